#!/usr/bin/env python3
"""Deliveries over child processes that are killed at each step of the flow: paper.py BINARY [--seeds N] [--first-seed S]

A registry, on a PostgreSQL cluster of its own where there is one; an edge; a provider with 20 drones as clients of sessions; a
customer whose endpoint fails half of the time. The clocks of both daemons run faster than the machine's. A seed says what is
ordered and who is killed where; the same seed again plans the same kills, and threads of the machine decide the rest.
"""

import argparse
import concurrent.futures
import contextlib
import dataclasses
import json
import multiprocessing
import pathlib
import random
import shutil
import sys
import tempfile
import threading
import time
import traceback

from cluster import Cluster, programs
from fast import NETWORK, FastDaemon, FastTime, grid
from fleet import Fleet
from paper_judge import Evidence, judge, self_test
from steps import CELLS, Kills, coverage
from town import FINAL, Receiver, until

DRONES = 20
ORDERS = (5, 8)
# Who calls without a token is this customer, and so are its quotes.
CUSTOMER = "local"
WEBHOOK = f"/v1/webhooks/{CUSTOMER}:main"
# How many of them are called off right after they were ordered, while their drones are on the ground.
CALLED_OFF = 0.12
ZONES_MAX = 6
ZONE_RADIUS_M = 25
# How long the operator waits for a drone that takes another version, before the next zone.
ZONE_WITHIN_S = 1.5
# How long the endpoint leaves its answer open where who asks is to be killed.
ANSWERS_AFTER_S = 0.03
# From this many seeds on a step at which nobody was killed is a failure.
COVERED_FROM = len(CELLS)


class TellingReceiver(Receiver):
    """The endpoint, at which it is known that a webhook is being told."""

    def __init__(self, seed: int, kills: Kills, fast_time: FastTime) -> None:
        super().__init__(seed, fast_time.seconds)
        self._kills = kills

    def take(self, headers, body: bytes) -> int:
        """The status that a call is answered with."""
        is_killed = self._kills.reached("told")
        status = super().take(headers, body)
        if is_killed:
            # It has taken the message, and who told it may not hear so any more.
            time.sleep(ANSWERS_AFTER_S)
        return status


