"""Cards of guidance laws: how well each tracks with an aircraft, measured by flying and kept for planning.

A law flies lines and arcs, in calm air and in wind, at ever wider turns until it stays near them: planning then gives
it turns of that radius, and keeps its error from obstacles. What `preview` does at its defaults is in the survey.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from copy import deepcopy
from dataclasses import asdict
from hashlib import sha256
from inspect import getsourcefile
from pathlib import Path
from typing import Any

from aircraft.airframe import Airframe
from aircraft.card_cache import cached
from aircraft.envelope import LawCard, WindPoint, performance
from aircraft.guidance.interface import GuidanceLaw
from aircraft.guidance.preview import PreviewConfig
from aircraft.guidance.registry import BUILT_IN, DEFAULT_KIND, GuidanceKind
from aircraft.guidance.waypoints import waypoint_law
from aircraft.model_files import AircraftError
from aircraft.route import route_length, weave
from aircraft.start import Atmosphere

WIND_SHARES = (0.0, 0.3, 0.6)
"""Winds in which a law is measured, along the weave and against it, as shares of the airspeed."""
RADIUS_FACTORS = (1.0, 1.25, 1.6, 2.0, 2.5, 3.2, 4.0)
"""Factors on the radius of the turns, tried one after the other until the law tracks them."""
TRACKED_SHARE = 0.1  # a law tracks the turns if its cross-track error is at most this share of their radius
WAYPOINTS_TRACKED_SHARE = 1.0
"""A law that flies the legs between the corners of the turns tracks them if its cross-track error is at most this share
of their radius. The turns are not widened then: the wider an arc, the further its corner lies outside."""
CUT_SHARE = 0.05
"""A law tracks the turns only if its bank command is cut at the bank limit for at most this share of the time."""
SLOWEST_SHARE = 4.0  # a weave is given up after this many times the time that it takes against the wind


def law_card(
    frame: Airframe,
    kind: GuidanceKind,
    config: Any,
    airspeed_mps: float | None = None,
    waypoints: bool = False,
    acceptance_radius_m: float | None = None,
    before_flying: Callable[[], object] = bool,
) -> LawCard | None:
    """The card of a law with its keys, from the cache or else flown; `before_flying` is called before a flight.

    None for `preview` at its defaults, which the survey of the aircraft has. AircraftError where it does not track.
    """
    limits = frame.guidance_limits(airspeed_mps)
    resolved = config.resolved(limits)
    if not waypoints and kind.kind == DEFAULT_KIND and resolved == PreviewConfig().resolved(limits):
        return None
    keys = json.dumps(asdict(resolved), sort_keys=True, default=repr)

    def make() -> GuidanceLaw:
        law = kind.make(resolved, limits)
        if law is kind.make(resolved, limits):  # an object that was given stays as it was
            law = deepcopy(law)
        if not waypoints:
            return law
        return waypoint_law(law, kind.kind, resolved, limits, acceptance_radius_m)

    def fly() -> dict[str, Any]:
        before_flying()
        return _measure(frame, kind.kind, limits.airspeed_mps, make, waypoints)

    legs = f"waypoints {acceptance_radius_m!r}" if waypoints else ""
    if (known := (frame, kind, keys, legs, limits.airspeed_mps)) not in _cards and kind not in BUILT_IN:
        _cards[known] = _card(fly())  # nothing tells what it depends on
    if known not in _cards:
        file = getsourcefile(kind.make)  # one of another distribution is not in the digest of this package
        source = Path(file).read_text("utf-8") if file else ""
        what = (frame.digest(), kind.kind, keys, repr(limits.airspeed_mps), source, legs)
        digest = sha256("\0".join(what).encode()).hexdigest()
        _cards[known] = cached(f"{frame.name}-{kind.kind}-law", digest, fly, _card)
    return _cards[known]


_cards: dict[tuple[Airframe, GuidanceKind, str, str, float], LawCard] = {}
"""The cards that this process has measured or read."""


def _card(measured: dict[str, Any]) -> LawCard:
    return LawCard(measured["kind"], tuple(WindPoint(**point) for point in measured["points"]))


def _measure(
    frame: Airframe, kind: str, speed_mps: float, make: Callable[[], GuidanceLaw], waypoints: bool
) -> dict[str, Any]:
    """Flies a law in every wind; returns the fields of its `LawCard`; AircraftError if it does not track."""
    most = WAYPOINTS_TRACKED_SHARE if waypoints else TRACKED_SHARE
    points: list[dict[str, float]] = []
    factors: tuple[float, ...] = RADIUS_FACTORS[:1] if waypoints else RADIUS_FACTORS
    for share in WIND_SHARES:
        for factor in factors:
            radius_m = factor * performance(frame, speed_mps, share * speed_mps).turn_radius_m
            error_m, cut = _worst(frame, speed_mps, make, radius_m, share * speed_mps)
            if error_m <= most * radius_m and (waypoints or cut <= CUT_SHARE):
                break
        else:
            how = f" in a wind of {share:.0%} of the airspeed" if share else ""
            how += f" on a state {frame.files.latency_s:g} s old" if frame.files.latency_s else ""
            raise AircraftError(
                f"the guidance law {kind} does not track with {frame.name}{how}: on turns of {factors[-1]:g} times "
                f"the radius that the aircraft needs it is off by more than {most:.0%} of the radius, or its bank "
                "is cut"
            )
        points.append({"wind_share": share, "radius_factor": factor, "error_m": float(f"{error_m:.3g}")})
        factors = factors[factors.index(factor) :]
    return {"kind": kind, "points": points}


def _worst(
    frame: Airframe, speed_mps: float, make: Callable[[], GuidanceLaw], radius_m: float, wind_mps: float
) -> tuple[float, float]:
    """Largest cross-track error (m) on a weave along and against a wind, and share of the time at the bank limit."""
    from aircraft.trials import tracked  # loads JSBSim

    route, worst = weave(radius_m), (0.0, 0.0)
    for north_mps in (wind_mps, -wind_mps) if wind_mps else (0.0,):
        most_s = SLOWEST_SHARE * route_length(route) / (speed_mps - abs(north_mps))
        flown = tracked(frame, speed_mps, make(), route, Atmosphere(wind_north_mps=north_mps), most_s)
        worst = max(worst[0], flown.most_m), max(worst[1], flown.cut_share)
    return worst
