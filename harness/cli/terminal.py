"""What a person sees on a terminal: progress while flying, and tables of results."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Final, TypeAlias

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn
from rich.table import Table

from harness.cli.standard_output import say
from harness.files.wording import printable, tallied

Report: TypeAlias = Callable[[float, float, str], None]
"""Takes simulated time (s), distance to go (m) and what is being done."""

_OUTCOME_STYLE = {"reached": "bold green", "unreachable": "bold yellow"}


@contextmanager
def progress_bar(straight_m: float) -> Iterator[Report | None]:
    """A progress bar on standard error, or None where that is not a terminal.

    Args:
        straight_m: distance from start to goal.
    """
    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    columns = (
        BarColumn(bar_width=20),
        TextColumn("{task.fields[time_s]:7.0f} s  {task.fields[speed_up]:5.0f} x real time"),
        TextColumn("{task.fields[to_go_m]:8.0f} m to go  {task.description}"),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("starting up", total=straight_m, time_s=0.0, speed_up=0.0, to_go_m=straight_m)

        def report(time_s: float, to_go_m: float, state: str) -> None:
            elapsed_s = bar.tasks[0].elapsed or 0.0
            bar.update(
                task,
                completed=max(0.0, straight_m - to_go_m),
                description=plain(state),
                time_s=time_s,
                to_go_m=max(0.0, to_go_m),
                speed_up=time_s / elapsed_s if elapsed_s > 0 else 0.0,
            )

        yield report


@contextmanager
def step_bar() -> Iterator[Callable[[int, int, str], None]]:
    """A bar of steps done on standard error; a line every ten seconds where that is not a terminal."""
    console = Console(stderr=True)
    if not console.is_terminal:
        state = ["begun"]

        def note(done: int, of: int, what: str) -> None:
            state[0] = f"{done} of {of}: {plain(what)}"

        with progress_lines(lambda: state[0]):
            yield note
        return
    with Progress(
        BarColumn(bar_width=20), TextColumn("{task.description}"), console=console, transient=True
    ) as bar:
        task = bar.add_task("")

        def report(done: int, of: int, what: str) -> None:
            bar.update(task, completed=done, total=of, description=plain(what))

        yield report


LINE_EVERY_S: Final = 10.0
"""Without a terminal, progress is a line on standard error at this interval."""


@contextmanager
def progress_lines(state: Callable[[], str]) -> Iterator[None]:
    """Prints a line on standard error every ten seconds, for those who read a log.

    Args:
        state: what the line says.
    """
    over = threading.Event()

    def tell() -> None:
        while not over.wait(LINE_EVERY_S):
            say(f"wayproof: {state()}", err=True)

    thread = threading.Thread(target=tell, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def print_grid(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A table with a heading over each column, on standard output; figures are right-aligned."""
    console = Console()
    table = Table(title=plain(title), box=box.SIMPLE, title_justify="left", pad_edge=False)
    for index, column in enumerate(columns):
        table.add_column(printable(column), justify="right" if index else "left", overflow="fold")
    for row in rows:
        table.add_row(*map(printable, row))
    console.print(table, width=min(80, console.width))


