"""The command that measures an aircraft: `envelope`."""

from __future__ import annotations

from typing import Annotated

import typer

from harness.cli.options import JsonOption, bad_input


def envelope(
    aircraft: Annotated[
        str,
        typer.Argument(metavar="AIRCRAFT", help="A name that `wayproof list aircraft` prints, or a folder."),
    ],
    airspeeds: Annotated[
        list[float] | None,
        typer.Option("--airspeed-mps", metavar="V", help="True airspeed; can be repeated. Default: cruise."),
    ] = None,
    winds: Annotated[
        list[float] | None,
        typer.Option("--wind", metavar="M/S", help="Wind to track in; can be repeated. Default: 30 % of V."),
    ] = None,
    as_json: JsonOption = False,
) -> int:
    """Flies an aircraft and prints what it can do: speeds, turns, roll-in, the tightest path that it tracks.

    The figures are kept until the model or wayproof changes. The planned radius in the table is the one that planners
    get: the tightest radius tracked, and a margin.

    For example: wayproof envelope c172p --wind 8
    """
    from aircraft.airframes import AircraftError
    from harness.bench.envelope_card import envelope_card
    from harness.cli.terminal import envelope_tables, print_grid, step_bar

    for name, values in (("--airspeed-mps", airspeeds or ()), ("--wind", winds or ())):
        for value in values:
            if not 0.0 <= value < 1000.0:
                raise typer.BadParameter(f"{value:g} is not a speed from 0 to 1000 m/s", param_hint=name)
    try:
        with step_bar() as report:
            card = envelope_card(aircraft, airspeeds or (), winds or (), report)
    except AircraftError as error:
        raise bad_input(error) from error
    if as_json:
        from harness.cli.options import print_json

        print_json(card)
    else:
        for title, columns, rows in envelope_tables(card):
            print_grid(title, columns, rows)
    return 0
