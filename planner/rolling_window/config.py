"""The keys of the rolling-window planner, and what they default to for a mission."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from planner.geometry.joining import LEAD_S
from planner.interface import Mission
from planner.keys import MarginConfig, key
from planner.shield.certificate import DISC_RADII


@dataclass(frozen=True)
class RollingWindowConfig(MarginConfig):
    """Keys of `planner.kind: rolling_window`."""

    steps: int = key(16, "N, how many steps the search looks ahead", minimum=1, maximum=100)
    candidates: int = key(12, "n, how many candidates are kept at every step", minimum=1, maximum=100)
    rolling_step_m: float | None = key(
        None,
        "distance flown before the window rolls, unless the plan is cut near by; default: 1/16 of the sensor range",
        "m",
        above=0.0,
    )

    def resolved(self, mission: Mission) -> RollingWindowConfig:
        """This config, each None replaced by its default; ValueError: sensing range too short for the turn radius."""
        reaction_s = LEAD_S + mission.sensor_latency_s + mission.compute_latency_s + mission.roll_in_s
        radius_m, keep_m = mission.hold_radius_m, mission.clearance_m
        # A turn beside the course reaches two radii to the side; beyond lie the clearance and what is flown by then.
        least = 2.0 * DISC_RADII * radius_m + keep_m + mission.ground_speed_mps * reaction_s
        if mission.sensor_range_m < least:
            raise ValueError(
                f"sensor.range_m is {mission.sensor_range_m:g}, too short for a turn radius of "
                f"{radius_m:.0f} m with a clearance of {keep_m:g} m; "
                f"must be at least {math.ceil(least)}, to see room for a safe turn ahead"
            )
        step = mission.sensor_range_m / 16.0 if self.rolling_step_m is None else self.rolling_step_m
        return replace(self, margin_m=self.margin(mission), rolling_step_m=step)
