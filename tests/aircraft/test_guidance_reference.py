from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from aircraft.guidance.l1 import follow_circle
from tests.aircraft import guidance_reference
from tests.aircraft.guidance_reference import circle_columns, compared, main

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
    row["ambiguous"] = 0
    return row | circle_columns(row)


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


def test_columns_may_stand_in_any_order(tmp_path: Path) -> None:
    write(tmp_path, [dict(reversed(a_circle().items()))])
    assert main([str(tmp_path)]) == 0


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda table: table.drop_columns(["radius"]), "has no column radius"),
        (lambda table: table.drop_columns(["lat_acc"]), "has no column lat_acc"),
        (lambda table: table.slice(0, 0), "has no rows"),
        (lambda table: with_yaw(table, pa.array([None], pa.float64())), "column yaw must have a number"),
        (lambda table: with_yaw(table, pa.array(["north"])), "column yaw must have a number"),
    ],
)
def test_data_of_another_format_are_refused_in_a_line(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    change: Callable[[pa.Table], pa.Table],
    said: str,
) -> None:
    path = tmp_path / "l1_loiter_states.parquet"
    pq.write_table(change(pa.Table.from_pylist([a_circle()])), path)
    assert main([str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"{path}: {said}")
    assert error.count("\n") == 1


def with_yaw(table: pa.Table, column: pa.Array) -> pa.Table:
    return table.set_column(table.column_names.index("yaw"), "yaw", column)


def test_a_file_that_is_not_parquet_is_refused_in_a_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "l1_loiter_states.parquet").write_text("pos_n,pos_e\r\n1,2\r\n\r\n")
    assert main([str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert "cannot be read as parquet" in error
    assert error.count("\n") == 1


@needs_reference
def test_a_few_rows_of_a_few_runs_are_replayed(tmp_path: Path) -> None:
    runs = pq.read_table(REFERENCE / "l1_runs.parquet").slice(3, 1)
    (number,) = runs["run"].to_pylist()
    rows = pq.read_table(REFERENCE / "l1_tracks.parquet", filters=[("run", "=", number)]).slice(40, 30)
    pq.write_table(runs.select(runs.column_names[::-1]), tmp_path / "l1_runs.parquet")
    pq.write_table(rows, tmp_path / "l1_tracks.parquet")
    assert main([str(tmp_path)]) == 0


@needs_reference
def test_tracks_need_their_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = pq.read_table(REFERENCE / "npfg_tracks.parquet").slice(0, 2)
    pq.write_table(rows, tmp_path / "npfg_tracks.parquet")
    assert main([str(tmp_path)]) == 2
    assert "npfg_runs.parquet: cannot be read as parquet" in capsys.readouterr().err
    runs = pq.read_table(REFERENCE / "npfg_runs.parquet").slice(5, 3)
    pq.write_table(runs, tmp_path / "npfg_runs.parquet")
    assert main([str(tmp_path)]) == 2
    assert "which npfg_runs.parquet has not" in capsys.readouterr().err


def test_it_is_the_law_that_is_compared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    row = a_circle()
    row["crosstrack"] = 10.0
    write(tmp_path, [row])

    def other(*arguments: object) -> object:
        output, memory = follow_circle(*arguments)  # type: ignore[arg-type]
        return output._replace(crosstrack_m=11.0), memory

    monkeypatch.setattr(guidance_reference, "follow_circle", other)
    assert main([str(tmp_path)]) == 1
