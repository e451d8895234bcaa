"""npfg and L1 against what the original sources gave at single states, their memory included, and in closed loops.

The data (shared/guidance/README.md) are not part of wayproof.
"""

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from tests.aircraft.guidance_reference import STATES, TOLERANCE, largest, main

REFERENCE = Path(__file__).parents[2].parent / "shared" / "guidance"

pytestmark = pytest.mark.skipif(not REFERENCE.is_dir(), reason="no shared/guidance beside the checkout")


@pytest.mark.parametrize("name", [*STATES, "npfg_tracks", "l1_tracks"])
def test_laws_decide_as_the_original_sources_do(name: str) -> None:
    worst = largest(REFERENCE, name, every=12)
    assert len(worst) >= 4
    assert {column: far for column, far in worst.items() if not far <= TOLERANCE} == {}


def test_a_folder_is_judged_column_by_column(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(tmp_path) == 2
    table = pq.read_table(REFERENCE / "l1_loiter_states.parquet").slice(0, 40)
    for name, status in (("lat_acc", 0), ("crosstrack", 1)):
        table = table.set_column(table.column_names.index("lat_acc"), "lat_acc", table[name])
        pq.write_table(table, tmp_path / "l1_loiter_states.parquet")
        assert main(tmp_path) == status
    assert capsys.readouterr().out.splitlines()[-1] == "1 above 1e-06"
