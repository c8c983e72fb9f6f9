"""Events of a server: what server-sent events say, and when to ask again after a cut."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from .errors import Problem

RETRY_S = 2.0
RETRY_MOST_S = 30.0
DOUBLINGS_MOST = 32
"""Of any pause, however short; a power of two beyond 1023 is no float."""
SILENCE_S = 45.0
"""The server says every 15 s that it is there; a line that has been silent for three times that is cut."""
BUSY = frozenset({429, 502, 503, 504})
"""Statuses of a server that will answer again."""


@dataclass(frozen=True)
class Event:
    """Something that happened; docs/tour.md shows some."""

    id: str
    """Give it as `after` to go on from here."""
    kind: str
    data: dict[str, Any]
    """What it is about, by its kind."""
    document: dict[str, Any] = field(repr=False)
    """All that was told: also when, and who has made it happen."""

    @property
    def at(self) -> str | None:
        """When, RFC 3339."""
        return self.document.get("at")


class Stream:
    """Where a listener is, over as many connections as it takes."""

    def __init__(self, after: str | None, give_up_after_s: float | None) -> None:
        self.last_id, self.give_up_after_s = after, give_up_after_s
        self._retry_s, self._failures = RETRY_S, 0
        self._heard_s, self._rest = time.monotonic(), b""
        self._begin()

    def _begin(self) -> None:
        """A new event, of which nothing is known."""
        self._kind, self._id, self._lines = "message", None, []

    def headers(self) -> dict[str, str]:
        """Of the next connection: what half an event said before is forgotten, and asked for again."""
        self._begin()
        self._rest = b""
        return {"accept": "text/event-stream"} | ({"last-event-id": self.last_id} if self.last_id else {})

    def heard(self) -> None:
        """The server is there."""
        self._heard_s, self._failures = time.monotonic(), 0

    def pause_s(self, retry_after_s: float | None = None) -> float | None:
        """How long to wait before the next connection; None where it is time to give up."""
        silent_s = time.monotonic() - self._heard_s
        if self.give_up_after_s is not None and silent_s >= self.give_up_after_s:
            return None
        doubled_s = min(self._retry_s * 2**self._failures, RETRY_MOST_S)
        self._failures = min(self._failures + 1, DOUBLINGS_MOST)
        return max(doubled_s, retry_after_s or 0.0)

    def take(self, piece: bytes) -> Iterator[Event]:
        """Takes a piece of the stream, and gives the events that end in it. Raises `Problem` where the server ends it for good."""
        self.heard()
        # By line feeds alone: a text may hold what else counts as the end of a line in Python.
        *lines, self._rest = (self._rest + piece).split(b"\n")
        for line in lines:
            event = self._take_line(line.removesuffix(b"\r").decode("utf-8", "replace"))
            if event is not None:
                yield event

    def _take_line(self, line: str) -> Event | None:
        if line:
            self._take_field(line)
            return None
        kind, given, text = self._kind, self._id, "\n".join(self._lines)
        self._begin()
        if given is not None:
            self.last_id = given
        if not text:
            return None
        told = json.loads(text)
        if kind == "gone":
            raise Problem(int(told.get("status", 410)), told)
        return Event(id=self.last_id or "", kind=kind, data=told.get("data", told), document=told)

    def _take_field(self, line: str) -> None:
        name, _, value = line.partition(":")
        value = value.removeprefix(" ")
        if name == "data":
            self._lines.append(value)
        elif name == "event":
            self._kind = value
        elif name == "id" and "\0" not in value:
            self._id = value
        elif name == "retry" and value.isdecimal():
            self._retry_s = int(value) / 1000
