"""The days of a certificate: a campaign whose cases are draws of one scenario, or of one given path.

Day k has a seed of its own and a draw of every varied quantity, both from the root seed and k alone.
"""

from __future__ import annotations

import json
import math
import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

from harness.analysis.metric import CLAIMS, Claim
from harness.campaign.campaign_file import Base, CampaignFile, absolute_paths, is_scenario, validated
from harness.campaign.flight import Job
from harness.campaign.runs import CampaignRuns
from harness.files import strict_yaml
from harness.files.strict_yaml import COMMAND_LINE, InputError, node_of
from harness.run.path_check import PathCheck, origin_of
from harness.run.path_check import asked as path_check
from harness.run_files.path_files import PathAsGiven, given_points, read_path
from harness.scenario.scenario import Given, Scenario, changed, overridden
from harness.scenario.shipped import scenario_path, shipped_scenarios

DEFAULT_AIRCRAFT: Final = "aerosonde"
DEFAULT_SEED: Final = 1
FORMS: Final = "KEY=LO:HI (evenly between), KEY=MEAN~SIGMA (Gaussian) or KEY=A,B,... (each as likely)"

Settings = Sequence[tuple[str, str]]
Vary = Mapping[str, Mapping[str, Any]]
Subject = Scenario | str | Path | Sequence[Sequence[float]]


class Days(CampaignRuns):
    """The days of a scenario."""

    def __init__(
        self,
        base: Base,
        vary: Vary,
        *,
        claim: Claim,
        seed: int,
        most: int,
        sources: tuple[tuple[str, ...], tuple[str, ...]] = ((), ()),
        band: bool = False,
    ) -> None:
        """Makes at most so many days of a scenario, or raises InputError; nothing is flown.

        `vary`: what is drawn by key path, as `random` of a campaign file.
        `sources`: planners and guidance laws, as `CampaignRuns` takes them.
        `band`: whether `band.json` is made of the tracks of all days.
        """
        plain = {
            "schema": "wayproof/campaign/1",
            "name": base.name,
            "seed": seed,
            "scenarios": [base.file],
            "random": {key: dict(each) for key, each in vary.items()},
            "draws": most,
            "recordings": "all" if band else "failures",
            "optimum": False,
        }
        root, source = node_of(plain, COMMAND_LINE), "command line"
        super().__init__(CampaignFile(validated(root, source), source, root, (base,)), *sources)
        self.claim, self.vary, self.band = claim, vary, band
        self.can_grow = not band  # the tracks of earlier days are gone

    def plain(self) -> dict[str, Any]:
        """All that says what is flown, and what is claimed."""
        return {**super().plain(), "claim": self.claim}


class PathDays(Days):
    """The days on which a given path is flown."""

    def __init__(
        self,
        ask: Callable[[Settings], PathCheck],
        content: str,
        command: Sequence[str],
        vary: Vary,
        **terms: Any,
    ) -> None:
        """Makes the days; nothing is flown.

        `ask`: puts together what the path is flown with, some keys of its scenario replaced.
        `content`: all that the path consists of, as text; a change of it makes other days.
        `command`: words of the command that flies the path, without those that differ between days.
        `terms`: as `Days` takes them, but for the root seed: that is the scenario's.
        """
        self._ask, self._command = ask, command
        self._digest = sha256(content.encode()).hexdigest()
        scenario = ask(()).scenario
        keys = {
            "schema": "wayproof/scenario/1",
            "name": scenario.name,
            "aircraft": {"model": scenario.aircraft.model},
            "planner": {"kind": "given"},
        }
        super().__init__(
            Base(scenario.name, "command line", node_of(keys, COMMAND_LINE)),
            vary,
            seed=scenario.seed,
            **terms,
        )

    def _settings(self, number: int) -> list[tuple[str, str]]:
        """The keys that day `number` replaces, and their values as YAML."""
        day = self.run(number)
        return [("seed", str(day.seed)), *((key, json.dumps(value)) for key, value in day.varied.items())]

    def scenario(self, number: int, overrides: Settings = ()) -> Scenario:
        """The scenario of day `number`, complete."""
        try:
            return self._ask([*self._settings(number), *overrides]).scenario
        except InputError as error:
            raise InputError(f"{error} (day {number})") from error

    def job(self, number: int, folder: Path) -> Job:
        """Day `number` as it is handed to who flies it."""
        return replace(super().job(number, folder), path=self._ask(self._settings(number)))

    def again(self, number: int, folder: Path) -> str:
        """The command that flies day `number` again."""
        words = [word for pair in self._settings(number) for word in ("--set", "=".join(pair))]
        return shlex.join([*self._command, *words])

    def plain(self) -> dict[str, Any]:
        """All that says what is flown, and what is claimed."""
        return {**super().plain(), "path": self._digest}


def distributions(vary: Mapping[str, Any] | Sequence[str]) -> dict[str, dict[str, Any]]:
    """Varied quantities by key path, as a campaign file has them under `random`; a ValueError where one is none.

    `vary`: texts KEY=DRAW; or by key path the text DRAW, `(low, high)`, or a distribution of a campaign file.
    """
    found: dict[str, dict[str, Any]] = {}
    pairs = vary.items() if isinstance(vary, Mapping) else (each.partition("=")[::2] for each in vary)
    for name, draw in pairs:
        key = name.strip()
        if key in found:
            raise ValueError(f"{key} is varied twice; leave one out")
        found[key] = dict(draw) if isinstance(draw, Mapping) else _distribution(key, draw)
    return found


