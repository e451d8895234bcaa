"""Guidance as every flight of the harness has it: machine code in the place of `aircraft.guidance_law`, bit for bit."""

from __future__ import annotations

from aircraft.guidance import GuidanceLimits, PathFollower
from aircraft.guidance_law import COMPILED, update
from planner.compiled import compile_all, compiled

for _function, _arguments in COMPILED:
    compiled(*_arguments, unchecked=_function is update)(_function)  # flight models give nothing else


def path_follower(limits: GuidanceLimits) -> PathFollower:
    """The guidance of one flight; nothing is left to compile in it."""
    compile_all()
    return PathFollower(limits)
