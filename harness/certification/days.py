"""The days of a certificate: a campaign whose cases are draws of one scenario, or of one given path."""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from statistics import NormalDist
from typing import Any, Final, Literal

import numpy as np

from harness.analysis.metric import Claim
from harness.campaign.campaign_file import Base, CampaignFile, Settings, absolute_paths, is_a, validated
from harness.campaign.flight import Job
from harness.campaign.results import LAW_KEY
from harness.campaign.runs import SEED_STREAM, CampaignRuns
from harness.files import strict_yaml
from harness.files.strict_yaml import COMMAND_LINE, InputError, Loc, node_of
from harness.flight.record import FloatArray, IntArray
from harness.run.path_check import CheckedFile
from harness.scenario.keys import NORMALS
from harness.scenario.scenario import Scenario, overridden
from harness.scenario.sections import UncertaintySpec
from harness.scenario.shipped import scenario_path, shipped_scenarios

DEFAULT_AIRCRAFT: Final = "aerosonde"  # aircraft that flies a path when none is named
DEFAULT_SEED: Final = 1  # root seed of the days when none is given
NO_DEVIATIONS: Final = ("uncertainty", json.dumps(dict.fromkeys(UncertaintySpec.model_fields, 0.0)))
DRAW_FORMS: Final = "KEY=LO:HI (evenly between), KEY=MEAN~SIGMA (Gaussian) or KEY=A,B,... (each as likely)"
LEAST_RARE_DAYS: Final = 520
"""A subset simulation of fewer days is refused: its pilot has no days for two levels. Each run begins with 15."""

Vary = Mapping[str, Mapping[str, Any]]


class Days(CampaignRuns):
    """The days of a scenario: a campaign in which every run has its own seed and its own draw of what varies."""

    def __init__(
        self,
        base: Base,
        vary: Vary,
        *,
        claim: Claim,
        seed: int,
        most: int,
        sources: tuple[tuple[str, ...], tuple[str, ...]] = ((), ()),
        purpose: Literal["counted", "band", "rare"] = "counted",
    ) -> None:
        """Prepares at most `most` days of a scenario, or raises InputError; nothing is flown.

        `vary`: what is drawn, as `random` of a campaign file. `band.json` is made of the tracks of all days of a band;
        rare ones are not drawn as they come, but given one after another (`give`).
        """
        rare, band = purpose == "rare", purpose == "band"
        if rare and claim == "reached":
            raise InputError("wayproof: --rare needs a margin: --claim no-contact, trackable or as-given")
        if rare and most < LEAST_RARE_DAYS:
            raise InputError(f"wayproof: --rare needs at least --runs {LEAST_RARE_DAYS}; 10,000 do for 1e-4")
        law = base.text(("guidance", "kind"), "") if sources[1] else ""
        plain = {
            "schema": "wayproof/campaign/1",
            "name": base.name,
            "seed": seed,
            "scenarios": [base.file],
            "set": {LAW_KEY: law} if law else {},
            "random": {key: dict(each) for key, each in vary.items()},
            "draws": most,
            "recordings": {"counted": "failures", "band": "all", "rare": "none"}[purpose],
            "optimum": False,
        }
        root, source = node_of(plain, COMMAND_LINE), "command line"
        super().__init__(CampaignFile(validated(root, source), source, root, (base,)), *sources)
        self.claim, self.vary, self.band, self.rare = claim, vary, band, rare
        self._draws: list[tuple[list[float], int]] = []
        self._fixed = base.root.at(("normals",)) is not None  # a scenario may say itself what its days draw
        self.normals = len(vary) + sum(NORMALS)  # of a given day: `vary`'s, then the scenario's
        self.grounded: dict[int, str] = {}  # why the aircraft that a day draws cannot fly, by its number
        self.can_grow = not (band or rare)  # the tracks of earlier days are gone; other days would follow

    def give(self, normals: FloatArray, seeds: IntArray) -> range:
        """Appends days by their standard normal numbers (n, d) and seeds (n,); returns their numbers."""
        begin = len(self._draws)
        self._draws += zip(normals.tolist(), seeds.tolist(), strict=True)
        return range(begin, len(self._draws))

    def check(self, progress: Callable[[int], None] | None = None) -> None:
        """Makes every scenario once, or where days are given the middle and the ends of what they draw."""
        if not self.rare:
            return super().check(progress)
        for number in self.give(np.full((3, self.normals), [[-4.0], [0.0], [4.0]]), np.arange(3)):
            self.files |= {each.path: each.sha256[:16] for each in self.scenario(number).sources or ()}
        self._draws.clear()
        self.grounded.clear()

    def _shares(self, case: int) -> list[float]:
        if not self.rare:
            return super()._shares(case)
        return [NormalDist().cdf(each) for each in self._draws[case][0][: len(self.vary)]]

    def _seed(self, case: int, stream: int = SEED_STREAM) -> int:
        return self._draws[case][1] if self.rare else super()._seed(case, stream)

    def _line(self, origin: Loc, sentence: str) -> str:
        return super()._line(origin[origin[:1] in (("random",), ("set",)) :], sentence)

    def _normals(self, number: int) -> list[tuple[str, str]]:
        if not self.rare or self._fixed:
            return []
        return [("normals", json.dumps(self._draws[number][0][len(self.vary) :]))]

    def scenario(self, number: int, overrides: Settings = ()) -> Scenario:
        """Makes the scenario of day `number`; its aircraft has no deviations where the one drawn cannot fly level."""
        try:
            return self._drawn_scenario(number, overrides)
        except InputError as error:
            _, is_deviation, why = str(error).partition("must be smaller: ")
            if not is_deviation:
                raise
            found = self._drawn_scenario(number, [*overrides, NO_DEVIATIONS])
            self.grounded[number] = why.rpartition(" (")[0]
            return found

    def _drawn_scenario(self, number: int, overrides: Settings) -> Scenario:
        return super().scenario(number, [*self._normals(number), *overrides])

    def job(self, number: int, folder: Path) -> Job:
        """Day `number` as it is handed to who flies it."""
        return replace(super().job(number, folder), cannot_fly=self.grounded.get(number, ""))

    def plain(self) -> dict[str, Any]:
        """Returns what is flown and what is claimed, as JSON has it."""
        return {**super().plain(), "claim": self.claim, **({"rare": True} if self.rare else {})}