class Paper:
    """One seed of it, from the first start to the last answer."""

    def __init__(self, binary: pathlib.Path, folder: pathlib.Path, store: str, seed: int) -> None:
        self.chance = random.Random(seed)
        self.kills = Kills(seed, self.chance)
        self.time, self.seed = FastTime(), seed
        self.receiver = TellingReceiver(seed, self.kills, self.time)
        network, self.homes, self.places = grid()
        self.registry = FastDaemon(
            binary, folder, "registry", self.time, f"--store={store}", "--set=deliveries.webhooks_anywhere=true").start()
        self.ask("PUT", f"/v1/networks/{NETWORK}", network, content_type="application/geo+json")
        self.edge = FastDaemon(
            binary, folder, "edge", self.time, f"--store={folder / 'edge.db'}", f"--registry-url={self.registry.url}",
            "--set=registry.edge_id=edge-1", f"--set=registry.network={NETWORK}", "--set=registry.poll_wait=1s",
            "--set=registry.retry_within=500ms", "--set=flight.stop=10s", "--set=drones.silent_after=2min")
        self.edge._base.append(f"--set=registry.advertise={self.edge.url}")
        self.edge.start()
        until(lambda: self.edge.ask("GET", "/readyz", raw=True), "the edge is ready")
        self.kills.of(registry=self.registry, edge=self.edge)
        drones = [f"acme:{number}" for number in range(1, DRONES + 1)]
        self.fleet = Fleet(f"127.0.0.1:{self.edge.port}", drones, seed, self.kills)
        self.acknowledged: dict[str, list[str]] = {}
        self.bodies: list[tuple[str, dict]] = []
        self.called_off: list[str] = []

    def ask(self, *asked, **more):
        """Asks the registry until it answers: an answer that was lost is asked for again."""
        return until(lambda: self.registry.ask(*asked, **more), f"{asked[:2]}")

    def put(self, path: str, body: dict) -> dict:
        """Puts what is new; where the answer to that was lost, it is there already."""
        try:
            return self.ask("PUT", path, body)
        except AssertionError as refused:
            if "precondition_required" not in str(refused):
                raise
            return self.ask("GET", path)

    def publish(self) -> None:
        """The provider with its drones and its service, the customer with its webhook."""
        service = {"name": "Parcels", "network": NETWORK, "payload_max_kg": 2.0, "time_zone": "Australia/Sydney",
                   "tariff": {"currency": "AUD", "base": "4.00", "per_km": "1.20"}}
        drones = {f"/v1/drones/acme:{number}": {"network": NETWORK, "home": home, "payload_max_kg": 2.0}
                  for number, home in enumerate(self.homes[:DRONES], 1)}
        put = {"/v1/providers/acme": {"name": "Acme"}, **drones, "/v1/services/acme:parcels": service,
               f"/v1/customers/{CUSTOMER}": {"name": "Shop"}, WEBHOOK: {"url": self.receiver.url}}
        for path, body in put.items():
            self.kills.reached("published")
            answer = self.put(path, body)
        # Where the answer that had it was lost, there is another.
        self.receiver.secret = answer.get("secret") or self.ask("POST", f"{WEBHOOK}/rotate", {})["secret"]

    def order(self, number: int) -> None:
        """Searches, asks for a price and orders; or orders without a quote. Now and then again, as if the answer was lost."""
        source, destination = self.chance.sample(self.places, 2)
        flight = {"source": source, "destination": destination, "payload_kg": 0.5}
        self.kills.reached("searched")
        offers = self.ask("POST", "/v1/services:search", {"network": NETWORK, **flight})["offers"]
        assert [offer["service_id"] for offer in offers] == ["acme:parcels"], offers
        self.kills.reached("quoted")
        is_quoted = self.chance.random() < 0.6
        quote = self.ask("POST", "/v1/quotes", {"service_id": "acme:parcels", **flight})
        key = f"{self.seed}-order-{number}"
        body = {"quote_id": quote["id"]} if is_quoted else {"network": NETWORK, **flight}
        body["reference"] = key
        self.kills.reached("ordered")
        for _ in range(1 + (self.chance.random() < 0.5)):
            ordered = self.ask("POST", "/v1/deliveries", body, idempotency_key=key)
            self.acknowledged.setdefault(key, []).append(ordered["id"])
        self.bodies.append((key, body))
        if self.chance.random() < CALLED_OFF:
            self.call_off(ordered["id"])

    def call_off(self, delivery: str) -> None:
        """Calls one off, unless its drone has departed."""
        def answered() -> str:
            try:
                return self.registry.ask("POST", f"/v1/deliveries/{delivery}/cancel", {})["status"]
            except OSError as refused:
                if "delivery_state_conflict" in str(refused):
                    return "departed"
                raise
        if until(answered, f"the end of {delivery}") == "cancelled":
            self.called_off.append(delivery)

    def operate(self) -> None:
        """The operator, beside everybody else."""
        try:
            self.put_zones(random.Random(f"zones of {self.seed}"))
        except Exception as error:
            self.kills.faults.append(f"the operator: {error}")

    def put_zones(self, chance: random.Random) -> None:
        """Zones over ways of drones in flight, until one of them has taken another version."""
        for number in range(ZONES_MAX):
            ahead = until(lambda: self.is_over() or self.fleet.ahead(), "a drone in flight")
            if ahead is True:
                return
            lon, lat = chance.choice(ahead)
            zone = {"type": "Feature", "geometry": {"type": "Point", "coordinates": [lon, lat]},
                    "properties": {"radius_m": ZONE_RADIUS_M, "reason": "crane"}}
            key = f"{self.seed}-zone-{number}"
            self.ask("POST", f"/v1/networks/{NETWORK}/zones", zone, content_type="application/geo+json", idempotency_key=key)
            before = self.fleet.total("taken")
            with contextlib.suppress(AssertionError):
                until(lambda: self.fleet.total("taken") > before, "a version that is taken", ZONE_WITHIN_S)
                return

    def is_over(self) -> bool:
        """Whether all that was ordered has ended, as far as the endpoint was told."""
        told = list(self.receiver.taken.values())
        return len(told) == len(self.acknowledged) and all(events[-1].removeprefix("delivery.") in FINAL for events in told)

    def listing(self, what: str) -> list[dict]:
        """All of it, page by page."""
        found, token = [], ""
        while True:
            page = self.ask("GET", f"/v1/{what}?page_size=5{token}")
            found += page[what]
            if not page.get("next_page_token"):
                return found
            token = f"&page_token={page['next_page_token']}"

    def evidence(self) -> Evidence:
        """What it has come to."""
        faults = [*self.receiver.faults, *self.kills.faults, *self.fleet.faults()]
        flown = [plan for drone in self.fleet.drones for plan in drone.flown]
        visited = {plan: nodes for drone in self.fleet.drones for plan, nodes in drone.visited.items()}
        return Evidence(self.acknowledged, self.listing("deliveries"), self.listing("drones"), self.receiver.taken, flown, visited,
                        faults, self.called_off)

    def is_home(self) -> bool:
        """Whether no drone is under way any more; one that has landed elsewhere is out of service."""
        return all(drone["state"] in ("available", "out_of_service") for drone in self.listing("drones"))

    def tell(self) -> Evidence:
        """The whole story."""
        self.publish()
        operator = threading.Thread(target=self.operate, daemon=True)
        for number in range(self.chance.randint(*ORDERS)):
            self.order(number)
            if number == 0:
                operator.start()
        with contextlib.suppress(AssertionError):
            # What does not end is for the judge to say.
            until(self.is_over, "the end of all", 120.0)
            until(self.is_home, "all drones are home", 60.0)
        operator.join()
        self.kills.finish()
        # The same order again is the same delivery, also when that is over.
        for key, body in self.bodies:
            self.acknowledged[key].append(self.ask("POST", "/v1/deliveries", body, idempotency_key=key)["id"])
        return self.evidence()

    def close(self) -> None:
        """Ends everything."""
        self.kills.finish()
        self.fleet.close()
        for daemon in (self.edge, self.registry):
            daemon.kill()
        self.receiver.close()


