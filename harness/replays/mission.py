"""The mission of a flown flight: corners, from where they count as reached, airspeed, height, bank limit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import AliasPath, BaseModel, ConfigDict, Field, FiniteFloat, PlainValidator, ValidationError

from aircraft.frames import LocalPlane
from harness.files.input_file import MAX_JSON_BYTES, InputError, parsed_json, read_text, shown
from harness.files.mavlink.commands import CHANGE_SPEED, FLOWN, JUMP, SPLINE_WAYPOINT, WAYPOINT, name_of
from harness.files.mavlink.items import Place
from harness.flight.record import FloatArray
from harness.replays.flown import FlownFlight
from harness.replays.logs import Command, logged_mission
from harness.run_files.path_files import PathAsGiven, read_path

CRUISE_PARAMETERS: Final = {"AIRSPEED_CRUISE": 1.0, "TRIM_ARSPD_CM": 0.01}
BANK_PARAMETERS: Final = {"ROLL_LIMIT_DEG": 1.0, "LIM_ROLL_CD": 0.01}
"""Parameters of ArduPlane, today's name first, and their units: cruise airspeed in m/s, bank limit in degrees."""
TARGET_RADIUS_M: Final = 10.0  # acceptance radius of corners known from a table's `target_index` alone
PLAIN: Final = (name_of(WAYPOINT), name_of(SPLINE_WAYPOINT))  # names of items that are corners
CORNERS_WANTED: Final = "two or more pairs [east, north] of numbers in m, at two places or more"


class Origin(BaseModel):
    """The place on earth of the origin (east = north = up = 0) of a log."""

    model_config = ConfigDict(strict=True)
    latitude_deg: FiniteFloat
    longitude_deg: FiniteFloat
    altitude_m: FiniteFloat = 0.0


def _corners(given: object) -> FloatArray:
    """(k, 2) east and north of two corners or more, none at the place of the one before; else ValueError."""
    found: NDArray[Any] = np.array(given)
    pairs = found.dtype.kind in "if" and found.ndim == 2 and found.shape[1] == 2 and len(found) >= 2
    if not pairs or not np.isfinite(found).all():
        raise ValueError
    found = found[np.append(True, np.hypot(*np.diff(found, axis=0).T) >= 1.0)]
    closed = len(found) > 2 and np.hypot(*(found[-1] - found[0])) < 1.0
    if len(found) < 2:
        raise ValueError
    return found[: len(found) - closed].astype(np.float64)


def _key(name: str, above: float | None = None) -> Any:
    """A key of the mapping `mission` of a JSON; a value of None is not known."""
    return Field(default=None, validation_alias=AliasPath("mission", name), gt=above)


class FlownMission(BaseModel):
    """The course that was to be flown lap by lap; of a JSON other keys are not read."""

    model_config = ConfigDict(strict=True, frozen=True, validate_by_name=True)
    corners_m: Annotated[Any, PlainValidator(_corners)] = Field(
        validation_alias=AliasPath("mission", "corners_east_north_m")
    )
    """(k, 2) east and north; after the last comes the first."""
    acceptance_m: FiniteFloat | None = _key("acceptance_radius_m", 0.0)
    """A corner counts as reached from here; None: by the rule of the law."""
    airspeed_mps: FiniteFloat | None = _key("airspeed_command_ias_mps", 0.0)  # commanded indicated airspeed
    height_m: FiniteFloat | None = _key("baro_height_command_m")  # commanded barometric height
    bank_limit_deg: FiniteFloat | None = _key("bank_limit_deg", 0.0)  # the autopilot's; None: the aircraft's
    origin: Origin | None = Field(default=None, validation_alias=AliasPath("frame", "origin"))  # the plane's

    def nearest_m(self, flight: FlownFlight) -> FloatArray:
        """(k,) how near a flight comes to each corner."""
        east_m, north_m = flight["east_m"], flight["north_m"]
        return np.array([np.hypot(east_m - east, north_m - north).min() for east, north in self.corners_m])

    def check_flown(self, flight: FlownFlight) -> None:
        """Raises InputError for a flight that stays away from a corner: it lies in another plane."""
        if (nearest_m := self.nearest_m(flight)).max() > self._far_m:
            text = f"comes no nearer than {nearest_m.max():.0f} m to corner {nearest_m.argmax() + 1} of its mission"
            raise InputError(f"{flight.source}: {text}; give both in one plane, or in degrees")

    def check_order(self, flight: FlownFlight, legs: FloatArray, first: int) -> None:
        """Raises InputError for a flight that comes to the corners in another order; `legs` as `legs_of` has them."""
        rows = np.flatnonzero(np.diff(legs) > 0.0)
        next_m = self.corners_m[((first + legs[rows]) % len(self.corners_m)).astype(np.int64)]
        away_m = np.hypot(flight["east_m"][rows] - next_m[:, 0], flight["north_m"][rows] - next_m[:, 1])
        if len(rows) and away_m.mean() > self._far_m:
            told = "target_index: changes" if "target_index" in flight else "its corners count as reached"
            text = f"{told} {away_m.mean():.0f} m from the corners that are next (mean)"
            raise InputError(f"{flight.source}: {text}; must go through the mission's corners in their order")

    @property
    def _far_m(self) -> float:
        """Who is farther away than this has not come to a corner."""
        legs_m = np.hypot(*(np.roll(self.corners_m, -1, axis=0) - self.corners_m).T)
        return max(self.acceptance_m or 0.0, 0.5 * float(legs_m.max()))

    def corner_at(self, flight: FlownFlight, rows: NDArray[np.intp], number: int) -> tuple[int, float]:
        """Number of the corner that some rows lie at, `number` unless another is half as far; and how far, m."""
        places = np.column_stack((flight["east_m"][rows], flight["north_m"][rows]))
        away = np.linalg.norm(places[:, None] - self.corners_m, axis=2).mean(axis=0)
        corner = int((away * np.where(np.arange(len(away)) == number, 0.5, 1.0)).argmin())
        return corner, float(away[corner])


