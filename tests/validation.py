"""Makes aircraft/VALIDATION.md and its figure: simulated flights beside flown ones. `python -m tests.validation FLOWN`.

FLOWN is the folder with thor75.parquet, thor75.json, proto09.parquet and proto09.json.
"""

import json
import math
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pyarrow.parquet as pq

from harness.flight.record import FloatArray
from harness.replays.flown import FlownFlight
from harness.replays.measures import rows_of
from harness.replays.replay import replay
from harness.replays.replay_figure import replay_figure
from harness.replays.wind import fit_wind
from harness.report.figure_style import svg
from tests.aircraft.check_cases import rows as check_case_rows

HERE = Path(__file__).parents[1] / "aircraft"
GRAVITY_MPS2 = 9.80665
TRIED = {
    "as above": (), "state not old": (("navigation.latency_s", "0"),),
    "state 0.12 s old": (("navigation.latency_s", "0.12"),),
    "roll of 60 deg/s at most, in 0.25 s": (
        ("aircraft.autopilot.roll_rate_limit_degps", "60"), ("aircraft.autopilot.roll_time_constant_s", "0.25")),
    "airspeed 18.1 m/s": (("aircraft.airspeed_mps", "18.1"),), "gain 1": (("guidance.gain", "1"),),
    "gain 3": (("guidance.gain", "3"),),
    "roll of 180 deg/s at most, in 0.1 s": (
        ("aircraft.autopilot.roll_rate_limit_degps", "180"), ("aircraft.autopilot.roll_time_constant_s", "0.1")),
    "height off by 2.1 m (1 sigma)": (("navigation.altitude_sigma_m", "2.1"),),
    "light turbulence": (("environment.turbulence", "{intensity: light}"),),
}  # fmt: skip
"""What the answer hangs on: name, and keys of the simulated flight."""


def main(flown: Path) -> None:
    found, thor, mission = {}, flown / "thor75.parquet", flown / "thor75.json"
    for name, keys in TRIED.items():
        with TemporaryDirectory() as folder:
            found[name] = replay(thor, "ultrastick25e", Path(folder), mission, keys, recording=False)
    told = found["as above"].results
    (HERE.parent / ".pictures" / "validation_thor.svg").write_bytes(svg(replay_figure(found["as above"])))
    between, wind = told["distance_between_m"], told["wind"]
    page = Path(__file__).with_name("validation_page.md").read_text("utf-8")
    text = page.format(
        latency=told["latency_s"],
        laps=" and ".join(map(str, told["settled_laps"])),
        table="\n".join(f"| {' | '.join(row)} |" for row in rows_of(told)),
        **between,
        speed=wind["speed_mps"],
        from_deg=wind["from_deg"],
        residual=wind["residual_mps"],
        tried="\n".join(_tried(name, each.results) for name, each in found.items()),
        count=len(told["settled_laps"]),
        fast=told["flown"]["airspeed_p95_mps"],
        high=told["flown"]["height_error_p95_m"],
        proto="\n".join(_proto(flown)),
        nasa="\n".join(check_case_rows()),
    )
    (HERE / "VALIDATION.md").write_text(text, encoding="utf-8")


def _tried(name: str, told: dict[str, Any]) -> str:
    figures = told["simulated"]
    cells = [figures["outside_p95_m"], figures["outside_max_mean_m"], figures["lap_mean_s"]]
    cells += [
        told["distance_between_m"]["p50"],
        figures["roll_rate_p95_degps"],
        figures["height_error_p95_m"],
    ]
    return f"| {name} | {' | '.join(f'{cell:.1f}' for cell in cells)} |"


def _proto(flown: Path) -> list[str]:
    facts = json.loads((flown / "proto09.json").read_text("utf-8"))
    table = pq.read_table(flown / "proto09.parquet")
    columns: dict[str, FloatArray] = {name: table[name].cast("float64").to_numpy() for name in table.column_names}
    rows, side_1pm = [], None
    for name, loiter in facts["loiters"].items():
        chosen = np.flatnonzero((columns["time_s"] >= loiter["from_s"]) & (columns["time_s"] <= loiter["to_s"]))
        turn = {each: values[chosen] for each, values in columns.items()}
        place = {each: turn[each] for each in ("time_s", "east_m", "north_m", "ve_mps", "vn_mps")}
        wind = fit_wind(FlownFlight(Path(name), place))
        east, north = turn["ve_mps"] - wind.east_mps, turn["vn_mps"] - wind.north_mps
        speed, course = float(np.hypot(east, north).mean()), np.unwrap(np.arctan2(east, north))
        rate = float(np.ptp(course)) / float(turn["time_s"][-1] - turn["time_s"][0])
        skid = np.sin(np.radians(turn["heading_deg"]) - course)
        banked = GRAVITY_MPS2 * float(np.tan(np.radians(turn["roll_deg"])).mean())
        skidding = speed**2 * float(skid.mean())
        if side_1pm is None:  # fitted on the first loiter alone
            side_1pm = (speed * rate - banked) / skidding
        radii = (speed / rate, speed**2 / banked, speed**2 / (banked + side_1pm * skidding))
        cells = (loiter["circle_fitted"]["radius_m"], *radii, math.degrees(math.asin(skid.mean())))
        assert math.isfinite(sum(cells))
        rows.append(f"| {name} | {' | '.join(f'{cell:.1f}' for cell in cells)} |")
    return rows


if __name__ == "__main__":
    main(Path(sys.argv[1]))
