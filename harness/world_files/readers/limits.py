"""Heights as files write them: limits of airspace (`2500 ft AMSL`; `FL 65`, taken as above the sea), buildings."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, Final

from harness.files.input_file import InputError
from harness.files.wording import counted
from harness.world_files.parts import FOOT_M, LEVEL_M, NO_BOTTOM, NO_TOP, Datum, FileSpec, Limit, Part

_FEET: Final = dict.fromkeys(("FEET", "FOOT", "FT", "F"), FOOT_M)
_METRES: Final = dict.fromkeys(("METRES", "METERS", "METRE", "METER", "MTR", "M"), 1.0)
_UNIT_M: Final = {"FL": 100.0 * FOOT_M, **_FEET, **_METRES}  # length (m) of each unit; FL is a flight level
_GROUND_WORDS: Final = ("SURFACE", "GROUND", "RELATIVE", "ASFC", "AGL", "GND", "SFC")  # mean above ground
_SEA_WORDS: Final = ("AMSL", "MSL", "SEA", "STD", "QNH", "ALT", "GEOID", "MEAN", "LEVEL")  # above the sea
_DATUMS: Final = {**dict.fromkeys(_GROUND_WORDS, Datum.GROUND), **dict.fromkeys(_SEA_WORDS, Datum.SEA)}
_LIMIT_WORD: Final = re.compile("|".join(sorted((*_UNIT_M, *_DATUMS, "ABOVE"), key=len, reverse=True)))
_WORDS_BESIDE: Final = rf"((?:{_LIMIT_WORD.pattern}|[\s()'./+\N{{DEGREE SIGN}}])*)"
_NUMBER: Final = r"-?\s*(?![1-9]\d?\.\d{3}(?!\d))(?:\d+(?:\.\d*)?|\.\d+)"  # not 2.500, which is 2500 to some
_LIMIT: Final = re.compile(f"{_WORDS_BESIDE}({_NUMBER}){_WORDS_BESIDE}")
"""A number among words that a limit may consist of. Nothing is guessed of a limit with others, as `ASK 123.5`."""
_WORDED_LIMITS: Final = (  # limits that are written without a number
    (re.compile(r"SFC|GND|SURFACE|GROUND|0+(\.0*)?\s*(FT|M)?\s*(AGL|GND|ASFC|SFC)?"), NO_BOTTOM),
    (re.compile(r"(UNL|UNLTD|UNLIM|UNLIMITED|INF|INFINITE)\b.*"), NO_TOP),
    (re.compile("MSL|AMSL|SEA LEVEL"), Limit(0.0)),
)
_LOWEST_M: Final = {Datum.SEA: -2700.0, Datum.GROUND: 0.0}
"""A lower number means a limit that is not known (-9998 ft in files of the FAA), or is two limits (SFC-2500)."""
_SIDE_PREFIXES: Final = (("lower", "floor", "bottom", "min"), ("upper", "ceil", "top", "max"))
"""Beginnings of the names of attributes with a lower and with an upper limit; min and max belong to altitudes only."""
_LIMIT_KEY: Final = re.compile(  # names a limit, without underscores; unit and datum may follow, as `floorft`
    "(?:(?:lower|floor|bottom|upper|ceil(?:ing)?|top)(?:limit)?(?:val|altitude)?|(?:min|max)alt(?:itude)?)"
    "((?:ft|feet|m|metres|agl|amsl|msl|gnd)*)"
)
_OWN_UNIT_KEY: Final = re.compile("uom|unit|ref|code|datum|type")  # is in names of one limit's unit or datum
_SHARED_UNIT_KEY: Final = re.compile(  # matches an attribute with the unit or the datum of both limits
    r"uom|units?|uomdimensions|altitudeunit|(altitude|vertical|height)?reference|(vertical)?datum"
)

_LENGTH_AND_UNIT: Final = re.compile(r"([-+]?\d+(?:\.\d+)?)\s*([a-z]*)\.?")
_FEET_AND_INCHES: Final = re.compile(r"(\d+(?:\.\d+)?)\s*(?:'|ft)\s*(?:(\d+(?:\.\d+)?)\s*(?:''|\"|in)?)?")
_THOUSANDS: Final = re.compile(r"\b[1-9]\d{0,2},\d{3}\b")  # is 1200 to some, 1.2 to others: not read
_LENGTHS_M: Final = {  # metres in OpenStreetMap's units: https://wiki.openstreetmap.org/wiki/Map_features/Units
    **{name.lower(): metres for name, metres in (*_FEET.items(), *_METRES.items()) if name != "F"},
    **dict.fromkeys(("in", "inch", "inches"), FOOT_M / 12.0),
    **{"": 1.0, "cm": 0.01, "km": 1000.0},
}
_HEIGHTS: Final = (  # names of attributes with the height of a building
    "height", "building:height", "building_height", "measuredheight", "render_height", "est_height", "height_m",
    "height_ft")  # fmt: skip
_BOTTOMS: Final = ("min_height", "render_min_height", "min_height_m", "min_height_ft")  # of where it begins
_ROOFS: Final = ("roof:height", "roof_height")  # of the roof alone
_LEVELS: Final = ("building:levels", "building_levels", "levels", "num_floors", "floors", "storeys",
    "storeysaboveground")  # fmt: skip


def _unit_and_datum(words: Sequence[str]) -> tuple[str | None, Datum | None]:
    """Returns unit and datum that words name, or None; ground goes before sea, a flight level before other units."""
    unit = "FL" if "FL" in words else next((each for each in words if each in _UNIT_M), None)
    datums = [_DATUMS[each] for each in words if each in _DATUMS] + ([Datum.SEA] if unit == "FL" else [])
    return unit, Datum.GROUND if Datum.GROUND in datums and unit != "FL" else next(iter(datums), None)


def limit_of(text: str, unit: str = "FT", datum: Datum = Datum.SEA) -> Limit | None:
    """Reads a height as airspace files write it, by default in `unit` above `datum`; None where it is not known."""
    upper = " ".join(text.upper().split())
    plain = next((limit for pattern, limit in _WORDED_LIMITS if pattern.fullmatch(upper)), None)
    if plain is not None or (match := _LIMIT.fullmatch(upper)) is None:
        return plain
    own_unit, own_datum = _unit_and_datum(_LIMIT_WORD.findall(f"{match[1]} {match[3]}"))
    limit = Limit(float(match[2].replace(" ", "")) * _UNIT_M[own_unit or unit], own_datum or datum)
    return limit if limit.height_m >= _LOWEST_M[limit.datum] else None


def read_limit(value: Any, units: str, notes: list[str], name: str) -> Limit | None:
    """Reads a limit whose unit and datum `units` may name, else metres, sea level, and a note; None: not known."""
    text = f"{value:.17f}" if isinstance(value, float) else str(value) if isinstance(value, str | int) else ""
    own_unit, own_datum = _unit_and_datum(_LIMIT_WORD.findall(text.upper()))
    unit, datum = _unit_and_datum(re.findall("[A-Z]+", units.upper()))
    limit = limit_of(text, unit or "M", datum or Datum.SEA)
    if limit is None or not re.search(r"[1-9]", text):  # the surface, or nothing that is known
        return limit
    for none, what, taken in (
        ((unit, own_unit) == (None, None), "unit", "metres"),
        ((datum, own_datum) == (None, None), "known reference", "above mean sea level"),
    ):
        note = f"{name}: its limits name no {what}; taken as {taken}"
        notes += [note] if none and note not in notes[-4:] else []
    return limit


def band_of(lower: Limit | None, upper: Limit | None, notes: list[str], name: str) -> tuple[Limit, Limit]:
    """Returns bottom and top; an unknown limit or an upper one of 0 is none; limits the wrong way up are swapped."""
    subject = f"{name}: its"
    for side, limit in (("lower", lower), ("upper", upper)):
        if limit is None:
            notes.append(f"{subject} {side} limit is not known; taken as without")
    bottom, top = lower or NO_BOTTOM, upper or NO_TOP
    if top == NO_BOTTOM or (top.height_m == 0.0 and bottom.height_m in (0.0, -math.inf)):
        notes.append(f"{subject} upper limit is 0, or the surface; taken as without")
        top = NO_TOP
    if bottom == NO_TOP or (bottom.datum is top.datum and bottom.height_m > top.height_m):
        notes.append(f"{subject} lower limit lies above the upper one; taken the other way round")
        bottom, top = (NO_BOTTOM, NO_TOP) if bottom == NO_TOP else (top, bottom)
    return bottom, top


def _plain_names(tags: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the attributes that have a value, by their names in lower case without underscores."""
    return {key.lower().replace("_", ""): value for key, value in tags.items() if value is not None}


