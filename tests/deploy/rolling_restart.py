"""Every daemon of an installation is started again, one after the other, while drones and operators go on asking.

No request may fail, although no client sends one twice; whatever was acknowledged is everywhere in the end. Zones are declared
at the edges and at the registry, and lifted at the registry alone: an edge that stands in for another may not know them yet.
"""

import itertools
import json
import threading
import time

from installation import EDGES, REGISTRIES, REPORT, Installation
from machine import expect, until

# Drain delay and drain timeout of the file, and the end of the process.
ENDS_WITHIN_S = 20.0
PACE_S = 0.02


class Traffic:
    """Drones that report failures, and operators that declare zones and lift some of them."""

    def __init__(self, installation: Installation) -> None:
        self._installation = installation
        self._is_over = threading.Event()
        self._lock = threading.Lock()
        self.failed: list[str] = []
        self.answered = 0
        self.slowest_s = 0.0
        self.stand: set[str] = set()
        self.lifted: set[str] = set()
        self._threads = [threading.Thread(target=self._drone, args=(token,)) for token in installation.drones]
        self._threads += [
            threading.Thread(target=self._operator, args=(number, token)) for number, token in enumerate(installation.operators)
        ]

    def __enter__(self) -> "Traffic":
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_) -> None:
        self._is_over.set()
        for thread in self._threads:
            thread.join()

    def _ask(self, client, *question, **headers) -> dict | None:
        start = time.monotonic()
        try:
            status, told, _ = client.ask(*question, **headers)
            wrong = None if 200 <= status < 300 else f"{status} {json.dumps(told)[:300]}"
        except Exception as error:
            told, wrong = None, repr(error)
        took = time.monotonic() - start
        with self._lock:
            self.answered += 1
            self.slowest_s = max(self.slowest_s, took)
            if wrong:
                self.failed.append(f"{time.strftime('%H:%M:%S')} {question[0]} {question[1]}: {wrong}")
        return None if wrong else told

    def _drone(self, token: str) -> None:
        client = self._installation.edges(token)
        while not self._is_over.wait(PACE_S):
            self._ask(client, "POST", "/v1/failures", REPORT)

    def _operator(self, own: int, token: str) -> None:
        is_at_registry = own % 2 == 1
        client = self._installation.registries(token) if is_at_registry else self._installation.edges(token)
        path = "/v1/networks/sydney/zones" if is_at_registry else "/v1/zones"
        for number in itertools.count():
            if self._is_over.wait(5 * PACE_S):
                return
            name = f"zone-{own}-{number}"
            place = [151.2 + 0.0007 * own, -33.87 + 0.0003 * (number % 40)]
            zone = {
                "type": "Feature",
                "id": name,
                "geometry": {"type": "Point", "coordinates": place},
                "properties": {"radius_m": 5, "reason": "rolling restart"},
            }
            told = self._ask(client, "POST", path, zone, content_type="application/geo+json")
            if told is None:
                continue
            if not is_at_registry and not told["durable"]:
                self.failed.append(f"{name} is not durable")
            self.stand.add(name)
            if is_at_registry and number % 2 and self._ask(client, "DELETE", f"{path}/{name}", if_match=told["etag"]) is not None:
                self.stand.discard(name)
                self.lifted.add(name)


def run(installation: Installation, restarts: int) -> str:
    """Starts daemons again `restarts` times under traffic; tells what came of it."""
    slowest_end_s = 0.0
    order = itertools.islice(itertools.cycle((*EDGES, *REGISTRIES)), restarts)
    with Traffic(installation) as traffic:
        time.sleep(1)
        for service in order:
            before = traffic.answered
            took_s = installation.processes[service].end(within_s=60)
            expect(took_s < ENDS_WITHIN_S, f"{service} took {took_s:.1f} s to end")
            slowest_end_s = max(slowest_end_s, took_s)
            installation.start(service)
            installation.await_ready(service)
            expect(traffic.answered > before, f"nothing was asked while {service} was started again")
            # As long as the proxy needs to see it (`rise 1`, `inter 500ms`), and an orchestrator's minReadySeconds.
            time.sleep(1)
    expect(not traffic.failed, f"{len(traffic.failed)} of {traffic.answered} requests failed:\n" + "\n".join(traffic.failed[:10]))
    everywhere(installation, traffic.stand, traffic.lifted)
    return (
        f"{restarts} restarts: {traffic.answered} requests, none failed, none was sent twice, the slowest took {traffic.slowest_s:.2f} s; "
        f"{len(traffic.stand)} zones stand everywhere, {len(traffic.lifted)} are lifted; the slowest end took {slowest_end_s:.1f} s"
    )


def everywhere(installation: Installation, stand: set[str], lifted: set[str]) -> None:
    """Every edge and the registry have what stands, and nothing that is lifted."""
    operator = installation.token("operator_token")

    def zones(client, path: str, member: str) -> set[str]:
        return {zone["id"] for zone in client.all_of(path, member)}

    def same(client, path: str, member: str) -> bool:
        found = zones(client, path, member)
        return stand <= found and not lifted & found

    expect(bool(stand) and bool(lifted), "nothing stands, or nothing was lifted")
    for edge in EDGES:
        until(f"{edge} has all zones", lambda edge=edge: same(installation.direct(edge, operator), "/v1/zones", "features"))
    registry = installation.direct(REGISTRIES[0], operator)
    until("the registry has all zones", lambda: same(registry, "/v1/networks/sydney/zones", "objects"))
