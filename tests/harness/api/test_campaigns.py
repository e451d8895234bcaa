"""Many flights from Python."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

import wayproof
from tests.harness.api.worlds import SCENARIO, small, source_file
from tests.processes import python

CAMPAIGN = """
schema: wayproof/campaign/1
name: two
seed: 1
scenarios: [short.yaml]
planners: [bug2, vfh_plus]
"""


@pytest.mark.flights
def test_a_campaign_is_flown_and_read_back(tmp_path: Path) -> None:
    (tmp_path / "short.yaml").write_text(SCENARIO)
    (tmp_path / "two.yaml").write_text(CAMPAIGN)
    told: list[int] = []
    flown = wayproof.sweep(
        str(tmp_path / "two.yaml"),
        out=tmp_path / "out",
        workers=1,
        progress=lambda answer: told.append(answer.run),
    )
    assert sorted(told) == [0, 1]
    assert flown.outcomes == {"reached": 2}
    assert flown.table.num_rows == pq.read_table(tmp_path / "out" / "results.parquet").num_rows == 2
    assert (tmp_path / "out" / "summary.html").is_file()
    read = wayproof.load_campaign(tmp_path / "out")
    assert read.summary.total == flown.summary.total
    assert repr(read) == f"CampaignResult(2 runs: 2 reached; {tmp_path / 'out'})"
    with pytest.raises(wayproof.InputError, match="go on with --resume"):
        wayproof.sweep(tmp_path / "two.yaml", out=tmp_path / "out")
    with pytest.raises(wayproof.InputError, match="or fly it with sweep"):
        wayproof.load_campaign(tmp_path / "two.yaml")


@pytest.mark.flights
def test_planners_are_compared_and_one_of_them_comes_from_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    source = source_file(tmp_path)
    compared = wayproof.compare(small(), ["vfh_plus", f"{source}:Beeline"], out=tmp_path / "out", workers=1)
    assert compared.all_reached
    assert compared.table["planner"].to_pylist() == ["vfh_plus", "planner.py:Beeline"]
    assert len(repr(compared)) < 200
    index = json.loads((tmp_path / "out" / "comparison.json").read_text())
    assert index["command"].startswith("wayproof.compare(['short'], ['vfh_plus', 'planner.py:Beeline'])")


@pytest.mark.flights
def test_a_script_needs_no_guard(tmp_path: Path) -> None:
    (tmp_path / "short.yaml").write_text(SCENARIO)
    (tmp_path / "two.yaml").write_text(CAMPAIGN)
    (tmp_path / "script.py").write_text(
        "import wayproof\nprint('begun')\n"
        "print(wayproof.sweep('two.yaml', out='swept', workers=1).outcomes)\n"
        "print(wayproof.compare('short.yaml', ['bug2'], out='compared').all_reached)\n"
    )
    done = python("script.py", folder=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == ["begun", "{'reached': 2}", "True"]


def test_what_is_compared_is_named_in_a_list() -> None:
    with pytest.raises(wayproof.InputError, match="planners as a list of names"):
        wayproof.compare(small(), "rolling_window")
    with pytest.raises(wayproof.InputError, match="planners as a list of names"):
        wayproof.compare(small(), [])
    with pytest.raises(wayproof.InputError, match=r"is .no_planner.; must be"):
        wayproof.compare(small(), np.array(["rolling_window", "no_planner"]))  # type: ignore[arg-type]
    with pytest.raises(wayproof.InputError, match=r"guidance: .*no_file.py: no such file"):
        wayproof.compare(small(), ["rolling_window"], guidance=["no_file.py:LAW"])


@pytest.mark.parametrize("workers", [0, -1, 1.5, "2"])
def test_no_comparison_is_lost_to_one_that_cannot_be_flown(workers: Any, tmp_path: Path) -> None:
    (tmp_path / "comparison.json").write_text('{"schema": "wayproof/comparison/1", "complete": true, "rows": []}')
    (tmp_path / "comparison.csv").write_text("scenario,planner\n")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(wayproof.InputError, match="no scenario to fly"):
        wayproof.compare([], ["bug2"], out=tmp_path)
    with pytest.raises(wayproof.InputError, match=r"workers is .*; must be a whole number of at least 1"):
        wayproof.compare(small(), ["bug2"], out=tmp_path, workers=workers)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    (tmp_path / "two.yaml").write_text(CAMPAIGN)
    (tmp_path / "short.yaml").write_text(SCENARIO)
    with pytest.raises(wayproof.InputError, match="workers is"):
        wayproof.sweep(tmp_path / "two.yaml", out=tmp_path / "out", workers=workers)
