"""A scenario read, completed, written and read again."""

import json
import math
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

import aircraft
from aircraft.airframes import airframe
from aircraft.envelope import performance
from harness.files.strict_yaml import dump
from harness.run.scenario_flight import make_loop
from harness.scenario.kinds import planner_kinds
from harness.scenario.performance import mission_of, performance_of
from harness.scenario.scenario import scenario_schema
from harness.scenario.shipped import scenario_path
from tests.scenarios import LEAST, scenario_of
from wayproof import InputError, Scenario, dump_scenario, load_scenario

WITH_PLANNER = LEAST + "planner: {kind: rolling_window, clearance_m: 70, candidates: 9}\n"


def test_limits_follow_from_the_written_clearance_and_from_nobody_who_flies() -> None:
    light = scenario_of(LEAST)
    assert light.planner.clearance_m > 100.0  # a default, which does not count
    limits = light.trackability
    assert (limits.cross_track_m, limits.altitude_m) == (10.0, 10.0)
    assert (limits.airspeed_mps, limits.load_factor) == (2.5, 3.8)
    for key, value in (
        ("aircraft.model", "B747"),
        ("guidance.kind", "npfg"),
        ("guidance.acceptance_radius_m", 300.0),
        ("environment.turbulence.intensity", "severe"),
        ("aircraft.actuators.rate_limit_degps", 60.0),
        ("aircraft.autopilot.bank_limit_deg", 40.0),
    ):
        other = light.with_({key: value}).trackability
        assert (other.cross_track_m, other.altitude_m) == (10.0, 10.0), key
    for clearance_m, limit_m in ((500, 50.0), (1, 0.1), (0, 10.0)):
        written = scenario_of(LEAST + f"planner: {{clearance_m: {clearance_m}}}\n").trackability
        assert (written.cross_track_m, written.altitude_m) == (pytest.approx(limit_m), 10.0)  # type: ignore[comparison-overlap]
    for model, most in (("c172p", 3.8), ("B747", 2.5)):  # by 1,880 lb 4.1, by 551,000 lb 2.14
        assert scenario_of(LEAST + f"aircraft: {{model: {model}}}\n").trackability.load_factor == most
    own = scenario_of(LEAST + "trackability: {cross_track_m: 3.0, load_factor: 1.5}\n").trackability
    assert (own.cross_track_m, own.altitude_m, own.load_factor) == (3.0, 10.0, 1.5)


def test_fills_in_every_default() -> None:
    scenario = scenario_of(LEAST)
    radius_m = performance(airframe("aerosonde"), 25.0).turn_radius_m
    assert scenario.seed == 1
    assert scenario.obstacles == ()
    assert scenario.aircraft.airspeed_mps == airframe("aerosonde").cruise_mps == 25.0
    assert scenario.mission.course_deg == 90.0
    assert scenario.mission.goal_radius_m == scenario.planner.clearance_m == 10 * math.ceil(radius_m / 10)
    assert scenario.mission.time_limit_s == 60 * math.ceil((10 * 30000 / 25 + 60) / 60)
    assert scenario.sensor.range_m == 100 * math.ceil(radius_m / 10)
    assert scenario.environment.wind is None
    assert set(scenario.planner.own) == set(planner_kinds()["rolling_window"].config.__dataclass_fields__)
    assert None not in scenario.planner.own.values()


def test_mission_of_tells_the_planner_what_the_scenario_says() -> None:
    scenario = scenario_of(WITH_PLANNER)
    mission = mission_of(scenario)
    assert mission.goal_m == (31000.0, 1000.0)
    assert mission.clearance_m == 70.0
    off_m = mission.tracking_error_m
    assert mission.bounds_m == pytest.approx((off_m, off_m, 40000.0 - off_m, 40000.0 - off_m))
    for north_m, south_m in ((50.0, off_m), (0.0, 0.0)):  # the side near the goal
        near = scenario_of(WITH_PLANNER.replace("[31000, 1000]", f"[31000, {north_m}]"))
        assert mission_of(near).bounds_m[1] == pytest.approx(south_m)
    assert mission.turn_radius_m == performance(airframe("aerosonde"), 25.0).turn_radius_m
    assert mission.sensor_range_m == scenario.sensor.range_m


