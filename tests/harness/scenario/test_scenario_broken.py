"""Every way to spoil a scenario file that its loader must name, with the line and the key at fault."""

import re
from pathlib import Path

import pytest

from harness.cli.app import main
from tests.harness.run.given import written
from tests.scenarios import scenario_of
from wayproof import InputError

GOOD = """\
schema: wayproof/scenario/1
name: good
seed: 1
area:
  bounds_m: [0, 0, 20000, 10000]
  origin: {latitude_deg: 47.0, longitude_deg: 8.0}
obstacles:
  - circle: {center_m: [8000, 5000], radius_m: 900}
  - polygon: {vertices_m: [[12000, 3000], [14000, 3000], [14000, 5000], [12000, 5000]]}
    active_s: [60, 600]
mission:
  start_m: [1000, 5000]
  course_deg: 90
  goal_m: [19000, 5000]
  goal_radius_m: 200
  altitude_m: 300
aircraft: {model: aerosonde, airspeed_mps: 25}
sensor: {range_m: 3000, rays: 360, rate_hz: 2}
planner:
  kind: rolling_window
  clearance_m: 200
  steps: 8
environment:
  wind: {speed_mps: 5, from_deg: 270}
  turbulence: {model: tustin, intensity: light}
  vertical_gusts: {speed_mps: 4, duration_s: 5, every_s: 60}
trackability: {cross_track_m: 10, altitude_m: 15, airspeed_mps: 2, load_factor: 2.5}
"""

NORTH, IN_DISC = "{latitude_deg: 48, longitude_deg: 8}", "{latitude_deg: 47.045, longitude_deg: 8.105}"
SPEED = "airspeed_mps: 25"
SQUARE = "[[12000, 3000], [14000, 3000], [14000, 5000], [12000, 5000]]"

