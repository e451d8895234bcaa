"""The paper's symbols as keys of a scenario; where the paper gives no value, the default is ours."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from planner.interface import Mission
from planner.keys import MarginConfig, key
from planner.paper.model import most_units


@dataclass(frozen=True)
class ImprovedBugConfig(MarginConfig):
    """Keys of `planner.kind: improved_bug`."""

    planning_window_m: float | None = key(
        None,
        "radius r1 of the planning window; no track point lies further from the aircraft; "
        "default: the sensor range, which is the most",
        "m",
        above=0.0,
    )
    steps: int = key(8, "N, steps of a search", minimum=1, maximum=100)
    candidates: int = key(8, "n, candidates kept at every step", minimum=1, maximum=100)
    step_m: float | None = key(
        None, "S0, length of a step; default: r1 / N, at most 0.6 r1, at least R / 2", "m", above=0.0
    )
    course_unit_deg: float = key(1.0, "theta0, smallest change of course", "deg", above=0.0, maximum=45.0)
    sectors: int = key(4, "sectors planned in at every step", minimum=1, maximum=100)
    refinement_deg: float = key(
        0.25, "a sector is refined down to this angle; 360 takes its middle", "deg", above=0.0, maximum=360.0
    )
    route_optimisation: bool = key(True, "whether track points between which the way is free are cancelled")

    def resolved(self, mission: Mission) -> ImprovedBugConfig:
        """This config, each None replaced by its default; ValueError: window or step do not fit the sensing range."""
        window = mission.sensor_range_m if self.planning_window_m is None else self.planning_window_m
        if window > mission.sensor_range_m:
            raise ValueError(
                f"planning_window_m is {window:g}, more than sensor.range_m {mission.sensor_range_m:g}; "
                "must be at most that: nothing is sensed beyond"
            )
        radius = mission.turn_radius_m
        step = self.step_m or max(min(window / self.steps, 0.6 * window), 0.5 * radius)
        if 1.5 * step > window:
            raise ValueError(
                f"planning_window_m is {window:g}, less than one and a half steps of {step:g} m; "
                f"must be at least {math.ceil(1.5 * step)}"
            )
        if not most_units(step, radius, self.unit_rad):
            raise ValueError(
                f"step_m is {step:g}, too short to turn by course_unit_deg {self.course_unit_deg:g} at a radius of "
                f"{radius:.0f} m; must be at least {math.ceil(2.0 * radius * math.tan(0.5 * self.unit_rad))}"
            )
        return replace(self, planning_window_m=window, step_m=step, margin_m=self.margin(mission))

    @property
    def unit_rad(self) -> float:
        """theta_0 in rad."""
        return math.radians(self.course_unit_deg)

    @property
    def resolved_step_m(self) -> float:
        """S_0 of a resolved config."""
        assert self.step_m is not None
        return self.step_m
