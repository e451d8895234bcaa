"""Heights as texts and attributes: `2500 ft AMSL`, `FL 65`, `100m GND`, `SFC`; heights of buildings.

A flight level is taken as an altitude above mean sea level, as it is in the standard atmosphere.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from harness.files.wording import counted
from harness.world_files.parts import FOOT_M, LEVEL_M, NO_BOTTOM, NO_TOP, Datum, Limit, Part, Reading
from harness.world_files.readers.lengths import lengths_of, metres_of

_NUMBER: Final = re.compile(r"[-+]?\d+(?:\.\d*)?|[-+]?\.\d+")
_SURFACE: Final = re.compile(r"^(SFC|GND|SURFACE|GROUND|0+(\s*(FT|M))?(\s*(AGL|GND|ASFC|SFC))?)$")
_NO_END: Final = re.compile(r"^(UNL|UNLTD|UNLIM|UNLIMITED|INF|INFINITE)\b")
_GROUND: Final = re.compile(r"AGL|GND|SFC|GROUND|SURFACE|RELATIVE")
_REFERENCE: Final = re.compile(r"AGL|GND|SFC|GROUND|SURFACE|RELATIVE|SL|SEA|STD|FL|QNH|WGS|GEOID|TI\b")
_WORD: Final = re.compile(
    r"\d+(?:[.,]\d*)?|\.\d+|[-+]|AMSL|MSL|METRES|METERS|METER|METRE|MEAN|MTR|FEET|FL|FT|F|"
    r"M(?!\w)|M(?=AMSL|MSL|AGL|ASFC|GND|SFC)|AGL|ASFC|GND|SFC|GROUND|ALT|STD|QNH|ABOVE|SEA|LEVEL|RELATIVE|[()'./]"
)
"""Words that a limit may consist of. Of others, as `ASK 123.5`, nothing is guessed."""
_METRES: Final = re.compile(r"\d\s*(M|METRES?|METERS?|MTR)(?=\b|AMSL|MSL|AGL|ASFC|GND|SFC)")
_LOWER: Final = (
    "lowerlimit", "lower", "lowerval", "floor", "bottom", "loweraltitude", "minaltitude", "altitudemin", "altmin",
    "minalt", "lowerlimitaltitude",
)  # fmt: skip
_UPPER: Final = (
    "upperlimit", "upper", "upperval", "ceiling", "top", "upperaltitude", "maxaltitude", "altitudemax", "altmax",
    "maxalt", "upperlimitaltitude",
)  # fmt: skip
"""Names of limits without their underscores; unit and reference may follow, as in `floor_ft_agl`."""
_TAILS: Final = frozenset(("ft", "feet", "m", "metres", "meters", "agl", "amsl", "msl", "gnd"))
_BEGINS: Final = {"lower": ("lower", "min", "floor", "bottom"), "upper": ("upper", "max", "ceiling", "top")}
"""Beginnings of the names of attributes that belong to one of the limits."""
_UNITS: Final = ("uom", "unit")
"""Parts of the name of an attribute with the unit of a limit."""
_BOTH_UNITS: Final = ("uom", "unit", "units", "uomdimensions", "altitudeunit", "unitofmeasure")
_REFERENCES: Final = ("ref", "code", "datum", "type")
"""Parts of the name of an attribute with the reference of a limit, as `lowerReference`, `UPPER_CODE`."""
_BOTH_REFERENCES: Final = (
    "reference", "altitudereference", "verticalreference", "datum", "verticaldatum", "altituderef", "altitudedatum",
    "altitudetype", "heightreference",
)  # fmt: skip
_GRID: Final = ("apt1_", "map_eff")
"""What attributes begin with in the facility maps of the FAA."""
NO_NUMBER: Final = -9000.0
"""Limits so low stand for one that is not known, as -9998 of the FAA's files."""
_HEIGHT: Final = (
    "height", "building:height", "building_height", "measuredheight", "render_height", "bldg_height", "est_height",
    "hoehe",
)  # fmt: skip
_LEVELS: Final = (
    "building:levels", "building_levels", "levels", "num_floors", "floors", "storeys", "stories",
)  # fmt: skip
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
    if ground and value < 0.0:  # as in SFC-2500, which says where a zone begins as well
        return None
    return Limit(value * (1.0 if metres else FOOT_M), Datum.GROUND if ground else Datum.SEA)


