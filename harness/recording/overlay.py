"""Recordings made of recordings: an overlay of several, a colour each, and one with the band of many days.

An overlay has the world of the first, tracks and series of all. What moves or comes and goes does so as long as any of
them flies.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr

from harness.analysis.metric import Metric
from harness.analysis.registry import METRICS
from harness.analysis.rows import escaped
from harness.files.errors import RunFolderError
from harness.flight.record import FloatArray
from harness.recording import blueprint as look
from harness.recording.file import RecordingFile, recording_stream
from harness.recording.layout import layout_of
from harness.recording.properties import RUN
from harness.recording.states import OVER, send_changes
from harness.recording.tracks import MISSION, tracks_layout

SHARED_ENTITIES = ("bounds", "goal", "ends", "area", "ground", "fences", "outlines", look.TRUE)
"""Below PLAN and WORLD: entities that all runs of a scenario have in common."""
RUN_ENTITIES = (look.FLOWN, look.WHOLE, look.END, "aircraft")
"""Below PLAN and WORLD: entities that are drawn for every run."""
COLOUR_NAMES = ("orange", "blue", "pink", "green", "violet", "red", "yellow", "grey")
"""Names of the colours in `blueprint.OVERLAY`, for the summary."""
BAND_COLOUR = (120, 120, 120)  # colour of the band about the tracks of many days
FLOWN_LINE = "/flown"  # ending of the entities of time series that are drawn for every run


def write_overlay(recordings: Sequence[Path], names: Sequence[str], path: Path) -> str:
    """Writes the overlay of recordings to `path`, in the world of the first.

    Returns which of them are of other worlds, a sentence that stands in the summary too; empty where none is. A
    RunFolderError says which recording cannot be read, an OSError that the overlay cannot be written.
    """
    chunks = [chunks_of(recording) for recording in recordings]
    runs = [f"runs/{place}/" for place in range(len(recordings))]
    title = ", ".join(names)
    with recording_stream(f"overlay: {title}") as rec:
        renamed = [
            list(_rename(own, run, place, re.sub(r"[^\w.-]", "-", name)))  # else it is shown with backslashes
            for place, (own, run, name) in enumerate(zip(chunks, runs, names, strict=True))
        ]
        entities = {chunk.entity_path for own in renamed for chunk in own}
        file = RecordingFile(rec, path, layout_of(frame_of(chunks[0], recordings[0]), entities, runs))
        rec.send_recording_name(title)
        properties = [properties_of(own) for own in chunks]
        worlds = [each.get(look.FRAME, {}).get("world", "") for each in properties]
        same = [place for place, world in enumerate(worlds) if world == worlds[0]]
        longest = max(same, key=lambda place: properties[place].get(RUN, {}).get("flight_time_s", [0.0]))
        rec.send_chunks(chunk for chunk in chunks[0] if _is_shared(chunk.entity_path))
        rec.send_chunks(chunk for chunk in chunks[longest] if chunk.entity_path.split("/")[2:3] == ["moving"])
        for place, (own, run, name) in enumerate(zip(chunks, runs, names, strict=True)):
            rec.send_chunks(renamed[place])
            ends_s = properties[place].get(RUN, {}).get("flight_time_s", ())  # others may go on
            for lane in {one.entity_path for one in renamed[place] if f"/{look.STATES}/" in one.entity_path}:
                send_changes(rec, lane.removeprefix(f"/{look.STATES}/"), [(at_s, OVER) for at_s in ends_s])
            _send_events(rec, own, place, name)
            _style(rec, run, place, name)
        warning = _of_other_worlds(names, worlds)
        summary = (f"**{escaped(warning)}**\n\n" if warning else "") + _summary(names, properties)
        rec.log(look.SUMMARY, rr.TextDocument(summary, media_type=rr.MediaType.MARKDOWN), static=True)
        file.end()
        return warning


def _of_other_worlds(names: Sequence[str], worlds: Sequence[str]) -> str:
    """Names the runs that were flown in another world than the one shown, if recordings tell their worlds."""
    others = [name for name, world in zip(names, worlds, strict=True) if world not in ("", worlds[0])]
    if not others or not worlds[0]:
        return ""
    were = "was" if len(others) == 1 else "were"
    return f"The obstacles are those of {names[0]}; {', '.join(others)} {were} flown in another world."


def add_band(recording: Path, left_m: FloatArray, right_m: FloatArray) -> None:
    """Replaces a recording by one that also shows the edges (n, 2) of the band in which days fly, in both views.

    A RunFolderError says that it cannot be read, an OSError that it cannot be written.
    """
    chunks = chunks_of(recording)
    frame = frame_of(chunks, recording)
    entities = {chunk.entity_path for chunk in chunks}
    (identity,) = {entry.recording_id for entry in rr.chunk.RrdReader(str(recording)).recordings()}
    partial = recording.with_name(f"{recording.stem}.band{recording.suffix}")
    with recording_stream(identity) as rec:
        file = RecordingFile(rec, partial, layout_of(frame, entities, runs_in(entities)))
        rec.send_chunks(chunks)
        flat = [left_m, right_m]
        rec.log(f"{look.PLAN}/band", rr.LineStrips2D(flat, colors=BAND_COLOUR), static=True)
        steep = [np.column_stack((edge, np.full(len(edge), frame.altitude_m))) for edge in flat]
        rec.log(f"{look.WORLD}/band", rr.LineStrips3D(steep, colors=BAND_COLOUR), static=True)
        file.end()
    partial.replace(recording)


def send_recording(recording: Path, address: str) -> None:
    """Sends a recording, of a replay too, or an overlay with its layout; a RunFolderError says it cannot be read."""
    chunks = chunks_of(recording)
    entities = {chunk.entity_path for chunk in chunks}
    with recording_stream(str(recording)) as rec:
        if f"/{MISSION}" in entities:
            layout = tracks_layout(entities)
        else:
            layout = layout_of(frame_of(chunks, recording), entities, runs_in(entities))
        rec.connect_grpc(address, default_blueprint=layout)
        layout.close()
        rec.send_chunks(chunks)
        rec.flush()
        rec.disconnect()


def runs_in(entities: Collection[str]) -> list[str]:
    """Returns the runs that a recording with these entities holds, as `layout_of` takes them."""
    found = [re.match(rf"/{look.PLAN}/runs/(\d+)/", each) for each in entities]
    places = {int(each[1]) for each in found if each is not None}
    return [f"runs/{place}/" for place in sorted(places)] or [""]


def chunks_of(recording: Path) -> list[rr.chunk.Chunk]:
    """Reads the content of a recording, also of an incomplete one; RunFolderError where it cannot be read."""
    try:
        with warnings.catch_warnings():
            # A recording of a killed run has no footer; it is read all the same.
            warnings.simplefilter("ignore", rr.error_utils.RerunWarning)
            return rr.chunk.RrdReader(str(recording)).stream().to_chunks()
    except (OSError, RuntimeError, ValueError) as error:
        raise RunFolderError(f"cannot read the recording {recording}: {error}") from error


def properties_of(chunks: Sequence[rr.chunk.Chunk]) -> dict[str, dict[str, Any]]:
    """Returns the properties of a recording, by their names and those of their values."""
    return {
        chunk.entity_path.rpartition("/")[2]: {
            name.rpartition(":")[2]: cells[0]
            for name, cells in chunk.to_record_batch().to_pydict().items()
            if isinstance(cells[0], list)
        }
        for chunk in chunks
        if chunk.entity_path.startswith("/__properties/")
    }


def frame_of(chunks: Sequence[rr.chunk.Chunk], recording: Path) -> look.Frame:
    """Returns the area that a recording's views are framed on; a RunFolderError if it is none of a flight."""
    if (frame := properties_of(chunks).get(look.FRAME)) is None:
        raise RunFolderError(f"{recording} is not a recording of a flight")
    xmin, ymin, xmax, ymax = frame["bounds_m"]
    return look.Frame((xmin, ymin, xmax, ymax), frame["altitude_m"][0], frame["clearance_m"][0])