def limits(tags: Mapping[str, Any], notes: list[str], name: str) -> tuple[Limit, Limit]:
    """Reads the limits of an airspace from attributes named in any case; a bare number is metres above sea level."""
    given = _plain_names(tags)
    if "ceiling" in given and any(key.startswith(("apt1", "mapeff")) for key in given):
        raise InputError("is a facility map: one may fly up to its ceilings; give the airspace")
    found: list[Limit | None] = []
    for begins, none in zip(_SIDE_PREFIXES, (NO_BOTTOM, NO_TOP), strict=True):
        side = {key: value for key, value in given.items() if key.startswith(begins)}
        if (match := next(filter(None, map(_LIMIT_KEY.fullmatch, side)), None)) is None:
            found.append(None if has_limits(tags) else none)
            continue
        words = re.findall("ft|feet|metres|agl|amsl|msl|gnd|m", match[1])
        own = {key: value for key, value in given.items() if key.startswith(begins) or key.endswith(begins)}
        words += [str(value) for key, value in own.items() if _OWN_UNIT_KEY.search(key)]
        words += [str(value) for key, value in given.items() if _SHARED_UNIT_KEY.fullmatch(key)]
        found.append(read_limit(side[match[0]], " ".join(words), notes, name))
    return band_of(found[0], found[1], notes, name)


