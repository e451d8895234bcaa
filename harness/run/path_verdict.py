"""What came of a path that was flown: the content of its `metrics.json`, and the answer as one sentence."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from aircraft.guidance.altitude import slewed
from aircraft.interface import FloatArray
from harness.analysis.breaches import CONTACT, Breach, Separation, compare, crossed, inside_m, stretches
from harness.analysis.deviation import Rows, Stations, deviation, distances_m, error_figures
from harness.analysis.flight_limits import AsGiven, FlightLimits
from harness.analysis.in_force import InForce, demand
from harness.analysis.metric import CROSSED
from harness.analysis.metrics import least_known, metrics, time_below_s
from harness.analysis.smoothness import polyline_profile, smoothness
from harness.files.wording import metres, tallied
from harness.flight.record import Flight, Outcome, Track
from harness.run_files.given_path import SAME_PLACE_M, CutCorner
from harness.world.world import World

if TYPE_CHECKING:
    from harness.run.path_flight import PathCheck, PathPlan
    from harness.scenario.scenario import Scenario
    from harness.world_files.height_field import HeightField
    from harness.world_files.parts import FileSpec

SPACING_SHARE: Final = 0.25  # points along the path are measured so close together, in cross-track limits
WINDOW_RADII: Final = 4.0
"""Track and path are compared where they are no further apart than this along the path, in turn radii."""
LAYER_M: Final = 10.0  # depth of a layer: what reaches into it, or its clearance does, is solid all through
WIDER, MOST_WIDER = 1.05, 5.0
"""A limit that does not hold far enough is made larger by the first factor, up to the second times the need."""
MOST_FLIGHTS: Final = 4  # a path is flown at most so often again to find the corner limit that is a yes
OF_TURNS: Final = ("turn radius too tight", "wind drift", "bank limit", "roll rate")  # causes at corners
MOST_LIMITS_TRIED: Final = 50
"""A corner limit that would be kept is looked for in at most this many steps, each of which makes it larger."""
Flown = Callable[[float], Mapping[str, Any]]  # metrics of the path flown with a corner limit (m)


def measure(check: PathCheck, flight: Flight, limits: FlightLimits, flown_at: Flown | None = None) -> dict[str, Any]:
    """The content of `metrics.json` of a path that was flown: that of any flight, and what is asked of a path.

    `flown_at` returns it for another corner limit; without it, `corner_m_that_would_do` is a guess.
    """
    followed, tolerance, way = flight.track, limits.cross_track_threshold_m, check.plan.way
    flight = replace(flight, track=followed.along_truly)
    track = flight.track
    corners = [replace(each, allowed_cut_m=check.allowed_cut_m(each.waypoint)) for each in way.corners]
    line = way.given_m, SPACING_SHARE * tolerance, WINDOW_RADII * limits.turn_radius_m
    found = believed = deviation(track, *line)
    passing = _Passing(track, np.nan_to_num(found.by_row_m), tolerance, corners)
    wanted = _demands(check.plan, passing, followed)
    if track.has_beliefs:
        east, north = followed.believed_m[:, :2].T
        believed = deviation(replace(followed, east_m=east, north_m=north), *line)
        wanted = replace(wanted, believed_off_m=believed.by_row_m)
    figures = metrics(flight, limits, wanted)
    others = layer_contacts(track, check.scenario, check.files, limits.clearance_m)
    seen = compare(track, World.from_scenario(check.scenario), check.given.fences, check.bounded, others)
    if seen.contacts and flight.outcome is not Outcome.COLLISION:
        reason = f"touched {seen.contacts[0].name} after {seen.contacts[0].start_s:.0f} s; {flight.reason}"
        figures |= {"outcome": Outcome.COLLISION.value, "reason": reason}
    facts = _check_content(check, flight, limits, wanted, passing)
    figures["trackable"] &= figures["outcome"] == "reached" and all(each["kept"] for each in facts["corners"])
    limit_m, causes = facts["corner_m_that_would_do"], {leg["cause"] for leg in figures["trackability"]}
    if limit_m is None and facts["corners"] and not _is_kept(facts) and not causes.isdisjoint(OF_TURNS):
        limit_m = float(math.ceil(facts["worst"]["off_m"])) if flown_at else None
    facts["corner_m_that_would_do"], sure = _try_limit(limit_m, flown_at)
    ok, sentence = verdict(figures, facts, seen, limits, sure)
    return {
        **figures,
        "total_system_error_m": error_figures(found.rows_m),
        "flight_technical_error_m": error_figures(believed.rows_m),
        "min_clearance_m": least_known(seen.nearest_m),
        "clearance_violation_s": time_below_s(track, seen.nearest_m, limits.clearance_m),
        "contact": bool(seen.contacts),
        "contacts": [dict(vars(each)) for each in seen.contacts],
        "breaches": [dict(vars(each)) for each in seen.crossings],
        **({} if seen.height_m is None else {"height_above_ground_m": seen.height_m}),
        "deviation_from_given_m": found.figures(),
        "check": {"ok": ok, "verdict": sentence, **facts},
    }


def _check_content(
    check: PathCheck, flight: Flight, limits: FlightLimits, wanted: AsGiven, passing: _Passing
) -> dict[str, Any]:
    """Returns the content of `check`, without `ok` and the verdict, which follow from it."""
    track, given, plan = flight.track, check.given, check.plan
    # The place where the track is furthest off the path in relation to what is allowed there.
    row = int((passing.off_m / np.maximum(wanted.allowed_m, 1e-9)).argmax())
    worst_m, most_m = float(passing.off_m[row]), float(wanted.allowed_m[row])
    line, speed = _given_line(plan), max(float(track.groundspeed_mps.mean()), 1e-3)
    found = {
        "drawn": given.mission is None,
        "clearance_m": limits.clearance_m or None,
        "points": len(given.points_m),
        "given_length_m": float(np.hypot(*np.diff(line, axis=0).T).sum()),
        "worst": {
            "time_s": float(track.time_s[row]),
            "east_m": float(track.east_m[row]),
            "north_m": float(track.north_m[row]),
            "off_m": worst_m,
            "allowed_m": most_m,
            "waypoint": passing.waypoint_at(row),
        },
        "limit_used": {
            "off_path": worst_m / most_m if most_m else None,
            "altitude": float(np.abs(track.up_m - wanted.altitude_m).max()) / limits.max_altitude_error_m,
            "bank": _bank_used(check, flight, limits, wanted),
        },
        "given": dataclasses.asdict(smoothness(polyline_profile(line, speed), speed)),
        "corners": [passing.of(corner) for corner in passing.corners],
        "profile": {name: getattr(plan.profile, name).tolist() for name in ("arc_length_m", "altitude_m")},
        "fences": [fence.plain() for fence in given.fences.every],
        "items": [dataclasses.asdict(item) for item in given.mission.items] if given.mission else [],
        "notes": [*given.notes, *plan.notes],
    }
    return {**found, "corner_m_that_would_do": _sufficient_m(passing, found)}


def verdict(
    figures: Mapping[str, Any], facts: Mapping[str, Any], seen: Separation, limits: FlightLimits, sure: bool
) -> tuple[bool, str]:
    """Whether a path can be flown as given, and a sentence that says so or why not.

    `sure`: it is a yes with `corner_m_that_would_do`.
    """
    legs = tallied([leg["cause"] for leg in figures["trackability"] if not leg["trackable"]], "legs")
    share, off_m = facts["limit_used"]["altitude"], figures["altitude_error_m"]["max"]
    faults = [*_breach_faults(seen), *filter(None, [legs]), *_deviation_faults(facts, sure)]
    if share > 1.0:
        allowed = metres(off_m / share, off_m)
        faults.append(f"{metres(off_m, off_m / share)} off in altitude where {allowed} are allowed")
    if figures["outcome"] not in ("reached", "collision"):
        faults.append(str(figures["reason"]))
    if not faults and not figures["trackable"]:
        faults.append("no leg was flown")
    return (False, "no: " + "; ".join(faults)) if faults else (True, _as_given_text(facts, limits))


def _breach_faults(seen: Separation) -> list[str]:
    """Says what was touched, entered and left: the deepest of each kind, and how many more there are."""
    crossed = {kind: [each for each in seen.crossings if each.kind == kind] for kind in CROSSED}
    found = []
    for kind, some in {CONTACT: seen.contacts, **crossed}.items():
        if some:
            deepest = max(some, key=lambda each: each.depth_m)
            more = f", {len(some) - 1} more" if len(some) > 1 else ""
            where = f"{deepest.name} at {deepest.start_s:.0f} s"
            found.append(f"{CROSSED.get(kind, 'touches')} {where}, by {metres(deepest.depth_m)}{more}")
    return found


def _as_given_text(facts: Mapping[str, Any], limits: FlightLimits) -> str:
    """Says how a path was flown, and how much of the limits was used."""
    used, tolerance_m = facts["limit_used"], limits.cross_track_threshold_m
    how = "as drawn" if facts["drawn"] else "with its corners cut by no more than allowed"
    wide_m = max((corner["allowed_cut_m"] for corner in facts["corners"]), default=0.0)
    within = metres(tolerance_m) + (f", corners within {metres(wide_m)}" if wide_m > tolerance_m else "")
    most = max(used["off_path"] or 0.0, used["altitude"])
    share, limit_deg = used["bank"] or 0.0, f"{math.degrees(limits.bank_limit_rad):.0f} deg of bank"
    bank_deg = math.degrees(math.atan(share * math.tan(limits.bank_limit_rad)))
    bank = f", turns take {bank_deg:.0f} of {limit_deg}" if bank_deg >= 1.0 else ""
    if share > 1.0:
        bank = f", a turn that needs more than {limit_deg} was flown on a larger radius"
    return f"yes: flown {how}, within {within}; {most:.0%} of a limit used at most{bank}"


def _bank_used(check: PathCheck, flight: Flight, limits: FlightLimits, wanted: AsGiven) -> float | None:
    """Lateral acceleration that the turns of the path ask for in that wind, over what the bank limit gives.

    None where the aircraft flies to waypoints, on arcs of its own.
    """
    rows = np.flatnonzero(flight.track.plan_index >= 0)
    if check.scenario.guidance.follow == "waypoints" or not len(rows):
        return None
    flown = int(rows[0]), int(rows[-1]) + 1
    force = InForce.of(flight.track, limits, wanted.airspeed_mps).part(*flown)
    return demand(flight.track.part(*flown), flight.plans, force).windy


def _deviation_faults(facts: Mapping[str, Any], sure: bool) -> list[str]:
    """Says how far off the path and a corner an aircraft was, if too far, and which limit would do."""
    worst, enough_m = facts["worst"], facts["corner_m_that_would_do"]
    missed = next((corner for corner in facts["corners"] if not corner["kept"]), None)
    noun, faults = "waypoint" if facts["drawn"] else "item", []
    if worst["off_m"] > worst["allowed_m"]:
        where = "" if worst["waypoint"] is None else f" at {noun} {worst['waypoint']}"
        off_m, allowed_m = worst["off_m"], worst["allowed_m"]
        faults.append(f"{metres(off_m, allowed_m)} off{where} where {metres(allowed_m, off_m)} are allowed")
    elif missed is not None:
        how = "not reached" if missed["flown_cut_m"] is None else f"passed {metres(missed['most_off_m'])} off"
        faults.append(f"{noun} {missed['waypoint']} {how}, {metres(missed['allowed_cut_m'])} are allowed")
    if faults and enough_m is not None:
        faults.append(f"--corner-m {enough_m:g} would {'be yes' if sure else 'do for the corners alone'}")
    return faults


def _try_limit(limit_m: float | None, flown_at: Flown | None) -> tuple[float | None, bool]:
    """Flies with a corner limit, and with a wider one as long as that does not hold; returns it, and if it is a yes."""
    for flight in range(MOST_FLIGHTS):
        if limit_m is None or flown_at is None:
            return limit_m, False
        if _is_kept(found := flown_at(limit_m)["check"]):
            return limit_m, found["ok"]
        needed_m = found["corner_m_that_would_do"]
        wider_m = float(math.ceil(limit_m * WIDER**flight))  # each flight may need a little more
        limit_m = 2.0 * limit_m if needed_m is None else max(needed_m, wider_m)
    return None, False


def _is_kept(facts: Mapping[str, Any]) -> bool:
    """Whether nothing of the track is further off the path or its corners than allowed."""
    worst = facts["worst"]
    return worst["off_m"] <= worst["allowed_m"] and all(each["kept"] for each in facts["corners"])


def _sufficient_m(passing: _Passing, facts: Mapping[str, Any]) -> float | None:
    """The limit at all corners that this track keeps, rounded up to 1 m; None where there is none, or no need."""
    corners = facts["corners"]
    if not corners or _is_kept(facts) or any(each["flown_cut_m"] is None for each in corners):
        return None
    limit_m = 0.0
    for _ in range(MOST_LIMITS_TRIED):
        tried = [replace(corner, allowed_cut_m=limit_m) for corner in passing.corners]
        needed_m = max(passing.of(corner)["most_off_m"] for corner in tried)
        allowed_m = passing.stations.allowed_m(passing.tolerance_m, tried)
        if needed_m <= limit_m and bool((passing.off_m <= allowed_m).all()):
            return limit_m
        if (limit_m := float(math.ceil(max(needed_m, WIDER * limit_m)))) > MOST_WIDER * needed_m:
            break  # it is off where no corner is
    return None


def _given_line(plan: PathPlan) -> FloatArray:
    """(k, 2) the line that was given: of a mission with its circles."""
    if not plan.marks:
        return plan.way.waypoints_m
    line: FloatArray = plan.way.given_m[:, :2]
    return line[np.flatnonzero(np.append(True, np.hypot(*np.diff(line, axis=0).T) > SAME_PLACE_M))]


def _demands(plan: PathPlan, passing: _Passing, track: Track) -> AsGiven:
    """Returns what the path asks for in each row of the track, as far along it as the aircraft believed to be."""
    corners, along, profile = passing.corners, np.nan_to_num(track.arc_length_m), plan.profile
    legs = np.maximum(np.searchsorted(profile.speed_from_m, along, side="right") - 1, 0)
    fastest = np.full((len(track), 2), np.inf)
    if not profile.level:
        fastest = np.array(list(map(plan.climb_mps, profile.airspeeds(along).tolist()))).reshape(-1, 2)
    altitude_m, slopes = profile.passed(along, track.up_m)
    return AsGiven(
        _leg_ends(plan, corners),
        passing.off_m,
        passing.stations.allowed_m(passing.tolerance_m, corners),
        altitude_m=altitude_m,
        climb_mps=slopes * track.groundspeed_mps,
        fastest_mps=fastest,
        airspeed_mps=slewed(plan.commanded_mps[legs], track.time_s, float(plan.commanded_mps[0])),
        unheld_mps=np.abs(plan.commanded_mps - profile.airspeed_mps)[legs],
    )


def _leg_ends(plan: PathPlan, corners: Sequence[CutCorner]) -> list[CutCorner]:
    """Finds the ends of legs: every item of a mission; the corners of a drawn line, and where its slope changes."""
    known = {(corner.waypoint, round(corner.arc_length_m, 3)): corner for corner in corners}
    plain = {
        (number, round(along, 3)): CutCorner(number, 0.0, 0.0, 0.0, 0.0, 0.0, along, 0.0)  # no corner
        for number, along in plan.marks or plan.bends
    }
    every = plain | known
    ends = [every[key] for key in plain] if plan.marks else list(every.values())
    return sorted(ends, key=lambda each: each.arc_length_m)


@dataclass(frozen=True, eq=False)
class _Passing:
    """A track and the corners that it passes; `off_m`, (n,), is how far it is off the path as given."""

    track: Track
    off_m: FloatArray
    tolerance_m: float
    corners: Sequence[CutCorner]

    @cached_property
    def stations(self) -> Stations:
        """Its rows by how far along the path they are."""
        return Stations(self.track)

    @cached_property
    def _within(self) -> Rows:
        """Rows that are within the tolerance, and the end."""
        return np.append(np.flatnonzero(self.off_m <= self.tolerance_m), len(self.track))

    def waypoint_at(self, row: int) -> int | None:
        """Returns the number of the corner of least limit about which a row of the track lies; None if of none."""
        near = [each for each in self.corners if row in self.stations.at_corner(each)]
        return min(near, key=lambda each: each.allowed_cut_m).waypoint if near else None

    def of(self, corner: CutCorner) -> dict[str, Any]:
        """Returns the entry of a corner under `check`; `flown_cut_m` is None if the aircraft did not get there.

        What it is off counts up to where it is within the tolerance of the path again.
        """
        rows, flown, most = self.stations.at_corner(corner), None, 0.0
        if self.stations.reached_m >= corner.arc_length_m:
            rows = np.append(rows, np.arange(rows[-1], self._within[np.searchsorted(self._within, rows[-1])]))
            passing = self.track.part(max(int(rows[0]) - 1, 0), int(rows[-1]) + 1)
            line = np.column_stack((passing.east_m, passing.north_m, passing.arc_length_m))
            place = np.array([[corner.east_m, corner.north_m, corner.arc_length_m]])
            flown = float(distances_m(place, line, math.inf)[0])  # it may be passed between two rows
            most = max(flown, float(self.off_m[rows].max()))
        kept_there = flown is not None and most <= corner.allowed_cut_m
        return {**vars(corner), "flown_cut_m": flown, "most_off_m": most, "kept": kept_there}


def layer_contacts(
    track: Track, scenario: Scenario, files: Sequence[FileSpec], wanted_m: float
) -> tuple[list[Breach], FloatArray]:
    """Contacts with what is solid at a track's altitudes, and distances (n,) from it, right if below the wanted one.

    Terrain is left out: contact with it is judged by its true height.
    """
    from harness.world_files.expansion import loaded_file

    specs = [each for each in files if loaded_file(each).terrain is None]
    inside = np.full((len(specs), len(track)), np.inf)
    for at, area, margin in _layers_met(track, scenario, specs, wanted_m):
        inside[at] = np.minimum(inside[at], crossed(track, margin, area))
    named = zip((each.path.name for each in specs), inside, strict=True)
    found = [each for name, margin in named for each in stretches(track, margin, CONTACT, name)]
    return found, inside.min(axis=0, initial=np.inf)


def _layers_met(
    track: Track, scenario: Scenario, specs: Sequence[FileSpec], wanted_m: float
) -> Iterator[tuple[int, Any, FloatArray]]:
    """Yields what is solid in a layer of the track: index of the file, area, and its distances (n,), negative inside.

    Many layers are cut as one first: what is not solid there, or further away than the least and the wanted one, is so
    in each of them.
    """
    known = None if scenario.ground is None else scenario.ground.field()
    layer, least = np.floor(track.up_m / LAYER_M), math.inf
    spans = (each.active_s or (0.0, math.inf) for each in specs)
    active = [(begin <= track.time_s) & (track.time_s <= end) for begin, end in spans]
    waiting = [(int(layer.min()), int(layer.max()))] if specs else []
    while waiting:
        low, high = waiting.pop()
        rows = (layer >= low) & (layer <= high)
        solid = _solid_areas(specs, scenario, known, low, high) if rows.any() else {}
        margins = {k: np.where(rows & active[k], -inside_m(track, area), np.inf) for k, area in solid.items()}
        nearest = min((float(each.min()) for each in margins.values()), default=math.inf)
        if low == high:
            least = min(least, nearest)
            yield from ((at, solid[at], margin) for at, margin in margins.items())
        elif nearest < max(least, wanted_m):
            middle = (low + high) // 2
            waiting += [(middle + 1, high), (low, middle)]


def _solid_areas(
    specs: Sequence[FileSpec], scenario: Scenario, ground: HeightField | None, low: int, high: int
) -> dict[int, Any]:
    """Returns what is solid between two layers of each file, by its index; files without any are left out."""
    import shapely

    from harness.world_files.expansion import expanded
    from harness.world_files.plane import Place

    origin, half_m = scenario.area.origin, 0.5 * LAYER_M * (high + 1 - low)
    place = Place(origin.latitude_deg, origin.longitude_deg)
    cut = [replace(each, vertical_clearance_m=each.vertical_clearance_m + half_m) for each in specs]
    sources = expanded(cut, place, scenario.area.bounds_m, low * LAYER_M + half_m, ground=ground).sources
    return {at: shapely.union_all(each.polygons) for at, each in enumerate(sources) if each.polygons}
