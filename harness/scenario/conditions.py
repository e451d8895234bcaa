"""`conditions: ideal | typical | rough`: a day for what is left out, by the seed; sources: `aircraft/README.md`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final, Literal, NamedTuple, TypeAlias

import numpy as np
from pydantic import BaseModel

from aircraft.airframe import Airframe
from aircraft.airframes import surface_travels
from aircraft.start import profile_share
from harness.scenario.environment import Environment, Turbulence, VerticalGustsSpec, Wind
from harness.scenario.keys import NORMALS, ScenarioKeys
from harness.scenario.navigation import Navigation
from harness.scenario.sections import MOST_SHARE, MOST_SHIFT_M, ActuatorsSpec, DeviationSpec, UncertaintySpec

CONDITIONS_STREAM, DEVIATION_STREAM = 4, 5
"""Numbers of the random streams, derived from the scenario's seed, that draw a day and the aircraft's deviations."""
MOST_SIGMAS: Final = 3.0  # normal numbers are clipped to this many standard deviations from the mean
WIND_FROM_M: Final = 10.0  # height over ground of a day's wind speed, the WMO's for measuring wind
CHANGE_EVERY_S, CHANGES = 300.0, 24  # how often a day's wind changes, and how many times; then it stays
GUST_LENGTH_M: Final = 100.0  # twice a gradient distance of a gust of 50 m, amid the 9 to 107 m of CS 25.341


class Day(NamedTuple):
    """The figures of one kind of day."""

    wind_mps: float | tuple[float, float]  # 10 m over ground: a Rayleigh's mean, or ends of a uniform one
    most_wind: float  # at the mission's altitude, as a share of the airspeed
    speed_change: float  # standard deviation of the wind's later speeds, as a share of its first
    direction_change_deg: float  # standard deviation of the wind's later directions from its first
    turbulence: Literal["light", "moderate"]
    vertical_gust_mps: float
    vertical_gust_every_s: float
    navigation: dict[str, Any]  # keys of `navigation`, for a satellite receiver with a barometer
    servos: dict[str, float]  # keys of `aircraft.actuators`, for every surface and the throttle
    uncertainty: dict[str, float]  # its keys; the centre of gravity's is over mass^1/3 (m/kg^1/3)


# fmt: off
DAYS: Final = {  # sources: `aircraft/README.md`
    "typical": Day(
        wind_mps=3.28, most_wind=0.35, speed_change=0.15, direction_change_deg=15.0,
        turbulence="light", vertical_gust_mps=2.3, vertical_gust_every_s=120.0,
        navigation={
            "kind": "gnss", "position_sigma_m": 1.3, "velocity_sigma_mps": 0.05, "heading_sigma_deg": 1.0,
            "airspeed_sigma_mps": 0.65, "altitude_sigma_m": 2.1, "latency_s": 0.12,
        },
        servos={"lag_s": 0.03, "rate_limit_degps": 300.0, "deadband_deg": 0.0},
        uncertainty={
            "mass": 0.02, "thrust": 0.05, "drag": 0.1, "lift_slope": 0.05,
            "elevator": 0.1, "aileron": 0.1, "rudder": 0.1, "centre_of_gravity_m": 0.002,
        },
    ),
    "rough": Day(
        wind_mps=(8.0, 10.7), most_wind=0.5, speed_change=0.15, direction_change_deg=10.0,
        turbulence="moderate", vertical_gust_mps=4.6, vertical_gust_every_s=60.0,
        navigation={
            "kind": "gnss", "position_sigma_m": 3.3, "velocity_sigma_mps": 0.1, "heading_sigma_deg": 2.0,
            "airspeed_sigma_mps": 1.3, "altitude_sigma_m": 4.2, "latency_s": 0.22,
        },
        servos={"lag_s": 0.06, "rate_limit_degps": 150.0, "deadband_deg": 1.0},
        uncertainty={
            "mass": 0.05, "thrust": 0.1, "drag": 0.2, "lift_slope": 0.1,
            "elevator": 0.2, "aileron": 0.2, "rudder": 0.2, "centre_of_gravity_m": 0.004,
        },
    ),
}
# fmt: on


def _keys_given(section: BaseModel | None) -> dict[str, Any]:
    return {} if section is None else section.model_dump(exclude_unset=True, exclude_none=True)


def with_servos(keys: ScenarioKeys, frame: Airframe) -> ScenarioKeys:
    """Fills in the servos of its day where a scenario leaves them out; those on its aircraft's card go before them.

    Of a model that does not show how far its surfaces move, a day fills the lag alone.
    """
    day, given = DAYS.get(keys.conditions), keys.aircraft.actuators
    if day is None or (given is None and frame.files.actuators):
        return keys
    of_day = day.servos if all(surface_travels(frame.files).values()) else {"lag_s": day.servos["lag_s"]}
    servos = ActuatorsSpec(**of_day | _keys_given(given))
    return keys.updated(aircraft=keys.aircraft.model_copy(update={"actuators": servos}))


def with_day(keys: ScenarioKeys, frame: Airframe) -> ScenarioKeys:
    """Fills in navigation, air and deviations of its day where a scenario leaves them out; its airspeed is known."""
    day = DAYS.get(keys.conditions)
    keys = keys.updated(navigation=_navigation(keys.navigation, day))
    if day is not None:
        keys = keys.updated(environment=_air(keys, day, _stream(keys, CONDITIONS_STREAM)))
    uncertainty = _uncertainty(keys.uncertainty, day, frame.mass_kg)
    deviation = _deviation(keys.aircraft.deviation, uncertainty, _stream(keys, DEVIATION_STREAM))
    aircraft = keys.aircraft.model_copy(update={"deviation": deviation})
    return keys.updated(aircraft=aircraft, uncertainty=uncertainty)


def _air(keys: ScenarioKeys, day: Day, rng: _Draws) -> Environment:
    """Fills in wind, turbulence and gusts of the day; what is drawn does not depend on which of them the file gives.

    A wind of given speed stays steady, and the same at all heights, unless that is given; the day's is at its height.
    """
    written = _keys_given(keys.environment.wind)
    height_m, every_s = written.get("measured_at_m", WIND_FROM_M), day.vertical_gust_every_s
    most_mps = day.most_wind * keys.aircraft.airspeed_mps / profile_share(keys.mission.altitude_m, height_m)
    if isinstance(day.wind_mps, tuple):
        mean_mps = float(rng.uniform(*day.wind_mps))
    else:
        mean_mps = float(rng.rayleigh(day.wind_mps / math.sqrt(math.pi / 2.0)))
    mean_mps = min(mean_mps * profile_share(height_m, WIND_FROM_M), most_mps)
    from_deg = written.get("from_deg", float(rng.uniform(0.0, 360.0)))  # drawn in any case
    changes = []
    for number, (speed, turn) in enumerate(_draw_clipped(rng, (CHANGES, 2)), start=1):
        speed_mps = min(mean_mps * (1.0 + day.speed_change * speed), most_mps)
        towards_deg = (from_deg + day.direction_change_deg * turn) % 360.0
        changes.append((CHANGE_EVERY_S * number, round(speed_mps, 3), round(towards_deg, 2)))
    wind: dict[str, Any] = {"from_deg": round(from_deg, 2)}
    if "speed_mps" not in written:
        wind |= {"speed_mps": round(mean_mps, 3), "measured_at_m": WIND_FROM_M, "changes": tuple(changes)}
    gusts = VerticalGustsSpec(
        speed_mps=day.vertical_gust_mps,
        duration_s=round(min(GUST_LENGTH_M / keys.aircraft.airspeed_mps, every_s), 3),
        every_s=every_s,
        start_s=round(float(rng.uniform(0.0, every_s)), 2),
    )
    return Environment(
        wind=Wind(**wind | written),
        turbulence=Turbulence(**{"intensity": day.turbulence} | _keys_given(keys.environment.turbulence)),
        vertical_gusts=keys.environment.vertical_gusts or gusts,
    )


def _navigation(given: Navigation, day: Day | None) -> Navigation:
    """Fills in the day's navigation where the file names no kind, else its latency; KeyFault: `perfect` has errors."""
    named = _keys_given(given)
    if day is not None and "kind" not in named:
        return Navigation(**day.navigation | named)
    if given.kind == "perfect":
        given.refuse_errors()
        return given
    return given if day is None else Navigation(**{"latency_s": day.navigation["latency_s"]} | named)


