"""A campaign's journal with a line that is not as it was written: told by file and line, and nothing touched."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from harness.campaign.campaign_file import load_campaign
from harness.campaign.flight import Answer, fly_job
from harness.campaign.folder import JOURNAL, CampaignFolder, sealed
from harness.campaign.results import RESULTS
from harness.campaign.runs import CampaignRuns
from harness.files.errors import RunFolderError
from harness.run.path_check import CheckedFile
from harness.scenario.kinds import registered
from tests.faults.command import CAMPAIGN_FILES
from tests.harness.campaign.test_sweep import refuses, sweep
from tests.refusals import refused

Lines = list[bytes]


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A campaign of three runs, and its folder as if it had been flown."""
    for name, text in CAMPAIGN_FILES.items():
        (tmp_path / name).write_text(text)
    runs = CampaignRuns(load_campaign(tmp_path / "campaign.yaml"))
    with CampaignFolder(tmp_path / "out", runs, resume=False) as folder:
        for number in range(len(runs)):
            flown = {"outcome": "reached", "flown_length_m": 1000.0 + number, "digest": "0"}
            folder.append(Answer(number, {**runs.cells(number), **flown}, {"wall_s": 1.0}))
        folder.write_tables()
    return tmp_path


def content(folder: Path) -> dict[str, bytes]:
    return {each.name: each.read_bytes() for each in folder.iterdir()}


def lines_of(place: Path) -> Lines:
    return (place / "out" / JOURNAL).read_bytes().splitlines(keepends=True)


def edited(index: int, cells: dict[str, Any] | None = None, **changes: Any) -> Callable[[Lines], Lines]:
    def edit(lines: Lines) -> Lines:
        line = json.loads(lines[index])
        line["row"] |= cells or {}
        lines[index] = sealed(line | changes)
        return lines

    return edit


NO_RUN = "is damaged: it tells of no run"
DAMAGE: dict[str, tuple[Callable[[Lines], Lines], str]] = {
    "no JSON": (lambda lines: [lines[0], b"x" + lines[1][1:], *lines[2:]], f":2: {NO_RUN}"),
    "empty": (lambda lines: [b"\n", *lines], f":1: {NO_RUN}"),
    "two in one": (lambda lines: [lines[0][:-1] + lines[1], *lines[2:]], f":1: {NO_RUN}"),
    "deep": (lambda lines: [b"[" * 100_000 + b"\n", *lines], f":1: {NO_RUN}"),
    "a number": (edited(2, run=2.0), f":3: {NO_RUN}"),
    "beyond": (edited(2, run=300, cells={"run": 300}), ": tells of run 300 where the last is 2"),
    "twice": (
        lambda lines: [*lines, edited(0, cells={"digest": "1"})(lines[:1])[0]],
        ":4: is damaged: it tells of run 0 otherwise than a line before it",
    ),
    "an outcome": (
        lambda lines: [lines[0].replace(b'"outcome": "', b'"outcome": "not '), *lines[1:]],
        ":1: is damaged: it tells of something else than was written: its sha256 is another",
    ),
}


@pytest.mark.parametrize("options", [(), ("--resume",)], ids=["", "resume"])
@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_line_is_named_nothing_touched(damage: str, options: tuple[str, ...], place: Path) -> None:
    edit, said = DAMAGE[damage]
    (place / "out" / JOURNAL).write_bytes(b"".join(edit(lines_of(place))))
    before = content(place / "out")
    told = refuses(place, *options)
    assert len(told.splitlines()) == 1
    if options:
        assert told.startswith(f"wayproof: {place / 'out' / JOURNAL}{said}")
    else:
        assert JOURNAL in told or "holds 3 runs" in told or "holds 4 runs" in told
    assert content(place / "out") == before


