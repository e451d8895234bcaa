"""Makes the API reference from the docstrings, a page a module: `python -m tests.reference [FOLDER]`.

Whatever pdoc warns of is an error: a name that does not resolve, an annotation that is none.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from types import ModuleType
from typing import get_type_hints

import pdoc
import pdoc.extract

import wayproof

MODULES = ("wayproof", "planner", "aircraft", "harness", "!harness.front_door")


def write(folder: Path) -> None:
    """Writes the reference into a folder; `index.html` leads to it."""
    for name in wayproof.__all__:
        getattr(wayproof, name)  # pdoc looks for names that are there already
    pdoc.render.configure(docformat="google", search=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in pdoc.extract.walk_specs(MODULES):
            _resolve_rows(pdoc.extract.load_module(name))
        pdoc.pdoc(*MODULES, output_directory=folder)


def _resolve_rows(module: ModuleType) -> None:
    # The constructor of a NamedTuple keeps the text of its annotations, without the module that tells what they mean.
    for row in vars(module).values():
        if isinstance(row, type) and hasattr(row, "_fields"):
            row.__new__.__annotations__ = get_type_hints(row)


if __name__ == "__main__":
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "reference")
    write(out)
    print(f"reference: {out / 'index.html'}")
