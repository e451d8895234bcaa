"""The answers of a campaign, on tables whose answers are known."""

import csv
import itertools
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from harness.analysis.causes import FINDINGS
from harness.campaign.cell import BINS, NOT_SET, Cell, Share, grouped, wilson
from harness.campaign.paired import duels, mean_estimate
from harness.campaign.results import sealed
from harness.campaign.summary import PAGE, Summary, summarise, write_summary
from harness.cli.app import main
from harness.cli.sweep import print_summary
from harness.files.wording import printable
from tests.examples import examples
from tests.page import assert_shown
from tests.refusals import refused
from wayproof import InputError, load_campaign

SCHEMA = pa.schema(
    [(name, pa.int64()) for name in ("run", "case", "seed")]
    + [(name, pa.string()) for name in ("scenario", "world", "planner", "aircraft")]
    + [("environment.wind.speed_mps", pa.float64()), ("sensor.rays", pa.int64())]
    + [(name, pa.string()) for name in ("outcome", "reason", "error")]
    + [(name, pa.float64()) for name in ("flown_length_m", "min_clearance_m", "clearance_violation_s")]
    + [("cross_track_m.p95", pa.float64()), ("cross_track_m.max", pa.float64())]
    + [("trackability.legs", pa.int64()), ("trackable", pa.bool_())]
    + [("optimum_m", pa.float64()), ("length_ratio", pa.float64()), ("wanted_clearance_m", pa.float64())]
    + [("max_load_factor", pa.float64()), ("trackability.causes", pa.string())]
    + [("bank_saturation_fraction", pa.float64()), ("plan_delay_s.max", pa.float64())]
    + [("navigation_error_m.max", pa.float64()), ("navigation_margin_m", pa.float64())]
    + [("navigation_jump_m", pa.float64()), ("check.ok", pa.bool_()), ("check.verdict", pa.string())]
)
WIND = "environment.wind.speed_mps"


def row(run: int, outcome: str = "reached", /, **other: Any) -> dict[str, Any]:
    """A run of 1.1 times an optimum of 1 km, 100 m from the nearest obstacle where 50 m were wanted."""
    flown = outcome != "error"
    return {
        "run": run, "case": run, "seed": 1000 + run, "scenario": "base", "world": "forest",
        "planner": "rolling_window", "aircraft": "aerosonde", "outcome": outcome,
        "reason": f"reason of run {run}", WIND: 5.0, "sensor.rays": 720,
        "error": None if flown else "Traceback: <b>boom</b>", "flown_length_m": 1100.0 if flown else None,
        "min_clearance_m": 100.0 if flown else None, "clearance_violation_s": 0.0 if flown else None,
        "cross_track_m.p95": 0.1 if flown else None, "trackability.legs": 3 if flown else None,
        "trackable": True if flown else None, "optimum_m": 1000.0,
        "length_ratio": 1.1 if outcome == "reached" else None, "wanted_clearance_m": 50.0,
    } | other  # fmt: skip


def campaign(folder: Path, rows: Sequence[Mapping[str, Any]], times: Sequence[tuple[float, float, float]] = ()) -> Path:
    folder.mkdir(exist_ok=True)
    names = [name for name in SCHEMA.names if not rows or name in rows[0]]
    schema = pa.schema([SCHEMA.field(name) for name in names])
    given = {"set": {"conditions": "rough"}, "random": {WIND: {}}}
    about = {"campaign": given, "scenarios": [], "runs": len(rows)}
    pq.write_table(sealed(pa.Table.from_pylist(list(rows), schema), about), folder / "results.parquet")
    if times:
        columns = {
            f"compute_ms.{name}": values
            for name, values in zip(("p50", "p99", "max"), zip(*times, strict=True), strict=True)
        }
        table = pa.table({"run": [each["run"] for each in rows], **columns})
        pq.write_table(sealed(table, about), folder / "timings.parquet")
    return folder


