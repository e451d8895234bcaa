"""The log of events that a run folder keeps as text."""

import csv
from pathlib import Path

import pytest

import wayproof
from wayproof import InputError, Mission, Plan, PlanRequest, PlanStatus


class Refusing:
    """Never has a plan, and says why in letters that a terminal would obey."""

    def __init__(self, mission: Mission) -> None:
        self.goal_m = mission.goal_m

    def plan(self, request: PlanRequest) -> Plan:
        return Plan(PlanStatus.NO_PATH, "no way,\x1b[2J at all")


def test_each_plan_is_an_event_with_its_reason(tmp_path: Path) -> None:
    scenario = wayproof.load_scenario("aerosonde_forest").with_({"mission.time_limit_s": 20})
    plans = wayproof.fly(scenario, out=tmp_path / "run").plans
    told = (tmp_path / "run" / "events.csv").read_text()
    assert plans.num_rows > 0
    for index, reason in zip(plans["plan_index"].to_pylist(), plans["reason"].to_pylist(), strict=True):
        assert f"plan {index}: {reason}" in told.replace('"', "")


def test_a_folder_has_its_events_as_text(tmp_path: Path) -> None:
    scenario = wayproof.load_scenario("aerosonde_forest").with_({"mission.time_limit_s": 5})
    run = wayproof.fly(scenario, planner=Refusing, out=tmp_path / "run")
    with (tmp_path / "run" / "events.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["level"] for row in rows] == ["warning", "warning"]
    assert rows[0] == {"time_s": "0", "level": "warning", "text": "no way,\\x1b[2J at all"}
    assert (float(rows[1]["time_s"]), rows[1]["text"].partition(":")[0]) == (5.0, run.outcome)
    (tmp_path / "run" / "events.csv").write_text("time_s,level,text\n")
    with pytest.raises(InputError, match="its sha256 is not that in manifest"):
        wayproof.load_run(tmp_path / "run")
