"""The loop stepped from outside: the same flight as `fly` flies, and misuse is told."""

from __future__ import annotations

import pytest

from harness.flight.closed_loop import ClosedLoop, fly
from harness.run.scenario_flight import make_loop
from tests.closed_loop.small import small_world
from tests.point_mass import PointMass


def test_a_loop_is_flown_once() -> None:
    loop = make_loop(small_world(mission={"time_limit_s": 1.0}), PointMass)
    fly(loop)
    for again in (fly, ClosedLoop):
        with pytest.raises(
            RuntimeError, match="has been flown for 1 s already; every flight needs a loop of its own"
        ):
            again(loop)
