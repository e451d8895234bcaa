"""What the commands share: their options and what these replace, how errors and interrupts are told, exit status."""

from __future__ import annotations

import errno
import inspect
import json
import os
import re
import shlex
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer
from typer.core import TyperCommand, TyperGroup

from harness.cli.standard_output import say
from harness.files.wording import printable

if TYPE_CHECKING:
    from harness.scenario.scenario import Scenario

FAILED: Final = 1
BAD_INPUT: Final = 2
IN_THE_NAME: Final = ("name", "seed", "planner.kind", "planner.shield", "aircraft.model")
"""Keys that the default folder of a run is called after; of a model that is a folder, by the folder's last name."""


class Command(TyperCommand):
    """A command whose help shows no type for what takes no value, and paragraphs without the source's line breaks."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.help = re.sub(r"(?<!\n)\n(?!\n)", " ", inspect.cleandoc(self.help or ""))

    def get_params(self, ctx: Any) -> list[Any]:
        """Its parameters."""
        return _tidied(super().get_params(ctx))


class Group(TyperGroup):
    """The same for the program itself."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Its parameters."""
        return _tidied(super().get_params(ctx))


def _tidied(parameters: list[Any]) -> list[Any]:
    for each in parameters:
        if getattr(each, "is_flag", False):
            each.metavar = " "
    return parameters


def flag(name: str, text: str) -> Any:
    """An option without a value."""
    return typer.Option(name, help=text)


def option(metavar: str, text: str, *names: str, **other: Any) -> Any:
    """An option with a value; its name is that of the parameter where none is given."""
    return typer.Option(*names, metavar=metavar, help=text, **other)


def argument(metavar: str, text: str, **other: Any) -> Any:
    """What stands behind a command without a name."""
    return typer.Argument(metavar=metavar, help=text, **other)


def completing(source: str) -> Callable[[str], list[str]]:
    """What a shell completes an argument with: the names that MODULE:FUNCTION gives; files it finds itself."""

    def begin_so(incomplete: str) -> list[str]:
        module, _, function = source.partition(":")
        names = getattr(import_module(module), function)()
        return [name for name in names if name.startswith(incomplete)]

    return begin_so


_SCENARIO: Any = typer.Argument(
    metavar="SCENARIO",
    help="A file, or a name that `wayproof list scenarios` prints.",
    autocompletion=completing("harness.scenario.shipped:shipped_scenarios"),
)
_AIRCRAFT: Any = typer.Option(
    metavar="NAME",
    help="A name that `wayproof list aircraft` prints, or a folder.",
    autocompletion=completing("aircraft.airframes:aircraft_names"),
)
ScenarioArgument = Annotated[str, _SCENARIO]
OptionalScenario = Annotated[str | None, _SCENARIO]
AircraftName = Annotated[str, _AIRCRAFT]
AircraftOption = Annotated[str | None, _AIRCRAFT]
WorkersOption = Annotated[int | None, option("N", "Flights at a time. Default: one a processor.", min=1)]
OutOption = Annotated[Path | None, option("DIR", "The folder to write. Default: one of its own in runs.")]
QuietOption = Annotated[bool, flag("--quiet", "Print nothing but errors.")]
NoRecordingOption = Annotated[bool, flag("--no-recording", "Do not write flight.rrd.")]
ResumeOption = Annotated[bool, flag("--resume", "Fly only what is missing in DIR.")]
JsonOption = Annotated[bool, flag("--json", "Print the result as JSON, and nothing else.")]


def load(scenario: str, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """A scenario by file or shipped name, with keys replaced."""
    from harness.campaign.campaign_file import is_campaign
    from harness.files.strict_yaml import InputError
    from harness.scenario.scenario import load_scenario
    from harness.scenario.shipped import shipped_campaigns

    try:
        return load_scenario(scenario, overrides)
    except InputError as error:
        if scenario in shipped_campaigns() or (os.path.isfile(scenario) and is_campaign(Path(scenario))):
            use = shlex.join(["wayproof", "sweep", scenario])
            raise InputError(f"{scenario}: this is a campaign: use `{use}`") from error
        raise


def told_apart(settings: Sequence[tuple[str, str]], named: Sequence[str] = IN_THE_NAME) -> str:
    """What a default folder's name has at its end, so that runs which differ in settings do not replace one another."""
    from hashlib import sha256

    from harness.files.strict_yaml import as_spelt

    spelt = [(as_spelt(key), value.strip()) for key, value in settings]
    others = [(key, value) for key, value in spelt if key not in named or "/" in value]
    return f"-{sha256(json.dumps(others).encode()).hexdigest()[:8]}" if others else ""


def bad_input(error: ValueError) -> Exception:
    """A fault of what was given, as the error that ends with BAD_INPUT."""
    from harness.files.strict_yaml import InputError

    return InputError(f"wayproof: {error}")


def with_remedy(error: OSError) -> str:
    """What an error of the system says, and what would help where that is known."""
    if error.errno in (errno.EMFILE, errno.ENFILE):
        return f"{error}: raise the limit with `ulimit -n 1024`"
    try:
        os.getcwd()
    except FileNotFoundError:
        return "the working directory has been deleted: change to another"
    return str(error)


@contextmanager
def faults_told(left: Callable[[], str]) -> Iterator[None]:
    """Ends with BAD_INPUT for a folder or an aircraft that cannot be used, and says after Ctrl-C what is left."""
    from aircraft.airframes import AircraftError
    from harness.files.errors import RunFolderError

    try:
        yield
    except (AircraftError, RunFolderError) as error:
        raise bad_input(error) from error
    except KeyboardInterrupt:
        say(f"wayproof: interrupted; {left()}", err=True)
        raise


def marked_incomplete(what: str, folder: Path, index: str, schema: str) -> Callable[[], str]:
    """What became of a folder that was being written, for `faults_told`."""

    def left() -> str:
        from harness.files.input_file import read_index

        begun = read_index(folder / index, schema)
        if begun is not None and begun.get("complete") is False:
            return f"the {what} in {folder} is marked incomplete"
        return "nothing was written"

    return left


@contextmanager
def resumable(folder: Path, index: str) -> Iterator[None]:
    """The same for many flights, which --resume goes on with; a full disk, or a cluster gone, ends with FAILED."""
    done = f"what is done is in {folder}, --resume goes on"
    try:
        with faults_told(lambda: done if (folder / index).exists() else "nothing was written"):
            yield
    except OSError as error:
        say(f"wayproof: {with_remedy(error)}; {done}", err=True)
        raise typer.Exit(FAILED) from error


def print_json(content: Any) -> None:
    """Prints a result for scripts."""
    text = json.dumps(content, indent=2, ensure_ascii=False)
    if printable(text) != text:
        # JSON has spelt out what ASCII has of them; what say() would make of the others is no JSON.
        text = "".join(c if c == printable(c) else f"\\u{ord(c):04x}" for c in text)
    say(text)
