"""Heights as texts and attributes: `2500 ft AMSL`, `FL 65`, `100m GND`, `SFC`; heights of buildings.

A flight level is taken as an altitude above mean sea level, as it is in the standard atmosphere.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping
from typing import Any, Final

from harness.world_files.parts import FOOT_M, LEVEL_M, NO_BOTTOM, NO_TOP, Datum, Limit, Part, Reading, counted

_NUMBER: Final = re.compile(r"[-+]?\d+(?:\.\d*)?|[-+]?\.\d+")
_SURFACE: Final = re.compile(r"^(SFC|GND|SURFACE|GROUND|0+(\s*(FT|M))?(\s*(AGL|GND|ASFC|SFC))?)$")
_NO_END: Final = re.compile(r"^(UNL|UNLTD|UNLIM|UNLIMITED|INF|INFINITE)\b")
_GROUND: Final = re.compile(r"AGL|GND|SFC|GROUND|RELATIVE")
_WORD: Final = re.compile(
    r"\d+(?:[.,]\d*)?|\.\d+|[-+]|AMSL|MSL|METRES|METERS|METER|METRE|MEAN|MTR|FEET|FL|FT|F|"
    r"M(?!\w)|M(?=AMSL|MSL|AGL|ASFC|GND|SFC)|AGL|ASFC|GND|SFC|GROUND|ALT|STD|QNH|ABOVE|SEA|LEVEL|RELATIVE|[()'./]"
)
"""Words that a limit may consist of. Of others, as `ASK 123.5`, nothing is guessed."""
_METRES: Final = re.compile(r"\d\s*(M|METRES?|METERS?|MTR)(?=\b|AMSL|MSL|AGL|ASFC|GND|SFC)")
_LOWER: Final = (
    "lowerlimit",
    "lower_limit",
    "lower",
    "lower_val",
    "floor",
    "bottom",
    "loweraltitude",
    "minaltitude",
    "altmin",
    "minalt",
    "lower_limit_altitude",
    *(f"{name}_{unit}" for name in ("lower", "lower_limit", "floor", "bottom") for unit in ("ft", "m")),
)
_UPPER: Final = (
    "upperlimit",
    "upper_limit",
    "upper",
    "upper_val",
    "ceiling",
    "top",
    "upperaltitude",
    "maxaltitude",
    "altmax",
    "maxalt",
    "upper_limit_altitude",
    *(f"{name}_{unit}" for name in ("upper", "upper_limit", "ceiling", "top") for unit in ("ft", "m")),
)
_FEET: Final = "_ft"
_UNITS: Final = ("uom", "unit")
"""What the name of an attribute has that says in what unit a limit is."""
_REFERENCES: Final = ("refer", "_ref", "code", "datum")
"""What the name of an attribute has that says what a limit is counted from, as `lowerReference`, `UPPER_CODE`."""
NO_NUMBER: Final = -9000.0
"""Limits so low stand for one that is not known, as -9998 of the FAA's files."""
_HEIGHT: Final = (
    "height",
    "building:height",
    "building_height",
    "measuredheight",
    "render_height",
    "bldg_height",
    "est_height",
    "hoehe",
)
_LEVELS: Final = (
    "building:levels",
    "building_levels",
    "levels",
    "num_floors",
    "floors",
    "storeys",
    "stories",
)
_MIN_HEIGHT: Final = ("min_height", "render_min_height", "base_height")
_MIN_LEVEL: Final = ("building:min_level", "min_level", "min_floor")


def limit_of(text: str, feet: bool = True, datum: Datum = Datum.SEA) -> Limit | None:
    """A height as airspace files write it.

    Args:
        text: as `2500 ft AMSL`, `FL 65`, `100m GND`, `UNLIM`.
        feet: unit of a number without one.
        datum: what it is counted from where it says nothing.

    Returns:
        The limit; NO_BOTTOM for the surface; None where it cannot be told.
    """
    word = " ".join(text.upper().replace("\N{DEGREE SIGN}", " ").split())
    if _SURFACE.match(word):
        return NO_BOTTOM
    if _NO_END.match(word):
        return NO_TOP
    if word in ("MSL", "AMSL", "SEA LEVEL"):
        return Limit(0.0)
    number = _NUMBER.search(word)
    if number is None or _WORD.sub("", word).strip() or len(_NUMBER.findall(word)) > 1:
        return None
    value = float(number[0])
    if value <= NO_NUMBER:
        return None
    if "FL" in word:
        return Limit(value * 100.0 * FOOT_M)
    metres = bool(_METRES.search(word)) if re.search(r"\d\s*(FT|FEET|F\b|M(?!SL))", word) else not feet
    ground = _GROUND.search(word) is not None or (
        datum is Datum.GROUND and not re.search("MSL|STD|ALT", word)
    )
    return Limit(value * (1.0 if metres else FOOT_M), Datum.GROUND if ground else Datum.SEA)


