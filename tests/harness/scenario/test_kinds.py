"""Planners and guidance laws of other distributions, handed over in Python, or by the name of a source file."""

import math
import sys
from dataclasses import MISSING, field, make_dataclass, replace
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from harness.scenario import kinds
from harness.scenario.kinds import GUIDANCE, PLANNER, LoopPart, PluginError, imported_sources, registered
from planner.registry import BUILT_IN
from tests.harness.api.test_stepping import flown
from wayproof import InputError, Plan, PlanRequest, PlanStatus, fly, load_scenario, make

MINE = replace(PLANNER.built_in[1], kind="mine")
MY_LAW = replace(GUIDANCE.built_in[1], kind="mine")
IMPOSTOR = replace(MINE, kind="rolling_window", summary="not the one that is built in")
LAW_IMPOSTOR = replace(MY_LAW, kind="preview", summary="not the one that is built in")

PARTS = pytest.mark.parametrize(
    ("part", "mine", "impostor"), [(PLANNER, "MINE", "IMPOSTOR"), (GUIDANCE, "MY_LAW", "LAW_IMPOSTOR")]
)


@pytest.fixture(autouse=True)
def nothing_registered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Other tests register kinds in this process."""
    for part in (PLANNER, GUIDANCE):
        monkeypatch.setattr(part, "registered", {})
    monkeypatch.setattr(sys, "path", [*sys.path])


def install(monkeypatch: pytest.MonkeyPatch, part: LoopPart, name: str) -> None:
    """Makes an attribute of this file known as an entry point of a distribution."""
    points = EntryPoints([EntryPoint(name.lower(), f"{__name__}:{name}", part.group)])
    monkeypatch.setattr(kinds, "entry_points", lambda group: points.select(group=group))


@PARTS
def test_a_kind_of_another_distribution_is_found_and_a_built_in_name_wins(
    part: LoopPart, mine: str, impostor: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    built_in = [kind.kind for kind in part.built_in]
    assert list(part.known()) == built_in
    install(monkeypatch, part, mine)
    assert list(part.known()) == [*built_in, "mine"]
    assert part.known()["mine"] is globals()[mine]
    with pytest.raises(ValueError, match=f"there is a {part.noun} called mine already"):
        part.register(globals()[mine])
    install(monkeypatch, part, impostor)
    assert list(part.known().values()) == list(part.built_in)


@PARTS
@pytest.mark.parametrize(
    ("named", "told"),
    [("install", "is no {}; mend or"), ("ABSENT", "cannot be loaded: AttributeError: .*'ABSENT'; mend or")],
)
def test_what_is_no_kind_or_cannot_be_loaded_is_refused(
    part: LoopPart, mine: str, impostor: str, named: str, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(monkeypatch, part, named)
    expected = rf"the {part.noun} of entry point .*:{named}\) of .* {told.format(part.kind.__name__)}"
    with pytest.raises(PluginError, match=expected):
        part.known()


def kind_of(planner: object) -> str:
    return make("paper_circles", planner=planner).scenario.planner.kind


def test_what_is_given_under_a_name_that_is_taken_keeps_a_flight_of_its_own() -> None:
    """As a class of a cell that is run again has the name of the first, and functions made in a loop have one name."""

    def define(said: str) -> type:
        class Later:
            def plan(self, request: PlanRequest) -> Plan:
                return Plan(PlanStatus.NO_PATH, said)

        return Later

    given: dict[str, object] = {said: define(said) for said in ("first", "second")}
    given |= {said: lambda said=said: define(said)() for said in ("third", "fourth")}
    scenario = load_scenario("paper_circles").with_({"mission.time_limit_s": 1})
    flights = {said: make(scenario, planner=each) for said, each in given.items()}
    assert len({flight.scenario.planner.kind for flight in flights.values()}) == 4
    for said, flight in flights.items():
        assert kind_of(given[said]) == flight.scenario.planner.kind
        assert said in fly(flight.scenario).reason
        assert said in flown(flight).reason


def test_the_last_of_many_that_are_given_are_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kinds, "MOST_NUMBERED", 2)
    names = [registered(lambda mission: mission) for _ in range(5)]
    assert [name in PLANNER.registered for name in names] == [True, False, False, True, True]
    assert len(set(names)) == 5


def test_a_built_in_name_is_not_taken_and_a_kind_in_a_file_keeps_its_keys(tmp_path: Path) -> None:
    assert [kind_of(each) for each in (BUILT_IN[0], "bug2")] == ["rolling_window", "bug2"]
    with pytest.raises(InputError, match="there is a planner called bug2 already"):
        kind_of(replace(BUILT_IN[0], kind="bug2"))
    path = tmp_path / "mine.py"
    path.write_text("from planner.registry import BUILT_IN\nMINE = BUILT_IN[0]\n")
    mine = make("paper_circles", planner=f"{path}:MINE").scenario.planner
    assert (mine.kind, mine.own) == ("mine.py:MINE", load_scenario("paper_circles").planner.own)


@PARTS
@pytest.mark.parametrize(
    ("key", "default", "derived", "told"),
    [
        ("kind", 1.0, 1.0, "kind: mine.*: its key kind is one of all kinds; rename it"),
        ("gain", -1.0, -1.0, "gain: is -1; must be at least 0"),
        ("gain", 1.0, math.nan, "gain: is nan; must be a finite number"),
        ("gain", 1.0, None, "kind: cannot be configured: AttributeError: .*gain"),
        ("gain", MISSING, 1.0, "gain: is missing; it is required"),
    ],
)
def test_own_keys_that_could_not_be_flown_again_are_refused(
    key: str, default: Any, derived: float | None, told: str, part: LoopPart, mine: str, impostor: str
) -> None:
    """What a run folder says is read again, and a section has one key of a name."""
    config: Any = make_dataclass("Config", [(key, float, field(default=default, metadata={"minimum": 0.0}))])
    config.resolved = lambda self, _told: None if derived is None else replace(self, **{key: derived})
    kind = replace(globals()[mine], config=config)
    with pytest.raises(InputError, match=rf"{'planner' if part is PLANNER else 'guidance'}\.{told}"):
        fly("paper_circles", **{"planner" if part is PLANNER else "guidance": kind})


def test_a_law_that_cannot_be_made_or_decides_nothing_is_told_before_the_flight() -> None:
    """Of one that flies to points no card is flown, so that the flight would be the first to make it."""
    bearing = next(kind for kind in GUIDANCE.built_in if kind.kind == "bearing")
    kind = replace(bearing, kind="torn", make=lambda _config, _limits: int(""))
    with pytest.raises(InputError, match=r"guidance\.kind: torn: it cannot be flown: ValueError"):
        fly(load_scenario("paper_circles").with_({"guidance.follow": "waypoints"}), guidance=kind)
    with pytest.raises(InputError, match=r"TypeError: update\(state\) gave None; must give a GuidanceOutput"):
        fly("paper_circles", guidance=SimpleNamespace(follow=lambda *_: None, update=lambda _: None))


def test_files_of_one_name_cannot_be_compared_and_a_source_may_be_shielded(tmp_path: Path) -> None:
    """Else both were flown as the later of them."""
    for said in ("first", "second"):
        (tmp_path / said).mkdir()
        (tmp_path / said / "mine.py").write_text("def Mine(mission): ...\n")
    names = [f"{tmp_path / said / 'mine.py'}:Mine" for said in ("first", "second")]
    with pytest.raises(InputError, match=r"would both be called mine.py:Mine; rename one of the files"):
        imported_sources("bug2", f"{names[0]}+shield", names[1])
    assert imported_sources(names[0], f"{names[0]}+shield", "bug2", None) == (names[0],)
    shielded = load_scenario("paper_circles").with_({"planner.kind": registered(f"{names[0]}+shield")}).planner
    assert (shielded.kind, shielded.shield) == ("mine.py:Mine", "loiter")


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("{folder}/none.py:A", "no such file; give FILE.py:NAME"),
        ("{folder}/mine.py:A", "mine.py has no A; it has Mine, make"),
        ("{folder}/mine.py:", "has no name; it has Mine, make"),
        ("{folder}/mine.py:NUMBER", "this is of type int"),
        ("{folder}/broken.py:A", "cannot be imported: ZeroDivisionError: division by zero"),
        ("{folder}/leaves.py:A", "cannot be imported: SystemExit: 0"),
        ("no_such.module:A", "there is no module no_such"),
        ("json:NoSuch", "json has no NoSuch"),
    ],
)
def test_what_cannot_be_imported_is_told_in_a_sentence(source: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("import json\nNUMBER = 3\nclass Mine: ...\ndef make(): ...\n")
    (tmp_path / "broken.py").write_text("1 / 0\n")
    (tmp_path / "leaves.py").write_text("import sys\nsys.exit(0)\n")
    with pytest.raises(InputError, match=f"wayproof: planner: .*{said}"):
        kind_of(source.format(folder=tmp_path))
