"""Planners that are handed over in Python, or by the name of a source file."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from harness.scenario.kinds import PLANNER, NoKeys, planner_kinds, registered
from planner.interface import Mission, Plan, PlanRequest, PlanStatus
from planner.registry import BUILT_IN, PlannerKind

MISSION = Mission((900.0, 0.0), 50.0, (-1e3, -1e3, 1e3, 1e3), 40.0, 100.0, 25.0, 1.0, 0.1, 500.0)


class Waits:
    """Finds nothing."""

    def __init__(self, mission: Mission | None = None, patience: int = 3) -> None:
        self.mission, self.patience = mission, patience

    def plan(self, request: PlanRequest) -> Plan:
        return Plan(PlanStatus.NO_PATH, "waits")


@pytest.fixture(autouse=True)
def fresh(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PLANNER, "registered", {})
    monkeypatch.setattr(sys, "path", [*sys.path])


def made(name: str) -> Waits:
    planner = planner_kinds()[name].make(NoKeys(), MISSION)
    assert isinstance(planner, Waits)
    return planner


def test_a_class_that_is_defined_anew_replaces_the_first() -> None:
    def define(patience: int) -> type[Waits]:
        class Later(Waits):
            def __init__(self) -> None:
                super().__init__(patience=patience)

        return Later

    first, second = registered(define(1)), registered(define(2))
    assert first == second
    assert made(second).patience == 2


def test_a_built_in_name_is_not_taken() -> None:
    assert registered(BUILT_IN[0]) == "rolling_window"
    assert registered("bug2") == "bug2"
    with pytest.raises(ValueError, match="there is a planner called bug2 already"):
        PLANNER.register(PlannerKind("bug2", "another", NoKeys, lambda keys, mission: Waits()))


def test_a_kind_in_a_file_keeps_its_keys(tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text("from planner.registry import BUILT_IN\nMINE = BUILT_IN[1]\n")
    name = registered(f"{path}:MINE")
    assert name == "mine.py:MINE"
    assert planner_kinds()[name].config is BUILT_IN[1].config


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("{folder}/none.py:A", "no such file; give FILE.py:NAME"),
        ("{folder}/mine.py:A", "mine.py has no A; it has Mine, make"),
        ("{folder}/mine.py:", "has no name; it has Mine, make"),
        ("{folder}/mine.py:NUMBER", "this is a int"),
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
    with pytest.raises(ValueError, match=said):
        registered(source.format(folder=tmp_path))