def _uncertainty(given: UncertaintySpec | None, day: Day | None, mass_kg: float) -> UncertaintySpec | None:
    if day is None:
        return given and given.filled(**dict.fromkeys(UncertaintySpec.model_fields, 0.0))
    shift_m = round(day.uncertainty["centre_of_gravity_m"] * mass_kg ** (1.0 / 3.0), 5)
    return (given or UncertaintySpec()).filled(**day.uncertainty | {"centre_of_gravity_m": shift_m})


def _deviation(given: DeviationSpec | None, uncertainty: UncertaintySpec | None, rng: _Draws) -> DeviationSpec | None:
    """Returns the deviations of one flight: those given, others drawn with standard deviations `uncertainty`, or 0."""
    names = list(DeviationSpec.model_fields)
    if uncertainty is None:
        return given and given.filled(**dict.fromkeys(names, 0.0))
    values = {}
    for name, each in zip(names, _draw_clipped(rng, len(names)), strict=True):
        most = MOST_SHIFT_M if name == "centre_of_gravity_m" else MOST_SHARE
        values[name] = min(max(round(getattr(uncertainty, name) * each, 6), -most), most)
    return (given or DeviationSpec()).filled(**values)


class _Given:
    """Draws as numpy's generator does, but from given standard normal numbers, one after another."""

    def __init__(self, normals: Sequence[float]) -> None:
        self._left = iter(normals)
        self._above = (0.5 * math.erfc(each / math.sqrt(2.0)) for each in self._left)

    def uniform(self, low: float, high: float) -> float:
        return high - (high - low) * next(self._above)

    def rayleigh(self, scale: float) -> float:
        return scale * math.sqrt(-2.0 * math.log(next(self._above)))

    def standard_normal(self, shape: int | tuple[int, int]) -> np.ndarray[Any, Any]:
        return np.fromiter(self._left, np.float64, int(np.prod(shape))).reshape(shape)


