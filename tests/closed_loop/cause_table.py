"""Flights of known cause, drawn at random, and which cause is named: `python -m tests.closed_loop.cause_table [N]`.

Every family exceeds one limit by formulas that stand here. The table is that of harness/run/README.md.
"""

import math
import sys
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

import wayproof

G = 9.80665
Draw = Callable[[float, float], float]
Asked = tuple[NDArray[np.float64], dict[str, Any]]


def least_m(speed_mps: float) -> float:
    """Radius of a turn at the bank limit of 45 degrees in calm air."""
    return speed_mps**2 / G


def keys(**settings: str) -> dict[str, Any]:
    """Keys of a scenario, their dots written as two underscores."""
    return {"settings": {key.replace("__", "."): value for key, value in settings.items()}}


def circles(radius_m: float, turns: float = 2.0) -> NDArray[np.float64]:
    """400 m east, then left turns, sampled every 3 m."""
    angle = np.linspace(0.0, turns * math.tau, round(turns * math.tau * radius_m / 3.0))
    arc = np.column_stack((400.0 + radius_m * np.sin(angle), radius_m * (1.0 - np.cos(angle))))
    return np.vstack(([[0.0, 0.0], [340.0, 0.0]], arc))


def corner(turn_deg: float) -> NDArray[np.float64]:
    turn = math.radians(turn_deg)
    return np.array([(0.0, 0.0), (900.0, 0.0), (900.0 + 900.0 * math.cos(turn), 900.0 * math.sin(turn))])


def slope(climb_mps: float, from_m: float, speed_mps: float = 25.0) -> NDArray[np.float64]:
    """Level, then a climb at an airspeed for 80 s, then level."""
    run, rise = 80.0 * speed_mps, 80.0 * climb_mps
    along, up = (0.0, 600.0, 600.0 + run, 1500.0 + run), (from_m, from_m, from_m + rise, from_m + rise)
    return np.column_stack((along, np.zeros(4), up))


def too_tight(draw: Draw) -> Asked:
    speed = draw(20.0, 30.0)
    radius = draw(0.75, 0.95) * least_m(speed)
    return circles(radius), {"airspeed_mps": speed, **keys(trackability__cross_track_m="2")}


def too_tight_a_corner(draw: Draw) -> Asked:
    speed, turn = draw(20.0, 30.0), draw(60.0, 120.0)
    cut_m = least_m(speed) * (1.0 / math.cos(math.radians(turn / 2.0)) - 1.0)
    return corner(turn), {"airspeed_mps": speed, "corner_m": draw(0.4, 0.8) * cut_m}


def windy(draw: Draw) -> Asked:
    """Wider than calm air asks for, tighter than flight downwind does."""
    speed, share = draw(20.0, 28.0), draw(0.25, 0.45)
    radius = draw(1.1, 0.85 * (1.0 + share) ** 2) * least_m(speed)
    wind = (share * speed, draw(0.0, 360.0))
    return circles(radius), {"airspeed_mps": speed, "wind": wind, **keys(trackability__cross_track_m="3")}


def windy_at_a_corner(draw: Draw) -> Asked:
    wind = draw(8.0, 11.0)
    calm, blown = (least_m(speed) * (math.sqrt(2.0) - 1.0) for speed in (25.0, 25.0 + wind))
    return corner(90.0), {"wind": (wind, 180.0), "corner_m": 1.1 * calm + draw(0.0, 0.15) * (blown - calm)}


def rolling(draw: Draw) -> Asked:
    """A sine whose bank is below the limit and whose roll rate is above that of the autopilot, 60 degrees a second."""
    bank, rate = math.radians(draw(25.0, 38.0)), math.radians(draw(75.0, 110.0))
    wave = 25.0 * bank / rate
    east = np.arange(0.0, 1200.0, 1.5)
    north = wave**2 * G * math.tan(bank) / 25.0**2 * (np.cos(east / wave) - 1.0)
    limit = {"aircraft__autopilot__roll_rate_limit_degps": "60", "trackability__cross_track_m": "0.3"}
    return np.vstack(([[-300.0, 0.0]], np.column_stack((east, north)))), keys(**limit)


def slow_servo(draw: Draw) -> Asked:
    """In severe turbulence an elevator of some 20 degrees a second is late: 20 m are lost, 1 m with a fast one."""
    slow, rough = f"{draw(19.0, 24.0):.1f}", "{intensity: severe}"
    limits = {"trackability__cross_track_m": "60", "trackability__altitude_m": "4"}
    servo = {"environment__turbulence": rough, "aircraft__actuators__rate_limit_degps": slow}
    return np.array([(0.0, 0.0), (4000.0, 0.0)]), keys(**servo, **limits)


def climbing(draw: Draw) -> Asked:
    return slope(draw(8.0, 12.0), draw(200.0, 4500.0)), {}


def climbing_high_up(draw: Draw) -> Asked:
    """What can be climbed at 300 m, where 3.6 m/s are left at 5,000 m."""
    return slope(draw(4.6, 5.4), draw(4000.0, 5000.0)), {}


