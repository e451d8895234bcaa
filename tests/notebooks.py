"""Runs the notebooks of `scenarios/notebooks` from their first cell to their last: `python -m tests.notebooks`.

A cell that raises ends it with a traceback and exit status 1. Nothing is written into the notebooks: they are kept
without outputs.
"""

import sys
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).parents[1] / "scenarios" / "notebooks"


def run(path: Path) -> None:
    """Runs one notebook in an empty folder; raises if a cell does, or if outputs were kept in it."""
    book = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
    if any(cell.get("outputs") for cell in book.cells):
        raise ValueError(f"{path} was saved with outputs; clear them")
    with tempfile.TemporaryDirectory() as folder:
        client = NotebookClient(book, timeout=600, kernel_name="python3", resources={"metadata": {"path": folder}})
        client.execute()


if __name__ == "__main__":
    for notebook in sorted(FOLDER.glob("*.ipynb")):
        print(notebook.name, flush=True)
        run(notebook)
    sys.exit(0)
