"""Campaign files: the type that is the file format, and reading one with the scenario files that it names."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final, Literal, TypeAlias

from pydantic import BeforeValidator, Field, Strict, ValidationError, model_validator

from harness.campaign.sampling import Distribution
from harness.files import strict_yaml
from harness.files.strict_yaml import COMMAND_LINE, InputError, Loc, Node, fault_line, node_of
from harness.scenario.files_resolved import file_beside
from harness.scenario.generators import WorldSpec
from harness.scenario.kinds import is_source, planner_kinds
from harness.scenario.resolving import model_or_folder
from harness.scenario.sections import AircraftSpec, PlannerSpec, Section
from harness.scenario.shipped import shipped_scenarios
from harness.scenario.validation import NAME_PATTERN, KeyFault, KeyFaults, shown

SCHEMA: Final = "wayproof/campaign/1"
MAX_RUNS: Final = 1_000_000  # a campaign of more is refused

GIVEN_ELSEWHERE: Final[dict[Loc, str]] = {
    ("schema",): "leave it out",
    ("name",): "leave it out",
    ("seed",): "every case gets a seed of its own, from the campaign's",
    ("planner", "kind"): "name planners under `planners`, or one with --planner",
    ("aircraft", "model"): "name aircraft under `aircraft`, or one with --aircraft",
}
"""Keys of a scenario that a campaign must not replace, and what to write in place of that."""

Settings: TypeAlias = Sequence[tuple[str, str]]  # key paths and their values as YAML
Values = Annotated[tuple[Any, ...], Strict(False), Field(min_length=1, json_schema_extra={"uniqueItems": True})]


def _bare(section: type[Section], name: str) -> BeforeValidator:
    """Makes a validator that takes bare text for a section in which only this key is given."""
    return BeforeValidator(
        lambda value: {name: value} if isinstance(value, str) else value, json_schema_input_type=str | section
    )


class Campaign(Section):
    """Many flights: every planner with every aircraft flies each draw of each combination of world and grid values."""

    schema_: Literal["wayproof/campaign/1"] = Field(alias="schema")
    """Format and version."""
    name: Annotated[str, Field(pattern=NAME_PATTERN, max_length=100)]
    """Names the folder."""
    seed: Annotated[int, Field(ge=0, le=2**53)]
    """Root seed; every case's seed and draws derive from it."""
    scenarios: Annotated[tuple[str, ...], Strict(False)] = ()
    """What is flown: scenario files or folders of them, from the campaign file on, or names that `wayproof list
    scenarios` prints. Default: none, the worlds are flown with every default."""
    worlds: Annotated[tuple[WorldSpec, ...], Strict(False)] = ()
    """Forests; each makes area.bounds_m, obstacles, mission.start_m and mission.goal_m in place of the scenario's.
    Default: the scenarios' own worlds."""
    planners: Annotated[tuple[Annotated[PlannerSpec, _bare(PlannerSpec, "kind")], ...], Strict(False)] = ()
    """Kinds, or a kind with keys of `planner`. Default: the scenario's own planner."""
    aircraft: Annotated[tuple[Annotated[AircraftSpec, _bare(AircraftSpec, "model")], ...], Strict(False)] = ()
    """Models, or a model with keys of `aircraft`. Default: the scenario's own."""
    set_: dict[str, Any] = Field(default_factory=dict, alias="set")
    """Values by key path of a scenario, for every run."""
    grid: dict[str, Values] = Field(default_factory=dict)
    """Lists of values by key path of a scenario; every combination is flown."""
    random: dict[str, Distribution] = Field(default_factory=dict)
    """What to draw, by key path of a scenario, anew for every case."""
    draws: Annotated[int, Field(ge=1, le=MAX_RUNS)] = 1
    """Draws of every combination."""
    recordings: Literal["all", "thin", "failures", "none"] = "none"
    """Of which runs a run folder is kept; thin: of all, their recordings with no more than track, plans and obstacles;
    failures are those that do not reach the goal."""
    optimum: bool = True
    """Whether to compute the shortest path of every run's world."""

    @model_validator(mode="after")
    def _can_be_flown(self) -> Campaign:
        if not (self.scenarios or self.worlds):
            raise KeyFault((), "has neither scenarios nor worlds; must have at least one of them")
        if index := _first_repeat(labels := [world.label for world in self.worlds]):
            raise KeyFault(("worlds", index), f"is called {labels[index]} as another; give each a label")
        taken: dict[Loc, str] = {}
        for section, keys in (("set", self.set_), ("grid", self.grid), ("random", self.random)):
            for name in keys:
                self._check_key((section, name), taken)
        for name, values in self.grid.items():
            if index := _first_repeat(values):
                raise KeyFault(("grid", name, index), "is there already; keep one (draws flies each more often)")
        _check_entries("planners", self.planners, taken)
        _check_entries("aircraft", self.aircraft, taken)
        return self

    def _check_key(self, where: tuple[str, str], taken: dict[Loc, str]) -> None:
        """Refuses a key path that is none, is not for a campaign to give, or is given already."""
        try:
            loc = strict_yaml.loc_of(where[1])
        except ValueError as error:
            raise KeyFault(where, str(error)) from error
        for other, way in GIVEN_ELSEWHERE.items():
            if other[: len(loc)] == loc:
                raise KeyFault(where, f"cannot be given here; {way}")
        for other, named in taken.items():
            if other[: len(loc)] == loc[: len(other)]:
                raise KeyFault(where, f"is given under {named} too; keep one of them")
        taken[loc] = strict_yaml.key_path(where)


