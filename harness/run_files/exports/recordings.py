"""Recordings of other viewers: MCAP for Foxglove and rerun."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from datetime import datetime
from typing import Any, Final

import numpy as np

from harness.files.errors import RunFolderError
from harness.flight.record import FloatArray
from harness.run_files.exports.exported_path import geodetic, plane_of, scenario_of_run
from harness.run_files.run_folder import Run

MAP_FRAME: Final = "map"
"""Frame of the local plane in an MCAP file: x east, y north, z up, metres; ROS calls it so (REP 105)."""
NEEDS_LOGS: Final = "MCAP needs the extra wayproof[logs]: pip install 'wayproof[logs]'"


def mcap_bytes(run: Run) -> bytes:
    """An MCAP file, https://mcap.dev, with Foxglove's schemas as protobuf: Foxglove and rerun draw them as they are.

    Topics: `/aircraft/pose` (PoseInFrame: the true pose, x forward, y left, z up), `/aircraft/location` (LocationFix),
    `/plan` (SceneUpdate: the plan in effect as a line), `/world` (SceneUpdate: area and standing obstacles), `/log`
    (Log: the outcome). Log times are the run's start and the simulated time since.

    Raises:
        RunFolderError: the packages for MCAP are not installed.
    """
    try:
        from mcap_protobuf.writer import Writer
    except ImportError as error:
        raise RunFolderError(NEEDS_LOGS) from error
    started = datetime.fromisoformat(str(run.manifest["started_utc"]))
    start_ns = int(started.timestamp()) * 10**9 + started.microsecond * 1000
    text = io.BytesIO()
    with Writer(text) as writer:
        for topic, time_s, message in sorted(_messages(run), key=lambda each: each[1]):
            time_ns = start_ns + round(1e9 * time_s)
            stamp = message.entities[0].timestamp if topic in ("/plan", "/world") else message.timestamp
            stamp.FromNanoseconds(time_ns)
            writer.write_message(topic, message, log_time=time_ns, publish_time=time_ns)
    return text.getvalue()


def _messages(run: Run) -> Iterator[tuple[str, float, Any]]:
    """Topic, simulated time and message, in any order; time stamps are still to be set."""
    from foxglove_schemas_protobuf.LocationFix_pb2 import LocationFix
    from foxglove_schemas_protobuf.Log_pb2 import Log
    from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

    scenario, track = scenario_of_run(run), run.track
    places = geodetic(plane_of(scenario), np.column_stack((track.east_m, track.north_m)))
    turns = _quaternions(track.roll_deg, track.pitch_deg, track.heading_deg)
    for row, time in enumerate(track.time_s.tolist()):
        pose = PoseInFrame(frame_id=MAP_FRAME)
        pose.pose.position.x, pose.pose.position.y = float(track.east_m[row]), float(track.north_m[row])
        pose.pose.position.z = float(track.up_m[row])
        turn = pose.pose.orientation
        turn.x, turn.y, turn.z, turn.w = turns[row].tolist()
        yield "/aircraft/pose", time, pose
        latitude, longitude = places[row].tolist()
        fix = LocationFix(latitude=latitude, longitude=longitude, altitude=float(track.up_m[row]))
        yield "/aircraft/location", time, fix
    world = _scene("world", 0.45)
    xmin, ymin, xmax, ymax = scenario.area.bounds_m
    _line(world, [(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax), (xmin, ymin)], 0.0)
    for obstacle in scenario.obstacles:
        if obstacle.fixed and obstacle.circle is not None:
            (east, north), radius = obstacle.circle.center_m, obstacle.circle.radius_m
            rim = [
                (east + radius * math.cos(a), north + radius * math.sin(a))
                for a in np.linspace(0, math.tau, 65)
            ]
            _line(world, rim, scenario.mission.altitude_m)
        if obstacle.fixed and obstacle.polygon is not None:
            for ring in (obstacle.polygon.vertices_m, *(obstacle.polygon.holes_m or ())):
                _line(world, [*ring, ring[0]], scenario.mission.altitude_m)
    yield "/world", 0.0, world
    for plan in run.plans:
        scene = _scene("plan", 1.0)
        _line(scene, plan.path_m.tolist(), scenario.mission.altitude_m)
        yield "/plan", plan.time_s, scene
    said = f"{run.metrics['outcome']}: {run.metrics['reason']}"
    yield "/log", float(track.time_s[-1]), Log(level=Log.INFO, name="wayproof", message=said)


def _scene(name: str, shade: float) -> Any:
    """A SceneUpdate with one entity that stays until it is replaced."""
    from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

    scene = SceneUpdate()
    entity = scene.entities.add(frame_id=MAP_FRAME, id=name)
    entity.metadata.add(key="shade", value=f"{shade:g}")
    return scene


def _line(scene: Any, points_m: Any, up_m: float) -> None:
    """Adds a line through points of the plane at one altitude."""
    from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive

    (entity,) = scene.entities
    shade = float(entity.metadata[0].value)
    line = entity.lines.add(type=LinePrimitive.Type.LINE_STRIP, thickness=2.0, scale_invariant=True)
    line.pose.orientation.w = 1.0
    line.color.r, line.color.g, line.color.b, line.color.a = 0.25 * shade, 0.75 * shade, shade, 1.0
    for east, north in points_m:
        line.points.add(x=float(east), y=float(north), z=up_m)


def _quaternions(roll_deg: FloatArray, pitch_deg: FloatArray, heading_deg: FloatArray) -> FloatArray:
    """(n, 4) x, y, z, w: from the body (x forward, y left, z up) to the plane (x east, y north, z up).

    Yaw is counter-clockwise from east; pitch nose up is a negative turn about y (left), roll right wing down a
    positive one about x.
    """
    roll, pitch, yaw = (np.radians(angle) / 2.0 for angle in (roll_deg, -pitch_deg, 90.0 - heading_deg))
    cr, sr, cp, sp, cy, sy = (
        np.cos(roll),
        np.sin(roll),
        np.cos(pitch),
        np.sin(pitch),
        np.cos(yaw),
        np.sin(yaw),
    )
    return np.column_stack(
        (
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        )
    )