# what is replaced, by what, then the line and the key that must be named, and a part of the sentence.
# fmt: off
BROKEN = {
    "wrong schema": ("scenario/1", "scenario/2", "1: schema", "must be 'wayproof/scenario/1'"),
    "no schema": ("schema: wayproof/scenario/1\n", "", "1: schema", "is missing"),
    "no name": ("name: good\n", "", "1: name", "is missing"),
    "no bounds": ("  bounds_m: [0, 0, 20000, 10000]\n", "", "4: area.bounds_m", "is missing"),
    "no start": ("  start_m: [1000, 5000]\n", "", "11: mission.start_m", "is missing"),
    "no goal": ("  goal_m: [19000, 5000]\n", "", "11: mission.goal_m", "is missing"),
    "goal in degrees outside": ("goal_m: [19000, 5000]", f"goal: {NORTH}", "14: mission.goal:", "] m from area.origin"),
    "start in degrees inside": ("start_m: [1000, 5000]", f"start: {IN_DISC}", "12: mission.start:", "lies inside"),
    "name in capitals": ("name: good", "name: Good", "2: name", "must have only a-z, 0-9"),
    "name climbs out": ("name: good", "name: ..", "2: name", "and not only dots"),
    "name is a number": ("name: good", "name: 7", "2: name", "must be text; put it in quotes"),
    "negative seed": ("seed: 1", "seed: -1", "3: seed", "must be at least 0"),
    "seed with a point": ("seed: 1", "seed: 7.0", "3: seed", "is 7.0; must be a whole number without a point"),
    "seed beyond floats": ("seed: 1", "seed: 1%s" % (20 * "0"), "3: seed", "of at most 9007199254740992"),
    "seed is true": ("seed: 1", "seed: true", "3: seed", "is true; must be a whole number"),
    "three bounds": ("[0, 0, 20000, 10000]", "[0, 0, 20000]", "5: area.bounds_m",
        "is [0, 0, 20000]; must have 4 numbers"),
    "five bounds": ("20000, 10000]", "20000, 10000, 1]", "5: area.bounds_m", "has 5 items; must have 4"),
    "bounds turned round": ("[0, 0, 20000,", "[20000, 0, 0,", "5: area.bounds_m", "with xmin < xmax and ymin < ymax"),
    "bounds beyond the plane": ("20000, 10000]", "2e7, 10000]", "5: area.bounds_m[2]", "at most 1000000"),
    "section left empty": ("{model: aerosonde, airspeed_mps: 25}", "", "17: aircraft", "is empty; must be a mapping"),
    "no shape": ("- circle: {center_m: [8000, 5000], radius_m: 900}", "- {}", "8: obstacles[0]", "neither"),
    "two shapes": ("  - polygon: {", "    polygon: {", "8: obstacles[0]",
        "has both of circle and polygon; must have exactly one"),
    "a file with heights": ("circle: {center_m: [8000, 5000], radius_m: 900}", "{file: {path: a}, heights_m: [0, 9]}",
        "8: obstacles[0]", "is a file with heights_m; what a file holds has its own heights"),
    "no lattice": ("mission:", "ground: {corner_m: [0, 0], spacing_m: [1, 1], rows: 1, columns: 1, lowest_m: 0, "
        "lattice: [], heights: eJxjYAAAAAIAAQ==}\nmission:", "11: ground.lattice", "must have"),
    "radius zero": ("radius_m: 900", "radius_m: 0", "8: obstacles[0].circle.radius_m", "greater than 0"),
    "radius is nan": ("radius_m: 900", "radius_m: .nan", "8: obstacles[0].circle.radius_m", "finite"),
    "centre is one number": ("[8000, 5000]", "8000", "8: obstacles[0].circle.center_m", "must be a list"),
    "overflowing number": ("radius_m: 900", "radius_m: 1e999", "8: obstacles[0].circle.radius_m", "finite"),
    "polygon crosses itself": (SQUARE, "[[12000, 3000], [14000, 5000], [14000, 3000], [12000, 5000]]",
        "9: obstacles[1].polygon.vertices_m", "crosses or touches itself at (13000, 4000)"),
    "two vertices": (SQUARE, "[[1, 2], [3, 4]]", "9: obstacles[1].polygon.vertices_m", "at least 3"),
    "polygon without area": (SQUARE, "[[12000, 3000], [13000, 3000], [14000, 3000]]",
        "9: obstacles[1].polygon.vertices_m", "encloses no area"),
    "a spike out and back": (SQUARE, "[[12000, 3000], [14000, 3000], [16000, 3000], [14000, 3000], [14000, 5000]]",
        "9: obstacles[1].polygon.vertices_m", "crosses or touches itself"),
    "reached from afar": (SPEED, f"{SPEED}}}\nguidance: {{follow: waypoints, acceptance_radius_m: 400",
        "18: guidance.acceptance_radius_m", "must be another: the guidance law preview does not track"),
    "stops before it starts": ("[60, 600]", "[600, 60]", "10: obstacles[1].active_s", "from < to"),
    "start outside": ("[1000, 5000]", "[-1, 5000]", "12: mission.start_m", "must lie inside area.bounds_m"),
    "start in a circle": ("[1000, 5000]", "[8000, 5100]", "12: mission.start_m", "lies inside obstacles[0]"),
    "start near a circle": ("[1000, 5000]", "[7000, 5000]", "12: mission.start_m", "100 m from obstacles[0]"),
    "goal near a circle": ("[19000, 5000]", "[9000, 5000]", "14: mission.goal_m", "100 m from obstacles[0]"),
    "goal at the start": ("[19000, 5000]", "[1100, 5000]", "14: mission.goal_m", "inside goal_radius_m"),
    "course": ("course_deg: 90", "course_deg: 900", "13: mission.course_deg", "at most 360"),
    "course is empty": ("course_deg: 90", "course_deg:", "13: mission.course_deg", "is empty; must be a number"),
    "below ground": ("altitude_m: 300", "altitude_m: 0", "16: mission.altitude_m", "at least 5"),
    "misspelt key": ("altitude_m: 300", "altitud_m: 300", "16: mission.altitud_m", "did you mean altitude_m?"),
    "unknown section": ("aircraft:", "aircaft:", "17: aircaft", "did you mean aircraft?"),
    "unknown aircraft": ("aerosonde", "concorde", "17: aircraft.model", "'concorde'; known are: aerosonde"),
    "too fast": (SPEED, "airspeed_mps: 90", "17: aircraft.airspeed_mps", "cannot hold 90 m/s"),
    "speed in quotes": (SPEED, "airspeed_mps: '25'", "17: aircraft.airspeed_mps", "is the text '25'"),
    "underscore in a number": (SPEED, "airspeed_mps: 2_5", "17: aircraft.airspeed_mps", "is the text '2_5'"),
    "seventh rate": ("rate_hz: 2", "rate_hz: 7", "18: sensor.rate_hz", "does not divide 120 Hz"),
    "too few rays": ("rays: 360", "rays: 2", "18: sensor.rays", "at least 3"),
    "sensor is a list": ("{range_m: 3000, rays: 360, rate_hz: 2}", "[3000]", "18: sensor", "must be a mapping"),
    "late state": ("planner:", "navigation: {kind: gnss, latency_s: 1}\nplanner:", "19: navigation.latency_s",
        "is 1; must be less, or aircraft.autopilot.state_latency_s be given: aerosonde cannot be held"),
    "unknown planner": ("rolling_window", "astar", "20: planner.kind", "must be one of rolling_window"),
    "planner's misspelt key": ("steps: 8", "stepz: 8", "22: planner.stepz", "did you mean steps?"),
    "planner's key out of range": ("steps: 8", "steps: 0", "22: planner.steps", "at least 1"),
    "planner's key of a wrong type": ("steps: 8", "steps: eight", "22: planner.steps", "a whole number"),
    "planner's keys contradict": ("rolling_window\n  clearance_m: 200\n  steps: 8",
        "improved_bug\n  clearance_m: 200\n  planning_window_m: 9000", "22: planner.planning_window_m", "3000"),
    "storm": ("speed_mps: 5", "speed_mps: 23", "24: environment.wind.speed_mps", "below 0.9 of the airspeed"),
    "turbulence model": ("tustin", "dryden", "25: environment.turbulence.model", "'tustin' or 'milspec'"),
    "load factor of level flight": ("load_factor: 2.5", "load_factor: 1", "27: trackability.load_factor",
        "must be greater than 1"),
    "gusts without end": ("duration_s: 5", "duration_s: 61", "26: environment.vertical_gusts.duration_s", "at most"),
    "key given twice": ("seed: 1", "seed: 1\nseed: 2", "4: seed", "is given twice, first in line 3"),
    "nested key given twice": ("rays: 360", "rays: 3, rays: 4", "18: sensor.rays", "is given twice"),
    "anchor": ("seed: 1", "seed: &one 1", "3: seed", "has the anchor &one"),
    "alias": ("seed: 1", "seed: *one", "3: seed", "is the alias *one"),
    "merge key": ("  steps: 8", "  <<: {steps: 8}", "22: planner", "has the merge key <<"),
    "tag": ("seed: 1", "seed: !!int 1", "3: seed", "has the tag tag:yaml.org,2002:int"),
    "list as a key": ("seed: 1", "[1, 2]: 1", "3: has a key that is not plain text", ""),
    "tab": ("  course_deg: 90", "\tcourse_deg: 90", "13: has a tab; indent with spaces", ""),
    "tab elsewhere": ("  course_deg: 90", "  course_deg: 90: 5  # a\tb", "13: mission", "is not YAML (mapping"),
    "bad indentation": ("  goal_m", "   goal_m", "14: mission", "is not YAML"),
    "open bracket": ("[0, 0, 20000, 10000]", "[0, 0, 20000, 10000", "5: area.bounds_m", "is not YAML"),
    "open quote": ("name: good", "name: 'good", "2: name", "is not YAML"),
    "control character": ("name: good", "name: go\aod", "2: has the control character 0x07", ""),
    "too deep": ("seed: 1", f"seed: {'[' * 40}{']' * 40}", "3: seed[0][0]", "is nested deeper than 20 levels"),
}
# fmt: on


