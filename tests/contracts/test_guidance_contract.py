"""What every built-in guidance law must be, and the law that README shows."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from types import ModuleType

from aircraft.guidance.contract import GuidanceContract
from aircraft.guidance.registry import BUILT_IN, GuidanceKind

README = Path(__file__).parents[2] / "aircraft" / "README.md"

# One class of tests for each law: Test_preview and so on.
globals().update(
    {f"Test_{kind.kind}": type(f"Test_{kind.kind}", (GuidanceContract,), {"kind": kind}) for kind in BUILT_IN}
)


def law_of_readme() -> GuidanceKind:
    shown = re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)
    (code,) = (each for each in shown if "LAW = " in each)
    module = sys.modules["law_of_readme"] = ModuleType("law_of_readme")
    exec(code, vars(module))
    kind: GuidanceKind = module.LAW
    return kind


class TestLawOfReadme(GuidanceContract):
    """As a user is told to test an own law."""

    kind = law_of_readme()
