"""What a flight shows of its planner beside the outcome, flown with planners that do one thing wrong."""

import math
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

import wayproof
from harness.cli.app import main
from wayproof import Path as PlannedPath
from wayproof import Plan, PlanRequest, PlanStatus

KEPT = Plan(PlanStatus.KEPT, "it is kept")


def turn(request: PlanRequest, curvature_1pm: float, length_m: float) -> Plan:
    """An arc from where the aircraft is, in its direction."""
    place = np.array(request.position_m)
    rows = np.array([[*place, *request.direction, curvature_1pm, length_m]])
    return Plan(PlanStatus.FOUND, "an arc", np.array([place, place + 1.0]), PlannedPath(rows))


class EndsOnTheWay:
    """Its only plan leads 300 m ahead."""

    def plan(self, request: PlanRequest) -> Plan:
        return KEPT if request.flown else turn(request, 0.0, 300.0)


class EndsAtOnce:
    """Each of its plans leads a centimetre ahead."""

    def plan(self, request: PlanRequest) -> Plan:
        return turn(request, 0.0, 0.01)


class Slow:
    """Its only search takes 0.6 s of processor time, where scans come every 0.05 s and a plan is 0.5 s late."""

    def plan(self, request: PlanRequest) -> Plan:
        if not request.flown:
            begun_s = time.thread_time()
            while time.thread_time() < begun_s + 0.6:
                pass
        return KEPT if request.flown else turn(request, 0.0, 9000.0)


@dataclass
class Undecided:
    """Turns to one side for a second, then to the other."""

    sides: list[float] = field(default_factory=list)

    def plan(self, request: PlanRequest) -> Plan:
        self.sides.append(math.copysign(1.0, len(self.sides) % 4 - 1.5))
        return turn(request, self.sides[-1] / 120.0, 200.0)


@pytest.mark.parametrize(
    ("planner", "kind", "time_s", "text", "trackable"),
    [
        # 300 m at 25 m/s and a second
        (EndsOnTheWay(), "plan ended", 13.0, "beyond the end of its plan", False),
        # Half a second beyond each plan: a second is allowed in all, and 4 m.
        (EndsAtOnce(), "plan ended", 1.2, "beyond the ends of plans within 5 s", False),
        (Slow(), "planner slower than the scans", 0.0, "took longer than 500 ms", True),
        # One turn to the other side a second.
        (Undecided(), "plans contradict each other", 1.0, "59.0 bank reversals a minute", True),
    ],
)
def test_what_a_planner_does_wrong_is_told(
    planner: EndsOnTheWay | EndsAtOnce | Slow | Undecided,
    kind: str,
    time_s: float,
    text: str,
    trackable: bool,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    empty = {"obstacles": [], "mission.time_limit_s": 60.0, "simulation.rate_hz": 60}
    empty |= {"sensor.rate_hz": 20, "planner.compute_latency_s": 0.5} if isinstance(planner, Slow) else {}
    scenario = wayproof.load_scenario("aerosonde_forest").with_(empty)
    run = wayproof.fly(scenario, planner=planner, out=tmp_path / "run")
    (found,) = run.metrics.findings
    assert found["kind"] == kind
    assert found["time_s"] == pytest.approx(time_s, abs=1.5)
    assert text in found["text"]
    assert run.metrics.trackable is trackable
    assert main(["report", str(tmp_path / "run")]) == 0
    page = (tmp_path / "run" / "report.html").read_text()
    assert kind in page
    assert found["text"] in page


def test_ordinary_plans_are_no_finding() -> None:
    run = wayproof.fly("aerosonde_forest")
    assert run.metrics.findings == ()
    assert run.metrics.plan_contradictions == 0