def faults_of(path: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """What `fly` says of a file on standard error; it must refuse it and write nothing."""
    before = sorted(path.parent.rglob("*"))
    assert main(["fly", str(path), "--out", str(path.parent / "run")]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert "Traceback" not in said.err
    assert sorted(path.parent.rglob("*")) == before
    return said.err.splitlines()


def test_the_unspoilt_file_is_valid(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", str(written(tmp_path / "good.yaml", GOOD))]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(("old", "new", "place", "sentence"), BROKEN.values(), ids=BROKEN)
def test_names_line_and_key(
    old: str, new: str, place: str, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert GOOD.count(old) >= 1
    path = written(tmp_path / "broken.yaml", GOOD.replace(old, new, 1))
    faults = faults_of(path, capsys)
    assert 1 <= len(faults) <= 2
    assert faults[0].startswith(f"{path}:{place}")
    assert sentence in faults[0]


BYTES = {
    "empty": (b"", ":1: is empty"),
    "only a comment": (
        b"# a town\n\n # of wind\n",
        ":1: has no key, only 2 lines of comments; must be a map",
    ),
    "only spaces": (b"   \n\n", ":1: is empty"),
    "a word": (b"scenario\n", ":1: is the text 'scenario'; must be a mapping"),
    "a list": (b"- 1\n- 2\n", ":1: is a list of 2; must be a mapping"),
    "two documents": (GOOD.encode() + b"---\nseed: 2\n", ":28: a second document begins here"),
    "Latin-1": (GOOD.replace("good", "gut\xe9").encode("latin-1"), ":2: byte 0xe9 is not UTF-8"),
    "UTF-16": (GOOD.encode("utf-16"), ": is UTF-16; must be a scenario"),
    "binary": (bytes(range(256)) * 50, ": is not a text file"),
    "deep flow": (b"a: " + b"[" * 200_000, ":1: a[0][0]: is nested deeper"),
    "deep block": (b"".join(b" " * n + b"a:\n" for n in range(500)), ":22: a.a.a: is nested deeper"),
    "billion laughs": (b"a: &a [x, x]\nb: [*a, *a]\n", ":1: a: has the anchor &a"),
    "huge": (b"#" * 33_000_000, ": is larger than 32 MB"),
}


@pytest.mark.parametrize(("content", "sentence"), BYTES.values(), ids=BYTES)
def test_names_what_is_not_a_scenario_at_all(
    content: bytes, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "broken.yaml"
    path.write_bytes(content)
    faults = faults_of(path, capsys)
    assert len(faults) == 1
    assert faults[0].startswith(f"{path}{sentence}")


def test_tells_the_first_of_many_faults_and_how_many_more_there_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path / "broken.yaml", GOOD.replace("m: ", "metre: "))
    faults = faults_of(path, capsys)
    assert len(faults) == 2
    assert all(fault.startswith(f"{path}:") for fault in faults)
    assert faults[-1].endswith("more")
    assert len(faults_of(written(path, GOOD.replace(SQUARE, "[[12, x], [14, 3], [14, 5]]")), capsys)) == 1


@pytest.mark.parametrize("name", ["missing.yaml", "."])
def test_names_an_unreadable_file(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (fault,) = faults_of(tmp_path / name, capsys)
    assert fault.startswith(f"{tmp_path / name}: ")
    assert "paper_circles" in fault


@pytest.mark.parametrize(
    ("start", "course"), [("[0, 5000]", 270), ("[0, 0]", 225), ("[5000, 10000]", 0), ("[30, 5000]", 270)]
)
def test_a_mission_that_begins_by_leaving_is_refused_with_a_course_that_would_do(start: str, course: float) -> None:
    text = (
        "schema: wayproof/scenario/1\nname: border\narea: {{bounds_m: [0, 0, 10000, 10000]}}\n"
        f"mission: {{{{start_m: {start}, course_deg: {{}}, goal_m: [5000, 5500]}}}}\n"
    )
    with pytest.raises(InputError) as caught:
        scenario_of(text.format(course), "border.yaml")
    told = re.fullmatch(r"border.yaml:4: mission.course_deg: .*; must be another, as (\d+)", str(caught.value))
    assert told
    assert scenario_of(text.format(told[1]))
    assert scenario_of(text.format(course).replace(start, "[5000, 2000]"))
