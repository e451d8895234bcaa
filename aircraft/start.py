"""How a flight begins: start conditions and the air."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

TURBULENCE_MODELS = ("tustin", "milspec")
TURBULENCE_INTENSITIES = ("light", "moderate", "severe")


@dataclass(frozen=True)
class Atmosphere:
    """Wind and turbulence.

    Attributes:
        wind_east_mps, wind_north_mps: steady wind in the local plane, the direction it blows towards.
        turbulence: "tustin", "milspec" or None.
        intensity: "light", "moderate" or "severe"; None exactly if `turbulence` is.
        seed: of the turbulence, 0 to 2^31 - 1.
    """

    wind_east_mps: float = 0.0
    wind_north_mps: float = 0.0
    turbulence: str | None = None
    intensity: str | None = None
    seed: int = 0

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
