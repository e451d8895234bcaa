"""Shielded flights among trees and walls: `python -m tests.closed_loop.shield_table ROWS.csv FLIGHTS`.

Flight number n takes planner n modulo their count, and one world of 2.0 x 1.4 km for all planners of a round. Each row
goes into the CSV as it is flown; a second call goes on after the last. Contact and departure are judged by shapely from
the track and the true obstacles. Those that people use are flown bare in the same world too. Prints the table.
`ROWS.csv FLIGHTS 0 2` flies the first of two parts, for two processors; `ROWS0.csv ROWS1.csv` prints the table of both,
and `ROWS0.csv ROWS1.csv planner/MEASURED.md` puts it there.
"""

import math
import sys
import time
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd  # type: ignore[import-untyped]
from shapely import LineString, Point, Polygon, box

import wayproof
from harness.scenario.kinds import planner_kinds
from planner.shield.shield import Shield
from tests.closed_loop.hostile import HOSTILE
from tests.closed_loop.tables import fill, head, line, upper
from wayproof import Mission, Plan, Planner, PlanRequest

KINDS: Final = ("improved_bug", "tangent_bug", "bug2", "bug1", "vfh_plus", "bendy_ruler", "mppi")
OWN: Final = "rolling_window"
"""It has the shield built in."""
TOLD: Final = {
    "Straight": "straight at the goal", "Anywhere": "corners at random", "Outwards": "out of the area",
    "Raising": "raises after 20 s", "NotANumber": "NaN after 20 s", "Kinked": "zigzag of right angles",
    "Teleporting": "begins 3 km away",
}  # fmt: skip
"""What the hostile planners do."""
PLANNERS: Final = (OWN, *KINDS, *(each.__name__ for each in HOSTILE))
PAIRED: Final = (*KINDS, "Straight", "Anywhere")
AREA: Final = (0.0, 0.0, 2000.0, 1400.0)
START, GOAL = (200.0, 700.0), (1800.0, 700.0)
CLEARANCE_M: Final = 30.0


class Timed:
    """An inner planner whose processor time is added up."""

    spent_s = 0.0

    def __init__(self, inner: Planner) -> None:
        self.inner = inner

    def plan(self, request: PlanRequest) -> Plan:
        began = time.thread_time()
        try:
            return self.inner.plan(request)
        finally:
            Timed.spent_s += time.thread_time() - began


def obstacles(number: int) -> list[Polygon]:
    """Trees, and in every third world a wall or a U that opens to the start, none within 230 m of the start."""
    rng = np.random.default_rng(number)
    made: list[Polygon] = []
    if number % 3 == 0:
        east, half, arm = rng.uniform(700.0, 1300.0), rng.uniform(100.0, 350.0), rng.choice([0.0, 250.0])
        north = 700.0 + rng.uniform(-200.0, 200.0)
        walls = [box(east, north - half, east + 20.0, north + half)]
        walls += [box(east - arm, n, east, n + 20.0) for n in (north - half, north + half - 20.0) if arm]
        made += walls
    while len(made) < 3 + number % 10:
        tree = Point(rng.uniform(0.0, 2000.0), rng.uniform(0.0, 1400.0)).buffer(rng.uniform(8.0, 70.0))
        if tree.distance(Point(START)) > 230.0 and tree.distance(Point(GOAL)) > 100.0:
            made.append(tree)
    return made


