"""Campaign files: what their runs fly, what two runs share, and every mistake refused before a flight."""

import json
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.campaign.campaign_file import CampaignFile, campaign_schema, is_a, load_campaign, validated
from harness.campaign.runs import CampaignRuns
from harness.cli.app import main
from harness.files.strict_yaml import node_of
from harness.scenario.shipped import shipped_campaigns, shipped_scenarios
from tests.refusals import refused
from wayproof import InputError, load_scenario

ROOT = Path(__file__).parents[3]
SCENARIO = """\
schema: wayproof/scenario/1
name: {name}
area: {{bounds_m: [0, 0, 3000, 3000]}}
obstacles:
  - circle: {{center_m: [1500, 1500], radius_m: 300}}
mission: {{start_m: [300, 300], goal_m: [2700, 2700], goal_radius_m: 60, course_deg: 10}}
aircraft: {{model: aerosonde, airspeed_mps: 25}}
sensor: {{range_m: 2500}}
planner: {{kind: rolling_window, clearance_m: 40}}
"""
SMALL = "schema: wayproof/campaign/1\nname: small\nseed: 5\n"
CAMPAIGN = """\
schema: wayproof/campaign/1
name: small
seed: 5
scenarios: [ring.yaml]
planners: [rolling_window, {kind: bug2, clearance_m: 50}]
aircraft:
  - aerosonde
  - {model: c172p, airspeed_mps: 50}
set:
  mission.time_limit_s: 900
grid:
  environment.wind.speed_mps: [0, 4.5]
  environment.turbulence: [null, {model: tustin, intensity: light}]
random:
  environment.wind.from_deg: {uniform: [0, 360]}
  sensor.rays: {choice: [360, 720]}
  sensor.dropout: {normal: {mean: 0, sigma: 0.05, least: 0, most: 0.1}}
draws: 3
"""


@pytest.fixture
def place(tmp_path: Path) -> Path:
    (tmp_path / "ring.yaml").write_text(SCENARIO.format(name="ring"))
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "b.yaml").write_text(SCENARIO.format(name="b"))
    (tmp_path / "more" / "a.yaml").write_text(SCENARIO.format(name="a"))
    return tmp_path


def runs_of(place: Path, text: str = CAMPAIGN) -> CampaignRuns:
    file = place / "campaign.yaml"
    file.write_text(text)
    return CampaignRuns(load_campaign(file))


def all_of(runs: CampaignRuns) -> list[dict[str, Any]]:
    return [runs.cells(number) for number in range(len(runs))]


def test_every_combination_is_drawn_and_flown_by_every_pair(place: Path) -> None:
    runs = runs_of(place)
    every = all_of(runs)
    assert (len(runs), runs.cases) == (3 * 4 * 4, 3 * 4)
    assert [run["run"] for run in every] == list(range(48))
    keys = ("environment.wind.speed_mps", "environment.turbulence", "planner", "aircraft")
    assert len({tuple(run[key] for key in keys) for run in every}) == 16
    light = '{"model": "tustin", "intensity": "light"}'
    assert {run["environment.turbulence"] for run in every} == {None, light}
    assert {run["world"] for run in every} == {"ring.yaml"}
    assert {run["scenario"] for run in every} == {"ring"}
    assert runs.varied == [
        "environment.wind.speed_mps", "environment.turbulence", "environment.wind.from_deg", "sensor.rays",
        "sensor.dropout", "planner.clearance_m", "aircraft.airspeed_mps",
    ]  # fmt: skip


def test_a_list_of_one_entry_is_text_and_nothing_in_the_others(place: Path) -> None:
    other = CAMPAIGN.replace("{kind: bug2, clearance_m: 50}", "{kind: bug2, weights: [1, 2]}")
    assert {(run["planner"], run["planner.weights"]) for run in all_of(runs_of(place, other))} == {
        ("rolling_window", None),
        ("bug2", "[1, 2]"),
    }


def test_own_keys_hold_wherever_they_stand_before_their_kind(place: Path) -> None:
    keys = "set: {planner.steps: 3, guidance.period_s: 12, guidance.kind: l1}\n"
    scenario = runs_of(place, f"{SMALL}scenarios: [ring.yaml]\nplanners: [improved_bug]\n{keys}").scenario(0)
    assert (scenario.planner.own["steps"], scenario.guidance.own["period_s"]) == (3, 12.0)


