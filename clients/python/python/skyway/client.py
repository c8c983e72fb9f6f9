"""The client of a server of Skyway for threads; `async_client` has the one for coroutines, with the same calls."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from types import TracebackType
from typing import Any, Self

import httpx

from . import calls
from .calls import Call
from .errors import ConnectionBroken, Problem
from .events import BUSY, SILENCE_S, Event, Stream
from .network import Network
from .results import NodeId

TIMEOUT_S = 30.0
CONNECTS = 3
"""How often a connection is tried; a request that has been sent is not sent again."""


def _settings(url: str, token: str | None, timeout_s: float) -> dict[str, Any]:
    headers = {"user-agent": "skyway-python"} | ({"authorization": f"Bearer {token}"} if token else {})
    return {"base_url": url.rstrip("/"), "headers": headers, "timeout": timeout_s}


def _problem(answer: httpx.Response) -> Problem:
    try:
        told = answer.json()
    except ValueError:
        told = None
    document: dict[str, object] = told if isinstance(told, dict) else {}
    if not document:
        document = {"code": f"http_{answer.status_code}", "detail": answer.text[:200] or answer.reason_phrase}
    if "retry_after_s" not in document and answer.headers.get("retry-after", "").isdecimal():
        document["retry_after_s"] = int(answer.headers["retry-after"])
    return Problem(answer.status_code, document)


def _broken(url: object, fault: httpx.TransportError) -> ConnectionBroken:
    hint = "start one with skyway.demo() or skyway edge, or give its address"
    return ConnectionBroken(f"no answer: {fault or type(fault).__name__}", "no_answer", str(url), hint)


def _request(call: Call) -> dict[str, Any]:
    return {"method": call.method, "url": call.path, "params": call.query, "headers": call.headers, "content": call.content}


class Client:
    """A server, asked from threads. Use it in a `with`, or close it.

    Each call raises `Problem` where the server refuses, with its code, the place in the body and a hint, and `ConnectionBroken` where
    there is no answer. Answers are the documents of the API (docs/openapi.json).
    """

    def __init__(self, url: str = "http://127.0.0.1:8080", token: str | None = None, *, timeout_s: float = TIMEOUT_S) -> None:
        self._timeout_s = timeout_s
        self._http = httpx.Client(**_settings(url, token, timeout_s), transport=httpx.HTTPTransport(retries=CONNECTS))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Ends its connections."""
        self._http.close()

    def _answer(self, call: Call) -> httpx.Response:
        try:
            answer = self._http.request(**_request(call))
        except httpx.TransportError as fault:
            raise _broken(self._http.base_url, fault) from fault
        if answer.is_error:
            raise _problem(answer)
        return answer

    def _send(self, call: Call) -> dict[str, Any]:
        answer = self._answer(call)
        return answer.json() if answer.content else {}

    def report_failure(
        self,
        service: tuple[NodeId, NodeId] | Mapping[str, Any],
        destination: NodeId | None = None,
        *,
        key: str | None = None,
        **fields: Any,
    ) -> dict[str, Any]:
        """Reports a failed leg, and gives the answer. `fields` are those of the API; `failure` is its `type`.

        With `dry_run=True` nothing is published and no plan changes. Sent again with the same `key`, it is answered once.
        """
        return self._send(calls.report_failure(calls.failure_report(service, destination, fields), key))

    def report_failures(self, reports: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """Reports many failures, each as the API has it; one that cannot be read does not spoil the others."""
        return self._send(calls.report_failures(reports))

    def compose(
        self, source: NodeId, destination: NodeId, *, drone_id: str, key: str | None = None, **fields: Any
    ) -> dict[str, Any]:
        """Composes a plan, and gives it. `fields` are those of the API, such as battery_fraction and payload_kg."""
        return self._send(calls.compose(source, destination, drone_id, fields, key))

    def plan(self, plan_id: str) -> dict[str, Any]:
        """A plan with its versions."""
        return self._send(calls.plan(plan_id))

    def plans(
        self, *, drone_id: str | None = None, state: str | None = None, affected_by: str | None = None
    ) -> Iterator[dict[str, Any]]:
        """All plans, page by page."""
        page = None
        while True:
            told, page = calls.pages(self._send(calls.plans(drone_id, state, affected_by, page)), "plans")
            yield from told
            if page is None:
                return

    def cancel_plan(self, plan_id: str) -> dict[str, Any]:
        """Ends a plan."""
        return self._send(calls.cancel_plan(plan_id))

    def preview_zone(self, zone: Any) -> dict[str, Any]:
        """What a zone would do to plans, without any effect. `zone` is a GeoJSON feature or a GeoDataFrame of one row."""
        return self._send(calls.preview_zone(zone))

    def post_zone(self, zone: Any, *, validate_only: bool = False, key: str | None = None) -> dict[str, Any]:
        """Posts a zone, which is in force when the answer comes; that says what each plan it meets is to fly instead."""
        return self._send(calls.post_zone(zone, validate_only, key))

    def import_zones(
        self, zones: Any, *, feed: str, authorized: Sequence[str] = (), validate_only: bool = False
    ) -> dict[str, Any]:
        """Imports the zones of a feed as one batch: a GeoDataFrame, a feature collection, or text of ED-269, ED-318 and others.

        What the feed had before and has no more is removed. `authorized` names the kinds (`req_authorization`, `conditional`) and the
        identifiers that the drones of the network are authorized for (docs/formats.md).
        """
        return self._send(calls.import_zones(zones, feed, authorized, validate_only))

    def zones(self) -> Iterator[dict[str, Any]]:
        """All zones as GeoJSON features, page by page."""
        page = None
        while True:
            told, page = calls.pages(self._send(calls.zones(page)), "features")
            yield from told
            if page is None:
                return

    def delete_zone(self, zone_id: str, *, etag: str | None = None, reason: str | None = None) -> dict[str, Any]:
        """Deletes a zone: the version with the entity tag, or the one that there is now."""
        tag = etag or self._answer(calls.zone(zone_id)).headers.get("etag", "*")
        return self._send(calls.delete_zone(zone_id, tag, reason))

    def recomposition(self, answer_id: str) -> dict[str, Any]:
        """An answer given before, with its report."""
        return self._send(calls.recomposition(answer_id))

    def clock(self) -> dict[str, Any]:
        """The time that the server goes by, and how fast it passes."""
        return self._send(calls.clock())

    def network(self) -> Network:
        """The network that the server serves, for the engine in this process."""
        return Network.from_text(self._answer(calls.network()).text)

    def events(self, after: str | None = None, *, give_up_after_s: float | None = None) -> Iterator[Event]:
        """What happens from now on, or after the event of an id, without end.

        After a cut it connects again and goes on after the last event: none is missed. It gives up with `ConnectionBroken` when the
        server was not heard for `give_up_after_s` seconds; without that, never. Raises `Problem` with the code `events_gone` where the
        server no longer has what comes next: read the lists again, then listen anew.
        """
        return self._follow("/v1/events", Stream(after, give_up_after_s))

    def mailbox(self, drone_id: str, *, give_up_after_s: float | None = None) -> Iterator[Event]:
        """What an edge has to tell a drone, from what it has not received yet on, without end (docs/line.md).

        The kind of an event is that of the message, and `data` is the message. After a cut it goes on as `events` does. What is not
        acknowledged, declined or `received` is told again to the next listener.
        """
        return self._follow(calls.mailbox_path(drone_id), Stream(None, give_up_after_s))

    def received(self, drone_id: str, through: str) -> dict[str, Any]:
        """Says that a drone has taken in its messages up to the one of this id."""
        return self._send(calls.received(drone_id, through))

    def acknowledge(self, plan_id: str, version: int, **fields: Any) -> dict[str, Any]:
        """Says that the drone flies this version of its plan; `fields` are those of the API, such as its `location`."""
        return self._send(calls.of_plan(plan_id, "ack", {"version": version, **fields}))

    def decline(self, plan_id: str, version: int, *, reason: str, **fields: Any) -> dict[str, Any]:
        """Says that the drone cannot fly this version: passed, energy, airspace or other. It may be given another one."""
        return self._send(calls.of_plan(plan_id, "decline", {"version": version, "reason": reason, **fields}))

    def complete(self, plan_id: str, **fields: Any) -> dict[str, Any]:
        """Says that the drone has landed; the plan is over."""
        return self._send(calls.of_plan(plan_id, "complete", fields))

    def telemetry(self, positions: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """Says where drones are, each as the API has it, and gives what became of each; one that is refused does not spoil the others."""
        return self._send(calls.telemetry(positions))

    def _follow(self, path: str, stream: Stream) -> Iterator[Event]:
        while True:
            fault: Exception | None = None
            retry_after_s = None
            try:
                yield from self._listen(path, stream)
            except httpx.TransportError as broken:
                fault = broken
            except Problem as problem:
                if problem.status not in BUSY:
                    raise
                fault, retry_after_s = problem, problem.retry_after_s
            pause_s = stream.pause_s(retry_after_s)
            if pause_s is None:
                message = f"no events: {fault or 'the server ended the stream'}"
                raise ConnectionBroken(
                    message, "no_answer", str(self._http.base_url), "see whether the server is there"
                ) from fault
            time.sleep(pause_s)

    def _listen(self, path: str, stream: Stream) -> Iterator[Event]:
        timeout = httpx.Timeout(self._timeout_s, read=SILENCE_S)
        with self._http.stream("GET", path, headers=stream.headers(), timeout=timeout) as answer:
            if answer.is_error:
                answer.read()
                raise _problem(answer)
            for piece in answer.iter_bytes():
                yield from stream.take(piece)
