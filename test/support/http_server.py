# SPDX-License-Identifier: Apache-2.0
"""A small web server, for tests of the page among others."""

from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread


@contextmanager
def http_server(answer: Callable[[BaseHTTPRequestHandler],
                                 tuple[int, Iterable[tuple[str, str]], bytes]],
                ) -> Generator[str]:
    """
    Serve GET and POST on a free port of this machine while the block runs; give the URL.

    answer: called with each request; returns status, headers and content.
    """
    class Handler(BaseHTTPRequestHandler):
        def respond(self) -> None:
            status, headers, content = answer(self)
            self.send_response(status)
            for name, value in headers:
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(content)
        do_GET = do_POST = respond  # noqa: N815 - the names are given

        def log_message(self, *_: object) -> None:
            """Print nothing."""
    with ThreadingHTTPServer(('127.0.0.1', 0), Handler) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        try:
            yield f'http://127.0.0.1:{server.server_port}/'
        finally:
            server.shutdown()