def by_two(folder: Path) -> Path:
    """Two planners on 12 cases; one flies 10 % further and fails in two cases in strong wind."""
    rows = []
    for case in range(12):
        wind = float(case)
        rows.append(row(2 * case, case=case, **{WIND: wind}))
        lost = "collision" if case in (10, 11) else "reached"
        other = row(2 * case + 1, lost, case=case, planner="bug2", **{WIND: wind})
        other |= {"flown_length_m": 1210.0, "length_ratio": 1.21 if lost == "reached" else None}
        rows.append(other | ({"min_clearance_m": -2.5} if lost == "collision" else {}))
    return campaign(folder, rows, [(1.0, 4.0, 9.0)] * 23 + [(2.0, 8.0, 30.0)])


@pytest.mark.parametrize("digits", [(0, 1), (1, 1), (19, 20), (532, 600)])
def test_a_share_has_wilsons_interval(digits: tuple[int, int]) -> None:
    successes, trials = digits
    z, share = 1.959963984540054, successes / trials
    middle = (share + z * z / (2 * trials)) / (1 + z * z / trials)
    half = z / (1 + z * z / trials) * math.sqrt(share * (1 - share) / trials + z * z / (4 * trials**2))
    found = wilson(successes, trials)
    limits = (share, middle - half, middle + half)
    assert (found.value, found.low, found.high) == pytest.approx(limits, abs=1e-12)


def test_a_cell_holds_the_figures_of_its_runs(tmp_path: Path) -> None:
    ratios = (1.0, 1.1, 1.3)
    rows = [row(run, length_ratio=ratio) for run, ratio in enumerate(ratios)]
    rows.append(row(3, "collision", min_clearance_m=-1.0, clearance_violation_s=4.0, trackable=False))
    rows.append(row(4, "error"))
    total = load_campaign(
        campaign(tmp_path, rows, [(1, 5, 9), (2, 6, 8), (3, 4, 7), (4, 4, 4), (9, 9, 9)])
    ).summary.total
    assert total == Cell(
        runs=5, reached=3, success=wilson(3, 5), length_median=1.1,
        length_p95=float(np.percentile(ratios, 95)), least_clearance_m=-1.0, below_wanted=wilson(1, 4),
        trackable=wilson(3, 4), planner_p99_ms=9.0, planner_max_ms=9.0,
    )  # fmt: skip


def test_nearly_all_is_not_all_and_none_of_a_few_is_not_never() -> None:
    """One failure in thousands of runs is what a campaign is flown for; none of 24 may still be one in seven."""
    told = [str(Share(share, share, share)) for share in (1.0, 4999 / 5000, 0.9951, 0.5, 1 / 5000, 0.0)]
    wanted = ("100", "99.98", "99.5", "50", "0.02", "0")
    assert told == [f"{each} ({each}\N{EN DASH}{each})" for each in wanted]
    z2 = 1.959963984540054**2
    for runs, decimals in ((24, 0), (1000, 1), (10_000, 2), (1_000_000, 4)):
        most = 100 * z2 / (runs + z2)
        assert str(wilson(0, runs)) == f"0 (0\N{EN DASH}{most:.{decimals}f})"
        assert str(wilson(runs, runs)) == f"100 ({100 - most:.{decimals}f}\N{EN DASH}100)"


def test_tables_by_two_keys_split_the_runs(tmp_path: Path) -> None:
    two, one = summarise(by_two(tmp_path / "c"), by=[("planner", WIND), ("sensor.rays",)]).tables
    assert (two.rows.labels, one.rows.labels, one.columns) == (("rolling_window", "bug2"), ("720",), None)
    assert two.columns is not None
    assert two.columns.edges == tuple(np.quantile(np.arange(12.0), np.linspace(0, 1, BINS + 1)).tolist())
    assert [[cell.reached for cell in cells] for cells in two.cells] == [[3, 3, 3, 3], [3, 3, 3, 1]]
    assert two.cells[1][3].least_clearance_m == -2.5
    assert (one.cells[0][0].runs, one.cells[0][0].reached) == (24, 22)
    assert two.cells[1][3].planner_max_ms == 30.0
    by_default = load_campaign(tmp_path / "c").summary
    assert by_default.varied == ("planner", WIND, "sensor.rays")
    keys = [(table.rows.key, table.columns and table.columns.key) for table in by_default.tables]
    assert keys == [("planner", WIND), ("planner", "sensor.rays"), (WIND, "sensor.rays")]


