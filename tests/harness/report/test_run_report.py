"""The report of a single run: written from the run folder alone, and shown by a real browser."""

import csv
import hashlib
import json
import shlex
import shutil
from pathlib import Path
from typing import Any

import pytest

from harness.analysis.causes import FINDINGS
from harness.cli.app import main
from harness.report.chapters import _scene
from harness.report.figure_style import styled
from harness.report.figures import draw_map
from harness.run_files.run_folder import REPORT_FILES, load_run
from harness.world.optimum import optimum_of
from harness.world.world import World
from tests.harness.comparison.test_compare import SCENARIO as RING
from tests.page import assert_shown, shown
from tests.scenarios import scenario_of

SCENARIO = RING.format(name="ring", motion="").replace("rolling_window, clearance_m: 40", "bug2, clearance_m: 100")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run whose plans have corners, with its report."""
    folder = tmp_path_factory.mktemp("report")
    (folder / "ring.yaml").write_text(SCENARIO)
    out = folder / "run"
    assert main(["fly", str(folder / "ring.yaml"), "--out", str(out), "--no-recording", "--quiet"]) == 0
    assert main(["report", str(out)]) == 0
    return out


def test_report_is_written_into_the_run_folder(run: Path) -> None:
    assert {path.name for path in run.iterdir()} >= set(REPORT_FILES)
    page, metrics = (run / "report.html").read_text(), load_run(run).metrics
    assert metrics["digest"] in page
    assert "kind: bug2" in page, "the scenario as flown"
    lost = [leg for leg in metrics["trackability"] if not leg["trackable"]]
    assert f"{len(lost)} of {len(metrics['trackability'])} legs were not." in page
    (row,) = csv.DictReader((run / "report.csv").read_text().splitlines())
    assert (row["outcome"], row["digest"]) == ("reached", metrics["digest"])
    assert float(row["flown_length_m"]) == metrics["flown_length_m"]


def test_the_arrow_of_the_wind_points_where_it_blows_on_a_map_of_any_shape() -> None:
    """In shares of a map of 12 km x 3 km 45 deg would be drawn as 76."""
    wide = scenario_of(SCENARIO.replace("3000, 3000]", "12000, 3000]")).with_(
        {"environment.wind": {"speed_mps": 6, "from_deg": 225, "measured_at_m": 10}}
    )
    with styled(2.0) as figure:
        axes = figure.add_subplot()
        draw_map(axes, _scene(wide, World.from_scenario(wide), optimum_of(wide), None))
        figure.canvas.draw()
        arrow: Any = next(each for each in axes.texts if getattr(each, "arrow_patch", None))
        right, up = arrow.xycoords.transform(arrow.xy) - arrow.anncoords.transform(arrow.xyann)
    assert right == pytest.approx(up)
    assert right > 0.0
    assert "wind 6 m/s from 225 deg at 10 m" in {text.get_text() for text in axes.texts}


@pytest.mark.flights
def test_a_leg_shows_the_limit_that_it_was_over(run: Path, tmp_path: Path) -> None:
    """Beside its cross-track error, which may have been small."""
    leg: dict[str, Any] = {"start_s": 0.0, "end_s": 9.0, "trackable": False, "cause": "navigation error"}
    leg |= {"max_cross_track_m": 0.8, "threshold_m": 10.0, "max_altitude_error_m": 12.5}
    leg |= {"max_airspeed_error_mps": None, "max_load_factor": 1.4}
    page = page_with(run, tmp_path / "high", trackability=[leg])
    assert f"<strong>navigation error</strong>: {FINDINGS['navigation error']}.</p>" in page
    assert "<strong>bank limit</strong>" not in page, "no leg has that cause"
    assert "<p>1 of 1 legs were not. Allowed: cross-track 10 m, altitude error 10 m.</p>" in page
    assert '<td>0.8</td><td class="bad">12.5</td><td class="bad">navigation error</td>' in page
    wide = leg | {"max_cross_track_m": 11.0, "max_altitude_error_m": 0.1}
    page = page_with(run, tmp_path / "wide", trackability=[wide])
    assert '<td class="bad">11.0</td><td class="bad">navigation error</td>' in page
    assert "altitude error, m" not in page
    both = [leg | {"max_airspeed_error_mps": 4.0, "max_load_factor": 4.5}, wide]
    page = page_with(run, tmp_path / "both", trackability=both)
    assert "altitude error 10 m, airspeed error 2.5 m/s, load factor 3.8.</p>" in page
    assert '<td>0.8</td><td class="bad">12.5</td><td class="bad">4</td><td class="bad">4.5</td>' in page
    assert '<td class="bad">11.0</td><td>0.1</td><td>\N{EN DASH}</td><td>1.4</td>' in page


def rewrite(file: Path, text: str) -> None:
    """Writes a file of a run folder anew, with its hash in the manifest: an edited file alone is refused."""
    file.write_text(text)
    manifest = json.loads((file.parent / "manifest.json").read_text())
    manifest["sha256"][file.name] = hashlib.sha256(file.read_bytes()).hexdigest()
    (file.parent / "manifest.json").write_text(json.dumps(manifest))


def page_with(run: Path, folder: Path, **figures: Any) -> str:
    shutil.copytree(run, folder)
    rewrite(folder / "metrics.json", json.dumps(json.loads((folder / "metrics.json").read_text()) | figures))
    assert main(["report", str(folder)]) == 0
    return (folder / "report.html").read_text()


@pytest.mark.flights
def test_the_report_of_a_campaigns_run_says_how_to_fly_it_again(tmp_path: Path) -> None:
    (tmp_path / "ring.yaml").write_text(SCENARIO)
    campaign = f"schema: wayproof/campaign/1\nname: c\nseed: 1\nscenarios: [{tmp_path}/ring.yaml]\nrecordings: thin\n"
    (tmp_path / "c.yaml").write_text(campaign)
    out = tmp_path / "out"
    assert main(["sweep", str(tmp_path / "c.yaml"), "--workers", "1", "--out", str(out), "--quiet"]) == 0
    assert main(["report", str(out / "runs" / "0")]) == 0
    command = f"wayproof fly --from {out / 'results.parquet'} --run 0"
    assert command in (out / "runs" / "0" / "report.html").read_text()
    again = [*shlex.split(command)[1:], "--out", str(tmp_path / "again"), "--no-recording", "--quiet"]
    assert main(again) == 0


@pytest.mark.flights
def test_report_escapes_what_it_is_told(run: Path, tmp_path: Path) -> None:
    copy = tmp_path / "run"
    shutil.copytree(run, copy)
    text, reason = (copy / "metrics.json").read_text(), load_run(run).metrics["reason"]
    evil = "<script>alert(1)</script>\\n<img src=x> \\u001b[31m\\udcff"
    rewrite(copy / "metrics.json", text.replace(reason, evil))
    assert main(["report", str(copy)]) == 0
    page = (copy / "report.html").read_text()
    assert "<script" not in page
    assert "&lt;script&gt;alert(1)" in page


def test_flying_anew_removes_the_report_of_the_run_before(run: Path, tmp_path: Path) -> None:
    copy = tmp_path / "run"
    shutil.copytree(run, copy)
    assert main(["fly", str(copy / "scenario.yaml"), "--out", str(copy), "--no-recording", "--quiet"]) == 0
    assert not {path.name for path in copy.iterdir()} & set(REPORT_FILES)


@pytest.mark.flights
def test_a_browser_shows_the_report_on_phone_and_screen(run: Path, chromium: Any) -> None:
    assert_shown(chromium, run / "report.html", figures=2)


@pytest.mark.flights
def test_a_table_of_corners_does_not_make_the_page_wider_than_a_phone(tmp_path: Path, chromium: Any) -> None:
    path, checked = tmp_path / "corners.csv", tmp_path / "checked"
    path.write_text("x_m,y_m\n0,0\n2000,0\n2000,1500\n4000,1500\n")
    assert main(["check", str(path), "--aircraft", "aerosonde", "--out", str(checked), "--no-recording"]) == 1
    assert main(["report", str(checked)]) == 0
    page = shown(chromium, checked / "report.html", 390)
    assert (page.said, page.asked_for, page.overflow_px) == ((), (), 0)
    on_phone = chromium.new_page(viewport={"width": 390, "height": 900})
    on_phone.goto((checked / "report.html").resolve().as_uri())
    assert on_phone.get_by_text("bending energy, 1/m").is_visible(), "figures without headings say nothing"
    on_phone.close()
    text = (checked / "report.html").read_text()
    assert "corners are cut" in text
    # What is tracked is the path with its corners rounded: the error against that is no reason for the verdict.
    leg = next(leg for leg in load_run(checked).metrics["trackability"] if not leg["trackable"])
    assert leg["max_deviation_m"] > 20.0 > leg["max_cross_track_m"]
    assert "off the path given, m" in text
    assert f'<td>{leg["max_deviation_m"]:.1f}</td><td class="bad">{leg["cause"]}</td>' in text


@pytest.mark.flights
def test_the_page_of_a_given_path_has_no_figures_of_a_planner(tmp_path: Path, chromium: Any) -> None:
    """Nor a clearance where none is wanted; and no word is broken within for a long cause beside it."""
    path, checked = tmp_path / "strip.csv", tmp_path / "checked"
    path.write_text("x_m,y_m\n0,0\n0,2000\n60,2000\n60,0\n")
    given = ["check", str(path), "--aircraft", "aerosonde", "--out", str(checked), "--no-recording"]
    around = "obstacles=[{circle: {center_m: [900, 800], radius_m: 150}}]"
    asked = ("clairvoyant optimum", "replans", "wanted clearance", "obstacles 0")
    typical = ["--set", around, "--clearance-m", "90", "--conditions", "typical"]
    for more, shown_too in (([], False), (typical[:2], False), (typical, True)):
        assert main([*given, *more]) == 1
        assert main(["report", str(checked)]) == 0
        said = (checked / "report.html").read_text().partition("<h2>How to repeat it")[0]
        assert [text for text in asked if text in said] == (["wanted clearance"] if shown_too else [])
        assert ("wanted clearance 90 m</li>" in said) is shown_too, "it keeps no navigation margin"
    page = chromium.new_page(viewport={"width": 390, "height": 900})
    page.goto((checked / "report.html").resolve().as_uri())
    narrow = "[...document.querySelectorAll('table.one th')].map(each => each.getBoundingClientRect().width)"
    assert min(page.evaluate(narrow)) > 110
    page.close()
