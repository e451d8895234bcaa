"""Planners side by side: real flights in processes of their own, and what is written of them."""

import csv
import itertools
import json
import math
import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.analysis.metric import number
from harness.analysis.rows import Row
from harness.cli.app import main
from harness.cli.compare import print_comparison
from harness.comparison.comparison import Comparison, fly_and_compare
from harness.report import figures
from harness.report.figure_style import WIDTH_IN, png
from harness.report.page import Chapter, rendered
from harness.report.planner_figure import planner_figure
from harness.run_files.run_folder import load_run
from harness.scenario.scenario import load_scenario
from harness.world.obstacle import Circle, Obstacle
from tests.faults.command import distribution
from tests.harness.conftest import CIRCLE_PLAN, circle_track
from tests.page import assert_shown
from tests.refusals import refused

PLUGIN = '''
import os

import numpy as np

from planner.interface import Path, Plan, PlanStatus


class Corner:
    """East, then straight to the goal."""

    def __init__(self, config, mission):
        self.mission = mission

    def plan(self, request):
        print("a planner that talks")
        if request.flown is not None:
            return Plan(PlanStatus.KEPT, "goes on")
        corners = np.array([request.position_m, (2700.0, 300.0), self.mission.goal_m])
        leg = np.diff(corners, axis=0)
        length = np.hypot(*leg.T)
        rows = np.column_stack((corners[:-1], leg / length[:, None], 0 * length, length))
        return Plan(PlanStatus.FOUND, "a corner", corners, Path(rows))


class Dies(Corner):
    def plan(self, request):
        os._exit(7)


class Raises(Corner):
    def __init__(self, config, mission):
        raise ValueError("<script>alert(1)</script> | *not* to be run")
'''
SCENARIO = """
schema: wayproof/scenario/1
name: {name}
area: {{bounds_m: [0, 0, 3000, 3000]}}
obstacles:
  - circle: {{center_m: [1500, 1500], radius_m: 300}}{motion}
mission: {{start_m: [300, 300], goal_m: [2700, 2700], goal_radius_m: 60}}
aircraft: {{model: aerosonde, airspeed_mps: 25}}
sensor: {{range_m: 1500}}
planner: {{kind: rolling_window, clearance_m: 40}}
"""
TIMES = ("planner_p50_ms", "planner_p99_ms", "planner_max_ms")
SIDE_M = 1200.0 * math.sqrt(2)
GROWN_M = np.array((340.0, 380.0))  # the ring and a clearance of 40 and 80 m
OPTIMA_M = 2 * np.sqrt(SIDE_M**2 - GROWN_M**2) + 2 * GROWN_M * np.arcsin(GROWN_M / SIDE_M) - 60.0


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with two scenarios, and with another distribution's planners that children find as well."""
    folder = tmp_path_factory.mktemp("compare")
    for file, name in (("ring", "ring"), ("ours", "report.html")):
        (folder / f"{file}.yaml").write_text(SCENARIO.format(name=name, motion=""))
    motion = "\n    velocity_mps: [-1.0, 0.5]"
    (folder / "drift.yaml").write_text(SCENARIO.format(name="drift", motion=motion))
    site = distribution(folder / "site", "side_by_side_plugin", PLUGIN, "corner", "dies", "raises")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(site)
        yield folder


@pytest.fixture(scope="module")
def flown(place: Path) -> Path:
    """The aircraft on one scenario, with four planners of which two crash."""
    out = place / "flown"
    options = ["--planners", "rolling_window,corner,dies,raises", "--out", str(out), "--workers", "2"]
    assert main(["compare", str(place / "ring.yaml"), *options]) == 1
    return out


def rows_of(out: Path) -> list[dict[str, Any]]:
    return list(json.loads((out / "comparison.json").read_text())["rows"])


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


@pytest.mark.flights
def test_writes_tables_figures_overlay_report_and_a_run_folder_each(flown: Path) -> None:
    assert files(flown) == {"comparison.csv", "comparison.json", "report.html", "ring"}
    pictures = ("map", "profiles", "path-rolling_window", "path-corner")
    drawn = {f"{name}.{kind}" for name in pictures for kind in ("svg", "png")}
    assert files(flown / "ring") == drawn | {"overlay.rrd", "rolling_window", "corner", "dies"}
    run = load_run(flown / "ring" / "corner")
    strips = figures.profiles([(0, figures.DrawnRun("", "reached", run.track, run.plans, 110.0))])
    at_km, bend = map(np.asarray, strips.axes[0].lines[0].get_data())
    assert at_km[bend != 0.0] == pytest.approx([2.4, 2.4], abs=1e-3), "2,400 m east, then the goal"
    assert json.loads((flown / "comparison.json").read_text())["complete"] is True


