"""The standing table of `planner/MEASURED.md` from campaigns: `python -m tests.closed_loop.standing_table FOLDER...`.

A row each planner and wind, in Markdown; then every planner in pairs with `rolling_window` in the same world and wind.
With `planner/MEASURED.md` behind it, the tables are put there. Only worlds that every planner has flown count, so that
a campaign which is still being flown compares like with like; of a flight in several folders the last one counts. The
campaign's page has the rest; `wayproof report FOLDER --format latex` and `csv` have its own table.
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd  # type: ignore[import-untyped]
from scipy import stats

from harness.campaign.cell import wilson
from harness.campaign.paired import mean_estimate
from tests.closed_loop.tables import fill, head, line, upper

WIND: Final = "environment.wind.speed_mps"
YARDSTICK: Final = "rolling_window"
HEAD: Final = (
    "planner", "wind, m/s", "flights", "reached [95 %]", "contacts (below, at 95 %)",
    "length over the optimum: median, p95", "over the shortest flown: median", "tightest turn planned, m",
    "trackable", "legs not tracked", "call, p50, p99, ms",
)  # fmt: skip


def load(folders: Sequence[Path]) -> pd.DataFrame:
    """Results and timings of campaigns, and each length over the shortest of all planners in its world and wind."""
    names = ("results.parquet", "timings.parquet")
    tables = ([pd.read_parquet(each / name) for name in names] for each in folders)
    rows = pd.concat([results.merge(timings, on="run") for results, timings in tables])
    rows["case"] = rows.world + rows[WIND].astype(str)
    order = list(rows.planner.unique())
    rows = rows.drop_duplicates(["case", "planner"], keep="last")
    rows = rows.sort_values("planner", key=lambda names: names.map(order.index), kind="stable")
    rows = rows[rows.case.map(rows.groupby("case").planner.nunique()) == rows.planner.nunique()].copy()
    rows["reached"] = rows.outcome == "reached"
    rows["contact"] = rows.outcome == "collision"
    best = rows[rows.reached].groupby("case").flown_length_m.min()
    rows["over_best"] = rows.flown_length_m / rows.case.map(best)
    return rows


def row(name: str, wind: float, of: pd.DataFrame) -> str:
    flights, reached, hits = len(of), of[of.reached], int(of.contact.sum())
    share = wilson(len(reached), flights)
    ratio = reached.length_ratio.dropna()
    length = f"{ratio.median():.3f}, {ratio.quantile(0.95):.2f}" if len(ratio) else "-"
    cells = (
        f"`{name}`",
        f"{wind:g}",
        f"{flights}",
        f"{len(reached)} [{100 * share.low:.0f}, {100 * share.high:.0f} %]",
        f"{hits} ({100 * upper(hits, flights):.0f} %)",
        length,
        f"{reached.over_best.median():.3f}" if len(reached) else "-",
        f"{1.0 / of['smoothness.planned.max_curvature_1pm'].max():.0f}",
        f"{int(of.trackable.fillna(False).sum())}",
        f"{of['trackability.not_trackable'].sum():.0f} of {of['trackability.legs'].sum():.0f}",
        f"{of['compute_ms.p50'].median():.1f}, {of['compute_ms.p99'].median():.1f}",
    )
    return line(*cells)


def pairs(rows: pd.DataFrame) -> list[str]:
    """Length over that of `rolling_window` where both reached the goal: geometric mean, interval, Wilcoxon and Holm."""
    ours = rows[(rows.planner == YARDSTICK) & rows.reached].set_index("case").flown_length_m
    found = []
    for name in rows.planner.unique():
        theirs = rows[(rows.planner == name) & rows.reached].set_index("case").flown_length_m
        if name != YARDSTICK and len(log := np.log((theirs / ours).dropna())) > 4:
            found.append((name, log, float(stats.wilcoxon(log).pvalue) if log.any() else 1.0))
    found.sort(key=lambda each: each[2])
    told, least = [], 0.0
    for place, (name, log, p) in enumerate(found):
        least = max(least, min(1.0, p * (len(found) - place)))
        mean = mean_estimate(log.to_numpy(), log.index.to_numpy())
        low, high = np.exp((mean.low or 0.0, mean.high or 0.0))
        ratio = f"{np.exp(log.mean()):.3f} [{low:.3f}, {high:.3f}]"
        told.append(line(f"`{name}`", f"{len(log)}", ratio, f"{least:.2g}"))
    return told


def tables(folders: Sequence[Path]) -> str:
    rows = load(folders)
    told = head(*HEAD)
    for name in rows.planner.unique():
        told += [row(name, wind, of) for wind, of in rows[rows.planner == name].groupby(WIND)]
    told += ["", *head("planner", "pairs", f"length over `{YARDSTICK}`, mean [95 %]", "p")]
    return "\n".join((*told, *pairs(rows)))


if __name__ == "__main__":
    pages = [Path(each) for each in sys.argv[1:] if each.endswith(".md")]
    text = tables([Path(each) for each in sys.argv[1:] if not each.endswith(".md")])
    print(text)
    for page in pages:
        fill("standing table", text, page)