def run_seed(binary: pathlib.Path, seed: int, cluster: Cluster | None, kept: pathlib.Path) -> dict:
    """Tells the story of a seed, in a process of its own: what it came to, and its faults. Logs of one with faults are kept."""
    folder = pathlib.Path(tempfile.mkdtemp(prefix=f"skyway-paper-{seed}-"))
    began, paper, came = time.monotonic(), None, {"seed": seed, "faults": [], "done": [], "counts": {}}
    store = cluster.create(f"seed_{seed}") if cluster else str(folder / "registry.db")
    with (folder / "clients.log").open("w") as log, contextlib.redirect_stdout(log):
        try:
            paper = Paper(binary, folder, store, seed)
            evidence = paper.tell()
            came["faults"] = judge(evidence)
            if came["faults"]:
                (folder / "evidence.json").write_text(json.dumps(seen(paper, evidence), indent=1))
            came["counts"] = counts(paper, evidence)
        except Exception:
            came["faults"].append(traceback.format_exc())
        finally:
            if paper:
                came["planned"] = ", ".join(map(str, paper.kills.planned))
                paper.close()
                came["done"] = [(kill.step, kill.victims) for kill in paper.kills.done]
            FastDaemon.end_all()
    if cluster:
        cluster.drop(f"seed_{seed}")
    if came["faults"]:
        kept.mkdir(parents=True, exist_ok=True)
        shutil.copytree(folder, kept / f"seed-{seed}", dirs_exist_ok=True)
    shutil.rmtree(folder, ignore_errors=True)
    came["took_s"] = time.monotonic() - began
    return came


def seen(paper: Paper, evidence: Evidence) -> dict:
    """What there is to see of a seed with faults."""
    messages = paper.ask("GET", f"{WEBHOOK}/messages?page_size=1000")["messages"]
    plans = until(lambda: paper.edge.ask("GET", "/v1/plans?page_size=1000"), "the plans of the edge")
    return {**dataclasses.asdict(evidence), "messages": messages, "plans": plans}


