"""Simulated scanning range sensor: rays against the true world, with its imperfections.

Frame: local ENU plane, x = east, y = north, metres. Bearings are radians clockwise from north. Whether and
where a ray hits is decided by correctly rounded operations on that ray and that face alone; bearings of faces
only choose which rays are tried, with a margin. So a face that is not hit cannot change any bit of a scan.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from harness.world import Faces, Surroundings, World
from planner.interface import ComplexArray, FloatArray, IntArray

if TYPE_CHECKING:
    from harness.scenario_sections import Sensor


# The neighbour list reaches this part of the range further, and this far into the future.
_SKIN = 0.25
_HORIZON_S = 30.0
# Rays tried beyond the bearings of a face, in rays: more than bearings err, even at a tangent (1.5e-8 rad).
_MARGIN_RAYS = 1e-3


@dataclass(frozen=True, eq=False)
class RangeScan:
    """One scan; all arrays are read-only, and copied if they were not.

    Attributes:
        time_s: when the sensor looked.
        available_s: when the scan may be used.
        east_m: sensor position.
        north_m: sensor position.
        heading_rad: bearing of the nose, clockwise from north.
        start_rad: bearing of ray 0, clockwise from north, in [0, 2 pi).
        spacing_rad: bearing of each ray less that of the one before; positive, clockwise.
        fan: (n,) unit vectors of the rays as the nose sees them, to its right + i ahead.
        ranges_m: (n,) measured ranges, +inf where nothing came back.
        max_range_m: no return is longer.
        nearest_m: no return is shorter; +inf if nothing came back.
    """

    time_s: float
    available_s: float
    east_m: float
    north_m: float
    heading_rad: float
    start_rad: float
    spacing_rad: float
    fan: ComplexArray
    ranges_m: FloatArray
    max_range_m: float
    nearest_m: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "nearest_m", float(self.ranges_m.min(initial=math.inf)))
        for name in ("fan", "ranges_m"):
            array = getattr(self, name)
            if array.flags.writeable:
                array = array.copy()
                array.setflags(write=False)
                object.__setattr__(self, name, array)

    def from_sensor_m(self, rays: IntArray) -> ComplexArray:
        """(k,) where some rays ended, east + i north of the sensor."""
        turned: ComplexArray = self.fan.take(rays) * self.ranges_m.take(rays)
        turned *= cmath.rect(1.0, -self.heading_rad)
        return turned

    def ends_m(self, rays: IntArray) -> ComplexArray:
        """(k,) where some rays ended, east + i north."""
        return self.from_sensor_m(rays) + complex(self.east_m, self.north_m)

    def least_beside_m(self, aside: int) -> FloatArray:
        """(n,) the least range of each ray and so many to either side; the ends of the fan are joined."""
        rays = len(self.ranges_m)
        ring = self.ranges_m.take(np.arange(-aside, rays + aside), mode="wrap")
        least = ring[:rays]
        for first in range(1, 2 * aside + 1):
            least = np.minimum(least, ring[first : first + rays])
        return least

    def kept(self) -> RangeScan:
        """The same, its rays followed by now: nothing leads from it to the world any more."""
        _ = self.ranges_m
        return self

    @property
    def followed(self) -> bool:
        """Whether its rays have been followed: ranges that nobody has read yet cost more than others."""
        return "ranges_m" in self.__dict__

    @property
    def directions(self) -> FloatArray:
        """(n, 2) unit vectors (east, north) of the rays."""
        turned: ComplexArray = self.fan * cmath.rect(1.0, -self.heading_rad)
        turned.setflags(write=False)
        return turned.view(np.float64).reshape(-1, 2)


class _Unread(RangeScan):
    """A scan whose rays are followed when somebody first reads their ranges: few scans are news to anybody."""

    @classmethod
    def of(cls, face_m: float, attributes: dict[str, Any]) -> _Unread:
        """A scan of which all is known but the ranges.

        Args:
            face_m: distance to the nearest face in range, ahead or not; +inf if there is none.
            attributes: all others, by name; and either the ranges or, as `_follow`, what gives them.
        """
        scan = cls.__new__(cls)
        # At once: a frozen dataclass would set them one by one, and that is most of the cost of a scan.
        scan.__dict__.update(attributes, nearest_m=face_m)
        return scan

    def __getattr__(self, name: str) -> FloatArray:
        """The ranges, when they are first read."""
        if name != "ranges_m":
            raise AttributeError(name)
        ranges: FloatArray = self.__dict__.pop("_follow")()
        ranges.setflags(write=False)
        self.__dict__[name] = ranges
        return ranges


class RangeSensor:
    """A fan of rays, centred on the nose of the aircraft.

    A ray returns the nearest crossing of an obstacle edge not further than the range; inside an obstacle that
    is the way out. Then, in this order:

    1. Noise: a Gaussian error is added to each range; a negative one becomes 0, one beyond the range is lost.
    2. Dropout: the ray returns nothing.
    3. False return: the ray returns a range uniform in (0, range], whatever there was.

    Each imperfection draws from a stream of its own, for every ray of every scan, so that neither what is
    seen nor another imperfection shifts its draws; one that is off draws nothing.

    Args:
        world: the truth.
        config: the `sensor` part of a scenario.
        seed_sequence: root of the three streams; it is not changed.
    """

    def __init__(self, world: World, config: Sensor, seed_sequence: np.random.SeedSequence) -> None:
        self._world = world
        self._config = config
        field_rad = math.radians(config.field_of_view_deg)
        self._spacing_rad = field_rad / config.rays
        self._first_rad = 0.5 * self._spacing_rad - field_rad / 2
        offsets = self._first_rad + self._spacing_rad * np.arange(config.rays)
        self._turn = math.tau / self._spacing_rad
        self._fan = np.array((np.sin(offsets), np.cos(offsets)))  # seen from the nose: to its right, ahead
        self._fan_right, self._fan_ahead = self._fan
        self._rays: ComplexArray = self._fan_right + 1j * self._fan_ahead
        self._rays.setflags(write=False)
        self._surely_in_range_m = config.range_m * (1.0 - 1e-9)
        self._nothing = np.full(config.rays, math.inf)
        self._nothing.setflags(write=False)
        self._noise, self._dropout, self._false_return = (
            _stream(seed_sequence, number) for number in range(3)
        )
        self._flawed = config.range_noise_m > 0 or config.dropout > 0 or config.false_return > 0
        self._surroundings: Surroundings | None = None
        self._listed_at = (math.nan, math.nan, math.nan)

    def scan(self, east_m: float, north_m: float, heading_rad: float, time_s: float) -> RangeScan:
        """Looks around from a place, at a time."""
        faces = self._near(east_m, north_m, time_s).faces(time_s)
        seen: dict[str, Any] = {
            "time_s": time_s,
            "available_s": time_s + self._config.latency_s,
            "east_m": east_m,
            "north_m": north_m,
            "heading_rad": heading_rad,
            "start_rad": (heading_rad + self._first_rad) % math.tau,
            "spacing_rad": self._spacing_rad,
            "fan": self._rays,
            "max_range_m": self._config.range_m,
        }
        follow = partial(self._true_ranges, faces, east_m, north_m, heading_rad)
        if self._flawed:  # what is drawn at random is drawn now, scan by scan
            return RangeScan(ranges_m=self._degraded(follow()), **seen)
        face_m = self._nearest(faces, east_m, north_m)
        if face_m == math.inf:  # nothing to follow rays to
            return _Unread.of(face_m, {**seen, "ranges_m": self._nothing})
        return _Unread.of(face_m, {**seen, "_follow": follow})

    def _near(self, east: float, north: float, time: float) -> Surroundings:
        """All that is in range, from the neighbour list; this renews the list when it runs out."""
        skin = _SKIN * self._config.range_m
        listed_east, listed_north, listed_s = self._listed_at
        moved = math.hypot(east - listed_east, north - listed_north)
        listed = self._surroundings
        if listed is None or not (moved <= skin and listed_s <= time <= listed.until_s):
            reach = self._config.range_m + skin
            self._surroundings = listed = self._world.surroundings(
                east, north, reach, time, time + _HORIZON_S
            )
            self._listed_at = (east, north, time)
        return listed

    def _nearest(self, faces: Faces, east: float, north: float) -> float:
        """Distance to the nearest face, ahead or not; +inf beyond the range."""
        nearest = math.inf
        for x, y, radius in faces.circles:
            nearest = min(nearest, abs(math.hypot(x - east, y - north) - radius))
        if faces.edges_m.shape[1]:
            edges = faces.edges_m[::2] + 1j * faces.edges_m[1::2] - complex(east, north)
            start, along = edges[0], edges[1] - edges[0]
            share = -(start * along.conj()).real / (along * along.conj()).real
            nearest = min(nearest, float(np.abs(start + np.clip(share, 0.0, 1.0) * along).min()))
        return nearest if nearest <= self._config.range_m else math.inf

    def _true_ranges(self, faces: Faces, east: float, north: float, heading_rad: float) -> FloatArray:
        """(n,) ranges to the nearest face, +inf beyond the range."""
        sin, cos = math.sin(heading_rad), math.cos(heading_rad)
        ranges = self._nothing.copy()
        for circle in faces.circles:
            self._hit_circle(ranges, circle, complex(east, north), complex(cos, sin))
        if faces.edges_m.shape[1]:
            away_east, away_north = faces.edges_m[::2] - east, faces.edges_m[1::2] - north
            self._hit_edges(ranges, cos * away_east - sin * away_north, sin * away_east + cos * away_north)
        return ranges

    def _hit_circle(
        self, ranges: FloatArray, circle: tuple[float, float, float], place: complex, heading: complex
    ) -> None:
        """Lowers ranges to a circle: centre east and north, radius; from a place, with a nose."""
        east, north, radius = circle
        centre = (complex(east, north) - place) * heading  # to the right + i ahead
        away = abs(centre)
        if away - radius > self._config.range_m:
            return
        half_rad, near_side = (math.asin(radius / away), True) if away > radius else (math.pi, False)
        right, ahead = centre.real, centre.imag
        # The power of the sensor's place: the square of its tangent to the circle, negative inside.
        power = (away - radius) * (away + radius)
        farthest = math.sqrt(power) if near_side else away + radius
        for low, high in self._tried(math.atan2(right, ahead) - half_rad, 2.0 * half_rad):
            along = self._fan_right[low:high] * right
            along += self._fan_ahead[low:high] * ahead
            half_chord2 = along * along
            half_chord2 -= power
            half_chord = np.sqrt(np.maximum(half_chord2, 0.0))
            distance = along - half_chord if near_side else along + half_chord
            # Only the outermost rays may pass by: the margin is far less than a ray.
            for end in (0, -1):
                if half_chord2.item(end) < 0.0 or distance.item(end) < 0.0:
                    distance[end] = math.inf
            if farthest > self._surely_in_range_m:
                np.putmask(distance, distance > self._config.range_m, math.inf)
            reached = ranges[low:high]
            np.minimum(reached, distance, out=reached)

    def _hit_edges(self, ranges: FloatArray, right: FloatArray, ahead: FloatArray) -> None:
        """Lowers ranges to edges; (2, e) where they start and end, to the right and ahead.

        A ray hits where the ends lie on different sides of it. Two edges that share a vertex agree about its
        side, so that no ray slips through between them.
        """
        (start_right, end_right), (start_ahead, end_ahead) = right, ahead
        turn = start_ahead * end_right - start_right * end_ahead
        dot = start_right * end_right + start_ahead * end_ahead
        width = np.arctan2(turn, dot)
        backwards = width < 0.0
        first = np.arctan2(
            np.where(backwards, end_right, start_right), np.where(backwards, end_ahead, start_ahead)
        )
        tries, faces = [], []
        for face, (bearing, wide) in enumerate(zip(first.tolist(), np.abs(width).tolist(), strict=True)):
            for span in self._tried(bearing, wide):
                tries.append(span)
                faces.append(face)
        if not tries:
            return
        along_right, along_ahead = end_right - start_right, end_ahead - start_ahead
        lever = start_right * along_ahead - start_ahead * along_right
        columns = np.array((start_right, start_ahead, end_right, end_ahead, lever))[:, faces]
        rays, (start_right, start_ahead, end_right, end_ahead, lever) = self._pairs(tries, columns)
        ray_right, ray_ahead = rays
        start_side = ray_right * start_ahead - ray_ahead * start_right
        end_side = ray_right * end_ahead - ray_ahead * end_right
        hit = ((start_side >= 0) != (end_side >= 0)).nonzero()[0]
        distance = np.full(len(lever), math.inf)
        distance[hit] = lever[hit] / (end_side[hit] - start_side[hit])
        distance[(distance < 0) | (distance > self._config.range_m)] = math.inf
        _lower(ranges, tries, distance)

    def _tried(self, first_rad: float, width_rad: float) -> Iterable[tuple[int, int]]:
        """Spans of rays (first, last + 1) that may meet a face.

        Args:
            first_rad: bearing from the nose at which the face begins.
            width_rad: how far it reaches clockwise from there.
        """
        rays, first = self._config.rays, (first_rad - self._first_rad) % math.tau / self._spacing_rad
        last = first + width_rad / self._spacing_rad
        low, high = math.ceil(first - _MARGIN_RAYS), math.floor(last + _MARGIN_RAYS) + 1
        if high <= rays:
            return ((low, high),) if low < high else ()
        # It may begin in this turn and reach into the next: it is tried as it is, and one turn back.
        again = min(math.floor(last - self._turn + _MARGIN_RAYS) + 1, rays)
        return tuple(span for span in ((low, rays), (0, again)) if span[0] < span[1])

    def _pairs(self, tries: Sequence[tuple[int, int]], faces: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rays and faces that may meet: (2, p) directions to the right and ahead, and (k, p) rows of faces."""
        counts = [high - low for low, high in tries]
        rays = np.concatenate([self._fan[:, low:high] for low, high in tries], axis=1)
        return rays, faces.repeat(counts, axis=1)

    def _degraded(self, ranges: FloatArray) -> FloatArray:
        """Ranges with the imperfections of the sensor."""
        config, n = self._config, len(ranges)
        if config.range_noise_m > 0:
            ranges = np.maximum(ranges + config.range_noise_m * self._noise.standard_normal(n), 0.0)
            ranges[ranges > config.range_m] = math.inf
        if config.dropout > 0:
            ranges[self._dropout.random(n) < config.dropout] = math.inf
        if config.false_return > 0:
            chance, share = self._false_return.random((2, n))
            ranges = np.where(chance < config.false_return, config.range_m * (1.0 - share), ranges)
        return ranges


