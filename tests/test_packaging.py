"""What the wheel holds, and that it flies from anywhere."""

import re
import shutil
import tomllib
import zipfile
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

from harness.run_files.run_folder import load_run
from tests.processes import FRONT_DOOR, ROOT, python

ROOMS = ("planner", "aircraft", "harness")
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def constraints() -> dict[str, str]:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pins = [line.split("==") for line in lines if not line.startswith("#")]
    return {normalised(name): pinned for name, pinned in pins}


def normalised(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    python("-c", f"import hatchling.build; hatchling.build.build_wheel({str(folder)!r})", check=True)
    (built,) = folder.glob("*.whl")
    return built


def test_wheel_holds_the_rooms_their_data_and_the_scenarios(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
        notes = {Path(name).name for name in archive.namelist()} - {Path(name).name for name in held}
    sources = {
        str(path.relative_to(ROOT))
        for room in ROOMS
        for path in (ROOT / room).rglob("*")
        if path.is_file() and not {"__pycache__", "front_door"} & {*path.parts}
    }
    own = {str(path.relative_to(FRONT_DOOR)) for path in (FRONT_DOOR / "wayproof").iterdir() if path.is_file()}
    shipped = [path for path in (ROOT / "scenarios").rglob("*") if path.is_file()]
    assert held == sources | {f"harness/{path.relative_to(ROOT)}" for path in shipped} | own
    assert {"wayproof/__init__.py", "wayproof/py.typed"} <= own
    assert {"aircraft/systems/autopilot.xml", "aircraft/airframes.yaml", "planner/py.typed"} <= held
    assert {"LICENSE", "entry_points.txt", "METADATA"} <= notes


def test_an_editable_installation_copies_no_source(tmp_path: Path) -> None:
    python("-c", f"import hatchling.build; hatchling.build.build_editable({str(tmp_path)!r})", check=True)
    (built,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(built) as archive:
        assert [name for name in archive.namelist() if name.endswith(".py")] == []
        (path,) = (name for name in archive.namelist() if name.endswith(".pth"))
        assert archive.read(path).decode().split() == [str(ROOT), str(FRONT_DOOR)]


@pytest.mark.flights
def test_unpacked_wheel_flies_from_an_empty_folder(wheel: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "site")
    for room in ROOMS:  # what was compiled of the same sources would take half a minute again
        for path in (*(ROOT / room).rglob("*.nbi"), *(ROOT / room).rglob("*.nbc")):
            copy = tmp_path / "site" / path.relative_to(ROOT)
            copy.parent.mkdir(exist_ok=True)
            shutil.copy(path, copy)
    (tmp_path / "empty").mkdir()
    (tmp_path / "empty" / "one.yaml").write_text(
        "schema: wayproof/campaign/1\nname: one\nseed: 1\nscenarios: [aerosonde_forest]\n"
    )
    where = "import harness, sys; sys.stdout.write(harness.__file__)"
    front_door = "import wayproof, sys; sys.stdout.write(wayproof.__file__ + wayproof.fly.__name__)"
    command = "from harness.cli.app import main; raise SystemExit(main())"
    for code, arguments, shown in (
        (where, [], str(tmp_path / "site")),
        (front_door, [], str(tmp_path / "site" / "wayproof" / "__init__.pyfly")),
        (command, ["fly", "aerosonde_forest", "--no-recording"], "reached: inside the goal circle"),
        (command, ["validate", "forest_planners"], "forest_planners"),
        (command, ["sweep", "one.yaml"], "results: runs/one/results.parquet"),
    ):
        run = python("-c", code, *arguments, folder=tmp_path / "empty", path=(tmp_path / "site",))
        assert run.returncode == 0, run.stderr
        assert shown in run.stdout
    read = load_run(tmp_path / "empty" / "runs" / "aerosonde_forest" / "rolling_window-aerosonde-1")
    assert read.metrics["outcome"] == "reached"


def test_everything_needed_is_pinned() -> None:
    pinned = constraints()
    needed = [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["dev"]]
    names = {normalised(re.split(r"[<>=!~\[; ]", line)[0]) for line in needed}
    assert names - pinned.keys() == set()
    assert all(re.fullmatch(r"\d+(\.\d+)*", pin) for pin in pinned.values())
    assert "rerun-sdk" in names


def test_rerun_is_held_to_one_minor_version() -> None:
    major, minor, _ = version("rerun-sdk").split(".")
    assert f"rerun-sdk>={major}.{minor},<{major}.{int(minor) + 1}" in PROJECT["dependencies"]
