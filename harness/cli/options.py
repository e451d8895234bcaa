"""What the commands share: their arguments, how they load a scenario, what they print, their exit status."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer
from typer.core import TyperCommand, TyperGroup

from harness.cli.standard_output import say
from harness.files.wording import printable

if TYPE_CHECKING:
    from harness.scenario.given import LoopPart
    from harness.scenario.scenario import Scenario

FAILED: Final = 1
BAD_INPUT: Final = 2
IN_THE_NAME: Final = ("name", "seed", "planner.kind", "aircraft.model")
"""Keys that the default folder of a run is called after; of a model that is a folder, by the folder's last name."""


class Command(TyperCommand):
    """A command whose help shows no type for what takes no value, and paragraphs without the source's line breaks."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.help = re.sub(r"(?<!\n)\n(?!\n)", " ", cleandoc(self.help or ""))

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


def _shipped(incomplete: str) -> list[str]:
    """Names for the shell to complete a scenario with; files it finds itself."""
    from harness.scenario.shipped import shipped_scenarios

    return [name for name in shipped_scenarios() if name.startswith(incomplete)]


def planners(incomplete: str) -> list[str]:
    """Kinds for the shell to complete a planner with."""
    from planner.registry import planner_kinds

    return [kind for kind in planner_kinds() if kind.startswith(incomplete)]


def laws(incomplete: str) -> list[str]:
    """Kinds for the shell to complete a guidance law with."""
    from aircraft.guidance.registry import guidance_kinds

    return [kind for kind in guidance_kinds() if kind.startswith(incomplete)]


def aircraft(incomplete: str) -> list[str]:
    """Names for the shell to complete an aircraft with."""
    from aircraft.airframes import aircraft_names

    return [name for name in aircraft_names() if name.startswith(incomplete)]


_SCENARIO: Any = typer.Argument(
    metavar="SCENARIO",
    help="A file, or a name that `wayproof list scenarios` prints.",
    autocompletion=_shipped,
)
ScenarioArgument = Annotated[str, _SCENARIO]
OptionalScenario = Annotated[str | None, _SCENARIO]
PlannerOption = Annotated[
    str | None,
    typer.Option(
        metavar="KIND",
        help="Replaces planner.kind; or FILE.py:NAME, MODULE:NAME.",
        autocompletion=planners,
    ),
]
AircraftOption = Annotated[
    str | None, typer.Option(metavar="NAME", help="Replaces aircraft.model.", autocompletion=aircraft)
]
GuidanceOption = Annotated[
    str | None,
    typer.Option(
        metavar="KIND", help="Replaces guidance.kind; or FILE.py:NAME, MODULE:NAME.", autocompletion=laws
    ),
]
ConditionsOption = Annotated[
    str | None,
    typer.Option(
        metavar="DAY", help="Replaces conditions: ideal, typical (an ordinary day), rough (the worst to fly)."
    ),
]
SeedOption = Annotated[int | None, typer.Option(metavar="N", help="Replaces seed.")]
SettingsOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY.PATH=VALUE", help="Replaces any key; can be repeated."),
]
WindOption = Annotated[
    str | None, typer.Option(metavar="SPEED,FROM", help="Steady wind: m/s, degrees it blows from.")
]
TurbulenceOption = Annotated[
    str | None, typer.Option(metavar="INTENSITY", help="light, moderate or severe; or milspec:light, ...")
]
WorkersOption = Annotated[
    int | None, typer.Option(metavar="N", min=1, help="Flights at a time. Default: one a processor.")
]
JsonOption = Annotated[bool, flag("--json", "Print the result as JSON, and nothing else.")]


def load(scenario: str, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """A scenario by file or shipped name, with keys replaced."""
    from harness.files.strict_yaml import InputError
    from harness.scenario.scenario import load_scenario
    from harness.scenario.shipped import scenario_path

    try:
        return load_scenario(scenario_path(scenario), overrides)
    except InputError as error:
        if _is_campaign(scenario):
            use = shlex.join(["wayproof", "sweep", scenario])
            raise InputError(f"{scenario}: this is a campaign: use `{use}`") from error
        raise


def _is_campaign(text: str) -> bool:
    """Whether what was given for a scenario is a campaign's file or name."""
    import os

    from harness.campaign.campaign_file import is_campaign
    from harness.files.strict_yaml import InputError
    from harness.scenario.shipped import campaign_path

    try:
        return os.path.isfile(campaign_path(text)) and is_campaign(campaign_path(text))
    except (InputError, OSError):
        return False


def chosen(
    planner: str | None = None,
    aircraft: str | None = None,
    seed: int | None = None,
    guidance: str | None = None,
    conditions: str | None = None,
) -> list[tuple[str, str]]:
    """What the options replace; a name is text, whatever YAML takes it for."""
    import json

    given = {
        "planner.kind": planner and planner_kind(planner),
        "aircraft.model": aircraft,
        "seed": seed,
        "guidance.kind": guidance and law_kind(guidance),
        "conditions": conditions,
    }
    return [(key, json.dumps(value)) for key, value in given.items() if value is not None]


