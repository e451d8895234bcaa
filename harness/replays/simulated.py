"""The mission of a flown flight, flown anew by the simulated aircraft in the wind of that day."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from aircraft.guidance.waypoints import WaypointLaw
from aircraft.interface import AircraftState
from harness.files.input_file import InputError
from harness.flight.closed_loop import Loop
from harness.flight.record import FloatArray, Outcome
from harness.flight.termination import Ending
from harness.replays.flown import FlownFlight
from harness.replays.mission import FlownMission
from harness.replays.wind import FittedWind
from harness.run.path_check import refuse_unused
from harness.run.path_flight import GivenPath
from harness.run.scenario_flight import FlownAs, fly_to_folder, make_loop
from harness.run_files.run_folder import load_run
from harness.scenario.navigation import Navigation
from harness.scenario.scenario import Scenario, scenario_of
from planner.interface import Path as PlannedPath

DEFAULT_LAW: Final = "bearing"  # of a simulated flight, with gain 1.5 and no switch by passing
LATENCY_S: Final = 0.2  # age of the state, ArduPilot's for an unknown receiver (AP_GPS_Backend::get_lag)
ZERO_SIGMAS: Final = tuple(name for name in Navigation.model_fields if "_sigma_" in name)  # set to 0
AREA_MARGIN_M: Final = 1000.0  # the area reaches this far beyond the flown track
LEAST_ALTITUDE_M: Final = 50.0  # lower heights of a log are not above the sea
UNKNOWN_ALTITUDE_M: Final = 300.0  # a log with heights below that is flown at this altitude
TIME_LIMIT_FACTOR: Final = 3.0  # the simulated flight may take this many times the flown time, and a minute
SIMULATED_COLUMNS: Final = ("time_s", "east_m", "north_m", "up_m", "roll_deg", "airspeed_mps")


@dataclass(frozen=True, eq=False)
class Task:
    """A flown flight and its mission, as the simulated aircraft is to fly it."""

    flight: FlownFlight
    mission: FlownMission
    first: int  # number of the corner that the flight was heading for at its first row
    winds: Sequence[FittedWind]  # as fitted, time rising from the first row
    airspeed_mps: float  # true, that was commanded
    height_m: float  # that was commanded, as `up_m` has it
    altitude_m: float  # above the sea, at which that is flown anew


class LapsEnd:
    """Ends a flight once all legs are flown, or the time is up. Implements `Termination`."""

    contact_m = math.inf

    def __init__(self, law: WaypointLaw, legs: int, limit_s: float) -> None:
        self._law, self._legs, self._limit_s, self._before_s = law, legs, limit_s, 0.0
        self.switches_s: list[float] = []  # times of the updates in which a corner was reached

    def to_go_m(self, state: AircraftState) -> float:
        """Returns NaN, as the distance that is left is not known."""
        return math.nan

    def verdict(self, state: AircraftState, fault: str | None) -> Ending | None:
        """Notes corners reached since the last call; returns how the flight ends now, None while it goes on."""
        self.switches_s += [self._before_s] * (max(self._law.leg, 0) - len(self.switches_s))
        self._before_s = state.time_s
        if fault is not None:
            return Ending(Outcome.LOST_CONTROL, fault)
        if state.time_s >= self._limit_s:
            return Ending(Outcome.TIMEOUT, f"not all corners after {state.time_s:.0f} s")
        if state.time_s > 0.0 and self._law.leg >= self._legs:
            return Ending(Outcome.REACHED, f"all corners flown to after {state.time_s:.0f} s")
        return None


def altitude_flown_m(flight: FlownFlight, mission: FlownMission, height_m: float, notes: list[str]) -> float:
    """Altitude above mean sea level at which a height of a log is flown anew, with a note if it is another."""
    base_m = mission.origin.altitude_m if mission.origin and not flight.in_degrees else 0.0
    if base_m + height_m >= LEAST_ALTITUDE_M:
        return base_m + height_m
    below = f"{base_m + height_m:.0f} m, which is below {LEAST_ALTITUDE_M:g} m above the sea"
    notes.append(f"altitude: the log's is {below}; flown anew at {UNKNOWN_ALTITUDE_M:g} m")
    return UNKNOWN_ALTITUDE_M


def scenario_for(task: Task, aircraft: str, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """Returns the flight as a scenario, some keys of it replaced; `InputError` if the aircraft cannot fly it."""
    refuse_unused(overrides, r"(sensor|planner|obstacles)\b(?!\.clearance_m$)|mission\.goal", "a replay")
    flight, mission, origin = task.flight, task.mission, task.mission.origin
    places = np.vstack((np.column_stack((flight["east_m"], flight["north_m"])), mission.corners_m))
    bounds = (*(places.min(axis=0) - AREA_MARGIN_M).tolist(), *(places.max(axis=0) + AREA_MARGIN_M).tolist())
    start, goal = places[0], mission.corners_m[task.first]
    far = max(float(np.hypot(*(goal - start))), 2.0)
    changes = [[wind.time_s, wind.speed_mps, wind.from_deg] for wind in task.winds if wind.time_s > 0.0]
    wind = {"speed_mps": task.winds[0].speed_mps, "from_deg": task.winds[0].from_deg, "changes": changes}
    place = {"origin": origin.model_dump(exclude={"altitude_m"})} if origin else {}
    keys: dict[str, Any] = {
        "schema": "wayproof/scenario/1",
        "name": "replay",
        "area": {"bounds_m": bounds, **place},
        "mission": {
            "start_m": start.tolist(),
            "course_deg": math.degrees(math.atan2(flight["ve_mps"][0], flight["vn_mps"][0])) % 360.0,
            "goal_m": goal.tolist() if far > 2.0 else [start[0], start[1] + 10.0],
            "goal_radius_m": min(0.5 * far, 10.0),
            "altitude_m": task.altitude_m,
            "time_limit_s": TIME_LIMIT_FACTOR * float(flight["time_s"][-1] - flight["time_s"][0]) + 60.0,
        },
        "aircraft": {
            "airspeed_mps": task.airspeed_mps,
            "autopilot": {"state_latency_s": 0.0, "bank_limit_deg": mission.bank_limit_deg},
        },
        "guidance": {"kind": DEFAULT_LAW, "follow": "waypoints", "acceptance_radius_m": mission.acceptance_m},
        "navigation": {"kind": "gnss", **dict.fromkeys(ZERO_SIGMAS, 0.0), "latency_s": LATENCY_S},
        "environment": {"wind": wind},
    }
    given = (("aircraft.model", json.dumps(aircraft)), *overrides)
    if (scenario := scenario_of(keys, given)).guidance.follow != "waypoints":
        raise InputError("command line: guidance.follow: is path; must be waypoints: corners are flown to")
    return scenario


def fly_anew(scenario: Scenario, task: Task, laps: int, folder: Path) -> dict[str, FloatArray]:
    """Flies the laps into a run folder; returns `SIMULATED_COLUMNS` of the track, and the number of the leg as `leg`.

    From where the log begins, and half way beyond the last corner: the end of a route is none. Raises as `replay` does.
    """
    corners = task.mission.corners_m
    order = (task.first + np.arange(laps * len(corners))) % len(corners)
    beyond = 0.5 * (corners[order[-1]] + corners[(order[-1] + 1) % len(corners)])
    points = np.vstack(((task.flight["east_m"][0], task.flight["north_m"][0]), corners[order], beyond))
    ways = np.diff(points, axis=0)
    length = np.hypot(*ways.T)
    lines = length > 1e-6
    points, ways, length = points[:-1][lines], ways[lines], length[lines]
    segments = np.column_stack((points, ways / length[:, None], np.zeros(len(length)), length))
    ends: list[LapsEnd] = []

    def make(scenario: Scenario) -> Loop:
        loop = make_loop(scenario)
        law = loop.guidance
        assert isinstance(law, WaypointLaw)
        ends.append(LapsEnd(law, len(segments) - 1, scenario.mission.time_limit_s or math.inf))
        planner = GivenPath(points, PlannedPath(segments))
        return replace(loop, sensor=None, planner=planner, termination=ends[-1])

    fly_to_folder(scenario, folder, recording=False, make=make, flown=FlownAs("replay"))
    track = load_run(folder).track
    columns = {name: np.asarray(getattr(track, name), dtype=np.float64) for name in SIMULATED_COLUMNS}
    columns["leg"] = np.searchsorted(ends[0].switches_s, columns["time_s"] + 1e-6).astype(np.float64)
    return columns