def has_limits(tags: Mapping[str, Any]) -> bool:
    """Tells whether attributes give a limit of an airspace."""
    return any(map(_LIMIT_KEY.fullmatch, _plain_names(tags)))


def metres_of(value: Any) -> float | None:
    """Reads a length (`12`, `12.5 m`, `40 ft`, `7'4"`), in metres unless it names a unit; None where it is none."""
    if isinstance(value, bool) or value is None or _THOUSANDS.search(str(value)):
        return None
    if isinstance(value, int | float):
        return float(value) if math.isfinite(value) else None
    text = str(value).strip().lower().replace("\N{RIGHT SINGLE QUOTATION MARK}", "'").replace(",", ".")
    if (match := _LENGTH_AND_UNIT.fullmatch(text)) and match[2] in _LENGTHS_M:
        return float(match[1]) * _LENGTHS_M[match[2]]
    if match := _FEET_AND_INCHES.fullmatch(text):
        return (float(match[1]) + float(match[2] or 0.0) / 12.0) * FOOT_M
    return None


def _largest_m(value: Any) -> float:
    """Reads a length (m); of any other text, such as a list or a range, it takes the largest number, else 0."""
    plain = metres_of(value)
    numbers = map(float, re.findall(r"\d+(?:\.\d*)?", str(value)[:100])) if plain is None else (plain,)
    return max((each for each in numbers if math.isfinite(each)), default=0.0)


def _unit_of(name: str, tags: Mapping[str, Any]) -> str:
    """The unit of a bare number: that at the end of its attribute's name, else what an attribute of the unit says."""
    ends = name.rpartition("_")[2] if name.endswith(("_m", "_ft")) else ""
    said = (str(tags.get(each, "")).lower() for each in ("units", "unit", "uom"))
    return ends or next((each for each in said if each in _LENGTHS_M), "")


