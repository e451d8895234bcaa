"""The log of a shield's interventions in a flight."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ShieldReport:
    """Figures of a flight under a shield."""

    interventions: int = 0  # how often the aircraft came from the planner's path onto the backup
    time_on_backup_s: float = 0.0  # in the turn that a plan ends with, or escaping
    refused_plans: int = 0  # paths of the planner of which no part that leads on could be certified


class InterventionLog:
    """Counts interventions as the planner is asked."""

    def __init__(self) -> None:
        self.refused_plans = 0
        self.backup = ""  # why the aircraft is on the backup; empty while it flies the planner's path
        self.since_s = 0.0  # time since when it is on it
        self._interventions, self._on_backup_s, self._last_s = 0, 0.0, 0.0

    def note(self, time_s: float, backup: str) -> None:
        """Notes that from now on the planner's path is flown (`backup` empty), or the backup and why."""
        if self.backup:
            self._on_backup_s += time_s - self._last_s
        elif backup:
            self._interventions += 1
            self.since_s = time_s
        self.backup, self._last_s = backup, time_s

    @property
    def report(self) -> ShieldReport:
        """The figures so far."""
        return ShieldReport(self._interventions, round(self._on_backup_s, 3), self.refused_plans)