def test_numbers_are_those_of_yaml_1_2() -> None:
    text = LEAST.replace("[31000, 1000]", "[31e3, +1.0E3]").replace("40000, 40000]", "4.e4, 0x9c40]")
    assert scenario_of(text) == scenario_of(LEAST)


@pytest.mark.parametrize(
    "ring",
    [
        "[5000, 5000], [5000, 5000], [6000, 5000], [6000, 6000]",
        "[5000, 5000], [6000, 5000], [6000, 5000], [6000, 5000], [6000, 6000]",
        "[5000, 5000], [6000, 5000], [6000, 6000], [6000, 6000], [5000, 5000], [5000, 5000]",
    ],
)  # fmt: skip
def test_repeated_vertices_are_dropped(ring: str) -> None:
    polygon = "obstacles: [{polygon: {vertices_m: [%s]}}]\n"
    clean = scenario_of(LEAST + polygon % "[5000, 5000], [6000, 5000], [6000, 6000]")
    assert scenario_of(LEAST + polygon % ring) == clean


def test_an_area_where_the_plane_may_be_off_by_a_metre_is_refused() -> None:
    said = r"3: area\.bounds_m: reaches 849 km from area\.origin; .* up to 400 km"
    with pytest.raises(InputError, match=said):
        scenario_of(LEAST.replace("[0, 0, 40000, 40000]", "[-1000, -1000, 600000, 600000]"))


@pytest.mark.parametrize("own", ["active_s: [60, 120]", "velocity_mps: [3, 0]"])
def test_only_what_stays_may_not_lie_on_the_goal(own: str) -> None:
    there = "obstacles: [{circle: {center_m: [31000, 1000], radius_m: 300}%s}]\n"
    assert scenario_of(LEAST + there % f", {own}").obstacles
    with pytest.raises(InputError, match=r"mission\.goal_m: lies inside obstacles\[0\]"):
        scenario_of(LEAST + there % "")


@pytest.mark.parametrize("key", ["start_m", "goal_m"])
@pytest.mark.parametrize(
    "shape",
    [
        "circle: {center_m: [%d, 1000], radius_m: 300}",
        "polygon: {vertices_m: [[%d, 0], [0, 9000], [40000, 9000]]}",
    ],
)  # fmt: skip
def test_nobody_starts_or_ends_inside_an_obstacle_however_small_the_clearance(key: str, shape: str) -> None:
    east = 1000 if key == "start_m" else 31000
    with pytest.raises(InputError, match=rf"mission\.{key}: lies inside obstacles\[0\]"):
        scenario_of(LEAST + f"obstacles: [{{{shape % east}}}]\nplanner: {{clearance_m: 0}}\n")


@pytest.mark.parametrize("name", ["on", "1e3", "0.1", "null", "0x1f", "yes", "-", "_", "2001-01-01", "1.-"])
def test_dumped_text_stays_text(name: str) -> None:
    scenario = scenario_of(json.dumps({**yaml.safe_load(LEAST), "name": name}))
    text = dump_scenario(scenario)
    assert scenario_of(text) == scenario
    assert yaml.safe_load(text)["name"] == name


finite = st.floats(-1e6, 1e6, allow_nan=False).filter(lambda x: x == 0 or abs(x) > 1e-300)
away = st.tuples(finite, finite).filter(
    lambda center: min(math.dist(center, (1000, 1000)), math.dist(center, (31000, 1000))) > 2000
)
time = st.floats(0, 1e6)
obstacle = st.fixed_dictionaries(
    {"circle": st.fixed_dictionaries({"center_m": away, "radius_m": st.floats(1e-9, 1e3)})},
    optional={
        "velocity_mps": st.tuples(st.floats(-100, 100), st.floats(-100, 100)),
        "active_s": st.tuples(time, time).filter(lambda t: t[0] < t[1]),
    },
)


