"""What a path that was given asks of a flight, row by row of the track."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from harness.flight.record import FloatArray
from harness.run_files.given_path import CutCorner


@dataclass(frozen=True)
class Corner(CutCorner):
    """A corner of a path that was given, or another end of a leg (`cut_m` and `half_m` 0).

    Attributes:
        allowed_cut_m: how far off it may be passed.
    """

    allowed_cut_m: float = 0.0


@dataclass(frozen=True, eq=False)
class AsGiven:
    """A path that was given and how it was flown, row by row of the track.

    Attributes:
        corners: places on the path, in order; each ends a leg.
        deviation_m: (n,) distance between the track and the path as given.
        allowed_m: (n,) what it may be.
        altitude_m: (n,) altitude that the path has there.
        climb_mps: (n,) climb that it asks for there, negative for a descent.
        fastest_mps: (n, 2) fastest climb and descent of the aircraft at its airspeed there.
        airspeed_mps: (n,) true airspeed that was commanded there.
        unheld_mps: (n,) by how much that is beyond the airspeeds that the aircraft holds.
        believed_off_m: (n,) distance of the believed position from the path; None where navigation is perfect.
    """

    corners: Sequence[Corner]
    deviation_m: FloatArray
    allowed_m: FloatArray
    altitude_m: FloatArray
    climb_mps: FloatArray
    fastest_mps: FloatArray
    airspeed_mps: FloatArray
    unheld_mps: FloatArray | float = 0.0
    believed_off_m: FloatArray | None = None
