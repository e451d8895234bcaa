"""`wayproof certify`: days of a planted failure rate, flown, counted and kept; the same for any number of workers."""

import json
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

import wayproof
from harness.certification.certification import Certificate, Explained
from harness.cli.app import main
from harness.cli.certify import certificate_rows
from tests.faults.command import CAMPAIGN_FILES
from tests.refusals import refused

LIMITS_S = "mission.time_limit_s=40:70"
"""The flight of the short scenario takes some 50 to 60 s: on a part of the days it does not arrive in time."""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("certify")
    (folder / "short.yaml").write_text(CAMPAIGN_FILES["short.yaml"])
    return folder


def certify(place: Path, *words: str, out: str = "out") -> tuple[int, dict[str, Any]]:
    status = main(["certify", str(place / "short.yaml"), *words, "--out", str(place / out), "--quiet"])
    file = place / out / "certificate.json"
    return status, json.loads(file.read_text()) if file.exists() else {}


def refuses(place: Path, *words: str, out: str = "out") -> str:
    return refused("certify", place / "short.yaml", *words, "--out", place / out)


@pytest.fixture(scope="module")
def flown(place: Path) -> dict[str, Any]:
    """Ten days with drawn time limits."""
    status, certificate = certify(place, "--vary", LIMITS_S, "--runs", "10", "--workers", "1")
    assert status == 1
    return certificate


def test_days_are_counted_as_flights_alone_say_and_failing_ones_are_kept(flown: dict[str, Any], place: Path) -> None:
    arrival_s = wayproof.fly(place / "short.yaml").metrics.flight_time_s
    limits_s = pq.read_table(place / "out" / "results.parquet")["mission.time_limit_s"].to_pylist()
    failing = [run for run, limit_s in enumerate(limits_s) if limit_s < arrival_s]
    assert flown["claim"] == "reached"
    assert flown["runs"] == 10
    assert 0 < flown["held"] == 10 - len(failing) < 10
    assert flown["failing_runs"] == failing
    assert (flown["verdict"], flown["confidence"]) == ("undecided", 0.95)
    assert flown["probability_lower"] < flown["held"] / 10 < flown["probability_upper"]
    assert [(each["outcome"], each["count"]) for each in flown["failures"]] == [("timeout", len(failing))]
    assert [each["key"] for each in flown["explained"]] == ["mission.time_limit_s"]
    assert flown["explained"][0]["share"] > 0.5
    kept = sorted(int(each.name) for each in (place / "out" / "runs").iterdir())
    assert kept == failing
    run = wayproof.load_run(place / "out" / "runs" / str(kept[0]))
    row = pq.read_table(place / "out" / "results.parquet").to_pylist()[kept[0]]
    assert (run.outcome, run.digest) == ("timeout", row["digest"])
    assert (place / "out" / "runs" / str(kept[0]) / "flight.rrd").stat().st_size > 0


@pytest.mark.flights
def test_a_claim_is_refuted_early_and_alike_at_any_number_of_workers(place: Path) -> None:
    words = ("--vary", LIMITS_S, "--probability", "0.95", "--runs", "40")
    found = [certify(place, *words, "--workers", str(number), out=f"w{number}") for number in (1, 2)]
    (status, one), (_, two) = found
    assert (status, one["verdict"], one["runs"] < 40) == (1, "refuted", True)
    assert one["probability_upper"] < 0.95
    assert {**one, "command": ""} == {**two, "command": ""}
    tables = [(place / out / "results.parquet").read_bytes() for out in ("w1", "w2")]
    assert tables[0] == tables[1]
    told = wayproof.load_campaign(place / "w1").summary
    assert told.total.runs == told.planned == one["runs"], "none is missing"
    assert main(["report", str(place / "w1")]) == 0
    failed = f"Failed: timeout: {len(one['failing_runs'])} (run {str(one['failing_runs'][:5])[1:-1]}"
    for text in (failed, f": {one['subject']}<", f"held on {one['held']} of {one['runs']} days", ">refuted<"):
        assert text in (place / "w1" / "summary.html").read_text()
    one.pop("first_day")  # as an earlier version wrote it
    (place / "w1" / "certificate.json").write_text(json.dumps(one))
    assert main(["report", str(place / "w1")]) == 0
    (place / "w1" / "certificate.json").write_text('{"schema": "wayproof/certificate/1"}')
    assert main(["report", str(place / "w1")]) == 2


