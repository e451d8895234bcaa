"""The runs of a campaign, by number: what each flies follows from the campaign and its number, never from order.

Case `c` is draw `c // combinations` of combination `c % combinations`; run `r` flies case `r // pairs` with
planner and aircraft `r % pairs`. A case's streams are children of the campaign's root seed
(`numpy.random.SeedSequence`, spawn key (case, stream)). More draws leave the runs before them as they are.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from harness.campaign.campaign_file import MAX_RUNS, CampaignFile
from harness.campaign.cells import PlannedRun, cell_of, entry_columns, kind_of
from harness.campaign.flight import Job
from harness.campaign.results import LAW, RESULTS, RUNS, fly_again, read_table
from harness.campaign.sampling import takes_whole_numbers
from harness.files.strict_yaml import (
    InputError,
    Loc,
    Node,
    Scalar,
    as_spelt,
    fault_line,
    key_path,
    loc_of,
    node_of,
    replaced,
)
from harness.scenario.generators import generated
from harness.scenario.overrides import overridden, with_key
from harness.scenario.scenario import Scenario, packed, scenario_from, unpacked
from harness.scenario.validation import KeyFaults, in_lines

SEED, WORLD, DRAW = range(3)
"""Random streams of a case."""

MOST_KEPT: Final = 100_000_000
"""Bytes of scenarios that are kept from the check on: to make one takes some six times as long as to unpack it."""

DEFAULT_PLANNER: Final = "rolling_window"
DEFAULT_AIRCRAFT: Final = "aerosonde"


class _Change(NamedTuple):
    """One key of a scenario replaced, and where in the campaign file that is said."""

    loc: Loc
    node: Node
    origin: Loc


class _Place(NamedTuple):
    """Where in the campaign a run lies: indices."""

    case: int
    draw: int
    combination: int
    base: int
    world: int
    grid: tuple[int, ...]
    planner: int
    aircraft: int


class CampaignRuns:
    """All runs of a campaign.

    Args:
        file: the campaign.
        planners: planners that who flies has to import, as FILE.py:NAME or MODULE:NAME.
        laws: guidance laws, likewise.
    """

    def __init__(
        self, file: CampaignFile, planners: tuple[str, ...] = (), laws: tuple[str, ...] = ()
    ) -> None:
        self._sources = planners, laws
        self.file, self.campaign = file, file.campaign
        campaign = file.campaign
        grids = [range(len(values)) for values in campaign.grid.values()]
        worlds = range(len(campaign.worlds)) or range(1)
        sizes = [len(file.bases), len(worlds), *map(len, grids)]
        self._pairs = list(
            itertools.product(range(len(campaign.planners) or 1), range(len(campaign.aircraft) or 1))
        )
        self._combinations = math.prod(sizes)
        self._number = campaign.draws * self._combinations * len(self._pairs)
        self._sizes = sizes
        self._last_world: tuple[int, list[_Change]] = (-1, [])
        self._made: dict[int, bytes] = {}  # by `check`
        if self._number > MAX_RUNS:
            sentence = f"makes {self._number} runs with what is combined; must be at most {MAX_RUNS}"
            raise InputError(self._line(("draws",) if campaign.draws > 1 else ("grid",), sentence))

    def __len__(self) -> int:
        return self._number

    @property
    def cases(self) -> int:
        """How many cases there are."""
        return self._number // len(self._pairs)

    @cached_property
    def planners(self) -> list[str]:
        """The kinds of planners that fly."""
        named = [each.label for each in self.campaign.planners]
        return named or [base.word(("planner", "kind"), DEFAULT_PLANNER) for base in self.file.bases]

    @cached_property
    def aircraft(self) -> list[str]:
        """The models of aircraft that fly."""
        named = [each.model for each in self.campaign.aircraft]
        return named or [base.word(("aircraft", "model"), DEFAULT_AIRCRAFT) for base in self.file.bases]

    @cached_property
    def varied(self) -> dict[str, str]:
        """Columns of `results.parquet` for the varied keys: number, int, bool or text by key path."""
        entries = {name: kind_of(values) for name, values in self._of_entries.items()}
        grid = {as_spelt(name): kind_of(values) for name, values in self.campaign.grid.items()}
        drawn = {
            as_spelt(name): kind_of(each.choice)
            if each.choice
            else "int"
            if name in self._whole
            else "number"
            for name, each in self.campaign.random.items()
        }
        return grid | drawn | entries

    @cached_property
    def _whole(self) -> set[str]:
        """Keys drawn at random that take whole numbers alone; an InputError where a range of theirs ends elsewhere."""
        whole = [name for name in self.campaign.random if takes_whole_numbers(loc_of(name))]
        for name in whole:
            for within, end in self.campaign.random[name].ends():
                if not end.is_integer():
                    sentence = f"is {end:g}; must be a whole number, as {name} is"
                    raise InputError(self._line(("random", name, *within), sentence))
        return set(whole)

    @cached_property
    def _of_entries(self) -> dict[str, tuple[Scalar, ...]]:
        return entry_columns(self.file)

    def run(self, number: int) -> PlannedRun:
        """Run `number`, from 0."""
        place = self._place(number)
        base = self.file.bases[place.base]
        changes = [*self._grid(place), *self._drawn(place)]
        given = {key_path(each.loc): each.node.plain() for each in changes}
        for name, values in self._of_entries.items():
            given[name] = values[place.planner if name.startswith("planner.") else place.aircraft]
        return PlannedRun(
            number,
            place.case,
            base.name,
            self.campaign.worlds[place.world].name if self.campaign.worlds else base.file,
            self.planners[place.planner if self.campaign.planners else place.base],
            self.aircraft[place.aircraft if self.campaign.aircraft else place.base],
            self._seed(place.case),
            {column: cell_of(given[column], kind) for column, kind in self.varied.items()},
        )

    def scenario(self, number: int, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
        """What run `number` flies, complete.

        Args:
            number: from 0.
            overrides: keys to replace besides, as `load_scenario` takes them.

        Raises:
            InputError: it is not a scenario; the faults name what in the campaign makes it so.
        """
        if number in self._made and not overrides:
            return unpacked(self._made[number])
        place = self._place(number)
        base = self.file.bases[place.base]
        root, changes = base.root, self._changes(place)
        if self.campaign.worlds:
            root = _without_course(root)
        for loc, node, origin in changes:
            try:
                root = with_key(root, loc, node)
            except InputError as error:
                sentence = str(error).removeprefix("command line: ")
                raise InputError(self._line(origin, sentence)) from error
        root = overridden(root, overrides)
        try:
            return scenario_from(root.plain())
        except KeyFaults as error:
            lines = [self._fault(number, root, changes, *fault) for fault in error.every]
            raise in_lines(lines, self.file.source) from error

    def packed(self, number: int) -> bytes:
        """The same as `harness.scenario.scenario.packed` has it."""
        return self._made.get(number) or packed(self.scenario(number))

    def job(self, number: int, folder: Path) -> Job:
        """Run `number`, from 0, as it is handed to who flies it; `folder` is the campaign's."""
        return Job(
            number,
            self.packed(number),
            (folder / RUNS / str(number)).resolve(),
            self.campaign.recordings,
            self.campaign.optimum,
            self.again(number, folder),
            {name: value for name, value in self.run(number).varied.items() if value is not None},
            planners=self._sources[0],
            laws=self._sources[1],
            identity=f"run {number}",
        )

    def again(self, number: int, folder: Path) -> str:
        """The command that flies run `number` again."""
        law = self.campaign.set_.get(LAW, "")
        return fly_again(folder / RESULTS, number, self.run(number).planner, law)

    def plain(self) -> dict[str, Any]:
        """All that says what is flown, as JSON."""
        return self.file.plain()

    def check(self, progress: Callable[[int], None] | None = None) -> None:
        """Makes every scenario of the campaign once; the first ones are kept for when they are flown.

        Args:
            progress: told how many have been made.

        Raises:
            InputError: one is not a scenario.
        """
        room = MOST_KEPT
        for number in range(len(self)):
            scenario = self.scenario(number)
            if room > 0:
                self._made[number] = packed(scenario)
                room -= len(self._made[number])
            if progress is not None:
                progress(number + 1)

    def _place(self, number: int) -> _Place:
        case, pair = divmod(number, len(self._pairs))
        draw, combination = divmod(case, self._combinations)
        base, world, *grid = (int(index) for index in np.unravel_index(combination, self._sizes))
        return _Place(case, draw, combination, base, world, tuple(grid), *self._pairs[pair])

    def _stream(self, number: int, stream: int) -> np.random.SeedSequence:
        return np.random.SeedSequence(self.campaign.seed, spawn_key=(number, stream))

    def _seed(self, case: int, stream: int = SEED) -> int:
        """A whole number of 53 bits, which every reader of JSON and YAML keeps."""
        return int(self._stream(case, stream).generate_state(1, np.uint64)[0] >> np.uint64(11))

    def _changes(self, place: _Place) -> list[_Change]:
        """What a run replaces in its scenario, in order."""
        return [
            *self._world(place),
            *(_Change(loc_of(name), self._at(("set", name)), ("set", name)) for name in self.campaign.set_),
            *self._entry("aircraft", "model", place.aircraft),
            *self._entry("planners", "kind", place.planner, section="planner"),
            *self._grid(place),
            *self._drawn(place),
            _Change(("seed",), Node(self._seed(place.case), self.file.root.line_of(("seed",))), ("seed",)),
        ]

    def _world(self, place: _Place) -> list[_Change]:
        """The generated world of a case; runs of one case follow each other, so that the last one is kept."""
        if not self.campaign.worlds:
            return []
        if self._last_world[0] != place.case:
            self._last_world = place.case, self._generated(place)
        return self._last_world[1]

    def _generated(self, place: _Place) -> list[_Change]:
        spec = self.campaign.worlds[place.world]
        world = generated(spec, self._seed(place.case, WORLD))
        origin: Loc = ("worlds", place.world, spec.generator)
        line = self.file.root.line_of(origin)
        made: tuple[tuple[Loc, Any], ...] = (
            (("area", "bounds_m"), world.bounds_m),
            (("obstacles",), world.obstacles),
            (("mission", "start_m"), world.start_m),
            (("mission", "goal_m"), world.goal_m),
        )
        return [_Change(loc, node_of(plain, line), origin) for loc, plain in made]

    def _entry(self, name: str, first: str, index: int, section: str | None = None) -> list[_Change]:
        """An entry of `planners` or `aircraft`: bare text, or keys of that section of a scenario."""
        origin, into = (name, index), section or name
        entry = self.file.root.at(origin)
        if entry is None:
            return []
        if not isinstance(entry.value, dict):
            return [_Change((into, first), entry, origin)]
        ordered = sorted(entry.value.items(), key=lambda pair: pair[0] != first)
        return [_Change((into, key), node, (*origin, key)) for key, node in ordered]

    def _grid(self, place: _Place) -> list[_Change]:
        return [
            _Change(loc_of(name), self._at(("grid", name, index)), ("grid", name, index))
            for name, index in zip(self.campaign.grid, place.grid, strict=True)
        ]

    def _drawn(self, place: _Place) -> list[_Change]:
        changes = []
        for (name, each), share in zip(self.campaign.random.items(), self._shares(place), strict=True):
            origin: Loc = ("random", name)
            if each.choice:
                node = self._at((*origin, "choice", each.chosen(share)))
            else:
                number = each.whole_number(share) if name in self._whole else each.number(share)
                node = Node(number, self.file.root.line_of(origin))
            changes.append(_Change(loc_of(name), node, origin))
        return changes

    def _shares(self, place: _Place) -> list[float]:
        """A number in [0, 1) for each random key."""
        rng = np.random.default_rng(self._stream(place.case, DRAW))
        return list(rng.random(len(self.campaign.random)).tolist())

    def _at(self, loc: Loc) -> Node:
        node = self.file.root.at(loc)
        assert node is not None
        return node

    def _fault(self, number: int, root: Node, changes: Sequence[_Change], loc: Loc, sentence: str) -> str:
        """The fault at `loc` of a run's scenario as a person reads it, and which line it comes from."""
        for change in reversed(changes):
            shared = min(len(loc), len(change.loc))
            if shared and change.loc[:shared] == loc[:shared]:
                named = loc == change.loc and change.origin[0] != "worlds"
                inner = "" if named else f"{key_path(loc)}: "
                return self._line(change.origin, f"{inner}{sentence} (run {number})")
        told = "".join(f", {name} {value}" for name, value in self.run(number).varied.items())
        where = f"(run {number} of {self.file.source}{told})"
        source = self.file.bases[self._place(number).base].source
        return fault_line(source, root.line_of(loc), loc, f"{sentence} {where}")

    def _line(self, origin: Loc, sentence: str) -> str:
        return fault_line(self.file.source, self.file.root.line_of(origin), origin, sentence)