def climbing_with_another(draw: Draw) -> Asked:
    return slope(draw(8.0, 14.0), draw(300.0, 1500.0), 55.0), {"aircraft": "c172p", "airspeed_mps": 55.0}


def descending(draw: Draw) -> Asked:
    return slope(-draw(9.0, 14.0), draw(1500.0, 4500.0)), {}


def misled(draw: Draw) -> Asked:
    navigation = f"{{kind: gnss, position_bias_m: [0, {draw(20.0, 30.0):.0f}]}}"
    return np.array([(0.0, 0.0), (3000.0, 0.0)]), keys(navigation=navigation)


def elevator_deg(speed_mps: float, bank_deg: float) -> float:
    """Elevator that holds the Aerosonde level in a turn at 300 m, by Beard and McLain's coefficients."""
    load, qbar = 1.0 / math.cos(math.radians(bank_deg)), 0.5 * 1.19 * speed_mps**2
    alpha = (load * 11.0 * G / (qbar * 0.55) - 0.23) / 5.61
    damping = -38.21 * 0.18994 / (2.0 * speed_mps) * G / speed_mps * (load - 1.0 / load)
    return math.degrees((0.0135 - 2.74 * alpha + damping) / 0.99)


def at_the_stop(draw: Draw) -> Asked:
    """Turns that take more elevator than the 25 degrees there are, and less bank than the limit."""
    speed, bank = draw(17.8, 19.0), draw(36.0, 40.0)
    assert elevator_deg(speed, bank) < -26.5
    return circles(speed**2 / (G * math.tan(math.radians(bank))), 4.0), {"airspeed_mps": speed}


def stalling(draw: Draw) -> Asked:
    """A Cessna that flies level down to 24.8 m/s stalls here at 27.7, by the root of the load factor."""
    speed, bank = draw(25.5, 27.0), draw(37.0, 39.0)
    radius = speed**2 / (G * math.tan(math.radians(bank)))
    return circles(radius, 3.0), {"aircraft": "c172p", "airspeed_mps": speed}


def heavy(draw: Draw) -> Asked:
    return circles(draw(85.0, 110.0)), keys(trackability__load_factor=f"{draw(1.05, 1.12):.3f}")


def disturbed(draw: Draw) -> Asked:
    """Nothing of the bank is left to get back onto the path with."""
    radius, air = draw(1.005, 1.03) * least_m(25.0), "{intensity: moderate}"
    return circles(radius, 3.0), keys(trackability__cross_track_m="1", environment__turbulence=air)


def slow(draw: Draw) -> Asked:
    """So high up and so fast that the Cessna's full throttle does not hold the speed in a long turn."""
    fast = {"aircraft": "c172p", "airspeed_mps": 60.0, "altitude_m": draw(2480.0, 2490.0)}
    return circles(draw(490.0, 500.0), 3.0), {**fast, **keys(trackability__airspeed_mps="1.0")}


def loose(draw: Draw) -> Asked:
    law = keys(trackability__cross_track_m=f"{draw(0.3, 0.6):.2f}", guidance="{kind: l1}")
    return circles(draw(250.0, 400.0)), law


FAMILIES: Mapping[str, tuple[Callable[[Draw], Asked], ...]] = {
    "turn radius too tight": (too_tight, too_tight_a_corner),
    "wind drift": (windy, windy_at_a_corner),
    "bank limit": (disturbed,),
    "roll rate": (rolling,),
    "actuator": (slow_servo,),
    "load factor": (heavy,),
    "speed or throttle saturation": (slow,),
    "climb too steep": (climbing, climbing_high_up, climbing_with_another),
    "descent too steep": (descending,),
    "navigation error": (misled,),
    "tracking error": (loose,),
    "control saturation": (at_the_stop,),
    "stall": (stalling,),
}


def confusion(flights: int, seed: int) -> Mapping[str, Counter[str]]:
    """How often which cause is named, by the cause that it is, of `flights` in each family."""
    rng = np.random.default_rng(seed)
    named: dict[str, Counter[str]] = {}
    for cause, families in FAMILIES.items():
        named[cause] = Counter()
        for family in families * flights:
            path, asked = family(rng.uniform)
            legs = wayproof.check(path, **asked).metrics.trackability
            named[cause][next((leg.cause for leg in legs if leg.cause), "none")] += 1
    return named


def table(named: Mapping[str, Counter[str]]) -> str:
    rows = ["| it is | flights | named so | named otherwise |", "|---|---|---|---|"]
    for cause, found in named.items():
        others = ", ".join(f"{name} {count}" for name, count in found.items() if name != cause)
        rows.append(f"| {cause} | {found.total()} | {found[cause]} | {others} |")
    return "\n".join(rows)


if __name__ == "__main__":
    print(table(confusion(int((sys.argv[1:] or ["10"])[0]), seed=1)))
