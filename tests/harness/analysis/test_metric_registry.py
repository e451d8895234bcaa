from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

import wayproof
from harness.analysis.metric import SEVERITY
from harness.analysis.registry import METRICS
from harness.cli.app import main
from harness.flight.record import Outcome
from harness.recording.overlay import chunks_of, properties_of
from tests.harness.breaking import SCENARIO

CAMPAIGN = """\
schema: wayproof/campaign/1
name: figures
seed: 4
scenarios: [straight.yaml]
draws: 1
recordings: thin
"""


def paths_of(content: Mapping[str, Any], prefix: str = "") -> set[str]:
    found = set()
    for name, value in content.items():
        found |= paths_of(value, f"{prefix}{name}.") if isinstance(value, Mapping) else {prefix + name}
    return found


def test_names_and_places_are_there_once() -> None:
    for names in ([m.name for m in METRICS], [m.path for m in METRICS], [m.short for m in METRICS if m.short]):
        assert len(names) == len(set(names))
    assert {outcome.value for outcome in Outcome} | {"error"} == set(SEVERITY)


def test_a_figure_stands_alike_in_metrics_campaign_comparison_and_recording(tmp_path: Path) -> None:
    """One flight, looked at four times: what the list names is there, and the same."""
    (tmp_path / "straight.yaml").write_text(SCENARIO)
    (tmp_path / "figures.yaml").write_text(CAMPAIGN)
    run = wayproof.fly(tmp_path / "straight.yaml", out=tmp_path / "run", recording=True)
    assert main(["sweep", str(tmp_path / "figures.yaml"), "--out", str(tmp_path / "all"), "--workers", "1"]) == 0
    (row,) = pq.read_table(tmp_path / "all" / "results.parquet").to_pylist()
    recorded = properties_of(chunks_of(tmp_path / "run" / "flight.rrd"))["run"]
    content = run.metrics.to_dict()
    for metric in METRICS:
        if metric.derived:
            continue
        value = metric.value(content)
        if metric.get is None and value is not None:
            assert metric.path in paths_of(content)
        if not metric.timed:
            assert row[metric.path] == value, metric.name
        if metric.recorded and value is not None and metric.kind == "number":
            shown = value * metric.factor if metric.unit == "%" else value
            assert recorded[metric.recorded_as] == [pytest.approx(shown, rel=1e-5)], metric.name


def test_the_list_of_figures_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "metrics"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "flown_length_m: flown length [m] flight_time_s: flight time [s]" in said
    assert "bank_saturation_fraction: time at the bank limit [share]" in said
    assert "total_system_error_p95_m (total_system_error_m.p95): total system error p95 [m]: distance of" in said
