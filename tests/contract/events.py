"""The one answer without an end, which schemathesis does not read: server-sent events, and the same over gRPC."""

import json

import grpc
import requests

from checks import Checks
from dialects import Grpc, Rest, as_dict, refusal

READ_S = 30.0
ZONE_ID = "events-zone"
ZONE = {
    "type": "Feature",
    "id": ZONE_ID,
    "geometry": {"type": "Point", "coordinates": [151.2108551, -33.862204]},
    "properties": {"radius_m": 40.0},
}
UNKNOWN_EPOCH = "1-1"


class Stream:
    """An event stream as the standard of HTML reads it."""

    def __init__(self, url: str, last_seen: str | None = None) -> None:
        headers = {"accept": "text/event-stream"}
        if last_seen is not None:
            headers["last-event-id"] = last_seen
        self.response = requests.get(f"{url}/v1/events", headers=headers, stream=True, timeout=READ_S)
        self._lines = self.response.iter_lines(chunk_size=1, decode_unicode=True)

    def next_event(self) -> dict:
        """The fields of the next event; comments and what has no data are passed over."""
        fields: dict = {}
        for line in self._lines:
            if line == "" and "data" in fields:
                return fields
            name, _, value = line.partition(":")
            if name:
                fields[name] = value.removeprefix(" ")
        return fields

    def close(self) -> None:
        """Ends the connection."""
        self.response.close()


def run(url: str, address: str) -> Checks:
    """Watches a zone come and go, comes back in between, and too late."""
    checks = Checks("events")
    rest, client = Rest(url), Grpc(address)
    try:
        first = come_and_go(checks, url, rest)
        come_back(checks, url, client, first)
        too_late(checks, rest, client)
    finally:
        client.close()
    return checks


def come_and_go(checks: Checks, url: str, rest: Rest) -> str:
    stream = Stream(url)
    try:
        media_type = stream.response.headers.get("content-type", "")
        checks.expect(media_type.startswith("text/event-stream"), f"the media type is {media_type}")
        written = rest.call("POST", "/v1/zones", ZONE)
        checks.equal(written.code, None, f"a zone is written: {written.told()}")
        put = stream.next_event()
        checks.equal(put.get("event"), "zone_put", f"the first event: {put}")
        checks.equal(json.loads(put["data"])["id"], put["id"], "its id is that of its data")
        lifted = rest.call("DELETE", f"/v1/zones/{ZONE_ID}", headers={"if-match": written.body["etag"]})
        checks.equal(lifted.code, None, f"the zone is lifted: {lifted.told()}")
        checks.equal(stream.next_event().get("event"), "zone_deleted", "the second event")
        return put["id"]
    finally:
        stream.close()


def come_back(checks: Checks, url: str, client: Grpc, first: str) -> None:
    stream = Stream(url, last_seen=first)
    try:
        again = stream.next_event()
    finally:
        stream.close()
    checks.equal(again.get("event"), "zone_deleted", "a subscriber that saw the first goes on with the second")
    watch = client.watch("skyway.v1.Airspace", "WatchEvents", {"after": first})
    told = as_dict(next(watch))
    watch.cancel()
    checks.equal(told["kind"], "EVENT_KIND_ZONE_DELETED", "so does gRPC")
    checks.equal(told["id"], again["id"], "with the same event")
    checks.equal(json.loads(told["data"]), json.loads(again["data"])["data"], "of the same content")


def too_late(checks: Checks, rest: Rest, client: Grpc) -> None:
    gone = rest.call("GET", "/v1/events", headers={"last-event-id": UNKNOWN_EPOCH})
    checks.equal((gone.code, gone.status), ("events_gone", "410"), f"events of another epoch: {gone.told()}")
    watch = client.watch("skyway.v1.Airspace", "WatchEvents", {"after": UNKNOWN_EPOCH})
    try:
        event = as_dict(next(watch))
        checks.expect(False, f"events of another epoch over gRPC are told: {event}")
    except grpc.RpcError as error:
        told = refusal(error)
        checks.equal((told.code, told.status), ("events_gone", "OUT_OF_RANGE"), f"over gRPC: {told.told()}")
