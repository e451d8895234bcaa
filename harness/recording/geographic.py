"""The flight on a map of the earth: latitude and longitude of the area, the obstacles, start, goal and track.

The map view draws them without a connection too; only the tiles below them come from one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
import rerun as rr

from harness.flight.record import FloatArray
from harness.recording import blueprint as look
from harness.recording.blueprint import Scene
from harness.recording.solids import circle, outlines

if TYPE_CHECKING:
    from aircraft.frames import LocalPlane

MOST_CORNERS: Final = 60_000
"""Of all outlines on the map together; more are left out, the smallest obstacles first."""
TURN_DEG: Final = 360.0


def globe(rec: rr.RecordingStream, scene: Scene) -> Globe | None:
    """What puts a flight on the map, its scene there already; None where the origin was not given."""
    if scene.origin_deg is None:
        return None
    from aircraft.frames import LocalPlane

    found = Globe(rec, LocalPlane(*scene.origin_deg))
    found.log_scene(scene)
    return found


class Globe:
    """Puts places of the local plane on the map of a recording.

    Args:
        rec: where to.
        plane: about the scenario's origin.
    """

    def __init__(self, rec: rr.RecordingStream, plane: LocalPlane) -> None:
        self._rec, self._plane = rec, plane

    def log_scene(self, scene: Scene) -> None:
        """Logs area, obstacles, start and goal."""
        xmin, ymin, xmax, ymax = scene.mission.bounds_m
        corners = np.array([(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax), (xmin, ymin)])
        goal = circle(scene.mission.goal_m, scene.mission.goal_radius_m, 24)
        self._lines("bounds", [corners], look.BOUNDS)
        self._lines("goal", [goal], look.GOAL)
        rings = [r for each in scene.obstacles if each.stands_for_ever for r in outlines(each.shape, 24)]
        rings.sort(key=lambda ring: -float(np.ptp(ring, axis=0).max()))
        kept = np.cumsum([len(ring) for ring in rings]) <= MOST_CORNERS
        self._lines("outlines", [r for r, keep in zip(rings, kept, strict=True) if keep], look.EDGE)
        self._rec.log(
            f"{look.MAP}/ends",
            rr.GeoPoints(
                lat_lon=self._lat_lon(np.array([scene.start_m, scene.mission.goal_m])),
                colors=[look.START, look.GOAL],
                radii=rr.Radius.ui_points(6.0),
            ),
            static=True,
        )

    def log_track(self, track_m: FloatArray) -> None:
        """Logs the whole track, (k, 2) or more east and north."""
        step = max(len(track_m) // 5000, 1)
        self._lines("track", [np.vstack((track_m[::step, :2], track_m[-1:, :2]))], look.TRACK, 2.0)

    def _lines(self, name: str, lines: Sequence[FloatArray], colour: look.Colour, width: float = 1.0) -> None:
        if lines:
            self._rec.log(
                f"{look.MAP}/{name}",
                rr.GeoLineStrings(
                    lat_lon=[self._lat_lon(line) for line in lines],
                    colors=[colour],
                    radii=rr.Radius.ui_points(width),
                ),
                static=True,
            )

    def _lat_lon(self, points_m: FloatArray) -> FloatArray:
        """(n, 2) degrees; longitudes by the turn that is nearest to the origin's: no line leads round the earth."""
        places = np.array([self._plane.geodetic(east, north) for east, north in points_m[:, :2].tolist()])
        places[:, 1] += TURN_DEG * np.round((self._plane.longitude_deg - places[:, 1]) / TURN_DEG)
        return places
