"""What a certificate is about: a scenario, or a given path."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from harness.analysis.claims import CLAIMS, Claim
from harness.campaign.campaign_file import Base, absolute_paths, is_scenario
from harness.certification.days import Days, PathDays, Settings
from harness.files import strict_yaml
from harness.files.input_file import InputError
from harness.files.strict_yaml import Node
from harness.run.path_check import PathCheck, origin_of
from harness.run.path_check import asked as path_check
from harness.run_files.path_files import PathAsGiven, given_points, read_path
from harness.scenario.overrides import Given, changed, overridden
from harness.scenario.scenario import Scenario
from harness.scenario.shipped import scenario_path, shipped_scenarios

DEFAULT_AIRCRAFT: Final = "aerosonde"
DEFAULT_SEED: Final = 1
FORMS: Final = "KEY=LO:HI (evenly between), KEY=MEAN~SIGMA (Gaussian) or KEY=A,B,... (each as likely)"

Vary = Mapping[str, Any] | Sequence[str]


def distributions(vary: Vary) -> dict[str, dict[str, Any]]:
    """Varied quantities by key path, as a campaign file has them under `random`.

    Args:
        vary: texts KEY=DRAW; or by key path the text DRAW, `(low, high)`, or a distribution of a campaign file.

    Raises:
        ValueError: one is none of these, or is there twice.
    """
    found: dict[str, dict[str, Any]] = {}
    for each in vary.items() if isinstance(vary, Mapping) else vary:
        if isinstance(each, str):
            key, drawn = _distribution(each)
        elif isinstance(each[1], Mapping):
            key, drawn = each[0], dict(each[1])
        else:
            draw = each[1] if isinstance(each[1], str) else ":".join(map(str, each[1]))
            key, drawn = _distribution(f"{each[0]}={draw}")
        if key in found:
            raise ValueError(f"{key} is varied twice; leave one out")
        found[key] = drawn
    return found


def _distribution(text: str) -> tuple[str, dict[str, Any]]:
    """Key path and distribution of a text."""
    key, equals, values = (part.strip() for part in text.partition("="))
    if not (key and equals and values):
        raise ValueError(f"{text[:60]!r} is not {FORMS}")
    for sign, name in ((":", "uniform"), ("~", "normal")):
        parts = values.split(sign)
        if len(parts) == 2:
            first, second = (_number(part, text) for part in parts)
            return key, {name: [first, second] if name == "uniform" else {"mean": first, "sigma": second}}
    return key, {"choice": [_value(part) for part in values.split(",")]}


def _number(part: str, text: str) -> float:
    with suppress(ValueError):
        if math.isfinite(number := float(part)):
            return number
    raise ValueError(f"{text[:60]!r} is not {FORMS}: {part[:20]!r} is not a number")


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


@dataclass(frozen=True)
class Asked:
    """What is asked of many days.

    Attributes:
        subject: a scenario, its file or shipped name; or a path: a file of `wayproof check`, or points (n, 2).
        settings: keys of the scenario to replace, as `load_scenario` takes them.
        vary: as `Days` takes it.
        claim: what is claimed of each day; None: `reached`, of a path `as-given`.
        most: number of days that may be flown.
        sources: planners and guidance laws, as `CampaignRuns` takes them.
    """

    subject: Scenario | str | Path | Sequence[Sequence[float]]
    settings: Settings
    vary: Mapping[str, Mapping[str, Any]]
    claim: Claim | None
    most: int
    sources: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())

    def terms(self, default: Claim, seed: int) -> dict[str, Any]:
        """What `Days` is told besides."""
        return {"claim": self.claim or default, "seed": seed, "most": self.most, "sources": self.sources}


def days_of(asked: Asked, world: Path | None = None) -> Days:
    """The days of a scenario or of a given path.

    Args:
        asked: what is asked.
        world: of a path, a scenario file with obstacles, bounds and air.

    Raises:
        InputError: it cannot be flown so; the days themselves are not checked yet.
    """
    if asked.claim is not None and asked.claim not in CLAIMS:
        raise InputError(f"wayproof: the claim {asked.claim!r} is none of {', '.join(CLAIMS)}")
    subject = asked.subject
    if is_path(subject) and not isinstance(subject, Scenario):
        return _path_days(asked, subject, world)
    if world is not None:
        raise InputError("wayproof: a world goes with a path; a scenario is one already")
    assert isinstance(subject, Scenario | str | Path)
    return _scenario_days(asked, subject)


def _scenario_days(asked: Asked, subject: Scenario | str | Path) -> Days:
    if asked.claim == "as-given":
        raise InputError(
            "wayproof: the claim as-given is of a given path; give one, or reached, no-contact or trackable"
        )
    if isinstance(subject, Scenario):
        given: Given = subject.__dict__["_given"]
        place = f"{subject.name}.yaml", "scenario", given.folder or Path()
        base = _base(changed(given, {}), *place, asked.settings)
    else:
        path = scenario_path(str(subject))
        place = path.name, str(path), path.absolute().parent
        base = _base(strict_yaml.read(path), *place, asked.settings)
    seed = base.root.at(("seed",))
    root_seed = seed.value if seed is not None and type(seed.value) is int else DEFAULT_SEED
    return Days(base, asked.vary, **asked.terms("reached", root_seed))


def _base(root: Node, file: str, source: str, folder: Path, overrides: Settings) -> Base:
    return Base(file, source, absolute_paths(overridden(root, overrides), folder))


def _path_days(asked: Asked, subject: str | Path | Sequence[Sequence[float]], world: Path | None) -> Days:
    given, settings = dict(asked.settings), [each for each in asked.settings if each[0] != "aircraft.model"]
    model = json.loads(given["aircraft.model"]) if "aircraft.model" in given else DEFAULT_AIRCRAFT
    if "planner.kind" in given:
        raise InputError("wayproof: a planner goes with a scenario; a path is flown as given")
    if isinstance(subject, str | Path):
        path: PathAsGiven = read_path(Path(subject), "mission.altitude_m" in given, origin_of(world))
        content = Path(subject).read_bytes().hex()
    else:
        path, content = given_points(subject), repr([list(map(float, each)) for each in subject])
    content += repr((model, settings, world and world.read_text()))
    name = _name(subject)

    def ask(replaced: Settings) -> PathCheck:
        keys = [("aircraft.model", json.dumps(model)), *settings, *replaced]
        return path_check(path, keys, world=world, name=name)

    words = ["wayproof", "check", str(subject), "--aircraft", model]
    words += ["--scenario", str(world)] if world else []
    words += [word for pair in settings for word in ("--set", "=".join(pair))]
    seed = int(given.get("seed", DEFAULT_SEED))
    return PathDays(ask, content, words, asked.vary, **asked.terms("as-given", seed))


def _name(subject: object) -> str:
    stem = Path(subject).stem if isinstance(subject, str | Path) else "path"
    return (re.sub(r"[^a-z0-9._-]+", "-", stem.lower()).strip("-.") or "path")[:100]
