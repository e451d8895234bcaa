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


def _without_types_of_flags(parameters: list[Any]) -> list[Any]:
    """The parameters of a command; help shows no type for those that take no value."""
    for each in parameters:
        if getattr(each, "is_flag", False):
            each.metavar = " "
    return parameters


class Command(TyperCommand):
    """A command whose help has paragraphs without the source's line breaks; an exit status is one of its own."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        apart = re.sub(r"\n(?=\d+ )", "\n\n", inspect.cleandoc(self.help or ""))
        self.help = re.sub(r"(?<!\n)\n(?!\n)", " ", apart)

    def get_params(self, ctx: Any) -> list[Any]:
        """Those that help shows."""
        return _without_types_of_flags(super().get_params(ctx))


class Group(TyperGroup):
    """The program itself."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Those that help shows."""
        return _without_types_of_flags(super().get_params(ctx))


def flag(name: str, text: str) -> Any:
    """An option without a value."""
    return typer.Option(name, help=text)


def option(metavar: str, text: str, *names: str, **other: Any) -> Any:
    """An option with a value; its name is that of the parameter where none is given."""
    return typer.Option(*names, metavar=metavar, help=text, **other)


def argument(metavar: str, text: str, **other: Any) -> Any:
    """What stands behind a command without a name."""
    return typer.Argument(metavar=metavar, help=text, **other)


_SCENARIO = argument("SCENARIO", "A file, or a name that `wayproof list scenarios` prints.")
_NAME = "A name that `wayproof list aircraft` prints, or a folder."
ScenarioArgument = Annotated[str, _SCENARIO]
OptionalScenario = Annotated[Text, _SCENARIO]
AircraftName = Annotated[str, option("NAME", _NAME)]
AircraftOption = Annotated[Text, option("NAME", _NAME)]
AircraftArgument = Annotated[str, argument("AIRCRAFT", _NAME)]
Workers = Annotated[Count, option("N", "Flights at a time. Default: one a processor.", min=1)]
Out = Annotated[Path | None, option("DIR", "The folder to write. Default: one of its own in runs.")]
Quiet = Annotated[bool, flag("--quiet", "Print nothing but errors.")]
NoRecording = Annotated[bool, flag("--no-recording", "Do not write flight.rrd.")]
Resume = Annotated[bool, flag("--resume", "Fly only what is missing in DIR.")]
Json = Annotated[bool, flag("--json", "Print the result as JSON, and nothing else.")]
