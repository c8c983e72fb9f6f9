"""The peers, each asked in the way that suits it best.

An engine answers three kinds of queries: `local` and `global` close one edge, `zone` all nodes in a polygon. A query
is `close, search, open again`, for the next one meets the graph as it was; all of it is timed. What comes back
is turned into metres by `length_m`, which is not timed.
"""

import math
import time

import networkit
import networkx
import numpy
import routingkit_cch
import rustworkx

CLOSED = math.inf
# What RoutingKit takes for infinity, and its unit: it counts in whole numbers.
ROUTINGKIT_CLOSED = 2**31 - 1
UNITS_PER_METRE = 1000


class Engine:
    """A peer with its graph. Columns of a query's exact distances are named after its kind."""

    name = ""
    kinds = ("local", "global", "zone")

    def ask(self, kind, query):
        if kind == "zone":
            return self.zone(query)
        return self.failure(query, query["to"] if kind == "local" else query["destination"])

    def name_for(self, kind):
        return self.name

    def __init__(self, network):
        self.network = network
        # What is done once: (what, seconds).
        self.preparations = []
        # Of the last query, where that is told apart.
        self.opening_ns = 0

    def prepare(self, what, make):
        begun = time.perf_counter()
        made = make()
        self.preparations.append((what, time.perf_counter() - begun))
        return made

    def failure(self, query, target):
        raise NotImplementedError

    def zone(self, query):
        raise NotImplementedError

    def length_m(self, answer):
        return answer

    def tolerance_m(self, answer, expected_m, hops):
        """Rounding of sums of doubles."""
        return 1e-9 * max(expected_m, 1.0)


# --- NetworkX ---


class NetworkX(Engine):
    """For a failure the edge is removed and put back; around a zone the weight function hides what is closed."""

    def __init__(self, network):
        super().__init__(network)
        self.graph = self.prepare("graph", self.build)

    def build(self):
        graph = networkx.Graph()
        graph.add_nodes_from(range(self.network.node_count))
        network = self.network
        graph.add_weighted_edges_from(zip(network.u, network.v, network.lengths_m), weight="length_m")
        return graph

    def failure(self, query, target):
        ends = (query["from"], query["to"])
        kept = self.graph.edges[ends]
        self.graph.remove_edge(*ends)
        answer = self.search(ends[0], target, "length_m")
        self.graph.add_edge(*ends, **kept)
        return answer

    def zone(self, query):
        closed = set(self.network.nodes_in(query["ring"]).tolist())

        def length_m(_, to, edge):
            return None if to in closed else edge["length_m"]

        return self.search(query["source"], query["destination"], length_m)


class NetworkXDijkstra(NetworkX):
    name = "NetworkX Dijkstra"

    def search(self, source, target, weight):
        return networkx.single_source_dijkstra(self.graph, source, target, weight=weight)[0]


class NetworkXBidirectional(NetworkX):
    name = "NetworkX bidirectional Dijkstra"

    def search(self, source, target, weight):
        return networkx.bidirectional_dijkstra(self.graph, source, target, weight)[0]


class NetworkXAstar(NetworkX):
    name = "NetworkX A*"

    def search(self, source, target, weight):
        bound_m = self.network.bound_to(target)
        return networkx.astar_path(self.graph, source, target, lambda node, _: bound_m(node), weight)

    def length_m(self, answer):
        return self.network.way_length_m(answer)


# --- rustworkx ---


class Rustworkx(Engine):
    """Edges that are closed weigh infinitely much until the query is answered."""

    def __init__(self, network):
        super().__init__(network)
        self.graph = self.prepare("graph", self.build)

    def build(self):
        network = self.network
        graph = rustworkx.PyGraph(multigraph=False)
        graph.add_nodes_from(range(network.node_count))
        graph.add_edges_from(list(zip(network.u, network.v, network.lengths_m)))
        return graph

    def failure(self, query, target):
        source, end = query["from"], query["to"]
        length_m = self.graph.get_edge_data(source, end)
        self.graph.update_edge(source, end, CLOSED)
        answer = self.search(source, target)
        self.graph.update_edge(source, end, length_m)
        return answer

    def zone(self, query):
        edges = self.network.edges_at(self.network.nodes_in(query["ring"])).tolist()
        for edge in edges:
            self.graph.update_edge_by_index(edge, CLOSED)
        answer = self.search(query["source"], query["destination"])
        lengths_m = self.network.lengths_m
        for edge in edges:
            self.graph.update_edge_by_index(edge, lengths_m[edge])
        return answer


class RustworkxDijkstra(Rustworkx):
    """Asked for the length alone: its paths are copied at every node."""

    name = "rustworkx Dijkstra"

    def search(self, source, target):
        return rustworkx.dijkstra_shortest_path_lengths(self.graph, source, float, goal=target)[target]


class RustworkxAstar(Rustworkx):
    name = "rustworkx A*"

    def search(self, source, target):
        bound_m = self.network.bound_to(target)
        return rustworkx.astar_shortest_path(self.graph, source, target.__eq__, float, bound_m)

    def length_m(self, answer):
        return self.network.way_length_m(answer)


# --- networkit ---


