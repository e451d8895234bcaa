"""The environment `wayproof/Waypoints-v0`; README.md beside it says what is observed, the reward, and the ends."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from aircraft.guidance.interface import UPDATE_RATE_HZ
from aircraft.interface import AircraftState
from harness.flight.observer import Observer
from harness.flight.record import Outcome, digest
from harness.flight.stepped import Status, SteppedLoop
from harness.learning.pilots import Episode, WaypointPilot
from harness.mapping.scan import RangeScan
from harness.run.scenario_flight import make_loop
from harness.scenario.kinds import PLANNER, registered
from harness.scenario.parts import limits_of
from harness.scenario.performance import mission_of
from harness.scenario.scenario import Scenario, load_scenario
from planner.interface import Mission

Observation = dict[str, NDArray[Any]]
Action = NDArray[Any]
Floats = NDArray[np.float32]

DEFAULT_BEAMS: Final = 72  # an observation has at most this many beams where nothing else is asked for
BAD_OUTCOMES: Final = (Outcome.COLLISION, Outcome.OUT_OF_BOUNDS, Outcome.LOST_CONTROL)  # cost 1 of reward
STATE: Final = (
    "goal distance over the diagonal of the area",
    "cosine of the goal's bearing from the course",
    "sine of it, positive to the right",
    "east over the width of the area, from its western bound",
    "north over the height of the area, from its southern bound",
    "cosine of the course",
    "sine of the course",
    "bank over the bank limit, positive to the right",
    "ground speed over twice the airspeed of the mission",
)
"""What each number of the observation's `state` is, in order."""
STATE_LOW: Final = np.array([0, -1, -1, 0, 0, -1, -1, -1, 0], dtype=np.float32)  # of `state`
STATE_HIGH: Final = np.ones(len(STATE), dtype=np.float32)  # largest value of each number of `state`


