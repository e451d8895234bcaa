"""The options that commands share, and how the help of a command looks."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer
from typer.core import TyperCommand, TyperGroup

Text: TypeAlias = str | None
Number: TypeAlias = float | None
Count: TypeAlias = int | None


def _without_types_of_flags(get_params: Callable[..., list[Any]]) -> Callable[..., list[Any]]:
    """The parameters of a command, of which help shows no type for those that take no value."""

    def tidied(self: Any, ctx: Any) -> list[Any]:
        parameters = get_params(self, ctx)
        for each in parameters:
            if getattr(each, "is_flag", False):
                each.metavar = " "
        return parameters

    return tidied


class Command(TyperCommand):
    """A command whose help has paragraphs without the source's line breaks; an exit status is one of its own."""

    get_params = _without_types_of_flags(TyperCommand.get_params)

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        apart = re.sub(r"\n(?=\d+ )", "\n\n", inspect.cleandoc(self.help or ""))
        self.help = re.sub(r"(?<!\n)\n(?!\n)", " ", apart)


class Group(TyperGroup):
    """The program itself."""

    get_params = _without_types_of_flags(TyperGroup.get_params)


def flag(name: str, text: str) -> Any:
    """An option without a value."""
    return typer.Option(name, help=text)


def option(metavar: str, text: str, *names: str, completes: str = "", **other: Any) -> Any:
    """An option with a value; its name is that of the parameter where none is given.

    A shell completes it with the names that the function of `completes`, MODULE:FUNCTION, gives.
    """
    return typer.Option(*names, metavar=metavar, help=text, autocompletion=_names(completes), **other)


def argument(metavar: str, text: str, completes: str = "", **other: Any) -> Any:
    """What stands behind a command without a name."""
    return typer.Argument(metavar=metavar, help=text, autocompletion=_names(completes), **other)


def called(source: str) -> Any:
    """What a function, MODULE:FUNCTION, gives; its module is imported now."""
    module, _, function = source.partition(":")
    return getattr(import_module(module), function)()


def _names(source: str) -> Callable[[str], list[str]] | None:
    return (
        (lambda incomplete: [name for name in called(source) if name.startswith(incomplete)])
        if source
        else None
    )


_SCENARIO = argument(
    "SCENARIO",
    "A file, or a name that `wayproof list scenarios` prints.",
    "harness.scenario.shipped:shipped_scenarios",
)
_NAME = "A name that `wayproof list aircraft` prints, or a folder."
_AIRCRAFT = option("NAME", _NAME, completes="aircraft.airframes:aircraft_names")
ScenarioArgument = Annotated[str, _SCENARIO]
OptionalScenario = Annotated[Text, _SCENARIO]
AircraftName = Annotated[str, _AIRCRAFT]
AircraftOption = Annotated[Text, _AIRCRAFT]
AircraftArgument = Annotated[str, argument("AIRCRAFT", _NAME)]
Workers = Annotated[Count, option("N", "Flights at a time. Default: one a processor.", min=1)]
Out = Annotated[Path | None, option("DIR", "The folder to write. Default: one of its own in runs.")]
Quiet = Annotated[bool, flag("--quiet", "Print nothing but errors.")]
NoRecording = Annotated[bool, flag("--no-recording", "Do not write flight.rrd.")]
Resume = Annotated[bool, flag("--resume", "Fly only what is missing in DIR.")]
Json = Annotated[bool, flag("--json", "Print the result as JSON, and nothing else.")]
