"""The rolling-window planner of the paper."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from planner.interface import Mission, Plan, PlanRequest


@dataclass(frozen=True)
class RollingWindowConfig:
    """Keys of `planner.kind: rolling_window`."""

    planning_window_m: float | None = field(
        default=None,
        metadata={
            "doc": "radius r1 of the planning window, at most the sensing range; default: the sensing range",
            "unit": "m",
            "above": 0.0,
        },
    )
    steps: int = field(
        default=8,
        metadata={"doc": "N, how many steps the search looks ahead", "unit": "1", "minimum": 1, "maximum": 50},
    )
    candidates: int = field(
        default=6,
        metadata={"doc": "n, how many paths are kept at every step", "unit": "1", "minimum": 1, "maximum": 100},
    )
    margin_m: float | None = field(
        default=None,
        metadata={
            "doc": "planned distance beyond the clearance; default: 0.1 of the clearance or twice the tracking error",
            "unit": "m",
            "minimum": 0.0,
        },
    )
    rolling_step_m: float | None = field(
        default=None,
        metadata={"doc": "distance flown before the window rolls; default: 1/16 of the planning window", "unit": "m", "above": 0.0},
    )

    def resolved(self, mission: Mission) -> RollingWindowConfig:
        """This config with every None replaced by its default for the mission."""
        window = self.planning_window_m or mission.sensor_range_m
        if window > mission.sensor_range_m:
            raise ValueError(f"planning_window_m {window:g} is larger than the sensor range {mission.sensor_range_m:g}")
        return replace(
            self,
            planning_window_m=window,
            margin_m=max(0.1 * mission.clearance_m, 2 * mission.tracking_error_m) if self.margin_m is None else self.margin_m,
            rolling_step_m=self.rolling_step_m or window / 16,
        )


class RollingWindow:
    """In progress."""

    def __init__(self, config: RollingWindowConfig, mission: Mission) -> None:
        self.config = config
        self.mission = mission

    def plan(self, request: PlanRequest) -> Plan:
        raise NotImplementedError
