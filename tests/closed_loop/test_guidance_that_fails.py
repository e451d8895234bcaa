"""A guidance law that raises, or asks for what is no number, ends the flight with a sentence and a whole run folder."""

import json
import math
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import shapely

from harness.run.scenario_flight import fly_to_folder, make_loop
from tests.scenarios import scenario_of
from wayproof import AircraftState, GuidanceOutput, Route

TEXT = """\
schema: wayproof/scenario/1
name: short
area: {bounds_m: [0, 0, 10000, 10000]}
mission: {start_m: [1000, 1000], goal_m: [1000, 3000]}
sensor: {range_m: 2000, rays: 90}
"""


class Broken:
    """Flies straight on until it breaks."""

    def __init__(self, follows: bool = True, then: Any = None, after: int = 30, holds: bool = True) -> None:
        self._follows, self._holds, self._then, self._after, self._updates = follows, holds, then, after, 0

    def follow(self, route: Route, arc_length_m: float = 0.0) -> None:
        if not self._follows:
            raise ZeroDivisionError("no route for me")

    def hold_airspeed(self, airspeed_mps: float) -> None:
        if not self._holds and self._updates >= self._after:
            raise ZeroDivisionError("no airspeed for me")

    def update(self, state: AircraftState) -> GuidanceOutput:
        self._updates += 1
        output = GuidanceOutput(0.0, 0.0, 25.0 * state.time_s, False, False)
        if self._updates == self._after and self._then is None:
            sys.exit("enough")
        return output if self._updates < self._after else self._then


FINE = GuidanceOutput(0.0, 0.0, 0.0, False, False)


@pytest.mark.parametrize("after", [1, 30])
@pytest.mark.parametrize(
    ("law", "said"),
    [
        ({"follows": False},
            "the guidance law raised ZeroDivisionError: no route for me when it was given a plan"),
        ({"then": FINE._replace(roll_command_rad=math.nan)}, "asked for a roll of nan rad"),
        ({"then": FINE._replace(roll_command_rad=math.inf)}, "asked for a roll of inf rad"),
        ({"then": FINE._replace(airspeed_mps=math.inf)}, "an airspeed of inf m/s"),
        ({"then": FINE._replace(cross_track_m=math.nan)}, "nan m beside its route"),
        ({"then": "left"}, "raised TypeError: update(state) gave 'left'; must give a GuidanceOutput"),
        ({"then": SimpleNamespace(**FINE._asdict())}, "gave namespace(roll_command_rad=0.0"),
        ({"holds": False, "then": FINE}, "the guidance law raised ZeroDivisionError: no airspeed for me"),
        ({"then": None}, "the guidance law raised SystemExit: enough"),
    ],
)  # fmt: skip
def test_ends_as_lost_control(law: dict[str, Any], after: int, said: str, tmp_path: Path) -> None:
    figures = fly_to_folder(
        scenario_of(TEXT),
        tmp_path / "run",
        recording=True,
        make=lambda scenario: replace(make_loop(scenario), guidance=Broken(**law, after=after)),
    )
    assert figures["outcome"] == "lost_control"
    assert said in figures["reason"]
    assert json.loads((tmp_path / "run" / "manifest.json").read_text())["complete"] is True
    assert (tmp_path / "run" / "track.parquet").exists()


def test_a_law_that_says_it_is_on_its_route_is_measured_beside_it(tmp_path: Path) -> None:
    """It flies straight on at 20 degrees, where each plan turns north to the goal."""
    far = FINE._replace(arc_length_m=9e5)
    figures = fly_to_folder(
        scenario_of(TEXT.replace("goal_m:", "course_deg: 20, goal_m:")),
        tmp_path / "run",
        recording=False,
        make=lambda scenario: replace(make_loop(scenario), guidance=Broken(after=1, then=far)),
    )
    (segments, *_) = pq.read_table(tmp_path / "run" / "plans.parquet").column("segments").to_pylist()
    line: list[tuple[float, float]] = []
    for x, y, tx, ty, curvature_1pm, length_m in segments:
        for s in np.arange(0.0, length_m, 0.5):
            ahead, left = s, 0.0
            if curvature_1pm:
                angle = curvature_1pm * s
                ahead, left = math.sin(angle) / curvature_1pm, (1.0 - math.cos(angle)) / curvature_1pm
            line.append((x + ahead * tx - left * ty, y + ahead * ty + left * tx))
    track = pq.read_table(tmp_path / "run" / "track.parquet").to_pylist()
    rows = [row for row in track if row["plan_index"] == 0]
    off_m = [shapely.Point(row["east_m"], row["north_m"]).distance(shapely.LineString(line)) for row in rows]
    assert max(off_m) > 1.0
    assert max(row["arc_length_m"] for row in rows) < 2000.0
    assert [abs(row["cross_track_m"]) for row in rows] == pytest.approx(off_m, abs=0.05)
    assert figures["cross_track_m"]["max"] >= max(off_m) - 0.05