Given = tuple[FlownMission, list[str], list[Place]]
"""A mission with notes on it, and places that `east_m` and `north_m` of a log may be counted from."""


def read_mission(path: Path, origin_deg: Place | None = None) -> Given:
    """Reads a JSON with `mission.corners_east_north_m`, or a file that `wayproof check` takes; else InputError.

    The plane of a mission in degrees lies about `origin_deg`, else about its first waypoint. A mission in degrees does
    not say where a log in metres is counted from: its home, or else its first waypoint.
    """
    if path.suffix.lower() == ".json":
        text = read_text(path, MAX_JSON_BYTES, "a mission, in JSON")
        if '"mission"' in text and '"Plan"' not in text:
            return _of_json(text, str(path)), [], []
    given = read_path(path, origin_deg=origin_deg)
    points, radius, notes = _lap_of(given)
    home, place = given.mission.home if given.mission else None, given.origin_deg
    origin = None if place is None else Origin(latitude_deg=place[0], longitude_deg=place[1])
    found = _mission(path, corners_m=points, acceptance_m=radius, origin=origin)
    return found, notes, [each for each in (home, place) if each is not None]


def _mission(source: Path, **keys: Any) -> FlownMission:
    try:
        return FlownMission(**keys)
    except ValidationError as error:
        raise InputError(f"{source}: its lap has fewer than two places; must have at least two") from error


def placed(path: Path, origins: Sequence[Place], flight: FlownFlight, notes: list[str]) -> FlownMission:
    """A mission in degrees about the origin with which a flight in metres comes nearest to its corners; notes it."""
    every = [read_mission(path, origin)[0] for origin in origins]
    missed_m = [float(each.nearest_m(flight).max()) for each in every]
    best = int(np.argmin(missed_m))
    latitude, longitude = origins[best]
    what = "home" if len(origins) > 1 and best == 0 else "the first waypoint"
    frame = f"the log's east = north = 0 is taken to be {what}, {latitude:.6f}, {longitude:.6f}"
    near = f"the flight comes within {missed_m[best]:.0f} m of its corners"
    notes.append(f"mission: in degrees; {frame}; {near}")
    return every[best]


def _lap_of(given: PathAsGiven) -> tuple[FloatArray, float | None, list[str]]:
    """Returns the corners of a lap, from where they are reached, and notes on what is flown otherwise or not at all.

    A mission that jumps back has laps of what it flies between the last two times at one item, in the file's order.
    """
    if (mission := given.mission) is None:
        return given.points_m, None, []
    steps = [each for each in mission.steps if each.position]
    lap, flown = range(len(steps)), dict[int, int]()
    for k, each in enumerate(steps):
        lap = range(flown[each.item], k) if each.item in flown else lap
        flown[each.item] = k
    order = sorted(lap, key=lambda k: steps[k].item)
    radius, notes = _one_radius(steps[k].acceptance_m for k in order)
    commanded = {(steps[k].height_m, steps[k].above, steps[k].airspeed_mps) for k in order}
    if mission.fences.every or len(commanded) > 1:
        told = "its fences, altitudes and changes of airspeed are passed over"
        notes.append(f"mission: {told}; flown at the log's height and airspeed")
    if others := [f"item {steps[k].item} ({steps[k].name})" for k in order if steps[k].name not in PLAIN]:
        notes.append(f"mission: flown to as waypoints: {', '.join(others)}")
    return given.points_m[order], radius, notes


def _one_radius(every: Iterable[float]) -> tuple[float | None, list[str]]:
    """Returns the first radius above 0, None where none is, and a note if not all are alike."""
    radii = list(dict.fromkeys(every))
    radius = next((each for each in radii if each > 0.0), None)
    listed = ", ".join(f"{each:g}" for each in radii)
    note = f"mission: its acceptance radii differ ({listed} m); {radius or 0.0:g} m is taken for all corners"
    return radius, [note] if len(radii) > 1 else []


