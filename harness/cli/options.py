"""What the commands share: their options and what these replace, how errors and interrupts are told, exit status."""

from __future__ import annotations

import errno
import inspect
import json
import os
import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeVar

import typer
from typer.core import TyperCommand, TyperGroup

from harness.cli.standard_output import say
from harness.files.wording import printable

if TYPE_CHECKING:
    from harness.scenario.given import LoopPart
    from harness.scenario.scenario import Scenario

FAILED: Final = 1
BAD_INPUT: Final = 2
IN_THE_NAME: Final = ("name", "seed", "planner.kind", "planner.shield", "aircraft.model")
"""Keys that the default folder of a run is called after; of a model that is a folder, by the folder's last name."""

Run = TypeVar("Run", bound=Callable[..., int])


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


def completing(names: Callable[[], Iterable[str]]) -> Callable[[str], list[str]]:
    """What a shell completes an argument with; files it finds itself."""

    def begin_so(incomplete: str) -> list[str]:
        return [name for name in names() if name.startswith(incomplete)]

    return begin_so


def _scenarios() -> Iterable[str]:
    from harness.scenario.shipped import shipped_scenarios

    return shipped_scenarios()


def _planners() -> Iterable[str]:
    from planner.registry import planner_kinds

    return planner_kinds()


def _laws() -> Iterable[str]:
    from aircraft.guidance.registry import guidance_kinds

    return guidance_kinds()


def _aircraft() -> Iterable[str]:
    from aircraft.airframes import aircraft_names

    return aircraft_names()


_SCENARIO: Any = typer.Argument(
    metavar="SCENARIO",
    help="A file, or a name that `wayproof list scenarios` prints.",
    autocompletion=completing(_scenarios),
)
_AIRCRAFT: Any = typer.Option(
    metavar="NAME",
    help="A name that `wayproof list aircraft` prints, or a folder.",
    autocompletion=completing(_aircraft),
)
_KIND: Final = "or FILE.py:NAME, MODULE:NAME."
ScenarioArgument = Annotated[str, _SCENARIO]
OptionalScenario = Annotated[str | None, _SCENARIO]
AircraftName = Annotated[str, _AIRCRAFT]
AircraftOption = Annotated[str | None, _AIRCRAFT]
WorkersOption = Annotated[
    int | None, typer.Option(metavar="N", min=1, help="Flights at a time. Default: one a processor.")
]
OutOption = Annotated[
    Path | None, typer.Option(metavar="DIR", help="The folder to write. Default: one of its own in runs.")
]
QuietOption = Annotated[bool, flag("--quiet", "Print nothing but errors.")]
NoRecordingOption = Annotated[bool, flag("--no-recording", "Do not write flight.rrd.")]
ResumeOption = Annotated[bool, flag("--resume", "Fly only what is missing in DIR.")]
JsonOption = Annotated[bool, flag("--json", "Print the result as JSON, and nothing else.")]

REPLACING: Final[dict[str, Any]] = {
    "planner": Annotated[
        str | None,
        typer.Option(
            metavar="KIND", help=f"Replaces planner.kind; {_KIND}", autocompletion=completing(_planners)
        ),
    ],
    "aircraft": AircraftOption,
    "guidance": Annotated[
        str | None,
        typer.Option(
            metavar="KIND", help=f"Replaces guidance.kind; {_KIND}", autocompletion=completing(_laws)
        ),
    ],
    "conditions": Annotated[
        str | None,
        typer.Option(
            metavar="DAY",
            help="Replaces conditions: ideal, typical (an ordinary day), rough (the worst to fly).",
        ),
    ],
    "wind": Annotated[
        str | None, typer.Option(metavar="SPEED,FROM", help="Steady wind: m/s, degrees it blows from.")
    ],
    "turbulence": Annotated[
        str | None,
        typer.Option(metavar="INTENSITY", help="light, moderate or severe; or milspec:light, ..."),
    ],
    "seed": Annotated[int | None, typer.Option(metavar="N", help="Replaces seed.")],
    "settings": Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY.PATH=VALUE", help="Replaces any key of a scenario; can be repeated."
        ),
    ],
}
"""The options that replace keys of a scenario, by the name of the parameter."""


