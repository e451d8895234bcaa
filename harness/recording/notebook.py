"""rerun's viewer as a widget in a notebook."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any


class NotebookError(RuntimeError):
    """The widget cannot be made; the message says what helps."""


def in_notebook() -> bool:
    """Whether this process answers a notebook: IPython runs in it with a kernel."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return getattr(shell, "kernel", None) is not None


def viewer_widget(recording: Path, width_px: int, height_px: int) -> Any:
    """A widget that shows a recording with its layout.

    Args:
        recording: the file.
        width_px: of the widget.
        height_px: of the widget.

    Raises:
        NotebookError: rerun's notebook viewer is not installed.
    """
    import rerun as rr
    from rerun import notebook

    if not notebook.HAS_NOTEBOOK:
        raise NotebookError(
            "to show recordings in a notebook needs rerun's viewer; pip install 'wayproof[notebook]'"
        )
    stream = rr.RecordingStream("wayproof-notebook")
    viewer = notebook.Viewer(width=width_px, height=height_px, recording=stream)
    stream.log_file_from_path(recording)
    return viewer
