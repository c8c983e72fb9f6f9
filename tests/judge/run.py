#!/usr/bin/env python3
"""The judge from outside: random worlds, random failure reports, and every answer held against the rules.

run.py                              2,000 answers; before them the self-test
run.py --answers 100000 --seed 7    more, others
run.py --world 20261122.5 --verbose that world alone, with every faulty report and answer
run.py --self-test                  the judge finds faults that answers are bent to have
"""

import argparse
import collections
import concurrent.futures
import dataclasses
import json
import os
import pathlib
import random
import sys
import tempfile
import time

import bent
import plans
import planted
import situations
from flown import instant, widened
from replaced import judge_replaced
from reports import Report, Reporter, scale_of
from rules import judge
from talk import Edge, told
from world import NOW_S, World, make_airspace, make_network, make_squeeze, text_of

ROOT = pathlib.Path(__file__).resolve().parents[2]
BINARY = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release/skyway"
SEED = 20261122
ANSWERS = 2000
# How many airspaces a network gets, and how many reports each of them.
AIRSPACES, REPORTS = 4, 50
# How many answers there are for each network that is replaced while drones fly.
ANSWERS_PER_REPLACED = 2000
SHARE = 0.02
FLOWN_SHARE = 0.3
COVERED = (
    [f"outcome {name}" for name in ("rerouted", "unaffected", "hold", "diverted", "no_route")]
    + [f"flag {name}" for name in ("leaving_zone", "cannot_stop", "unverified", "reserve_used", "pad_occupied")]
    + [f"start {name}" for name in ("leg", "straight", "none")]
)
# Of each rule.
SHOWN = 8


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--binary", type=pathlib.Path, default=BINARY)
    arguments.add_argument("--answers", type=int, default=ANSWERS)
    arguments.add_argument("--seed", type=int, default=SEED)
    arguments.add_argument("--processes", type=int, default=2, choices=(1, 2))
    arguments.add_argument("--world", help="SEED.NUMBER of one world")
    arguments.add_argument("--verbose", action="store_true")
    arguments.add_argument("--self-test", action="store_true")
    arguments.add_argument("--planted", action="store_true", help="of a binary with the feature `planted`")
    given = arguments.parse_args()
    if given.world:
        seed, number = given.world.split(".")
        outcome = judge_network((given.binary, int(seed), int(number), None, given.verbose))
        print(outcome.told(SHOWN if not given.verbose else 10**6))
        return 1 if outcome.faults else 0
    if given.planted:
        return planted.find_all(given.binary, given.seed, judge_network)
    on_page = situations.told_right()
    failed = bent.self_test() | (on_page <= 0)
    print(f"situations of docs/safe-answers.md judged right: {max(on_page, 0)}")
    if given.self_test:
        return failed
    return failed | judge_many(given)


class Outcome:
    """What judging came to."""

    def __init__(self) -> None:
        self.answers = 0
        self.covered: collections.Counter = collections.Counter()
        self.faults: list[tuple[str, str, str]] = []
        self.checker_cases: float | None = None
        self.shown: list[str] = []
        # What the checker did not let pass.
        self.refused: list[str] = []

    def add(self, other: "Outcome") -> None:
        self.answers += other.answers
        self.covered += other.covered
        self.faults += other.faults
        self.shown += other.shown
        self.refused += other.refused
        if other.checker_cases is not None:
            self.checker_cases = (self.checker_cases or 0.0) + other.checker_cases

    def told(self, limit: int) -> str:
        lines = []
        for rule, count in collections.Counter(rule for rule, _, _ in self.faults).most_common():
            lines.append(f"  {count:6d}  {rule}")
        shown: collections.Counter = collections.Counter()
        for rule, where, text in self.faults:
            shown[rule] += 1
            if shown[rule] <= limit:
                lines.append(f"FAILED: world {where}: {rule}: {text}")
        lines += self.shown + self.refused[:limit]
        return "\n".join(lines)