def print_table(title: str, rows: Mapping[str, str]) -> None:
    """Two columns, name and value, on standard output and never wider than 80."""
    console = Console()
    table = Table(title=plain(title), box=box.SIMPLE, show_header=False, title_justify="left", pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in rows.items():
        table.add_row(printable(name), printable(value))
    console.print(table, width=min(80, console.width))


def flight_rows(metrics: Mapping[str, Any]) -> dict[str, str]:
    """The rows of the table at the end of a flight, from the content of `metrics.json`."""
    style = _OUTCOME_STYLE.get(metrics["outcome"], "bold red")
    compute, timing = metrics["compute_ms"], metrics["timing"]
    return {
        "outcome": f"[{style}]{metrics['outcome']}[/]: {plain(metrics['reason'])}",
        "length flown": f"{legible(metrics['flown_length_m'])} m, "
        f"planned {legible(metrics['planned_length_m'])} m",
        "flight time": f"{legible(metrics['flight_time_s'])} s",
        "least clearance": f"{legible(metrics['min_clearance_m'])} m, "
        f"below the wanted one for {legible(metrics['clearance_violation_s'])} s",
        **_over_ground(metrics),
        **error_rows(metrics),
        "altitude error": f"{spread(metrics['altitude_error_m'])} m",
        "trackable": _tracked(metrics),
        **{each["kind"]: plain(each["text"]) for each in metrics.get("findings", ())},
        "replans": str(metrics["replans"]),
        "planner time": f"p99 {legible(compute['p99'])} / max {legible(compute['max'])} ms a search",
        "wall time": f"{legible(timing['wall_s'])} s, {legible(timing['realtime_factor'])} x real time",
    }


def _over_ground(metrics: Mapping[str, Any]) -> dict[str, str]:
    """A row on the height above ground, where that is known."""
    least_m = metrics.get("min_altitude_above_ground_m")
    return {} if least_m is None else {"above ground": f"at least {legible(least_m)} m"}


def error_rows(metrics: Mapping[str, Any]) -> dict[str, str]:
    """Rows on how far the true and the believed position were off the path; one where navigation was perfect.

    The names are those of performance-based navigation (ICAO Doc 9613).
    """
    legs, margin_m = metrics["trackability"], metrics.get("navigation_margin_m")
    total = metrics.get("total_system_error_m", metrics["cross_track_m"])
    threshold_m = legs[0].get("threshold_m") if legs else None
    allowed = "" if threshold_m is None else f", allowed {threshold_m:.3g} m"
    kept = f", of which {legible(margin_m)} m are the navigation margin that was planned" if margin_m else ""
    rows = {"total system error": f"{spread(total)} m{allowed}{kept}"}
    if metrics.get("navigation_error_m") is not None:
        rows["  flight technical error"] = f"{spread(metrics['flight_technical_error_m'])} m"
        rows["  navigation error"] = f"{spread(metrics['navigation_error_m'])} m"
    return rows


def bench_rows(result: Mapping[str, Any]) -> dict[str, str]:
    """The rows of the table of `wayproof bench`."""
    planner = result["planner_ms"]
    rows = {
        "closed loop": f"{result['closed_loop_ratio']:.3f} x bare JSBSim at the same step rate",
        "with recording": f"{result['closed_loop_recording_ratio']:.3f} x bare JSBSim at the same step rate",
        "outside JSBSim": f"{result['outside_us']:.1f} us a guidance interval",
        "step rate": f"{result['step_rate_hz']} Hz, a bare step {result['bare_step_us']:.2f} us",
        "planner, processor time": ", ".join(
            f"{name} {planner[name]:.2f} ms" for name in ("p50", "p99", "max")
        ),
        "rounds": f"{result['rounds']}, {'steady' if result['steady'] else 'not steady: the machine is busy'}",
    }
    return rows | {f"  {name}": f"{share:.1%}" for name, share in result["blocks"].items()}


def _tracked(metrics: Mapping[str, Any]) -> str:
    """Whether all legs were tracked, and why some were not; of plans that are judged together, how many they are."""
    if metrics["trackable"]:
        return "yes"
    legs = metrics["trackability"]
    plans = metrics["replans"] + 1
    together = (
        f" ({plans} plans; one flown for less than 5 s is judged with the next)" if plans > len(legs) else ""
    )
    bad = [leg for leg in legs if not leg["trackable"]]
    causes = [leg["cause"] for leg in bad]
    return (
        f"no: {len(bad)} of {len(legs)} legs, {tallied(causes, 'legs')}{together}"
        if bad
        else "no: no plan was flown"
    )


def envelope_tables(card: Mapping[str, Any]) -> list[tuple[str, Sequence[str], list[Sequence[str]]]]:
    """Title, headings and rows of each table of `wayproof envelope`."""
    low, high = card["airspeed_range_mps"]
    facts = {
        "mass": f"{card['mass_kg']:g} kg",
        "level flight": f"{low:g} to {high:g} m/s, cruise {card['cruise_mps']:g} m/s",
        "bank limit": f"{card['bank_limit_deg']:g} deg, rolled into at {card['roll_rate_dps']:g} deg/s",
        "tracking": "held by tests" if card["verified"] else "not held by tests",
    }
    tables: list[tuple[str, Sequence[str], list[Sequence[str]]]] = [
        (card["aircraft"], ("", ""), list(facts.items()))
    ]
    margins: list[Sequence[str]] = [
        (name, f"{law['gain']:.1f}", f"{law['delay_s']:.2f}") for name, law in card["laws"].items()
    ]
    heads = ("law on a line", "gain margin", "delay margin s")
    tables.append(("guidance at cruise, calm air", heads, margins))
    for page in card["at"]:
        title = (
            f"turns at {page['airspeed_mps']:g} m/s; 90 % of 30 deg in {page['roll_in_s']:g} s; speed and altitude "
            f"kept up to {page['level_bank_deg']:g} deg; climbs at up to {page['climb_mps']:.3g} m/s, sinks at up to "
            f"{page['descent_mps']:.3g}"
        )
        tables.append((title, tuple(_TURN_COLUMNS.values()), _rows(page["turns"], _TURN_COLUMNS)))
        title = f"paths at {page['airspeed_mps']:g} m/s"
        tables.append((title, tuple(_PATH_COLUMNS.values()), _rows(page["tracked"], _PATH_COLUMNS)))
    return tables


_TURN_COLUMNS = {
    "bank_deg": "bank deg",
    "radius_m": "radius m",
    "load_factor": "load factor",
    "altitude_lost_m": "altitude lost m",
    "airspeed_lost_mps": "speed lost m/s",
}
_PATH_COLUMNS = {
    "wind_mps": "wind m/s",
    "tightest_radius_m": "tightest radius tracked m",
    "planned_radius_m": "planned radius m",
}


def _rows(entries: Sequence[Mapping[str, float | None]], columns: Mapping[str, str]) -> list[Sequence[str]]:
    return [tuple(legible(entry[name]) for name in columns) for entry in entries]


def tracking_rows(result: Mapping[str, Any]) -> tuple[Sequence[str], list[Sequence[str]]]:
    """Headings and rows of the table of `wayproof bench tracking`; limits are behind the figures."""
    figures = ("cross_track_p95_m", "cross_track_max_m", "altitude_p95_m")
    rows: list[Sequence[str]] = []
    for case in result["cases"]:
        limits = case["limits"]
        if case["lost"]:
            rows.append((case["case"], *("-" for _ in figures), "-", "[bold red]control is lost[/]"))
            continue
        cells = [f"{case[name]:.3f}" + (f" <= {limits[name]:.2g}" if limits else "") for name in figures]
        verdict = {True: "kept", False: "[bold red]not kept[/]", None: "-"}[case["kept"]]
        rows.append((case["case"], *cells, f"{case['bank_saturation']:.1%}", verdict))
    return ("air", "cross-track p95", "max m", "altitude p95", "saturated", "limits"), rows


def plain(text: str) -> str:
    """Text of others with nothing in it that rich takes for markup, or a terminal for a command."""
    return escape(printable(text))


def legible(value: float | None) -> str:
    """A number as a person reads it; a dash where there is none."""
    if value is None or value != value:
        return "-"
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"


def spread(values: Mapping[str, float | None], names: Sequence[str] = ("rms", "p95", "max")) -> str:
    """Figures of one error, each after its name; their unit, once, comes after them."""
    return " / ".join(f"{name} {legible(values[name])}" for name in names)
