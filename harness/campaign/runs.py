"""The runs of a campaign: what each flies follows from the campaign and its number, never from order.

Case `c` is draw `c // combinations` of combination `c % combinations`; run `r` flies case `r // pairs` with
planner and aircraft `r % pairs`. A case's streams are children of the campaign's root seed
(`numpy.random.SeedSequence`, spawn key (case, stream)). More draws leave the runs before them as they are.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np

from harness.analysis.metric import Claim
from harness.campaign.campaign_file import MAX_RUNS, Base, Campaign, CampaignFile, Settings
from harness.campaign.flight import Job
from harness.campaign.results import LAW_KEY, RESULTS, RUN, RUNS, fly_again, read_table
from harness.campaign.sampling import takes_whole_numbers
from harness.files import strict_yaml
from harness.files.strict_yaml import InputError, Loc, Node, Scalar, fault_line, key_path, loc_of, node_of
from harness.run_files.run_folder import MANIFEST, SCENARIO
from harness.scenario.generators import generated
from harness.scenario.scenario import Scenario, load_scenario, overridden, packed, scenario_from, unpacked, with_key
from harness.scenario.sections import PlannerSpec
from harness.scenario.validation import KeyFaults, in_lines

SEED_STREAM, WORLD_STREAM, DRAW_STREAM = range(3)  # numbers of the random streams of a case

MOST_KEPT_BYTES: Final = 100_000_000
"""Scenarios made by the check are kept up to this size: making one takes six times as long as unpacking it."""
KIND, MODEL = ("planner", "kind"), ("aircraft", "model")
"""The key of a scenario that a bare entry of `planners`, and one of `aircraft`, replaces."""
SHIELD: Final = "planner.shield"  # key of a scenario


class _Change(NamedTuple):
    """One key of a scenario with its new value, and the place in the campaign file that gives it."""

    loc: Loc
    node: Node
    origin: Loc


_Axis: TypeAlias = list[list[_Change]]
"""The changes for each value of a key of the grid, or for each entry of `planners` or `aircraft`."""


class _Place(NamedTuple):
    """A run's place in the campaign: indices of its case, scenario, world, grid values and entries."""

    case: int
    base: int
    world: int
    grid: list[int]
    entries: list[int]


