"""Checking a path from Python."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

import wayproof
from tests.harness.api.worlds import small

LINE = [(300.0, 1000.0), (900.0, 1000.0)]


def test_points_are_checked_and_nothing_is_left_behind() -> None:
    few: dict[str, Any] = {
        "corner_m": np.float64(50.0),
        "wind": np.array((0.0, 270.0)),
        "settings": {"seed": np.int64(3), "guidance.kind": np.str_("l1"), "obstacles": np.array(())},
    }
    run = wayproof.check(np.array([LINE[0], (299.0, 1001.0), LINE[1]]), **few)  # a second click at its start
    assert run.metrics.check is not None
    assert run.metrics.check.ok
    assert repr(run) == "FlightResult(path: reached; path as given, aerosonde, seed 3)"
    assert run.metrics.deviation_from_given_m is not None
    assert run.track.num_rows > 200


def test_a_path_through_an_obstacle_of_a_scenario_is_told(tmp_path: Path) -> None:
    run = wayproof.check([(300.0, 1700.0), (1800.0, 1700.0)], scenario=small(), out=tmp_path / "run")
    assert run.metrics.check is not None
    assert (run.metrics.check.ok, run.metrics.contact) == (False, True)
    assert run.manifest["command"][0].startswith("wayproof.check('points', 'aerosonde')")
    read = wayproof.load_run(tmp_path / "run")
    assert (read.digest, read.metrics, read.scenario) == (run.digest, run.metrics, run.scenario)


def test_an_altitude_among_the_settings_is_that_of_the_flight_and_not_of_the_obstacles_alone() -> None:
    run = wayproof.check([(*place, 300.0) for place in LINE], settings={"mission.altitude_m": "450"})
    assert np.asarray(run.track["up_m"]) == pytest.approx(450.0, abs=0.1)


def test_columns_of_a_table_count_by_their_names() -> None:
    named = pa.table({"time_s": [9, 40], "north_m": [1000, 1000], "east_m": [300, 900]})
    assert wayproof.check(named).digest == wayproof.check(LINE).digest
    run = wayproof.check(pa.table({"lat": [47.0, 47.02], "lon": [8.0, 8.0], "altitude_m": [700, 700]}))
    assert (run.metrics.planned_length_m, run.track["up_m"][0].as_py()) == pytest.approx((2223.42, 700.0), abs=0.1)


def test_what_cannot_be_checked_is_refused(tmp_path: Path) -> None:
    degrees = tmp_path / "degrees.csv"
    degrees.write_text("latitude_deg,longitude_deg\n47,8\n47,8.01\n")
    twice = {"airspeed_mps": 25.0, "settings": {"aircraft": {"airspeed_mps": 20.0}}}
    refused: list[tuple[Any, dict[str, Any], str]] = [
        (__file__, {}, "is none of"),
        (degrees, {"settings": {"area.origin.latitude_deg": "47.01"}}, r"area\.origin: is not that of the path"),
        ([(0.0, 0.0)], {}, "has the shape"),
        (np.ma.masked_greater(np.array(LINE), 899.0), {}, "holds a number that is not finite"),
        (pa.table({"x": [0, 600], "y": [0, 0]}), {}, "path:1: has the columns x, y; must have x_m,y_m"),
        (LINE, {"corner_m": -3.0}, "is -3; must be at least 0"),
        (LINE, twice, "aircraft: is given in settings and as an argument"),
        (LINE, {"wind": (5.0, 0.0, 0.0)}, r"environment\.wind: is a list of 3; must be a mapping"),
        (LINE, {"scenario": "no_such"}, "no such file"),
        ([(*place, 9000.0) for place in LINE], {}, r"^the path: mission\.altitude_m: is 9000; must be"),
    ]
    for path, options, told in refused:
        with pytest.raises(wayproof.InputError, match=told):
            wayproof.check(path, **options)


def test_of_a_scenario_object_only_the_keys_that_it_was_given_count() -> None:
    day = small().with_({"conditions": "typical"})
    run = wayproof.check(LINE, scenario=day, settings={"conditions": "ideal", "planner.clearance_m": 50})
    assert run.metrics.trackability[0].threshold_m == pytest.approx(0.1 * 50)
    ground, air = (np.asarray(run.track[name]) for name in ("groundspeed_mps", "airspeed_mps"))
    assert ground == pytest.approx(air, abs=1e-3)