def test_planners_are_compared_in_pairs(tmp_path: Path) -> None:
    (duel,) = load_campaign(by_two(tmp_path / "c")).summary.duels
    assert (duel.first, duel.second, duel.pairs) == ("rolling_window", "bug2", 12)
    assert (duel.only_first, duel.only_second, duel.both_reached) == (2, 0, 10)
    figures = {each.figure: each for each in duel.figures}
    success = figures["goals reached, %"]
    assert (success.pairs, success.first) == (12, 100.0)
    assert success.second == pytest.approx(100 * 10 / 12)
    assert success.difference.value == pytest.approx(100 * 2 / 12)
    assert success.difference.low is not None
    assert success.difference.high is not None
    assert 0.0 <= success.difference.low < 100 * 2 / 12 < success.difference.high <= 50.0
    length = figures["ratio to the clairvoyant optimum"]
    assert length.pairs == 10
    assert length.difference.value == pytest.approx(1.1 - 1.21)
    assert length.difference.low is None, "every pair has the same difference: there is nothing to resample"
    assert "planner time p99, ms" in figures


@pytest.mark.parametrize(("n", "step"), [(20, 2**-20), (12, 2**-2)], ids=["many", "few, with ties"])
def test_each_figure_has_wilcoxons_test_corrected_by_holm(n: int, step: float) -> None:
    rng = np.random.default_rng(2)
    ours, theirs = {}, {}
    for name, shift in (("ratio", 0.3), ("min_clearance_m", 0.2), ("bank_reversals_per_min", 0.0)):
        ours[name], theirs[name] = (step * rng.normal(m / step, 0.3 / step, n).round() for m in (shift, 0.0))
    figures = {name: np.concatenate((ours[name], theirs[name])) for name in ours}
    planners, cases = ["a"] * n + ["b"] * n, [(case, "") for case in range(n)] * 2
    (duel,) = duels(planners, cases, [True] * 2 * n, figures)
    raw = sorted((float(stats.wilcoxon(ours[name] - theirs[name]).pvalue), name) for name in figures)
    expected = list(itertools.accumulate((min(1.0, (3 - rank) * p) for rank, (p, _) in enumerate(raw)), max))
    assert sorted(each.p for each in duel.figures if each.p is not None) == pytest.approx(expected)
    assert 0.0 < expected[0] < 0.06 < expected[2]
    assert duel.figures[0].p is None, "all reached: there is nothing to test"


def test_figures_that_are_compared_are_in_the_units_of_their_names() -> None:
    figures = {"trackable": np.array([1.0, 1.0, 0.0, 0.0]), "bank_saturation_fraction": np.array([0.2, 0.1, 0.3, 0.3])}
    (duel,) = duels(["a", "a", "b", "b"], [(1, ""), (2, "")] * 2, [True] * 4, figures)
    told = {each.figure: (each.first, each.second, each.difference.value) for each in duel.figures[1:]}
    assert told == {
        "trackable, %": (100.0, 0.0, 100.0),
        "time at the bank limit, %": pytest.approx((15.0, 30.0, -15.0)),
    }


