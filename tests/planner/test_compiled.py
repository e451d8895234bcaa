"""Compiled functions: when, for which arguments, and where there is no place to keep what was compiled."""

import io
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from planner import compiled
from planner.compiled import FLOAT, ROWS, Compiled
from planner.kernels.fans import encircled
from tests.processes import ROOT, python


def twice(x: float) -> float:
    return 2.0 * x


def inverse(x: float) -> float:
    return 1.0 / x


def total(rows: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> float:
    return rows[0, 0] + rows[1, 1]  # type: ignore[no-any-return]


@pytest.fixture(autouse=True)
def names_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiling puts what is compiled in the place of a function."""
    for function in (twice, inverse, total):
        monkeypatch.setitem(globals(), function.__name__, function)


def ran(source: str, folder: Path, **environment: str) -> list[str]:
    """What a program writes that is run in another folder, whose modules it finds."""
    done = python("-c", source, folder=folder, path=(ROOT, folder), environment=environment, check=True)
    return done.stdout.split()


def test_to_import_planners_compiles_nothing_and_no_search_compiles(tmp_path: Path) -> None:
    source = """
import sys, planner.baselines.mppi, planner.compiled, planner.registry
print("numba" in sys.modules or any(each.rare for each in planner.compiled._waiting))
from planner.geometry.clearance import inside_bounds
from planner.interface import Path
print(inside_bounds(Path([(0.0, 0.0, 1.0, 0.0, 0.0, 9.0)]), (0.0, 0.0, 10.0, 10.0)), "numba" in sys.modules)
"""
    assert ran(source, tmp_path) == ["False", "True", "True"]


@pytest.mark.flights
def test_where_nothing_can_be_kept_functions_are_compiled_all_the_same(tmp_path: Path) -> None:
    """From a file that cannot be found again there is nowhere to keep them."""
    source = """
from planner.compiled import FLOAT, Compiled
names = {}
exec("def twice(x): return 2.0 * x", names)
made = Compiled(names["twice"], (FLOAT,))
made.compile()
print(made(21.0))
"""
    assert ran(source, tmp_path, HOME="/nonexistent") == ["42.0"]


def test_division_by_zero_gives_what_it_gives_in_numpy() -> None:
    made = Compiled(inverse, (FLOAT,))
    made.compile()
    assert made(0.0) == np.inf


def test_nothing_is_compiled_in_flight() -> None:
    """Arguments of other types are refused, where compiling anew would take seconds."""
    loop, points = np.zeros((3, 2)), np.zeros((2, 4))[:, ::2]
    with pytest.raises(TypeError, match="No matching definition"):
        encircled(loop, points)


def test_what_is_only_read_may_be_read_only() -> None:
    made = Compiled(total, (ROWS,))
    made.compile()
    rows = np.eye(2)
    rows.setflags(write=False)
    assert made(rows) == 2.0


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("stream", "lines"), [(Terminal, 1), (io.StringIO, 0)])
def test_that_it_compiles_is_told_once_and_to_a_person_alone(
    stream: type[io.StringIO], lines: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    terminal = stream()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(compiled, "_waiting", [Compiled(twice, (FLOAT,)), Compiled(inverse, (FLOAT,))])
    for made in compiled._waiting:
        monkeypatch.setattr(made, "compile", partial(setattr, made, "anew", True))
    compiled.compile_all()
    assert terminal.getvalue().count("wayproof: compiling for this machine, once") == lines
    assert terminal.getvalue().count("\n") == lines


@pytest.mark.flights
def test_what_was_kept_is_loaded_and_nothing_is_told(tmp_path: Path) -> None:
    source = """
from planner.compiled import FLOAT, Compiled
from keepable import twice
made = Compiled(twice, (FLOAT,))
made.compile()
print(made.anew)
"""
    (tmp_path / "keepable.py").write_text("def twice(x):\n    return 2.0 * x\n")
    cache = str(tmp_path / "cache")
    assert [ran(source, tmp_path, NUMBA_CACHE_DIR=cache) for _ in range(2)] == [["True"], ["False"]]


@pytest.mark.flights
def test_another_process_compiles_some_of_them(tmp_path: Path) -> None:
    """Of three modules one is compiled elsewhere; all here where that cannot be, fails, or takes less than to start.

    Where it was begun before other work, it compiles all but the one that told that nothing is on disk.
    """
    source = """
import importlib, os, sys
import planner.compiled
from planner.compiled import begin_compiling, compile_all
for folder, processors, python, starts_bytes in (
    ("two", 2, sys.executable, 0),
    ("one", 1, sys.executable, 0),
    ("fails", 2, "/bin/false", 0),
    ("missing", 2, "/no/such/file", 0),
    ("little", 2, sys.executable, planner.compiled.STARTS_BYTES),
    ("begun", 2, sys.executable, 0),
    ("begun_alone", 1, sys.executable, 0),
    ("begun_fails", 2, "/bin/false", 0),
):
    os.cpu_count, sys.executable, planner.compiled.STARTS_BYTES = lambda: processors, python, starts_bytes
    made = [importlib.import_module(f"{folder}.{name}").it for name in "abc"]
    if folder.startswith("begun"):
        begin_compiling(10**9)
    compile_all()
    print(folder, *(each(1.0) for each in made), sum(each.anew for each in made))
"""
    here = {"two": "2", "one": "3", "fails": "3", "missing": "3", "little": "3"}
    here |= {"begun": "1", "begun_alone": "3", "begun_fails": "3"}
    for folder in here:
        (tmp_path / folder).mkdir()
        for number, name in enumerate("abc"):
            text = f"@compiled('float64')\ndef it(x):\n    return x + {number}\n"
            (tmp_path / folder / f"{name}.py").write_text(f"from planner.compiled import compiled\n{text}")
    said = ran(source, tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    assert said == [word for folder in here for word in (folder, "1.0", "2.0", "3.0", here[folder])]
