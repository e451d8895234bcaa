"""What every guidance law must be: of the built-in ones, of the law that README shows, and of your own.

    from tests.contracts.test_guidance_contract import GuidanceContract

    class TestMine(GuidanceContract):
        kind = MY_KIND

is a whole test module: pytest collects what the class inherits. The law steers a point that rolls with a lag, turns as
its bank has it and drifts with the wind. What is asked of a law here is what the closed loop counts on, and that it
comes to its route and stays there; how near is for `aircraft.law_cards` to say.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable
from dataclasses import FrozenInstanceError, fields
from functools import partial
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar, NamedTuple

from aircraft.guidance.interface import UPDATE_RATE_HZ, GuidanceLaw
from aircraft.guidance.registry import BUILT_IN, GuidanceKind
from aircraft.interface import GRAVITY_MPS2
from tests.routes import route_of
from wayproof import AircraftState, GuidanceLimits, GuidanceOutput, Route

README = Path(__file__).parents[2] / "aircraft" / "README.md"
LIMITS = GuidanceLimits(25.0, 32.0, math.radians(45.0), math.radians(60.0), 0.25, 0.05, 1.4)
RADIUS_M = 150.0
CLOSE_M = 15.0  # a law is on its route if it is no further off: a tenth of the turn radius
WIND_MPS = 7.5


class Point(NamedTuple):
    """A point that turns as its bank has it. Headings are clockwise from north."""

    east_m: float = 0.0
    north_m: float = 0.0
    heading_rad: float = 0.0
    roll_rad: float = 0.0
    time_s: float = 0.0
    wind_east_mps: float = 0.0

    def state(self, airspeed_mps: float = LIMITS.airspeed_mps) -> AircraftState:
        east = airspeed_mps * math.sin(self.heading_rad) + self.wind_east_mps
        north, heading = airspeed_mps * math.cos(self.heading_rad), self.heading_rad % math.tau
        place = self.time_s, self.east_m, self.north_m, 300.0
        load = 1.0 / math.cos(self.roll_rad)
        return AircraftState(*place, east, north, 0.0, heading, self.roll_rad, 0.0, airspeed_mps, load)

    def moved(self, command_rad: float) -> Point:
        step_s, speed = 1.0 / UPDATE_RATE_HZ, LIMITS.airspeed_mps
        roll = command_rad + (self.roll_rad - command_rad) * math.exp(-step_s / LIMITS.roll_lag_s)
        turn = step_s * GRAVITY_MPS2 * math.tan(0.5 * (self.roll_rad + roll)) / speed
        middle = self.heading_rad + 0.5 * turn
        east = self.east_m + step_s * (speed * math.sin(middle) + self.wind_east_mps)
        north = self.north_m + step_s * speed * math.cos(middle)
        time_s = round(self.time_s + step_s, 6)
        return Point(east, north, self.heading_rad + turn, roll, time_s, self.wind_east_mps)


LINE = route_of((0.0, 20_000.0))
BEND = 1.0 / RADIUS_M
COURSE = route_of((0.0, 300.0), (-BEND, 200.0), (0.0, 400.0), (BEND, 350.0), (0.0, 400.0))
LOITER = route_of((0.0, 300.0), (-1.0 / RADIUS_M, math.tau * RADIUS_M), loiter=True)


def flown(law: GuidanceLaw, point: Point, seconds: float) -> list[tuple[AircraftState, GuidanceOutput]]:
    found = []
    for _ in range(round(seconds * UPDATE_RATE_HZ)):
        state = point.state()
        output = law.update(state)
        found.append((state, output))
        point = point.moved(output.roll_command_rad)
    return found


def _raises(error: type[Exception], action: Callable[[], object]) -> bool:
    try:
        action()
    except error:
        return True
    return False


class GuidanceContract:
    """Tests of one guidance law, the `kind` that a subclass sets."""

    kind: ClassVar[GuidanceKind]

    def law(self, route: Route = LINE, arc_length_m: float = 0.0) -> GuidanceLaw:
        law = self.kind.law(LIMITS)
        law.follow(route, arc_length_m)
        return law

    def test_its_config_is_frozen_described_and_resolves_to_itself(self) -> None:
        """Keys are documented, cannot be changed, and none is left to be derived; the kind has a summary."""
        assert len(self.kind.summary) > 20, "say in the summary what it is"
        config: Any = self.kind.config()
        for field in fields(config):
            assert field.metadata["doc"], field.name
            assert _raises(FrozenInstanceError, partial(setattr, config, field.name, None))
        resolved = config.resolved(LIMITS)
        assert all(getattr(resolved, field.name) is not None for field in fields(resolved))
        assert resolved.resolved(LIMITS) == resolved

    def test_asked_without_a_route_it_says_so(self) -> None:
        """RuntimeError, not a command from nothing."""
        assert _raises(RuntimeError, lambda: self.kind.law(LIMITS).update(Point().state()))

    def test_on_a_line_it_flies_straight_on(self) -> None:
        """On the route, along it, there is nothing to correct."""
        for _, output in flown(self.law(), Point(), 5.0):
            assert abs(output.roll_command_rad) < 1e-6
            assert abs(output.cross_track_m) < 1e-3

    def test_the_right_of_the_route_is_positive(self) -> None:
        """The cross-track error is positive to the right of the route, and the turn back is to the left."""
        for east in (40.0, -40.0):
            first, *_, last = flown(self.law(), Point(east, 100.0), 1.0)
            assert math.isclose(first[1].cross_track_m, east, abs_tol=1e-6)
            assert math.isclose(first[1].arc_length_m, 100.0, abs_tol=1e-6)
            assert last[1].roll_command_rad * east < 0.0

    def test_it_comes_to_its_route_in_calm_air_and_in_wind(self) -> None:
        """From 100 m beside it, in two minutes, and stays."""
        for wind in (0.0, WIND_MPS, -WIND_MPS):
            for east in (100.0, -100.0):
                *_, (_, last) = flown(self.law(), Point(east, 0.0, 0.3, wind_east_mps=wind), 120.0)
                assert abs(last.cross_track_m) < 0.1 * CLOSE_M, (wind, east)

    def test_it_flies_turns_to_both_sides(self) -> None:
        """A course of lines and arcs, up to its end and beyond."""
        for wind in (0.0, WIND_MPS):
            outputs = [output for _, output in flown(self.law(COURSE), Point(wind_east_mps=wind), 150.0)]
            assert max(abs(output.cross_track_m) for output in outputs if not output.past_end) < CLOSE_M
            assert outputs[-1].past_end
            assert not outputs[0].past_end

    def test_a_loiter_goes_on_for_ever(self) -> None:
        """Round after round, on the circle; the arc length grows on."""
        outputs = [output for _, output in flown(self.law(LOITER), Point(), 400.0)]
        assert not any(output.past_end for output in outputs)
        assert max(abs(output.cross_track_m) for output in outputs) < CLOSE_M
        assert outputs[-1].arc_length_m > 300.0 + 9.0 * math.tau * RADIUS_M

    def test_commands_stay_within_the_limits(self) -> None:
        """Wherever it is: no more bank than the limit, and a cut of the bank is told."""
        for east in (-3000.0, 0.0, 3000.0):
            for heading in (0.0, 2.0, math.pi, 4.5):
                for output in [output for _, output in flown(self.law(), Point(east, 0.0, heading), 20.0)]:
                    assert abs(output.roll_command_rad) <= LIMITS.bank_limit_rad + 1e-9

    def test_every_state_gets_a_finite_command(self) -> None:
        """Standing still over the ground, blown backwards, on the centre of an arc."""
        for route, east, north in ((LINE, 0.0, 0.0), (LINE, 50.0, 10.0), (LOITER, RADIUS_M, 300.0)):
            for heading in (0.0, 0.5 * math.pi, math.pi):
                for wind in (0.0, -25.0, 40.0):
                    point = Point(east, north, heading, wind_east_mps=wind)
                    for airspeed in (25.0, 1.0):
                        output = self.law(route).update(point.state(airspeed))
                        assert all(math.isfinite(value) for value in output[:3]), (point, airspeed)

    def test_two_laws_command_the_same_bit_for_bit(self) -> None:
        """No clock, no randomness of its own, nothing shared between flights."""
        first, second = self.law(COURSE), self.law(COURSE)
        flown(self.law(LOITER), Point(20.0), 30.0)
        # As text: a figure that is not given is NaN, which equals nothing.
        assert repr(flown(first, Point(10.0), 60.0)) == repr(flown(second, Point(10.0), 60.0))

    def test_a_route_that_crosses_itself_is_followed_in_order(self) -> None:
        """It looks for the nearest point from where it was told on, not all along the route."""
        crossing = route_of((0.0, 600.0), (-1.0 / RADIUS_M, 1.5 * math.pi * RADIUS_M), (0.0, 600.0))
        outputs = [output for _, output in flown(self.law(crossing), Point(), 90.0)]
        assert all(after.arc_length_m > before.arc_length_m - 1.0 for before, after in pairwise(outputs))
        assert outputs[-1].past_end
        placed = self.law(LINE, 5000.0).update(Point(0.0, 5010.0).state())
        assert math.isclose(placed.arc_length_m, 5010.0, abs_tol=1e-6)

    def test_the_rest_of_a_route_is_taken_over_in_flight(self) -> None:
        """Given the same route again, from where it is on it, it commands what it would have commanded."""
        for seconds in (14.0, 20.0):
            kept = self.law(COURSE)
            *_, (state, output) = flown(kept, Point(), seconds)
            again = self.law(COURSE)
            flown(again, Point(), seconds)
            again.follow(COURSE, output.arc_length_m)
            expected, found = kept.update(state), again.update(state)
            assert math.isclose(found.roll_command_rad, expected.roll_command_rad, abs_tol=1e-6)
            assert math.isclose(found.arc_length_m, expected.arc_length_m, abs_tol=1e-3)


# One class of tests for each law: Test_preview and so on.
globals().update(
    {f"Test_{kind.kind}": type(f"Test_{kind.kind}", (GuidanceContract,), {"kind": kind}) for kind in BUILT_IN}
)


def law_of_readme() -> GuidanceKind:
    shown = re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)
    (code,) = (each for each in shown if "LAW = " in each)
    module = sys.modules["law_of_readme"] = ModuleType("law_of_readme")
    exec(code, vars(module))
    kind: GuidanceKind = module.LAW
    return kind


class TestLawOfReadme(GuidanceContract):
    """As a user is told to test an own law."""

    kind = law_of_readme()
