"""Subset simulation: planted systems of known failure probability, and the days of a path by `certify --rare`."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy import stats

import harness.certification.days
import harness.certification.rare
import wayproof
from harness.certification.rare import Evaluate, subset_simulation
from harness.cli.app import main

ALONG = np.array([0.1, -0.7, 0.5, 0.5])
SHARE_OF_SEED = {"one direction": 0.0, "seed in part": 0.3, "seed alone": 1.0}
SYSTEMS = ("two directions", "all directions", *SHARE_OF_SEED)


def planted(system: str, p: float) -> Evaluate:
    """Margins of days that fail with this probability: scipy's distributions give the place of failure."""
    away, both_sides, far = stats.norm.isf(p), stats.norm.isf(p / 2), stats.chi(4).isf(p)
    if system == "two directions":
        return lambda x, _: both_sides - np.abs(x @ ALONG)
    if system == "all directions":
        return lambda x, _: far - np.linalg.norm(x, axis=1)
    own, noise = math.sqrt(1.0 - SHARE_OF_SEED[system]), math.sqrt(SHARE_OF_SEED[system])
    return lambda x, seeds: away - own * (x @ ALONG) - noise * stats.norm.ppf((seeds + 0.5) / 2.0**53)


@pytest.mark.parametrize(
    ("p", "most", "times"),
    [(5e-3, 3000, 60), *(pytest.param(10.0**-n, 10_000, 400, marks=pytest.mark.slow) for n in (1, 2, 3, 4))],
)
@pytest.mark.parametrize("system", SYSTEMS)
def test_estimates_are_unbiased_their_bounds_cover_and_rare_failures_need_fewer_days(
    system: str, p: float, most: int, times: int
) -> None:
    margins, counts = planted(system, p), [0]

    def counted(normals: Any, seeds: Any) -> Any:
        counts[0] += len(seeds)
        return margins(normals, seeds)

    found = [subset_simulation(counted, 4, most, seed, 0.95) for seed in range(times)]
    estimates = np.array([each.failure_probability for each in found])
    assert counts[0] <= most * times
    assert abs(estimates.mean() - p) < 4.0 * estimates.std() / math.sqrt(times)
    # 0.86 is 0.95 less three standard errors of 60.
    assert np.mean([each.failure_lower <= p for each in found]) >= 0.86
    assert np.mean([each.failure_upper >= p for each in found]) >= (0.86 if times < 400 else 0.93)
    if p == 1e-4 and system == "one direction":  # against what plain sampling takes for that standard error
        assert p * (1.0 - p) / estimates.var() >= 20.0 * counts[0] / times


def test_where_no_day_fails_the_bound_is_that_of_counting_and_says_how_near_it_came() -> None:
    found = subset_simulation(lambda x, _: 1.0 + np.exp(x[:, 0]), 4, 3000, 1, 0.95)
    assert (found.failure_probability, found.failure_lower) == (0.0, 0.0)
    assert found.failure_upper == pytest.approx(1.0 - 0.05 ** (1.0 / found.plain_runs), rel=1e-9)
    assert 1.0 < found.levels[-1] < found.levels[0] < 2.0
    none = subset_simulation(lambda x, _: np.full(len(x), np.inf), 4, 3000, 1, 0.95)
    assert none.levels == ()
    assert none.method.endswith(": the pilot found no levels")


@pytest.mark.parametrize("seed", range(4))
def test_few_days_do_for_levels_and_no_more_are_flown_than_allowed(seed: int) -> None:
    margins, counts, most = planted("one direction", 1e-6), [0], harness.certification.days.LEAST_RARE_DAYS

    def counted(normals: Any, seeds: Any) -> Any:
        counts[0] += len(seeds)
        return margins(normals, seeds)

    assert len(subset_simulation(counted, 4, most, seed, 0.95).levels) >= 2
    assert counts[0] <= most


@pytest.mark.flights
def test_days_of_a_path_are_the_same_for_any_number_of_workers_and_after_an_interruption(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(harness.certification.days, "LEAST_RARE_DAYS", 100)
    monkeypatch.setattr(harness.certification.rare, "PILOT_LEAST", 20)
    monkeypatch.setattr(harness.certification.rare, "PILOT_MOST", 0.3)
    (tmp_path / "path.csv").write_text("east_m,north_m\n0,0\n300,0\n")
    words = ["certify", str(tmp_path / "path.csv"), "--aircraft", "aerosonde", "--conditions", "typical"]
    words += ["--rare", "--set", "trackability.cross_track_m=3.0", "--set", "trackability.altitude_m=30"]
    words += ["--vary", "environment.wind.from_deg=0:360", "--runs", "220", "--probability", "0.5"]

    def certify(name: str, *more: str) -> dict[str, Any]:
        assert main([*words, *more, "--out", str(tmp_path / name)]) == 0
        return {**json.loads((tmp_path / name / "certificate.json").read_text()), "command": ""}

    one = certify("one", "--workers", "2")
    (tmp_path / "two").mkdir()
    for name in ("campaign.json", "journal.jsonl"):
        lines = (tmp_path / "one" / name).read_bytes().splitlines(keepends=True)
        (tmp_path / "two" / name).write_bytes(b"".join(lines[: 60 if "journal" in name else None]))
    assert certify("two", "--workers", "1", "--resume") == one
    assert len(one["rare"]["levels"]) >= 2
    results = [tmp_path / name / "results.parquet" for name in ("one", "two")]
    assert results[0].read_bytes() == results[1].read_bytes()
    rows = pq.read_table(results[0]).to_pylist()
    assert len({(row["seed"], row["environment.wind.from_deg"]) for row in rows}) == len(rows) == one["runs"]
    for row in (json.loads(line)["row"] for line in lines):
        used = (row["deviation_from_given_m.max"] / 3.0, row["altitude_error_m.max"] / 30.0)
        assert row["margin"] == pytest.approx(max(1.0 - max(used), 0.0), abs=1e-8)
    kept = one["failing_runs"][0]
    assert wayproof.load_run(tmp_path / "one" / "runs" / str(kept)).digest == rows[kept]["digest"]
    for again in (["fly", "--from", str(results[0]), "--run", "0"], ["report", str(tmp_path / "one")]):
        assert main(again) == 2