class Networkit(Engine):
    """Edges that are closed weigh infinitely much until the query is answered."""

    def __init__(self, network):
        super().__init__(network)
        networkit.setNumberOfThreads(1)
        self.graph = self.prepare("graph", self.build)

    def build(self):
        network = self.network
        graph = networkit.Graph(network.node_count, weighted=True)
        graph.addEdges((network.edge_lengths_m, (network.edge_u, network.edge_v)))
        return graph

    def failure(self, query, target):
        source, end = query["from"], query["to"]
        length_m = self.graph.weight(source, end)
        self.graph.setWeight(source, end, CLOSED)
        answer = self.search(source, target)
        self.graph.setWeight(source, end, length_m)
        return answer

    def zone(self, query):
        network, graph = self.network, self.graph
        edges = network.edges_at(network.nodes_in(query["ring"]))
        ends = list(zip(network.edge_u[edges].tolist(), network.edge_v[edges].tolist()))
        for source, end in ends:
            graph.setWeight(source, end, CLOSED)
        answer = self.search(query["source"], query["destination"])
        for (source, end), length_m in zip(ends, network.edge_lengths_m[edges].tolist()):
            graph.setWeight(source, end, length_m)
        return answer


class NetworkitBidirectional(Networkit):
    name = "networkit bidirectional Dijkstra"

    def search(self, source, target):
        search = networkit.distance.BidirectionalDijkstra(self.graph, source, target, True)
        search.run()
        return search.getDistance()


class NetworkitAstar(Networkit):
    """It wants the lower bounds of all nodes beforehand."""

    name = "networkit A*"

    def search(self, source, target):
        bounds_m = self.network.bounds_to(target)
        search = networkit.distance.AStar(self.graph, bounds_m, source, target, True)
        search.run()
        return search.getDistance()


# --- RoutingKit ---


class RoutingKit(Engine):
    """Customizable contraction hierarchies: lengths in whole millimetres, a segment as two arcs.

    Also asked what a hierarchy is made for: nothing closed, a query object that stays. That is another question than
    ours, and comes last, for the binding wants no query alive while weights change.
    """

    name = "RoutingKit CCH"
    kinds = ("local", "global", "zone", "open")

    def ask(self, kind, query):
        if kind != "open":
            return super().ask(kind, query)
        self.opening_ns = 0
        self.standing_query = self.standing_query or routingkit_cch.CCHQuery(self.metric)
        answer = self.standing_query.run(query["from"], query["destination"])
        return answer.distance, answer.node_path

    def name_for(self, kind):
        return "RoutingKit CCH, nothing closed" if kind == "open" else self.name

    def failure(self, query, target):
        arcs = self.arcs_of(query)
        self.close(arcs)
        answer = self.search(query["from"], target)
        self.open_again(arcs)
        return answer

    def zone(self, query):
        arcs = self.arcs_in(query)
        self.close(arcs)
        answer = self.search(query["source"], query["destination"])
        self.open_again(arcs)
        return answer

    def __init__(self, network):
        super().__init__(network)
        self.standing_query = None
        self.tails = network.u + network.v
        self.heads = network.v + network.u
        millimetres = numpy.rint(network.edge_lengths_m * UNITS_PER_METRE).astype(int).tolist()
        self.weights = millimetres + millimetres
        self.edge_of = {ends: edge for edge, ends in enumerate(zip(network.u, network.v))}
        order = self.prepare("order", self.order)
        self.hierarchy = self.prepare(
            "hierarchy", lambda: routingkit_cch.CCH(order, self.tails, self.heads, False)
        )
        self.metric = self.prepare(
            "customization", lambda: routingkit_cch.CCHMetric(self.hierarchy, self.weights)
        )
        self.updater = routingkit_cch.CCHMetricPartialUpdater(self.hierarchy)

    def order(self):
        network = self.network
        return routingkit_cch.compute_order_inertial(
            network.node_count, self.tails, self.heads, network.ys_m, network.xs_m
        )

    def arcs_of(self, query):
        ends = (query["from"], query["to"])
        edge = self.edge_of.get(ends)
        if edge is None:
            edge = self.edge_of[ends[::-1]]
        return [edge, edge + len(self.network.u)]

    def arcs_in(self, query):
        edges = self.network.edges_at(self.network.nodes_in(query["ring"])).tolist()
        count = len(self.network.u)
        return edges + [edge + count for edge in edges]

    def close(self, arcs):
        self.updater.apply(self.metric, dict.fromkeys(arcs, ROUTINGKIT_CLOSED))

    def open_again(self, arcs):
        """Told apart: it costs as much as closing, and a service could do it after it has answered."""
        begun = time.perf_counter_ns()
        self.updater.apply(self.metric, {arc: self.weights[arc] for arc in arcs})
        self.opening_ns = time.perf_counter_ns() - begun

    def search(self, source, target):
        answer = routingkit_cch.CCHQuery(self.metric).run(source, target)
        return answer.distance, answer.node_path

    def length_m(self, answer):
        distance, _ = answer
        return CLOSED if distance is None else distance / UNITS_PER_METRE

    def tolerance_m(self, answer, expected_m, hops):
        """Each length is rounded by up to half a millimetre, on the way found and on the shortest."""
        _, path = answer
        return 0.5 / UNITS_PER_METRE * max(hops, len(path) - 1) + 1e-9 * expected_m


ENGINES = [
    NetworkXAstar,
    NetworkXBidirectional,
    NetworkXDijkstra,
    RustworkxAstar,
    RustworkxDijkstra,
    NetworkitBidirectional,
    NetworkitAstar,
    RoutingKit,
]