def flown(name: str, number: int, shield: str, limit_s: float = 130.0) -> dict[str, Any]:
    shapes = obstacles(number)
    mission = {
        "start_m": list(START),
        "goal_m": list(GOAL),
        "course_deg": (90.0 + float(np.random.default_rng(number + 10_000).uniform(-60.0, 60.0))) % 360.0,
        "goal_radius_m": 60,
    }
    keys = {
        "area.bounds_m": list(AREA),
        "obstacles": [{"polygon": {"vertices_m": [list(p) for p in s.exterior.coords[:-1]]}} for s in shapes],
        "mission": mission | {"time_limit_s": limit_s},
        "planner": {"kind": OWN if name == OWN else "vfh_plus", "clearance_m": CLEARANCE_M, "shield": shield},
        "sensor": {"range_m": 600},
    }
    base = wayproof.load_scenario("aerosonde_forest").with_(keys)
    hostile = {each.__name__: each for each in HOSTILE}

    def make(mission: Mission) -> Planner:
        if name in hostile:
            return Timed(hostile[name](mission))
        kind = planner_kinds()[name]
        return Timed(kind.make(kind.config().resolved(mission), mission))

    own_ms: list[float] = []
    plain = Shield.plan

    def timed(self: Shield, request: PlanRequest) -> Plan:
        Timed.spent_s, began = 0.0, time.thread_time()
        try:
            return plain(self, request)
        finally:
            own_ms.append(1e3 * (time.thread_time() - began - Timed.spent_s))

    Shield.plan = timed  # type: ignore[method-assign]
    try:
        run = wayproof.fly(base, planner=None if name == OWN else make)
    finally:
        Shield.plan = plain  # type: ignore[method-assign]
    line = LineString(run.track.to_pandas()[["east_m", "north_m"]].to_numpy())
    away = min(line.distance(each) for each in shapes)
    figures = run.metrics.shield
    return {
        "planner": name, "world": number, "shield": shield, "outcome": run.outcome,
        "contact": int(away <= 0.0 or run.outcome == "collision"), "departed": int(not box(*AREA).covers(line)),
        "away_m": round(away, 3), "length_m": round(run.metrics.flown_length_m, 2), "calls": len(own_ms),
        "own_p50_ms": round(float(np.percentile(own_ms, 50)), 3) if own_ms else math.nan,
        "own_p99_ms": round(float(np.percentile(own_ms, 99)), 3) if own_ms else math.nan,
        "refused": figures.refused_plans if figures else 0,
        "interventions": figures.interventions if figures else 0,
        "backup_s": figures.time_on_backup_s if figures else 0.0,
        "plans": len(run.plans.to_pandas()), "reason": run.reason,
    }  # fmt: skip


def table(rows: pd.DataFrame) -> str:
    told = head(
        "planner", "flights", "reached", "of those without a wall", "contacts, departures", "bare: contacts",
        "length over bare: median, p95 (n)", "refused, share of calls", "on the backup, s a flight",
        "shield alone, p50, p99 of the median flight, ms",
    )  # fmt: skip
    safe, bare = rows[rows.shield == "loiter"], rows[rows.shield == "none"]
    for name in PLANNERS:
        mine = safe[safe.planner == name]
        pair = mine.merge(bare[bare.planner == name], on="world", suffixes=("", "_bare"))
        pair = pair[(pair.outcome == "reached") & (pair.outcome_bare == "reached")]
        over = pair.length_m / pair.length_m_bare
        ratio = f"{over.median():.3f}, {over.quantile(0.95):.2f} ({len(pair)})" if len(pair) else "-"
        flown_bare = bare[bare.planner == name]
        bare_hits = f"{flown_bare.contact.sum()} of {len(flown_bare)}" if len(flown_bare) else "-"
        refused = f"{100 * mine.refused.sum() / mine.calls.sum():.1f} %" if mine.calls.sum() else "-"
        open_ = mine[mine.world % 3 != 0]
        own = f"{mine.own_p50_ms.median():.1f}, {mine.own_p99_ms.median():.1f}" if mine.calls.sum() else "-"
        told.append(line(
            TOLD.get(name, f"`{name}`"), f"{len(mine)}", f"{(mine.outcome == 'reached').sum()}",
            f"{(open_.outcome == 'reached').sum()} of {len(open_)}", f"{mine.contact.sum()}, {mine.departed.sum()}",
            bare_hits, ratio, refused, f"{mine.backup_s.mean():.1f}", own,
        ))  # fmt: skip
    told += ["", f"least distance: {safe.away_m.min():.1f} m"]
    for what in ("contact", "departed"):
        hits, flights = int(safe[what].sum()), len(safe)
        bound = f"below {100 * upper(hits, flights):.2f} % at 95 %"
        told += [f"{what}: {hits} of {flights}, {bound}; bare {bare[what].sum()} of {len(bare)}"]
    return "\n".join(told)


def main(file: Path, flights: int, part: int = 0, parts: int = 1) -> None:
    """Flies on from what a file has already, and prints the table of all."""
    done = len(pd.read_csv(file).query("shield == 'loiter'")) if file.exists() else 0
    for n in range(part, flights, parts)[done:]:
        name, number = PLANNERS[n % len(PLANNERS)], n // len(PLANNERS)
        for shield in ("none", "loiter") if name in PAIRED else ("loiter",):
            row = flown(name, number, shield)
            pd.DataFrame([row]).to_csv(file, mode="a", header=not file.exists(), index=False)
    print(table(pd.read_csv(file)))


if __name__ == "__main__":
    if (given := sys.argv[1:])[-1].endswith((".csv", ".md")):
        text = table(pd.concat([pd.read_csv(each) for each in given if each.endswith(".csv")]))
        print(text)
        if given[-1].endswith(".md"):
            fill("shield", text.partition("\n\n")[0], Path(given[-1]))
    else:
        main(Path(given[0]), *map(int, given[1:]))