def counts(paper: Paper, evidence: Evidence) -> dict[str, int]:
    """What there was to judge."""
    ended = [delivery["status"] for delivery in evidence.listing]
    return {
        "deliveries": len(ended), **{status: ended.count(status) for status in sorted(FINAL) if status in ended},
        "orders again": sum(len(answers) for answers in evidence.acknowledged.values()) - len(evidence.acknowledged),
        "versions taken": paper.fleet.total("taken"), "declined": paper.fleet.total("declined"),
        "sessions": sum(stream.sessions for stream in paper.fleet.streams),
        "events told": sum(map(len, paper.receiver.taken.values())), "calls refused": paper.receiver.failed,
        "repeated": paper.receiver.repeated,
    }


def told(came: dict) -> str:
    """A seed in a line."""
    figures = ", ".join(f"{count} {name}" for name, count in came["counts"].items())
    return f"seed {came['seed']}, {came['took_s']:.1f} s: killed {came.get('planned')}: {figures}"


def run(given, cluster: Cluster | None) -> list[dict]:
    """All seeds, some at a time, each in a new process: nothing of one is left to another."""
    came, kept = [], pathlib.Path(given.kept)
    seeds = range(given.first_seed, given.first_seed + given.seeds)
    fresh = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(given.jobs, mp_context=fresh, max_tasks_per_child=1) as pool:
        running = [pool.submit(run_seed, given.binary, seed, cluster, kept) for seed in seeds]
        for future in concurrent.futures.as_completed(running):
            came.append(future.result())
            print(told(came[-1]), flush=True)
            for fault in came[-1]["faults"]:
                print(f"  FAULT of seed {came[-1]['seed']}: {fault}", flush=True)
    return came


def summary(came: list[dict], store: str, took_s: float) -> bool:
    """What all seeds came to; whether that is right."""
    done = [cell for one in came for cell in map(tuple, one["done"])]
    table, never = coverage(done)
    total: dict[str, int] = {}
    for one in came:
        for name, count in one["counts"].items():
            total[name] = total.get(name, 0) + count
    bad = [one["seed"] for one in came if one["faults"]]
    print(f"\nkills at each step, of {len(done)}:\n{table}")
    print("all seeds: " + ", ".join(f"{count} {name}" for name, count in total.items()))
    is_covered = len(came) < COVERED_FROM or not never
    if not is_covered:
        print(f"nobody was ever killed there: {', '.join(never)}")
    print(f"paper, {len(came)} seeds from {min(one['seed'] for one in came)} on {store}: {len(bad)} with faults {bad or ''}, "
          f"{took_s:.0f} s, {took_s / len(came):.1f} s for each")
    return is_covered and not bad


def main() -> int:
    """Runs seeds, or looks whether the judge finds what is planted."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("binary", nargs="?", type=lambda path: pathlib.Path(path).resolve())
    arguments.add_argument("--seeds", type=int, default=3)
    arguments.add_argument("--first-seed", type=int, default=1)
    arguments.add_argument("--jobs", type=int, default=4, help="seeds at a time")
    arguments.add_argument("--sqlite", action="store_true", help="in place of PostgreSQL, also where there is one")
    arguments.add_argument("--kept", default="target/paper", help="where the logs of seeds with faults are kept")
    arguments.add_argument("--self-test", action="store_true", help="plant faults, each of which the judge has to find")
    given = arguments.parse_args()
    if given.self_test:
        print(self_test())
        return 0
    if not given.binary:
        arguments.error("name the program, or --self-test")
    began = time.monotonic()
    is_postgres = bool(programs()) and not given.sqlite
    with Cluster() if is_postgres else contextlib.nullcontext() as cluster:
        came = run(given, cluster)
    return 0 if summary(came, "PostgreSQL" if is_postgres else "SQLite", time.monotonic() - began) else 1


if __name__ == "__main__":
    sys.exit(main())