def _is_shared(entity: str) -> bool:
    top, _, below = entity.strip("/").partition("/")
    shared = top in (look.PLAN, look.WORLD) and below.partition("/")[0] in ("", *SHARED_ENTITIES)
    return shared or entity == f"/__properties/{look.FRAME}"


def _rename(chunks: Sequence[rr.chunk.Chunk], run: str, place: int, name: str) -> Iterator[rr.chunk.Chunk]:
    """Yields tracks, aircraft, series, states and events of one run, below entities of its own."""
    for chunk in chunks:
        top, _, below = chunk.entity_path.strip("/").partition("/")
        if top in (look.PLAN, look.WORLD) and below.split("/")[0] in RUN_ENTITIES:
            if below != "aircraft/sensing":
                yield chunk.with_entity_path(f"/{top}/{run}{below}")
        elif top == look.SERIES and below.endswith(FLOWN_LINE) and not chunk.is_static:
            yield chunk.with_entity_path(f"/{look.SERIES}/{below}/{place}")
        elif top == look.STATES and below in (look.PLANNER_LANE, look.TRACKING_LANE):
            yield chunk.with_entity_path(f"/{look.STATES}/{place + 1}-{name}/{below}")


def _send_events(rec: rr.RecordingStream, chunks: Sequence[rr.chunk.Chunk], place: int, name: str) -> None:
    """Sends the events of one run, in its colour and after its name.

    They have an entity of their own: where the rows of several runs share one, rerun's log takes colours from the
    wrong run.
    """
    for chunk in chunks:
        if chunk.entity_path == f"/{look.EVENTS}":
            batch = chunk.to_record_batch()
            columns = {name: batch[name] for name in batch.schema.names}
            texts = next(cells.to_pylist() for key, cells in columns.items() if key.endswith("text"))
            levels = next(cells.to_pylist() for key, cells in columns.items() if key.endswith("level"))
            # As numbers: as Python objects, times in nanoseconds need pandas.
            time_s = columns[look.TIMELINE].cast("int64").to_numpy() / 1e9
            lines = rr.TextLog.columns(
                text=[f"{name}, {text}" for (text,) in texts],
                level=[level for (level,) in levels],
                color=[look.OVERLAY[place % len(look.OVERLAY)]] * len(texts),
            )
            rec.send_columns(f"{look.EVENTS}/{place}", [look.time_column(time_s)], lines)


