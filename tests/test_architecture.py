"""The import rules of the project, and what else holds for every source, read off the sources."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ROOMS = ("planner", "aircraft", "harness")
SOURCES = {str(p.relative_to(ROOT)): p for room in ROOMS for p in sorted((ROOT / room).rglob("*.py"))}
MAX_LINES = 400

# Which top-level packages a room may import besides the standard library and itself.
ALLOWED = {
    "planner": {"numba", "numpy", "shapely", "ompl"},
    "aircraft": {"numpy", "jsbsim", "yaml"},
    "harness": {
        "numpy",
        "shapely",
        "pydantic",
        "pydantic_core",
        "pyarrow",
        "scipy",
        "rerun",
        "rich",
        "typer",
        "yaml",
        "matplotlib",
        "jinja2",
        "distributed",
        "planner",
        "aircraft",
    },
}
# Packages that only these files (patterns of `fnmatch`) may import.
ONLY_IN = {
    "jsbsim": ("aircraft/jsbsim_loading.py",),
    "rerun": ("harness/rerun_*.py",),
    "yaml": ("aircraft/airframes.py", "harness/strict_yaml.py"),
    "typer": ("harness/cli.py", "harness/commands/*.py"),
    "matplotlib": ("harness/*figure*.py",),
    "jinja2": ("harness/report.py",),
    "scipy": (
        "harness/sampling.py",
        "harness/campaign_paired.py",
        "harness/campaign_summary.py",
        "harness/falsify_search.py",
    ),
    "distributed": ("harness/sweep_workers.py",),
    "numba": ("planner/compiled.py",),
    "ompl": ("planner/dubins_tree.py",),
    "harness.cli": ("harness/__main__.py",),
}
# Slow to import: inside the function that needs them, but for files that are imported late themselves.
LATE = {
    "jsbsim": ("aircraft/jsbsim_loading.py",),
    "numba": (),
    "rerun": ("harness/rerun_*.py",),
    "pyarrow": (),
    "scipy": (),
    "shapely": (),
    "typer": ("harness/cli.py", "harness/commands/*.py"),
    "matplotlib": ("harness/*figure*.py",),
    "jinja2": ("harness/report.py",),
    "ompl": (),
    "distributed": (),
}


def at_the_top(source: str) -> str:
    """What is left of a source without its functions and what only type checkers read."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) != "TYPE_CHECKING":
            continue
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.If):
            node.body = [ast.Pass()]
    return ast.unparse(tree)


def imports(source: str) -> Iterator[str]:
    """Dotted names of all modules that a source imports, at its top or inside a function."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative import"
            assert node.module
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def breaches(path: str, source: str) -> list[str]:
    """What a source breaks of the rules."""
    room = path.partition("/")[0]
    found = []
    for module in imports(source):
        top = module.partition(".")[0]
        if top not in {*sys.stdlib_module_names, room, *ALLOWED[room]}:
            found.append(f"{path} imports {module}")
        for guarded, files in ONLY_IN.items():
            if f"{module}.".startswith(f"{guarded}.") and not among(path, files):
                found.append(f"{path} imports {module}")
    for module in imports(at_the_top(source)):
        late = LATE.get(module.partition(".")[0])
        if late is not None and not among(path, late):
            found.append(f"{path} imports {module} at its top")
    return found


def among(path: str, patterns: tuple[str, ...]) -> bool:
    return any(fnmatch(path, pattern) for pattern in patterns)


@pytest.mark.parametrize("path", SOURCES)
def test_keeps_the_import_rules(path: str) -> None:
    assert breaches(path, SOURCES[path].read_text()) == []


@pytest.mark.parametrize("path", SOURCES)
def test_is_of_a_readable_size(path: str) -> None:
    assert len(SOURCES[path].read_text().splitlines()) <= MAX_LINES


@pytest.mark.parametrize("path", SOURCES)
def test_is_named_for_what_it_does(path: str) -> None:
    assert Path(path).stem not in {"utils", "util", "helpers", "common", "manager", "misc"}


@pytest.mark.parametrize(
    ("path", "source"),
    [
        ("planner/a.py", "import jsbsim"),
        ("planner/a.py", "from harness.world import World"),
        ("planner/a.py", "from aircraft.interface import Route"),
        ("aircraft/a.py", "def f():\n    from planner import dubins"),
        ("aircraft/a.py", "import jsbsim"),
        ("harness/a.py", "import rerun as rr"),
        ("harness/a.py", "import rerun.blueprint as rrb"),
        ("harness/a.py", "from harness import cli"),
        ("harness/a.py", "import yaml"),
        ("harness/a.py", "import matplotlib.pyplot"),
        ("harness/rerun_a.py", "import shapely"),
        ("harness/a.py", "import pyarrow as pa"),
        ("planner/a.py", "class A:\n    import shapely"),
        ("planner/a.py", "def f():\n    import ompl.base"),
        ("planner/dubins_tree.py", "from ompl import base"),
        ("harness/a.py", "def f():\n    from ompl import base"),
        ("harness/a.py", "def f():\n    import jinja2"),
        ("harness/sampling.py", "from scipy.stats import qmc"),
        ("harness/a.py", "def f():\n    import distributed"),
    ],
)
def test_a_breach_is_seen(path: str, source: str) -> None:
    assert breaches(path, source)


@pytest.mark.parametrize(
    ("path", "source"),
    [
        ("harness/rerun_a.py", "import rerun as rr"),
        ("harness/rerun_a.py", "def f():\n    import shapely"),
        ("harness/a.py", "if TYPE_CHECKING:\n    import pyarrow as pa"),
        ("aircraft/a.py", "import numpy as np\nimport math"),
        ("planner/dubins_tree.py", "def f():\n    from ompl import base"),
        ("harness/figures.py", "import matplotlib as mpl"),
        ("harness/report.py", "import jinja2"),
    ],
)
def test_what_is_allowed_is_no_breach(path: str, source: str) -> None:
    assert breaches(path, source) == []
