"""How much of the failures each quantity explains, on planted systems whose shares are known."""

import numpy as np
import pytest

from harness.certification.certification import differing, explained

RATES = np.array([0.05, 0.1, 0.3, 0.55])


def test_the_share_is_the_variance_between_groups_over_that_of_failing() -> None:
    """Each quartile of the wind fails at a rate of its own: Var(rate) / (mean (1 - mean))."""
    rng = np.random.default_rng(4)
    wind, noise = rng.uniform(0.0, 10.0, 40_000), rng.normal(size=40_000)
    course = rng.uniform(0.0, 360.0, 40_000)
    failed = rng.random(40_000) < RATES[np.searchsorted(np.quantile(wind, (0.25, 0.5, 0.75)), wind)]
    mean = RATES.mean()
    quantities = {"noise": noise.tolist(), "wind": wind.tolist(), "wind.from_deg": course.tolist()}
    first, *others = explained(failed, quantities)
    assert first.key == "wind"
    assert first.share == pytest.approx(RATES.var() / (mean * (1.0 - mean)), abs=0.01)
    assert first.failed / first.runs == pytest.approx(RATES[-1], abs=0.02)
    assert all(each.share < 0.001 for each in others)


@pytest.mark.parametrize(
    ("drawn", "fails", "worst"),
    [
        ((0, 360), (315, 405), "N, -45 to 45"),
        ((50, 130), (70, 90), "70 to 90"),
        ((-30, 50), (-10, 10), "350 to 10"),
    ],
)
def test_a_direction_explains_failures_about_north_and_within_a_quarter_of_the_compass(
    drawn: tuple[float, float], fails: tuple[float, float], worst: str
) -> None:
    course = np.linspace(*drawn, 20_001) % 360.0
    (one,) = explained((course - fails[0]) % 360.0 < fails[1] - fails[0], {"wind.from_deg": course.tolist()})
    assert one.worst == worst
    assert one.share == pytest.approx(1.0, abs=1e-3)


def test_what_conditions_draw_is_found_though_no_key_names_it() -> None:
    """The range of the sensor is no quantity of its own: it follows from the wind."""
    winds = [{"speed_mps": speed, "from_deg": 270.0} for speed in (1.0, 2.0)]
    pairs = zip(winds, [{"range_m": 900.0 + wind["speed_mps"]} for wind in winds], strict=True)
    days = [{"environment": {"wind": wind}, "sensor": sensor} for wind, sensor in pairs]
    assert differing(days) == {"environment.wind.speed_mps": [1.0, 2.0]}
