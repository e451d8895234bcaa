"""The commands that measure: `bench` the closed loop, `envelope` an aircraft."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final

import typer

from harness.cli.command_line import load, print_json
from harness.cli.options import AircraftArgument, Json, argument, option
from harness.cli.terminal import legible, print_table, spread, step_bar

AIRSPEEDS_HELP: Final = "True airspeed; can be repeated. Default: cruise."
WINDS_HELP: Final = "Wind to track in; can be repeated. Default: 30 % of V."


def bench(
    scenario: Annotated[str, argument("SCENARIO", "A file or shipped name.", show_default=True)] = "paper_circles",
    as_json: Json = False,
) -> int:
    """Measures the time of the closed loop on this machine over that of bare JSBSim, block by block.

    It flies the scenario up to 21 times, which takes some minutes for a long one.

    For example: wayproof bench aerosonde_forest --json
    """
    from harness.bench.costs import bench as measure

    loaded = load(scenario)
    with step_bar() as report:
        result = measure(loaded, report)
    if as_json:
        print_json(result)
    else:
        print_table(f"bench of {loaded.name}", bench_rows(result))
    return 0


def bench_rows(result: Mapping[str, Any]) -> dict[str, str]:
    """Returns name and value of each row of the table of `bench`."""
    same = "x bare JSBSim at the same step rate"
    return {
        "closed loop": f"{result['closed_loop_ratio']:.3f} {same}",
        "with recording": f"{result['closed_loop_recording_ratio']:.3f} {same}",
        "step rate": f"{result['step_rate_hz']} Hz",
        "planner, processor time": f"{spread(result['planner_ms'], ('p50', 'p99', 'max'))} ms",
        **{f"  {name}": f"{share:.1%}" for name, share in result["blocks"].items()},
    }


def envelope(
    aircraft: AircraftArgument,
    airspeeds: Annotated[list[float] | None, option("V", AIRSPEEDS_HELP, "--airspeed-mps")] = None,
    winds: Annotated[list[float] | None, option("M/S", WINDS_HELP, "--wind")] = None,
    as_json: Json = False,
) -> int:
    """Flies an aircraft and prints what it can do: speeds, turns, roll-in, the tightest path that it tracks.

    The figures are kept until the model or wayproof changes. The planned radius in the table is the one that planners
    get: it leaves bank in reserve below the limit.

    For example: wayproof envelope c172p --wind 8
    """
    from harness.bench.envelope_card import envelope_card

    for name, values in (("--airspeed-mps", airspeeds or ()), ("--wind", winds or ())):
        for value in values:
            if not 0.0 <= value < 1000.0:
                raise typer.BadParameter(f"{value:g} is not a speed from 0 to 1000 m/s", param_hint=name)
    with step_bar() as report:
        card = envelope_card(aircraft, airspeeds or (), winds or (), report)
    if as_json:
        print_json(card)
    else:
        _print_card(card)
    return 0


def _print_card(card: Mapping[str, Any]) -> None:
    """Prints the tables of `envelope`; figures that a page lists are headed by their names."""
    low, high = card["airspeed_range_mps"]
    facts = {
        "mass": f"{card['mass_kg']:g} kg",
        "level flight": f"{low:g} to {high:g} m/s, cruise {card['cruise_mps']:g} m/s",
        "bank limit": f"{card['bank_limit_deg']:g} deg, rolled into at {card['roll_rate_dps']:g} deg/s",
        "tracking": "held by tests" if card["verified"] else "not held by tests",
    }
    print_table(card["aircraft"], facts)
    margins = [(name, f"{law['gain']:.1f}", f"{law['delay_s']:.2f}") for name, law in card["laws"].items()]
    print_table("guidance at cruise, calm air", margins, ("law on a line", "gain margin", "delay margin s"))
    for page in card["at"]:
        at = f"at {page['airspeed_mps']:g} m/s"
        level = f"speed and altitude kept in banks of up to {page['level_bank_deg']:g} deg"
        climbs = f"climbs at up to {page['climb_mps']:.3g} m/s, sinks at up to {page['descent_mps']:.3g}"
        turns = f"turns {at}; rolls to 90 % of 30 deg in {page['roll_in_s']:g} s; {level}; {climbs}"
        for title, entries in ((turns, page["turns"]), (f"paths {at} that are tracked", page["tracked"])):
            heads = [name.replace("_", " ").replace("mps", "m/s") for name in entries[0]]
            print_table(title, [[legible(figure) for figure in each.values()] for each in entries], heads)
