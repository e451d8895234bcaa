"""The mission of a flown flight: corners, from where they count as reached, airspeed, height, bank limit."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from harness.files.input_file import InputError
from harness.flight.record import FloatArray
from harness.run_files.path_files import read_path

MISSION_KEYS = ("acceptance_radius_m", "airspeed_command_ias_mps", "baro_height_command_m", "bank_limit_deg")


class Origin(NamedTuple):
    """Where east = north = up = 0 of a log lies."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float = 0.0


@dataclass(frozen=True, eq=False)
class FlownMission:
    """What was to be flown, again and again.

    Attributes:
        corners_m: (k, 2) east and north; after the last comes the first.
        acceptance_m: a corner counts as reached from here; None: by the rule of the law.
        airspeed_mps: commanded indicated airspeed; None: not known.
        height_m: commanded barometric height; None: not known.
        bank_limit_deg: of the autopilot; None: the aircraft's.
        origin: of the plane; None: not known.
    """

    corners_m: FloatArray
    acceptance_m: float | None = None
    airspeed_mps: float | None = None
    height_m: float | None = None
    bank_limit_deg: float | None = None
    origin: Origin | None = None


def read_mission(path: Path) -> FlownMission:
    """Reads a mission.

    Args:
        path: a JSON with `mission.corners_east_north_m` and others of `MISSION_KEYS`, or a file that `wayproof check`
            takes.

    Raises:
        InputError: it is neither, or a value is not of its kind.
    """
    content: Any = None
    if path.suffix.lower() == ".json":
        try:
            content = json.loads(path.read_text("utf-8"))
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({error.strerror})") from error
        except ValueError as error:
            raise InputError(f"{path}: is no JSON ({error})") from error
    if isinstance(content, dict) and "mission" in content:
        return _of_json(content, str(path))
    given = read_path(path)
    points = given.points_m
    if len(points) > 2 and np.hypot(*(points[-1] - points[0])) < 1.0:
        points = points[:-1]
    accepted = [step.acceptance_m for step in given.mission.steps] if given.mission else []
    radius = next((each for each in accepted if each > 0.0), None)
    origin = None if given.origin_deg is None else Origin(*given.origin_deg)
    height_m = float(given.altitudes_m[0]) if len(given.altitudes_m) else None
    return FlownMission(points, radius, height_m=height_m, origin=origin)


def _of_json(content: dict[str, Any], source: str) -> FlownMission:
    mission = content["mission"]
    if not isinstance(mission, dict) or "corners_east_north_m" not in mission:
        raise InputError(
            f"{source}: mission.corners_east_north_m: is missing; must be [[east, north], ...] in m"
        )
    try:
        corners = np.array(mission["corners_east_north_m"], dtype=np.float64)
    except (TypeError, ValueError):
        corners = np.zeros(0)
    if corners.ndim != 2 or corners.shape[1:] != (2,) or len(corners) < 2 or not np.isfinite(corners).all():
        raise InputError(f"{source}: mission.corners_east_north_m: must be two or more pairs of numbers in m")
    values = {name: _number(mission, name, f"{source}: mission.") for name in MISSION_KEYS}
    frame = content.get("frame", {})
    place = frame.get("origin") if isinstance(frame, dict) else None
    origin = None
    if isinstance(place, dict) and {"latitude_deg", "longitude_deg"} <= place.keys():
        numbers = [_number(place, name, f"{source}: frame.origin.") for name in Origin._fields]
        origin = Origin(numbers[0] or 0.0, numbers[1] or 0.0, numbers[2] or 0.0)
    return FlownMission(
        corners,
        values["acceptance_radius_m"],
        values["airspeed_command_ias_mps"],
        values["baro_height_command_m"],
        values["bank_limit_deg"],
        origin,
    )


def _number(mapping: dict[str, Any], name: str, where: str) -> float | None:
    value = mapping.get(name)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise InputError(f"{where}{name}: is {value!r}; must be a number")
    return float(value)