def band_of(lower: Limit | None, upper: Limit | None, notes: list[str], name: str) -> tuple[Limit, Limit]:
    """Bottom and top: what is not known is no limit, and limits that are the wrong way round are turned.

    Files write an upper limit of 0 where there is none; a zone of no height would forbid nothing.
    """
    if lower is None or upper is None:
        which = (
            "lower limit is" if upper is not None else "upper limit is" if lower is not None else "limits are"
        )
        notes.append(f"{name or 'a part'}: its {which} not known; taken as without")
    bottom, top = lower or NO_BOTTOM, upper or NO_TOP
    if top == NO_BOTTOM or (top.height_m == 0.0 and bottom.height_m in (0.0, -math.inf)):
        notes.append(f"{name or 'a part'}: its upper limit is 0, or the surface; taken as without")
        top = NO_TOP
    if bottom == NO_TOP or (bottom.datum is top.datum and bottom.height_m > top.height_m):
        notes.append(
            f"{name or 'a part'}: its lower limit lies above the upper one; taken the other way round"
        )
        bottom, top = (NO_BOTTOM if bottom == NO_TOP else top), (NO_TOP if bottom == NO_TOP else bottom)
    return bottom, top


@dataclass
class Doubts:
    """What has to be said of the heights of buildings.

    Attributes:
        guessed: buildings of which no height is known.
        strange: heights that say nothing, and how often each comes.
        rough: heights that are approximate, lists or ranges, likewise.
    """

    guessed: int = 0
    strange: Counter[str] = field(default_factory=Counter)
    rough: Counter[str] = field(default_factory=Counter)

    def notes(self, reading: Reading) -> list[str]:
        """A line of each."""
        notes = []
        if self.guessed:
            notes.append(
                f"{counted(self.guessed, 'building')} without height and levels taken as "
                f"{reading.default_height_m:g} m high (default_height_m)"
            )
        if self.strange:
            first = next(iter(self.strange))
            notes.append(
                f"{counted(self.strange.total(), 'height')} of buildings say nothing, {first} the first"
            )
        if self.rough:
            first = next(iter(self.rough))
            notes.append(
                f"{counted(self.rough.total(), 'height')} of buildings approximate, a list or a range, {first} the "
                "first: taken as they stand, of several the one that makes the building larger"
            )
        return notes


def building(
    tags: Mapping[str, Any], footprint: Any, reading: Reading, doubts: Doubts, name: str = ""
) -> Part:
    """A building from its tags.

    The rule: `height`, which is that of the whole building; else storeys (`building:levels`) of 3 m each, and above
    them the roof, `roof:height` or else `roof:levels` of 3 m each; else `default_height_m`. It
    begins at `min_height`, else `building:min_level` times 3 m, else at the ground. Names are told in any case. A
    height of zero or less says nothing: some files mean by -1 that it is not known.

    Args:
        tags: attributes by name, as OpenStreetMap has them.
        footprint: shapely geometry.
        reading: has the default height.
        doubts: are added to.
        name: for messages.
    """
    tags = {key.lower(): value for key, value in tags.items()}
    top = _first(tags, _HEIGHT, doubts)
    levels = None if top is not None else _first(tags, _LEVELS, doubts)
    if top is None and levels is not None:
        roof = _first(tags, ("roof:height", "roof_height"), doubts)
        if roof is None:
            roof = (_first(tags, ("roof:levels", "roof_levels"), doubts) or 0.0) * LEVEL_M
        top = levels * LEVEL_M + roof
    if top is None:
        top = reading.default_height_m
        doubts.guessed += 1
    bottom = _first(tags, _MIN_HEIGHT, doubts, least=True)
    if bottom is None:
        bottom = (_first(tags, _MIN_LEVEL, doubts, least=True) or 0.0) * LEVEL_M
    begin = NO_BOTTOM if bottom <= 0.0 else Limit(min(bottom, top), Datum.GROUND)
    return Part(footprint, begin, Limit(top, Datum.GROUND), name=name, rigid=True)


