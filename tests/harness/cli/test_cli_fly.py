"""Real flights through the command: what they leave behind, also when they are stopped half-way."""

import json
from pathlib import Path

import pytest
import rerun as rr

from harness.cli.app import main
from harness.files.errors import RunFolderError
from harness.recording.file import end_of_whole
from harness.run_files.run_folder import load_run
from tests.faults.command import run as run_alone
from tests.faults.command import start, wait_until
from tests.refusals import refused

RRD_HEADER_BYTES = 12
RECORDED_BYTES = 600_000
"""A good deal less than a whole recording of paper_circles, and more than its first block."""
SHORT = ("--set", "mission.time_limit_s=15")


def entities(recording: Path) -> set[str]:
    """Names of what a recording without an end holds, up to its last whole message."""
    data = bytearray(recording.read_bytes())
    recording = recording.with_suffix(".whole.rrd")
    recording.write_bytes(data[: end_of_whole(data, RRD_HEADER_BYTES)])
    with pytest.warns(rr.error_utils.RerunWarning, match="no footer"):
        found = {str(chunk.entity_path) for chunk in rr.chunk.RrdReader(recording).stream()}
    recording.unlink()
    return found


def test_flies_into_the_default_folder_and_prints_a_summary(tmp_path: Path) -> None:
    status, out, err = run_alone(tmp_path, "fly", "aerosonde_forest", "--no-recording")
    assert status == 0, err
    assert "reached: inside the goal circle after" in out
    assert out.splitlines()[-1] == "run folder: runs/aerosonde_forest/rolling_window-aerosonde-1"
    run = load_run(tmp_path / "runs" / "aerosonde_forest" / "rolling_window-aerosonde-1")
    assert run.manifest["complete"] is True
    assert "fly aerosonde_forest --no-recording" in run.manifest["command"][0]


def test_json_is_the_metrics_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run"
    assert main(["fly", "aerosonde_forest", *SHORT, "--out", str(out), "--no-recording", "--json"]) == 1
    said = capsys.readouterr()
    assert json.loads(said.out) == json.loads((out / "metrics.json").read_text())
    assert said.err == ""


@pytest.mark.flights
def test_killed_while_flying_leaves_a_readable_recording(tmp_path: Path) -> None:
    """What else it leaves is in the tests of faults."""
    out = tmp_path / "run"
    process = start(tmp_path, "fly", "paper_circles", "--out", str(out))
    rrd = out / "flight.rrd"
    wait_until(rrd.exists, process)
    wait_until(lambda: rrd.stat().st_size >= RECORDED_BYTES, process)
    process.kill()
    process.communicate(timeout=30)
    with pytest.raises(RunFolderError, match="incomplete"):
        load_run(out)
    assert {"/plan/flown", "/plan/aircraft", "/plan/goal"} <= entities(out / "flight.rrd")

    # The same folder takes another run, and nothing of the killed one is left.
    assert main(["fly", "aerosonde_forest", *SHORT, "--out", str(out), "--no-recording", "--quiet"]) == 1
    assert load_run(out).metrics["outcome"] == "timeout"
    assert not (out / "flight.rrd").exists()


def test_a_folder_with_other_things_is_refused_and_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    said = refused("fly", "aerosonde_forest", *SHORT, "--out", tmp_path, "--quiet")
    assert "not empty and not a run folder" in said
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
    assert (tmp_path / "thesis.tex").read_text() == "years of work"
