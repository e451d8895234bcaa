from __future__ import annotations

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from aircraft.guidance.l1 import follow_circle
from tests.aircraft import guidance_reference
from tests.aircraft.guidance_reference import compared, main

REFERENCE = Path(__file__).parents[2].parent / "shared" / "guidance"
FILES = ("npfg_states", "l1_waypoint_states", "l1_loiter_states", "npfg_tracks", "l1_tracks")

needs_reference = pytest.mark.skipif(not REFERENCE.is_dir(), reason="no shared/guidance beside the checkout")


@needs_reference
def test_npfg_and_l1_fly_as_the_original_sources_do() -> None:
    found = dict(compared(REFERENCE, every=12))
    assert tuple(found) == FILES
    beyond = [(name, *key) for name, worst in found.items() for key, one in worst.items() if not one.kept]
    assert beyond == []


def a_circle() -> dict[str, float]:
    """A row on a circle of 100 m at 20 m/s, 10 m outside, along it."""
    row = {"pos_n": 110.0, "pos_e": 0.0, "vg_n": 0.0, "vg_e": 20.0, "yaw": 1.5707963, "yaw_cd": 9000}
    row |= {"centre_n": 0.0, "centre_e": 0.0, "radius": 100.0, "direction": 1, "last_nu_in": 0.0, "set": 0}
    row |= {
        "p_period": 17.0,
        "p_damping": 0.75,
        "p_lim_bank": 0.0,
        "p_tecs_target_airspeed": 0.0,
        "eas2tas": 1.0,
    }
    return row | {"ambiguous": 0}


def write(folder: Path, rows: list[dict[str, float]]) -> None:
    pq.write_table(pa.Table.from_pylist(rows), folder / "l1_loiter_states.parquet")


def test_a_folder_with_one_file_is_compared(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    row = a_circle()
    # The law on a circle: omega^2 times the error, and the centripetal acceleration.
    omega = 6.2832 / 17.0
    row["lat_acc"] = omega * omega * 10.0 + 400.0 / 110.0
    write(tmp_path, [row])
    assert main([str(tmp_path)]) == 0
    assert "lat_acc" in capsys.readouterr().out


def test_a_difference_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    row = a_circle()
    row["l1_dist"] = 0.3183099 * 0.75 * 17.0 * 20.0 * (1.0 + 3e-6)
    write(tmp_path, [row])
    assert main([str(tmp_path)]) == 1
    assert "BEYOND" in capsys.readouterr().out


def test_ambiguous_rows_are_left_out(tmp_path: Path) -> None:
    row = a_circle()
    write(tmp_path, [row | {"crosstrack": 10.0}, row | {"crosstrack": 99.0, "ambiguous": 1}])
    assert main([str(tmp_path)]) == 0


def test_no_reference_data_is_bad_usage(tmp_path: Path) -> None:
    assert main([str(tmp_path)]) == 2
    assert main([]) == 2


def test_it_is_the_law_that_is_compared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    row = a_circle()
    row["crosstrack"] = 10.0
    write(tmp_path, [row])

    def other(*arguments: object) -> object:
        output, memory = follow_circle(*arguments)  # type: ignore[arg-type]
        return output._replace(crosstrack_m=11.0), memory

    monkeypatch.setattr(guidance_reference, "follow_circle", other)
    assert main([str(tmp_path)]) == 1