def band_of(lower: Limit | None, upper: Limit | None, notes: list[str], name: str) -> tuple[Limit, Limit]:
    """Bottom and top: what is not known is no limit, and limits that are the wrong way round are turned."""
    if lower is None or upper is None:
        which = "lower" if lower is None else "upper"
        notes.append(f"{name or 'a part'}: its {which} limit is not known; taken as without one")
    bottom, top = lower or NO_BOTTOM, upper or NO_TOP
    if top == NO_BOTTOM:  # an upper limit of the surface: the zone has no height
        top = Limit(0.0, Datum.GROUND)
    if bottom == NO_TOP or (bottom.datum is top.datum and bottom.height_m > top.height_m):
        notes.append(
            f"{name or 'a part'}: its lower limit lies above the upper one; taken the other way round"
        )
        bottom, top = (NO_BOTTOM if bottom == NO_TOP else top), (NO_TOP if bottom == NO_TOP else bottom)
    return bottom, top


def metres_of(value: Any) -> float | None:
    """A height of a building, in metres unless it says feet: `12`, `12.5 m`, `40 ft`, feet and inches with marks."""
    if isinstance(value, bool) or value is None:
        return None
    if isinstance(value, int | float):
        return float(value) if math.isfinite(value) else None
    text = str(value).strip().lower().replace(",", ".")
    if text.isdecimal():
        return float(text)
    if match := re.fullmatch(r"(\d+)'(?:(\d+)(?:''|\"))?", text):
        return (float(match[1]) + float(match[2] or 0) / 12.0) * FOOT_M
    if match := re.fullmatch(r"([-+]?\d+(?:\.\d+)?)\s*(|m|mtr|metres?|meters?|ft|foot|feet)\.?", text):
        return float(match[1]) * (FOOT_M if match[2].startswith("f") else 1.0)
    return None


def building(
    tags: Mapping[str, Any], footprint: Any, reading: Reading, unknown: Counter[str], name: str = ""
) -> Part:
    """A building from its tags.

    The rule: `height`; else storeys (`building:levels` and `roof:levels`) of 3 m each; else `default_height_m`. It
    begins at `min_height`, else `building:min_level` times 3 m, else at the ground. Names are told in any case. A
    height of zero or less says nothing: some files mean by -1 that it is not known.

    Args:
        tags: attributes by name, as OpenStreetMap has them.
        footprint: shapely geometry.
        reading: has the default height.
        unknown: counts the buildings whose height had to be guessed, and heights that cannot be read.
        name: for messages.
    """
    tags = {key.lower(): value for key, value in tags.items()}
    top = _first(tags, _HEIGHT, unknown)
    levels = None if top is not None else _first(tags, _LEVELS, unknown)
    if top is None and levels is not None:
        top = (levels + (_first(tags, ("roof:levels", "roof_levels"), unknown) or 0.0)) * LEVEL_M
    if top is None:
        top = reading.default_height_m
        unknown[GUESSED] += 1
    bottom = _first(tags, _MIN_HEIGHT, unknown, least=True)
    if bottom is None:
        bottom = (_first(tags, _MIN_LEVEL, unknown, least=True) or 0.0) * LEVEL_M
    begin = NO_BOTTOM if bottom <= 0.0 else Limit(min(bottom, top), Datum.GROUND)
    return Part(footprint, begin, Limit(top, Datum.GROUND), name=name, rigid=True)


GUESSED: Final = ""
"""Counts, in `unknown` of `building`, those of which no height is known."""


