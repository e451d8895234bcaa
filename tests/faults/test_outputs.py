"""Outputs go to fresh files of their folder: no link is followed, edits are found, full disks survived."""

import csv
import hashlib
import io
import json
import os
import resource
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from harness.cli.app import main
from harness.files.whole_file import PARTIAL
from tests.faults.command import FOREST
from tests.harness.run.given import written
from tests.refusals import refused

OUTPUTS = ("report.html", "report.csv", "path.svg", "path.png")


@pytest.fixture
def sent(a_run: Path, tmp_path: Path) -> Path:
    shutil.copytree(a_run, tmp_path / "run")
    return tmp_path / "run"


@contextmanager
def full_disk(size: int) -> Iterator[None]:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_report_writes_through_no_link(sent: Path, tmp_path: Path) -> None:
    victim = written(tmp_path / "victim", "mine")
    for name in OUTPUTS:
        for link in (sent / name, sent / f"{name}{PARTIAL}"):
            link.unlink(missing_ok=True)
            link.symlink_to(victim)
    assert main(["report", str(sent)]) == 0
    assert victim.read_text() == "mine"
    assert not any((sent / name).is_symlink() for name in OUTPUTS)


def test_a_flight_writes_through_no_link(sent: Path, tmp_path: Path) -> None:
    victim = written(tmp_path / "victim", "mine")
    for name in ("manifest.json", "scenario.yaml", "metrics.json", "track.parquet", "flight.rrd"):
        (sent / f"{name}{PARTIAL}").symlink_to(victim)
    (sent / "flight.rrd").unlink()
    (sent / "flight.rrd").symlink_to(victim)
    assert main(["fly", str(FOREST), "--out", str(sent), "--quiet"]) == 0
    assert victim.read_text() == "mine"
    assert not (sent / "flight.rrd").is_symlink()


def test_a_pipe_in_the_place_of_an_output_is_refused_at_once(sent: Path, tmp_path: Path) -> None:
    (sent / "report.csv").unlink(missing_ok=True)
    os.mkfifo(sent / "report.csv")
    assert "report.csv: is a pipe or a device, not a file" in refused("report", sent)
    os.mkfifo(tmp_path / "pipe")
    said = refused("export", sent, "--format", "kml", "--out", tmp_path / "pipe")
    assert "pipe: is a pipe or a device, not a file" in said


@pytest.mark.parametrize("name", ["metrics.json", "scenario.yaml"])
def test_an_edited_file_of_a_run_is_named_with_its_sha256(name: str, sent: Path) -> None:
    text = (sent / name).read_text()
    (sent / name).write_text(text.replace("timeout", "reached").replace("radius_m: ", "radius_m: 1"))
    assert (sent / name).read_text() != text
    for command in (["report"], ["export", "--format", "kml"], ["view", "--web"]):
        (line,) = refused(*command, sent).splitlines()
        assert f"{name} is not what was written: its sha256 is not that in manifest.json" in line


def test_an_export_that_finds_no_room_leaves_the_file_as_it_was(
    sent: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = written(tmp_path / "way.kml", "the one before")
    with full_disk(100):
        assert main(["export", str(sent), "--format", "kml", "--out", str(out)]) == 2
    assert "way.kml" in capsys.readouterr().err
    assert out.read_text() == "the one before"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["run", "way.kml"]


def test_a_run_that_finds_no_room_at_its_start_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "some" / "run"
    with full_disk(800):  # the manifest has room, the scenario has none
        assert main(["fly", str(FOREST), "--out", str(out), "--quiet", "--no-recording"]) == 2
    assert not (tmp_path / "some").exists()
    assert ": " in capsys.readouterr().err


def test_control_characters_of_a_planners_text_are_spelt_out(sent: Path) -> None:
    metrics = json.loads((sent / "metrics.json").read_text())
    (sent / "metrics.json").write_text(json.dumps(metrics | {"reason": "red \x1b[31m"}))
    manifest = json.loads((sent / "manifest.json").read_text())
    manifest["sha256"]["metrics.json"] = hashlib.sha256((sent / "metrics.json").read_bytes()).hexdigest()
    (sent / "manifest.json").write_text(json.dumps(manifest))
    assert main(["report", str(sent)]) == 0
    (row,) = csv.DictReader(io.StringIO((sent / "report.csv").read_text()))
    assert row["reason"] == "red \\x1b[31m"