class WaypointsEnv(gymnasium.Env[Observation, Action]):
    """`wayproof/Waypoints-v0`, a scenario's flight of which an action is the next waypoint.

    Action: (2,) how far the waypoint lies to the right of the course and ahead of the aircraft, over the sensing range,
    each from -1 to 1. From the next scan on the aircraft turns onto the line to it, and flies straight on beyond.

    The first interval after a reset is flown straight ahead, so that there is a scan to be observed.

    Args:
        scenario: a scenario, its file, or the name of one that comes with wayproof; InputError if it cannot be used.
        step_s: simulated time of a step: a multiple of the interval between two updates of guidance (0.1 s).
        beams: how many beams of the scan are observed, each the least of neighbouring ones; default: all, at most 72.
    """

    def __init__(
        self,
        scenario: Scenario | str | Path,
        step_s: float = 1.0,
        beams: int | None = None,
        render_mode: None = None,  # asked for by gymnasium's makers of several environments
    ) -> None:
        own = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
        self._own = self._flown = own
        self._updates = round(step_s * UPDATE_RATE_HZ) if math.isfinite(step_s) else 0
        if self._updates < 1 or abs(self._updates - step_s * UPDATE_RATE_HZ) > 1e-9:
            raise ValueError(f"step_s is {step_s:g}; must be a multiple of {1.0 / UPDATE_RATE_HZ:g} s")
        rays, scan_s = own.sensor.rays, 1.0 / own.sensor.rate_hz
        self._beams = min(rays, DEFAULT_BEAMS) if beams is None else beams
        if not 1 <= self._beams <= rays:
            raise ValueError(f"beams is {beams}; must be from 1 to the {rays} rays of the scenario's sensor")
        self._mission = replace(mission_of(own), bounds_m=own.area.bounds_m)
        self._bank_limit_rad = limits_of(own.aircraft).bank_limit_rad
        if self._updates * own.sensor.rate_hz < UPDATE_RATE_HZ:
            raise ValueError(f"step_s is below the {scan_s:g} s between scans: actions would be passed over")
        self._pilot = WaypointPilot(self._mission)
        self._scans = ScanKeeper()
        self._loop: SteppedLoop | None = None
        self._seeded, self._to_go_m = False, math.nan
        scan = spaces.Box(0.0, 1.0, (self._beams,), np.float32)
        observed: Any = spaces.Dict(scan=scan, state=spaces.Box(STATE_LOW, STATE_HIGH, dtype=np.float32))
        self.observation_space = observed
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begins an episode; without a seed with the scenario's, or one drawn by the generator that a seed began."""
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(2**31)) if self._seeded and seed is None else seed
        self._seeded |= seed is not None
        self._flown = self._own if drawn is None else self._own.with_({"seed": drawn})
        self._scans = ScanKeeper()
        self._pilot = WaypointPilot(mission_of(self._flown))
        steered = self._flown.with_({"planner.kind": registered(self._pilot, PLANNER)})
        self._loop = SteppedLoop(lambda: make_loop(steered), [self._scans])
        status = self._advance(self._loop.reset())
        self._to_go_m = status.to_go_m
        return self._observe(status), self._info(status)

    def step(self, action: Action) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Flies on for a step; after the end nothing more is flown. ValueError: the action is none."""
        if self._loop is None:
            raise RuntimeError("reset() before step(): no episode has begun")
        before = self._loop.status
        given = np.asarray(action, dtype=np.float64)
        if given.shape != (2,) or not (np.abs(given) <= 1.0).all():
            raise ValueError(f"action is {action!r}; must be 2 numbers from -1 to 1")
        right_m, ahead_m = (self._mission.sensor_range_m * given).tolist()
        believed = before.believed
        sine, cosine = math.sin(believed.course_rad), math.cos(believed.course_rad)
        self._pilot.target_m = (
            believed.east_m + ahead_m * sine + right_m * cosine,
            believed.north_m + ahead_m * cosine - right_m * sine,
        )
        status = self._advance(before)
        whole_m = math.dist(self._own.mission.start_m, self._own.mission.goal_m)
        reward = (self._to_go_m - status.to_go_m) / whole_m
        self._to_go_m = status.to_go_m
        if not before.done:  # else it has been given
            reward += float(status.outcome is Outcome.REACHED) - float(status.outcome in BAD_OUTCOMES)
        truncated = status.outcome is Outcome.TIMEOUT
        return self._observe(status), reward, status.done and not truncated, truncated, self._info(status)

    @property
    def episode(self) -> Episode:
        """The episode flown so far, with which `wayproof.fly` flies it again."""
        return Episode(self._flown, tuple(self._pilot.noted))

    def _advance(self, status: Status) -> Status:
        assert self._loop is not None
        for _ in range(self._updates):
            if status.done:
                break
            status = self._loop.step()
        return status

    def _observe(self, status: Status) -> Observation:
        return {
            "scan": self._scans.ranges(status.time_s, self._beams),
            "state": state_of(status.believed, self._mission, self._bank_limit_rad),
        }

    def _info(self, status: Status) -> dict[str, Any]:
        """Time, distance to go and seed; at the end outcome, reason and digest of the flight."""
        info: dict[str, Any] = {"time_s": status.time_s, "to_go_m": status.to_go_m, "seed": self._flown.seed}
        if status.outcome is not None and self._loop is not None:
            track = self._loop.flight().track
            info |= {"outcome": status.outcome.value, "reason": status.reason, "digest": digest(track)}
        return info


class ScanKeeper(Observer):
    """An observer of the loop that keeps the last scan which has become available."""

    def __init__(self) -> None:
        self._coming: deque[RangeScan] = deque()
        self._last: RangeScan | None = None

    def on_scan(self, scan: RangeScan, state: AircraftState) -> None:
        """Keeps a scan."""
        self._coming.append(scan)

    def ranges(self, time_s: float, beams: int) -> Floats:
        """(beams,) the nearest return of neighbouring rays over the sensing range, clockwise; 1: there was none."""
        while self._coming and self._coming[0].available_s <= time_s + 1e-9:
            self._last = self._coming.popleft()
        if self._last is None:
            return np.ones(beams, dtype=np.float32)
        shares = np.minimum(self._last.ranges_m / self._last.max_range_m, 1.0)
        first = np.arange(beams) * len(shares) // beams
        return np.clip(np.minimum.reduceat(shares, first), 0.0, 1.0).astype(np.float32)


def state_of(state: AircraftState, mission: Mission, bank_limit_rad: float) -> Floats:
    """The numbers of `STATE`, of what the aircraft believes, cut to the observation's bounds."""
    xmin, ymin, xmax, ymax = mission.bounds_m
    east, north = mission.goal_m[0] - state.east_m, mission.goal_m[1] - state.north_m
    bearing = math.atan2(east, north) - state.course_rad
    values = (
        math.hypot(east, north) / math.hypot(xmax - xmin, ymax - ymin),
        math.cos(bearing),
        math.sin(bearing),
        (state.east_m - xmin) / (xmax - xmin),
        (state.north_m - ymin) / (ymax - ymin),
        math.cos(state.course_rad),
        math.sin(state.course_rad),
        state.roll_rad / bank_limit_rad,
        state.groundspeed_mps / (2.0 * mission.speed_mps),
    )
    return np.clip(np.array(values, dtype=np.float32), STATE_LOW, STATE_HIGH)