def _check_entries(section: str, entries: Sequence[Section], taken: Mapping[Loc, str]) -> None:
    """Refuses an entry that is there twice, its default shield named or not, or with a key of `grid` or `random`."""
    plain = [(getattr(each, "label", ""), each.model_dump(exclude={"shield"})) for each in entries]
    if index := _first_repeat(plain):
        raise KeyFault((section, index), "is there already; leave it out or give it another key")
    for index, entry in enumerate(entries):
        for name in entry.model_fields_set | (entry.model_extra or {}).keys():
            if not (named := taken.get((section.removesuffix("s"), name), "set")).startswith("set"):
                raise KeyFault((section, index, name), f"is given under {named} too; keep one of them")


def _first_repeat(values: Sequence[Any]) -> int | None:
    """Index of the first value that was there before; None where all differ."""
    return next((index for index, each in enumerate(values) if each in values[:index]), None)


@dataclass(frozen=True)
class Base:
    """A scenario that a campaign starts from: the name of its file, what its faults name it, and its keys."""

    file: str
    source: str
    root: Node

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self.text(("name",), Path(self.file).stem)

    def text(self, loc: Loc, default: str) -> str:
        """The text at `loc`, or a default where there is none."""
        node = self.root.at(loc)
        return node.value if node and isinstance(node.value, str) else default


@dataclass(frozen=True)
class CampaignFile:
    """A campaign file as it was read: what its faults name it, its keys with their lines, at least one scenario."""

    campaign: Campaign
    source: str
    root: Node
    bases: tuple[Base, ...]

    def plain(self) -> dict[str, Any]:
        """Returns the content as JSON has it: enough to fly every run again, without a file."""
        return {
            "campaign": self.root.plain(),
            "scenarios": [{"file": base.file, "keys": base.root.plain()} for base in self.bases],
        }

    @classmethod
    def from_plain(cls, plain: dict[str, Any], source: str) -> CampaignFile:
        """Restores the file from what `plain` returned; an InputError if it is something else."""
        try:
            root = node_of(plain["campaign"], 1)
            given = [(Path(each["file"]).name, dict(each["keys"])) for each in plain["scenarios"]]
            first, *more = (Base(name, f"{name} in {source}", node_of(keys, 1)) for name, keys in given)
        except (KeyError, TypeError, ValueError):
            raise InputError(f"{source}: holds no campaign, or only a part; give another copy") from None
        return cls(validated(root, source), source, root, (first, *more))


