"""Asks the peers that come with Python what the bench has asked, and checks every answer.

    run.py FOLDER    a network's folder below target/peers, as the bench wrote it

A query is timed by itself, around the call, in passes over all queries of its kind; its time is the median over the
passes. A budget bounds the passes, so that slow peers are asked fewer queries. One answer that differs stops the run.
"""

import csv
import gc
import os
import pathlib
import sys
import time

# One thread each, as ours. To be said before the libraries are loaded.
os.environ.setdefault("OMP_NUM_THREADS", "1")

from engines import ENGINES  # noqa: E402
from network import Network  # noqa: E402

IS_QUICK = os.environ.get("SKYWAY_PEERS_QUICK") == "1"
MIN_QUERIES = 5
MAX_PASSES = 5
# For one peer and kind of query: half of it bounds the first pass, all of it the passes.
BUDGET_NS = 50e6 if IS_QUICK else 1.2e9


def time_queries(count, ask, check):
    """Times `ask` for numbers from 0 on; hands every answer to `check`, which is not timed.

    Gives the medians; beside each how long opening again took of it, which `check` knows.
    """
    spent_ns = 0
    times_ns = []
    for number_of_pass in range(MAX_PASSES):
        for query in range(count if number_of_pass == 0 else len(times_ns)):
            if number_of_pass == 0 and query >= MIN_QUERIES and spent_ns > BUDGET_NS / 2:
                break
            start = time.perf_counter_ns()
            answer = ask(query)
            took_ns = time.perf_counter_ns() - start
            spent_ns += took_ns
            opening_ns = check(query, answer)
            if number_of_pass == 0:
                times_ns.append([])
            times_ns[query].append((took_ns, opening_ns))
        if spent_ns > BUDGET_NS:
            break
    return [sorted(times)[len(times) // 2] for times in times_ns]


def check_answer(engine, kind, query, answer):
    expected_m, hops = query[f"{kind}_m"], query[f"{kind}_hops"]
    length_m = engine.length_m(answer)
    if not abs(length_m - expected_m) <= engine.tolerance_m(answer, expected_m, hops):
        sys.exit(
            f"error: {engine.name}, {kind}, {engine.network.about['name']}: "
            f"{length_m!r} m, where {expected_m!r} m is the shortest; the query is {query}"
        )


def measure(engine, kind, failures, zones):
    queries = zones if kind == "zone" else failures

    def ask(number):
        return engine.ask(kind, queries[number])

    def check(number, answer):
        check_answer(engine, kind, queries[number], answer)
        return engine.opening_ns

    return time_queries(len(queries), ask, check)


def check_zones(network, zones):
    """The polygons close the same nodes here as there."""
    for zone in zones:
        found = len(network.nodes_in(zone["ring"]))
        if found != zone["closed_nodes"]:
            sys.exit(f"error: {found} nodes in a zone where the engine finds {zone['closed_nodes']}")


def main(folder):
    begun = time.perf_counter()
    network = Network(folder)
    failures, zones = network.failures(), network.zones()
    check_zones(network, zones)
    rows, preparations = [], []
    for make in ENGINES:
        engine = make(network)
        gc.collect()
        gc.disable()
        for kind in engine.kinds:
            times_ns = measure(engine, kind, failures, zones)
            name = engine.name_for(kind)
            for query, (took_ns, opening_ns) in enumerate(times_ns):
                rows.append((kind, name, query, took_ns, 0))
                if opening_ns:
                    rows.append((kind, f"{name}, opening again left out", query, took_ns - opening_ns, 0))
        gc.enable()
        preparations += [(engine.name, what, seconds) for what, seconds in engine.preparations]
        del engine
    write(folder / "times-python.csv", ["kind", "engine", "query", "ns", "mean_excess"], rows)
    write(folder / "preparations-python.csv", ["engine", "what", "seconds"], preparations)
    name, seconds = network.about["name"], time.perf_counter() - begun
    print(f"{name}: {len(ENGINES)} peers, {seconds:.0f} s", file=sys.stderr)


def write(path, head, rows):
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(head)
        writer.writerows(rows)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]))
