"""The report of a single run, written into its folder: page, figures as SVG and PNG, table as CSV."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.analysis.causes import FINDINGS
from harness.analysis.rows import to_csv
from harness.files.errors import RunFolderError
from harness.files.input_file import InputError
from harness.files.whole_file import replace_text
from harness.report.chapters import entry, run_chapter
from harness.report.page import rendered
from harness.run_files.run_folder import REPORT, SCENARIO, WRONG_CONTENT, Run, damaged, load_run
from harness.scenario.scenario import Scenario, parse_scenario
from harness.world.optimum import optimum_of


def write_report(folder: Path) -> Path:
    """Writes the report of a complete run, else RunFolderError or InputError; returns the path of its page."""
    run = load_run(folder)
    try:
        return _write(run, folder)
    except InputError:
        raise
    except OSError as error:
        raise RunFolderError(f"cannot write the report in {folder}: {error.strerror or error}") from error
    except WRONG_CONTENT as error:
        raise damaged(folder, error) from error


def _write(run: Run, folder: Path) -> Path:
    scenario = parse_scenario(run.scenario_yaml, str(folder / SCENARIO), as_flown=True)
    optimum = optimum_of(scenario)
    flight = entry(scenario, run, optimum)
    page, manifest = folder / REPORT, run.manifest
    line, *_ = manifest["command"]
    if not isinstance(line, str):
        raise TypeError(f"command: must be text; got {type(line).__name__}")
    _, *arguments = shlex.split(line)
    legs, given = run.metrics["trackability"], "check" in run.metrics
    lost = [leg for leg in legs if not leg["trackable"]]
    text = rendered(
        "run.html",
        chapter=run_chapter(scenario, flight, optimum),
        row=flight.row,
        legs=legs,
        lost=lost,
        findings={cause: text for cause, text in FINDINGS.items() if cause in {leg["cause"] for leg in lost}},
        exceeded=_exceeded_limits(scenario, lost),
        checked=run.metrics if given else None,
        remarks=[(each["kind"], each["text"]) for each in run.metrics.get("findings", ())],
        aircraft=Path(scenario.aircraft.model).name,
        scenario_yaml=run.scenario_yaml,
        command=shlex.join(["wayproof", *arguments]),
        versions={name: version for name, version in manifest["versions"].items() if version},
        platform=manifest["platform"]["system"],
        written=manifest["started_utc"],
    )
    replace_text(page.with_suffix(".csv"), to_csv([flight.row]))
    replace_text(page, text)
    return page


def _exceeded_limits(scenario: Scenario, lost: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Returns the limits, beside the path's, that legs exceeded: figure of `trackability`, label, limit."""
    limits = scenario.trackability
    given = (
        ("max_altitude_error_m", "altitude error, m", limits.altitude_m),
        ("max_airspeed_error_mps", "airspeed error, m/s", limits.airspeed_mps),
        ("max_load_factor", "load factor", limits.load_factor),
    )
    return [
        {"figure": figure, "label": label, "most": most}
        for figure, label, most in given
        if most is not None and any((leg.get(figure) or 0.0) > most for leg in lost)
    ]
