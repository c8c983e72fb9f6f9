"""A server of one's own making: each connection is answered by the next step of a script, and what was asked is kept."""

from __future__ import annotations

import http.server
import json
import threading
from collections.abc import Callable
from typing import Any, Self


class FakeServer:
    """Serves on a free port. A step is handed the handler of a request, and writes whatever it wants."""

    def __init__(self, steps: list[Callable[[Any], None]]) -> None:
        self.asked: list[dict[str, Any]] = []
        self._steps = iter(steps)
        outer = self
        # Not a status at which a client asks again: a test that asks too much fails, and does not hang.
        beyond = say(500, {"code": "beyond_the_script", "status": 500, "detail": "the script has no more steps"})

        class Handler(http.server.BaseHTTPRequestHandler):
            def answer(self) -> None:
                body = self.rfile.read(int(self.headers.get("content-length") or 0))
                headers = {name.lower(): value for name, value in self.headers.items()}
                outer.asked.append({"method": self.command, "path": self.path, "headers": headers, "body": body})
                next(outer._steps, beyond)(self)

            do_GET = do_POST = do_DELETE = answer

            def log_message(self, *_: object) -> None:
                pass

        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self._server.server_port}"
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.01,))

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


def say(status: int, document: object, **headers: str) -> Callable[[Any], None]:
    """Answers with JSON, or with a text."""
    content = document.encode() if isinstance(document, str) else json.dumps(document).encode()

    def step(handler: Any) -> None:
        handler.send_response(status)
        for name, value in {"content-type": "application/json", "content-length": str(len(content)), **headers}.items():
            handler.send_header(name.replace("_", "-"), value)
        handler.end_headers()
        handler.wfile.write(content)

    return step


def stream(text: str) -> Callable[[Any], None]:
    """Says a piece of a stream of events, then cuts the line."""

    def step(handler: Any) -> None:
        handler.send_response(200)
        handler.send_header("content-type", "text/event-stream")
        handler.end_headers()
        handler.wfile.write(text.encode())
        handler.wfile.flush()
        handler.close_connection = True

    return step


def hang_up(handler: Any) -> None:
    """Cuts the line without a word."""
    handler.close_connection = True


def event(number: int, kind: str = "zone_put") -> str:
    """An event as an edge writes it."""
    document = {"id": f"e-{number}", "kind": kind, "at": "2026-11-25T10:00:00Z", "data": {"number": number}}
    return f"id: e-{number}\nevent: {kind}\ndata: {json.dumps(document)}\n\n"
