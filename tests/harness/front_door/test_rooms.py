"""Packages of our common names: a folder of the user's own may hide one."""

import subprocess
from pathlib import Path

import pytest

from tests.processes import python


def run(code: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return python("-c", code, folder=folder)


@pytest.mark.parametrize("room", ["planner", "harness"])
def test_a_folder_that_hides_ours_is_told(room: str, tmp_path: Path) -> None:
    (tmp_path / room).mkdir()
    (tmp_path / room / "__init__.py").touch()
    done = run("import wayproof\ntry: wayproof.fly\nexcept ImportError as error: print(error)", tmp_path)
    said = f"needs its own package '{room}', and Python finds another one first, {tmp_path / room / '__init__.py'}"
    assert said in done.stdout
    command = run("import sys; from wayproof.__main__ import main; sys.exit(main())", tmp_path)
    assert (command.returncode, command.stdout) == (2, "")
    assert said in command.stderr
    assert len(command.stderr.splitlines()) == 1


def test_a_module_that_hides_ours_is_told(tmp_path: Path) -> None:
    (tmp_path / "planner.py").touch()
    done = run("from wayproof import fly", tmp_path)
    assert done.stderr.splitlines()[-1].startswith("ImportError: wayproof needs its own package 'planner'")


def test_a_folder_without_code_hides_nothing(tmp_path: Path) -> None:
    (tmp_path / "planner").mkdir()
    assert run("import wayproof; wayproof.InputError", tmp_path).returncode == 0
