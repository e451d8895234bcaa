"""Routes of pieces, and their points at an arc length, from the closed form of each segment."""

import numpy as np

from aircraft.interface import Route
from aircraft.route import arc_point


def route_of(*pieces: tuple[float, float], loiter: bool = False) -> Route:
    """A route from (0, 0) northwards, of curvatures (1/m, positive left) and lengths (m)."""
    rows, point = [], (0.0, 0.0, 0.0, 1.0)
    for curvature, length in pieces:
        rows.append((*point, curvature, length))
        point = arc_point(rows[-1], length)
    return Route(np.array(rows), loiter)


def route_point(route: Route, arc_length_m: float) -> tuple[float, float, float, float]:
    """East, north (m) and unit tangent; beyond the end a loiter goes round, any other route straight on."""
    starts = np.concatenate(([0.0], np.cumsum(route.segments[:-1, 5])))
    index = max(int(np.searchsorted(starts, arc_length_m, side="right")) - 1, 0)
    row = tuple(route.segments[index].tolist())
    along = arc_length_m - float(starts[index])
    over = max(along - row[5], 0.0) if index == len(starts) - 1 and not route.loiter else 0.0
    east, north, tangent_east, tangent_north = arc_point(row, along - over)
    return east + over * tangent_east, north + over * tangent_north, tangent_east, tangent_north