def mission_of_log(path: Path) -> Given:
    """The mission of an ArduPilot log: waypoints between a jump and its target, else InputError; with a note."""
    commands, parameters = logged_mission(path) if path.suffix.lower() == ".bin" else ([], {})
    lap, kinds = _lap(commands, path), {each.command for each in commands}
    radius, notes = _one_radius(each.acceptance_m or parameters.get("WP_RADIUS", 0.0) for each in lap)
    origin = Origin(latitude_deg=lap[0].latitude_deg, longitude_deg=lap[0].longitude_deg)
    plane = LocalPlane(origin.latitude_deg, origin.longitude_deg)
    found = _mission(
        path,
        corners_m=np.array([plane.plane(each.latitude_deg, each.longitude_deg) for each in lap]),
        acceptance_m=radius,
        airspeed_mps=None if CHANGE_SPEED in kinds else _parameter(parameters, CRUISE_PARAMETERS),
        bank_limit_deg=_parameter(parameters, BANK_PARAMETERS),
        origin=origin,
    )
    reach = f"from {radius:g} m" if radius else "by the rule of the law"
    items = f"mission: items {lap[0].number} to {lap[-1].number} of the log, reached {reach}"
    return found, [items, *notes], []


def mission_of_targets(flight: FlownFlight) -> Given:
    """Corners ahead of where `target_index` changes, so that it changes there again, with a note; else InputError."""
    if "target_index" not in flight:
        text = "its mission is not known; give --mission FILE, or a column target_index"
        raise InputError(f"{flight.source}: {text}")
    target = flight["target_index"]
    reached = np.flatnonzero((np.diff(target) != 0.0) & (target[:-1] >= 0.0) & (target[1:] >= 0.0))
    numbers = np.unique(target[reached])
    if len(numbers) < 2 or (numbers != np.arange(len(numbers))).any():
        text = ", ".join(f"{each:g}" for each in numbers[:8].tolist()) or "none"
        text = f"is changed from {text}; must be from 0, 1 and so on; give --mission FILE"
        raise InputError(f"{flight.source}: target_index: {text}")
    going = np.column_stack((flight["ve_mps"], flight["vn_mps"]))[reached]
    ahead = TARGET_RADIUS_M * going / np.hypot(*going.T)[:, None]
    places = np.column_stack((flight["east_m"], flight["north_m"]))[reached] + ahead
    corners = np.array([places[target[reached] == number].mean(axis=0) for number in numbers])
    far = f"{TARGET_RADIUS_M:g} m"
    note = f"mission: {len(corners)} corners, {far} ahead of where target_index changes, reached from {far}"
    return _mission(flight.source, corners_m=corners, acceptance_m=TARGET_RADIUS_M), [note], []


def _lap(commands: Sequence[Command], path: Path) -> list[Command]:
    """Returns the waypoints from the target of a mission's last jump back to that jump."""
    jump = next((each for each in commands[::-1] if each.command == JUMP and each.first < each.number), None)
    if jump is None:
        raise InputError(f"{path}: its mission is not known; give --mission FILE")
    lap = [each for each in commands if jump.first <= each.number < jump.number and each.command in FLOWN]
    if (other := next((each for each in lap if each.command != WAYPOINT), None)) is not None:
        text = f"item {other.number} of its mission, {name_of(other.command)}, is no corner"
        raise InputError(f"{path}: {text}; give --mission FILE with the corners")
    if len(lap) < 2:
        raise InputError(f"{path}: its mission has under 2 waypoints before its jump; give --mission FILE")
    return lap


def _parameter(parameters: Mapping[str, float], names: Mapping[str, float]) -> float | None:
    """Returns the first of the named parameters that is above 0, in its unit; None where none is."""
    known = (parameters[name] * unit for name, unit in names.items() if parameters.get(name, 0.0) > 0.0)
    return next(known, None)


def _of_json(text: str, source: str) -> FlownMission:
    content = parsed_json(text, source)
    frame = content.get("frame") if isinstance(content, dict) else None
    if not isinstance(frame, dict | None):
        raise InputError(f"{source}: frame: is {shown(repr(frame))}; must be a mapping")
    try:
        return FlownMission.model_validate(content, by_name=False)
    except ValidationError as error:
        first: Any = error.errors()[0]
        value = "is missing" if first["type"] == "missing" else f"is {shown(repr(first['input']))}"
        right = "a mapping" if first["type"].startswith("model") else "a number"
        right += " above 0" if first["type"] == "greater_than" else ""
        right = CORNERS_WANTED if "corners_east_north_m" in first["loc"] else right
        where = ".".join(map(str, first["loc"])) or "the file"
        raise InputError(f"{source}: {where}: {value}; must be {right}") from error
