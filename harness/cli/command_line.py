"""Parts that commands share: load a scenario, name a folder, report faults and interrupts, print JSON."""

from __future__ import annotations

import errno
import json
import os
import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import typer

from harness.cli.terminal import FlightReport, progress_bar, say
from harness.files.input_file import InputError, read_index
from harness.files.wording import counted, printable

if TYPE_CHECKING:
    from harness.scenario.scenario import Scenario

FAILED: Final = 1
"""Exit status of a command that ran but whose answer is no, that could not write, or in which the software failed."""
BAD_INPUT: Final = 2  # exit status of bad input or usage
FOLDER_KEYS: Final = ("name", "seed", "planner.kind", "planner.shield", "aircraft.model")
"""Keys that name the default folder of a run; a model that is a folder stands there by its last name."""


def world_notes(scenario: Scenario) -> dict[str, str]:
    """Says what was assumed of each file and passed over, and how many own obstacles stand wholly outside the area."""
    sources = scenario.sources or ()  # in layers, that nothing is solid is so at one altitude among many
    told = [[n for n in each.notes if not each.in_layers or "it is solid" not in n] for each in sources]
    files = [f"{each.path}: {'; '.join(notes)}" for each, notes in zip(sources, told, strict=True) if notes]
    notes = {f"file {number}": note for number, note in enumerate(files, start=1)}
    if outside := _outside(scenario):
        text = f"{counted(len(outside), 'obstacle')} wholly outside area.bounds_m"
        notes["outside"] = f"{text}, the first at {outside[0]}"
    mission = scenario.__dict__["_given"].sections["mission"]
    if (mission.start or mission.goal) and "origin" not in scenario.area.model_fields_set:
        origin = scenario.area.origin
        at = f"{origin.latitude_deg:g}, {origin.longitude_deg:g}"
        notes["origin"] = f"area.origin is not given: start and goal in degrees lie about the default, {at}"
    return notes


def _outside(scenario: Scenario) -> list[list[float]]:
    """Returns a place of each own obstacle that stands wholly outside the area."""
    xmin, ymin, xmax, ymax = scenario.area.bounds_m
    outside = []
    for each in scenario.obstacles:
        circle, polygon = each.circle, each.polygon
        places = (circle.center_m,) if circle else polygon.vertices_m if polygon else ()
        if not places or each.velocity_mps or (scenario.sources and each.heights_m):
            continue  # what moves may come in, and what is read from a file was cut at the border
        east, north = zip(*places, strict=True)
        apart_m = max(xmin - max(east), min(east) - xmax, ymin - max(north), min(north) - ymax)
        if apart_m > (circle.radius_m if circle else 0.0):
            outside.append(list(places[0]))
    return outside


def load(scenario: str, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """Loads a scenario by file or shipped name, with keys replaced; the error on a campaign names its command."""
    from harness.scenario.scenario import load_scenario

    try:
        return load_scenario(scenario, overrides)
    except InputError as error:
        from harness.campaign.campaign_file import is_a
        from harness.scenario.shipped import shipped_campaigns

        if scenario in shipped_campaigns() or (os.path.isfile(scenario) and is_a("campaign", Path(scenario))):
            use = shlex.join(["wayproof", "sweep", scenario])
            raise InputError(f"{scenario}: this is a campaign: use `{use}`") from error
        raise


def distinct_suffix(settings: Sequence[tuple[str, str]], named: Sequence[str] = FOLDER_KEYS) -> str:
    """Returns an ending for a default folder's name, so that runs with other settings do not replace one another."""
    from hashlib import sha256

    from harness.files.strict_yaml import as_spelt

    spelt = [(as_spelt(key), value.strip()) for key, value in settings]
    others = [(key, value) for key, value in spelt if key not in named or "/" in value]
    return f"-{sha256(json.dumps(others).encode()).hexdigest()[:8]}" if others else ""


def with_remedy(error: OSError) -> str:
    """Returns the text of a system's error, and a remedy where one is known."""
    if error.errno in (errno.EMFILE, errno.ENFILE):
        return f"{error}: raise the limit with `ulimit -n 1024`"
    try:
        os.getcwd()
    except FileNotFoundError:
        return "the working directory has been deleted: change to another"
    return str(error)


@contextmanager
def interruptible(left: Callable[[], str]) -> Iterator[None]:
    """Says after Ctrl-C what is left behind, by the sentence of `left`."""
    try:
        yield
    except KeyboardInterrupt:
        say(f"wayproof: interrupted; {left()}", err=True)
        raise


@contextmanager
def flying_into(folder: Path, length_m: float, silent: bool) -> Iterator[FlightReport]:
    """Shows progress of a flight of about `length_m` into a run folder; after Ctrl-C says what became of the folder."""
    from harness.run_files.run_folder import MANIFEST, SCHEMA

    left = partial(leftover_text, folder, "run", MANIFEST, SCHEMA)
    with interruptible(left), progress_bar(length_m, silent) as report:
        yield report


def leftover_text(folder: Path, what: str, index: str, schema: str) -> str:
    """Says what became of a folder that was being written."""
    begun = read_index(folder / index, schema)
    incomplete = begun is not None and begun.get("complete") is False
    return f"the {what} in {folder} is marked incomplete" if incomplete else "nothing was written"


@contextmanager
def resumable(folder: Path, again: str = "--resume") -> Iterator[None]:
    """Says after Ctrl-C what goes on with the flights; a full disk, or a cluster gone, ends with FAILED."""
    from harness.campaign.results import INDEX

    done = f"what is done is in {folder}, {again} goes on"
    try:
        with interruptible(lambda: done if (folder / INDEX).exists() else "nothing was written"):
            yield
    except OSError as error:
        say(f"wayproof: {with_remedy(error)}; {done}", err=True)
        raise typer.Exit(FAILED) from error


@contextmanager
def writing(out: Path, given: Iterable[Path] = ()) -> Iterator[None]:
    """Turns an OSError while a named file is written into an InputError, and refuses to replace one that is given."""
    try:
        if any(out.exists() and each.exists() and out.samefile(each) for each in given):
            raise InputError(f"{out}: is one of the files that are given; choose another to write")
        yield
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error.strerror}); give the path of a file") from error


def print_json(content: Any) -> None:
    """Prints a result for scripts."""
    text = json.dumps(content, indent=2, ensure_ascii=False)
    if printable(text) != text:
        # JSON has spelt out what ASCII has of them; what say() would make of the others is no JSON.
        text = "".join(c if c == printable(c) else f"\\u{ord(c):04x}" for c in text)
    say(text)