@pytest.mark.flights
def test_the_optimum_is_that_of_the_clearance_under_each_law(place: Path) -> None:
    """Under a law that needs wider turns a clearance that no file gives is wider."""
    ring = load_scenario(place / "ring.yaml", [("mission.time_limit_s", "1")])
    laws = {"preview": 40, "l1": 80}
    flights = [ring.with_({"guidance.kind": law, "planner.clearance_m": m}) for law, m in laws.items()]
    rows = fly_and_compare(flights, place / "laws", recording=False).rows
    assert [row.optimum_m for row in rows] == pytest.approx(OPTIMA_M, rel=1e-9)
    assert "40 m or 80 m" in (place / "laws" / "report.html").read_text()


@pytest.mark.flights
def test_an_error_is_a_row_and_the_others_fly_on(flown: Path) -> None:
    rows = rows_of(flown)
    assert [row["planner"] for row in rows] == ["rolling_window", "corner", "dies", "raises"]
    assert [row["outcome"] for row in rows] == ["reached", "reached", "error", "error"]
    assert rows[2]["reason"].startswith("the process that flew it died")
    told = "ValueError: <script>alert(1)</script> | *not* to be run"
    assert rows[3]["reason"] == f"the planner raises cannot be made: {told}"
    assert rows[3]["flown_length_m"] is None


