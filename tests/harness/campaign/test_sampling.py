"""Distributions: limits kept, shares right."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from harness.campaign.sampling import Distribution

shares = st.floats(0.0, 1.0, exclude_max=True)


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6), shares)
def test_uniform_stays_inside_and_is_even(low: float, width: float, share: float) -> None:
    drawn = Distribution(uniform=(low, low + width)).number(share)
    assert low <= drawn <= low + width
    assert drawn == pytest.approx(low + share * width)


@given(shares)
def test_normal_is_the_bell_and_a_cut_one_the_truncated_bell(share: float) -> None:
    whole = Distribution.model_validate({"normal": {"mean": 3.0, "sigma": 2.0}})
    bell = stats.norm(3.0, 2.0).ppf(np.clip(share, 1e-12, 1 - 1e-12))
    assert whole.number(share) == pytest.approx(bell, abs=1e-6)
    cut = Distribution.model_validate({"normal": {"mean": 3.0, "sigma": 2.0, "least": 0.0, "most": 4.0}})
    assert 0.0 <= cut.number(share) <= 4.0
    assert cut.number(share) == pytest.approx(stats.truncnorm(-1.5, 0.5, 3.0, 2.0).ppf(share), abs=1e-6)


def test_whole_numbers_and_choices_are_drawn_alike_the_ends_too() -> None:
    each = Distribution(uniform=(3.0, 5.0))
    shares_of = [each.whole_number((k + 0.5) / 300) for k in range(300)]
    assert [shares_of.count(number) for number in (3, 4, 5)] == [100, 100, 100]
    assert each.whole_number(1.0 - 1e-16) == 5
    bell = Distribution.model_validate({"normal": {"mean": 3.0, "sigma": 2.0, "least": 1, "most": 4}})
    assert {bell.whole_number(share) for share in np.linspace(0.0, 0.999, 100)} == {1, 2, 3, 4}
    ends: tuple[dict[str, float], ...] = ({}, {"least": 1}, {"least": 1, "most": 4.5}, {"least": 0.5})
    bells = [Distribution.model_validate({"normal": {"mean": 0.3, "sigma": 2.0, **cut}}) for cut in ends]
    assert [bell.is_whole for bell in bells] == [True, True, False, False]
    assert [Distribution(uniform=(0.0, most)).is_whole for most in (3.0, 3.5)] == [True, False]
    choice = Distribution.model_validate({"choice": ["a", "b", "c"]})
    assert [choice.chosen(share) for share in (0.0, 0.33, 0.34, 0.66, 0.67, 0.999)] == [0, 0, 1, 1, 2, 2]


@pytest.mark.parametrize(
    ("key", "number", "flown"),
    [
        ("environment.wind.from_deg", 370.0, 10.0), ("environment.wind.from_deg", -90.0, 270.0),
        ("environment.wind.from_deg", 360.0, 360.0), ("mission.altitude_m", 400.0, 400.0),
        ("area.origin.longitude_deg", -90.0, -90.0), ("mission.altitude_m", 300.5, 300.5),
    ],
)  # fmt: skip
def test_only_a_direction_goes_on_about_north(key: str, number: float, flown: float) -> None:
    assert Distribution(uniform=(number, number + 1e-9)).value(key, 0.0, whole=False) == flown