def test_a_claim_is_shown_and_a_second_certificate_needs_resume(place: Path) -> None:
    words = ("--claim", "no-contact", "--probability", "0.4", "--runs", "20", "--workers", "1")
    status, first = certify(place, *words, out="shown")
    assert (status, first["verdict"]) == (0, "shown")
    assert first["runs"] == first["held"] < 20
    assert first["probability_lower"] >= 0.4
    assert "--resume" in refuses(place, *words, out="shown")
    status, again = certify(place, *words, "--resume", out="shown")
    assert status == 0
    assert {**again, "command": ""} == {**first, "command": ""}


@pytest.mark.flights
def test_more_days_go_on_with_those_that_were_flown_and_have_bounds_that_allow_it(
    flown: dict[str, Any], place: Path
) -> None:
    """Whoever raises the number has seen what came out: no bound for a number that was fixed beforehand holds then."""
    words = ("--vary", LIMITS_S, "--workers", "1", "--runs")
    assert certify(place, *words, "4", out="grown")[1]["runs"] == 4
    _, grown = certify(place, *words, "10", "--resume", out="grown")
    tables = [(place / out / "results.parquet").read_bytes() for out in ("out", "grown")]
    assert tables[0] == tables[1]
    assert (grown["runs"], grown["failing_runs"]) == (10, flown["failing_runs"])
    assert "--resume raised the number of runs" in grown["method"]
    assert grown["probability_lower"] < flown["probability_lower"]
    assert flown["probability_upper"] < grown["probability_upper"]
    _, refuted = certify(place, *words, "10", "--probability", "0.95", "--resume", out="grown")
    _, again = certify(place, *words, "10", "--resume", out="grown")
    assert again["method"] == grown["method"], "it stays so"
    kept = sorted(int(each.name) for each in (place / "grown" / "runs").iterdir())
    assert refuted["failing_runs"] != kept == again["failing_runs"], "also of days after the one that decided"
    assert "campaign.draws was 10, is 4" in refuses(place, *words, "4", "--resume", out="grown")


def test_a_day_under_an_own_law_names_it_where_it_is_flown_again(place: Path) -> None:
    law = "from aircraft.guidance.pure_pursuit import PurePursuitConfig as Config, PurePursuitLaw as Law"
    flies = "def Mine(limits):\n    return Law(Config().resolved(limits), limits)\n"
    (place / "law.py").write_text(f"{law}\n{flies}")
    words = ("--guidance", f"{place / 'law.py'}:Mine", "--set", "mission.time_limit_s=2", "--runs", "1")
    assert certify(place, *words, "--workers", "1", out="law")[1]["failing_runs"] == [0]
    (command,) = wayproof.load_run(place / "law" / "runs" / "0").manifest["command"]
    assert command == f"wayproof fly --from {place / 'law' / 'results.parquet'} --run 0 --guidance law.py:Mine"


def test_a_day_whose_drawn_aircraft_cannot_fly_fails_with_its_cause(place: Path) -> None:
    """The days that count as failures are those whose flight alone is refused."""
    keys = {"aircraft.airspeed_mps": 18, "uncertainty.mass": 0.3, "mission.time_limit_s": 5}
    words = [word for key, value in keys.items() for word in ("--set", f"{key}={value}")]
    words += ["--claim", "no-contact", "--runs", "6", "--workers", "1"]
    _, found = certify(place, *words, out="heavy")
    refused = []
    for day in pq.read_table(place / "heavy" / "results.parquet").to_pylist():
        try:
            wayproof.load_scenario(place / "short.yaml").with_({**keys, "seed": day["seed"]})
        except wayproof.InputError:
            refused.append(day["run"])
    assert 0 < len(refused) < 6
    assert found["failing_runs"] == refused
    assert {each["outcome"] for each in found["failures"]} == {"lost_control"}
    assert found["failures"][0]["cause"].startswith("aerosonde cannot be trimmed for level flight at 18 m/s")
    more = " ".join(words).replace("=18", "=19").replace("=0.3", "=0.2").replace("--runs 6", "--runs 14")
    _, found = certify(place, *more.split(), "--conditions", "typical", out="as the flight begins")
    assert [each["outcome"] for each in found["failures"]] == ["lost_control"] * len(found["failures"])
    assert "JSBSim finds no trim" in found["failures"][-1]["cause"]
    written = refuses(place, *words, "--set", "aircraft.deviation.mass=0.5", out="written")
    assert "aircraft.deviation" in written


