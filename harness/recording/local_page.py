"""The viewer's page for a browser, served so that the browser talks to this machine only.

rerun's web page posts usage statistics and asks for fonts, examples and versions. The page is passed on here with a
content security policy (W3C, CSP level 3), with which the browser itself refuses every other address.
"""

from __future__ import annotations

import contextlib
import re
import shutil
import threading
import urllib.request
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.error import HTTPError

LOCALHOST = "127.0.0.1"
POLICY = (
    "default-src 'self' 'unsafe-inline' 'unsafe-eval' 'wasm-unsafe-eval' blob: data:; "
    f"connect-src 'self' blob: data: http://{LOCALHOST}:* ws://{LOCALHOST}:*"
)
"""What the page may load: its own parts; and what it may talk to: this machine."""
PASSED_ON = ("Content-Type", "Content-Encoding", "Cache-Control")
"""Headers of rerun's server that go with its answers."""
OUTSIDE = re.compile(rb"<link\b[^>]*https?://[^>]*>|https://[^\"']*\.js\b")
"""Parts of the page that would load something from elsewhere: fonts and the script of statistics."""


@contextlib.contextmanager
def local_page(port: int, source_port: int) -> Iterator[None]:
    """Serves the page of rerun's web server with the policy, for the length of the block."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            try:
                with urllib.request.urlopen(f"http://{LOCALHOST}:{source_port}{self.path}") as answer:
                    self.send_response(answer.status)
                    for name in PASSED_ON:
                        if name in answer.headers:
                            self.send_header(name, answer.headers[name])
                    self.send_header("Content-Security-Policy", POLICY)
                    self.send_header("Connection", "close")
                    if answer.headers.get_content_type() == "text/html":
                        page = OUTSIDE.sub(b"", answer.read())
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