class CampaignRuns:
    """All runs of a campaign; `planners` are the kinds that fly, `aircraft` the models."""

    can_grow: bool = True  # whether a campaign with more draws may go on with the runs of one with fewer
    claim: Claim = "reached"  # a run is a failure where this does not hold of it

    def __init__(self, file: CampaignFile, planners: tuple[str, ...] = (), laws: tuple[str, ...] = ()) -> None:
        """`planners` and `laws` are those that a process has to import, as FILE.py:NAME or MODULE:NAME."""
        self.file, self.campaign, self.sources = file, file.campaign, (planners, laws)
        campaign, bases = file.campaign, file.bases
        for base in bases:
            _refuse_one_day(base, campaign)
        self._grid = [
            [[self._change(loc_of(name), ("grid", name, index))] for index in range(len(values))]
            for name, values in campaign.grid.items()
        ]
        self._entries = [self._entry_axis("planners", *KIND), self._entry_axis("aircraft", *MODEL)]
        self._pairs = [*map(len, self._entries)]
        self._sizes = [len(bases), len(campaign.worlds) or 1, *map(len, self._grid)]
        own = (base.text(KIND, PlannerSpec().kind) for base in bases)
        self.planners = [each.kind for each in campaign.planners] or [*own]
        self.aircraft = [e.model for e in campaign.aircraft] or [b.text(MODEL, "aerosonde") for b in bases]
        self._made: dict[int, bytes] = {}  # by `check`
        self.files: dict[str, str] = {}  # path and SHA-256 of all that obstacles are made of; by `check`
        self._world = lru_cache(maxsize=1)(self._world_changes)  # runs of one case follow each other
        self.cases = campaign.draws * math.prod(self._sizes)
        if len(self) > MAX_RUNS:
            sentence = f"makes {len(self)} runs with what is combined; must be at most {MAX_RUNS}"
            raise InputError(self._line(("draws",) if campaign.draws > 1 else ("grid",), sentence))

    def __len__(self) -> int:
        return self.cases * math.prod(self._pairs)

    @cached_property
    def varied(self) -> list[str]:
        """Key paths that differ between runs: those of the grid, drawn at random, and of the entries."""
        drawn = map(strict_yaml.as_spelt, (*self.campaign.grid, *self.campaign.random))
        entries = [change.loc for axis in self._entries for entry in axis for change in entry]
        return [*dict.fromkeys([*drawn, *(key_path(loc) for loc in entries if loc not in (KIND, MODEL))])]

    @cached_property
    def _whole_keys(self) -> list[str]:
        """Keys drawn at random that take whole numbers only, from ranges that end at whole numbers."""
        drawn = {name: each for name, each in self.campaign.random.items() if not each.choice}
        middles = [(name, each.value(name, 0.5, each.is_whole)) for name, each in drawn.items()]
        middle = [_Change(loc_of(name), Node(value, 0), ()) for name, value in middles]
        with suppress(InputError, KeyFaults):  # the check of the runs tells of their faults
            scenario = scenario_from(self._keys_of_run(0, middle)[0].plain())
            whole = (name for name in drawn if takes_whole_numbers(scenario, loc_of(name)))
            return [name for name in whole if drawn[name].is_whole]
        return []

    def cells(self, number: int) -> dict[str, Any]:
        """Returns the first columns of `results.parquet` for run `number`, from 0: `RUN`, then varied keys.

        Runs of one `case` fly the same world with the same seed and draws; `world` is the name of its file, or of the
        generator. Lists and mappings are JSON text.
        """
        place = self._place(number)
        base, campaign = self.file.bases[place.base], self.campaign
        changes = [*_chosen_changes(self._entries, place.entries), *_chosen_changes(self._grid, place.grid)]
        given = {key_path(each.loc): _cell(each.node) for each in [*changes, *self._draw(place.case)]}
        planner = self._planner(place, str(given.get(SHIELD) or campaign.set_.get(SHIELD) or ""))
        model = self.aircraft[place.entries[1] if campaign.aircraft else place.base]
        world = campaign.worlds[place.world].label if campaign.worlds else base.file
        named = (number, place.case, base.name, world, planner, model, self._seed(place.case))
        return {**dict(zip(RUN, named, strict=True)), **self._varied(given)}

    def _planner(self, place: _Place, shield: str) -> str:
        """Returns the label of a run's planner, under its entry's shield, else this one, else that of its scenario."""
        base, named = self.file.bases[place.base], self.campaign.planners
        shield = shield or base.text(loc_of(SHIELD), "")
        if named:
            return named[place.entries[0]].filled(shield=shield).label
        return PlannerSpec.model_construct(kind=self.planners[place.base], shield=shield).label

    def _varied(self, row: Mapping[str, Any]) -> dict[str, Scalar]:
        return {name: row.get(name) for name in self.varied}

    def scenario(self, number: int, overrides: Settings = ()) -> Scenario:
        """Returns the scenario of run `number`, keys replaced as by `load_scenario`; an InputError names its fault."""
        if number in self._made and not overrides:
            return unpacked(self._made[number])
        root, changes = self._keys_of_run(number, self._draw(self._place(number).case))
        root = overridden(root, overrides)
        try:
            return scenario_from(root.plain())
        except KeyFaults as error:
            lines = [self._fault(number, root, changes, *fault) for fault in error.every]
            raise in_lines(lines, self.file.source) from error

    def _keys_of_run(self, number: int, drawn: Sequence[_Change]) -> tuple[Node, list[_Change]]:
        """Returns the keys of a run's scenario, `drawn` ones and all others of the campaign in, and these changes."""
        place, root = self._place(number), self.file.bases[self._place(number).base].root
        changes = [
            *(self._change(loc_of(name), ("set", name)) for name in self.campaign.set_),
            *_chosen_changes(self._entries[::-1], place.entries[::-1]),
            *_chosen_changes(self._grid, place.grid),
            *drawn,
            _Change(("seed",), Node(self._seed(place.case), self.file.root.line_of(("seed",))), ("seed",)),
        ]
        if self.campaign.worlds:  # the course at the start is towards the goal of the generated world
            root = strict_yaml.without(root, ("mission", "course_deg"))
            changes = [*self._world(place.case, place.world), *changes]
        for loc, node, origin in sorted(changes, key=lambda each: each.loc[1:] != ("kind",)):
            try:
                root = with_key(root, loc, node)
            except InputError as error:
                raise InputError(self._line(origin, str(error).removeprefix("command line: "))) from error
        return root, changes

    def packed(self, number: int) -> bytes:
        """Returns the scenario of run `number` packed by `harness.scenario.scenario.packed`."""
        return self._made.get(number) or packed(self.scenario(number))

    def job(self, number: int, folder: Path) -> Job:
        """Returns run `number`, from 0, as a job for a worker; `folder` is the campaign's."""
        return Job(
            number,
            self.packed(number),
            (folder / RUNS / str(number)).resolve(),
            self.campaign.recordings,
            self.campaign.optimum,
            self.again(number, folder),
            {name: cell for name, cell in self._varied(self.cells(number)).items() if cell is not None},
            claim=self.claim,
            planners=self.sources[0],
            laws=self.sources[1],
            identity=f"run {number}",
        )

    def again(self, number: int, folder: Path) -> str:
        """Returns the command that flies run `number` again."""
        law = self.campaign.set_.get(LAW_KEY, "")
        return fly_again(folder / RESULTS, number, self.cells(number)["planner"], law)

    def plain(self) -> dict[str, Any]:
        """Returns the campaign with all scenarios, as JSON."""
        return self.file.plain()

    def check(self, progress: Callable[[int], None] | None = None) -> None:
        """Makes every scenario of the campaign once, or raises InputError; the first ones are kept to be flown."""
        room = MOST_KEPT_BYTES
        for number in range(len(self)):
            scenario = self.scenario(number)
            self.files |= {each.path: each.sha256[:16] for each in scenario.sources or ()}
            if room > 0:
                self._made[number] = packed(scenario)
                room -= len(self._made[number])
            if progress is not None:
                progress(number + 1)

    def _place(self, number: int) -> _Place:
        case, pair = divmod(number, math.prod(self._pairs))
        base, world, *grid = map(int, np.unravel_index(case % math.prod(self._sizes), self._sizes))
        return _Place(case, base, world, grid, [*map(int, np.unravel_index(pair, self._pairs))])

    def _stream(self, case: int, stream: int) -> np.random.SeedSequence:
        return np.random.SeedSequence(self.campaign.seed, spawn_key=(case, stream))

    def _seed(self, case: int, stream: int = SEED_STREAM) -> int:
        """Returns a seed of 53 bits, which every reader of JSON and YAML keeps whole."""
        return int(self._stream(case, stream).generate_state(1, np.uint64)[0] >> np.uint64(11))

    def _world_changes(self, case: int, world: int) -> list[_Change]:
        """Returns the changes that put a world of the campaign, generated with the case's seed, into a scenario."""
        made = generated(self.campaign.worlds[world], self._seed(case, WORLD_STREAM))
        origin: Loc = ("worlds", world, "forest")
        line = self.file.root.line_of(origin)
        return [_Change(loc, node_of(plain, line), origin) for loc, plain in made.items()]

    def _entry_axis(self, listed: str, section: str, first: str) -> _Axis:
        """Returns the changes for each entry of `planners` or `aircraft`: bare text, or keys of that section."""
        axis = []
        for index, each in enumerate(self.file.root.plain().get(listed, ())):
            keys = sorted(each, key=lambda key: key != first) if isinstance(each, dict) else ()
            changes = [self._change((section, key), (listed, index, key)) for key in keys]
            axis.append(changes or [self._change((section, first), (listed, index))])
        return axis or [[]]

    def _shares(self, case: int) -> list[float]:
        """Returns the number in [0, 1) by which each key is drawn."""
        rng = np.random.default_rng(self._stream(case, DRAW_STREAM))
        return [*map(float, rng.random(len(self.campaign.random)))]

    def _draw(self, case: int) -> list[_Change]:
        """Returns the changes drawn for a case, each key by a number in [0, 1) of its stream."""
        changes = []
        for (name, each), share in zip(self.campaign.random.items(), self._shares(case), strict=True):
            origin: Loc = ("random", name)
            if each.choice:
                changes.append(self._change(loc_of(name), (*origin, "choice", each.chosen(share))))
                continue
            number = each.value(name, share, name in self._whole_keys)
            changes.append(_Change(loc_of(name), Node(number, self.file.root.line_of(origin)), origin))
        return changes

    def _change(self, loc: Loc, origin: Loc) -> _Change:
        node = self.file.root.at(origin)
        assert node is not None
        return _Change(loc, node, origin)

    def _fault(self, number: int, root: Node, changes: Sequence[_Change], loc: Loc, sentence: str) -> str:
        """Returns a line for people on the fault at `loc` of a run's scenario, with the line it comes from."""
        for change in reversed(changes):
            shared = min(len(loc), len(change.loc))
            if shared and change.loc[:shared] == loc[:shared]:
                inner = "" if loc == change.loc and change.origin[0] != "worlds" else f"{key_path(loc)}: "
                return self._line(change.origin, f"{inner}{sentence} (run {number})")
        drawn = "".join(f", {name} {value}" for name, value in self._varied(self.cells(number)).items())
        where = f"(run {number} of {self.file.source}{drawn})"
        source = self.file.bases[self._place(number).base].source
        return fault_line(source, root.line_of(loc), loc, f"{sentence} {where}")

    def _line(self, origin: Loc, sentence: str) -> str:
        return fault_line(self.file.source, self.file.root.line_of(origin), origin, sentence)