def test_runs_of_a_case_fly_the_same_and_cases_do_not(place: Path) -> None:
    by_case: dict[int, list[dict[str, Any]]] = {}
    for run in all_of(runs_of(place)):
        by_case.setdefault(run["case"], []).append(run)
    for own in by_case.values():
        assert len(own) == 4
        shared = {json.dumps({k: v for k, v in run.items() if k.startswith(("environment", "sensor"))}) for run in own}
        assert (len({run["seed"] for run in own}), len(shared)) == (1, 1)
        assert {(run["planner"], run["planner.clearance_m"]) for run in own} >= {("bug2", 50)}
    assert len({own[0]["seed"] for own in by_case.values()}) == len(by_case)
    drawn = [own[0]["environment.wind.from_deg"] for own in by_case.values()]
    assert len(set(drawn)) == len(by_case)
    assert all(isinstance(angle, float) and 0 <= angle <= 360 for angle in drawn)
    about_north = runs_of(place, CAMPAIGN.replace("[0, 360]", "[300, 420]"))
    for own, angle in zip(by_case.values(), drawn, strict=True):  # the same share of a third of the compass
        north_deg = about_north.cells(own[0]["run"])["environment.wind.from_deg"]
        assert north_deg == pytest.approx((300.0 + angle / 3.0) % 360.0)


def test_whole_numbers_are_drawn_where_a_key_takes_no_others(place: Path) -> None:
    text = CAMPAIGN.replace("sensor.rays: {choice", "trackability.altitude_m: {choice").replace(
        "random:\n",
        "random:\n  sensor.rays: {uniform: [100, 700]}\n  planner.steps: {normal: {mean: 9, sigma: 3, least: 1}}\n",
    )
    runs = runs_of(place, text.replace("{kind: bug2, clear", "{kind: rolling_window, clear"))
    run, scenario = runs.cells(5), runs.scenario(5)
    assert scenario.sensor.rays == run["sensor.rays"]
    assert scenario.planner.own["steps"] == run["planner.steps"]
    drawn = {run["sensor.rays"] for run in all_of(runs)}
    assert all(isinstance(each, int) and 100 <= each <= 700 for each in drawn)
    assert len(drawn) > 6


@pytest.mark.parametrize("drawn", ["{uniform: [3.5, 9]}", "{normal: {mean: 9, sigma: 3, most: 9.2}}"])
def test_ranges_of_whole_numbers_end_at_whole_numbers(place: Path, drawn: str) -> None:
    other = CAMPAIGN.replace("sensor.rays: {choice", "trackability.altitude_m: {choice")
    with pytest.raises(InputError, match=r"yaml:15: random.sensor.rays: is \d\.\d+; must be a whole number"):
        runs_of(place, other.replace("random:\n", f"random:\n  sensor.rays: {drawn}\n")).check()


def test_a_scenario_has_what_its_run_says(place: Path) -> None:
    runs = runs_of(place)
    for number in (0, 7, 30, 47):
        run, scenario = runs.cells(number), runs.scenario(number)
        assert scenario.seed == run["seed"]
        assert (scenario.planner.kind, scenario.aircraft.model) == (run["planner"], run["aircraft"])
        assert scenario.planner.clearance_m == (50 if run["planner"] == "bug2" else 40)
        assert scenario.aircraft.airspeed_mps == (50 if run["aircraft"] == "c172p" else 25)
        assert scenario.mission.time_limit_s == 900
        assert scenario.sensor.rays == run["sensor.rays"]
        assert scenario.environment.wind
        assert scenario.environment.wind.speed_mps == run["environment.wind.speed_mps"]
        assert (scenario.environment.turbulence is None) == (run["environment.turbulence"] is None)


def test_the_scenario_of_a_run_without_changes_is_the_file_but_for_its_seed(place: Path) -> None:
    runs = runs_of(place, SMALL + "scenarios: [ring.yaml]\ndraws: 2\n")
    assert runs.scenario(1) == load_scenario(place / "ring.yaml", [("seed", str(runs.cells(1)["seed"]))])
    assert runs.cells(0)["seed"] != runs.cells(1)["seed"]


