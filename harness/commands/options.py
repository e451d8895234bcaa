"""What the commands share: their arguments, how they load a scenario, what they print, their exit status."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

if TYPE_CHECKING:
    from harness.scenario import Scenario

FAILED: Final = 1
BAD_INPUT: Final = 2


def flag(name: str, text: str) -> Any:
    """An option without a value; the empty metavar keeps the help from showing a type for it."""
    return typer.Option(name, metavar=" ", help=text)


ScenarioArgument = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="A file, or a name that `wayproof list scenarios` prints.")
]
JsonOption = Annotated[bool, flag("--json", "Print the result as JSON, and nothing else.")]


def load(scenario: str, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """A scenario by file or shipped name, with keys replaced."""
    from harness.scenario import load_scenario
    from harness.shipped import scenario_path

    return load_scenario(scenario_path(scenario), overrides)


def setting(text: str) -> tuple[str, str]:
    """KEY.PATH=VALUE as its two parts."""
    name, equals, value = text.partition("=")
    if not equals:
        raise typer.BadParameter(f"{text!r} is not KEY.PATH=VALUE", param_hint="--set")
    return name.strip(), value


def straight_m(scenario: Scenario) -> float:
    """From start to goal, m: what a progress bar counts off."""
    import math

    return math.dist(scenario.mission.start_m, scenario.mission.goal_m)


def bad_input(error: ValueError) -> Exception:
    """A fault of what was given, as the error that ends with BAD_INPUT."""
    from harness.strict_yaml import InputError

    return InputError(f"wayproof: {error}")


def print_json(content: Any) -> None:
    """Prints a result for scripts."""
    import json

    typer.echo(json.dumps(content, indent=2, ensure_ascii=False))
