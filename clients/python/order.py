#!/usr/bin/env python3
"""A customer: it looks for a service, has it quoted, orders, and follows the delivery until it ends.

order.py REGISTRY NETWORK FROM TO [KG]        as in: order.py http://127.0.0.1:8180 sydney 1 450 0.8

The token, where the registry wants one, is read from the file that SKYWAY_TOKEN_FILE names.
"""

import json
import os
import pathlib
import sys
import urllib.error
import urllib.request
import uuid

FINAL = {"delivered", "diverted", "returned", "failed", "cancelled"}


class Registry:
    """A registry over REST."""

    def __init__(self, url):
        self.url = url.rstrip("/")
        file = os.environ.get("SKYWAY_TOKEN_FILE")
        self.token = pathlib.Path(file).read_text(encoding="utf-8").strip() if file else None

    def open(self, path, body=None, **headers):
        """The answer to a request, as a stream."""
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.url + path, data=data, headers={"content-type": "application/json", **headers})
        if self.token:
            request.add_header("authorization", f"Bearer {self.token}")
        return urllib.request.urlopen(request, timeout=60)

    def post(self, path, body, **headers):
        """The answer to a body, both JSON."""
        with self.open(path, body, **headers) as answer:
            return json.load(answer)

    def events(self, path):
        """What a stream of events tells."""
        with self.open(path, accept="text/event-stream") as stream:
            for line in stream:
                if line.startswith(b"data:"):
                    yield json.loads(line.removeprefix(b"data:"))


def main(url, network, source, destination, payload_kg="0"):
    """Orders one delivery and follows it."""
    registry = Registry(url)
    asked = {"source": source, "destination": destination, "payload_kg": float(payload_kg)}
    found = registry.post("/v1/services:search", {"network": network, **asked})
    if not found["offers"]:
        return "\n".join(["no service fits"] + [f"{one['service_id']}: {one['text']}" for one in found["passed_over"]])
    best = found["offers"][0]
    quote = registry.post("/v1/quotes", {"service_id": best["service_id"], **asked})
    print(f"{best['name']}: {quote['price']['amount']} {quote['price']['currency']}, arrives at {quote['arrives_at']}", flush=True)
    # The same key again is the same order.
    order = registry.post("/v1/deliveries", {"quote_id": quote["id"]}, **{"idempotency-key": str(uuid.uuid4())})
    print(f"ordered {order['id']}", flush=True)
    for told in registry.events(f"/v1/deliveries/{order['id']}/track"):
        place = told.get("place")
        print(told["status"], f"at {place['lon']:.5f},{place['lat']:.5f}" if place else "", flush=True)
        if told["status"] in FINAL:
            return 0 if told["status"] == "delivered" else 1
    return "the line broke; ask for the delivery again"


if __name__ == "__main__":
    try:
        sys.exit(main(*sys.argv[1:]))
    except urllib.error.HTTPError as refused:
        sys.exit(json.load(refused).get("detail", str(refused)))
