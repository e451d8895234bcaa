"""The benchmark worlds that come with the sources: each is a scenario, and says where it is from."""

import pytest

from harness.cli.app import main
from harness.scenario.shipped import scenario_path, shipped_worlds
from wayproof import load_scenario

WORLDS = shipped_worlds()
LICENCES = ("licence MIT", "licence BSD-3-Clause", "licence CC0-1.0", "licence of this project")
FIRST = {name.partition("/")[0]: name for name in reversed(WORLDS)}
"""The first world of each family."""


@pytest.mark.parametrize("family", FIRST)
def test_a_family_has_worlds_that_can_be_flown(family: str) -> None:
    assert load_scenario(scenario_path(FIRST[family])).name == FIRST[family].partition("/")[2]


def test_every_world_names_its_source_and_a_licence_that_lets_it_be_passed_on() -> None:
    assert len(WORLDS) > 150
    notices = (scenario_path(next(iter(WORLDS))).parents[1] / "LICENCES.md").read_text()
    for name, path in WORLDS.items():
        first = path.read_text().partition("\n")[0]
        assert any(licence in first for licence in LICENCES), name
        source = first.removeprefix("# github.com/").partition(",")[0]
        assert first.startswith("# Generated for this project") or source in notices


def test_list_worlds_has_a_row_for_each_family(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "worlds"]) == 0
    rows = capsys.readouterr().out.splitlines()
    assert [row.split()[0] for row in rows] == sorted(FIRST)
    assert sum(int(row.split()[1]) for row in rows) == len(WORLDS)
    assert all("licence" in row for row in rows)