def air(wind: str | None, turbulence: str | None, conditions: str | None = None) -> list[tuple[str, str]]:
    """What --wind, --turbulence and --conditions replace."""
    import json

    given = {
        "environment.wind": wind_of(wind),
        "environment.turbulence": turbulence_of(turbulence),
    }
    return [(key, json.dumps(value)) for key, value in given.items() if value is not None]


def wind_of(text: str | None) -> dict[str, float] | None:
    """The key `environment.wind` that --wind SPEED,FROM means; None where it is not given.

    Raises:
        typer.BadParameter: it is no such text.
    """
    if text is None:
        return None
    try:
        speed, direction = (float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not SPEED,FROM such as 8,270", param_hint="--wind") from None
    return {"speed_mps": speed, "from_deg": direction}


def turbulence_of(text: str | None) -> dict[str, str] | None:
    """The key `environment.turbulence` that --turbulence [MODEL:]INTENSITY means; None where it is not given."""
    if text is None:
        return None
    model, colon, intensity = text.rpartition(":")
    return {"model": model if colon else "tustin", "intensity": intensity}


def planner_kind(text: str) -> str:
    """The kind that --planner means: FILE.py:NAME and MODULE:NAME are imported, and known by their name then."""
    from harness.scenario.given import PLANNER
    from harness.scenario.sections import SHIELDED

    shielded = SHIELDED if text.endswith(SHIELDED) else ""
    return _kind(text.removesuffix(SHIELDED), PLANNER, "--planner") + shielded


def sources(*names: str | None) -> tuple[str, ...]:
    """Those of some names that are FILE.py:NAME or MODULE:NAME: a process that flies has to import them too."""
    from harness.scenario.given import is_source

    return tuple(name for name in names if name is not None and is_source(name))


def law_kind(text: str) -> str:
    """The kind that --guidance means, likewise."""
    from harness.scenario.given import GUIDANCE

    return _kind(text, GUIDANCE, "--guidance")


def _kind(text: str, part: LoopPart, option: str) -> str:
    from harness.scenario.given import registered

    try:
        return registered(text, part)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint=option) from error


def _setting(text: str) -> tuple[str, str]:
    """KEY.PATH=VALUE as its two parts."""
    name, equals, value = text.partition("=")
    if not equals:
        raise typer.BadParameter(f"{text[:60]!r} is not KEY.PATH=VALUE", param_hint="--set")
    return name.strip(), value


def settings_of(texts: Sequence[str] | None, options: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """What --set replaces, beside what other options do.

    Args:
        texts: KEY.PATH=VALUE, each.
        options: key paths and values of the other options.

    Raises:
        typer.BadParameter: one is no such text, or its key is given by another option with another value.
    """
    found = [_setting(text) for text in texts or ()]
    for name, value in found:
        for key, other in options:
            if f"{key}.".startswith(f"{name}.") and value.strip() not in (other, other.strip('"')):
                raise typer.BadParameter(
                    f"{name}={value[:60]} beside an option that gives {key} as {other}; leave one of them out",
                    param_hint="--set",
                )
    return found


def straight_m(scenario: Scenario) -> float:
    """From start to goal, m: what a progress bar counts off."""
    import math

    return math.dist(scenario.mission.start_m, scenario.mission.goal_m)


def bad_input(error: ValueError) -> Exception:
    """A fault of what was given, as the error that ends with BAD_INPUT."""
    from harness.files.strict_yaml import InputError

    return InputError(f"wayproof: {error}")


def told_apart(settings: Sequence[tuple[str, str]], named: Sequence[str] = IN_THE_NAME) -> str:
    """What a default folder's name has at its end, so that runs which differ in settings do not replace one another.

    Args:
        settings: keys and values as given.
        named: keys that the folder is called after anyway.

    Returns:
        Eight digits after a dash, the same for the same settings; nothing without any.
    """
    import json
    from hashlib import sha256

    from harness.files.strict_yaml import as_spelt

    spelt = [(as_spelt(key), value.strip()) for key, value in settings]
    others = [(key, value) for key, value in spelt if key not in named or "/" in value]
    return f"-{sha256(json.dumps(others).encode()).hexdigest()[:8]}" if others else ""


def tell_interrupted(what: str, folder: Path, index: str, schema: str) -> None:
    """Says after Ctrl-C what became of a folder.

    Args:
        what: that was to be written: "run".
        folder: where.
        index: file of the folder that says whether it is complete.
        schema: of that file.
    """
    from harness.files.input_file import read_index

    begun = read_index(folder / index, schema)
    left = (
        f"the {what} in {folder} is marked incomplete"
        if begun is not None and begun.get("complete") is False
        else "nothing was written"
    )
    say(f"wayproof: interrupted; {left}", err=True)


def print_json(content: Any) -> None:
    """Prints a result for scripts."""
    import json

    text = json.dumps(content, indent=2, ensure_ascii=False)
    if printable(text) != text:
        # JSON has spelt out what ASCII has of them; what say() would make of the others is no JSON.
        text = "".join(c if c == printable(c) else f"\\u{ord(c):04x}" for c in text)
    say(text)