@given(
    obstacles=st.lists(obstacle, max_size=4),
    seed=st.integers(0, 2**53),
    altitude_m=st.floats(50, 7000),
    sensor=st.fixed_dictionaries(
        {},
        optional={"range_m": st.floats(2e4, 1e5), "rays": st.integers(3, 9999), "dropout": st.floats(0, 1)},
    ),
)
def test_a_dump_loads_back_bit_for_bit(
    obstacles: list[dict[str, Any]], seed: int, altitude_m: float, sensor: dict[str, Any]
) -> None:
    data = yaml.safe_load(LEAST)
    data["mission"]["altitude_m"] = altitude_m
    scenario = scenario_of(json.dumps({**data, "obstacles": obstacles, "seed": seed, "sensor": sensor}))
    text = dump_scenario(scenario)
    again = scenario_of(text)
    assert again == scenario
    assert again.model_dump_json() == scenario.model_dump_json()
    assert dump_scenario(again) == text
    assert yaml.safe_load(text)["mission"]["altitude_m"] == altitude_m


def overridden(*settings: tuple[str, str], text: str, folder: Path) -> Scenario:
    path = folder / "file.yaml"
    path.write_text(text)
    return load_scenario(path, settings)


def test_overrides_replace_keys_before_defaults_follow(tmp_path: Path) -> None:
    scenario = overridden(
        ("mission.goal_m", "[1000, 31000]"),
        ("sensor.range_m", "5e3"),
        ("environment.wind.speed_mps", "4"),
        ("obstacles", "[{circle: {center_m: [9000, 9000], radius_m: 10}}]"),
        ("obstacles[0].circle.radius_m", "20"),
        text=LEAST,
        folder=tmp_path,
    )
    assert scenario.mission.course_deg == 0.0
    assert scenario.sensor.range_m == 5000.0
    assert scenario.environment.wind
    assert scenario.environment.wind.speed_mps == 4.0
    assert scenario.obstacles[0].circle
    assert scenario.obstacles[0].circle.radius_m == 20.0


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        (("sensor.rnage_m", "1"), "command line: sensor.rnage_m: unknown key; did you mean range_m?"),
        (("sensor.rays", "many"), "command line: sensor.rays: is the text 'many'"),
        (("seed", ""), "command line: seed: has no value"),
        (("seed", "[1"), "command line: seed:1:"),
        (("mission..start_m", "1"), "command line: 'mission..start_m' is not a key path"),
        (("name.first", "1"), "command line: name.first: no such key"),
        (("mission.start_m[7]", "1"), "command line: mission.start_m[7]: does not exist; there are 2"),
        (("planner.kind", "other"), "command line: planner.kind: is 'other'; must be one of rolling_window"),
        (("guidance.kind", "other"), "command line: guidance.kind: is 'other'; must be one of preview, npfg, l1"),
        (
            ("guidance.rate", "1"),
            "command line: guidance.rate: unknown key; known here: kind, follow, acceptance_radius_m, bandwidth_radps",
        ),
        (("guidance.damping", "0"), "command line: guidance.damping: is 0; must be greater than 0"),
        (("planner.kind", 2000 * "x"), f"command line: planner.kind: is '{40 * 'x'}'; must be one of"),
    ],
)  # fmt: skip
def test_a_bad_override_is_named(setting: tuple[str, str], message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        overridden(setting, text=LEAST, folder=tmp_path)
    assert str(caught.value).startswith(message)


def test_the_same_planner_keeps_its_keys_and_another_drops_them(tmp_path: Path) -> None:
    same = overridden(("planner.kind", "rolling_window"), text=WITH_PLANNER, folder=tmp_path)
    assert same.planner.own["candidates"] == 9
    elsewhere = WITH_PLANNER.replace("rolling_window", "elsewhere").replace("candidates", "whatever")
    other = overridden(("planner.kind", "rolling_window"), text=elsewhere, folder=tmp_path)
    assert other.planner.clearance_m == 70.0
    assert "whatever" not in other.planner.own


def test_the_keys_of_a_guidance_law_are_checked_as_those_of_a_planner(tmp_path: Path) -> None:
    text = LEAST + "guidance: {kind: l1, period_s: 20}\n"
    given = overridden(("guidance.kind", "l1"), text=text, folder=tmp_path)
    assert given.guidance.own == {"period_s": 20, "damping": 0.75, "integrator_gain": 0.02}
    assert overridden(("guidance.kind", "npfg"), text=text, folder=tmp_path).guidance.own["period_s"] == 10.0
    again = scenario_of(dump_scenario(given))
    assert again == given
    assert performance_of(again) == performance_of(given)


def described_keys(schema: dict[str, Any], defs: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    found: list[tuple[str, dict[str, Any]]] = []
    for choice in (schema, *schema.get("anyOf", ())):
        resolved = defs[choice["$ref"].rpartition("/")[2]] if "$ref" in choice else choice
        for name, key in resolved.get("properties", {}).items():
            section = defs[key["$ref"].rpartition("/")[2]] if "$ref" in key else {}
            told = {**section, **key, "needed": name in resolved.get("required", ())}
            found += [(name, told), *described_keys(key, defs)]
        if "items" in resolved:
            found += described_keys(resolved["items"], defs)
    return found


def test_the_schema_describes_every_key_with_its_default() -> None:
    schema = scenario_schema()
    keys = described_keys(schema, schema["$defs"])
    assert len(keys) > 45
    for name, key in keys:
        assert key.get("description"), name
        told = key.get("default") is not None or "default:" in key["description"].lower()
        assert key["needed"] or told or "$ref" in str(key) or "properties" in str(key), name
    assert schema["required"] == ["schema", "name", "area", "mission"]


RING = "vertices_m: [[5000, 5000], [6000, 5000], [5000, 6000]]"


@pytest.mark.parametrize(
    ("more", "is_right"),
    [
        ("planner: {kind: vfh_plus+shield}", True),
        ("planner: {kind: vfh_plus+other}", False),
        (f"obstacles: [{{circle: null, polygon: {{{RING}}}}}]", True),
        ("obstacles: [{circle: null}]", False),
        ("mission: {start: null, start_m: [1000, 1000], goal_m: [31000, 1000]}", True),
        ("mission: {start: null, goal_m: [31000, 1000]}", False),
        ("uncertainty: {mass: 0.2, centre_of_gravity_m: 0}", True),
        ("uncertainty: {mass: -0.2}", False),
        (f"obstacles: [{{polygon: {{{RING}, holes_m: [[[5100, 5100], [5200, 5100], [5100, 5200]]]}}}}]", True),
        (f"obstacles: [{{polygon: {{{RING}, holes_m: [[[5100, 5100]]]}}}}]", False),
    ],
)
def test_an_editor_marks_what_the_loader_refuses(more: str, is_right: bool) -> None:
    """Whether a file follows the schema is said by the package `jsonschema`."""
    jsonschema = pytest.importorskip("jsonschema")
    plain = {**yaml.safe_load(LEAST), **yaml.safe_load(more)}
    assert jsonschema.Draft202012Validator(scenario_schema()).is_valid(plain) is is_right
    if is_right:
        scenario_of(dump(plain))
    else:
        with pytest.raises(InputError):
            scenario_of(dump(plain))


def test_editors_find_the_schema_beside_the_scenarios() -> None:
    folder = Path(__file__).parents[3] / "scenarios"
    assert json.loads((folder / "scenario.schema.json").read_text()) == scenario_schema()
    for path in folder.glob("*.yaml"):
        first, second = path.read_text().splitlines()[:2]
        assert first == "# yaml-language-server: $schema=scenario.schema.json"
        assert second.startswith("# ")


def test_a_model_folder_is_sought_beside_the_scenario_and_then_from_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    beside, here = tmp_path / "beside", tmp_path / "here"
    for place, name in ((beside, "mine"), (here, "mine"), (here, "other")):
        shutil.copytree(Path(aircraft.__path__[0], "aerosonde"), place / name)
    text = scenario_path("paper_circles").read_text()
    file = beside / "s.yaml"
    monkeypatch.chdir(here)

    def model(given: str) -> str:
        file.write_text(text.replace("model: aerosonde", f"model: {given}"))
        return load_scenario(file).aircraft.model

    assert model("aerosonde") == "aerosonde"
    assert model("mine") == str(beside / "mine")
    assert model("../here/mine") == str(here / "mine")
    assert model("./other") == str(here / "other")
    assert scenario_of(dump_scenario(load_scenario(file))) == load_scenario(file)
    with pytest.raises(InputError, match=r"s.yaml:\d+: aircraft.model: unknown aircraft 'nowhere/mine'"):
        model("nowhere/mine")


def test_a_scenario_with_other_keys_is_derived_anew_and_the_first_one_stays() -> None:
    first = load_scenario("aerosonde_forest")
    before = dump_scenario(first)
    other = first.with_({"planner.clearance_m": 60, "seed": np.int64(3), "sensor": {"range_m": np.float64(900)}})
    assert (other.planner.clearance_m, other.seed, other.sensor.range_m) == (60, 3, 900.0)
    assert other.planner.own["margin_m"] == pytest.approx(1.5 * first.planner.own["margin_m"])
    assert dump_scenario(first) == before
    assert other.with_({"planner.clearance_m": 40, "seed": 1, "sensor": first.sensor}) == first


def test_defaults_of_a_changed_scenario_follow_the_changed_keys() -> None:
    bare = scenario_of(LEAST)
    faster = bare.with_({"aircraft.model": "c172p", "environment.wind.speed_mps": 5, "environment.wind": {}})
    assert faster == scenario_of(LEAST + "aircraft: {model: c172p}\nenvironment: {wind: {speed_mps: 5}}\n")
    assert faster.planner != bare.planner
    assert faster.with_({"aircraft": None, "environment": None, "planner.margin_m": None}) == bare


def test_none_takes_keys_and_items_out_of_lists() -> None:
    full = (
        "obstacles:\n  - circle: {center_m: [5000, 1000], radius_m: 50}\n    velocity_mps: [1, 0]\n"
        f"  - polygon: {{{RING}, holes_m: [[[5100, 5100], [5200, 5100], [5100, 5200]]]}}\n"
        "  - circle: {center_m: [7000, 7000], radius_m: 60}\n    active_s: [60, 140]\n"
    )
    gone = {"obstacles[0]": None, "obstacles[1].polygon.holes_m": None, "obstacles[2].active_s": None}
    left = f"obstacles:\n  - polygon: {{{RING}}}\n  - circle: {{center_m: [7000, 7000], radius_m: 60}}\n"
    assert scenario_of(LEAST + full).with_(gone) == scenario_of(LEAST + left)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"planner.clearance_m": -1}, "with_: planner.clearance_m: is -1; must be at least 0"),
        ({"no_such": 1}, "with_: no_such: unknown key"),
        ({"obstacles[9999].circle.radius_m": 2}, "with_: obstacles[9999]: does not exist"),
        ({"a..b": 1}, "with_: 'a..b' is not a key path"),
        ({"name.inner": 1}, "with_: name.inner: no such key"),
        ({"seed": math.nan}, "with_: seed: "),
        ({"sensor.rangem": None}, "with_: sensor.rangem: unknown key; did you mean range_m?"),
        ({"planner.marginm": None}, "with_: planner.marginm: unknown key; did you mean margin_m?"),
        ({"no.such": None}, "with_: no: unknown key"),
        ({"environment.wind.speed": None}, "with_: environment.wind.speed: unknown key"),
        ({"obstacles[9999].active_s": None}, "with_: obstacles[9999]: does not exist"),
        ({1: 2}, "with_: must be given a mapping of key paths"),
        ([("seed", 2)], "with_: must be given a mapping of key paths"),
    ],
)  # fmt: skip
def test_a_wrong_key_of_a_changed_scenario_is_told(keys: Any, said: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(said)}"):
        load_scenario("aerosonde_forest").with_(keys)


