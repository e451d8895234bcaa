"""How each guidance law tracks with an aircraft: cards, flown by `aircraft.law_cards.law_survey` and kept.

What `preview` does at its defaults is in the aircraft's survey.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from copy import deepcopy
from dataclasses import asdict, replace
from hashlib import sha256
from inspect import getsourcefile
from pathlib import Path
from typing import Any

from aircraft.airframe import Airframe
from aircraft.card_cache import cached
from aircraft.envelope import LawCard, WindPoint
from aircraft.guidance.interface import GuidanceLaw
from aircraft.guidance.preview import PreviewConfig
from aircraft.guidance.registry import DEFAULT_KIND, GuidanceKind, installed_kinds
from aircraft.guidance.waypoints import waypoint_law
from aircraft.model_files import ModelFiles


def law_card(
    frame: Airframe,
    kind: GuidanceKind,
    config: Any,
    airspeed_mps: float | None = None,
    waypoints: bool = False,
    acceptance_radius_m: float | None = None,
    before_flying: Callable[[], object] = bool,
) -> LawCard | None:
    """The card of a law with its keys, flown unless that has been done before; `before_flying` is called first then.

    Returns:
        The card; None for `preview` at its defaults, which the survey of the aircraft has.

    Raises:
        AircraftError: the law does not track with this aircraft.
    """
    limits = frame.guidance_limits(airspeed_mps)
    resolved = config.resolved(limits)
    if not waypoints and kind.kind == DEFAULT_KIND and resolved == PreviewConfig().resolved(limits):
        return None
    keys = json.dumps(asdict(resolved), sort_keys=True, default=repr)

    def flown() -> dict[str, Any]:
        before_flying()
        from aircraft.law_cards.law_survey import measured  # loads JSBSim

        # A copy: a law that was given as an object is flown as it was given.
        def made() -> GuidanceLaw:
            law = deepcopy(kind.make(resolved, limits))
            if not waypoints:
                return law
            return waypoint_law(law, kind.kind, resolved, limits, acceptance_radius_m)

        return measured(frame, kind.kind, limits.airspeed_mps, made, waypoints)

    legs = f"waypoints {acceptance_radius_m!r}" if waypoints else ""
    flies = repr(replace(frame, files=None))  # type: ignore[arg-type]  # the files count by their content
    known = (flies, frame.files, kind, keys, legs, limits.airspeed_mps)
    if known not in _kept and installed_kinds().get(kind.kind) != kind:
        _kept[known] = _card(flown())  # nothing tells what it depends on
    if known not in _kept:
        what = (frame.files.digest(), flies, kind.kind, keys, repr(limits.airspeed_mps), _source(kind), legs)
        digest = sha256("\0".join(what).encode()).hexdigest()
        _kept[known] = cached(f"{frame.name}-{kind.kind}-law", digest, flown, _card)
    return _kept[known]


_kept: dict[tuple[str, ModelFiles, GuidanceKind, str, str, float], LawCard] = {}


def _source(kind: GuidanceKind) -> str:
    """The text of the file that makes a law: one of another distribution is not in the digest of this package."""
    file = getsourcefile(kind.make)
    return Path(file).read_text("utf-8") if file else ""


def _card(measured: dict[str, Any]) -> LawCard:
    """What `law_survey.measured` returned, as a card."""
    return LawCard(measured["kind"], tuple(WindPoint(**point) for point in measured["points"]))
