"""When guidance and scans are due."""

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.flight.timetable import Instant, intervals

RATES = st.sampled_from([0.01, 0.5, 1.0, 2.0, 3.0, 4.0, 8.0, 10.0, 24.0, 120.0])


def test_scans_fall_on_updates_of_guidance_and_between_them() -> None:
    both, guidance, scan = Instant(True, True, 12, 6), Instant(True, False, 12, 6), Instant(False, True, 6, 0)
    assert intervals(120, 2.0) == [(both,), *[(guidance,)] * 4]
    between = (Instant(True, False, 6, 6), scan)
    assert intervals(120, 4.0) == [(both,), (guidance,), between, (guidance,), (guidance,)]
    assert intervals(120, 20.0) == [(Instant(True, True, 6, 6), scan)]


@given(RATES, st.sampled_from([120, 240, 1200]))
def test_every_interval_is_one_of_guidance_and_every_scan_has_its_step(rate_hz: float, step_hz: int) -> None:
    whole = intervals(step_hz, rate_hz)
    assert {sum(instant.steps for instant in each) for each in whole} == {step_hz // 10}
    assert all([instant.guidance for instant in each] == [True] + [False] * (len(each) - 1) for each in whole)
    at, scans = 0, []
    for instant in (instant for each in whole for instant in each):
        if instant.scan:
            scans.append(at)
        at += instant.steps
    apart = round(step_hz / Fraction(str(rate_hz)))
    assert scans == list(range(0, at, apart))
    assert at == math.lcm(apart, step_hz // 10)


@pytest.mark.parametrize(("step_hz", "rate_hz"), [(120, 7.0), (120, 240.0), (55, 5.0)])
def test_a_rate_that_does_not_divide_the_steps_is_refused(step_hz: int, rate_hz: float) -> None:
    with pytest.raises(ValueError, match="does not divide the simulation rate"):
        intervals(step_hz, rate_hz)
