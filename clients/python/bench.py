#!/usr/bin/env python3
"""What a call costs beyond the engine, how long a million recompositions take, and NetworkX' A* on the same queries.

bench.py [--queries N] [--astar N]     prints a table; run it on a machine that does nothing else
"""

import argparse
import math
import os
import platform
import time

import networkx as nx
import numpy as np
import skyway

NODES = 5_000
CALLS = 20_000
ROUNDS = 5
SEED = 24


def queries_of(network, graph, count):
    """Failed legs in either direction, with destinations, drawn uniformly."""
    draw = np.random.default_rng(SEED)
    edges = np.array(graph.edges)
    legs = edges[draw.integers(len(edges), size=count)]
    turned = draw.random(count) < 0.5
    legs[turned] = legs[turned][:, ::-1]
    return legs[:, 0].copy(), legs[:, 1].copy(), draw.choice(np.array(network.node_ids), size=count)


def best_s(work):
    """The shortest of some rounds, in seconds: what else the machine does only adds to it."""
    times_s = []
    for _ in range(ROUNDS):
        began_s = time.perf_counter()
        work()
        times_s.append(time.perf_counter() - began_s)
    return min(times_s)


def overhead(network, queries):
    """Microseconds of a call, and of the engine alone: the same query many times, so that its table is there for both."""
    start, end, destination = (int(column[0]) for column in queries)
    network.recompose((start, end), destination)
    network.recompose((start, end), destination)

    def calls():
        for _ in range(CALLS):
            network.recompose((start, end), destination)

    columns = [np.full(CALLS, node) for node in (start, end, destination)]
    call_us = best_s(calls) / CALLS * 1e6
    engine_us = best_s(lambda: network.recompose_many(*columns, threads=1)) / CALLS * 1e6
    return call_us, engine_us


def astar_s(graph, network, queries, count):
    """Seconds that A* of NetworkX takes for a query, with the straight line as its bound; each answer is held against the engine's."""
    start, end, destination = (column[:count] for column in queries)
    answers = network.recompose_many(start, end, destination)
    places = {node: (place["x"], place["y"]) for node, place in graph.nodes(data=True)}
    spent_s = 0.0
    for row, (a, b, goal) in enumerate(zip(start.tolist(), end.tolist(), destination.tolist())):
        attributes = graph.edges[a, b].copy()
        graph.remove_edge(a, b)
        began_s = time.perf_counter()
        try:
            path = nx.astar_path(graph, a, goal, lambda one, other: math.dist(places[one], places[other]), "weight")
        except nx.NetworkXNoPath:
            path = None
        spent_s += time.perf_counter() - began_s
        if path is None:
            assert answers.outcome(row) in ("diverted", "no_route"), (a, b, goal)
        else:
            length_m = nx.path_weight(graph, path, "weight")
            assert math.isclose(length_m, answers.remaining_length_m[row], rel_tol=1e-9), (a, b, goal)
        graph.add_edge(a, b, **attributes)
    return spent_s / count


def main():
    """Measures and prints."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--queries", type=int, default=1_000_000)
    arguments.add_argument("--astar", type=int, default=200)
    given = arguments.parse_args()
    network = skyway.Network.generated(NODES, max_neighbours=10, reach_fraction=0.1, seed=SEED)
    graph = network.to_networkx()
    queries = queries_of(network, graph, given.queries)
    call_us, engine_us = overhead(network, queries)
    began_s = time.perf_counter()
    network.recompose_many(*queries)
    many_s = time.perf_counter() - began_s
    networkx_s = astar_s(graph, network, queries, given.astar)
    alone_s = many_s / given.queries
    load = os.getloadavg()[0]
    print(
        f"{network.node_count} nodes, {network.segment_count} segments; {os.cpu_count()} cores, load {load:.1f}, Python {platform.python_version()}"
    )
    print()
    print("| what | measured | goal |")
    print("|---|---:|---:|")
    print(f"| a call of `recompose` | {call_us:.1f} µs | |")
    print(f"| the same in the engine, checked | {engine_us:.1f} µs | |")
    print(f"| a call beyond the engine | {call_us - engine_us:.1f} µs | 3 µs |")
    print(f"| {given.queries:,} recompositions in one call | {many_s:.1f} s | 5 s a million |")
    print(f"| A* of NetworkX, a query (of {given.astar}) | {networkx_s * 1e3:.1f} ms | |")
    print(f"| the same beside a row of that call | {networkx_s / alone_s:,.0f} times | 100 times |")


if __name__ == "__main__":
    main()
