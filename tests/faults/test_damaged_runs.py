"""Run folders that were damaged after they were written, given to whatever reads them."""

import json
import os
import shutil
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from harness.cli.app import main
from tests.faults.hostile import JSON_SNIPPETS, KEYS, as_json, spoilt, spoilt_bytes
from tests.longer import longer
from tests.refusals import refused

FILES = ("track.parquet", "plans.parquet", "metrics.json", "manifest.json", "scenario.yaml")
INDICES = {
    "manifest.json": ("fly", "paper_circles"),
    "campaign.json": ("sweep", "forest_planners"),
    "falsify.json": ("falsify", "paper_circles", "--vary", "environment.wind.speed_mps=0:20"),
    "comparison.json": ("compare", "paper_circles", "--planners", "bug2"),
}
TREES = {"metrics.json": (JSON_SNIPPETS, as_json), "manifest.json": (JSON_SNIPPETS, as_json)}


@st.composite
def damage(draw: st.DrawFn, whole: Path, name: str) -> bytes:
    """What a file of a run becomes: bytes changed, and in JSON values too."""
    data = (whole / name).read_bytes()
    if name in TREES and draw(st.booleans()):
        snippets, write = TREES[name]
        return write(draw(spoilt(json.loads(data), snippets, KEYS))).encode("utf-8", "surrogatepass")
    if (how := draw(st.sampled_from(("pieces", "flip", "flip", "cut")))) == "pieces":
        return draw(spoilt_bytes(data))
    at = draw(st.integers(0, len(data) - 1))
    return data[:at] if how == "cut" else data[:at] + bytes([data[at] ^ draw(st.integers(1, 255))]) + data[at + 1 :]


NOTES = ("the run did not reach its goal", "area.origin is 47, 8, also the default")
"""How what is said of a file that was written begins."""


@pytest.mark.parametrize("cases", [*longer([8]), pytest.param(150, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", FILES)
def test_export_and_report_of_a_damaged_run(
    name: str, cases: int, a_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "run"
    shutil.copytree(a_run, copy)
    (copy / "flight.rrd").unlink()
    manifest = json.loads((copy / "manifest.json").read_text())
    del manifest["sha256"]
    formats = ("plan", "waypoints", "geojson", "kml")

    @settings(max_examples=cases, derandomize=True, database=None, suppress_health_check=list(HealthCheck))
    @given(
        damage(a_run, name),
        st.booleans(),
        st.sampled_from(formats),
        st.sampled_from(("flown", "planned")),
        st.integers(0, 7),
    )
    def each(data: bytes, summed: bool, form: str, what: str, reported: int) -> None:
        (copy / "manifest.json").write_bytes(
            (a_run / "manifest.json").read_bytes() if summed else json.dumps(manifest).encode()
        )
        (copy / name).write_bytes(data)
        read_or_refused(["export", str(copy), "--format", form, "--what", what], copy, capsys)
        if reported == 0:
            read_or_refused(["report", str(copy)], copy, capsys)
        (copy / name).write_bytes((a_run / name).read_bytes())

    each()


def read_or_refused(arguments: list[str], folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status = main(arguments)
    said = capsys.readouterr()
    assert status in (0, 2), said.err
    assert "Traceback" not in said.err
    lines = said.err.splitlines()
    if status == 0:
        assert all(line.startswith(NOTES) for line in lines)
        return
    assert lines
    assert len(lines) <= 5
    assert all(str(folder) in line and len(line) < 800 for line in lines) or "leave --what out" in said.err


def pipe(path: Path) -> None:
    os.mkfifo(path)


def loop(path: Path) -> None:
    path.symlink_to(path)


def device(path: Path) -> None:
    path.symlink_to("/dev/zero")


@pytest.mark.parametrize(
    ("name", "make"),
    [
        *((name, make) for name in FILES for make in (pipe, loop, device, Path.mkdir, Path.touch)),
        *(("flight.rrd", make) for make in (pipe, loop, device, Path.mkdir)),
    ],
)
def test_something_else_in_place_of_a_file(name: str, make: Any, a_run: Path, tmp_path: Path) -> None:
    copy = tmp_path / "run"
    shutil.copytree(a_run, copy)
    (copy / name).unlink()
    make(copy / name)
    for arguments in (["report", str(copy)], ["view", str(copy), str(a_run)]):
        if (name == "flight.rrd") == (arguments[0] == "view"):
            said = refused(*arguments)
            assert str(copy) in said
            assert len(said.splitlines()) == 1


@pytest.mark.parametrize("name", INDICES)
@pytest.mark.parametrize("kind", ["too deep", "a pipe"])
def test_a_folder_with_an_index_that_is_none_is_somebody_elses(kind: str, name: str, tmp_path: Path) -> None:
    if kind == "a pipe":
        os.mkfifo(tmp_path / name)
    else:
        (tmp_path / name).write_text("[" * 100_000)
    assert f"{tmp_path} is not empty and not a" in refused(*INDICES[name], "--out", tmp_path)
    assert [each.name for each in tmp_path.iterdir()] == [name]
