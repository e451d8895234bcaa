"""Heights as texts and attributes: `2500 ft AMSL`, `FL 65`, `100m GND`, `SFC`; heights of buildings.

A flight level is taken as an altitude above mean sea level, as it is in the standard atmosphere.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any, Final

from harness.world_files.parts import FOOT_M, LEVEL_M, NO_BOTTOM, NO_TOP, Datum, Limit, Part, Reading

_NUMBER: Final = re.compile(r"[-+]?\d+(?:\.\d*)?|[-+]?\.\d+")
_SURFACE: Final = re.compile(r"^(SFC|GND|SURFACE|GROUND|0+(\s*(FT|M))?(\s*(AGL|GND|SFC))?)$")
_NO_END: Final = re.compile(r"^(UNL|UNLIM|UNLIMITED|INF|INFINITE)\b")
_GROUND: Final = re.compile(r"AGL|GND|SFC|GROUND|RELATIVE")
_METRES: Final = re.compile(r"\d\s*(M|METRES|METERS)\b")
_LOWER: Final = (
    "lowerLimit",
    "lower_limit",
    "lower",
    "floor",
    "bottom",
    "lowerAltitude",
    "minAltitude",
    "altMin",
)
_UPPER: Final = (
    "upperLimit",
    "upper_limit",
    "upper",
    "ceiling",
    "top",
    "upperAltitude",
    "maxAltitude",
    "altMax",
)
_HEIGHT: Final = ("height", "building_height", "measuredHeight", "render_height", "bldg_height", "hoehe")
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
    number = _NUMBER.search(word)
    if number is None:
        return None
    value = float(number[0])
    if "FL" in word:
        return Limit(value * 100.0 * FOOT_M)
    metres = bool(_METRES.search(word)) if re.search(r"\d\s*(FT|F\b|M)", word) else not feet
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
    if match := re.fullmatch(r"(\d+)'(?:(\d+)(?:''|\"))?", text):
        return (float(match[1]) + float(match[2] or 0) / 12.0) * FOOT_M
    if match := re.match(r"([-+]?\d+(?:\.\d+)?)\s*(m\b|metres|meters|ft\b|feet|$)", text):
        return float(match[1]) * (FOOT_M if match[2] in ("ft", "feet") else 1.0)
    return None


def building(tags: Mapping[str, Any], footprint: Any, reading: Reading, name: str = "") -> tuple[Part, bool]:
    """A building from its tags, and whether its height had to be guessed.

    The rule: `height`; else storeys (`building:levels` and `roof:levels`) of 3 m each; else `default_height_m`. It
    begins at `min_height`, else `building:min_level` times 3 m, else at the ground.

    Args:
        tags: attributes by name, as OpenStreetMap has them.
        footprint: shapely geometry.
        reading: has the default height.
        name: for messages.
    """
    top = _first(tags, _HEIGHT)
    levels = _first(tags, _LEVELS)
    guessed = top is None and levels is None
    if top is None:
        roof = _first(tags, ("roof:levels", "roof_levels")) or 0.0
        top = reading.default_height_m if levels is None else (levels + roof) * LEVEL_M
    bottom = _first(tags, _MIN_HEIGHT)
    if bottom is None:
        bottom = (_first(tags, _MIN_LEVEL) or 0.0) * LEVEL_M
    begin = NO_BOTTOM if bottom <= 0.0 else Limit(min(bottom, top), Datum.GROUND)
    return Part(footprint, begin, Limit(top, Datum.GROUND), name=name, rigid=True), guessed


def is_building(tags: Mapping[str, Any]) -> bool:
    """Whether attributes are those of a building."""
    if any(str(tags.get(name) or "no") != "no" for name in ("building", "building:part")):
        return True
    return any(_first(tags, names) is not None for names in (_HEIGHT, _LEVELS)) and not has_limits(tags)


def has_limits(tags: Mapping[str, Any]) -> bool:
    """Whether attributes give the limits of an airspace."""
    return any(tags.get(name) is not None for name in (*_LOWER, *_UPPER))


def limits(tags: Mapping[str, Any], notes: list[str], name: str) -> tuple[Limit, Limit]:
    """Limits of an airspace from attributes; a number alone is in metres unless `uom` or `unit` says feet."""
    unit = str(tags.get("uom") or tags.get("unit") or tags.get("uomDimensions") or "m").lower()
    found: list[Limit | None] = []
    for names, none, word in ((_LOWER, NO_BOTTOM, "lower"), (_UPPER, NO_TOP, "upper")):
        value = next((tags[each] for each in names if tags.get(each) is not None), None)
        reference = str(next((tags[each] for each in tags if str(each).lower().startswith(word)
                             and "refer" in str(each).lower()), "")).upper()  # fmt: skip
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
        return Limit(value * (FOOT_M if unit.startswith("f") else 1.0), datum)
    return limit_of(str(value), unit.startswith("f"), datum)


def _first(tags: Mapping[str, Any], names: tuple[str, ...]) -> float | None:
    """The first of some attributes that is a length or a number."""
    for name in names:
        value = metres_of(tags[name]) if name in tags else None
        if value is not None:
            return value
    return None