class Buildings:
    """The buildings of one file, with counts of heights that are missing or odd for the notes."""

    def __init__(self, spec: FileSpec) -> None:
        self._default_m, self._guessed = spec.default_height_m, 0
        self._odd = Counter[str]()  # heights that are no plain length, and how often each comes

    def part(self, tags: Mapping[str, Any], footprint: Any, name: str = "") -> Part:
        """Returns a building as a part, by its OpenStreetMap tags, named in any case.

        `height` is that of the whole building; else there are storeys (`building:levels`) of 3 m each and above them
        the roof, `roof:height` or else `roof:levels` of 3 m each. It begins at `min_height`, or `building:min_level`
        times 3 m, else at the ground; without a height above that it is `default_height_m` high, or its higher roof.
        """
        tags = {key.lower(): value for key, value in tags.items()}
        top = self._length_m(tags, _HEIGHTS)
        levels, roof = (0.0 if top else self._length_m(tags, each) for each in (_LEVELS, _ROOFS))
        if levels or (not top and any(metres_of(tags.get(name)) == 0.0 for name in _LEVELS)):  # 0: all roof
            top = LEVEL_M * levels + (roof or LEVEL_M * self._length_m(tags, ("roof:levels",)))
        bottom = self._length_m(tags, _BOTTOMS, bottom=True)
        bottom = bottom or LEVEL_M * self._length_m(tags, ("building:min_level", "min_level"), bottom=True)
        if top <= max(bottom, 0.0):
            top = max(bottom, 0.0) + max(self._default_m, roof)
            self._guessed += roof <= self._default_m
        begin = NO_BOTTOM if bottom <= 0.0 else Limit(bottom, Datum.GROUND)
        return Part(footprint, begin, Limit(top, Datum.GROUND), name=name, rigid=True)

    def _length_m(self, tags: Mapping[str, Any], names: Sequence[str], bottom: bool = False) -> float:
        """Reads the first of some attributes that is above zero, or of a `bottom` a plain length; 0 where none is."""
        for name in names:
            if (given := tags.get(name)) is None:
                continue
            if name in (*_HEIGHTS, *_BOTTOMS, *_ROOFS) and re.fullmatch(r"[\d.]+", str(given)):
                given = f"{given} {_unit_of(name, tags)}"
            plain = metres_of(given)
            if plain is None or (plain < 0.0 and not bottom):
                self._odd[f"{name}={str(given)[:20]!r}"] += 1
            found = (plain or 0.0) if bottom else _largest_m(given)
            if found > 0.0 or (bottom and plain is not None):
                return found
        return 0.0

    def notes(self) -> list[str]:
        """Returns notes on buildings without a height and on heights that are no plain length."""
        notes = []
        if self._guessed:
            text = f"{counted(self._guessed, 'building')} without height and levels above where they begin"
            notes.append(f"{text} taken as {self._default_m:g} m high (default_height_m)")
        if self._odd:
            text = f"{counted(self._odd.total(), 'height')} of buildings no plain length, {next(iter(self._odd))}"
            text += " the first: the largest number in it is taken, in metres"
            notes.append(f"{text}; of a bottom the ground; nothing below 0")
        return notes


def is_building(tags: Mapping[str, Any]) -> bool:
    """Tells whether attributes are a building's: by a `building` key, or by a height without airspace limits."""
    if any(str(tags.get(name) or "no") != "no" for name in ("building", "building:part")):
        return True
    lower = {key.lower(): value for key, value in tags.items()}
    return not has_limits(tags) and any(_largest_m(lower.get(name)) > 0.0 for name in (*_HEIGHTS, *_LEVELS))


def name_of(tags: Mapping[str, Any]) -> str:
    """Returns the name of a feature, for messages; empty where it has none."""
    named = {key.lower(): value for key, value in tags.items()}
    name = named.get("name") or named.get("identifier") or ""
    return (name if isinstance(name, str) else str(named.get("identifier") or ""))[:40]


def parts_of(features: Sequence[tuple[Mapping[str, Any], Any]], spec: FileSpec, notes: list[str]) -> tuple[Part, ...]:
    """Turns features (attributes, footprint) into parts: buildings by their heights, all others by their limits."""
    parts, buildings, bare = [], Buildings(spec), 0
    for tags, footprint in features:
        name = name_of(tags)
        if is_building(tags):
            parts.append(buildings.part(tags, footprint, name))
        else:
            bare += not has_limits(tags)
            parts.append(Part(footprint, *limits(tags, notes, name), name=name))
    notes += buildings.notes()
    if bare:
        notes.append(f"{counted(bare, 'polygon')} without height limits taken as solid at every altitude")
    return tuple(parts)
