"""The table of public worlds in planner/MEASURED.md: `python -m tests.closed_loop.worlds_table [MOST [WIND]]`.

Each world with a way to the goal, and each without one, is flown by the Aerosonde, in calm air if nothing else is
said, and judged by the independent referee, which knows the true obstacles. Prints a row for each family, then what
the referee or the verdict found wrong, and exits with 1 where that is anything. MOST is how many worlds of a family
are flown, WIND the speed of a wind from 300 degrees, m/s. Beside the tail of the flights stands that of an exact point
robot with the same sensing range in the same worlds (`tests.closed_loop.point_robot`).
"""

import json
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any, Final

import numpy as np

from harness.run.scenario_flight import fly_to_folder
from tests.closed_loop.point_robot import over_the_optimum
from tests.closed_loop.tables import head, line
from wayproof import load_scenario

SHARED: Final = Path(__file__).parents[3] / "shared"
FAMILIES: Final[dict[str, tuple[str, ...]]] = {
    "like the paper's": ("paper_like",), "circles, few": ("circles_low",), "circles, more": ("circles_mid",),
    "circles, many": ("circles_high",), "polygons": ("polygon_field",), "U-shaped traps": ("u_trap",),
    "mazes of 5 x 5 cells, corridors of 18.5 km": ("maze5",),
    "mazes of 8 x 8 cells, corridors of 11 km": ("maze8",), "spirals": ("spiral",), "slots": ("slots",),
    "dead ends": ("dead_ends",), "forest": ("faster_forest",), "CTU": ("ctu_dubins",),
    "OMPL": ("ompl_circles",), "others": ("mrpb", "pythonrobotics", "zhm_rrt2d"),
    "without a way": ("enclosed_goal", "enclosed_start", "wall_across"), "BARN": ("barn",),
}  # fmt: skip
ENDS: Final = {"reach": "reached", "unreachable": "unreachable"}


def judged(world: Path, folder: Path, wind: str, *, point: bool = False) -> dict[str, Any]:
    """A world flown: its end, what referee and verdict find wrong, what the row needs; `point` takes a minute."""
    facts = json.loads(world.read_text())
    scenario, run = folder / f"{world.stem}.yaml", folder / world.stem
    convert = [sys.executable, str(SHARED / "tools" / "world_to_scenario.py"), str(world)]
    convert += ["--wind", wind, "300"] if wind else []
    scenario.write_text(subprocess.run(convert, capture_output=True, text=True, check=True).stdout)
    metrics = fly_to_folder(load_scenario(scenario), run, recording=False)
    faults = referee_faults(run)
    if metrics["outcome"] != ENDS.get(facts["expect"], metrics["outcome"]):
        faults.append(f"ended as {metrics['outcome']}, expected {facts['expect']}")
    if metrics["clearance_violation_s"] > 0:
        faults.append(f"{metrics['clearance_violation_s']} s below the wanted clearance")
    reached = metrics["outcome"] == "reached" and facts.get("optimum_m")
    return {
        "end": metrics["outcome"],
        "ratio": metrics["flown_length_m"] / facts["optimum_m"] if reached else None,
        "point": over_the_optimum(facts) if reached and point else None,
        "p50_ms": metrics["compute_ms"]["p50"],
        "p99_ms": metrics["compute_ms"]["p99"],
        "faults": [f"{world.stem}: {fault}" for fault in faults],
    }


def referee_faults(run: Path) -> list[str]:
    """What the independent referee, which knows the true obstacles, finds wrong with a run folder."""
    judge = [sys.executable, str(SHARED / "tools" / "referee.py"), str(run)]
    if (verdict := subprocess.run(judge, capture_output=True, text=True)).returncode == 0:
        return []
    return [f"{verdict.stdout.strip()[-300:]}{verdict.stderr.strip()[-300:]}"]


def worlds(folders: tuple[str, ...], most: int) -> list[Path]:
    every = sorted(path for name in folders for path in (SHARED / "worlds" / name).glob("*.json"))
    return every[:: max(1, len(every) // most)][:most]


def row(name: str, flown: list[dict[str, Any]]) -> str:
    ratios, point = (np.array([each[key] for each in flown if each["ratio"] is not None]) for key in ("ratio", "point"))
    length = ["-", "-", "-"]
    if len(ratios):
        # A point that is caught has no length: it is the longest.
        tails = [np.percentile(each, 95) for each in (ratios, point)]
        length = [f"{each:.2f}" for each in (np.median(ratios), *tails)]
    half, tail = np.median([each["p50_ms"] for each in flown]), max(each["p99_ms"] for each in flown)
    ends = ", ".join(f"{count} {end}" for end, count in Counter(each["end"] for each in flown).most_common())
    return line(name, f"{len(flown)}", *length, f"{half:.1f}", f"{tail:.0f}") + f" ({ends})"


def main(most: int, wind: str = "") -> int:
    wrong: list[str] = []
    titles = ("worlds", "number", "length over the optimum: median", "p95", "p95 of a point robot")
    print(*head(*titles, "planner p50: median, ms", "p99: largest, ms"), sep="\n")
    with tempfile.TemporaryDirectory() as folder:
        for name, folders in FAMILIES.items():
            flown = [judged(world, Path(folder), wind, point=True) for world in worlds(folders, most)]
            print(row(name, flown), flush=True)
            wrong += [fault for world in flown for fault in world["faults"]]
    print("\n".join(wrong) or "no fault")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000, *sys.argv[2:]))