class PathDays(Days):
    """The days on which a given path is flown."""

    def __init__(self, path: CheckedFile, vary: Vary, **terms: Any) -> None:
        """Prepares the days; nothing is flown. `terms` are those of `Days`; the root seed is the scenario's."""
        self._path = path
        scenario = path.prepared().scenario
        keys = {"schema": "wayproof/scenario/1", "name": scenario.name, "planner": {"kind": "given"}}
        keys |= {"aircraft": {"model": scenario.aircraft.model}, "conditions": scenario.conditions}
        base = Base(scenario.name, str(path.world or ""), node_of(keys, COMMAND_LINE))
        super().__init__(base, vary, seed=scenario.seed, **{**terms, "sources": ((), path.laws)})
        self._fixed = scenario.normals is not None

    def _settings(self, number: int) -> list[tuple[str, str]]:
        """Returns the keys that day `number` replaces, and their values as YAML."""
        day, kind_first = self.cells(number), sorted(self.varied, key=LAW_KEY.__ne__)
        return [*((key, json.dumps(day[key])) for key in ("seed", *kind_first)), *self._normals(number)]

    def _drawn_scenario(self, number: int, overrides: Settings) -> Scenario:
        try:
            return self._path.prepared([*self._settings(number), *overrides]).scenario
        except InputError as error:
            raise InputError(f"{error} (day {number})") from error

    def job(self, number: int, folder: Path) -> Job:
        """Day `number` as it is handed to who flies it."""
        job = super().job(number, folder)
        return job if job.cannot_fly else replace(job, path=self._path.prepared(self._settings(number)))

    def again(self, number: int, folder: Path) -> str:
        """Returns the command that flies day `number` again."""
        return shlex.join(self._path.command(self._settings(number)))

    def plain(self) -> dict[str, Any]:
        """Returns what is flown and what is claimed, as JSON has it."""
        return {**super().plain(), "path": self._path.digest}


def distributions(vary: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Parses texts KEY=DRAW into distributions by key path, as `random` of a campaign file; or a ValueError."""
    found: dict[str, dict[str, Any]] = {}
    for each in vary:
        name, _, draw = each.partition("=")
        if (key := name.strip()) in found:
            raise ValueError(f"{key} is varied twice; leave one out")
        found[key] = _distribution(key, draw.strip())
    return found


def _distribution(key: str, text: str) -> dict[str, Any]:
    """Parses the DRAW of a key; the ValueError of a bad one tells the forms that there are."""
    fault = f"{f'{key}={text}'[:60]!r} is not {DRAW_FORMS}"
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


def is_path(subject: str) -> bool:
    """Whether a command's argument is the file of a path, and not a scenario or the name of one."""
    if subject in shipped_scenarios() or Path(subject).suffix in (".yaml", ".yml", ""):
        return False
    return not is_a("scenario", Path(subject))


def days_of(
    subject: str, settings: Settings, vary: Vary, claim: Claim | None, world: Path | None, **terms: Any
) -> Days:
    """Prepares the days of a scenario (file or shipped name) or of a given path, not checked yet; or an InputError.

    `settings`: keys of the scenario to replace, as `load_scenario` takes them; `claim`: by default `reached`, of a path
    `as-given`; `world`: of a path, a scenario file with obstacles, bounds and air; `terms`: as `Days` takes them.
    """
    if is_path(subject):
        if "planner.kind" in (given := dict(settings)):
            raise InputError("wayproof: a planner goes with a scenario; a path is flown as given")
        keys = settings if "aircraft.model" in given else [("aircraft.model", DEFAULT_AIRCRAFT), *settings]
        file = CheckedFile(Path(subject), keys, world, laws=terms["sources"][1])
        return PathDays(file, vary, claim=claim or "as-given", **terms)
    if world is not None:
        raise InputError("wayproof: a world goes with a path; a scenario is one already")
    if claim == "as-given":
        reason = "the claim as-given is of a given path"
        raise InputError(f"wayproof: {reason}; give one, or reached, no-contact or trackable")
    path = scenario_path(subject)
    root = overridden(strict_yaml.read(path), settings)
    seed = root.at(("seed",))
    root_seed = seed.value if seed is not None and type(seed.value) is int else DEFAULT_SEED
    base = Base(path.name, str(path), absolute_paths(root, path.absolute().parent))
    return Days(base, vary, claim=claim or "reached", seed=root_seed, **terms)