def building_notes(unknown: Counter[str], reading: Reading) -> list[str]:
    """What is said of buildings whose height is not known, or cannot be read."""
    notes = []
    if unknown[GUESSED]:
        notes.append(
            f"{counted(unknown[GUESSED], 'building')} without height and levels taken as "
            f"{reading.default_height_m:g} m high (default_height_m)"
        )
    strange = {text: count for text, count in unknown.items() if text != GUESSED}
    if strange:
        notes.append(
            f"{counted(sum(strange.values()), 'height')} of buildings say nothing, {next(iter(strange))} the first"
        )
    return notes


def is_building(tags: Mapping[str, Any]) -> bool:
    """Whether attributes are those of a building."""
    if any(str(tags.get(name) or "no") != "no" for name in ("building", "building:part")):
        return True
    lower = {key.lower(): value for key, value in tags.items()}
    return any(_first(lower, names) is not None for names in (_HEIGHT, _LEVELS)) and not has_limits(tags)


def has_limits(tags: Mapping[str, Any]) -> bool:
    """Whether attributes give the limits of an airspace."""
    return any(tags[key] is not None for key in tags if key.lower() in _LOWER or key.lower() in _UPPER)


def limits(tags: Mapping[str, Any], notes: list[str], name: str) -> tuple[Limit, Limit]:
    """Limits of an airspace from attributes, named in any case; a number alone is in metres unless a unit says feet."""
    tags = {key.lower(): value for key, value in tags.items() if value is not None}
    found: list[Limit | None] = []
    for names, none, word in ((_LOWER, NO_BOTTOM, "lower"), (_UPPER, NO_TOP, "upper")):
        key = next((each for each in names if each in tags), None)
        value = None if key is None else tags[key]
        units = [each for each in tags if each.startswith(word) and any(u in each for u in _UNITS)]
        unit = next(
            (str(tags[each]) for each in (*units, *_UNITS, "uomdimensions") if each in tags), "m"
        ).lower()
        if key is not None and key.endswith(_FEET):
            unit = "ft"
        reference = next(
            (str(tags[each]).upper() for each in tags if each.startswith(word) and any(r in each for r in _REFERENCES)),
            "",
        )  # fmt: skip
        datum = Datum.GROUND if _GROUND.search(reference) else Datum.SEA
        found.append(none if value is None else _limit(value, unit, datum))
    return band_of(found[0], found[1], notes, name)


def _limit(value: Any, unit: str, datum: Datum) -> Limit | None:
    """A limit as a number, a text, or a mapping as openAIP has it: unit 1 feet, 6 flight level; datum 0 ground."""
    if isinstance(value, Mapping):
        number = metres_of(value.get("value"))
        kind, reference = value.get("unit"), value.get("referenceDatum", value.get("reference"))
        if number is None:
            return None
        if kind in (6, "FL"):
            return Limit(number * 100.0 * FOOT_M)
        ground = reference == 0 or bool(_GROUND.search(str(reference).upper()))
        if ground and number == 0.0:
            return NO_BOTTOM
        return Limit(
            number * (FOOT_M if kind in (1, "FT", "ft") else 1.0), Datum.GROUND if ground else Datum.SEA
        )
    if isinstance(value, int | float) and not isinstance(value, bool):
        if datum is Datum.GROUND and value == 0:
            return NO_BOTTOM
        if value <= NO_NUMBER:
            return None
        if unit == "fl":
            return Limit(value * 100.0 * FOOT_M)
        return Limit(value * (FOOT_M if unit.startswith("f") else 1.0), datum)
    return limit_of(str(value), unit.startswith("f"), datum)


def _first(
    tags: Mapping[str, Any], names: tuple[str, ...], unknown: Counter[str] | None = None, least: bool = False
) -> float | None:
    """The first of some attributes that is a length or a number; of a list the largest, or the least.

    Args:
        tags: attributes by lower-case name.
        names: of which the first that says something counts.
        unknown: counts what says nothing: no number, or none above zero.
        least: of the bottom of a building, which may be 0.
    """
    for name in names:
        if (given := tags.get(name)) is None:
            continue
        values = [metres_of(each) for each in (given.split(";") if isinstance(given, str) else [given])]
        known = [each for each in values if each is not None]
        if len(known) == len(values) and (least or max(known) > 0):
            return min(known) if least else max(known)
        if unknown is not None and known != [0.0]:
            unknown[f"{name}={str(given)[:20]!r}"] += 1
    return None
