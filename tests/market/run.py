#!/usr/bin/env python3
"""Deliveries from the order to the webhook, over child processes that are killed: run.py BINARY [--postgres URL] [STORY ...]"""

import argparse
import pathlib
import random
import subprocess
import sys
import tempfile
import threading
import time

from town import FINAL, HOOK, ROOT, Town, until

# Of the faults and of the endpoint.
SEED = 20_261_127
HOMES = [1, 11, 22]
ROUTES = [(1, 11), (11, 22), (22, 1), (11, 1), (1, 22), (22, 11)]
# Between two faults, in seconds.
QUIET_S = (3.0, 12.0)


def a_parcel_is_published_searched_quoted_ordered_and_delivered(binary, folder, store):
    """The story of the documentation, by the command line and by the example of a customer."""
    town = Town(binary, folder, SEED, store)
    town.enroll(HOMES)
    search = {"network": "sydney", "source": 1, "destination": 11, "payload_kg": 0.5}
    offers = town.registry.ask("POST", "/v1/services:search", search)["offers"]
    assert [offer["service_id"] for offer in offers] == ["acme:parcels"], offers
    asked = {"service_id": "acme:parcels", "source": 1, "destination": 11, "payload_kg": 0.5}
    # The registry hears of its edge some seconds after the edge is ready.
    quote = until(lambda: town.registry.ask("POST", "/v1/quotes", asked), "a quote")
    assert quote["price"]["currency"] == "AUD", quote
    first = town.order(1, 11, "first")
    lines = town.run("delivery", "track", first).splitlines()
    assert lines[-1].startswith("delivered"), lines
    # A quote is for now: while the drone before flies home over the same segments there may be none.
    until(lambda: town.registry.ask("GET", "/v1/drones/acme:1")["state"] == "available", "the drone is home")
    example = [sys.executable, "-B", ROOT / "clients/python/order.py", town.registry.url, "sydney", "11", "22", "0.5"]
    said = subprocess.run(example, capture_output=True, text=True, timeout=600)
    assert said.returncode == 0 and "delivered" in said.stdout, said
    delivery = town.ended(first)
    assert delivery["proof"] and delivery["price"]["currency"] == "AUD", delivery
    in_an_hour = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(time.time() + 3600.0))
    way = ["--network", "sydney", "--from", "1", "--to", "11", "--start", in_an_hour]
    later = town.run("delivery", "order", *way).strip()
    assert town.run("delivery", "cancel", later).startswith("cancelled"), later
    assert town.ended(later)["status"] == "cancelled", later
    told = town.check_told([delivery])
    messages = town.registry.ask("GET", f"/v1/webhooks/{HOOK}/messages")["messages"]
    again = messages[0]["id"]
    town.registry.ask("POST", f"/v1/webhooks/{HOOK}/messages/{again}/resend")
    before = town.receiver.repeated
    until(lambda: town.receiver.repeated > before, "the message that is sent again")
    town.end()
    return f"{told} events, {town.receiver.failed} calls refused, {len(lines)} lines of track"


def nothing_is_lost_though_registry_and_edge_are_killed(binary, folder, store):
    """Every delivery ends in one status, and the endpoint is told all of them in order."""
    random_ = random.Random(SEED)
    town = Town(binary, folder, SEED, store)
    town.enroll(HOMES)
    over, kills = threading.Event(), {"registry": 0, "edge": 0}

    def kill() -> None:
        while not over.wait(random_.uniform(*QUIET_S)):
            victim = random_.choice([town.registry, town.edge])
            kills[victim.kind] += 1
            victim.kill()
            over.wait(random_.uniform(0.0, 2.0))
            victim.start()

    killing = threading.Thread(target=kill, daemon=True)
    killing.start()
    ordered = [town.order(*route, f"order-{number}") for number, route in enumerate(ROUTES)]
    # The same order again is the same delivery.
    again = [town.order(*route, f"order-{number}") for number, route in enumerate(ROUTES)]
    assert again == ordered, (ordered, again)
    ended = [town.ended(delivery, 900.0) for delivery in ordered]
    over.set()
    killing.join()
    for delivery in ended:
        statuses = [change["status"] for change in delivery["history"]]
        assert statuses[0] == "created" and [status for status in statuses if status in FINAL] == statuses[-1:], delivery
    listed = town.registry.ask("GET", "/v1/deliveries?page_size=1000")["deliveries"]
    assert sorted(one["id"] for one in listed) == sorted(ordered), listed
    told = town.check_told(ended)
    town.end()
    delivered = sum(delivery["status"] == "delivered" for delivery in ended)
    return f"{delivered} of {len(ended)} delivered, {kills} killed, {told} events, {town.receiver.failed} calls refused"


STORIES = [
    a_parcel_is_published_searched_quoted_ordered_and_delivered,
    nothing_is_lost_though_registry_and_edge_are_killed,
]


def main() -> int:
    """Tells all stories, or those that are named."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("binary", type=lambda path: pathlib.Path(path).resolve())
    arguments.add_argument("--postgres", metavar="URL", help="an empty database, in place of SQLite; for one story")
    arguments.add_argument("stories", nargs="*")
    given = arguments.parse_args()
    for story in STORIES:
        if given.stories and story.__name__ not in given.stories:
            continue
        began = time.monotonic()
        with tempfile.TemporaryDirectory(prefix="skyway-market-") as folder:
            told = story(given.binary, pathlib.Path(folder), given.postgres)
        print(f"{story.__name__.replace('_', ' ')}: {told} ({time.monotonic() - began:.1f} s)", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
