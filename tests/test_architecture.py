"""The import rules of the project, and what else holds for every source, read off the sources."""

import ast
import re
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ROOMS = ("planner", "aircraft", "harness")
SOURCES = {
    str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
    for room in ROOMS
    for path in sorted((ROOT / room).rglob("*.py"))
}
"""Text of each source by its path."""
MAX_LINES = 400

# Which top-level packages a room may import besides the standard library and itself.
ALLOWED = {
    "planner": {"numba", "numpy", "shapely"},
    "aircraft": {"numpy", "numba", "jsbsim", "yaml"},
    "harness": {
        "numpy", "shapely", "pydantic", "pydantic_core", "pyarrow", "scipy", "pyproj", "rerun", "rich", "typer",
        "yaml", "matplotlib", "jinja2", "aerofiles", "pymavlink", "pyulog", "datafusion", "distributed",
        "gymnasium", "rasterio", "osmium", "planner", "aircraft", "wayproof",
    },
}  # fmt: skip
RUNS_WHAT_IT_READS = {"pickle", "marshal", "shelve"}
# Packages that only these files (patterns of `fnmatch`) may import.
ONLY_IN = {
    "jsbsim": ("aircraft/jsbsim_loading.py",),
    "rerun": ("harness/recording/*.py",),
    "yaml": ("aircraft/airframes.py", "harness/files/strict_yaml.py"),
    "typer": ("harness/cli/*.py"),
    "matplotlib": ("harness/*figure*.py",),
    "jinja2": ("harness/report/page.py",),
    "scipy": (
        "harness/campaign/paired.py", "harness/campaign/cell.py", "harness/certification/bounds.py",
        "harness/world_files/height_field.py", "harness/world_files/free_room.py",
    ),
    "pyproj": ("harness/world_files/plane.py", "harness/world_files/readers/footprints.py"),
    "rasterio": ("harness/world_files/readers/raster.py",),
    "osmium": ("harness/world_files/readers/osm.py",),
    "distributed": ("harness/campaign/workers.py",),
    "gymnasium": ("harness/learning/environments.py", "harness/front_door/wayproof/environments.py"),
    "datafusion": ("harness/recording/catalog.py",),
    "aerofiles": ("harness/run_files/drawn_lines.py",),
    "numba": ("planner/compiled.py", "planner/kernel_cache.py", "aircraft/kernels.py"),
    "harness.cli.app": ("harness/__main__.py", "harness/front_door/wayproof/__main__.py"),
    "wayproof": ("harness/front_door/wayproof/*.py",),
}  # fmt: skip
# Slow to import: inside the function that needs them, but for files that are imported late themselves.
LATE = {
    "jsbsim": ("aircraft/jsbsim_loading.py",),
    "numba": ("aircraft/kernels.py",),
    "rerun": ("harness/recording/*.py",),
    "pyproj": ("harness/world_files/*.py",),
    "shapely": ("harness/world_files/*.py", "planner/baselines/grown.py"),
    "typer": ("harness/cli/*.py"),
    "matplotlib": ("harness/*figure*.py",),
    "jinja2": ("harness/report/page.py",),
    "gymnasium": ("harness/learning/environments.py",),
    "aircraft.kernels": (), "pyarrow": (), "scipy": (), "distributed": (), "aerofiles": (), "pyulog": (),
    "pymavlink": (), "datafusion": (), "rasterio": (), "osmium": (),
}  # fmt: skip

LAYERS: dict[str, tuple[tuple[str, ...], ...]] = {
    "aircraft": (
        ("airframes", "climb", "law_cards"), ("card_cache", "survey"), ("trials",), ("jsbsim_model",),
        ("envelope", "jsbsim_loading"), ("airframe", "injection", "start"),
        ("autopilot", "frames", "guidance", "model_files"), ("actuators", "deviation", "kernels", "route"),
        ("interface",),
    ),
    "harness": (
        ("front_door",), ("api",), ("cli",), ("certification", "comparison", "falsify"),
        ("bench", "campaign", "replays"), ("learning", "report", "watching"), ("run",), ("recording",),
        ("analysis",), ("run_files",), ("flight",), ("world",), ("mapping",), ("scenario",), ("world_files",),
        ("files",),
    ),
    "planner": (
        ("contract",), ("registry",), ("baselines",), ("rolling_window",), ("paper",), ("shield",),
        ("keys", "memory", "world_stability"), ("geometry",), ("kernels",),
        ("compiled", "nearest_edge", "plan_checks"), ("interface", "kernel_cache"),
    ),
}  # fmt: skip
"""Subpackages and modules of a package, from the top down: each may import itself and what stands below it."""
FORBIDDEN = {("harness", "mapping"): ("harness.scenario", "harness.world")}
"""What a subpackage may not import although it stands below: the map must not reach the truth."""
MOST_MODULES = 20


