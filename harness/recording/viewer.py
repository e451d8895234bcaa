"""Looking at recordings: the rerun viewer of the installed wheel, in a window, a browser or without a screen.

It listens on 127.0.0.1 only and sends no usage statistics. rerun's web page would, and asks for fonts and versions: it
is passed on with a content security policy (W3C, CSP level 3), with which the browser refuses every other address.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.parse import quote

from harness.files.errors import RunFolderError
from harness.files.input_file import InputError
from harness.flight.signals import signals_as_interrupt
from harness.recording.overlay import send_recording, write_overlay
from harness.run_files.run_folder import OVERLAY, RECORDING, recording_of

LOCALHOST = "127.0.0.1"
CONTENT_POLICY = (
    "default-src 'self' 'unsafe-inline' 'unsafe-eval' 'wasm-unsafe-eval' blob: data:; "
    f"connect-src 'self' blob: data: http://{LOCALHOST}:* ws://{LOCALHOST}:*"
)
"""The page may load its own parts only, and talk to this machine only."""
PASSED_HEADERS = ("Content-Type", "Content-Encoding", "Cache-Control")
"""Headers of rerun's server that are passed on with its answers."""
OUTSIDE_PARTS = re.compile(rb"<link\b[^>]*https?://[^>]*>|https://[^\"']*\.js\b")
"""Matches parts of the page that load something from elsewhere: fonts and the script of statistics."""
START_TIMEOUT_S = 30.0  # the viewer's server must answer within this
ENDING = ".rrd"  # ending of a recording's name
VIEWER_LOG = "viewer.log"  # file with what the viewer printed
NO_SCREEN = (
    "there is no screen to open the viewer on (neither DISPLAY nor WAYLAND_DISPLAY is set); `wayproof view --web`, or "
    f"`wayproof fly --live --web`, shows it in a browser; or copy the run's {RECORDING} to a machine with a screen and "
    f"open it there: rerun {RECORDING}"
)
NO_DRIVER = (
    "the headless viewer did not start: it needs a Vulkan driver (on Debian: apt-get install mesa-vulkan-drivers)"
)


class ViewerError(RuntimeError):
    """The viewer cannot be run; the message says why and what helps."""


def open_viewer(
    run_dirs: Sequence[Path], web: bool = False, report: Callable[[str], None] = lambda warning: None
) -> None:
    """Opens the recordings of runs in the viewer and waits until it is closed. Several are overlaid in one.

    Raises RunFolderError for a folder without a recording, InputError for a recording that does not exist or is to be
    overlaid, ViewerError where there is no screen or the viewer does not start.
    """
    if len(run_dirs) == 1:
        run_dirs = [_overlay_of(run_dirs[0])]
    for each in (each for each in run_dirs if each.suffix.lower() == ENDING):
        if not each.is_file():
            raise InputError(f"{each}: no such file")
        if len(run_dirs) > 1:
            raise InputError(f"{each}: a recording is opened alone; run folders are overlaid")
    recordings = [each if each.suffix.lower() == ENDING else recording_of(each) for each in run_dirs]
    with tempfile.TemporaryDirectory(prefix="wayproof-view-") as scratch:
        shown = recordings[0]
        if len(recordings) > 1:
            shown = Path(scratch) / "overlay.rrd"
            if warning := write_overlay(recordings, run_names(run_dirs), shown):
                report(warning)
        with empty_viewer(web, report) as (viewer, source):
            # A viewer that serves a file to a browser keeps a processor busy; one that is sent it does not.
            send_recording(shown, source)
            wait_for(viewer)


def _overlay_of(folder: Path) -> Path:
    """Returns the overlay in the folder of a comparison; any other path as it is."""
    if (folder / RECORDING).exists():
        return folder
    if len(overlays := sorted([*folder.glob(OVERLAY), *folder.glob(f"*/{OVERLAY}")])) > 1:
        known = ", ".join(map(str, overlays))
        raise RunFolderError(f"{folder} compares several scenarios; name one of {known}")
    return overlays[0] if overlays else folder


@contextlib.contextmanager
def empty_viewer(
    web: bool = False, report: Callable[[str], None] = lambda address: None, url: str | None = None
) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Opens a viewer, in a window or a browser; gives it, and the address that takes recordings.

    `report` gets the address for the browser, which opens `url` in place of what the viewer is sent. A ViewerError
    says that there is no screen, or that the viewer does not start.
    """
    if not web and sys.platform == "linux" and not (os.environ.keys() & {"DISPLAY", "WAYLAND_DISPLAY"}):
        raise ViewerError(NO_SCREEN)
    port, web_port, page_port = free_port(), free_port(), free_port()
    source = f"rerun+http://{LOCALHOST}:{port}/proxy"
    arguments = ["--bind", LOCALHOST, "--port", str(port)]
    with tempfile.TemporaryDirectory(prefix="wayproof-view-") as scratch:
        if not web:
            with viewer_process([*arguments, "--hide-welcome-screen"], Path(scratch), port) as viewer:
                yield viewer, source
            return
        arguments += ["--serve-web", "--web-viewer-port", str(web_port)]
        with (
            viewer_process(arguments, Path(scratch), port, web_port) as viewer,
            local_page(page_port, web_port),
        ):
            address = f"http://{LOCALHOST}:{page_port}/?url={quote(url or source, safe='')}"
            report(f"{address} (Ctrl-C ends it)")
            webbrowser.open(address)
            yield viewer, source


@contextlib.contextmanager
def local_page(port: int, source_port: int) -> Iterator[None]:
    """Serves the page of rerun's web server with the policy, for the length of the block."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            try:
                with urllib.request.urlopen(f"http://{LOCALHOST}:{source_port}{self.path}") as answer:
                    self.send_response(answer.status)
                    for name in PASSED_HEADERS:
                        if name in answer.headers:
                            self.send_header(name, answer.headers[name])
                    self.send_header("Content-Security-Policy", CONTENT_POLICY)
                    self.send_header("Connection", "close")
                    if answer.headers.get_content_type() == "text/html":
                        page = OUTSIDE_PARTS.sub(b"", answer.read())
                        self.send_header("Content-Length", str(len(page)))
                        self.end_headers()
                        self.wfile.write(page)
                    else:
                        self.end_headers()
                        shutil.copyfileobj(answer, self.wfile)
            except HTTPError as error:
                self.send_error(error.code)
            except ConnectionError:  # the browser has gone, or the viewer has
                self.close_connection = True

        def log_message(self, format: str, *args: object) -> None:
            """Requests are not logged."""

    with ThreadingHTTPServer((LOCALHOST, port), Handler) as server:
        thread = threading.Thread(target=server.serve_forever, name="page", daemon=True)
        thread.start()
        try:
            yield
        finally:
            server.shutdown()
            thread.join()


