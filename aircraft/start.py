"""How a flight begins: start conditions and the air."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

TURBULENCE_MODELS = ("tustin", "milspec")
TURBULENCE_INTENSITIES = ("light", "moderate", "severe")
GUST_SHAPES = ("step", "one_minus_cosine")


@dataclass(frozen=True)
class Gust:
    """A gust front that reaches all of the air at one time, on top of the wind.

    Attributes:
        shape: "step": the whole gust from one instant to the next, until its end; "one_minus_cosine": the
            discrete gust of certification, g/2 (1 - cos(2 pi t / T)) over its duration T (CS 25.341).
        east_mps, north_mps: the gust at its strongest in the local plane, the direction it blows towards.
        start_s: when it begins.
        duration_s: after which it has passed; infinite: it stays.
    """

    shape: str
    east_mps: float
    north_mps: float
    start_s: float
    duration_s: float = math.inf

    def __post_init__(self) -> None:
        if self.shape not in GUST_SHAPES:
            raise ValueError(f"shape must be step or one_minus_cosine; got {self.shape!r}")
        if not math.isfinite(self.east_mps + self.north_mps) or not 0.0 <= self.start_s < math.inf:
            raise ValueError("a gust must be finite and begin at 0 or later")
        if not self.duration_s > 0.0 or (self.shape != "step" and self.duration_s == math.inf):
            raise ValueError(
                f"duration_s must be positive, and finite but of a step; got {self.duration_s:g}"
            )

    def share(self, time_s: float) -> float:
        """How much of the gust blows at a time, 0 to 1."""
        since = time_s - self.start_s
        if not 0.0 <= since < self.duration_s:
            return 0.0
        return 1.0 if self.shape == "step" else 0.5 - 0.5 * math.cos(math.tau * since / self.duration_s)


@dataclass(frozen=True)
class Atmosphere:
    """Wind, gust and turbulence.

    Attributes:
        wind_east_mps, wind_north_mps: steady wind in the local plane, the direction it blows towards.
        turbulence: "tustin", "milspec" or None.
        intensity: "light", "moderate" or "severe"; None exactly if `turbulence` is.
        seed: of the turbulence, 0 to 2^31 - 1.
        gust: a gust front, or None.
    """

    wind_east_mps: float = 0.0
    wind_north_mps: float = 0.0
    turbulence: str | None = None
    intensity: str | None = None
    seed: int = 0
    gust: Gust | None = None

    def __post_init__(self) -> None:
        if not math.isfinite(self.wind_east_mps) or not math.isfinite(self.wind_north_mps):
            raise ValueError("the wind must be finite")
        if self.turbulence is not None and self.turbulence not in TURBULENCE_MODELS:
            raise ValueError(f"turbulence must be tustin, milspec or None; got {self.turbulence!r}")
        if (self.turbulence is None) != (self.intensity is None):
            raise ValueError("turbulence and intensity come together")
        if self.intensity is not None and self.intensity not in TURBULENCE_INTENSITIES:
            raise ValueError(f"intensity must be light, moderate, severe or None; got {self.intensity!r}")
        if not 0 <= self.seed < 2**31:
            raise ValueError(f"seed must be in [0, 2^31); got {self.seed}")

    @property
    def wind_mps(self) -> float:
        """Speed of the steady wind."""
        return math.hypot(self.wind_east_mps, self.wind_north_mps)


@dataclass(frozen=True)
class StartConditions:
    """Straight level flight in the local plane.

    Attributes:
        east_m, north_m: position.
        altitude_m: above mean sea level.
        course_rad: direction over the ground, clockwise from the plane's north.
        airspeed_mps: true airspeed.
    """

    east_m: float
    north_m: float
    altitude_m: float
    course_rad: float
    airspeed_mps: float

    def __post_init__(self) -> None:
        for f in fields(self):
            if not math.isfinite(getattr(self, f.name)):
                raise ValueError(f"{f.name} must be finite")
        if not self.airspeed_mps > 0.0:
            raise ValueError(f"airspeed_mps must be positive; got {self.airspeed_mps:g}")

    def heading_rad(self, atmosphere: Atmosphere) -> float:
        """Heading that makes the course good in a wind (the wind triangle).

        Raises:
            ValueError: if the wind across the course is not weaker than the airspeed.
        """
        across = atmosphere.wind_east_mps * math.cos(self.course_rad) - atmosphere.wind_north_mps * math.sin(
            self.course_rad
        )
        if abs(across) >= self.airspeed_mps:
            raise ValueError(
                f"a wind of {abs(across):g} m/s across the course cannot be held at {self.airspeed_mps:g} m/s"
            )
        return self.course_rad - math.asin(across / self.airspeed_mps)
