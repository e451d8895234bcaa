"""Makes the API reference from the docstrings, a page a module: `python -m tests.reference [FOLDER]`.

Whatever pdoc warns of is an error: a name that does not resolve, an annotation that is none.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import get_type_hints

import pdoc

import wayproof
from planner.interface import PlanRequest

MODULES = ("wayproof", "planner", "aircraft", "harness", "!harness.front_door")


def write(folder: Path) -> None:
    """Writes the reference into a folder; `index.html` leads to it."""
    for name in wayproof.__all__:
        getattr(wayproof, name)  # pdoc looks for names that are there already
    # Where it was made, a NamedTuple does not know of classes below it.
    PlanRequest.__new__.__annotations__ = get_type_hints(PlanRequest)
    pdoc.render.configure(docformat="google", search=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pdoc.pdoc(*MODULES, output_directory=folder)


if __name__ == "__main__":
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "reference")
    write(out)
    print(f"reference: {out / 'index.html'}")