def wait_for(viewer: subprocess.Popen[str]) -> None:
    """Waits until a viewer is closed, or Ctrl-C is pressed; a ViewerError says that it broke off."""
    with contextlib.suppress(KeyboardInterrupt):
        if viewer.wait() == 0:
            return
        raise ViewerError(f"the viewer ended with status {viewer.returncode}")


def run_names(run_dirs: Sequence[Path]) -> list[str]:
    """Names runs by as much of the end of each path as tells them apart."""
    paths = [folder.resolve().parts for folder in run_dirs]
    longest = max(map(len, paths))
    length = next((n for n in range(1, longest) if len({path[-n:] for path in paths}) == len(paths)), 1)
    return ["/".join(path[-length:]) for path in paths]


def _executable() -> str:
    """Returns the viewer's own program; the wheel's `rerun` command only wraps it and would leave it behind."""
    spec = find_spec("rerun_cli")
    folder = Path(spec.origin).parent if spec is not None and spec.origin else Path()
    for name in ("rerun", "Rerun.app/Contents/MacOS/Rerun", "rerun.exe"):
        if (folder / name).is_file():
            return str(folder / name)
    remedy = "pip install 'rerun-sdk>=0.41,<0.42'"
    raise ViewerError(f"the installed rerun-sdk has no viewer; install it with: {remedy}")


@contextlib.contextmanager
def viewer_process(arguments: Sequence[str], scratch: Path, *ports: int) -> Iterator[subprocess.Popen[str]]:
    """Runs a viewer that is ended with the block; settings that allow no statistics lie in `scratch`.

    A ViewerError says that there is none, or that it does not come to listen on the ports.
    """
    settings = scratch / "rerun" / "analytics.json"
    settings.parent.mkdir()
    none = {"analytics_enabled": False, "analytics_id": "", "metadata": {}}
    paths = {"config_file_path": str(settings), "data_dir_path": str(scratch)}
    settings.write_text(json.dumps(none | paths), encoding="utf-8")
    environment = {**os.environ, "XDG_CONFIG_HOME": str(scratch), "RUST_LOG": "error"}
    command = [_executable(), *arguments]
    with (
        (scratch / VIEWER_LOG).open("w+", encoding="utf-8") as log,
        subprocess.Popen(
            command, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log, text=True
        ) as viewer,
    ):
        try:
            with signals_as_interrupt():
                if not all(answers(port, viewer) for port in ports):
                    told = (scratch / VIEWER_LOG).read_text(encoding="utf-8", errors="replace").strip()
                    why = f"the viewer does not start: {(told or 'it gave no reason').splitlines()[-1]}"
                    raise ViewerError(why if "--serve-web" in arguments else NO_DRIVER)
                yield viewer
        finally:
            if viewer.poll() is None:
                viewer.kill()


def in_notebook() -> bool:
    """Tells whether this process answers a notebook: IPython runs in it with a kernel."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return getattr(shell, "kernel", None) is not None


def viewer_widget(recording: Path, width_px: int, height_px: int) -> Any:
    """Returns a notebook widget that shows a recording; a ViewerError says that rerun's notebook viewer is missing."""
    import rerun as rr
    from rerun import notebook

    if not notebook.HAS_NOTEBOOK:
        needed = "needs rerun's viewer; pip install 'wayproof[notebook]'"
        raise ViewerError(f"to show recordings in a notebook {needed}")
    stream = rr.RecordingStream("wayproof-notebook")
    viewer = notebook.Viewer(width=width_px, height=height_px, recording=stream)
    stream.log_file_from_path(recording)
    return viewer


def free_port() -> int:
    """Returns a port of this machine that nobody listens on."""
    with socket.socket() as probe:
        probe.bind((LOCALHOST, 0))
        return int(probe.getsockname()[1])


def answers(port: int, viewer: subprocess.Popen[str]) -> bool:
    """Tells whether a viewer comes to listen on a port before it ends, or `START_TIMEOUT_S` are over."""
    until = time.monotonic() + START_TIMEOUT_S
    while time.monotonic() < until and viewer.poll() is None:
        with contextlib.suppress(OSError), socket.create_connection((LOCALHOST, port), timeout=1.0):
            return True
        time.sleep(0.05)
    return False