def _distribution(key: str, draw: str | Sequence[float]) -> dict[str, Any]:
    """The distribution that a text, or a pair of numbers, means."""
    text = draw.strip() if isinstance(draw, str) else ":".join(map(str, draw))
    fault = f"{f'{key}={text}'[:60]!r} is not {FORMS}"
    if not key or not text:
        raise ValueError(fault)
    for sign in (":", "~"):
        first, found, second = text.partition(sign)
        if found and sign not in second:
            try:
                numbers = [float(first), float(second)]
            except ValueError:
                numbers = [math.nan]
            if not all(map(math.isfinite, numbers)):
                raise ValueError(f"{fault}: it needs two numbers")
            mean, sigma = numbers
            return {"uniform": numbers} if sign == ":" else {"normal": {"mean": mean, "sigma": sigma}}
    return {"choice": [_value(part) for part in text.split(",")]}


def _value(part: str) -> Any:
    with suppress(ValueError):
        return json.loads(part)
    return part.strip()


def is_path(subject: object) -> bool:
    """Whether something is a given path, and not a scenario or the name of one."""
    if isinstance(subject, Scenario):
        return False
    if not isinstance(subject, str | Path):
        return True
    if str(subject) in shipped_scenarios() or Path(subject).suffix in (".yaml", ".yml", ""):
        return False
    return not is_scenario(Path(subject))


def days_of(
    subject: Subject, settings: Settings, vary: Vary, claim: Claim | None, world: Path | None, **terms: Any
) -> Days:
    """The days of a scenario or of a given path, or an InputError; the days themselves are not checked yet.

    `subject`: a scenario, its file or shipped name; or a path: a file of `wayproof check`, or points (n, 2).
    `settings`: keys of the scenario to replace, as `load_scenario` takes them.
    `claim`: what is claimed of each day; None: `reached`, of a path `as-given`.
    `world`: of a path, a scenario file with obstacles, bounds and air.
    `terms`: `most` and `sources`, as `Days` takes them.
    """
    if claim is not None and claim not in CLAIMS:
        raise InputError(f"wayproof: the claim {claim!r} is none of {', '.join(CLAIMS)}")
    if is_path(subject) and not isinstance(subject, Scenario):
        return _path_days(subject, settings, vary, world, {**terms, "claim": claim or "as-given"})
    if world is not None:
        raise InputError("wayproof: a world goes with a path; a scenario is one already")
    if claim == "as-given":
        raise InputError(
            "wayproof: the claim as-given is of a given path; give one, or reached, no-contact or trackable"
        )
    base = _base(subject, settings)
    seed = base.root.at(("seed",))
    root_seed = seed.value if seed is not None and type(seed.value) is int else DEFAULT_SEED
    return Days(base, vary, claim=claim or "reached", seed=root_seed, **terms)


def _base(subject: Subject, settings: Settings) -> Base:
    """A scenario, or that of a file, with keys replaced."""
    if isinstance(subject, Scenario):
        given: Given = subject.__dict__["_given"]
        root, file, source = changed(given, {}), f"{subject.name}.yaml", "scenario"
        folder = given.folder or Path()
    else:
        path = scenario_path(str(subject))
        root, file, source, folder = strict_yaml.read(path), path.name, str(path), path.absolute().parent
    return Base(file, source, absolute_paths(overridden(root, settings), folder))


def _path_days(
    subject: str | Path | Sequence[Sequence[float]],
    settings: Settings,
    vary: Vary,
    world: Path | None,
    terms: Mapping[str, Any],
) -> Days:
    given, others = dict(settings), [each for each in settings if each[0] != "aircraft.model"]
    named = given.get("aircraft.model", DEFAULT_AIRCRAFT)
    model = strict_yaml.parse(named, "command line: aircraft.model").plain()
    if "planner.kind" in given:
        raise InputError("wayproof: a planner goes with a scenario; a path is flown as given")
    if isinstance(subject, str | Path):
        path: PathAsGiven = read_path(Path(subject), "mission.altitude_m" in given, origin_of(world))
        stem, content = Path(subject).stem, Path(subject).read_bytes().hex()
    else:
        path, stem = given_points(subject), "path"
        content = repr([list(map(float, each)) for each in subject])
    content += repr((model, others, world and world.read_text()))
    name = (re.sub(r"[^a-z0-9._-]+", "-", stem.lower()).strip("-.") or "path")[:100]

    def ask(replaced: Settings) -> PathCheck:
        return path_check(
            path, [("aircraft.model", json.dumps(model)), *others, *replaced], world=world, name=name
        )

    words = ["wayproof", "check", str(subject), "--aircraft", model]
    words += ["--scenario", str(world)] if world else []
    words += [word for pair in others for word in ("--set", "=".join(pair))]
    return PathDays(ask, content, words, vary, **terms)
