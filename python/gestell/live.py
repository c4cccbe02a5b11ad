"""Serves a page on this computer that shows a machine while its input is changed: `gestell live machine.nml`."""
from __future__ import annotations

import json
import sys
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from . import Error, version
from ._live_solver import Solver

PORT = 8117
_LONGEST_REQUEST = 8_000_000
_MOST_CHANGES = 1000
_HERE = Path(__file__).parent
# The page runs its own scripts only, asks this server only, and stands in no page of others.
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; style-src 'self' 'unsafe-inline'; script-src 'self' 'unsafe-inline'; "
                               "connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff", "X-Frame-Options": "DENY", "Referrer-Policy": "no-referrer", "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin"}
_OWN_POLICY = '<meta http-equiv="Content-Security-Policy"'


class Handler(BaseHTTPRequestHandler):
    """Answers one browser."""

    server: "Server"
    protocol_version = "HTTP/1.1"
    server_version = "gestell/" + version()
    sys_version = ""
    timeout = 60

    def do_GET(self) -> None:
        if not self._is_local():
            return
        path = self.path.partition("?")[0]
        if path == "/":
            self._send(200, "text/html", self.server.page())
        elif path == "/live.js":
            self._send(200, "text/javascript", (_HERE / "live.js").read_text(encoding="utf-8"))
        elif path == "/live.css":
            self._send(200, "text/css", (_HERE / "live.css").read_text(encoding="utf-8"))
        else:
            self._send(404, "text/plain", "there is no such page\n")

    def do_POST(self) -> None:
        if not self._is_local():
            return
        try:
            length = int(self.headers.get("Content-Length", ""))
        except ValueError:
            length = -1
        if not 0 <= length <= _LONGEST_REQUEST:
            self._refuse(411 if length < 0 else 413, f"a request has at most {_LONGEST_REQUEST} bytes\n")
            return
        body = self.rfile.read(length)
        # Pages of other sites cannot send this type without asking this server, which does not answer.
        if self.path != "/solve" or self.headers.get_content_type() != "application/json":
            self._send(404, "text/plain", "there is no such page\n")
            return
        try:
            answer = self.server.solver.answer(*_checked(json.loads(body)))
        except (KeyError, TypeError, ValueError, RecursionError):
            self._send(400, "text/plain", "the request is not understood\n")
            return
        self._send(200, "application/json", answer)

    def _is_local(self) -> bool:
        """Whether a page of this server asks. Otherwise refuses."""
        names = [f"{name}:{self.server.server_port}" for name in ("127.0.0.1", "localhost")]
        origin = self.headers.get("Origin")
        if self.headers.get("Host") in names and origin in (None, *("http://" + name for name in names)):
            return True
        self._refuse(403, "this page is for this computer only\n")
        return False

    def _refuse(self, code: int, words: str) -> None:
        """Answers without having read what the client may have sent."""
        self.close_connection = True
        self._send(code, "text/plain", words)

    def _send(self, code: int, kind: str, words: str) -> None:
        body = words.encode("utf-8", "replace")
        try:
            self.send_response(code)
            for name, value in {**HEADERS, "Content-Type": kind + "; charset=utf-8", "Content-Length": str(len(body))}.items():
                self.send_header(name, value)
            if self.close_connection:
                self.send_header("Connection", "close")
            self.end_headers()
            self.wfile.write(body)
        except OSError:
            # the browser has gone
            self.close_connection = True

    def log_message(self, *_) -> None:
        pass


class Server(ThreadingHTTPServer):
    """Serves the live page of one input file to the browsers of this computer."""

    handler = Handler
    daemon_threads = True
    # A browser that reloads quickly opens many connections at once.
    request_queue_size = 128

    def __init__(self, file: str | Path, port: int = PORT):
        """Reads the file. Fails with gestell.Error if the machine cannot be solved, with OSError if the port is in use."""
        self.file = Path(file)
        try:
            if self.file.exists() and not self.file.is_file():
                raise Error(f"{self.file}: is not a file", 2)
            text = self.file.read_bytes().decode("utf-8")
        except UnicodeDecodeError:
            raise Error(f"{self.file}: is not UTF-8; save the input file as UTF-8 text", 2) from None
        except OSError as error:
            raise Error(f"{self.file}: cannot be read: {error.strerror}", 2) from None
        self.solver = Solver(self.file)
        try:
            self.start = json.loads(self.solver.answer("", 0, text, []))
            if "error" in self.start:
                raise Error(self.start["error"], 2)
        except BaseException:
            self.solver.stop()
            raise
        super().__init__(("127.0.0.1", port), self.handler)

    def handle_error(self, request, client_address) -> None:
        """Says nothing of browsers that go away."""
        if not isinstance(sys.exc_info()[1], (ConnectionError, TimeoutError)):
            super().handle_error(request, client_address)

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server_port}/"

    def page(self) -> str:
        """The page with the machine of the file, its fields and the script that makes it live."""
        before, policy, after = self.start["page"].partition(_OWN_POLICY)
        after = after.partition(">")[2] if policy else after
        state = json.dumps({**self.start, "page": None, "name": self.file.name}).replace("<", "\\u003c")
        body = ('<link rel="icon" href="data:,">\n'
                f'<link rel="stylesheet" href="/live.css">\n<script type="application/json" id="live-state">{state}</script>\n'
                '<script src="/live.js"></script>\n</body>')
        return (before + after).replace("</body>", body)

    def server_close(self) -> None:
        super().server_close()
        self.solver.stop()


def _checked(request: dict) -> tuple:
    """Client, number, text and changes of a request. Fails if something else was sent."""
    client, number, text, changes = request["client"], request["number"], request["text"], request["changes"]
    if not (isinstance(client, str) and len(client) <= 64 and isinstance(number, int) and isinstance(text, str)):
        raise ValueError
    if not (isinstance(changes, list) and len(changes) <= _MOST_CHANGES):
        raise ValueError
    for pair in changes:
        if not (isinstance(pair, list) and len(pair) == 2 and all(isinstance(word, str) for word in pair)):
            raise ValueError
    return client, number, text, changes