def test_obstacles_from_a_file_are_cut_anew_at_another_altitude(tmp_path: Path) -> None:
    corners = [[8.05, 47.05], [8.06, 47.05], [8.06, 47.06], [8.05, 47.06], [8.05, 47.05]]
    tower = {
        "type": "Feature",
        "properties": {"building": "yes", "height": 100},
        "geometry": {"type": "Polygon", "coordinates": [corners]},
    }
    (tmp_path / "town.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": [tower]}))
    (tmp_path / "town.yaml").write_text(
        "{schema: wayproof/scenario/1, name: town, area: {bounds_m: [0, 0, 9000, 9000],"
        " origin: {latitude_deg: 47, longitude_deg: 8}}, obstacles: [file: {path: town.geojson}],"
        " mission: {start_m: [500, 500], goal_m: [8500, 1500], altitude_m: 80}}"
    )
    low = load_scenario(tmp_path / "town.yaml")
    assert len(low.obstacles) == 1
    high = low.with_({"mission.altitude_m": 900})
    assert (len(high.obstacles), high.mission.altitude_m) == (0, 900)
    assert high.with_({"mission.altitude_m": 80}) == low


X8 = "x8, airspeed_mps: 18.1333", 19000, "11.*x8 cannot be trimmed .* 19000 m above"
PB = "penguin_b", 6000, "5.*penguin_b keeps 25 m/s and its altitude there only up to 0 degrees of bank, and 5"
HIGH_FAULTS = [("aerosonde", up, f"7.*aerosonde cannot be trimmed .* {up} m above") for up in (7300, 9000, 20000)]


