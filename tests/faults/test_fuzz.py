"""Files that people could give, spoilt in every way: each is taken, or refused in a few lines that name it.

A reader of another kind of file is one entry of `READERS`. The larger numbers of cases run with `-m slow`.
"""

import json
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from harness.campaign.campaign_file import CampaignFile, load_campaign
from harness.campaign.runs import CampaignRuns
from harness.files import strict_yaml
from harness.run.path_check import prepare_check
from harness.run_files.path_files import read_path
from tests.faults.hostile import (
    CAMPAIGN_SNIPPETS,
    CELLS,
    JSON_SNIPPETS,
    KEYS,
    YAML_SNIPPETS,
    Raw,
    as_json,
    as_yaml,
    places,
    spoilt,
    spoilt_bytes,
)
from tests.longer import longer
from tests.scenarios import scenario_of
from wayproof import InputError, dump_scenario, load_scenario

SCENARIOS = Path(__file__).parents[2] / "scenarios"
LONGEST_S = 15.0
"""Seconds of processor time for one small file, the survey of an aircraft that it names included."""
LONGEST_LINE, MOST_LINES = 600, 5


def plain(value: Any) -> Any:
    """With lists for tuples and raw pieces for numbers and names, as they were written."""
    if isinstance(value, dict):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, tuple | list):
        return [plain(each) for each in value]
    return value


EVERYTHING = plain(strict_yaml.read(SCENARIOS / "one_of_everything.yaml").plain())
CAMPAIGN = plain(strict_yaml.read(SCENARIOS / "campaigns" / "everything.yaml").plain())
LEAST = {
    "schema": "wayproof/scenario/1",
    "name": "least",
    "area": {"bounds_m": [0, 0, 8000, 6000]},
    "mission": {"start_m": [500, 3000], "goal_m": [7500, 3000]},
}
LINE = [[8.0, 47.0], [8.01, 47.0], [8.02, 47.01]]
GEOJSON = {
    "type": "FeatureCollection",
    "features": [{"type": "Feature", "properties": {}, "geometry": {"type": "LineString", "coordinates": LINE}}],
}


def item(command: int, north: float, *params: float | None) -> dict[str, Any]:
    place = [47.0 + north, 8.0, 120]
    return {"type": "SimpleItem", "command": command, "frame": 3, "params": [*params, *place]}


def plan(*items: dict[str, Any], **more: Any) -> dict[str, Any]:
    mission = {"firmwareType": 3, "plannedHomePosition": [47.0, 8.0, 400], "items": list(items)}
    return {"fileType": "Plan", "mission": mission, **more}


PLAN = plan(*(item(16, north, 0, 0, 0, None) for north in (0.0, 0.01, 0.02)))
CSV = [["x_m", "y_m"], ["0", "0"], ["500", "0"], ["900", "700"]]
WAYPOINTS = [
    ["QGC WPL 110"],
    *(f"{n} 0 {3 * (n > 0)} 16 0 0 0 0 47.{n} 8.0 {120 if n else 400} 1".split() for n in range(3)),
]


def read_scenario(path: Path) -> None:
    """Loads a scenario; one that is taken is the same when it is written out and read again."""
    taken = load_scenario(path)
    assert scenario_of(dump_scenario(taken)) == taken


def read_campaign(path: Path) -> None:
    """Loads a campaign and makes its first run and its last; one that is taken can be flown from its results alone."""
    taken = CampaignRuns(load_campaign(path))
    again = CampaignRuns(CampaignFile.from_plain(json.loads(json.dumps(taken.file.plain())), str(path)))
    assert (len(taken), taken.varied) == (len(again), again.varied)
    for number in sorted({0, len(taken) - 1}):
        assert taken.cells(number) == again.cells(number)
        assert scenario_of(dump_scenario(taken.scenario(number))) == again.scenario(number)


def read_given_path(path: Path) -> None:
    assert len(prepare_check(read_path(path, any_altitude=True)).plan.way.segments) >= 1


@dataclass(frozen=True)
class Reader:
    """A kind of file: what reads it, a valid one as a tree or rows, what writes a spoilt tree, and what spoils it."""

    name: str
    read: Callable[[Path], None]
    valid: Any
    write: Callable[[Any], str]
    snippets: tuple[str, ...]

    def holds(self, folder: Path) -> Callable[[bytes], None]:
        """The property that a file of some bytes is taken or refused."""
        path = folder / self.name

        def holds(data: bytes) -> None:
            path.write_bytes(data)
            taken_or_refused(path, lambda: self.read(path))

        return holds