def judge_many(given) -> int:
    """Worlds until there are enough answers, in one process or two."""
    began = time.monotonic()
    per_world = AIRSPACES * REPORTS
    jobs = [
        (given.binary, given.seed, number, None, False)
        for number in range((given.answers + per_world - 1) // per_world)
    ]
    total = Outcome()
    with concurrent.futures.ProcessPoolExecutor(given.processes) as pool:
        for outcome in pool.map(judge_network, jobs):
            total.add(outcome)
    for number in range(max(1, given.answers // ANSWERS_PER_REPLACED)):
        total.add(judge_new_network(given.binary, given.seed, number))
    took = time.monotonic() - began
    print(total.told(SHOWN))
    missed = []
    for name in sorted(total.covered, key=lambda name: (name.split()[0], -total.covered[name])):
        print(f"  {100 * total.covered[name] / total.answers:5.1f} %  {name}")
    for name in COVERED:
        if total.covered[name] < SHARE * total.answers:
            missed.append(f"{name} in {total.covered[name]} of {total.answers}")
    if total.covered["flown"] < FLOWN_SHARE * total.answers:
        missed.append(f"flown in {total.covered['flown']} of {total.answers}")
    for line in missed:
        print(f"FAILED: coverage: {line}")
    if total.checker_cases:
        print(f"FAILED: the checker had {total.checker_cases:.0f} cases")
    cases = "no counter" if total.checker_cases is None else f"{total.checker_cases:.0f}"
    figures = f"{total.answers} answers, {len(total.faults)} faults, checker cases: {cases}, {took:.0f} s"
    print(f"judge, seed {given.seed}: {figures}")
    return 1 if total.faults or missed or total.checker_cases else 0


def judge_network(job) -> Outcome:
    """One edge over one network: airspace after airspace, batch after batch."""
    binary, seed, number, bug, verbose = job
    dice = random.Random(f"{seed}.{number}")
    flown = number % 5 in (1, 3)
    network = make_network(dice, dice.choice([600.0, 1200.0, 2500.0]) * (2.5 if flown and dice.random() < 0.5 else 1))
    outcome = Outcome()
    with tempfile.TemporaryDirectory(prefix="skyway-judge-") as folder:
        file = pathlib.Path(folder) / "network.json"
        file.write_text(json.dumps(network.document()))
        with Edge(binary, file, flown, bug) as edge:
            flying: list[dict] = []
            for index in range(AIRSPACES):
                world = make_airspace(dice, network, flown, scale_of(network))
                put(edge, world)
                if flown and index >= AIRSPACES // 2:
                    plans.keep(edge, dice, world, flying)
                    flying = world.plans
                reporter = Reporter(dice, world)
                reports = [reporter.draw() for _ in range(REPORTS)]
                where = f"{seed}.{number}"
                answers = ask(edge, dice, reports)
                plans.read_again(edge, world)
                for report, answer in zip(reports, answers):
                    hold_against(outcome, world, report, answer, where, verbose)
                if flown and not world.plans:
                    squeeze(outcome, edge, dice, world, where, verbose)
                clear(edge, world)
            outcome.checker_cases = edge.checker_cases()
            if outcome.checker_cases:
                outcome.refused += [f"world {seed}.{number}: {line}" for line in edge.cases()]
    return outcome


def squeeze(outcome: Outcome, edge: Edge, dice: random.Random, world: World, where: str, verbose: bool) -> None:
    """A zone begins just when a drone is still on a long leg, or just not any more, by the margin of its window."""
    report = Reporter(dice, world).draw_long()
    answer = edge.single(report.body) if report is not None else {}
    leg = next(iter(answer.get("legs") or []), None)
    if leg is None or answer["outcome"] == "hold":
        return
    arrives_s = instant(leg["arrives_at"])
    segment = world.network.by_id[leg["segment"]]
    for early_s in (0.6, 2.0, 4.0):
        zone = make_squeeze(world.network, segment, arrives_s + widened(arrives_s) - early_s)
        expect_done(edge, "POST", "/v1/zones", zone.feature)
        squeezed = dataclasses.replace(world, zones=[*world.zones, zone], kept={})
        hold_against(outcome, squeezed, report, edge.single(report.body), where, verbose)
        tag = edge.rest.call("GET", f"/v1/zones/{zone.id}").headers.get("etag")
        expect_done(edge, "DELETE", f"/v1/zones/{zone.id}", None, {"if-match": tag} if tag else {})


def judge_new_network(binary: pathlib.Path, seed: int, number: int) -> Outcome:
    """Drones whose leg a new network does not have."""
    outcome = Outcome()

    def against(world: World, report: Report, answer: dict, where: str) -> None:
        hold_against(outcome, world, report, answer, f"{where} (replaced)", False)

    judge_replaced(binary, seed, number, against)
    return outcome


def hold_against(outcome: Outcome, world: World, report: Report, answer: dict, where: str, verbose: bool) -> None:
    faults, covered = judge(world, report, answer)
    outcome.answers += 1
    outcome.covered.update(covered)
    for fault in faults:
        outcome.faults.append((fault.rule, where, fault.text))
    if faults and verbose:
        outcome.shown += [*(f"* {fault}" for fault in faults), told(report.body), told(answer), ""]


def put(edge: Edge, world: World) -> None:
    """Brings an airspace into force."""
    for zone in world.zones:
        expect_done(edge, "POST", "/v1/zones", zone.feature)
    for closure in world.closures:
        expect_done(edge, "POST", "/v1/closures", closure.body)
    if world.flown:
        wind = {"from": text_of(NOW_S - 3600), "until": text_of(NOW_S + 86_400)}
        wind |= {"speed_mps": world.wind.speed_mps, "from_deg": world.wind.from_deg}
        tag = edge.rest.call("GET", "/v1/weather").headers.get("etag")
        expect_done(edge, "PUT", "/v1/weather", {"wind": [wind]}, {"if-match": tag} if tag else {})


def clear(edge: Edge, world: World) -> None:
    """Takes it away again."""
    for kind, things in (("zones", world.zones), ("closures", world.closures)):
        for thing in things:
            tag = edge.rest.call("GET", f"/v1/{kind}/{thing.id}").headers.get("etag")
            expect_done(edge, "DELETE", f"/v1/{kind}/{thing.id}", None, {"if-match": tag} if tag else {})


def expect_done(edge: Edge, method: str, path: str, body, headers: dict | None = None) -> dict:
    answer = edge.rest.call(method, path, body, headers)
    if answer.code is not None:
        raise RuntimeError(f"{method} {path} of {told(body)}: {answer.told()}\n{edge.log()}")
    return answer.body


def ask(edge: Edge, dice: random.Random, reports: list[Report]) -> list[dict]:
    """Most in a batch, some by themselves, some over gRPC."""
    ways = [
        "rest" if pick < 0.08 else "grpc" if pick < 0.2 and report.zone is None else "batch"
        for report, pick in ((report, dice.random()) for report in reports)
    ]
    batch = iter(edge.batch([report.body for report, way in zip(reports, ways) if way == "batch"]))
    answers = []
    for report, way in zip(reports, ways):
        if way == "batch":
            answers.append(next(batch))
        else:
            answers.append(edge.single(report.body) if way == "rest" else edge.over_grpc(report.body))
    return answers


if __name__ == "__main__":
    sys.exit(main())
