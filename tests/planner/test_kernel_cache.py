"""Compiled code on disk that is damaged is compiled anew, with one line, and never run."""

from hashlib import sha256
from pathlib import Path

import pytest

from tests.processes import ROOT, python

KERNEL = "import numba\n@numba.njit('float64(float64)', cache=True)\ndef twice(x):\n    return 2.0 * x\n"
CALL = """
from planner.kernel_cache import seal
seal()
import kernel
print(kernel.twice(21.0), sum(kernel.twice.stats.cache_hits.values()))
"""


def called(folder: Path) -> tuple[str, list[str]]:
    """What the kernel gives and how often it was loaded; the lines on standard error."""
    cache = {"NUMBA_CACHE_DIR": str(folder / "cache")}
    done = python("-c", CALL, path=(ROOT, folder), environment=cache, check=True)
    return done.stdout.strip(), done.stderr.splitlines()


@pytest.mark.flights
@pytest.mark.parametrize(("ending", "place"), [("nbc", 0.5), ("nbi", 0.9)])
def test_a_damaged_kernel_is_compiled_anew(ending: str, place: float, tmp_path: Path) -> None:
    (tmp_path / "kernel.py").write_text(KERNEL)
    assert called(tmp_path) == ("42.0 0", [])
    assert called(tmp_path) == ("42.0 1", [])
    (file,) = (tmp_path / "cache").rglob(f"*.{ending}")
    data = bytearray(file.read_bytes())
    data[int(place * len(data))] ^= 1
    file.write_bytes(data)
    result, (line,) = called(tmp_path)
    assert result == "42.0 0"
    assert "is damaged, or of an older version: compiled anew" in line
    assert called(tmp_path) == ("42.0 1", [])


ALGEBRA = """
import sys
from planner.kernel_cache import seal
seal()
import numpy as np
import plain
assert plain.twice(2.0) == 4.0
assert "scipy.linalg" not in sys.modules
import kernel
a = np.array([[2.0, 1.0], [1.0, 3.0]])
print(*kernel.algebra(a).ravel(), sum(kernel.algebra.stats.cache_hits.values()))
"""


@pytest.mark.flights
def test_linear_algebra_of_a_users_kernel_is_there_when_it_is_asked_for(tmp_path: Path) -> None:
    """Compiled, and loaded: A x A^-1 + cov(A), by hand, of A = [[2, 1], [1, 3]]; other kernels import none of it."""
    body = "    return np.dot(x, np.linalg.inv(x)) + np.cov(x)\n"
    head = "import numba\nimport numpy as np\n@numba.njit('float64[:, ::1](float64[:, ::1])', cache=True)\n"
    (tmp_path / "kernel.py").write_text(f"{head}def algebra(x):\n{body}")
    (tmp_path / "plain.py").write_text(KERNEL)
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    for hits in ("0", "1"):
        done = python("-c", ALGEBRA, path=(ROOT, tmp_path), environment=cache, check=True)
        *numbers, loaded = done.stdout.split()
        assert [float(each) for each in numbers] == pytest.approx([1.5, -1.0, -1.0, 3.0])
        assert loaded == hits


def assert_sealed(folder: Path) -> None:
    """There is machine code, and each file ends in the SHA-256 of what stands before that."""
    files = [file.read_bytes() for file in folder.rglob("*.nbc")]
    assert files
    assert all(sha256(data[:-32]).digest() == data[-32:] for data in files)


LIST = """
from aircraft import airframes
airframes.aircraft_names = lambda: ("aerosonde",)
from harness.cli.app import main
main(["list", "aircraft"])
"""


@pytest.mark.flights
def test_what_a_survey_compiles_is_sealed(tmp_path: Path) -> None:
    """As first command on a machine."""
    keys = {"XDG_CACHE_HOME": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path)}
    for flown in (True, False):
        assert ("flown for the figures" in python("-c", LIST, environment=keys, check=True).stderr) == flown
    assert_sealed(tmp_path)


CARD = """
import wayproof
scenario = wayproof.load_scenario("aerosonde_forest")
scenario.with_({"guidance.kind": "l1", "guidance.period_s": %s, "conditions": "%s"})
"""


@pytest.mark.flights
def test_what_the_card_of_a_law_or_of_a_days_servos_compiles_is_sealed(tmp_path: Path) -> None:
    for period_s, day in ((18.0, "ideal"), (19.0, "ideal"), (19.0, "rough")):  # later ones: it is surveyed
        code = tmp_path / f"code{period_s:g}{day}"
        keys = {"XDG_CACHE_HOME": str(tmp_path), "NUMBA_CACHE_DIR": str(code)}
        python("-c", CARD % (period_s, day), environment=keys, check=True)
        assert_sealed(code)