def _refuse_one_day(base: Base, campaign: Campaign) -> None:
    """Raises an InputError if several days are asked of the scenario of a run folder, which says all of its own day."""
    path, day = Path(base.source), campaign.set_.get("conditions", base.text(("conditions",), "ideal"))
    if "conditions" in {*campaign.grid, *campaign.random}:
        day = "varied"
    elif day == "ideal" or campaign.draws == 1:
        return
    if path.name == SCENARIO and (path.parent / MANIFEST).is_file():
        text = "but a run's scenario says all of its one day; give the scenario that was flown"
        raise InputError(f"{path}: conditions: is {day}, {text}, or conditions: ideal")


def _chosen_changes(axes: Sequence[_Axis], indices: Sequence[int]) -> list[_Change]:
    return [change for axis, index in zip(axes, indices, strict=True) for change in axis[index]]


def _cell(node: Node) -> Scalar:
    """Returns a value for its column of `results.parquet`: lists and mappings as JSON text."""
    return json.dumps(node.plain()) if isinstance(node.value, tuple | dict) else node.value


def flown_run(results: Path, run: int, overrides: Settings = ()) -> tuple[Scenario, str | None]:
    """Returns the scenario that a run flew, and the digest of its row, from `results.parquet` alone; or an InputError.

    There is no digest where the row is missing, or `overrides` change what is flown.
    """
    table, metadata = read_table(results)
    digests = dict(zip(table["run"].to_pylist(), table["digest"].to_pylist(), strict=True))
    if "path" in metadata:
        way = f"{RUNS}/{run}/manifest.json, where that run was kept, has the command that flies it again"
        raise InputError(f"{results}: has the days of a given path; {way}")
    if metadata.get("rare"):
        if not (path := results.parent / RUNS / str(run) / SCENARIO).is_file():
            raise InputError(f"{results}: run {run} of a subset simulation was not kept: there is no {path}")
        return load_scenario(path, overrides), None if overrides else digests.get(run)
    if not 0 <= run < len(runs := CampaignRuns(CampaignFile.from_plain(metadata, str(results)))):
        raise InputError(f"{results}: has no run {run}; must be 0 to {len(runs) - 1}")
    scenario = runs.scenario(run, overrides)
    with suppress(InputError):  # a planner that is not here: another one was given
        if not overrides or packed(runs.scenario(run)) == packed(scenario):
            return scenario, digests.get(run)
    return scenario, None