@pytest.mark.parametrize(("cases", "tells"), [(1, False), (3, False), (5, False), (6, True)])
def test_planners_on_too_few_cases_are_not_said_to_be_alike(
    cases: int, tells: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One figure differs, always one way: of n cases the most extreme sign pattern has the probability 2 / 2^n."""
    rows = [
        row(2 * case + of, planner=name, case=case, min_clearance_m=80.0 + 40 * of + case)
        for case in range(cases)
        for of, name in enumerate(("rolling_window", "bug2"))
    ]
    folder = campaign(tmp_path / "c", rows)
    assert main(["report", str(folder)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    expected = "differ at 5 %: least clearance" if tells else f"too few cases ({cases}) to tell"
    assert (expected in told, 2 / 2**cases < 0.05) == (True, tells)
    assert ("too few for any p" in (folder / "summary.html").read_text()) is not tells


def test_scenarios_are_told_apart_where_each_is_flown_in_every_world(tmp_path: Path) -> None:
    places = [(scenario, world) for scenario in ("calm", "storm") for world in ("forest", "maze")]
    rows = [
        row(run, "reached" if scenario == "storm" else "collision", scenario=scenario, world=world)
        for run, (scenario, world) in enumerate(places)
    ]
    summary = load_campaign(campaign(tmp_path, rows)).summary
    (first, *_) = summary.tables
    assert first.columns is not None
    assert (first.rows.key, first.columns.key) == ("world", "scenario")
    assert summary.worst[0].name == "calm, forest, rolling_window, aerosonde"


def test_worlds_that_were_flown_once_each_make_no_table(tmp_path: Path) -> None:
    rows = [row(run, world=f"field_{run}.yaml", scenario=f"field_{run}", case=run) for run in range(6)]
    twice = [row(6 + each["run"], **{key: each[key] for key in ("world", "scenario")}) for each in rows]
    for name, flown, expected in (("alone", rows, False), ("twice", rows + twice, True)):
        tables = load_campaign(campaign(tmp_path / name, flown)).summary.tables
        assert ("world" in {table.rows.key for table in tables}) == expected


def test_the_bootstrap_interval_is_that_of_the_binomial_where_it_is_known() -> None:
    differences = np.array([1.0] * 300 + [0.0] * 700)
    estimate = mean_estimate(differences, np.arange(1000))
    low, high = (float(stats.binom.ppf(end, 1000, 0.3)) / 1000 for end in (0.025, 0.975))
    assert estimate.value == pytest.approx(0.3)
    assert (estimate.low, estimate.high) == pytest.approx((low, high), abs=0.004)
    assert mean_estimate(differences, np.arange(1000)) == estimate, "the same every time"


def test_pairs_of_one_case_are_drawn_together() -> None:
    of_case = np.array([1.0] * 6 + [0.0] * 14)
    one = mean_estimate(of_case, np.arange(20))
    assert mean_estimate(np.repeat(of_case, 5), np.repeat(np.arange(20), 5)) == one
    assert mean_estimate(np.array([1.0, 0.0]), np.array([3, 3])).low is None, "a single case"
    few, enough = np.array([1.0, 0.0, 0.5]), np.array([1.0, 0.0, 0.5, 0.0])
    assert mean_estimate(few, np.arange(3)).low is None, "one in 27 resamples is the least of them alone"
    assert mean_estimate(enough, np.arange(4)).low is not None


def entries_campaign(folder: Path, kind: str = "rolling_window", shield: str = "") -> Path:
    """Two planners of one kind on two aircraft of one model, told apart by the keys that they are given."""
    same = {"kind": kind, "shield": "loiter"} if shield else {"kind": kind}
    planners = [{**same, "clearance_m": 40}, {**same, "steps": 8}, "bug2"]
    models = ["aerosonde", {"model": "aerosonde", "airspeed_mps": 30}]
    about = {"runs": 8, "campaign": {"planners": planners, "aircraft": models}}
    every = []
    for run, (airspeed, planner) in enumerate(itertools.product((None, 30), range(3))):
        told = row(run, case=0, planner=(kind + shield, kind + shield, "bug2")[planner])
        given = {"clearance_m": (40, None, None)[planner], "steps": (None, 8, None)[planner]}
        keys = {f"planner.{key}": value for key, value in given.items()} | {"aircraft.airspeed_mps": airspeed}
        outcome = {name: told.pop(name) for name in list(told)[list(told).index("outcome") :]}
        every.append(told | keys | outcome)
    folder.mkdir()
    pq.write_table(sealed(pa.Table.from_pylist(every), about), folder / "results.parquet")
    return folder


@pytest.mark.parametrize("named", [("rolling_window", ""), ("vfh_plus", "+shield")])
def test_entries_of_one_kind_are_told_apart_and_paired(named: tuple[str, str], tmp_path: Path) -> None:
    folder, name = entries_campaign(tmp_path / "c", *named), "".join(named)
    summary = load_campaign(folder).summary
    names = [f"{name}, clearance_m 40", f"{name}, steps 8", "bug2"]
    duels_told = [(duel.first, duel.second, duel.pairs) for duel in summary.duels]
    assert duels_told == [(*pair, 2) for pair in itertools.combinations(names, 2)]
    assert "planner.clearance_m" in summary.varied
    assert summary.worst[0].name == f"forest, {name}, clearance_m 40, aerosonde"


@pytest.mark.parametrize("about", ["{torn", "[1]", '{"campaign": {"planners": 3}}', "[" * 100_000])
def test_a_table_that_says_nonsense_of_its_campaign_is_damaged(tmp_path: Path, about: str) -> None:
    folder = campaign(tmp_path / "c", [row(0)])
    rows = pq.read_table(folder / "results.parquet").replace_schema_metadata({"wayproof": about})
    pq.write_table(rows, folder / "results.parquet")
    with pytest.raises(InputError, match="is not the results"):
        load_campaign(folder)


@pytest.mark.parametrize("name", ["results.parquet", "timings.parquet"])
def test_an_edited_table_is_refused(name: str, tmp_path: Path) -> None:
    folder = campaign(tmp_path / "c", [row(0), row(1, "collision")], [(1.0, 4.0, 9.0)] * 2)
    whole = pq.read_table(folder / name)
    column = "outcome" if name == "results.parquet" else "compute_ms.max"
    other = pa.array(["reached"] * 2 if column == "outcome" else [1.0, 1.0])
    edited = whole.set_column(whole.column_names.index(column), column, other)
    pq.write_table(edited.replace_schema_metadata(whole.schema.metadata), folder / name)
    assert f"{folder / name}: is not as it was written: its sha256 is another" in refused("report", folder)
    assert not (folder / PAGE).exists()


def test_what_is_missing_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = entries_campaign(tmp_path / "c")
    summary = load_campaign(folder).summary
    assert (summary.planned, summary.missing) == (8, 2)
    print_summary(summary)
    out = capsys.readouterr().out
    assert "c: 6 of 8 runs" in out
    assert "not complete: 2 missing, --resume flies what the journal lacks" in out
    page = write_summary(summary, folder).read_text()
    assert "6 of 8 runs" in page
    assert "2 runs are missing" in page
    assert json.loads((folder / "summary.json").read_text())["planned"] == 8


def test_what_a_table_of_others_holds_reaches_no_terminal_raw(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    evil = "\x1b[2J[red]\x9b"
    folder = campaign(
        tmp_path / "c",
        [row(run, evil, planner=f"{evil}{run}", scenario=evil, world=evil) for run in range(3)],
    )
    print_summary(summarise(folder, by=[("planner", "scenario")]), all_tables=True)
    said = capsys.readouterr().out
    assert printable(said) == said
    assert r"\x1b[2J[red]\x9b" in said


def test_the_worst_runs_come_first_with_what_to_do(tmp_path: Path) -> None:
    rows = [
        row(0, "unreachable"),
        row(1, min_clearance_m=60.0, wanted_clearance_m=30.0),
        row(2, min_clearance_m=80.0, wanted_clearance_m=200.0),
        row(3, "timeout"),
        row(4, "error"),
        row(5, "collision", min_clearance_m=-1.0),
        row(6, "collision", min_clearance_m=-9.0),
        row(7, "something new"),
        row(8, min_clearance_m=None),
        *(row(run) for run in range(9, 14)),
    ]
    folder = campaign(tmp_path / "my campaign", rows)
    (folder / "runs" / "6").mkdir(parents=True)
    (folder / "runs" / "6" / "flight.rrd").touch()
    (folder / "runs" / "5").mkdir()
    worst = load_campaign(folder).summary.worst
    assert [run.run for run in worst] == [6, 5, 4, 3, 0, 7]
    assert [(run.folder, run.view) for run in worst[:3]] == [
        ("runs/6", f"wayproof view '{folder}/runs/6'"),
        ("runs/5", ""),
        ("", ""),
    ]
    assert worst[0].clearance_ratio == pytest.approx(-0.18)
    assert worst[0].command == f"wayproof fly --from '{folder}/results.parquet' --run 6"
    page = write_summary(load_campaign(folder).summary, folder).read_text()
    assert 'href="runs/6/flight.rrd"' in page
    assert 'href="runs/5/flight.rrd"' not in page
    assert '</strong> the wanted 50 m. <a href="runs/6">Run folder</a>' in page
    assert worst[-1].clearance_ratio is not None
    assert worst[-1].clearance_ratio > 1.0
    assert "100.0 m; wanted 50 m." in page


def test_where_nothing_failed_the_three_closest_are_shown(tmp_path: Path) -> None:
    rows = [row(run, min_clearance_m=100.0 - run) for run in range(6)]
    folder = campaign(tmp_path / "fine", rows)
    summary = load_campaign(folder).summary
    assert [run.run for run in summary.worst] == [5, 4, 3]
    assert "Every run reached the goal" in write_summary(summary, folder).read_text()
    rows[2] |= {"trackable": False, "trackability.causes": ""}
    for each in rows:
        each |= {"planner": "given", "check.ok": each["run"] != 2, "check.verdict": f"verdict {each['run']}"}
    days = load_campaign(campaign(tmp_path / "path", rows)).summary
    assert [run.reason for run in days.worst] == ["verdict 2"], "flown to its end, not as given"
    assert days.untracked == {"end or a corner missed": 1}, "a path was flown"
    assert "The runs that were not flown as given" in write_summary(days, tmp_path / "path").read_text()
    assert days.never.startswith("collision, lost control: 0 of 6"), "it may have left its bounds"
    for each in rows:
        del each["wanted_clearance_m"], each["check.ok"]
    worst = load_campaign(campaign(tmp_path / "unknown", rows)).summary.worst
    assert [(run.run, run.clearance_ratio) for run in worst] == [(5, None), (4, None), (3, None)]


@pytest.mark.parametrize(
    ("rows", "timed"),
    [
        ([], False),
        ([row(0)], False),
        ([row(0)], True),
        ([row(run, "error", planner=("a", "b")[run % 2]) for run in range(4)], True),
        ([row(0, **{WIND: math.nan}), row(1, **{WIND: None}), row(2, min_clearance_m=math.nan)], True),
    ],
    ids=["empty", "one", "one-timed", "all-errors", "holes"],
)
def test_thin_campaigns_have_answers_too(
    rows: list[dict[str, Any]], timed: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = campaign(tmp_path, rows, [(1.0, math.nan, 3.0)] * len(rows) if timed else ())
    summary = summarise(folder, by=[(WIND, "planner")])
    print_summary(summary)
    assert f": {len(rows)} {'run' if len(rows) == 1 else 'runs'}" in capsys.readouterr().out
    page = write_summary(summary, folder).read_text()
    assert ("Nothing has been flown" in page) == (not rows)
    assert "nan" not in page.lower().replace("nanosecond", "")
    assert json.loads((folder / "summary.json").read_text())["total"]["runs"] == len(rows)


@given(st.lists(st.none() | st.floats(-1e6, 1e6, allow_nan=False), max_size=60))
@settings(max_examples=examples(30))
def test_every_number_has_one_group_between_its_edges(values: list[float | None]) -> None:
    axis, index = grouped("key", values)
    assert len(index) == len(values)
    for value, group in zip(values, index, strict=True):
        assert (axis.labels[group] == NOT_SET) == (value is None)
        if value is not None and axis.edges:
            low, high = axis.edges[group : group + 2]
            assert low <= value <= high
    if axis.edges:
        assert axis.edges == tuple(sorted(set(axis.edges)))


def test_a_terminal_of_80_columns_shows_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = by_two(tmp_path / "c")
    print_summary(load_campaign(folder).summary, all_tables=True)
    printed = capsys.readouterr().out
    lines = printed.splitlines()
    assert max(map(len, lines[:-1])) <= 80
    assert "reached 22, collision 2\nconditions: rough, but for what scenarios or campaign set\n" in printed
    assert any(line.split()[:5] == ["all", "runs", "24", "91.7", "(74\N{EN DASH}98)"] for line in lines)
    assert "collision run 21 (forest, bug2, aerosonde), least clearance -2.5 m" in printed
    assert lines[-1] == f"again: wayproof fly --from {tmp_path}/c/results.parquet --run 21"
    (folder / "runs" / "21").mkdir(parents=True)
    (folder / "runs" / "21" / "flight.rrd").touch()
    print_summary(load_campaign(folder).summary)
    assert capsys.readouterr().out.splitlines()[-1] == f"view: wayproof view {folder}/runs/21"


def test_the_command_makes_the_summary_again_by_other_keys(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = by_two(tmp_path / "c")
    assert main(["report", str(folder), "--by", f"planner, {WIND}", "--by", "sensor.rays"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert said.out.splitlines()[-1] == f"summary: {folder / PAGE}"
    page = (folder / PAGE).read_text()
    assert f"<h2>By planner and {WIND}</h2>" in page
    assert "<h2>By sensor.rays</h2>" in page
    assert "with the edges 0, 2.75, 5.5, 8.25, 11;" in page


@pytest.mark.parametrize(
    ("by", "sentence"),
    [
        ("planner,wind", f"no column 'wind'; varied there: planner, {WIND}, sensor.rays"),
        ("obstacles.0.velocity_mps.1", "no column 'obstacles[0].velocity_mps[1]'"),
        ("planner,planner", "must be one key, or two different ones"),
        ("planner,world,aircraft", "must be one key, or two different ones"),
    ],
)
def test_a_wrong_key_is_bad_input(by: str, sentence: str, tmp_path: Path) -> None:
    folder = by_two(tmp_path / "c")
    assert sentence in refused("report", folder, "--by", by)
    assert not (folder / PAGE).exists()


def test_a_run_folder_has_no_keys_and_damage_is_told(tmp_path: Path) -> None:
    assert "only a campaign has tables by keys" in refused("report", tmp_path, "--by", "planner")
    (tmp_path / "campaign.json").write_text("{}")
    said = refused("report", tmp_path)
    assert "stopped before the tables were written; `wayproof sweep` with --resume" in said
    (tmp_path / "results.parquet").write_bytes(b"PAR1 torn")
    assert "results.parquet: is not the results.parquet of a campaign" in refused("report", tmp_path)
    with pytest.raises(InputError, match="not the folder of a campaign"):
        load_campaign(tmp_path / "none")


def test_runs_that_were_not_tracked_are_counted_by_why(tmp_path: Path) -> None:
    rows = [row(run, **{"trackable": False, "trackability.causes": "navigation error"}) for run in range(20)]
    rows[0] |= {"trackable": True, "trackability.causes": ""}
    rows[13] |= {"trackability.causes": "navigation error; planner too late"}
    folder = campaign(tmp_path / "c", rows)
    summary = load_campaign(folder).summary
    assert summary.untracked == {"navigation error": 18, "navigation error; planner too late": 1}
    page = write_summary(summary, folder).read_text()
    assert "In 19 of 20 runs not every leg was tracked, for these causes:" in page
    assert page.index("<li>18 runs: navigation error.</li>") < page.index("planner too late.</li>")
    for cause in ("navigation error", "planner too late"):
        assert f"<strong>{cause}</strong>: {FINDINGS[cause]}.</p>" in page
    assert "<strong>bank limit</strong>" not in page, "no run has that cause"


def test_a_key_is_grouped_by_values_quantiles_or_quarters_of_the_compass() -> None:
    """An inner edge belongs to the group above it; 350 and 10 degrees are one group."""
    axis, index = grouped("w", [1000000.1, 1000000.4, 1000000.1])
    assert (axis.labels, index.tolist()) == (("1000000.1", "1000000.4"), [0, 1, 0])
    assert grouped("flag", [True, False])[0].labels == ("true", "false")
    assert grouped("seed", [6589440123456789, 1000000])[0].labels == ("1000000", "6589440123456789")
    axis, index = grouped("key", [float(value) for value in range(9)])
    assert (axis.edges, index.tolist()) == ((0.0, 2.0, 4.0, 6.0, 8.0), [0, 0, 1, 1, 2, 2, 3, 3, 3])
    drawn = [277.182, 12.5, 3.25, 90.125, 41.0, 5.5]
    assert [len(grouped("key", drawn, random)[0].labels) for random in (False, True)] == [6, 4]
    values = [350.0, 10.0, 44.9, 45.1, 90.0, 180.0, 225.1, 314.9, 360.0, None]
    axis, index = grouped("environment.wind.from_deg", values, drawn=True)
    assert index.tolist() == [0, 0, 0, 1, 1, 2, 3, 3, 0, 4]
    assert (axis.labels[0], axis.labels[-1]) == ("N, -45 to 45", NOT_SET)
    assert grouped("course_deg", [330.0, 0.0, 60.0, 300.0, 30.0], True)[0].edges == (300, 330, 0, 30, 60)


@pytest.mark.parametrize("form", ["latex", "csv", "markdown"])
def test_a_table_for_a_paper_has_the_groups_and_all_runs(
    form: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = campaign(tmp_path / "c", [row(run, planner="[1, *]") for run in range(12)])
    assert main(["report", str(folder), "--by", "planner", "--format", form]) == 0
    # Behind the end of a line LaTeX takes a bracket for a distance, and a star for a command.
    cells = {"latex": "\n{[}1, {*}] & 12", "csv": '\n"[1, *]",12', "markdown": "\n| \\[1, \\*\\] | 12"}
    assert cells[form] in capsys.readouterr().out
    folder = by_two(tmp_path / "d")
    assert main(["report", str(folder), "--by", "planner", "--format", form]) == 0
    text = capsys.readouterr().out
    if form != "latex":
        table = text.partition("\n\n")[0].replace(" | ", ",").replace("| ", "")
        rows = [each[:3] for each in csv.reader(table.splitlines()) if "---" not in each]
        assert [each[:2] for each in rows[::3]] == [["planner", "runs"], ["all runs", "24"]]
        assert rows[2] == ["bug2", "12", "83.3 (55\N{EN DASH}95)"]
    else:
        assert r"planner & runs & reached \%" in text
        assert "bug2 & 12 & 83.3 (55--95) & 1.21/1.21" in text
        comments, _, table = text.partition("\n\\begin{tabular}{lrrrrrrr}\n\\toprule\n")
        assert table
        assert comments.startswith("% \\usepackage{booktabs}\n")
        assert all(line.startswith("% ") for line in comments.splitlines())
        assert "% plan ms: Planner time (Milliseconds: largest p99 of a run/longest search)." in comments
        assert text.count(r"\\") == 4
    assert not (folder / PAGE).exists(), "the table alone"


@pytest.mark.flights
def test_a_browser_shows_the_page_on_phone_and_screen(tmp_path: Path, chromium: Any) -> None:
    folder = by_two(tmp_path / "c")
    summary: Summary = load_campaign(folder).summary
    page = write_summary(summary, folder)
    assert "<b>boom" not in page.read_text()
    assert_shown(chromium, page, figures=1)
    long = campaign(tmp_path / "d", [row(run, planner=f"{'name_' * 18}{run % 2}") for run in range(4)])
    phone = chromium.new_page(viewport={"width": 390, "height": 900})
    phone.goto(write_summary(load_campaign(long).summary, long).resolve().as_uri())
    widths = "[...document.querySelectorAll('.wide th[scope=row]')].map(name => name.clientWidth)"
    assert 100 < phone.evaluate(f"Math.max(...{widths})") < 250, "names stay beside the figures"


def test_what_never_happened_has_an_upper_bound(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of 0 of 286, Clopper and Pearson's bound at 95 % is 1.04 %: 0.98959^286 = 0.05. What failed may have been one."""
    ends = {9: "collision", 286: "error", 287: "planner_failed"}
    rows = [row(run, ends.get(run, "reached")) for run in range(288)]
    summary = load_campaign(campaign(tmp_path / "c", rows)).summary
    told = "lost control, out of bounds: 0 of 286, each less frequent than 1.04 % at 95 % confidence"
    assert summary.never == told
    print_summary(summary)
    assert "0 of 286" in capsys.readouterr().out
