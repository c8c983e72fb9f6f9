"""A network and its queries as the bench wrote them, and what every peer needs of them."""

import csv
import json
import math

import numpy


class Network:
    def __init__(self, folder):
        self.folder = folder
        self.about = json.loads((folder / "about.json").read_text())
        nodes = numpy.loadtxt(folder / "nodes.csv", delimiter=",", skiprows=1, ndmin=2)
        edges = numpy.loadtxt(folder / "edges.csv", delimiter=",", skiprows=1, ndmin=2)
        self.node_count = len(nodes)
        self.x, self.y = nodes[:, 0].copy(), nodes[:, 1].copy()
        self.edge_u, self.edge_v = edges[:, 0].astype(numpy.int64), edges[:, 1].astype(numpy.int64)
        self.edge_lengths_m = edges[:, 2].copy()
        # The same as lists: plain numbers are what Python is quickest with.
        self.xs_m, self.ys_m = self.x.tolist(), self.y.tolist()
        self.u, self.v = self.edge_u.tolist(), self.edge_v.tolist()
        self.lengths_m = self.edge_lengths_m.tolist()
        # The straight line times this is a lower bound, also where stated lengths are shorter.
        self.scale = self.about["straight_line_scale"]
        self._sort_by_x()
        self._list_edges_by_node()
        self._length_of = None

    def failures(self):
        return [numbers(row) for row in read(self.folder / "failures.csv")]

    def zones(self):
        zones = []
        for row in read(self.folder / "zones.csv"):
            ring = row.pop("ring")
            zone = numbers(row)
            zone["ring"] = [tuple(map(float, corner.split(" "))) for corner in ring.split(";")]
            zones.append(zone)
        return zones

    # --- what is in a polygon ---

    def _sort_by_x(self):
        self.by_x = numpy.argsort(self.x, kind="stable")
        self.sorted_x, self.y_by_x = self.x[self.by_x], self.y[self.by_x]

    def nodes_in(self, ring):
        """The nodes in a polygon: the box by bisection, then crossings with a line to the right, counted."""
        xs, ys = [x for x, _ in ring], [y for _, y in ring]
        first, last = numpy.searchsorted(self.sorted_x, [min(xs), max(xs)])
        near = self.y_by_x[first:last]
        rows = numpy.flatnonzero((near >= min(ys)) & (near <= max(ys))) + first
        x, y = self.sorted_x[rows], self.y_by_x[rows]
        inside = numpy.zeros(len(rows), dtype=bool)
        for place, (x1, y1) in enumerate(ring):
            x0, y0 = ring[place - 1]
            if y0 != y1:
                inside ^= ((y0 > y) != (y1 > y)) & (x < (x1 - x0) * (y - y0) / (y1 - y0) + x0)
        return self.by_x[rows[inside]]

    def _list_edges_by_node(self):
        ends = numpy.concatenate([self.edge_u, self.edge_v])
        order = numpy.argsort(ends, kind="stable")
        self.edges_by_node = order % len(self.edge_u)
        self.first_edge = numpy.searchsorted(ends[order], numpy.arange(self.node_count + 1))

    def edges_at(self, nodes):
        """The edges of some nodes, each once."""
        first, counts = self.first_edge[nodes], self.first_edge[nodes + 1] - self.first_edge[nodes]
        begins = numpy.repeat(first - numpy.concatenate(([0], numpy.cumsum(counts)[:-1])), counts)
        return numpy.unique(self.edges_by_node[begins + numpy.arange(counts.sum())])

    # --- lower bounds ---

    def bound_to(self, target):
        """The lower bound of the way from a node to the target, as a function."""
        xs_m, ys_m, scale, hypot = self.xs_m, self.ys_m, self.scale, math.hypot
        x, y = xs_m[target], ys_m[target]
        return lambda node: scale * hypot(xs_m[node] - x, ys_m[node] - y)

    def bounds_to(self, target):
        """The lower bounds of all nodes."""
        return self.scale * numpy.hypot(self.x - self.x[target], self.y - self.y[target])

    # --- outside of what is timed ---

    def way_length_m(self, nodes):
        if self._length_of is None:
            self._length_of = {}
            for u, v, length_m in zip(self.u, self.v, self.lengths_m):
                self._length_of[u, v] = self._length_of[v, u] = length_m
        return math.fsum(self._length_of[step] for step in zip(nodes, list(nodes)[1:]))


def read(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def numbers(row):
    """Whole numbers where they are written as such; lengths are metres."""
    return {name: float(text) if name.endswith("_m") else int(text) for name, text in row.items()}