def rows(between: str) -> Callable[[Any], str]:
    def write(value: Any) -> str:
        listed = value if isinstance(value, list) else [value]
        cells = [row if isinstance(row, list) else [row] for row in listed]
        return "\n".join(between.join(_cell(cell) for cell in row) for row in cells) + "\n"

    return write


def _cell(cell: Any) -> str:
    return cell.text if isinstance(cell, Raw) else " ".join(map(_cell, cell)) if isinstance(cell, list) else cell


READERS = {
    "scenario": Reader("s.yaml", read_scenario, EVERYTHING, as_yaml, YAML_SNIPPETS),
    "short scenario": Reader("s.yaml", read_scenario, LEAST, as_yaml, YAML_SNIPPETS),
    "campaign": Reader("c.yaml", read_campaign, CAMPAIGN, as_yaml, CAMPAIGN_SNIPPETS),
    "geojson": Reader("p.geojson", read_given_path, GEOJSON, as_json, JSON_SNIPPETS),
    "plan": Reader("p.plan", read_given_path, PLAN, as_json, JSON_SNIPPETS),
    "csv": Reader("p.csv", read_given_path, CSV, rows(","), CELLS),
    "waypoints": Reader("p.waypoints", read_given_path, WAYPOINTS, rows("\t"), CELLS),
}
CASES = [25, pytest.param(1500, marks=pytest.mark.slow)]


def fuzzed(cases: int, strategy: st.SearchStrategy[Any], holds: Callable[[Any], None]) -> None:
    """Tries a property on so many cases, the same ones every time."""
    tried = 0

    @settings(max_examples=cases, derandomize=True, database=None, suppress_health_check=list(HealthCheck))
    @given(strategy)
    def each(case: Any) -> None:
        nonlocal tried
        tried += 1
        holds(case)

    each()
    assert tried >= cases


def taken_or_refused(path: Path, read: Callable[[], object]) -> None:
    """A file is read, or refused as a person can use it, in good time."""
    begun = time.process_time()
    try:
        read()
    except InputError as error:
        said = str(error)
    else:
        said = str(path)
    lines = said.splitlines()
    assert 1 <= len(lines) <= MOST_LINES
    assert all(line.startswith((str(path), "command line")) for line in lines)
    assert max(map(len, lines)) < LONGEST_LINE + len(str(path))
    assert said.replace("\n", "").isprintable()
    assert time.process_time() - begun < LONGEST_S


@pytest.fixture(autouse=True)
def files_beside(tmp_path: Path) -> None:
    """The scenario of every key names a file beside itself."""
    shutil.copy(SCENARIOS / "one_of_everything.geojson", tmp_path)


@pytest.mark.parametrize("kind", READERS)
def test_the_unspoilt_file_is_taken(kind: str, tmp_path: Path) -> None:
    reader = READERS[kind]
    path = tmp_path / reader.name
    path.write_text(reader.write(reader.valid))
    reader.read(path)


@pytest.mark.parametrize("cases", CASES)
@pytest.mark.parametrize("kind", READERS)
def test_a_file_with_wrong_things_in_it(kind: str, cases: int, tmp_path: Path) -> None:
    reader = READERS[kind]
    trees = spoilt(reader.valid, reader.snippets, KEYS)
    fuzzed(
        cases,
        trees.map(lambda tree: reader.write(tree).encode("utf-8", "surrogatepass")),
        reader.holds(tmp_path),
    )


@pytest.mark.parametrize("cases", [15, pytest.param(700, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", READERS)
def test_a_file_that_is_torn(kind: str, cases: int, tmp_path: Path) -> None:
    reader = READERS[kind]
    fuzzed(cases, spoilt_bytes(reader.write(reader.valid).encode()), reader.holds(tmp_path))


@pytest.mark.parametrize("cases", [10, *longer([25]), pytest.param(1500, marks=pytest.mark.slow)])
def test_keys_set_on_the_command_line(cases: int, tmp_path: Path) -> None:
    path = tmp_path / "s.yaml"
    path.write_text(as_yaml(EVERYTHING))
    known = st.sampled_from(list(filter(None, map(strict_yaml.key_path, places(EVERYTHING)))))
    long = ("a" * 5000, "a." * 3000 + "a", "obstacles[" + "9" * 5000 + "]")
    odd = st.sampled_from((*KEYS, *long, "obstacles[99]", "obstacles[-1]"))
    name = st.one_of(known, known, odd, st.builds("{}.{}".format, known, odd), st.text(max_size=8))
    value = st.one_of(st.sampled_from(YAML_SNIPPETS), st.text(max_size=8))

    def holds(pairs: list[tuple[str, str]]) -> None:
        taken_or_refused(path, lambda: dump_scenario(load_scenario(path, pairs)))

    fuzzed(cases, st.lists(st.tuples(name, value), min_size=1, max_size=2), holds)
