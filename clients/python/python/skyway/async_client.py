"""The client for coroutines: the calls of `skyway.Client`, awaited."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping, Sequence
from types import TracebackType
from typing import Any, Self

import httpx

from . import calls
from .calls import Call
from .client import CONNECTS, TIMEOUT_S, _broken, _problem, _request, _settings
from .errors import ConnectionBroken, Problem
from .events import BUSY, SILENCE_S, Event, Stream
from .network import Network
from .results import NodeId


class AsyncClient:
    """A server, asked from coroutines. Its calls are those of `Client`, with the same answers and exceptions."""

    def __init__(self, url: str = "http://127.0.0.1:8080", token: str | None = None, *, timeout_s: float = TIMEOUT_S) -> None:
        self._timeout_s = timeout_s
        self._http = httpx.AsyncClient(**_settings(url, token, timeout_s), transport=httpx.AsyncHTTPTransport(retries=CONNECTS))

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None) -> None:
        await self.close()

    async def close(self) -> None:
        """Ends its connections."""
        await self._http.aclose()

    async def _answer(self, call: Call) -> httpx.Response:
        try:
            answer = await self._http.request(**_request(call))
        except httpx.TransportError as fault:
            raise _broken(self._http.base_url, fault) from fault
        if answer.is_error:
            raise _problem(answer)
        return answer

    async def _send(self, call: Call) -> dict[str, Any]:
        answer = await self._answer(call)
        return answer.json() if answer.content else {}

    async def report_failure(
        self,
        service: tuple[NodeId, NodeId] | Mapping[str, Any],
        destination: NodeId | None = None,
        *,
        key: str | None = None,
        **fields: Any,
    ) -> dict[str, Any]:
        """As `Client.report_failure`."""
        return await self._send(calls.report_failure(calls.failure_report(service, destination, fields), key))

    async def report_failures(self, reports: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """As `Client.report_failures`."""
        return await self._send(calls.report_failures(reports))

    async def compose(
        self, source: NodeId, destination: NodeId, *, drone_id: str, key: str | None = None, **fields: Any
    ) -> dict[str, Any]:
        """As `Client.compose`."""
        return await self._send(calls.compose(source, destination, drone_id, fields, key))

    async def plan(self, plan_id: str) -> dict[str, Any]:
        """As `Client.plan`."""
        return await self._send(calls.plan(plan_id))

    async def plans(
        self, *, drone_id: str | None = None, state: str | None = None, affected_by: str | None = None
    ) -> AsyncIterator[dict[str, Any]]:
        """As `Client.plans`."""
        page = None
        while True:
            told, page = calls.pages(await self._send(calls.plans(drone_id, state, affected_by, page)), "plans")
            for one in told:
                yield one
            if page is None:
                return

    async def cancel_plan(self, plan_id: str) -> dict[str, Any]:
        """As `Client.cancel_plan`."""
        return await self._send(calls.cancel_plan(plan_id))

    async def preview_zone(self, zone: Any) -> dict[str, Any]:
        """As `Client.preview_zone`."""
        return await self._send(calls.preview_zone(zone))

    async def post_zone(self, zone: Any, *, validate_only: bool = False, key: str | None = None) -> dict[str, Any]:
        """As `Client.post_zone`."""
        return await self._send(calls.post_zone(zone, validate_only, key))

    async def import_zones(
        self, zones: Any, *, feed: str, authorized: Sequence[str] = (), validate_only: bool = False
    ) -> dict[str, Any]:
        """As `Client.import_zones`."""
        return await self._send(calls.import_zones(zones, feed, authorized, validate_only))

    async def zones(self) -> AsyncIterator[dict[str, Any]]:
        """As `Client.zones`."""
        page = None
        while True:
            told, page = calls.pages(await self._send(calls.zones(page)), "features")
            for one in told:
                yield one
            if page is None:
                return

    async def delete_zone(self, zone_id: str, *, etag: str | None = None, reason: str | None = None) -> dict[str, Any]:
        """As `Client.delete_zone`."""
        tag = etag or (await self._answer(calls.zone(zone_id))).headers.get("etag", "*")
        return await self._send(calls.delete_zone(zone_id, tag, reason))

    async def recomposition(self, answer_id: str) -> dict[str, Any]:
        """As `Client.recomposition`."""
        return await self._send(calls.recomposition(answer_id))

    async def clock(self) -> dict[str, Any]:
        """As `Client.clock`."""
        return await self._send(calls.clock())

    async def network(self) -> Network:
        """As `Client.network`."""
        return Network.from_text((await self._answer(calls.network())).text)

    def events(self, after: str | None = None, *, give_up_after_s: float | None = None) -> AsyncIterator[Event]:
        """As `Client.events`."""
        return self._follow("/v1/events", Stream(after, give_up_after_s))

    def mailbox(self, drone_id: str, *, give_up_after_s: float | None = None) -> AsyncIterator[Event]:
        """As `Client.mailbox`."""
        return self._follow(calls.mailbox_path(drone_id), Stream(None, give_up_after_s))

    async def received(self, drone_id: str, through: str) -> dict[str, Any]:
        """As `Client.received`."""
        return await self._send(calls.received(drone_id, through))

    async def acknowledge(self, plan_id: str, version: int, **fields: Any) -> dict[str, Any]:
        """As `Client.acknowledge`."""
        return await self._send(calls.of_plan(plan_id, "ack", {"version": version, **fields}))

    async def decline(self, plan_id: str, version: int, *, reason: str, **fields: Any) -> dict[str, Any]:
        """As `Client.decline`."""
        return await self._send(calls.of_plan(plan_id, "decline", {"version": version, "reason": reason, **fields}))

    async def complete(self, plan_id: str, **fields: Any) -> dict[str, Any]:
        """As `Client.complete`."""
        return await self._send(calls.of_plan(plan_id, "complete", fields))

    async def telemetry(self, positions: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """As `Client.telemetry`."""
        return await self._send(calls.telemetry(positions))

    async def _follow(self, path: str, stream: Stream) -> AsyncIterator[Event]:
        while True:
            fault: Exception | None = None
            retry_after_s = None
            try:
                async for event in self._listen(path, stream):
                    yield event
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
            await asyncio.sleep(pause_s)

    async def _listen(self, path: str, stream: Stream) -> AsyncIterator[Event]:
        timeout = httpx.Timeout(self._timeout_s, read=SILENCE_S)
        async with self._http.stream("GET", path, headers=stream.headers(), timeout=timeout) as answer:
            if answer.is_error:
                await answer.aread()
                raise _problem(answer)
            async for piece in answer.aiter_bytes():
                for event in stream.take(piece):
                    yield event
