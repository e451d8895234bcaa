"""Heights and lengths as people write them in attributes: `12`, `12.5 m`, `40 ft`, `7'4"`, `~15`, `15;18`, `3-4`.

The units of OpenStreetMap: https://wiki.openstreetmap.org/wiki/Map_features/Units. Metres need none.
"""

from __future__ import annotations

import math
import re
from typing import Any, Final, NamedTuple

from harness.world_files.parts import FOOT_M

_NUMBER: Final = r"\d+(?:\.\d+)?"
_UNITS: Final = {
    "": 1.0,
    **dict.fromkeys(("m", "mtr", "metre", "metres", "meter", "meters"), 1.0),
    **dict.fromkeys(("ft", "foot", "feet"), FOOT_M),
    **dict.fromkeys(("in", "inch", "inches"), FOOT_M / 12.0),
    "cm": 0.01,
    "km": 1000.0,
}
_WITH_UNIT: Final = re.compile(rf"([-+]?{_NUMBER})\s*([a-z]*)\.?")
_FEET: Final = re.compile(rf"({_NUMBER})\s*(?:'|ft)\s*(?:({_NUMBER})\s*(?:''|\"|in)?)?")
_THOUSANDS: Final = re.compile(r"\b[1-9]\d{0,2},\d{3}\b")
"""As `1,200`: twelve hundred to some, one and a fifth to others; such a text says nothing."""
_ABOUT: Final = re.compile(r"(?:~|\u2248|ca\.?(?=[\s\d])|circa|approx(?:\.|imately)?|about)\s*")
"""Words for an approximate length."""
_RANGE: Final = re.compile(rf"({_NUMBER})\s*([a-z']*)\s*[-\u2013]\s*({_NUMBER})\s*([a-z']*)")


class Lengths(NamedTuple):
    """What an attribute says.

    Attributes:
        metres: one or several; none where it says nothing that is certain.
        rough: it is approximate, a list or a range.
    """

    metres: tuple[float, ...]
    rough: bool = False


def metres_of(value: Any) -> float | None:
    """One length, in metres unless it says otherwise: `12`, `12.5 m`, `40 ft`, feet and inches with marks."""
    if isinstance(value, bool) or value is None:
        return None
    if isinstance(value, int | float):
        return float(value) if math.isfinite(value) else None
    if _THOUSANDS.search(str(value)):
        return None
    text = str(value).strip().lower().replace("\N{RIGHT SINGLE QUOTATION MARK}", "'").replace(",", ".")
    if (match := _WITH_UNIT.fullmatch(text)) and match[2] in _UNITS:
        return float(match[1]) * _UNITS[match[2]]
    if match := _FEET.fullmatch(text):
        return (float(match[1]) + float(match[2] or 0.0) / 12.0) * FOOT_M
    return None


def names_unit(value: Any) -> bool:
    """Whether a length that can be read says its unit."""
    return isinstance(value, str) and re.fullmatch(r"[-+\d.,\s]*", value) is None


def lengths_of(value: Any) -> Lengths:
    """One length or several: also `~15`, lists with semicolons as `15;18`, and ranges as `10-12 m`, by their ends."""
    one = metres_of(value)
    if one is not None:
        return Lengths((one,))
    if not isinstance(value, str) or _THOUSANDS.search(value):
        return Lengths(())
    found: list[float] = []
    for part in filter(None, (part.strip() for part in value.lower().split(";"))):
        text = _ABOUT.sub("", part, count=1)
        ends = _RANGE.fullmatch(text)
        texts = (
            [text] if ends is None else [f"{ends[1]}{ends[2] or ends[4]}", f"{ends[3]}{ends[4] or ends[2]}"]
        )
        read = [metres_of(each) for each in texts]
        if None in read or (len(read) == 2 and not 0.0 < read[0] < read[1]):  # type: ignore[operator]
            return Lengths(())
        found += read  # type: ignore[arg-type]
    return Lengths(tuple(found), rough=True)
