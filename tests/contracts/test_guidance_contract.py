"""What every built-in guidance law must be."""

from __future__ import annotations

from aircraft.guidance.contract import GuidanceContract
from aircraft.guidance.registry import BUILT_IN

# One class of tests for each law: Test_preview and so on.
globals().update(
    {f"Test_{kind.kind}": type(f"Test_{kind.kind}", (GuidanceContract,), {"kind": kind}) for kind in BUILT_IN}
)
