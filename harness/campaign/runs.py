"""The runs of a campaign, by number: what each flies follows from the campaign and its number, never from order.

Case `c` is draw `c // combinations` of combination `c % combinations`; run `r` flies case `r // pairs` with
planner and aircraft `r % pairs`. A case's streams are children of the campaign's root seed
(`numpy.random.SeedSequence`, spawn key (case, stream)). More draws leave the runs before them as they are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from harness.campaign.campaign_file import MAX_RUNS, CampaignFile
from harness.campaign.flight import Job
from harness.campaign.planned_run import PlannedRun, cell_of, kind_of
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
    without,
)
from harness.scenario.generators import generated
from harness.scenario.overrides import overridden, with_key
from harness.scenario.scenario import Scenario, packed, scenario_from, unpacked
from harness.scenario.validation import KeyFaults, in_lines

SEED, WORLD, DRAW = range(3)
"""Random streams of a case."""

MOST_KEPT: Final = 100_000_000
"""Bytes of scenarios that are kept from the check on: to make one takes some six times as long as to unpack it."""

ENTRIES: Final = (
    ("planners", "planner", "kind", "rolling_window"),
    ("aircraft", "aircraft", "model", "aerosonde"),
)
"""Lists of a campaign, the section of a scenario that an entry replaces, its key of a bare entry, and its default."""


class _Change(NamedTuple):
    """One key of a scenario replaced, and where in the campaign file that is said."""

    loc: Loc
    node: Node
    origin: Loc


class _Place(NamedTuple):
    """Where in the campaign a run lies: indices."""

    case: int
    base: int
    world: int
    grid: tuple[int, ...]
    entries: dict[str, int]


class CampaignRuns:
    """All runs of a campaign.

    Args:
        planners: planners that who flies has to import, as FILE.py:NAME or MODULE:NAME.
        laws: guidance laws, likewise.
    """

    def __init__(
        self, file: CampaignFile, planners: tuple[str, ...] = (), laws: tuple[str, ...] = ()
    ) -> None:
        self._sources = planners, laws
        self.file, self.campaign = file, file.campaign
        campaign = file.campaign
        grids = [len(values) for values in campaign.grid.values()]
        self._sizes = [len(file.bases), len(campaign.worlds) or 1, *grids]
        self._entry_sizes = [len(getattr(campaign, listed)) or 1 for listed, *_ in ENTRIES]
        self._made: dict[int, bytes] = {}  # by `check`
        self._world = lru_cache(maxsize=1)(self._generated)  # runs of one case follow each other
        self.cases = campaign.draws * math.prod(self._sizes)
        if len(self) > MAX_RUNS:
            sentence = f"makes {len(self)} runs with what is combined; must be at most {MAX_RUNS}"
            raise InputError(self._line(("draws",) if campaign.draws > 1 else ("grid",), sentence))

    def __len__(self) -> int:
        return self.cases * math.prod(self._entry_sizes)

    @property
    def planners(self) -> list[str]:
        """The kinds of planners that fly."""
        return self._names["planners"]

    @property
    def aircraft(self) -> list[str]:
        """The models of aircraft that fly."""
        return self._names["aircraft"]

    @cached_property
    def _names(self) -> dict[str, list[str]]:
        """Names of the entries of each list of `ENTRIES`; of one without entries, those of the scenarios."""
        campaign = self.campaign
        named = {
            "planners": [each.label for each in campaign.planners],
            "aircraft": [each.model for each in campaign.aircraft],
        }
        own = {
            listed: [base.word((section, first), default) for base in self.file.bases]
            for listed, section, first, default in ENTRIES
        }
        return {listed: named[listed] or own[listed] for listed in named}

    @cached_property
    def varied(self) -> dict[str, str]:
        """Columns of `results.parquet` for the varied keys: number, int, bool, text or json by key path."""
        grid = {as_spelt(name): kind_of(values) for name, values in self.campaign.grid.items()}
        drawn = {
            as_spelt(name): kind_of(each.choice)
            if each.choice
            else "int"
            if name in self._whole
            else "number"
            for name, each in self.campaign.random.items()
        }
        return grid | drawn | {name: kind for name, (_, kind, _) in self._of_entries.items()}

    @cached_property
    def _of_entries(self) -> dict[str, tuple[str, str, list[Scalar]]]:
        """The list, its column's kind and each entry's cell for a key that any of them gives, by key path."""
        columns = {}
        for listed, section, first, _ in ENTRIES:
            plain = self.file.root.plain().get(listed, ())
            given = [each if isinstance(each, dict) else {} for each in plain]
            for name in dict.fromkeys(name for each in given for name in each if name != first):
                kind = kind_of(values := [each.get(name) for each in given])
                columns[f"{section}.{name}"] = (
                    listed,
                    kind,
                    [None if value is None else cell_of(value, kind) for value in values],
                )
        return columns

    @cached_property
    def _whole(self) -> set[str]:
        """Keys drawn at random that take whole numbers alone; an InputError where a range of theirs ends elsewhere."""
        drawn = {name: each for name, each in self.campaign.random.items() if not each.choice}
        middle = [_Change(loc_of(name), Node(each.middle(), 0), ()) for name, each in drawn.items()]
        whole: set[str] = set()
        if drawn:
            with suppress(InputError, KeyFaults):  # the check of the runs tells of their faults
                scenario = scenario_from(self._root(0, middle)[0].plain())
                whole = {name for name in drawn if takes_whole_numbers(scenario, loc_of(name))}
        for name in sorted(whole):
            for within, end in drawn[name].ends().items():
                if not end.is_integer():
                    sentence = f"is {end:g}; must be a whole number, as {name} is"
                    raise InputError(self._line(("random", name, *within), sentence))
        return whole

    def run(self, number: int) -> PlannedRun:
        """Run `number`, from 0."""
        place = self._place(number)
        base = self.file.bases[place.base]
        changes = [*self._grid(place), *self._drawn(place)]
        given = {key_path(each.loc): each.node.plain() for each in changes}
        varied = {name: cell_of(given[name], kind) for name, kind in self.varied.items() if name in given}
        varied |= {
            name: cells[place.entries[listed]] for name, (listed, _, cells) in self._of_entries.items()
        }
        planner, model = (
            names[place.entries[listed] if getattr(self.campaign, listed) else place.base]
            for listed, names in self._names.items()
        )
        return PlannedRun(
            number,
            place.case,
            base.name,
            self.campaign.worlds[place.world].name if self.campaign.worlds else base.file,
            planner,
            model,
            self._seed(place.case),
            varied,
        )

    def scenario(self, number: int, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
        """What run `number` flies, complete.

        `overrides`: keys to replace besides, as `load_scenario` takes them.

        Raises:
            InputError: it is not a scenario; the faults name what in the campaign makes it so.
        """
        if number in self._made and not overrides:
            return unpacked(self._made[number])
        root, changes = self._root(number, self._drawn(self._place(number)))
        root = overridden(root, overrides)
        try:
            return scenario_from(root.plain())
        except KeyFaults as error:
            lines = [self._fault(number, root, changes, *fault) for fault in error.every]
            raise in_lines(lines, self.file.source) from error

    def _root(self, number: int, drawn: Sequence[_Change]) -> tuple[Node, list[_Change]]:
        """The keys of a run's scenario, and what was replaced in them."""
        place = self._place(number)
        seed = Node(self._seed(place.case), self.file.root.line_of(("seed",)))
        changes = [*self._changes(place), *drawn, _Change(("seed",), seed, ("seed",))]
        root = self.file.bases[place.base].root
        if self.campaign.worlds:  # the course at the start is towards the goal of the generated world
            root = without(root, ("mission", "course_deg"))
        for loc, node, origin in changes:
            try:
                root = with_key(root, loc, node)
            except InputError as error:
                sentence = str(error).removeprefix("command line: ")
                raise InputError(self._line(origin, sentence)) from error
        return root, changes

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
        case, pair = divmod(number, math.prod(self._entry_sizes))
        combination = case % math.prod(self._sizes)
        base, world, *grid = (int(index) for index in np.unravel_index(combination, self._sizes))
        indices = map(int, np.unravel_index(pair, self._entry_sizes))
        return _Place(case, base, world, tuple(grid), dict(zip(self._names, indices, strict=True)))

    def _stream(self, case: int, stream: int) -> np.random.SeedSequence:
        return np.random.SeedSequence(self.campaign.seed, spawn_key=(case, stream))

    def _seed(self, case: int, stream: int = SEED) -> int:
        """A whole number of 53 bits, which every reader of JSON and YAML keeps."""
        return int(self._stream(case, stream).generate_state(1, np.uint64)[0] >> np.uint64(11))

    def _changes(self, place: _Place) -> list[_Change]:
        """What a run replaces in its scenario, in order, before what is drawn at random."""
        return [
            *(self._world(place.case, place.world) if self.campaign.worlds else ()),
            *(_Change(loc_of(name), self._at(("set", name)), ("set", name)) for name in self.campaign.set_),
            *(
                change
                for listed, section, first, _ in reversed(ENTRIES)
                for change in self._entry((listed, place.entries[listed]), section, first)
            ),
            *self._grid(place),
        ]

    def _generated(self, case: int, index: int) -> list[_Change]:
        """The generated world of a case."""
        spec = self.campaign.worlds[index]
        world = generated(spec, self._seed(case, WORLD))
        origin: Loc = ("worlds", index, spec.generator)
        made: Mapping[Loc, Any] = {
            ("area", "bounds_m"): world.bounds_m,
            ("obstacles",): world.obstacles,
            ("mission", "start_m"): world.start_m,
            ("mission", "goal_m"): world.goal_m,
        }
        line = self.file.root.line_of(origin)
        return [_Change(loc, node_of(plain, line), origin) for loc, plain in made.items()]

    def _entry(self, origin: Loc, section: str, first: str) -> list[_Change]:
        """An entry of `planners` or `aircraft`: bare text, or keys of that section of a scenario."""
        entry = self.file.root.at(origin)
        if entry is None:
            return []
        if not isinstance(entry.value, dict):
            return [_Change((section, first), entry, origin)]
        ordered = sorted(entry.value.items(), key=lambda pair: pair[0] != first)
        return [_Change((section, key), node, (*origin, key)) for key, node in ordered]

    def _grid(self, place: _Place) -> list[_Change]:
        pairs = zip(self.campaign.grid, place.grid, strict=True)
        origins: list[Loc] = [("grid", name, index) for name, index in pairs]
        return [_Change(loc_of(str(origin[1])), self._at(origin), origin) for origin in origins]

    def _drawn(self, place: _Place) -> list[_Change]:
        """What is drawn for a case: each key by a number in [0, 1) of its stream."""
        shares = np.random.default_rng(self._stream(place.case, DRAW)).random(len(self.campaign.random))
        changes = []
        for (name, each), share in zip(self.campaign.random.items(), shares.tolist(), strict=True):
            origin: Loc = ("random", name)
            if each.choice:
                node = self._at((*origin, "choice", each.chosen(share)))
            else:
                number = each.whole_number(share) if name in self._whole else each.number(share)
                node = Node(number, self.file.root.line_of(origin))
            changes.append(_Change(loc_of(name), node, origin))
        return changes

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
    asked = runs.scenario(run, overrides)
    with suppress(InputError):  # a planner that is not here: another one was given
        if not overrides or packed(runs.scenario(run)) == packed(asked):
            return asked, dict(zip(table["run"].to_pylist(), table["digest"].to_pylist(), strict=True)).get(
                run
            )
    return asked, None
