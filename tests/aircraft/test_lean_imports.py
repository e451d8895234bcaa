"""Nothing slow is imported before it is needed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LEAN = sorted(
    {
        ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for path in (ROOT / "aircraft").rglob("*.py")
        if path.stem != "__init__"
    }
    - {"aircraft.jsbsim_loading", "aircraft.jsbsim_model", "aircraft.survey"}
    - {"aircraft.climb", "aircraft.kernels", "aircraft.trials"}
)


def loaded_after(*modules: str) -> set[str]:
    code = f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"
    code += "".join(f"import {module}\n" for module in modules)
    code += "print(*(name.split('.')[0] for name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_importing_the_package_imports_neither_jsbsim_nor_numba_nor_yaml() -> None:
    assert "aircraft.guidance.preview" in LEAN
    loaded = loaded_after("aircraft", *LEAN)
    assert "aircraft" in loaded
    assert not loaded & {"jsbsim", "_jsbsim", "numba", "yaml", "shapely", "pyproj"}


@pytest.mark.parametrize("module", ["aircraft.frames"])
def test_geodesy_needs_not_even_numpy(module: str) -> None:
    assert "numpy" not in loaded_after(module)