@settings(derandomize=True, max_examples=10)
@given(draws=st.integers(1, 6), more=st.integers(1, 6), seed=st.integers(0, 2**53))
def test_more_draws_leave_the_runs_there_were_as_they_are(
    tmp_path_factory: pytest.TempPathFactory, draws: int, more: int, seed: int
) -> None:
    place = tmp_path_factory.mktemp("draws")
    (place / "ring.yaml").write_text(SCENARIO.format(name="ring"))
    text = CAMPAIGN.replace("seed: 5", f"seed: {seed}")
    few = runs_of(place, text.replace("draws: 3", f"draws: {draws}"))
    many = runs_of(place, text.replace("draws: 3", f"draws: {draws + more}"))
    assert all_of(few) == all_of(many)[: len(few)]
    assert [few.cells(number) for number in reversed(range(len(few)))][::-1] == all_of(few), "in any order"


def test_worlds_take_the_place_of_the_scenarios_own(place: Path) -> None:
    worlds = "[{forest: {size_m: [3000, 3000]}}, {label: few, seed: 1, forest: {density_1pkm2: 0.5}}]"
    runs = runs_of(place, f"{SMALL}scenarios: [ring.yaml]\nworlds: {worlds}\ndraws: 2\n")
    assert [run["world"] for run in all_of(runs)] == ["forest", "few", "forest", "few"]
    scenarios = [runs.scenario(number) for number in range(4)]
    assert [each.name for each in scenarios] == ["ring"] * 4
    assert scenarios[0].area.bounds_m == (0.0, 0.0, 3000.0, 3000.0)
    assert scenarios[0].obstacles != scenarios[2].obstacles, "another world in every case"
    assert scenarios[1].obstacles == scenarios[3].obstacles, "a held one"
    assert scenarios[0].mission.course_deg == pytest.approx(45.0), "towards the goal of this world"
    assert scenarios[0].sensor.range_m == 2500


def test_worlds_need_no_scenario(place: Path) -> None:
    text = SMALL + "worlds: [{forest: {}}]\n"
    runs = runs_of(place, text)
    (place / "other.yaml").write_text(text)
    assert load_campaign(place / "other.yaml").plain() == runs.file.plain(), "whatever its file is called"
    assert runs.cells(0)["scenario"] == runs.scenario(0).name == "small"
    assert (runs.cells(0)["planner"], runs.cells(0)["aircraft"]) == ("rolling_window", "aerosonde")
    assert (runs.scenario(0).planner.kind, runs.scenario(0).aircraft.model) == ("rolling_window", "aerosonde")


@pytest.mark.parametrize(
    ("kind", "campaign", "label"),
    [
        ("bug2, shield: loiter", "", "bug2+shield"),
        ("bug2+shield", "", "bug2+shield"),
        ("bug2", "", "bug2"),
        ("bug2, shield: loiter", "planners: [bug1]", "bug1+shield"),
        ("bug2, shield: none", "planners: [rolling_window]", "rolling_window-bare"),
        ("bug2", "grid: {planner.shield: [loiter]}", "bug2+shield"),
        ("rolling_window", "set: {planner.shield: none}", "rolling_window-bare"),
        ("bug2", "set: {planner.shield: loiter}\nplanners: [bug1]", "bug1+shield"),
        ("bug2", "set: {planner.shield: loiter}\nplanners: [{kind: bug1, shield: none}]", "bug1"),
    ],
)
def test_a_planner_is_named_with_its_shield(place: Path, kind: str, campaign: str, label: str) -> None:
    text = SCENARIO.format(name="own").replace("rolling_window, clearance_m: 40", kind)
    (place / "own.yaml").write_text(text)
    runs = runs_of(place, f"{SMALL}scenarios: [own.yaml]\n{campaign}")
    assert runs.cells(0)["planner"] == runs.scenario(0).planner.label == label


def test_scenarios_are_files_folders_and_shipped_names(place: Path) -> None:
    (place / "more" / "._a.yaml").write_bytes(b"\x00\x05\x16\x07")
    (place / "more" / ".#b.yaml").symlink_to("somebody@somewhere.1234")
    (place / "more" / "c.yml").write_text(SCENARIO.format(name="c"))
    every = all_of(runs_of(place, SMALL + "scenarios: [ring.yaml, more, paper_circles]\n"))
    assert [run["scenario"] for run in every] == ["ring", "a", "b", "c", "paper_circles"]
    assert [run["world"] for run in every] == ["ring.yaml", "a.yaml", "b.yaml", "c.yml", "paper_circles.yaml"]


