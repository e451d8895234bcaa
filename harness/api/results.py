"""The results of a flight, a comparison and a campaign: typed figures, tables, and a look for notebooks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from harness.api.metrics import Metrics
from harness.files.input_file import InputError
from harness.run_files.given_path import GIVEN
from harness.scenario.scenario import Scenario

if TYPE_CHECKING:
    import pyarrow as pa

    from harness.campaign.summary import Summary
    from harness.flight.record import Flight


@dataclass(frozen=True, eq=False, repr=False)
class FlightResult:
    """A flight that has ended: its figures, track and plans."""

    scenario: Scenario
    """The scenario as flown, every default filled in."""
    metrics: Metrics
    """Its figures, as in `metrics.json`."""
    track: pa.Table
    """The flown track, ten rows a second, with the columns of `track.parquet`."""
    plans: pa.Table
    """The accepted plans, a row each, with the columns of `plans.parquet`."""
    folder: Path | None = None
    """Its run folder; None if none was written."""
    manifest: Mapping[str, Any] = field(default_factory=dict)
    """Versions, platform, command and start time; empty without a run folder."""
    _scratch: TemporaryDirectory[str] | None = None

    @classmethod
    def of(cls, scenario: Scenario, flight: Flight) -> FlightResult:
        """The result of a flight without a run folder."""
        from harness.analysis.metrics import metrics
        from harness.run.scenario_flight import flight_limits
        from harness.run_files.run_tables import plans_table, track_table

        figures = Metrics(metrics(flight, flight_limits(scenario)))
        return cls(scenario, figures, track_table(flight.track), plans_table(flight.plans))

    @property
    def outcome(self) -> str:
        """How it ended: a value of `harness.flight.record.Outcome`, such as `reached` or `collision`."""
        return str(self.metrics.outcome)

    @property
    def reason(self) -> str:
        """How it ended, as a sentence."""
        return str(self.metrics.reason)

    @property
    def digest(self) -> str:
        """SHA-256 of the track: the same for the same scenario, seed and versions."""
        return str(self.metrics.digest)

    @property
    def recording(self) -> Path | None:
        """The rerun recording; None if none was made."""
        from harness.run_files.run_folder import RECORDING

        path = self.folder / RECORDING if self.folder else None
        return path if path and path.is_file() else None

    def show(self, width_px: int = 1000, height_px: int = 600) -> Any:
        """The recording in rerun's viewer: in a notebook as a widget, elsewhere in a window of its own.

        An InputError says that there is no recording, no screen, or that a package that the viewer needs is missing.
        """
        if (recording := self.recording) is None:
            kept = "with recording=True, and with out= where another process is to show it"
            raise InputError(f"wayproof: the run has no recording to show; fly it {kept}")
        from harness.recording.viewer import ViewerError, in_notebook, open_viewer, viewer_widget

        try:
            if in_notebook():
                return viewer_widget(recording, width_px, height_px)
            open_viewer([recording.parent])
        except ViewerError as error:
            raise InputError(f"wayproof: {error}") from error
        return None

    def __repr__(self) -> str:
        where = f", in {self.folder}" if self.folder and self._scratch is None else ""
        name, model, seed = self.scenario.name, Path(self.scenario.aircraft.model).name, self.scenario.seed
        pilot = self.scenario.planner.label if self.metrics.check is None else GIVEN
        return f"FlightResult({name}: {self.outcome}; {pilot}, {model}, seed {seed}{where})"


@dataclass(frozen=True, eq=False, repr=False)
class ComparisonResult:
    """Planners side by side."""

    table: pa.Table
    """A row a scenario and planner: outcome, reason, lengths, errors, times."""
    folder: Path
    """The comparison's folder, with `report.html` and a run folder for each flight."""

    @property
    def all_reached(self) -> bool:
        """Whether every planner reached every goal."""
        return set(self.table["outcome"].to_pylist()) <= {"reached"}

    def __repr__(self) -> str:
        reached = self.table["outcome"].to_pylist().count("reached")
        return f"ComparisonResult({len(self.table)} flights, {reached} reached; {self.folder})"


@dataclass(frozen=True, eq=False, repr=False)
class CampaignResult:
    """A campaign, or the part of it that has been flown."""

    folder: Path
    """The campaign's folder."""

    @cached_property
    def table(self) -> pa.Table:
        """One row a run, with the columns of `results.parquet`."""
        from harness.campaign.results import results_of

        return results_of(self.folder)

    @cached_property
    def summary(self) -> Summary:
        """Its summary: goals reached with intervals, lengths, clearances, by any two varied keys; the worst runs."""
        from harness.campaign.summary import summarise

        return summarise(self.folder)

    @property
    def outcomes(self) -> dict[str, int]:
        """Number of runs with each outcome, the most frequent first."""
        return dict(self.summary.outcomes)

    def __repr__(self) -> str:
        ends = ", ".join(f"{number} {outcome}" for outcome, number in self.outcomes.items())
        return f"CampaignResult({len(self.table)} runs: {ends}; {self.folder})"