def parts_of(
    features: Sequence[tuple[Mapping[str, Any], Any]], reading: Reading, notes: list[str]
) -> tuple[Part, ...]:
    """Features as parts: buildings by their heights, all others by their limits.

    Args:
        features: attributes and footprint of each.
        reading: has the default height of buildings.
        notes: are added to.
    """
    parts, doubts, bare = [], Doubts(), 0
    for tags, footprint in features:
        name = name_of(tags)
        if is_building(tags):
            parts.append(building(tags, footprint, reading, doubts, name))
        else:
            bare += not has_limits(tags)
            parts.append(Part(footprint, *limits(tags, notes, name), name=name))
    notes += doubts.notes(reading)
    if bare:
        notes.append(f"{counted(bare, 'polygon')} without height limits taken as solid at every altitude")
    return tuple(parts)


def name_of(tags: Mapping[str, Any]) -> str:
    """The name of a feature for messages."""
    named = {key.lower(): value for key, value in tags.items()}
    name = named.get("name") or named.get("identifier") or ""
    return (name if isinstance(name, str) else str(named.get("identifier") or ""))[:40]


def is_building(tags: Mapping[str, Any]) -> bool:
    """Whether attributes are those of a building."""
    if any(str(tags.get(name) or "no") != "no" for name in ("building", "building:part")):
        return True
    lower = {key.lower(): value for key, value in tags.items()}
    return any(_first(lower, names) is not None for names in (_HEIGHT, _LEVELS)) and not has_limits(tags)


def has_limits(tags: Mapping[str, Any]) -> bool:
    """Whether attributes give the limits of an airspace."""
    return any(tags[key] is not None and _parted(key)[0] in (*_LOWER, *_UPPER) for key in tags)


def _parted(key: str) -> tuple[str, frozenset[str]]:
    """The name of an attribute without underscores, and the unit and the reference that it ends with."""
    words = key.lower().split("_")
    count = next((k for k, word in enumerate(reversed(words)) if word not in _TAILS), len(words))
    return "".join(words[: len(words) - count]), frozenset(words[len(words) - count :])


def limits(tags: Mapping[str, Any], notes: list[str], name: str) -> tuple[Limit, Limit]:
    """Limits of an airspace from attributes, named in any case; a number alone is in metres unless a unit says feet.

    A limit without a reference is taken as above mean sea level, which is noted.
    """
    lower = {key.lower(): value for key, value in tags.items() if value is not None}
    if "ceiling" in lower and any(key.startswith(_GRID) for key in lower):
        return _above_the_grid(lower, notes)
    parted = [(*_parted(key), value) for key, value in lower.items()]
    said = {key.replace("_", ""): str(value) for key, value in lower.items()}
    found: list[Limit | None] = []
    bare = alone = False
    for names, none, word in ((_LOWER, NO_BOTTOM, "lower"), (_UPPER, NO_TOP, "upper")):
        given = next((each for known in names for each in parted if each[0] == known), None)
        if given is None:
            found.append(none)
            continue
        _, ends, value = given
        unit = "ft" if ends & {"ft", "feet"} else _said(said, word, _UNITS, _BOTH_UNITS)
        alone |= not unit and not ends & {"m", "metres", "meters"} and _is_number(value)
        reference = " ".join(ends & {"agl", "gnd", "amsl", "msl"})
        reference = (reference or _said(said, word, _REFERENCES, _BOTH_REFERENCES)).upper()
        datum = Datum.GROUND if _GROUND.search(reference) else Datum.SEA
        limit = _limit(value, (unit or "m").lower(), datum)
        found.append(limit)
        told = unit.upper() == "FL" or _REFERENCE.search(reference) is not None
        bare |= not told and limit is not None and _bare(value, limit)
    if alone:
        notes.append(f"{name or 'a part'}: its limits name no unit; taken as metres")
    if bare:
        notes.append(f"{name or 'a part'}: its limits name no reference; taken as above mean sea level")
    return band_of(found[0], found[1], notes, name)