def test_the_plain_form_flies_the_same_without_a_file(place: Path) -> None:
    runs = runs_of(place)
    (place / "ring.yaml").unlink()
    again = CampaignRuns(CampaignFile.from_plain(json.loads(json.dumps(runs.file.plain())), "results"))
    assert all_of(again) == all_of(runs)
    assert [again.scenario(number) for number in (0, 47)] == [runs.scenario(number) for number in (0, 47)]


@pytest.mark.parametrize(
    "changed",
    [{"campaign": None}, {"scenarios": 3}, {"scenarios": []}, {"scenarios": [{"file": "a.yaml", "keys": 3}]},
     {"scenarios": [{"file": 3, "keys": {}}]}],
)  # fmt: skip
def test_a_plain_form_that_is_none_is_bad_input(place: Path, changed: dict[str, Any]) -> None:
    plain = runs_of(place).file.plain() | changed
    for each in (plain, {name: plain[name] for name in plain if name not in changed}):
        with pytest.raises(InputError, match=r"^results\S* "):
            CampaignRuns(CampaignFile.from_plain(each, "results")).check()


def test_world_files_are_sought_beside_the_file_that_names_them(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from tests.harness.world_files.making import feature, geojson

    (place / "worlds").mkdir()
    for name, west in (("one", 8.005), ("two", 8.025)):
        ring = [[west + x, 47.02 + y] for x, y in ((0, 0), (0.001, 0), (0.001, 0.001), (0, 0.001), (0, 0))]
        geojson(place / "worlds" / f"{name}.geojson", feature({"building": "yes", "height": 400}, ring))
    both = "  - file: {path: one.geojson, ground_m: 0}\n  - circle"
    text = SCENARIO.format(name="town").replace("  - circle", both)
    (place / "worlds" / "town.yaml").write_text(text)
    monkeypatch.chdir(place.parent)
    campaign = "schema: wayproof/campaign/1\nname: c\nseed: 1\nscenarios: [worlds/town.yaml]\n"
    other = 'grid: {"obstacles[0].file.path": [worlds/two.geojson]}\n'
    for text, east_m in ((campaign, 380.2), (campaign + other, 1900.9)):
        runs = runs_of(place, text)
        scenario = runs.scenario(0)
        polygon = scenario.obstacles[0].polygon
        assert polygon is not None
        assert min(east for east, _ in polygon.vertices_m) == pytest.approx(east_m, abs=0.5)
        assert CampaignRuns(CampaignFile.from_plain(runs.file.plain(), "results")).scenario(0) == scenario


def test_an_aircraft_folder_is_sought_beside_the_file_that_names_it(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import shutil

    import aircraft

    shutil.copytree(Path(aircraft.__path__[0], "aerosonde"), place / "mine")
    monkeypatch.chdir(place.parent)
    runs = runs_of(place, CAMPAIGN.replace("  - aerosonde\n", "  - mine\n"))
    assert runs.scenario(0).aircraft.model == str(place / "mine")
    assert CampaignRuns(CampaignFile.from_plain(runs.file.plain(), "results")).scenario(0) == runs.scenario(0)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("seed: 5\n", "", "campaign.yaml:1: seed: is missing"),
        ("draws: 3", "draws: 0", "campaign.yaml:18: draws: is 0; must be at least 1"),
        ("draws: 3", "drawss: 3", "campaign.yaml:18: drawss: unknown key; did you mean draws?"),
        ("[ring.yaml]", "[rong.yaml]", "campaign.yaml:4: scenarios[0]: is 'rong.yaml'; must be a scenario"),
        ("[ring.yaml]", "[ring.yaml, ring.yaml]", "scenarios[1]: is a second scenario called ring"),
        ("scenarios: [ring.yaml]", "draws: 1", "given twice"),
        ("[ring.yaml]", "[run]", "conditions: is rough, but a run's scenario says all of its one day"),
        ("[ring.yaml]", "[list.yaml]", "list.yaml:1: must be a mapping"),
        ("  environment.wind.speed_mps", "  environment.wnd.speed_mps", "unknown key; did you mean wind"),
        ("[0, 4.5]", "[0, 45]", "campaign.yaml:12: grid.environment.wind.speed_mps[1]: is 45; must be below"),
        ("[0, 4.5]", '[0, "x"]', "grid.environment.wind.speed_mps[1]: is the text 'x'; must be a number"),
        ("[0, 4.5]", "[4.5, 0, 4.5]", "grid.environment.wind.speed_mps[2]: is there already; keep one"),
        ("environment.wind.from_deg: {uniform: [0, 360]}", "mission.altitude_m: {uniform: [-9e9, -8e9]}", "_m: is -8"),
        ("{uniform: [0, 360]}", "{unifrm: [0, 360]}", "from_deg.unifrm: unknown key; did you mean uniform"),
        ("{uniform: [0, 360]}", "{}", "from_deg: has none of uniform, normal, choice"),
        ("{uniform: [0, 360]}", "{uniform: [0, 1], choice: [1]}", "from_deg: has uniform and choice"),
        ("{uniform: [0, 360]}", "{uniform: [1, 1]}", "least < most"),
        ("{uniform: [0, 360]}", "{choice: []}", "from_deg.choice: has 0 items; must have at least 1"),
        ("{uniform: [0, 360]}", "{uniform: [a, 1]}", "from_deg.uniform[0]: is the text 'a'; must be a number"),
        ("sigma: 0.05,", "sigma: 0,", "sensor.dropout.normal.sigma: is 0; must be greater than 0"),
        ("least: 0, most: 0.1", "least: 2, most: 1", "leaves nothing"),
        ("least: 0, most: 0.1", "least: 50", "leaves nothing"),
        ("sensor.rays: {choice", "seed: {choice", "random.seed: cannot be given here; every case gets"),
        ("sensor.rays: {choice", "planner: {choice", "random.planner: cannot be given here"),
        ("sensor.rays: {choice", "planner.kind: {choice", "name planners under `planners`"),
        ("sensor.rays: {choice", "a..b: {choice", "'a..b' is not a key path"),
        ("sensor.rays: {choice", "environment.wind: {choice", "given under grid.environment.wind.speed_mps"),
        ("sensor.rays: {choice", "obstacles[7].circle: {choice", "obstacles[7]: does not exist; there are 1"),
        ("mission.time_limit_s: 900", "mission.start_m: [1500, 1500]", "set.mission.start_m: lies inside"),
        ("{kind: bug2,", "{kind: bug3,", "planners[1].kind: is 'bug3'; must be one of"),
        ("model: c172p,", "model: nosuch,", "aircraft[1].model: unknown aircraft 'nosuch'"),
        ("airspeed_mps: 50}", "airspeed_mps: 500}", "aircraft[1].airspeed_mps: "),
        ("draws: 3", "worlds: [{circles: {}}]",
            "worlds[0].circles: unknown key; known here: label, seed, forest"),
        ("draws: 3", "worlds: [{}]", "worlds[0].forest: is missing"),
        ("draws: 3", "worlds: [{forest: {}}, {forest: {}}]", "worlds[1]: is called forest as another"),
        ("draws: 3", "worlds: [{forest: {density_1pkm2: 401}}]", "asks for 30075 obstacles; must be at most 10000"),
        ("draws: 3", "worlds: [{forest: {trunks: [1, 401]}}]",
            "asks for 20050 obstacles; must be at most 10000"),
        ("draws: 3", "worlds: [{forest: {trunks: [3, 1]}}]", "worlds[0].forest.trunks: is [3, 1]; must be [least"),
        ("draws: 3", "worlds: [{forest: {size_m: [900, 1700]}}]", "each side must be at least 4 x room_m"),
        ("draws: 3", "worlds: [{forest: {room_m: 20, size_m: [80, 80]}}]", "worlds[0].forest: mission"),
        ("draws: 3", "draws: 1000000", "18: draws: makes 16000000 runs with what is combined; must be"),
        ("{kind: bug2, clearance_m: 50}", "rolling_window", "planners[1]: is there already"),
        ("{kind: bug2, clearance_m: 50}", "rolling_window+shield", "planners[1]: is there already"),
        ("  sensor.rays: {choice", "  planner.clearance_m: {choice",
            "planners[1].clearance_m: is given under random.planner.clearance_m too"),
        ("schema: wayproof/campaign/1", "schema: wayproof/campaign/2", "schema: is the text"),
    ],
)  # fmt: skip
def test_a_mistake_is_told_with_file_line_and_key(place: Path, old: str, new: str, said: str) -> None:
    assert old in CAMPAIGN
    (place / "campaign.yaml").write_text(CAMPAIGN.replace(old, new))
    (place / "list.yaml").write_text("- schema: wayproof/scenario/1\n")
    (place / "run").mkdir()
    (place / "run" / "scenario.yaml").write_text(SCENARIO.format(name="run") + "conditions: rough\n")
    (place / "run" / "manifest.json").touch()
    out = place / "out"
    told = refused("sweep", place / "campaign.yaml", "--out", out)
    assert said in told
    assert str(place) in told
    assert len(told.splitlines()) <= 5
    assert not out.exists(), "nothing is written"