def _without_course(root: Node) -> Node:
    """A scenario's keys for another world: the course at the start is towards its goal."""
    mission = root.at(("mission",))
    if mission is None or not isinstance(mission.value, dict):
        return root
    kept = {name: node for name, node in mission.value.items() if name != "course_deg"}
    return replaced(root, ("mission",), Node(kept, mission.line))


def flown_run(
    results: Path, run: int, overrides: Sequence[tuple[str, str]] = ()
) -> tuple[Scenario, str | None]:
    """What a run of a campaign flew, and the digest of its row.

    Args:
        results: a campaign's `results.parquet`; it holds the campaign, no other file is needed.
        run: number of the run; it may still be missing in the table.
        overrides: keys to replace besides, as `load_scenario` takes them; where they change what is flown, there is
            no digest.

    Raises:
        InputError: the file is something else, or the campaign has no such run.
    """
    table, about = read_table(results)
    runs = CampaignRuns(CampaignFile.from_plain(about, str(results)))
    if not 0 <= run < len(runs):
        raise InputError(f"{results}: has no run {run}; must be 0 to {len(runs) - 1}")
    digests = dict(zip(table["run"].to_pylist(), table["digest"].to_pylist(), strict=True))
    asked = runs.scenario(run, overrides)
    return asked, digests.get(run) if not overrides or _is_flown(runs, run, asked) else None


def again_from(folder: Path, run: int) -> str:
    """The command that flies a run again, from the folder of its campaign."""
    results = folder / RESULTS
    if results.is_file():
        runs = CampaignRuns(CampaignFile.from_plain(read_table(results)[1], str(results)))
        if run < len(runs):
            return runs.again(run, folder)
    return fly_again(results, run)


def _is_flown(runs: CampaignRuns, run: int, asked: Scenario) -> bool:
    """Whether a scenario is what the campaign flew in a run."""
    try:
        return packed(runs.scenario(run)) == packed(asked)
    except InputError:  # its planner is not here; another one was given
        return False
