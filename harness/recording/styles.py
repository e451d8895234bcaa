"""How each entity of a recording is drawn: colour, size and order, logged once for all that comes later."""

from __future__ import annotations

from typing import Any, Final

import rerun as rr

from harness.recording import blueprint as look
from harness.recording.layout import THIN_SERIES
from harness.recording.states import AT_LIMIT, FREE, log_colours

STYLES: Final[tuple[tuple[str, Any, look.Colour | None, float, float | None], ...]] = (
    (f"{look.PLAN}/{look.SENSED}", rr.Points2D, look.EDGE, 1.25, 12),
    (f"{look.PLAN}/window", rr.LineStrips2D, look.WINDOW, 0.75, 22),
    (f"{look.PLAN}/sectors", rr.LineStrips2D, look.SECTOR, 0.75, 23),
    (f"{look.PLAN}/{look.MET}", rr.Points2D, look.MET_DOTS, 1.0, 24),
    (f"{look.PLAN}/scan", rr.Points2D, look.HIT, 1.5, 25),
    (f"{look.PLAN}/{look.TRACKED}", rr.LineStrips2D, look.MOVES, 1.5, 26),
    (f"{look.PLAN}/{look.TRACKED}/velocity", rr.Arrows2D, look.MOVES, 1.0, 27),
    (f"{look.PLAN}/candidates", rr.LineStrips2D, look.CANDIDATE, 0.5, 30),
    (f"{look.PLAN}/guide", rr.Arrows2D, look.GUIDE, 1.0, 35),
    (f"{look.PLAN}/chosen", rr.LineStrips2D, look.CHOSEN, 1.5, 40),
    (f"{look.PLAN}/waypoints", rr.Points2D, look.CHOSEN, 3.5, 41),
    (f"{look.PLAN}/{look.FLOWN}", rr.LineStrips2D, None, 1.25, 50),
    (f"{look.WORLD}/{look.SENSED}", rr.LineStrips3D, look.EDGE, 0.75, None),
    (f"{look.WORLD}/chosen", rr.LineStrips3D, look.CHOSEN, 1.25, None),
    (f"{look.WORLD}/{look.FLOWN}", rr.LineStrips3D, None, 1.25, None),
)
"""Entity, archetype, colour (None: it comes with the data), size in points of the screen, order of drawing."""
THIN: Final = (f"{look.PLAN}/chosen", f"{look.PLAN}/waypoints")
"""Those that a thin recording has."""


def log_styles(rec: rr.RecordingStream, scene: look.Scene, thin: bool) -> None:
    """Logs how all entities and time series are drawn that the recording has: a layout is made by what there is."""
    for entity, archetype, colour, size, order in STYLES:
        if entity in THIN or not thin:
            style = {"colors": colour and [colour], "radii": rr.Radius.ui_points(size)}
            style |= {"draw_order": order} if order else {}
            rec.log(entity, archetype.from_fields(**style), static=True)
    _log_series_styles(rec, scene, thin)
    if not thin:
        log_colours(rec, look.BANK_LANE, {FREE: look.CALM, AT_LIMIT: look.HIT})


def _log_series_styles(rec: rr.RecordingStream, scene: look.Scene, thin: bool) -> None:
    empty = {*scene.empty_series, *(() if scene.believes else (look.BELIEVED_OFF,))}
    for entity, (name, colour, width) in look.SERIES_STYLE.items():
        plot = entity.partition("/")[0]
        too_much = thin and (plot not in THIN_SERIES or entity in look.WHOLE_ONLY)
        if not too_much and not empty & {plot, entity}:
            rec.log(f"{look.SERIES}/{entity}", look.series_lines(name, colour, width), static=True)
    for entity, name in () if thin else ((look.SEARCH, "search"), (look.DELAYS, "plan delay")):
        points = rr.SeriesPoints(names=[name], colors=[look.CHOSEN], marker_sizes=[2.0])
        rec.log(f"{look.SERIES}/{entity}", points, static=True)
