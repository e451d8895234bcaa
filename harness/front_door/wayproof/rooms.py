"""The packages that wayproof is made of: they have common names, and a folder of the user's own may hide one."""

import functools
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

ROOMS = ("planner", "aircraft", "harness")  # top packages, found beside this one


@functools.cache
def own_packages() -> Any:
    """The package `harness`, after a look at whether it and the others are ours; ImportError if not."""
    here = Path(__file__).resolve().parents
    root = here[1] if (here[1] / "harness").is_dir() else here[3]  # installed, or in a checkout
    for room in ROOMS:
        spec = find_spec(room)
        found = Path(spec.origin).resolve() if spec and spec.origin else None
        if found is None or found.parent != root / room:
            what = "does not find it" if found is None else f"finds another one first, {found}"
            raise ImportError(
                f"wayproof needs its own package {room!r}, and Python {what}: rename that folder or file, or move the "
                "script that is run (or start Python) into another folder; if it is another checkout of wayproof, run "
                "`pip install -e .` in it first",
                name=room,
            )
    return import_module("harness")