def _style(rec: rr.RecordingStream, run: str, place: int, name: str) -> None:
    """Gives the lines of one run its colour, over the colours it was recorded with."""
    colour = look.OVERLAY[place % len(look.OVERLAY)]
    for entity, shade in ((look.FLOWN, colour), (look.WHOLE, tuple(part // 2 for part in colour))):
        plan, world = f"{look.PLAN}/{run}{entity}", f"{look.WORLD}/{run}{entity}"
        rec.log(plan, rr.LineStrips2D.from_fields(colors=[shade]), static=True)
        rec.log(world, rr.LineStrips3D.from_fields(colors=[shade]), static=True)
    flat, solid = rr.LineStrips2D.from_fields(colors=[colour]), rr.Mesh3D.from_fields(albedo_factor=colour)
    rec.log(f"{look.PLAN}/{run}aircraft/shape", flat, static=True)
    rec.log(f"{look.WORLD}/{run}aircraft/shape", solid, static=True)
    for line in look.SERIES_STYLE:
        if line.endswith(FLOWN_LINE):
            rec.log(f"{look.SERIES}/{line}/{place}", look.series_lines(name, colour, 1.5), static=True)
    points = rr.SeriesPoints(names=[name], colors=[colour], marker_sizes=[2.0])
    for line in (look.SEARCH, look.DELAYS):
        rec.log(f"{look.SERIES}/{line}/{place}", points, static=True)


def _summary(names: Sequence[str], properties: Sequence[Mapping[str, Mapping[str, Any]]]) -> str:
    """Returns the results of all runs side by side, as Markdown."""
    colours = [COLOUR_NAMES[place % len(COLOUR_NAMES)] for place in range(len(names))]
    rows = [["", *map(escaped, names)], ["---"] * (1 + len(names)), ["colour", *colours]]
    runs = [each.get(RUN, {}) for each in properties]
    for metric in METRICS:
        if metric.heading:
            shown = [_value_text(metric, run) or ("none" if run else "unfinished") for run in runs]
            rows.append([metric.label or metric.name, *shown])
    table = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    return f"{table}\n\nSolid grey: the true obstacles. Dimmed: track still ahead of the time cursor.\n"


def _value_text(metric: Metric, run: Mapping[str, Any]) -> str:
    """Returns a figure from the properties of a run, where shares are in percent; empty where it has none."""
    (value,) = run.get(metric.recorded_as, (None,))
    return escaped(metric.text(value / metric.factor if metric.unit == "%" and value is not None else value))