def certify_path(place: Path, points: str, *words: str) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    (place / "path.csv").write_text(f"east_m,north_m\n{points}\n")
    words = (str(place / "path.csv"), *words, "--workers", "1", "--out", str(place / "out"))
    assert main(["certify", *words]) == 1
    certificate = json.loads((place / "out" / "certificate.json").read_text())
    return certificate, pq.read_table(place / "out" / "results.parquet").to_pylist()


def test_a_given_path_is_certified_as_given(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--vary", "trackability.cross_track_m=1,50", "--seed", "5", "--runs", "4", "--wind", "2,90"]
    found, days = certify_path(tmp_path, "0,0\n2000,0\n2000,1500", *words)
    assert "no --aircraft: the path is flown by the aerosonde" in capsys.readouterr().err
    strict = [day["run"] for day in days if day["trackability.cross_track_m"] == 1.0]
    assert found["failing_runs"] == strict
    assert 0 < len(strict) < 4
    why = [(each["key"], each["share"]) for each in found["explained"]]
    assert (found["claim"], why) == ("as-given", [("trackability.cross_track_m", 1.0)])
    told = {**found, "failures": (), "explained": [Explained("conditions", 0.5, "rough", 1, 2)]}
    told.pop("schema")
    rows = certificate_rows(Certificate(**told))
    assert rows["conditions"] == "ideal; drawn: trackability.cross_track_m"
    assert rows["first day"] == "ideal, but for what the scenario sets: wind 2 m/s from 90 deg"
    assert rows["conditions drawn"].startswith("explains 50 % of the failures;")
    kept = wayproof.load_run(tmp_path / "out" / "runs" / str(strict[0]))
    assert kept.metrics.check is not None
    assert not kept.metrics.check.ok


def test_the_days_of_a_path_have_the_limits_of_its_check(tmp_path: Path) -> None:
    """A given path has no planner that keeps a margin in hand: 10 m are 10 m, satellite navigation or not."""
    _, days = certify_path(tmp_path, "0,0\n2000,0", "--set", "navigation.kind=gnss", "--runs", "4")
    off_m = [(day["deviation_from_given_m.max"], day["altitude_error_m.max"]) for day in days]
    assert any(10.0 < off < 20.0 for off, _ in off_m)  # the margin of a planner would be 20 m
    judged = [(day["check.ok"], day["wanted_clearance_m"]) for day in days]
    assert judged == [(max(each) <= 10.0, None) for each in off_m]


@pytest.mark.flights
def test_days_that_touch_the_same_obstacle_fail_alike_whenever_and_however_deep(tmp_path: Path) -> None:
    """The obstacle reaches 10 m over the line; with a tolerance of 1 m the turn before it is not tracked either."""
    (tmp_path / "world.yaml").write_text(
        "schema: wayproof/scenario/1\nname: world\narea: {bounds_m: [-500, -500, 2500, 2500]}\n"
        "obstacles: [{circle: {center_m: [1040, 900], radius_m: 50}}]\n"
        "mission: {start_m: [0, 0], goal_m: [2000, 0]}\n"
    )
    drawn = "--vary aircraft.airspeed_mps=22:28 --vary trackability.cross_track_m=1,50"
    radius = "--vary obstacles.0.circle.radius_m=50:51 --seed 6 --runs 4"
    words = ("--scenario", str(tmp_path / "world.yaml"), *f"{drawn} {radius}".split())
    found, days = certify_path(tmp_path, "0,0\n1000,0\n1000,1500", *words)
    assert len({day["trackability.causes"] for day in days}) == 2
    assert len({day["check.verdict"] for day in days}) == 4
    (alike,) = found["failures"]
    assert (alike["outcome"], alike["cause"], alike["count"]) == ("collision", "touches obstacles[0]", 4)


def test_keys_of_a_path_are_read_as_a_scenarios(tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("east_m,north_m\n0,0\n400,0\n")
    words = ["certify", str(tmp_path / "path.csv"), "--runs", "1", "--workers", "1", "--quiet"]
    for key, told in (("seed=abc", "seed: is the text 'abc'"), ("aircraft.model=[1]", "aircraft.model: ")):
        assert told in refused(*words, "--set", key, "--out", tmp_path / "none")
    (tmp_path / "scenario.yaml").write_text(CAMPAIGN_FILES["short.yaml"])
    (tmp_path / "manifest.json").touch()
    day = f"--scenario {tmp_path}/scenario.yaml --conditions rough --out {tmp_path}/none".split()
    for command in ([*words[:3], "2"], ["check", words[1], "--aircraft", "aerosonde", "--days", "2"]):
        assert "is rough, but a run's scenario says all of its one day" in refused(*command, *day)
    assert not (tmp_path / "none").exists()
    keys = ["--set", "aircraft.model=ultrastick25e", "--set", "seed=7", "--vary", "conditions=typical,ideal"]
    assert main([*words, *keys, "--out", str(tmp_path / "out")]) == 1
    certificate = json.loads((tmp_path / "out" / "certificate.json").read_text())
    assert (certificate["aircraft"], certificate["seed"]) == ("ultrastick25e", 7)
    assert certificate["conditions"] == "typical or ideal"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--probability", "1"], "probability"),
        (["--confidence", "0"], "confidence"),
        (["--claim", "safe"], "as-given"),
        (["--claim", "as-given"], "as-given is of a given path"),
        (["--vary", "planner.clearance_m"], "KEY=LO:HI"),
        (["--vary", "planner.clearance_m=9:1"], "least < most"),
        (["--vary", "no.such=0:1"], "no"),
        (["--vary", "seed=0:1"], "seed"),
        (["--vary", "obstacles.9.circle.radius_m=1:2"], "obstacles[9]: does not exist"),
        (["--vary", "environment.wind.speed_mps=3~9"], "command line: environment.wind.speed_mps: is -"),
        (["--vary", "sensor.rays=9:99", "--set", "sensor[rays]=9"], "is given a value too, 9; give one"),
        (["--vary", "environment.wind.speed_mps=0:8", "--wind", "3,90"], "environment.wind is given a"),
        (["--vary", "conditions=ideal,rough", "--conditions", "typical"], "conditions is given a value too"),
        (["--conditions", "rough"], "conditions: is rough, but a run's scenario says all of its one day"),
        (["--vary", "conditions=typical,rough"], "conditions: is varied, but a run's scenario says all"),
        (["--runs", "0"], "--runs"),
        (["--rare"], "needs a margin: --claim no-contact, trackable or as-given"),
        (["--rare", "--claim", "no-contact", "--runs", "519"], "needs at least --runs 520"),
        (["--rare", "--claim", "no-contact", "--set", "normals=[1]"], "normals"),
        (["--planner", "vfh_plus+shield+shield"], "must be one kind, then +shield"),
        (["--set", "uncertainty.mass=7"], "uncertainty.mass: is 7; must be"),
    ],
)
def test_bad_input_is_told_and_nothing_is_written(tmp_path: Path, words: list[str], told: str) -> None:
    (tmp_path / "scenario.yaml").write_text(CAMPAIGN_FILES["short.yaml"])
    (tmp_path / "manifest.json").touch()
    assert told in refused("certify", tmp_path / "scenario.yaml", *words, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()