def upward(path: str, source: str) -> list[str]:
    """The imports of a source that lead to its own layer, to a higher one, or to what is forbidden."""
    package, place, *_ = [*Path(path).with_suffix("").parts, ""]
    level = {name: number for number, names in enumerate(LAYERS.get(package, ())) for name in names}
    if place not in level:
        return []
    found = []
    for module in imports(source):
        top, _, rest = module.partition(".")
        there = rest.partition(".")[0]
        if top == package and there in level and there != place and level[there] <= level[place]:
            found.append(f"{path} imports {module}")
        if module.startswith(FORBIDDEN.get((package, place), ("-",))):
            found.append(f"{path} imports {module}")
    return found


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
    room = path.partition("/")[0]
    found = []
    for module in imports(source):
        top = module.partition(".")[0]
        if top not in {*sys.stdlib_module_names, room, *ALLOWED[room]} - RUNS_WHAT_IT_READS:
            found.append(f"{path} imports {module}")
        for guarded, files in ONLY_IN.items():
            if f"{module}.".startswith(f"{guarded}.") and not among(path, files):
                found.append(f"{path} imports {module}")
    for module in imports(at_the_top(source)):
        late = next((files for guarded, files in LATE.items() if f"{module}.".startswith(f"{guarded}.")), None)
        if late is not None and not among(path, late):
            found.append(f"{path} imports {module} at its top")
    return found


def among(path: str, patterns: Sequence[str]) -> bool:
    return any(fnmatch(path, pattern) for pattern in patterns)


def test_sources_keep_the_import_rules() -> None:
    assert {path: found for path, source in SOURCES.items() if (found := breaches(path, source))} == {}


def test_imports_lead_down() -> None:
    assert {path: found for path, source in SOURCES.items() if (found := upward(path, source))} == {}


@pytest.mark.parametrize("package", LAYERS)
def test_every_place_of_a_package_has_a_layer(package: str) -> None:
    places = {Path(path).relative_to(package).parts[0] for path in SOURCES if path.startswith(package)}
    listed = {name for names in LAYERS[package] for name in names}
    assert {place.removesuffix(".py") for place in places} - {"__init__", "__main__"} == listed


def test_no_package_is_a_drawer() -> None:
    folders = Counter(Path(path).parent for path in SOURCES if Path(path).stem != "__init__")
    assert {str(folder): count for folder, count in folders.items() if count > MOST_MODULES} == {}


def test_sources_are_of_a_readable_size() -> None:
    assert [path for path, source in SOURCES.items() if len(source.splitlines()) > MAX_LINES] == []


def test_sources_are_named_for_what_they_do() -> None:
    vague = {"utils", "util", "helpers", "common", "manager", "misc"}
    assert [path for path in SOURCES if Path(path).stem in vague] == []


@pytest.mark.parametrize(
    ("path", "source"),
    [
        ("planner/a.py", "from harness.world.world import World"),
        ("aircraft/a.py", "def f():\n    from planner import dubins"),
        ("harness/a.py", "import rerun.blueprint as rrb"),
        ("planner/a.py", "class A:\n    import shapely"),
        ("harness/a.py", "from pickle import loads"),
    ],
)
def test_a_breach_is_seen(path: str, source: str) -> None:
    assert breaches(path, source)
    assert upward("harness/mapping/a.py", "from harness.world.world import World")


def test_outputs_are_written_by_one_writer() -> None:
    """`harness.files.whole_file` follows no link and leaves no half file; others write into scratch folders only."""
    writes = re.compile(r"\.write_(text|bytes)\(|open\([^)]*\"[wa]b?\+?\"")
    found = {path for path, source in SOURCES.items() if path.startswith("harness/") and writes.search(source)}
    scratch = {
        "harness/api/paths.py",
        "harness/recording/viewer.py",
        "harness/replays/logs.py",
        "harness/cli/terminal.py",
    }
    assert found == scratch