def test_a_fault_of_the_scenario_itself_names_its_own_line_and_the_run(place: Path) -> None:
    (place / "ring.yaml").write_text(SCENARIO.format(name="ring").replace("range_m: 2500", "range_m: 0"))
    with pytest.raises(InputError, match=r"ring.yaml:8: sensor.range_m: is 0; .* \(run 0 of .*campaign.yaml"):
        runs_of(place).check()
    with pytest.raises(InputError, match="has neither scenarios nor worlds"):
        runs_of(place, SMALL)


def test_validate_and_schema_know_campaigns(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (place / "campaign.yaml").write_text(CAMPAIGN)
    assert main(["validate", str(place / "campaign.yaml"), str(place / "ring.yaml")]) == 0
    first, second = capsys.readouterr().out.splitlines()
    assert first.endswith("campaign.yaml: small, 48 runs of 12 cases: valid")
    assert second.endswith("ring.yaml: ring, 1 obstacle: valid")
    assert main(["schema", "campaign"]) == 0
    assert json.loads(capsys.readouterr().out) == campaign_schema()


@pytest.mark.parametrize(
    ("more", "is_right"),
    [
        ({}, True),
        ({"scenarios": []}, False),
        ({"scenarios": [], "worlds": [{"forest": {}}]}, True),
        ({"random": {"sensor.range_m": {"uniform": None}}}, False),
        ({"random": {"sensor.range_m": {"uniform": [1, 2], "normal": None}}}, True),
    ],
)
def test_an_editor_marks_what_the_loader_of_campaigns_refuses(more: dict[str, Any], is_right: bool) -> None:
    """Whether a file follows the schema is said by the package `jsonschema`."""
    jsonschema = pytest.importorskip("jsonschema")
    plain = {"schema": "wayproof/campaign/1", "name": "a", "seed": 1, "scenarios": ["ring.yaml"]} | more
    assert jsonschema.Draft202012Validator(campaign_schema()).is_valid(plain) is is_right
    with nullcontext() if is_right else pytest.raises(InputError):
        validated(node_of(plain, 1), "a.yaml")


@pytest.mark.parametrize("name", shipped_campaigns())
def test_shipped_campaigns_are_valid_and_named_after_their_files(name: str) -> None:
    path = shipped_campaigns()[name]
    first, second = path.read_text().splitlines()[:2]
    assert first == "# yaml-language-server: $schema=../campaign.schema.json"
    assert second.startswith("# ")
    assert is_a("campaign", path)
    runs = CampaignRuns(load_campaign(path))
    assert runs.campaign.name == name
    assert f"{len(runs)} flights" in path.read_text().partition("schema:")[0]
    for number in {*range(0, len(runs), 37), len(runs) - 1}:
        runs.scenario(number)


def test_editors_find_the_campaign_schema_and_one_shipped_campaign_has_every_key() -> None:
    assert len(shipped_campaigns()) >= 2
    assert shipped_campaigns().keys().isdisjoint(shipped_scenarios())
    assert json.loads((ROOT / "scenarios" / "campaign.schema.json").read_text()) == campaign_schema()
    whole = load_campaign(shipped_campaigns()["everything"]).campaign
    assert whole.model_fields_set == set(type(whole).model_fields)
    forms = {name for each in whole.random.values() for name in each.model_fields_set}
    assert forms == {"uniform", "normal", "choice"}