@pytest.mark.flights
def test_figures_are_those_of_the_runs(flown: Path) -> None:
    with (flown / "comparison.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    for cells, row in zip(table, rows_of(flown), strict=True):
        assert cells == {name: "" if value is None else str(value) for name, value in row.items()}
    for row in rows_of(flown)[:2]:
        said = load_run(flown / "ring" / row["planner"]).metrics
        assert row["digest"] == said["digest"]
        assert row["total_system_error_max_m"] == said["total_system_error_m"]["max"]
        assert row["planned_heading_change_deg"] == said["smoothness"]["planned"]["heading_change_deg"]
        assert row["planner_max_ms"] == said["compute_ms"]["max"]
        assert row["optimum_m"] == pytest.approx(OPTIMA_M[0], rel=1e-9)
        assert row["ratio"] == pytest.approx(said["flown_length_m"] / OPTIMA_M[0], rel=1e-9)


@pytest.mark.flights
def test_a_corner_is_tighter_than_the_aircraft_and_is_not_tracked(flown: Path) -> None:
    smooth, corner = rows_of(flown)[:2]
    assert smooth["tightest_turn"] == pytest.approx(1.0, abs=1e-6)
    assert smooth["trackable"] is True
    # 90 degrees in one second of flight.
    assert corner["tightest_turn"] == pytest.approx(math.pi / 2 / 25.0 * corner["turn_radius_m"], rel=1e-2)
    assert corner["trackable"] is False
    assert corner["total_system_error_max_m"] > 10.0


@pytest.mark.flights
def test_a_browser_shows_the_report_on_phone_and_screen(flown: Path, chromium: Any) -> None:
    assert_shown(chromium, flown / "report.html", figures=4)
    text = (flown / "report.html").read_text()
    assert "ValueError: &lt;script&gt;alert(1)&lt;/script&gt; | *not* to be run" in text
    assert "<script" not in text
    assert all(row["digest"] in text for row in rows_of(flown)[:2])


@pytest.mark.flights
def test_the_report_says_how_to_repeat_it(
    place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = place / "repeat"
    arguments = ["compare", str(place / "ring.yaml"), "--planners", "raises", "--out", str(out)]
    monkeypatch.setattr("sys.argv", ["/somewhere/bin/wayproof", *arguments])
    assert main(arguments) == 1
    assert f"wayproof compare {place / 'ring.yaml'} --planners raises" in (out / "report.html").read_text()
    assert "raises, error: the planner raises cannot be made: ValueError: <script>" in capsys.readouterr().out
    assert files(out / "ring") == set()


@pytest.mark.flights
def test_any_number_of_workers_gives_the_same_answer(place: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scenarios = [str(place / "ring.yaml"), str(place / "drift.yaml")]
    answers = []
    for workers in ("1", "2"):
        out = place / f"workers-{workers}"
        options = ["--planners", "rolling_window,bug2", "--no-recording", "--json", "--workers", workers]
        assert main(["compare", *scenarios, *options, "--out", str(out)]) in (0, 1)
        answer = json.loads(capfd.readouterr().out)
        assert answer == json.loads((out / "comparison.json").read_text())
        assert not (out / "ring" / "overlay.rrd").exists()
        answers.append([{name: row[name] for name in row if name not in TIMES} for row in answer["rows"]])
    assert answers[0] == answers[1]
    ring, _, drift, _ = answers[0]
    assert (ring["scenario"], drift["scenario"], drift["ratio"]) == ("ring", "drift", None)
    assert ring["ratio"] >= 0.98
    page = (place / "workers-1" / "report.html").read_text()
    assert "an obstacle moves" in page
    assert "<h3>rolling_window against bug2</h3>\n<p>2 pairs: " in page


@pytest.mark.flights
def test_the_overlay_of_an_earlier_comparison_is_not_offered(
    place: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--planners", "corner", "--out", str(tmp_path)]
    assert main(["compare", str(place / "ring.yaml"), *options]) == 0
    told = [*map(str.strip, capsys.readouterr().out.splitlines())]
    assert told[1] == "conditions: ideal: calm, state known exactly"
    assert f"view: wayproof view {tmp_path}/ring/overlay.rrd" in told
    assert main(["compare", str(place / "drift.yaml"), *options, "--no-recording"]) == 0
    assert "view: " not in capsys.readouterr().out
    assert (tmp_path / "ring" / "overlay.rrd").is_file()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["{place}/ring.yaml"], "--planners"),
        (["--planners", "corner"], "SCENARIO"),
        (["{place}/ring.yaml", "--planners", "corner,astar"], "planner.kind: is 'astar'"),
        (["{place}/ring.yaml", "--planners", ""], "planner.kind"),
        (["{place}/ring.yaml", "--planners", "corner,corner"], "corner is to fly ring twice"),
        (["{place}/ring.yaml", "{place}/ring.yaml", "--planners", "corner"], "corner is to fly ring twice"),
        (["{place}/nowhere.yaml", "--planners", "corner"], "nowhere.yaml: no such file"),
        (["{place}/ring.yaml", "--planners", "corner", "--workers", "0"], "--workers"),
        (["{place}/ours.yaml", "--planners", "corner"], "a scenario is called report.html, as a file of the"),
    ],
)
def test_bad_input_ends_with_2_before_anything_is_flown(
    place: Path, tmp_path: Path, arguments: list[str], sentence: str
) -> None:
    given = [argument.format(place=place) for argument in arguments]
    said = refused("compare", *given, "--out", tmp_path / "out")
    assert sentence in said
    assert said.count("\n") <= 2
    assert not (tmp_path / "out").exists()


@pytest.mark.flights
def test_a_planner_in_a_file_may_lie_in_another_folder(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine").mkdir()
    own = PLUGIN.partition("class Dies")[0].replace("self, config, mission", "self, mission")
    (tmp_path / "mine" / "own.py").write_text(own)
    monkeypatch.chdir(tmp_path)
    given = [str(place / "ring.yaml"), "--planners", "rolling_window,mine/own.py:Corner", "--no-recording"]
    assert main(["compare", *given, "--out", "out"]) == 0
    assert [row["planner"] for row in rows_of(tmp_path / "out")] == ["rolling_window", "own.py:Corner"]


def test_the_terminal_table_fits_80_columns(capsys: pytest.CaptureFixture[str]) -> None:
    worst = Row(
        "a-scenario", "a_planner_with_a_long_name", "planner_failed", "[bold] it raised",
        flown_length_m=123456.7, optimum_m=1e5, ratio=12.3456, min_clearance_m=-1234.5, tightest_turn=123.456,
        trackable=False, total_system_error_max_m=1234.5, planner_p99_ms=123.4,
    )  # fmt: skip
    print_comparison([worst, Row("a-scenario", "b", "error", "[bold] it died")], {"a-scenario": "ideal"})
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    for text in ("planner_failed", "123.5", "12.3456", "-1234", "123.46", "no", "1234", "123.4", "error"):
        assert any(text in line.split() for line in lines), text
    assert lines[-1] == "b, error: [bold] it died"
    assert "all legs trackable" in " ".join(lines[-4:-1])


@pytest.mark.parametrize("planners", [("rolling_window",), ("rolling_window", "vfh_plus")])
def test_the_terminal_table_has_planner_and_law_whole(
    planners: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    laws = ("preview", "npfg", "l1", "vector_field", "pure_pursuit")
    figures = {"flown_length_m": 123456.7, "ratio": 12.3456, "planner_p99_ms": 123.4}
    pairs = itertools.product(planners, laws)
    rows = [Row("w", one, "planner_failed", "x", guidance=law, **figures) for one, law in pairs]
    print_comparison(rows, {"w": "ideal"})
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert all("123.4" in line.split() for line in lines if "planner_failed" in line)
    begins = [line.split()[0] for line in lines if line.strip()]
    for name in ("rolling_window", *laws):
        wanted = len(planners) if name in laws else len(laws) if len(planners) > 1 else 0
        assert begins.count(name) == wanted, name
    assert lines[0].rstrip() == ("w, rolling_window" if len(planners) == 1 else "w")


def test_numbers_read_well() -> None:
    values = (None, 0.0, 1.0, 0.12345, 0.00004, -0.5, 94321.5, 306.04, 99.96)
    assert [*map(number, values)] == ["", "0", "1", "0.123", "4.0e-05", "-0.5", "94322", "306.0", "100"]


@pytest.fixture
def drawn() -> tuple[figures.FigureScene, figures.DrawnRun]:
    track = circle_track(500.0, 60.0)
    obstacle = Obstacle(Circle((3000.0, 3000.0), 400.0))
    scene = figures.FigureScene(
        name="a_world", bounds_m=(-1000.0, -1000.0, 5000.0, 5000.0), obstacles=(obstacle,), start_m=(500.0, 0.0),
        goal_m=(4000.0, 4500.0), goal_radius_m=60.0, clearance_m=50.0, turn_radius_m=100.0, optimum_m=np.zeros((0, 2)),
    )  # fmt: skip
    return scene, figures.DrawnRun("round", "timeout", track, [CIRCLE_PLAN], 150.0)


@pytest.mark.parametrize("changes", [False, True])
@pytest.mark.parametrize("outcome", ["reached", "timeout"])
def test_the_legend_explains_every_mark_that_is_there_and_no_other(
    drawn: tuple[figures.FigureScene, figures.DrawnRun], changes: bool, outcome: str
) -> None:
    scene, run = drawn[0], replace(drawn[1], outcome=outcome)
    if changes:
        scene = replace(scene, obstacles=(*scene.obstacles, Obstacle(Circle((0.0, 2000.0), 9.0), (1.0, 0.0))))
    for figure in (figures.overview(scene, [(0, run)]), planner_figure(scene, run, 0)):
        (legend,) = figure.legends
        told = {text.get_text() for text in legend.get_texts()}
        assert ("moves, or stands for a time" in told) is changes
        assert ("ended, not at G" in told) is (outcome == "timeout")


@pytest.mark.parametrize("size_m", [(20_000, 900), (1500, 6000), (900, 36_000), (800, 2000)])
def test_the_numbers_beside_a_flat_or_narrow_map_stand_apart(
    drawn: tuple[figures.FigureScene, figures.DrawnRun], size_m: tuple[float, float]
) -> None:
    figure = planner_figure(replace(drawn[0], bounds_m=(0.0, 0.0, *size_m), name="n_" * 50), drawn[1], 0)
    with warnings.catch_warnings(action="error"):
        png(figure)
    assert figure.axes[0].title.get_window_extent().width < 200 * WIDTH_IN, "the outcome is at its end"
    assert max(figure.axes[0].get_position().size * figure.get_size_inches()) > 3.0, "its size"
    unit, (*_, last) = figure.axes[0].get_ylabel(), figure.axes[0].yaxis.get_major_ticks()
    assert float(last.label1.get_text()) == last.get_loc() * {"north, km": 1, "north, m": 1000}[unit]
    for axis, along in zip((figure.axes[0].xaxis, figure.axes[0].yaxis), (0, 1), strict=True):
        shown = [tick for tick in axis.get_major_ticks() if 0.0 <= tick.get_loc() <= size_m[along] / 1e3]
        spans = sorted(tuple(tick.label1.get_window_extent().get_points()[:, along]) for tick in shown)
        assert all(end < begin for (_, end), (begin, _) in itertools.pairwise(spans))


def test_a_planner_that_came_too_near_is_marked_on_the_page() -> None:
    near = Row("s", "near", "reached", "there", min_clearance_m=1.1, clearance_violation_s=66.2)
    fair = Row("s", "fair", "reached", "there", min_clearance_m=102.2, clearance_violation_s=0.0)
    chapters, told = [Chapter("s", {}, [near, fair], [])], {"command": "", "versions": {}, "written": ""}
    html = rendered("comparison.html", chapters=chapters, duels=(), **told)
    for text in ("1.1", "66.2"):
        assert f'<td data-planner="near" class="bad">{text}</td>' in html
    for text in ("102.2", "0"):
        assert f'<td data-planner="fair">{text}</td>' in html


@pytest.mark.flights
def test_words_stay_whole_beside_many_flights(tmp_path: Path, chromium: Any) -> None:
    rows = [Row("s", f"rolling_window, law {number}", "reached", "there") for number in range(12)]
    told = {"command": "", "versions": {}, "written": ""}
    html = tmp_path / "report.html"
    html.write_text(rendered("comparison.html", chapters=[Chapter("s", {}, rows, [])], duels=(), **told))
    assert_shown(chromium, html, figures=0)
    page = chromium.new_page(viewport={"width": 1200, "height": 900})
    page.goto(html.as_uri())
    cells = "[...document.querySelectorAll('th[scope=row], td.good')]"
    assert page.evaluate(f"Math.min(...{cells}.map(cell => cell.clientWidth))") > 60


def test_a_near_miss_is_enlarged(drawn: tuple[figures.FigureScene, figures.DrawnRun]) -> None:
    """With the obstacle where it was then, and the clearance that was wanted."""
    scene, run = drawn
    # Half the circle of 500 m is flown in 60 s; at 30 s the obstacle, which came from the west, is north of it.
    obstacle = Obstacle(Circle((-265.0, 610.0), 80.0), velocity_mps=(10.0, 0.0))
    points_m = np.column_stack((run.track.east_m, run.track.north_m))
    track = replace(run.track, clearance_m=obstacle.distance(points_m, run.track.time_s))
    run, scene = replace(run, track=track, outcome="reached"), replace(scene, obstacles=(obstacle,))
    row = int(track.clearance_m.argmin())
    least_m, at_s, place = float(track.clearance_m[row]), track.time_s[row], points_m[row] / 1e3
    assert 0.0 < least_m < scene.clearance_m
    whole, close_up, clearance = planner_figure(scene, run, 0).axes
    assert close_up.get_title() == f"nearest: {number(least_m)} m, at {at_s:.1f} s"
    for axes in (whole, close_up):
        marked = [np.asarray(line.get_xydata()) for line in axes.get_lines() if line.get_marker() == "s"]
        assert marked == [pytest.approx(place[None, :])]
    assert np.mean([close_up.get_xlim(), close_up.get_ylim()], axis=1) == pytest.approx(place)
    (solid,) = [patch for patch in close_up.patches if patch.get_fill()]
    corners_km = close_up.transData.inverted().transform(solid.get_extents().get_points())
    assert corners_km.mean(axis=0) == pytest.approx(np.array((-265.0 + 10.0 * at_s, 610.0)) / 1e3, abs=1e-3)
    assert any(np.allclose(line.get_ydata(), scene.clearance_m) for line in clearance.get_lines())
    crash = figures.DrawnRun("round", "collision", track.part(0, row + 1), [CIRCLE_PLAN], 150.0)
    assert planner_figure(scene, crash, 0).axes[1].get_title() == f"its collision, at {at_s:.1f} s"
    assert len(planner_figure(replace(scene, clearance_m=least_m), run, 0).axes) == 1


@pytest.mark.flights
def test_the_table_of_a_comparison_for_a_paper(flown: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", str(flown), "--format", "csv"]) == 0
    heads, *rows = csv.reader(capsys.readouterr().out.splitlines())
    assert heads[:4] == ["scenario", "planner", "outcome", "km"]
    lengths_m = [row["flown_length_m"] for row in rows_of(flown)]
    assert [row[3] for row in rows] == [f"{m / 1e3:.3g}" if m else "\N{EN DASH}" for m in lengths_m]
    said = refused("report", flown / "ring", "--format", "csv")
    assert "is not the folder of a campaign or of a complete comparison" in said
    assert f"of a comparison, not of a run; see {flown / 'report.html'}" in refused("report", flown)


def test_the_report_of_a_stopped_comparison_says_what_flies_it_again(tmp_path: Path) -> None:
    """That of a stopped replay, which has no page yet, says that it was stopped."""
    Comparison("wayproof compare forest", "2026-01-01T00:00:00", {}, ()).write(tmp_path, complete=False)
    assert "`wayproof compare forest` flies it again" in refused("report", tmp_path)
    (tmp_path / "comparison.json").rename(tmp_path / "replay.json")
    (tmp_path / "replay.json").write_text('{"schema": "wayproof/replay/1", "complete": false}')
    assert "its replay has not been flown to its end" in refused("report", tmp_path)
