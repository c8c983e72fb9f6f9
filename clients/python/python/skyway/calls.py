"""What is asked of a server, as plain values: the two clients differ only in how they send them."""

from __future__ import annotations

import json
import uuid
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import quote

from .errors import RequestError
from .geojson import collection_of, is_table
from .results import NodeId

GEOJSON = "application/geo+json"
Body = Mapping[str, Any]


@dataclass(frozen=True)
class Call:
    """One request."""

    method: str
    path: str
    query: Mapping[str, str] = field(default_factory=dict)
    headers: Mapping[str, str] = field(default_factory=dict)
    content: bytes | None = None


def _stated(fields: Mapping[str, Any]) -> dict[str, str]:
    """The parameters of a query that are not None, as text."""
    return {
        name: str(value).lower() if isinstance(value, bool) else str(value) for name, value in fields.items() if value is not None
    }


def _get(path: str, **query: Any) -> Call:
    return Call("GET", path, _stated(query))


def _send(method: str, path: str, body: Body | str | None = None, *, kind: str = "application/json", **query: Any) -> Call:
    if body is None:
        return Call(method, path, _stated(query))
    content = body.encode() if isinstance(body, str) else json.dumps(body).encode()
    return Call(method, path, _stated(query), {"content-type": kind}, content)


def _once(call: Call, key: str | None) -> Call:
    """The same with a key: sent again with it, it is done once."""
    headers = {**call.headers, "idempotency-key": key or str(uuid.uuid4())}
    return Call(call.method, call.path, call.query, headers, call.content)


def report_failure(report: Body, key: str | None) -> Call:
    return _once(_send("POST", "/v1/failures", report), key)


def report_failures(reports: Sequence[Body]) -> Call:
    return _send("POST", "/v1/failures:batch", {"failures": list(reports)})


def failure_report(service: tuple[NodeId, NodeId] | Body, destination: NodeId | None, fields: Body) -> dict[str, Any]:
    """The body of a report: the leg by its nodes, or a service as the API has it."""
    if isinstance(service, Mapping):
        leg = dict(service)
    else:
        leg = {"from": service[0], "to": service[1]}
    named = {"type" if name == "failure" else name: value for name, value in fields.items()}
    report = {"service": leg} | named
    return report if destination is None else report | {"destination": destination}


def compose(source: NodeId, destination: NodeId, drone_id: str, fields: Body, key: str | None) -> Call:
    body = {"source": source, "destination": destination, "drone_id": drone_id} | dict(fields)
    return _once(_send("POST", "/v1/plans", body), key)


def plan(plan_id: str) -> Call:
    return _get(f"/v1/plans/{quote(plan_id, safe='')}")


def plans(drone_id: str | None, state: str | None, affected_by: str | None, page: str | None) -> Call:
    return _get("/v1/plans", drone_id=drone_id, state=state, affected_by=affected_by, page_token=page)


def cancel_plan(plan_id: str) -> Call:
    return _send("DELETE", f"/v1/plans/{quote(plan_id, safe='')}")


def of_plan(plan_id: str, verb: str, fields: Body) -> Call:
    """What a drone says of its plan; once, however often it is sent."""
    return _once(_send("POST", f"/v1/plans/{quote(plan_id, safe='')}/{verb}", fields), None)


def mailbox_path(drone_id: str) -> str:
    return f"/v1/drones/{quote(drone_id, safe='')}/events"


def received(drone_id: str, through: str) -> Call:
    return _send("POST", f"/v1/drones/{quote(drone_id, safe='')}/received", {"through": through})


def telemetry(positions: Sequence[Body]) -> Call:
    return _send("POST", "/v1/telemetry", {"positions": list(positions)})


def post_zone(zone: Any, validate_only: bool, key: str | None) -> Call:
    call = _send("POST", "/v1/zones", feature_of(zone), kind=GEOJSON, validate_only=validate_only or None)
    return _once(call, key)


def preview_zone(zone: Any) -> Call:
    return _send("POST", "/v1/zones:preview", feature_of(zone), kind=GEOJSON)


def import_zones(zones: Any, feed: str, authorized: Sequence[str], validate_only: bool) -> Call:
    asked = {"feed": feed, "authorized": ",".join(authorized) or None, "validate_only": validate_only or None}
    return _send("POST", "/v1/zones:import", collection_of(zones), kind=GEOJSON, **asked)


def zone(zone_id: str) -> Call:
    return _get(f"/v1/zones/{quote(zone_id, safe='')}")


def zones(page: str | None) -> Call:
    return _get("/v1/zones", page_token=page)


def delete_zone(zone_id: str, etag: str, reason: str | None) -> Call:
    call = _send("DELETE", f"/v1/zones/{quote(zone_id, safe='')}", reason=reason)
    return Call(call.method, call.path, call.query, {"if-match": etag})


def network() -> Call:
    return _get("/v1/network")


def recomposition(answer_id: str) -> Call:
    return _get(f"/v1/recompositions/{quote(answer_id, safe='')}")


def clock() -> Call:
    return _get("/v1/clock")


def feature_of(given: Any) -> Body:
    """A GeoJSON feature: of a mapping, or the one row of a GeoDataFrame."""
    if not is_table(given):
        return given
    features = collection_of(given)["features"]
    if len(features) != 1:
        hint = "post several with import_zones(frame, feed=...), as one batch"
        raise RequestError(f"the table has {len(features)} rows, and one zone is one row", "not_one_zone", "zone", hint)
    return features[0]


def pages(told: Body, member: str) -> tuple[Iterator[Any], str | None]:
    """What a page lists, and the token of the next one."""
    return iter(told.get(member, ())), told.get("next_page_token")
