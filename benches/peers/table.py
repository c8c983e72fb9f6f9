"""Prints the tables of what the bench and `run.py` have measured.

    table.py FOLDER    target/peers

Ratios are of medians over the same queries: a peer that was asked ten is compared with ours on these ten.
"""

import collections
import csv
import json
import pathlib
import statistics
import sys

# What every ratio is to: the whole answer, path included.
OURS = {
    "local": "exact, no table",
    "global": "exact, table in memory",
    "zone": "exact, table in memory",
    "open": "exact, table in memory",
}
TITLES = {
    "local": "local: from one end of the failed segment to the other, without it",
    "global": "global: from the start of the failed segment to the destination, without it",
    "zone": "zone: all nodes in a polygon of 1 % of the map closed for this query, finding them included",
}
# Engines of this package; the heuristics may find longer ways.
HEURISTICS = ("two_phased", "cell_density", "radius")
OWN = ("exact", "compact") + HEURISTICS


class Measured:
    def __init__(self, folder):
        self.about = json.loads((folder / "about.json").read_text())
        self.name = self.about["name"]
        self.times_ns = collections.defaultdict(dict)
        self.excess = {}
        self.preparations = []
        for half in ("rust", "python"):
            for row in read(folder / f"times-{half}.csv"):
                key = row["kind"], row["engine"]
                self.times_ns[key][int(row["query"])] = int(row["ns"])
                self.excess[key] = float(row["mean_excess"])
            self.preparations += read(folder / f"preparations-{half}.csv")

    def p50_us(self, key):
        return statistics.median(self.times_ns[key].values()) / 1e3

    def p99_us(self, key):
        ordered = sorted(self.times_ns[key].values())
        return ordered[round(0.99 * (len(ordered) - 1))] / 1e3

    def ratio(self, key):
        """How many times as long as ours takes for the same queries."""
        kind, _ = key
        ours = self.times_ns["global" if kind == "open" else kind, OURS[kind]]
        queries = self.times_ns[key].keys() & ours.keys()
        theirs = statistics.median(self.times_ns[key][query] for query in queries)
        return theirs / statistics.median(ours[query] for query in queries)


def read(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def is_own(engine):
    return engine.startswith(OWN)


def head(columns):
    print("| " + " | ".join(columns) + " |")
    print("|---" + "|---:" * (len(columns) - 1) + "|")


def row(cells):
    print("| " + " | ".join(cells) + " |")


def figure(number):
    """Three digits, as a person would write them."""
    if number >= 100:
        return f"{number:,.0f}"
    return f"{number:.1f}" if number >= 10 else f"{number:.2f}"


def duration(us):
    if us < 1e3:
        return f"{figure(us)} µs"
    return f"{figure(us / 1e3)} ms" if us < 1e6 else f"{figure(us / 1e6)} s"


def engines(networks, kind):
    """All engines of a kind of query, in the order they were measured."""
    names = [name for network in networks for kind_of, name in network.times_ns if kind_of == kind]
    return list(dict.fromkeys(names))


def print_networks(networks):
    head(["network", "nodes", "segments", "failures", "left out, no way around", "zones", "straight-line scale"])
    for network in networks:
        about = network.about
        drawn = about["failures"] + about["without_detour"]
        row([
            network.name,
            f"{about['nodes']:,}",
            f"{about['segments']:,}",
            str(about["failures"]),
            f"{100 * about['without_detour'] / drawn:.0f} %",
            str(about["zones"]),
            f"{about['straight_line_scale']:.3f}",
        ])


def print_times(networks, kind):
    print(f"\n#### {TITLES[kind]}\n")
    print(f"p50, and how many times that of `{OURS[kind]}` on the same queries.\n")
    head(["engine"] + [network.name for network in networks])
    for engine in engines(networks, kind):
        cells = []
        for network in networks:
            key = kind, engine
            if key not in network.times_ns:
                cells.append("-")
                continue
            text = duration(network.p50_us(key))
            if engine != OURS[kind]:
                text += f" (×{figure(network.ratio(key))})"
            cells.append(text)
        row([f"**{engine}**" if engine == OURS[kind] else engine] + cells)
    print_open(networks, kind)


def print_open(networks, kind):
    """RoutingKit's query with nothing closed, which answers another question, below the global ones."""
    if kind != "global":
        return
    for engine in engines(networks, "open"):
        cells = [
            f"{duration(network.p50_us(('open', engine)))} (×{figure(network.ratio(('open', engine)))})"
            for network in networks
        ]
        row([f"*{engine}*"] + cells)


def print_own_p99(networks, kind):
    print(f"\nOurs, {kind}, p99" + ("" if kind == "zone" else "; in brackets how much longer than the shortest on average") + ":\n")
    head(["engine"] + [network.name for network in networks])
    for engine in filter(is_own, engines(networks, kind)):
        cells = []
        for network in networks:
            key = kind, engine
            text = duration(network.p99_us(key))
            if engine in HEURISTICS:
                text += f" ({100 * network.excess[key]:.2f} %)"
            cells.append(text)
        row([engine] + cells)


def print_winners(networks):
    """Who is fastest among those who close and answer, and who else beats ours."""
    print("\n#### Who is fastest\n")
    head(["network", *TITLES])
    for network in networks:
        cells = []
        for kind in TITLES:
            keys = [key for key in network.times_ns if key[0] == kind]
            fastest = min(keys, key=network.p50_us)
            peers = [key for key in keys if not is_own(key[1])]
            best_peer = min(peers, key=network.ratio)
            cells.append(f"{fastest[1]}; best peer {best_peer[1]}, ×{figure(network.ratio(best_peer))}")
        row([network.name] + cells)
    print()
    beaten = [
        f"- {network.name}, {kind}: {engine} takes {network.ratio((kind, engine)):.2f} times as long as `{OURS[kind]}`."
        for network in networks
        for kind, engine in network.times_ns
        if not is_own(engine) and network.ratio((kind, engine)) < 1
    ]
    print("\n".join(["Peers that are faster than ours:\n", *beaten]) if beaten else "No peer is faster than ours in any row.")


def print_preparations(networks):
    print("\n#### What is done once\n")
    whats = dict.fromkeys((one["engine"], one["what"]) for network in networks for one in network.preparations)
    head(["engine, what"] + [network.name for network in networks])
    for engine, what in whats:
        seconds = [
            float(one["seconds"])
            for network in networks
            for one in network.preparations
            if (one["engine"], one["what"]) == (engine, what)
        ]
        row([f"{engine}, {what}"] + [duration(1e6 * second) for second in seconds])


def print_samples(networks):
    print("\n#### Queries asked\n")
    print("Local, global and zone; a budget of time for each cell bounds them.\n")
    head(["engine"] + [network.name for network in networks])
    names = dict.fromkeys(name for kind in TITLES for name in engines(networks, kind))
    for engine in names:
        row([engine] + [
            " / ".join(str(len(network.times_ns.get((kind, engine), {})) or "-") for kind in TITLES)
            for network in networks
        ])


def main(folder):
    names = (folder / "networks.txt").read_text().split()
    networks = [Measured(folder / name) for name in names]
    with_assertions = any(network.about["debug_assertions"] for network in networks)
    print("Seed 1; every distance checked against petgraph's Dijkstra, one that differs stops the run.")
    if with_assertions:
        print("**Built with debug assertions: these figures are no measurement.**")
    print()
    print_networks(networks)
    for kind in TITLES:
        print_times(networks, kind)
        print_own_p99(networks, kind)
    print_winners(networks)
    print_preparations(networks)
    print_samples(networks)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]))