@pytest.mark.parametrize("torn", [None, b"\n", b"\x00\xff", b'{"run": 2, "ro'])
def test_a_run_told_twice_alike_is_one_and_a_torn_line_none(torn: bytes | None, place: Path) -> None:
    lines = lines_of(place)
    (place / "out" / JOURNAL).write_bytes(b"".join([*lines, lines[0] if torn is None else torn]))
    results = (place / "out" / RESULTS).read_bytes()
    assert sweep(place, "--resume") == 0
    assert (place / "out" / RESULTS).read_bytes() == results


@pytest.mark.parametrize("left", [None, b"", b'{"run": 0, "ro'], ids=["deleted", "emptied", "torn"])
def test_results_without_a_journal_are_results(left: bytes | None, place: Path) -> None:
    (place / "out" / JOURNAL).unlink()
    if left is not None:
        (place / "out" / JOURNAL).write_bytes(left)
    before = content(place / "out")
    assert f"{place / 'out'} holds {RESULTS}: go on with --resume" in refuses(place)
    (place / "campaign.yaml").write_text((place / "campaign.yaml").read_text().replace(": short", ": " + 60 * "n"))
    assert refuses(place)
    assert 'campaign.name was "short", is "' + "n" * 56 + "...; change" in refuses(place, "--resume")
    assert content(place / "out") == before


def test_a_planner_whose_file_was_edited_since_is_another_campaign(place: Path) -> None:
    """Else runs of two planners stand in one table under one name."""
    source = f"{place / 'mine.py'}:Mine"
    (place / "mine.py").write_text("class Mine:\n    def plan(self, request): ...\n")
    runs = CampaignRuns(load_campaign(place / "campaign.yaml", [registered(source)]), (source,))
    with CampaignFolder(place / "own", runs, resume=False) as folder:
        folder.append(Answer(0, {**runs.cells(0), "outcome": "reached", "digest": "0"}, {"wall_s": 1.0}))
    CampaignFolder(place / "own", runs, resume=True).__exit__()
    assert "ValueError" not in str(fly_job(runs.job(0, place)))
    (place / "mine.py").write_text("class Mine:\n    def plan(self, request): raise ValueError\n")
    assert "ValueError" in str(fly_job(runs.job(0, place)))
    with pytest.raises(RunFolderError, match=r"of another campaign: sources\.mine\.py:Mine was "):
        CampaignFolder(place / "own", runs, resume=True)


def test_a_world_whose_map_was_edited_since_is_another_campaign_and_has_other_days(place: Path) -> None:
    """Else days in two worlds are counted together, and those of a check are not flown again."""
    world, of_file = place / "short.yaml", "[{file: {path: a.map, metres_per_cell: 9}}, {circle"
    world.write_text(world.read_text().replace("[{circle", of_file))
    (place / "line.csv").write_text("x_m,y_m\n500,500\n900,500\n")
    digests, runs = [], []
    for cells in ("..", "@."):
        (place / "a.map").write_text(f"type octile\nheight 2\nwidth 2\nmap\n{cells}\n..\n")
        digests.append(CheckedFile(place / "line.csv", [("aircraft.model", "aerosonde")], world).digest)
        runs.append(CampaignRuns(load_campaign(place / "campaign.yaml")))
        runs[-1].check()
    assert digests[0] != digests[1]
    with CampaignFolder(place / "own", runs[0], resume=False) as folder:
        folder.append(Answer(0, runs[0].cells(0), {}))
    with pytest.raises(RunFolderError, match=r"of another campaign: files\..*a\.map was "):
        CampaignFolder(place / "own", runs[1], resume=True)


def test_results_that_cannot_be_read_count_and_are_made_anew_from_the_journal(place: Path) -> None:
    whole = (place / "out" / RESULTS).read_bytes()
    shutil.copytree(place / "out", place / "lost")
    for folder in ("out", "lost"):
        (place / folder / RESULTS).write_bytes(b"spoilt")
    (place / "lost" / JOURNAL).unlink()
    said = refused("sweep", place / "campaign.yaml", "--out", place / "lost")
    assert f"holds {RESULTS}: go on with --resume" in said
    assert sweep(place, "--resume") == 0
    assert (place / "out" / RESULTS).read_bytes() == whole
