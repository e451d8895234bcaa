"""Flights of aircraft that do not know their state exactly."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from aircraft.guidance.progress import RouteProgress
from harness.analysis.metrics import metrics
from harness.cli.flight_rows import flight_rows
from harness.flight.closed_loop import Loop, fly
from harness.flight.navigation import StateEstimator
from harness.flight.observer import Caution, Observer
from harness.flight.record import BELIEVED_FIELDS, TRACK_FIELDS, Flight, Outcome, digest
from harness.run.scenario_flight import flight_limits, fly_to_folder, make_loop
from harness.run_files.run_folder import load_run, tables
from harness.scenario.scenario import parse_scenario
from tests.closed_loop.small import small_world
from tests.harness.recording.test_rerun_log import numbers, read, texts
from tests.point_mass import PointMass
from tests.scenarios import scenario_of
from wayproof import AircraftState, Plan, PlanRequest, Route, Scenario, dump_scenario, load_scenario

TREE = {"circle": {"center_m": [3000.0, 3000.0], "radius_m": 300.0}}
GNSS = {"kind": "gnss", "outages_s": [[40.0, 100.0]]}


def flown(scenario: Scenario) -> Flight:
    return fly(make_loop(scenario, PointMass))


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return small_world(TREE, navigation=GNSS)


@pytest.fixture(scope="module")
def flight(scenario: Scenario) -> Flight:
    return flown(scenario)


def test_perfect_navigation_changes_no_bit() -> None:
    scenario = small_world(TREE)
    without = replace(make_loop(scenario, PointMass), navigator=StateEstimator())
    flight = fly(make_loop(scenario, PointMass))
    assert digest(flight.track) == digest(fly(without).track)
    assert not flight.track.has_beliefs
    figures = metrics(flight, flight_limits(scenario))
    assert not {"navigation_error_m", "navigation_margin_m"} & set(figures)
    off_m = np.abs(flight.track.cross_track_m[flight.track.plan_index >= 0])
    rms, p95 = np.sqrt(np.nanmean(off_m**2)), np.nanpercentile(off_m, 95)
    by_hand = {"rms": rms, "p95": p95, "max": np.nanmax(off_m)}
    for error in ("total_system_error_m", "flight_technical_error_m"):
        assert figures[error] == pytest.approx(by_hand), "believed is true"


def test_truth_and_belief_are_in_the_track(flight: Flight) -> None:
    track = flight.track
    assert flight.outcome is Outcome.REACHED, flight.reason
    assert track.has_beliefs
    off = track.navigation_error_m
    assert 0.0 < off[0] < 30.0
    in_outage = (track.time_s >= 40.0) & (track.time_s < 100.0)
    grown = off[in_outage][-1]
    assert grown > 0.03 * 25.0 * 60.0 - 30.0  # drift_share of the distance, about
    assert off[np.flatnonzero(in_outage)[-1] + 1] < grown - 10.0  # and back with a jump
    # Guidance keeps to the plan where it believes to be; the true aircraft is off by the error.
    progress = RouteProgress(Route(flight.plans[0].segments, flight.plans[0].loiter))
    for row in np.flatnonzero(track.plan_index == flight.plans[0].plan_index)[1:20].tolist():
        true = progress.nearest(float(track.east_m[row]), float(track.north_m[row])).cross_track_m
        assert track.cross_track_m[row] == pytest.approx(true, abs=1e-6)
    assert np.nanmedian(np.abs(track.believed_cross_track_m)) < np.nanmedian(np.abs(track.cross_track_m))


def test_metrics_have_the_error_and_its_cause(scenario: Scenario, flight: Flight) -> None:
    figures = metrics(flight, flight_limits(scenario))
    off = flight.track.navigation_error_m
    assert figures["navigation_error_m"]["max"] == pytest.approx(off.max())
    assert figures["navigation_margin_m"] == scenario.navigation.margin_m
    assert 10.0 < figures["navigation_jump_m"] < off.max() + 10.0  # back from the drift of the outage
    tight = replace(flight_limits(scenario), max_cross_track_m=2.0, navigation_margin_m=0.0)
    assert next(leg["cause"] for leg in metrics(flight, tight)["trackability"]) == "navigation error"
    both = replace(flight.track, believed_cross_track_m=flight.track.cross_track_m)
    told = [leg["cause"] for leg in metrics(replace(flight, track=both), tight)["trackability"]]
    assert "navigation error" not in told  # guidance was off as well


@pytest.mark.parametrize("keys", [{}, {"planner.clearance_m": None, "obstacles": []}])
def test_a_law_that_needs_wider_turns_widens_no_limit(keys: dict[str, Any]) -> None:
    """Planners keep 39.7 m under it where they keep 31.6 under `preview`; a margin that was set counts whole."""
    rough = load_scenario("aerosonde_forest").with_({"conditions": "rough", **keys})
    other = rough.with_({"guidance.kind": "vector_field"})
    assert rough.navigation.margin_m < other.navigation.margin_m
    for each in (rough, other, parse_scenario(dump_scenario(other), "as flown")):
        assert flight_limits(each).navigation_margin_m == rough.navigation.margin_m
    assert flight_limits(other.with_({"navigation.margin_m": 20})).navigation_margin_m == 20.0


class Jumping(StateEstimator):
    """Believes to be 80 m to the east, until a fix comes at 30 s."""

    def believed(self, state: AircraftState) -> AircraftState:
        if state.time_s >= 30.0:
            self.jumps = 1
            return state
        return state._replace(east_m=state.east_m + 80.0)


class Told(Observer):
    """Notes the events that tell of fixes."""

    def __init__(self) -> None:
        self.of_fixes: list[tuple[float, str, bool]] = []

    def on_event(self, time_s: float, text: str) -> None:
        if "fix" in text:
            self.of_fixes.append((round(time_s, 3), text.partition(":")[0], isinstance(text, Caution)))


LOST, FOUND = ("no fix any more", True), ("a fix again", True)


@pytest.mark.parametrize(
    ("navigation", "told"),
    [
        ({"kind": "gnss"}, []),
        (
            {"kind": "gnss", "outages_s": [[40.0, 60.0], [70.0, 80.0], [90.0, 1e4]]},
            [(40.0, *LOST), (60.0, *FOUND), (70.0, *LOST), (80.0, *FOUND), (90.0, *LOST)],
        ),
        # From one outage into the next between two looks at the state: the fix in between is told of too.
        (
            {"kind": "gnss", "outages_s": [[40.0, 60.01], [60.02, 70.0]]},
            [(40.0, *LOST), (60.1, *FOUND), (60.1, *LOST), (70.0, *FOUND)],
        ),
        ({"kind": "dead_reckoning"}, [(0.0, "no fix at the start", False)]),
    ],
)
def test_events_say_when_a_fix_is_lost_and_when_it_is_back(
    navigation: dict[str, Any], told: list[tuple[float, str, bool]]
) -> None:
    scenario = small_world(TREE, navigation=navigation)
    events = Told()
    assert digest(fly(make_loop(scenario, PointMass), [events]).track) == digest(flown(scenario).track)
    assert events.of_fixes == told


class Watched:
    """A planner that notes what the map shows it."""

    def __init__(self, planner: object) -> None:
        self._plan = planner.plan  # type: ignore[attr-defined]
        self.seen: list[tuple[float, np.ndarray]] = []

    def plan(self, request: PlanRequest) -> Plan:
        self.seen.append((request.time_s, request.seen.edges_since(-1).copy()))
        return self._plan(request)  # type: ignore[no-any-return]


def test_after_a_jump_the_plan_is_checked_against_the_shifted_world() -> None:
    loop = make_loop(small_world(TREE, sensor={"latency_s": 1.2}), PointMass)
    watched = Watched(loop.planner)
    flight = fly(replace(loop, planner=watched, navigator=Jumping()))
    assert flight.outcome is Outcome.REACHED, flight.reason
    before = [edges for time_s, edges in watched.seen if time_s < 30.0][-1]
    assert np.hypot(*(before - (3080.0, 3000.0)).T) == pytest.approx(300.0, abs=5.0)
    later = [edges for time_s, edges in watched.seen if time_s >= 30.0]
    assert len(later) > 100
    for edges in later:  # nothing of what was entered from elsewhere
        assert np.hypot(*(edges - (3000.0, 3000.0)).T) == pytest.approx(300.0, abs=5.0)


@pytest.mark.flights
def test_run_folder_and_recording_have_truth_and_belief(scenario: Scenario, flight: Flight, tmp_path: Path) -> None:
    def make(given: Scenario) -> Loop:
        return make_loop(given, PointMass)

    figures = fly_to_folder(scenario, tmp_path / "run", recording=True, make=make)
    table, _ = tables(tmp_path / "run")
    assert tuple(table.column_names) == (*TRACK_FIELDS, *BELIEVED_FIELDS)
    run = load_run(tmp_path / "run")
    assert digest(run.track) == digest(flight.track) == figures["digest"]
    for name in BELIEVED_FIELDS:
        np.testing.assert_array_equal(getattr(run.track, name), getattr(flight.track, name))
    assert digest(flown(scenario_of(run.scenario_yaml)).track) == digest(flight.track)
    assert "navigation margin that was planned" in flight_rows(figures)["total system error"]
    assert "  navigation error" in flight_rows(figures)
    shown = read(tmp_path / "run" / "flight.rrd")
    assert {"/plan/believed", "/world/believed", "/series/navigation_error/flown"} <= shown.keys()
    assert "; thin, the track as the aircraft believed it;" in texts(shown, "/colours")[0]
    believed, true = (abs(numbers(shown, f"/world/{each}", "radii")).max() for each in ("believed", "flown"))
    assert believed < 0.5 * true, "so that it does not hide the flown track"
