"""Nothing slow is imported before it is needed."""

import pytest

from tests.processes import ROOT, python

MODULES = [each.relative_to(ROOT).with_suffix("").parts for each in (ROOT / "aircraft").rglob("*.py")]
SLOW = {f"aircraft.{name}" for name in ("jsbsim_loading", "jsbsim_model", "survey", "climb", "kernels", "trials")}
LEAN = sorted({".".join(each) for each in MODULES if each[-1] != "__init__"} - SLOW)


def loaded_after(*modules: str) -> set[str]:
    code = "".join(f"import {module}\n" for module in ("sys", *modules))
    code += "print(*(name.split('.')[0] for name in sys.modules))"
    return set(python("-c", code, check=True).stdout.split())


def test_importing_the_package_imports_neither_jsbsim_nor_numba_nor_yaml() -> None:
    assert "aircraft.guidance.preview" in LEAN
    loaded = loaded_after("aircraft", *LEAN)
    assert "aircraft" in loaded
    assert not loaded & {"jsbsim", "_jsbsim", "numba", "yaml", "shapely", "pyproj"}


@pytest.mark.parametrize("module", ["aircraft.frames"])
def test_geodesy_needs_not_even_numpy(module: str) -> None:
    assert "numpy" not in loaded_after(module)