def _said(said: Mapping[str, str], word: str, has: tuple[str, ...], both: tuple[str, ...]) -> str:
    """What an attribute says of one of the limits, else one that says it of both; empty where none does."""
    own = (each for each in said if each.startswith(_BEGINS[word]) and any(part in each for part in has))
    return next((said[each] for each in (*own, *both) if each in said), "")


def _is_number(value: Any) -> bool:
    """Whether a limit is a number other than zero, and says nothing of its unit."""
    try:
        return not isinstance(value, Mapping) and float(value) not in (0.0, -9998.0)
    except (TypeError, ValueError):
        return False


def _bare(value: Any, limit: Limit) -> bool:
    """Whether a limit is a height of which nothing says what it is counted from."""
    if isinstance(value, Mapping):
        return "referenceDatum" not in value and "reference" not in value
    if not math.isfinite(limit.height_m) or limit.height_m == 0.0:
        return False
    return not re.search(r"FL|SL|AGL|GND|SFC|GROUND|RELATIVE|ALT|STD|QNH|SEA", str(value).upper())


def _above_the_grid(tags: Mapping[str, Any], notes: list[str]) -> tuple[Limit, Limit]:
    """A cell of a facility map of the FAA: its ceiling is the height up to which one may fly."""
    ceiling = metres_of(tags["ceiling"])
    if ceiling is None:
        return NO_BOTTOM, NO_TOP
    notes.append("cells of a facility map of the FAA: solid above their ceiling, in feet above ground")
    return (NO_BOTTOM if ceiling <= 0.0 else Limit(ceiling * FOOT_M, Datum.GROUND)), NO_TOP


def _limit(value: Any, unit: str, datum: Datum) -> Limit | None:
    """A limit as a number, a text, or a mapping as openAIP has it: unit 1 feet, 6 flight level; datum 0 ground."""
    if isinstance(value, Mapping):
        reference = value.get("referenceDatum", value.get("reference"))
        ground = reference == 0 or _GROUND.search(str(reference).upper()) is not None
        datum = Datum.GROUND if ground else Datum.SEA
        unit = {1: "ft", 6: "fl"}.get(value.get("unit"), str(value.get("unit"))).lower()  # type: ignore[arg-type]
        value = metres_of(value.get("value"))
    if isinstance(value, bool) or not isinstance(value, int | float | None):
        return limit_of(str(value), unit.startswith("f"), datum)
    if value is None or value <= NO_NUMBER:
        return None
    if unit == "fl":
        return Limit(value * 100.0 * FOOT_M)
    if datum is Datum.GROUND and value == 0:
        return NO_BOTTOM
    return Limit(value * (FOOT_M if unit.startswith("f") else 1.0), datum)


def _first(
    tags: Mapping[str, Any], names: tuple[str, ...], doubts: Doubts | None = None, least: bool = False
) -> float | None:
    """The first of some attributes that is a length or a number; of several the largest, or the least.

    Args:
        tags: attributes by lower-case name.
        names: of which the first that says something counts.
        doubts: are added to by what is rough, or says nothing: no number, or none above zero.
        least: of the bottom of a building, which may be 0.
    """
    for name in names:
        if (given := tags.get(name)) is None:
            continue
        found, rough = lengths_of(given)
        said = bool(found) and (least or max(found) > 0.0)
        if doubts is not None and (rough or not said) and found != (0.0,):
            (doubts.rough if said else doubts.strange)[f"{name}={str(given)[:20]!r}"] += 1
        if said:
            return min(found) if least else max(found)
    return None