_Draws: TypeAlias = np.random.Generator | _Given


def _stream(keys: ScenarioKeys, number: int) -> _Draws:
    if keys.normals is not None:
        air = NORMALS[0]
        return _Given(keys.normals[:air] if number == CONDITIONS_STREAM else keys.normals[air:])
    return np.random.default_rng(np.random.SeedSequence(keys.seed, spawn_key=(number,)))


def _draw_clipped(rng: _Draws, shape: int | tuple[int, int]) -> list[Any]:
    return list(rng.standard_normal(shape).clip(-MOST_SIGMAS, MOST_SIGMAS).tolist())


def conditions_text(scenario: ScenarioKeys) -> str:
    """Describes the kind of day that a scenario is flown on, its air and its navigation, in a line of a summary."""
    air, navigation, deviation = scenario.environment, scenario.navigation, scenario.aircraft.deviation
    wind = air.wind or Wind()
    exact = navigation.kind == "perfect" and not navigation.latency_s
    sayings = {
        wind.text: wind.text,
        f"{air.gusts} turbulence": air.gusts,
        "gusts": air.vertical_gusts,
        f"{navigation.kind} navigation": not exact,
        f"state {navigation.latency_s:g} s old": navigation.latency_s,
        "servos": scenario.conditions == "ideal" and scenario.aircraft.actuators,
        "aircraft other than its model": deviation and any(dict(deviation).values()),
    }
    other = [saying for saying, holds in sayings.items() if holds]
    if scenario.conditions == "ideal" and other:
        return f"ideal, but for what the scenario sets: {', '.join(other)}"
    calm, known = [] if wind.fastest_mps else ["calm"], ["state known exactly"] if exact else []
    return f"{scenario.conditions}: {', '.join([*calm, *other, *known])}"