@pytest.mark.parametrize(("aircraft", "altitude_m", "fault_text"), [*HIGH_FAULTS, X8, PB])
def test_an_altitude_without_level_flight_is_refused_where_it_stands(
    aircraft: str, altitude_m: int, fault_text: str, tmp_path: Path
) -> None:
    """Before anything is flown: `wayproof validate` says it, too; the altitude that is named can be flown."""
    path = tmp_path / "high.yaml"
    text = (
        "schema: wayproof/scenario/1\nname: high\n"
        "area: {bounds_m: [-9000, -9000, 9000, 9000], origin: {latitude_deg: 46, longitude_deg: 8}}\n"
        "mission:\n  altitude_m: HIGH\n  start_m: [-8000, 0]\n  goal_m: [8000, 0]\n"
        f"aircraft: {{model: {aircraft}}}\n"
    )
    path.write_text(text.replace("HIGH", str(altitude_m)))
    with pytest.raises(InputError) as fault:
        load_scenario(path)
    said = str(fault.value)
    assert said.startswith(f"{path}:5: mission.altitude_m: is {altitude_m}; must be at most ")
    bound = re.search(rf"at most (?={fault_text})(\d+)", said)
    assert bound is not None
    path.write_text(text.replace("HIGH", bound[1]))
    make_loop(load_scenario(path))  # trims the aircraft as a flight does


def test_turns_at_altitude_are_planned_with_the_lift_that_is_there() -> None:
    """Penguin B, 21.5 kg, 0.79 m2; 0.9093 kg/m3 at 3,000 m (ISA): 13 to 27 degrees of bank at 22.5 m/s, not 30.

    CL is 1.3 at the most, and by the model's formula 1.19 at 9 degrees, 3 short of the stall.
    """
    high = {"aircraft.model": "penguin_b", "aircraft.airspeed_mps": 22.5, "mission.altitude_m": 3000}
    planned_m = performance_of(load_scenario("aerosonde_forest").with_(high)).turn_radius_m
    most_m, least_m = (
        22.5**2 / (9.80665 * math.tan(math.acos(21.5 * 9.80665 / (0.5 * 0.9093 * 22.5**2 * 0.79 * lift))))
        for lift in (1.19, 1.3)
    )
    assert least_m < planned_m < most_m
