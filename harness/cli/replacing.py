"""The options of commands that replace keys of a scenario, and the replacements that they give."""

from __future__ import annotations

import inspect
import itertools
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import wraps
from typing import Annotated, Any, Final, Literal, TypeVar

import typer

from harness.cli.options import AircraftOption, Count, Text, option

Run = TypeVar("Run", bound=Callable[..., int])
_KIND_HELP: Final = "Replaces {}.kind; or FILE.py:NAME, MODULE:NAME."
_DAY_HELP: Final = "Replaces conditions: ideal, typical (an ordinary day), rough (the worst to fly)."
_ANY_HELP: Final = "Replaces any key of a scenario; can be repeated."

REPLACING: Final[dict[str, Any]] = {
    "planner": Annotated[Text, option("KIND", _KIND_HELP.format("planner"))],
    "aircraft": AircraftOption,
    "guidance": Annotated[Text, option("KIND", _KIND_HELP.format("guidance"))],
    "conditions": Annotated[Text, option("DAY", _DAY_HELP)],
    "wind": Annotated[Text, option("SPEED,FROM", "Steady wind: m/s, degrees it blows from.")],
    "turbulence": Annotated[Text, option("INTENSITY", "light, moderate or severe; or milspec:light, ...")],
    "seed": Annotated[Count, option("N", "Replaces seed.")],
    "settings": Annotated[list[str] | None, option("KEY.PATH=VALUE", _ANY_HELP, "--set")],
}
"""Options that replace keys of a scenario, by the name of the parameter."""