def _lower(ranges: FloatArray, tries: Iterable[tuple[int, int]], distance: FloatArray) -> None:
    """Lowers ranges to the distances of pairs of rays and faces."""
    first = 0
    for low, high in tries:
        reached = ranges[low:high]
        np.minimum(reached, distance[first : first + high - low], out=reached)
        first += high - low


def _stream(root: np.random.SeedSequence, number: int) -> np.random.Generator:
    """The numbered child stream of a root, whatever was spawned from the root before."""
    key = (*root.spawn_key, number)
    return np.random.default_rng(
        np.random.SeedSequence(root.entropy, spawn_key=key, pool_size=root.pool_size)
    )


def all_round(scan: RangeScan) -> bool:
    """Whether the first ray is the neighbour of the last."""
    return len(scan.ranges_m) * scan.spacing_rad > math.tau - 1e-9


def clockwise_from(start_rad: float, east: FloatArray, north: FloatArray) -> FloatArray:
    """(k,) bearings of offsets, clockwise from a bearing, in [0, 2 pi]."""
    turns = (np.arctan2(east, north) - start_rad) * (1.0 / math.tau)
    turned: FloatArray = (turns - np.floor(turns)) * math.tau
    return turned


def supported(scan: RangeScan, apart_m: float) -> NDArray[np.bool_]:
    """(n,) which rays returned something that one of the two to either side returned, too: no false return."""
    ranges = scan.ranges_m if all_round(scan) else np.concatenate((scan.ranges_m, np.full(2, math.inf)))
    hit = ranges < math.inf
    finite = np.where(hit, ranges, -math.inf)
    supported = np.zeros(len(ranges), dtype=np.bool_)
    for side in (1, 2):
        # Where one of two is missing, they are infinitely far apart.
        with np.errstate(invalid="ignore"):
            alike = np.abs(finite - np.roll(finite, side)) < apart_m
        supported |= alike | np.roll(alike, -side)
    return (supported & hit)[: len(scan.ranges_m)]
