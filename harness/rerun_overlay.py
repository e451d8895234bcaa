"""Several recordings in one: the world of the first, tracks and series of all, a colour for each."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path

import rerun as rr

from harness import rerun_blueprint as look
from harness.record import RunFolderError

SHARED = ("bounds", "goal", "ends", "area", "obstacles", "moving")
"""Below PLAN and WORLD: what all runs of a scenario have in common."""

FLOWN_LINE = "/flown"
"""Ends the entities of the time series that are drawn of every run."""


def write_overlay(recordings: Sequence[Path], names: Sequence[str], path: Path) -> None:
    """Writes the overlay of recordings to `path`.

    Args:
        recordings: recordings of one scenario; incomplete ones may be among them.
        names: name of each, for the legends.
        path: the file to write.

    Raises:
        RunFolderError: a recording cannot be read.
    """
    chunks = [_chunks(recording) for recording in recordings]
    runs = [f"runs/{number}/" for number in range(len(recordings))]
    title = ", ".join(names)
    with rr.RecordingStream("wayproof", recording_id=f"overlay: {title}") as rec:
        rec.set_log_time_enabled(False)
        rec.set_log_tick_enabled(False)
        rec.save(path, default_blueprint=look.blueprint(_frame(chunks[0], recordings[0]), runs))
        rec.send_recording_name(title)
        rec.send_chunks(chunk for chunk in chunks[0] if _is_shared(chunk.entity_path))
        for number, (own, run, name) in enumerate(zip(chunks, runs, names, strict=True)):
            rec.send_chunks(_renamed(own, run, number))
            _style(rec, run, number, name)
        rec.log(look.SUMMARY, rr.TextDocument(_summary(names), media_type=rr.MediaType.MARKDOWN), static=True)


def _chunks(recording: Path) -> list[rr.chunk.Chunk]:
    try:
        with warnings.catch_warnings():
            # A recording of a killed run has no footer; it is read all the same.
            warnings.simplefilter("ignore", rr.error_utils.RerunWarning)
            return rr.chunk.RrdReader(str(recording)).stream().to_chunks()
    except (OSError, RuntimeError, ValueError) as error:
        raise RunFolderError(f"cannot read the recording {recording}: {error}") from error


def _frame(chunks: Sequence[rr.chunk.Chunk], recording: Path) -> look.Frame:
    for chunk in chunks:
        if chunk.entity_path == f"/__properties/{look.FRAME}":
            values = chunk.to_record_batch().to_pydict()
            bounds, altitude, clearance = (
                next(column[0] for name, column in values.items() if name.endswith(key))
                for key in ("bounds_m", "altitude_m", "clearance_m")
            )
            return look.Frame(tuple(bounds), altitude[0], clearance[0])
    raise RunFolderError(f"{recording} is not a recording of a flight")


def _is_shared(entity: str) -> bool:
    parts = entity.strip("/").split("/")
    return parts in ([look.PLAN], [look.WORLD]) or (
        parts[0] in (look.PLAN, look.WORLD) and len(parts) > 1 and parts[1] in SHARED
    )


def _renamed(chunks: Sequence[rr.chunk.Chunk], run: str, number: int) -> Iterator[rr.chunk.Chunk]:
    """Tracks, aircraft and series of one run, below entities of its own."""
    for chunk in chunks:
        top, _, below = chunk.entity_path.strip("/").partition("/")
        if top in (look.PLAN, look.WORLD) and below.split("/")[0] in (look.FLOWN, look.WHOLE, "aircraft"):
            if below != "aircraft/sensing":
                yield chunk.with_entity_path(f"/{top}/{run}{below}")
        elif top == look.SERIES and below.endswith(FLOWN_LINE) and not chunk.is_static:
            yield chunk.with_entity_path(f"/{look.SERIES}/{below}/{number}")


def _style(rec: rr.RecordingStream, run: str, number: int, name: str) -> None:
    """Gives the lines of one run its colour, over the colours it was recorded with."""
    colour = look.OVERLAY[number % len(look.OVERLAY)]
    dim = tuple(part // 2 for part in colour)
    for entity, shade in ((look.FLOWN, colour), (look.WHOLE, dim)):
        plan, world = f"{look.PLAN}/{run}{entity}", f"{look.WORLD}/{run}{entity}"
        rec.log(plan, rr.LineStrips2D.from_fields(colors=[shade]), static=True)
        rec.log(world, rr.LineStrips3D.from_fields(colors=[shade]), static=True)
    for line in look.SERIES_STYLE:
        if line.endswith(FLOWN_LINE):
            style = rr.SeriesLines(names=[name], colors=[colour], widths=[1.5])
            rec.log(f"{look.SERIES}/{line}/{number}", style, static=True)


def _summary(names: Sequence[str]) -> str:
    rows = [f"| {number + 1} | {name} |" for number, name in enumerate(names)]
    return "\n".join(
        ["| | run |", "|---|---|", *rows, "", "Colours are those of the legends at the right.", ""]
    )