@dataclass(frozen=True)
class Given:
    """Replacements in a scenario that the options of `REPLACING` give: key paths, and values as YAML."""

    options: tuple[tuple[str, str], ...] = ()
    settings: tuple[tuple[str, str], ...] = ()  # the replacements by --set
    planner: str | None = None
    guidance: str | None = None

    @property
    def keys(self) -> list[tuple[str, str]]:
        """All replacements, those by --set last."""
        return [*self.options, *self.settings]

    @property
    def sources(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Planners and laws given as FILE.py:NAME or MODULE:NAME, which a process that flies has to import too."""
        from harness.scenario.kinds import imported_sources

        return imported_sources(self.planner), imported_sources(self.guidance)

    def plus(self, **keys: Any) -> Given:
        """Adds values by key path, its points written as two underscores; None replaces nothing.

        A BadParameter says that --set gives such a key another value, an InputError that its value is no YAML.
        """
        named = {name.replace("__", "."): value for name, value in keys.items() if value is not None}
        more = [(name, json.dumps(value)) for name, value in named.items()]
        known = [
            (f"{name}.{part}" if part else name, json.dumps(of))
            for name, value in named.items()
            for part, of in (value.items() if isinstance(value, dict) else [("", value)])
        ]
        from harness.files.strict_yaml import parse

        for name, value in self.settings:
            for key, other in (each for each in known if f"{each[0]}.".startswith(f"{name}.")):
                if not value.strip() or parse(value, "--set").plain() != parse(other, "--set").plain():
                    raise typer.BadParameter(
                        f"{name}={value[:60]} beside an option that gives {key} as {other}; leave one of them out",
                        param_hint="--set",
                    )
        return replace(self, options=(*self.options, *more))

    def check_beside(self, varied: Iterable[str]) -> None:
        """Raises BadParameter where a varied key, one above or below it, or of a varied kind, is given a value too."""
        for key, (name, value) in itertools.product(varied, self.keys):
            one, other = f"{_place(key)}.", f"{_place(name)}."
            if one.startswith(other) or other.startswith(one) or _drops(one[:-1], other[:-1]):
                text = f"{key}: {name} is given a value too, {value.strip()[:60]}; give one of them"
                raise typer.BadParameter(text, param_hint="--vary")


NOTHING: Final = Given()  # settings that replace nothing


def replacing(*names: str) -> Callable[[Run], Callable[..., int]]:
    """Adds options of `REPLACING` to a command, whose parameter `given` gets the replacements."""

    def made(command: Run) -> Callable[..., int]:
        signature = inspect.signature(command, eval_str=True)
        kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
        own = [inspect.Parameter(name, kind, default=None, annotation=REPLACING[name]) for name in names]
        listed = signature.parameters.values()
        parameters = [p for each in listed for p in (own if each.name == "given" else [each])]

        @wraps(command)
        def run(**arguments: Any) -> int:
            return command(given=given_by(**{name: arguments.pop(name) for name in names}), **arguments)

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
    """Collects what the options replace; raises BadParameter where a text cannot be used or contradicts --set."""
    from harness.scenario.sections import SHIELDED

    return Given((), _settings(settings or ()), planner, guidance).plus(
        planner__kind=planner and kind_of(planner).removesuffix(SHIELDED),
        planner__shield="loiter" if planner is not None and planner.endswith(SHIELDED) else None,
        aircraft__model=aircraft,
        guidance__kind=guidance and kind_of(guidance, "guidance"),
        environment__wind=wind and _wind(wind),
        **_turbulence(turbulence),
        seed=seed,
        conditions=conditions,
    )


def _wind(text: str) -> dict[str, float]:
    try:
        speed, direction = (float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not SPEED,FROM such as 8,270", param_hint="--wind") from None
    return {"speed_mps": speed, "from_deg": direction}


def _turbulence(text: str | None) -> dict[str, str]:
    """Returns the keys that --turbulence [MODEL:]INTENSITY replaces; without a MODEL the scenario's stays."""
    model, colon, intensity = (text or "").rpartition(":")
    given = {"intensity": intensity} | ({"model": model} if colon else {})
    return {f"environment__turbulence__{key}": value for key, value in given.items() if text}


def _drops(place: str, other: str) -> bool:
    """Whether the first key is the kind of a planner or a law, and the second one an own key of one."""
    from harness.scenario.sections import GuidanceSpec, PlannerSpec

    shared = {"planner.kind": PlannerSpec.model_fields, "guidance.kind": GuidanceSpec.model_fields}
    section, _, key = other.partition(".")
    return place in shared and place == f"{section}.kind" and key not in ("", *shared[place])


def _place(name: str) -> str:
    """Returns a key path with its indices between points."""
    return name.replace("[", ".").replace("]", "")


def _settings(texts: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """Splits each KEY.PATH=VALUE into its two parts; a BadParameter says that one replaces another before it."""
    found: list[tuple[str, str]] = []
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            raise typer.BadParameter(f"{text[:60]!r} is not KEY.PATH=VALUE", param_hint="--set")
        name, place = name.strip(), _place(name.strip())
        for other, before in found:
            there = _place(other)
            own, same = _drops(place, there), there == place and value.strip() == before.strip()
            if own or (f"{there}.".startswith(f"{place}.") and not same):
                conflict = f"{name}={value[:60]} {'drops' if own else 'replaces'} {other}={before[:60]}"
                wanted = f"put {name} first" if own else "leave one of them out"
                raise typer.BadParameter(f"{conflict}, which stands before it; {wanted}", param_hint="--set")
        found.append((name, value))
    return tuple(found)


def kind_of(text: str, name: Literal["planner", "guidance"] = "planner") -> str:
    """Returns the kind for --planner or --guidance; imports FILE.py:NAME and MODULE:NAME, then known as NAME."""
    from harness.scenario.kinds import GUIDANCE, PLANNER, registered
    from harness.scenario.sections import SHIELDED

    part = PLANNER if name == "planner" else GUIDANCE
    shielded = SHIELDED if part is PLANNER and text.endswith(SHIELDED) else ""
    text = text.removesuffix(shielded)
    if shielded and (not text or text.endswith(SHIELDED)):
        raise typer.BadParameter(f"is {text + shielded}; must be one kind, then {SHIELDED}", param_hint=f"--{name}")
    if text.endswith(".py") and text not in part.known():
        reason = f"is {text}; must be one of {', '.join(part.known())}, or FILE.py:NAME as {text}:NAME"
        raise typer.BadParameter(reason, param_hint=f"--{name}")
    try:
        return registered(text, part) + shielded
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint=f"--{name}") from error
