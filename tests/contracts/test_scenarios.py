"""What every shipped scenario must be."""

import math
from pathlib import Path
from typing import Any

import pytest
import yaml

from harness.cli.app import main
from harness.cli.inputs import summary
from harness.scenario.scenario import scenario_schema
from harness.scenario.shipped import scenario_path, shipped_scenarios
from tests.scenarios import scenario_of
from wayproof import Scenario, dump_scenario, load_scenario

SHIPPED = shipped_scenarios()


def line_distance(scenario: Scenario, point: tuple[float, float]) -> float:
    (x0, y0), (x1, y1) = scenario.mission.start_m, scenario.mission.goal_m
    along = ((point[0] - x0) * (x1 - x0) + (point[1] - y0) * (y1 - y0)) / math.hypot(x1 - x0, y1 - y0) ** 2
    along = min(max(along, 0.0), 1.0)
    return math.dist(point, (x0 + along * (x1 - x0), y0 + along * (y1 - y0)))


def test_the_folder_validates(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", *map(str, SHIPPED.values())]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert len([line for line in said.out.splitlines() if line.endswith(": valid")]) == len(SHIPPED) >= 5


@pytest.mark.parametrize("name", SHIPPED)
def test_is_named_after_its_file_and_says_what_it_is_for(name: str) -> None:
    assert load_scenario(SHIPPED[name]).name == name
    assert SHIPPED[name].read_text().split("\n", 1)[1].startswith(f"# {summary(SHIPPED[name])}\n")
    assert len(summary(SHIPPED[name])) > 30


@pytest.mark.parametrize("name", SHIPPED)
def test_its_dump_is_the_same_scenario(name: str) -> None:
    scenario = load_scenario(SHIPPED[name])
    text = dump_scenario(scenario)
    assert scenario_of(text) == scenario
    # Other programs read the dump as YAML 1.1.
    plain: dict[str, Any] = yaml.safe_load(text)
    assert plain["mission"]["goal_m"] == list(scenario.mission.goal_m)
    assert plain["planner"]["clearance_m"] == scenario.planner.clearance_m


@pytest.mark.parametrize("name", SHIPPED)
def test_is_found_by_name_and_by_path_from_anywhere(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert scenario_path(name) == scenario_path(f"scenarios/{name}.yaml") == SHIPPED[name]


def test_paper_circles_is_the_papers_world() -> None:
    scenario = load_scenario(SHIPPED["paper_circles"])
    assert scenario.area.bounds_m == (0.0, 0.0, 100e3, 100e3)
    assert scenario.mission.start_m == (10e3, 10e3)
    assert scenario.mission.goal_m == (80e3, 70e3)
    circles = [o.circle for o in scenario.obstacles if o.circle]
    assert len(circles) == len(scenario.obstacles) == 10
    assert all(4000 <= c.radius_m <= 9000 for c in circles)
    assert sum(line_distance(scenario, c.center_m) < c.radius_m for c in circles) >= 3
    for i, a in enumerate(circles):
        for b in circles[:i]:
            assert math.dist(a.center_m, b.center_m) - a.radius_m - b.radius_m > 3000


def keys_of(value: object, prefix: str = "") -> set[str]:
    """Key paths of plain values, list indices left out."""
    if isinstance(value, dict):
        below = [keys_of(inner, f"{prefix}.{key}") for key, inner in value.items()]
        return {f"{prefix}.{key}" for key in value}.union(*below)
    if isinstance(value, list):
        return set().union(*(keys_of(inner, prefix) for inner in value))
    return set()


def schema_keys(part: dict[str, Any], defs: dict[str, Any], prefix: str = "") -> set[str]:
    """Key paths of a JSON Schema, list indices left out; of the planners, the first."""
    if "$ref" in part:
        return schema_keys(defs[part["$ref"].rpartition("/")[2]], defs, prefix)
    if "anyOf" in part:
        return schema_keys(part["anyOf"][0], defs, prefix)
    if "items" in part:
        return schema_keys(part["items"], defs, prefix)
    below = [schema_keys(inner, defs, f"{prefix}.{key}") for key, inner in part.get("properties", {}).items()]
    return {f"{prefix}.{key}" for key in part.get("properties", {})}.union(*below)


def test_one_of_everything_has_every_key() -> None:
    schema = scenario_schema()
    written = keys_of(yaml.safe_load(SHIPPED["one_of_everything"].read_text()))
    instead = {f".mission.{end}{key}" for end in ("start", "goal") for key in ("", ".latitude_deg", ".longitude_deg")}
    wayproofs_own = {key for key in schema_keys(schema, schema["$defs"]) if key.startswith((".sources", ".normals"))}
    assert written == schema_keys(schema, schema["$defs"]) - instead - wayproofs_own
    assert ".obstacles.circle.radius_m" in written
    assert ".planner.steps" in written