@dataclass(frozen=True)
class Given:
    """What the options of `REPLACING` replace in a scenario.

    Attributes:
        options: key paths and values (YAML) of the options but --set.
        settings: those of --set.
        planner: as given; None where none was.
        guidance: likewise.
    """

    options: tuple[tuple[str, str], ...] = ()
    settings: tuple[tuple[str, str], ...] = ()
    planner: str | None = None
    guidance: str | None = None

    @property
    def keys(self) -> list[tuple[str, str]]:
        """All of them, those of --set last."""
        return [*self.options, *self.settings]

    @property
    def sources(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Planners and laws of one's own: a process that flies has to import them too."""
        return sources(self.planner), sources(self.guidance)

    def plus(self, **keys: Any) -> Given:
        """With further values by key path, its points written as two underscores; None replaces nothing.

        Raises:
            typer.BadParameter: --set gives such a key another value.
        """
        named = {name.replace("__", "."): value for name, value in keys.items() if value is not None}
        more = [(name, json.dumps(value)) for name, value in named.items()]
        for name, value in self.settings:
            for key, other in more:
                if f"{key}.".startswith(f"{name}.") and value.strip() not in (other, other.strip('"')):
                    raise typer.BadParameter(
                        f"{name}={value[:60]} beside an option that gives {key} as {other}; leave one of them out",
                        param_hint="--set",
                    )
        return replace(self, options=(*self.options, *more))


NOTHING: Final = Given()


def replacing(*names: str) -> Callable[[Run], Callable[..., int]]:
    """Gives a command some options of `REPLACING`, which its parameter `given` has what they replace of."""

    def made(command: Run) -> Callable[..., int]:
        signature = inspect.signature(command, eval_str=True)
        kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
        own = [inspect.Parameter(name, kind, default=None, annotation=REPLACING[name]) for name in names]
        parameters = [
            option
            for each in signature.parameters.values()
            for option in (own if each.name == "given" else [each])
        ]

        @wraps(command)
        def run(**arguments: Any) -> int:
            texts = {name: arguments.pop(name) for name in names}
            return command(given=given_by(**texts), **arguments)

        run.__annotations__ = {each.name: each.annotation for each in parameters}
        run.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
        return run

    return made


def given_by(
    planner: str | None = None,
    guidance: str | None = None,
    aircraft: str | None = None,
    wind: str | None = None,
    turbulence: str | None = None,
    settings: Sequence[str] | None = None,
    seed: int | None = None,
    conditions: str | None = None,
) -> Given:
    """What the texts of options replace.

    Raises:
        typer.BadParameter: one cannot be used, or --set gives a key that another option gives with another value.
    """
    from harness.scenario.sections import SHIELDED

    is_shielded = planner is not None and planner.endswith(SHIELDED)
    begun = Given((), tuple(_setting(text) for text in settings or ()), planner, guidance)
    return begun.plus(
        planner__kind=planner and planner_kind(planner).removesuffix(SHIELDED),
        planner__shield="loiter" if is_shielded else None,
        aircraft__model=aircraft,
        guidance__kind=guidance and law_kind(guidance),
        environment__wind=wind and _wind(wind),
        environment__turbulence=turbulence and _turbulence(turbulence),
        seed=seed,
        conditions=conditions,
    )


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


def _wind(text: str) -> dict[str, float]:
    """The key `environment.wind` that --wind SPEED,FROM means."""
    try:
        speed, direction = (float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not SPEED,FROM such as 8,270", param_hint="--wind") from None
    return {"speed_mps": speed, "from_deg": direction}


def _turbulence(text: str) -> dict[str, str]:
    """The key `environment.turbulence` that --turbulence [MODEL:]INTENSITY means."""
    model, colon, intensity = text.rpartition(":")
    return {"model": model if colon else "tustin", "intensity": intensity}


def _setting(text: str) -> tuple[str, str]:
    """KEY.PATH=VALUE as its two parts."""
    name, equals, value = text.partition("=")
    if not equals:
        raise typer.BadParameter(f"{text[:60]!r} is not KEY.PATH=VALUE", param_hint="--set")
    return name.strip(), value


def planner_kind(text: str) -> str:
    """The kind that --planner means: FILE.py:NAME and MODULE:NAME are imported, and known by their name then."""
    from harness.scenario.given import PLANNER
    from harness.scenario.sections import SHIELDED

    shielded = SHIELDED if text.endswith(SHIELDED) else ""
    return _kind(text.removesuffix(SHIELDED), PLANNER, "--planner") + shielded


def law_kind(text: str) -> str:
    """The kind that --guidance means, likewise."""
    from harness.scenario.given import GUIDANCE

    return _kind(text, GUIDANCE, "--guidance")


def _kind(text: str, part: LoopPart, option: str) -> str:
    from harness.scenario.given import registered

    if text.endswith(".py") and text not in part.kinds():
        told = f"is {text}; must be one of {', '.join(part.kinds())}, or FILE.py:NAME as {text}:NAME"
        raise typer.BadParameter(told, param_hint=option)
    try:
        return registered(text, part)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint=option) from error


def sources(*names: str | None) -> tuple[str, ...]:
    """Those of some names that are FILE.py:NAME or MODULE:NAME: a process that flies has to import them too."""
    from harness.scenario.given import is_source
    from harness.scenario.sections import SHIELDED

    return tuple(name.removesuffix(SHIELDED) for name in names if name is not None and is_source(name))


def told_apart(settings: Sequence[tuple[str, str]], named: Sequence[str] = IN_THE_NAME) -> str:
    """What a default folder's name has at its end, so that runs which differ in settings do not replace one another.

    Args:
        settings: keys and values as given.
        named: keys that the folder is called after anyway.

    Returns:
        Eight digits after a dash, the same for the same settings; nothing without any.
    """
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
    """Ends with BAD_INPUT for a folder or an aircraft that cannot be used, and says after Ctrl-C what is left.

    Args:
        left: what became of what was begun, for the line after an interrupt.
    """
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
    """What became of a folder that was being written, for `faults_told`.

    Args:
        what: that was to be written: "run".
        folder: where.
        index: file of the folder that says whether it is complete.
        schema: of that file.
    """

    def left() -> str:
        from harness.files.input_file import read_index

        begun = read_index(folder / index, schema)
        if begun is not None and begun.get("complete") is False:
            return f"the {what} in {folder} is marked incomplete"
        return "nothing was written"

    return left


@contextmanager
def resumable(folder: Path, index: str) -> Iterator[None]:
    """The same for many flights, which --resume goes on with; a full disk or a cluster that is gone ends with FAILED.

    Args:
        folder: where they are kept.
        index: file of the folder that is there once something was begun.
    """
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
