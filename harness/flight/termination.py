"""When and how a flight is over, judged by the true state and world."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

from aircraft.interface import AircraftState
from harness.flight.record import Outcome
from harness.world.ground import Ground, Position
from harness.world.world import Fix, World
from planner.interface import Mission

LONGEST_UNCHECKED_S = 5.0
"""Contact is checked at least this often, and sooner where an obstacle could be reached sooner."""


class Ending(NamedTuple):
    """How a flight ended."""

    outcome: Outcome
    reason: str  # one sentence


class Termination(Protocol):
    """Decides when and how a flight is over, from the true state. One object serves one flight."""

    contact_m: float  # clearance at a contact between the last two rows of the track; +inf without

    def to_go_m(self, state: AircraftState) -> float:
        """Returns the distance (m) that is left to the end of the flight."""
        ...

    def verdict(self, state: AircraftState, fault: str | None) -> Ending | None:
        """Returns how a flight ends at a true state or by lost control (`fault`: how); None while it goes on."""
        ...


class MissionEnd:
    """Ends a flight to a goal: reached, contact, bounds, time limit (simulated). Implements `Termination`."""

    def __init__(self, world: World, mission: Mission, time_limit_s: float) -> None:
        self._world, self._mission, self._time_limit_s = world, mission, time_limit_s
        self._next_look_s = 0.0  # until then nothing but a fault can end the flight
        self._appears_s = -math.inf
        # At the last look at the obstacles: where, when, and how much clearance.
        self._measured = (0.0, 0.0, 0.0, 0.0)
        self._above_before: Position | None = None  # position at the last look at the ground
        self._looked: tuple[Fix, float] | None = None  # position and sure clearance at the last look of all
        self._place: complex | None = None  # then: east + i north
        self.contact_m = math.inf

    def to_go_m(self, state: AircraftState) -> float:
        """Straight distance to the goal."""
        east, north = self._mission.goal_m
        return math.hypot(state.east_m - east, state.north_m - north)

    def verdict(self, state: AircraftState, fault: str | None) -> Ending | None:
        """Returns how the flight ends now; None while it goes on. Only a fault is looked for before more can happen."""
        if fault is not None:
            return Ending(Outcome.LOST_CONTROL, fault)
        if state.time_s < self._next_look_s:
            return None
        world, mission = self._world, self._mission
        east, north = state.east_m, state.north_m
        clearance = self._surely_clear_m(east, north, state.time_s)
        if touched := self._contact(state, clearance):
            return Ending(Outcome.COLLISION, touched)
        passed = self._passed_goal(complex(east, north))
        if not passed and not world.inside_bounds(east, north):
            return Ending(Outcome.OUT_OF_BOUNDS, f"left the area at ({east:z.0f}, {north:z.0f}) m")
        to_go = self.to_go_m(state)
        if passed or to_go <= mission.goal_radius_m:
            return Ending(Outcome.REACHED, f"inside the goal circle after {state.time_s:.0f} s")
        if state.time_s >= self._time_limit_s:
            return Ending(Outcome.TIMEOUT, f"time limit {self._time_limit_s:g} s, {to_go:.0f} m from the goal")
        xmin, ymin, xmax, ymax = world.bounds_m
        room = min(to_go - mission.goal_radius_m, east - xmin, north - ymin, xmax - east, ymax - north)
        # Whatever it turns to: the wind is no faster than both speeds together.
        fastest = state.groundspeed_mps + 2.0 * state.airspeed_mps
        wait = min(clearance / (fastest + world.max_obstacle_speed_mps), room / fastest, LONGEST_UNCHECKED_S)
        if world.ground is not None:
            wait = min(wait, world.ground.reach_m((east, north, state.up_m)) / (fastest + state.airspeed_mps))
        if self._appears_s <= state.time_s:
            self._appears_s = world.next_appearance(state.time_s)
        self._next_look_s = min(state.time_s + wait, self._appears_s, self._time_limit_s)
        return None

    def _passed_goal(self, here: complex) -> bool:
        """Tells whether the way since the last look was in the goal circle, inside the area, before it ends."""
        before, self._place = self._place, here
        if before is None or before == here:
            return False
        goal, way = complex(*self._mission.goal_m), here - before
        share = min(max(((goal - before) / way).real, 0.0), 1.0)
        nearest = before + share * way
        in_circle = share < 1.0 and abs(nearest - goal) <= self._mission.goal_radius_m
        return in_circle and self._world.inside_bounds(nearest.real, nearest.imag)

    def _contact(self, state: AircraftState, clearance_m: float) -> str:
        """A sentence if the aircraft touches something, or did since the last look; else empty."""
        if clearance_m < 0.0:
            return f"inside an obstacle by {-clearance_m:.2g} m"
        if self.contact_m < 0.0:
            return "touched an obstacle between two steps"
        return "" if self._world.ground is None else self._ground_hit(self._world.ground, state)

    def _ground_hit(self, ground: Ground, state: AircraftState) -> str:
        """Returns a sentence if the aircraft is below the ground, or was since the last look; else empty."""
        here = state.east_m, state.north_m, state.up_m
        before, self._above_before = self._above_before, here
        if (above_m := ground.above_m(here)) <= 0.0:
            return f"flew into the terrain: {-above_m:.1f} m below the ground at {here[2] - above_m:.0f} m"
        if before is not None and ground.contact_between(before, here):
            return "flew into the terrain between two steps"
        return ""

    def _surely_clear_m(self, east: float, north: float, time_s: float) -> float:
        """Returns the true clearance, or what surely remains of the last one while that is more than a quarter."""
        world, here = self._world, (east, north, time_s)
        there_east, there_north, then_s, clearance = self._measured
        lost = math.hypot(east - there_east, north - there_north)
        lost += world.max_obstacle_speed_mps * (time_s - then_s)
        if lost < 0.75 * clearance and time_s < self._appears_s:
            self._looked = here, clearance - lost
            return clearance - lost
        clearance = world.clearance_at(east, north, time_s)
        if self._looked is not None:
            self.contact_m = world.contact_between(*self._looked, here, clearance)
        self._measured, self._looked = (*here, clearance), (here, clearance)
        return clearance
