"""The options that commands share, and how the help of a command looks."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer
from typer.core import TyperCommand, TyperGroup

Text: TypeAlias = str | None
Number: TypeAlias = float | None
Count: TypeAlias = int | None


class _Shown:
    """A command in whose help parameters that take no value have no type."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Returns the parameters as help shows them."""
        parameters: list[Any] = super().get_params(ctx)  # type: ignore[misc]
        for each in parameters:
            if getattr(each, "is_flag", False):
                each.metavar = " "
        return parameters


class Command(_Shown, TyperCommand):
    """A command whose help has paragraphs without the source's line breaks; an exit status is one of its own."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        apart = re.sub(r"\n(?=\d+ )", "\n\n", inspect.cleandoc(self.help or ""))
        self.help = re.sub(r"(?<!\n)\n(?!\n)", " ", apart)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parses arguments; a UsageError says which option is given twice, of which the last alone would count."""
        _, _, given = self.make_parser(ctx).parse_args(args=list(args))
        for each in given:
            takes_one = not (each.multiple or getattr(each, "is_flag", False))
            if takes_one and given.count(each) > 1 and not ctx.resilient_parsing:
                ctx.fail(f"{each.opts[0]} is given {given.count(each)} times; give it once")
        return list(super().parse_args(ctx, args))


class Group(_Shown, TyperGroup):
    """The program itself."""


def flag(name: str, text: str) -> Any:
    """Declares an option without a value."""
    return typer.Option(name, help=text)


def option(metavar: str, text: str, *names: str, **other: Any) -> Any:
    """Declares an option with a value; it is named after the parameter where no name is given."""
    return typer.Option(*names, metavar=metavar, help=text, **other)


def argument(metavar: str, text: str, **other: Any) -> Any:
    """Declares an argument, which stands behind the command without a name."""
    return typer.Argument(metavar=metavar, help=text, **other)


_SCENARIO_ARGUMENT = argument("SCENARIO", "A file, or a name that `wayproof list scenarios` prints.")
_AIRCRAFT_HELP = "A name that `wayproof list aircraft` prints, or a folder."
ScenarioArgument = Annotated[str, _SCENARIO_ARGUMENT]
OptionalScenario = Annotated[Text, _SCENARIO_ARGUMENT]
AircraftName = Annotated[str, option("NAME", _AIRCRAFT_HELP)]
AircraftOption = Annotated[Text, option("NAME", _AIRCRAFT_HELP)]
AircraftArgument = Annotated[str, argument("AIRCRAFT", _AIRCRAFT_HELP)]
Workers = Annotated[Count, option("N", "Flights at a time. Default: one a processor.", min=1)]
Out = Annotated[Path | None, option("DIR", "The folder to write. Default: one of its own in runs.")]
Quiet = Annotated[bool, flag("--quiet", "Print nothing but errors.")]
NoRecording = Annotated[bool, flag("--no-recording", "Do not write flight.rrd.")]
Resume = Annotated[bool, flag("--resume", "Fly only what is missing in DIR.")]
Json = Annotated[bool, flag("--json", "Print the result as JSON, and nothing else.")]
