"""What laws have in common that decide on a bank from the nearest point of their route."""

from __future__ import annotations

from abc import ABC, abstractmethod

from aircraft.guidance.interface import UPDATE_RATE_HZ, GuidanceLimits, GuidanceOutput
from aircraft.guidance.progress import PathPoint, RouteProgress
from aircraft.interface import AircraftState, Route


class RouteLaw(ABC):
    """Keeps the place on the route, and the roll command within the limits. Implements `GuidanceLaw`.

    A law is a subclass that decides in `demand`.
    """

    def __init__(self, limits: GuidanceLimits) -> None:
        self._limit_rad, self._step_rad = limits.bank_limit_rad, limits.roll_rate_radps / UPDATE_RATE_HZ
        self._progress: RouteProgress | None = None
        self._roll_rad = 0.0

    @property
    def progress(self) -> RouteProgress:
        """The place on the route; RuntimeError if there is no route yet."""
        if self._progress is None:
            raise RuntimeError("follow() a route before update()")
        return self._progress

    def follow(self, route: Route, arc_length_m: float = 0.0) -> None:
        """Takes a new route; the roll command goes on from where it is."""
        self._progress = RouteProgress(route, arc_length_m)

    @abstractmethod
    def demand(self, state: AircraftState, place: PathPoint) -> tuple[float, float]:
        """Roll (rad) and true airspeed (m/s; NaN: the mission's) that the law asks for, without limits."""

    def update(self, state: AircraftState) -> GuidanceOutput:
        """Decides the roll command: what the law wants, within the bank limit, changed as fast as the aircraft can."""
        place = self.progress.nearest(state.east_m, state.north_m)
        demand, airspeed_mps = self.demand(state, place)
        allowed = min(max(demand, -self._limit_rad), self._limit_rad)
        self._roll_rad += min(max(allowed - self._roll_rad, -self._step_rad), self._step_rad)
        return GuidanceOutput(
            self._roll_rad, place.off_m, place.arc_length_m, allowed != demand, place.past_end, airspeed_mps
        )


def centre_of(place: PathPoint) -> tuple[float, float]:
    """East and north (m) of the centre of the arc that a point is on."""
    radius = 1.0 / place.curvature_1pm
    return place.east_m - radius * place.tangent_north, place.north_m + radius * place.tangent_east
