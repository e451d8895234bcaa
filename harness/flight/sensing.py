"""Takes scans of the true world and enters them into the map once they are available."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from aircraft.interface import AircraftState
from harness.flight.observer import Observer
from harness.flight.plans import LATE_S
from harness.mapping.scan import RangeScan
from harness.mapping.sensed_map import SensedMap
from harness.world.range_sensor import RangeSensor


class Sensing:
    """The range sensor, its scans that are not available yet, and the map; without a sensor nothing is sensed."""

    def __init__(self, sensor: RangeSensor | None, seen: SensedMap, observers: Sequence[Observer]) -> None:
        self._sensor, self._map, self._observers = sensor, seen, observers
        self.pending: deque[RangeScan] = deque()  # scans that the map has not got yet, the oldest first

    def scan(self, true: AircraftState, believed: AircraftState) -> None:
        """Takes a scan from the true state; the map receives it as taken from the believed one."""
        assert self._sensor is not None
        scan = self._sensor.scan(true.east_m, true.north_m, true.heading_rad, true.time_s)
        for observer in self._observers:
            observer.on_scan(scan, true)
        if believed is not true:
            scan = scan.taken_from(believed.east_m, believed.north_m, believed.heading_rad)
        self.pending.append(scan)

    def enter(self, time_s: float) -> RangeScan | None:
        """Enters the oldest scan into the map if it is available; returns it, else None."""
        if not self.pending or self.pending[0].available_s > time_s + LATE_S:
            return None
        scan = self.pending.popleft()
        self._map.update(scan)
        return scan

    def start_over(self, time_s: float) -> None:
        """Forgets the map and the pending scans."""
        self.pending.clear()
        self._map.start_over(time_s)