def load_campaign(path: Path, planners: Sequence[str] = (), settings: Settings = ()) -> CampaignFile:
    """Reads a campaign file and the scenario files that it names, unchecked; an InputError where a file is none.

    `planners`: kinds that fly in place of those that the file names.
    `settings`: keys that are added to `set`; `seed` replaces that of the campaign.
    """
    source, root = str(path), strict_yaml.read(path)
    if planners:
        root = strict_yaml.replaced(root, ("planners",), node_of(tuple(planners), COMMAND_LINE))
    for name, text in settings:
        value = node_of(strict_yaml.parse(text, f"command line: {name}").plain(), COMMAND_LINE)
        root = strict_yaml.replaced(root, ("seed",) if name == "seed" else ("set", name), value)
    root = absolute_paths(root, path.parent)
    campaign = validated(root, source)

    def fault(loc: Loc, sentence: str) -> InputError:
        return InputError(fault_line(source, root.line_of(loc), loc, sentence))

    for index, each in enumerate(campaign.planners):
        if is_source(each.kind) and each.kind not in planner_kinds():
            name = each.kind[:80]
            reason = f"is {name!r}, which no file may name: give `wayproof sweep` --planners {name},..."
            raise fault(("planners", index), f"{reason}, which replaces all of `planners`")
    bases: dict[str, Base] = {}
    for index, name in enumerate(campaign.scenarios):
        loc: Loc = ("scenarios", index)
        for base in map(_base_of, _files(name, path.parent, partial(fault, loc))):
            if base.name in bases:
                raise fault(loc, f"is a second scenario called {base.name}; rename one")
            bases[base.name] = base
    if not bases:
        node = node_of({"schema": "wayproof/scenario/1", "name": campaign.name}, root.line_of(("worlds",)))
        bases[""] = Base(campaign.name, source, node)
    return CampaignFile(campaign, source, root, tuple(bases.values()))


def _base_of(file: Path) -> Base:
    if not isinstance((keys := strict_yaml.read(file)).value, dict):
        raise InputError(f"{file}:{keys.line}: must be a mapping that begins with `schema:`")
    return Base(file.name, str(file), absolute_paths(keys, file.parent))


def is_a(what: Literal["campaign", "scenario"], path: Path) -> bool:
    """Whether a file says that it is a campaign, or a scenario; False for one that cannot be read."""
    try:
        schema = strict_yaml.read(path).at(("schema",))
    except InputError:
        return False
    return schema is not None and str(schema.value).startswith(f"wayproof/{what}/")


def campaign_schema() -> dict[str, Any]:
    """JSON Schema of the format."""
    some = [{"required": [name], "properties": {name: {"minItems": 1}}} for name in ("scenarios", "worlds")]
    whole = {**Campaign.model_json_schema(), "anyOf": some}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **whole}


def validated(root: Node, source: str) -> Campaign:
    """The campaign of some keys; an InputError where they are none."""
    try:
        return Campaign.model_validate(root.plain())
    except ValidationError as error:
        raise KeyFaults.of(error, Campaign).in_file(root, source) from error


def _files(entry: str, folder: Path, fault: Callable[[str], InputError]) -> list[Path]:
    """The scenario files that an entry means: a file, those of a folder, or a shipped one."""
    path, shipped = folder / entry, shipped_scenarios()
    try:
        if path.is_file():
            return [path]
        if path.is_dir():
            found = (each for each in sorted(path.glob("[!.]*.y*ml")) if each.suffix in (".yaml", ".yml"))
            if files := [each for each in found if not is_a("campaign", each)]:
                return files
            raise fault(f"is {entry!r}, a folder without scenario files (*.yaml, *.yml)")
    except OSError as error:
        raise fault(f"is {shown(entry)}: {error.strerror}") from error
    if entry in shipped:
        return [shipped[entry]]
    wanted = f"a scenario file, a folder of them or one of {', '.join(shipped)}"
    raise fault(f"is {entry[:200]!r}; must be {wanted}")


def absolute_paths(node: Node, folder: Path, keys: str = "") -> Node:
    """Makes the paths of aircraft and of obstacles' files absolute in the keys of a scenario or a campaign."""
    if isinstance(value := node.value, tuple):
        return Node(tuple(absolute_paths(each, folder, keys) for each in value), node.line)
    # Circles and polygons are passed over: there may be thousands, without a file.
    if isinstance(value, dict) and not {"circle", "polygon"} & value.keys():
        inner = {key: absolute_paths(each, folder, f"{keys}.{key}") for key, each in value.items()}
        return Node(inner, node.line)
    if isinstance(value, str) and keys in (".aircraft", ".aircraft.model"):
        return Node(model_or_folder(value, folder), node.line)
    if isinstance(value, str) and ".file.path." in f"{keys}." and (beside := file_beside(value, folder)):
        return Node(str(beside.absolute()), node.line)
    return node
