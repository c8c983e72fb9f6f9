"""Graphs of NetworkX and tables of GeoPandas, in and out."""

import gzip

import networkx as nx
import numpy as np
import pandas as pd
import skyway


def same(one: skyway.Network, other: skyway.Network) -> None:
    assert other.node_ids == one.node_ids
    assert nx.utils.graphs_equal(one.to_networkx(), other.to_networkx())


def test_a_graph_comes_back_as_it_went(sydney, generated):
    for network in (sydney, generated):
        same(network, skyway.Network.from_networkx(network.to_networkx()))


def test_tables_come_back_as_they_went(sydney, generated):
    for network in (sydney, generated):
        same_lengths = skyway.Network.from_geopandas(*network.to_geopandas())
        assert same_lengths.node_ids == network.node_ids
        before, after = network.to_networkx(), same_lengths.to_networkx()
        assert {frozenset(edge) for edge in before.edges} == {frozenset(edge) for edge in after.edges}
        assert all(np.isclose(before.edges[edge]["weight"], after.edges[edge]["weight"]) for edge in before.edges)


def test_a_projected_table_is_taken_to_degrees(sydney):
    nodes, segments = sydney.to_geopandas()
    network = skyway.Network.from_geopandas(nodes.to_crs(32756), segments)
    assert network.is_geographic
    assert network.recompose((379, 406), 450).nodes == sydney.recompose((379, 406), 450).nodes


def test_the_ends_of_segments_may_be_an_index(sydney):
    nodes, segments = sydney.to_geopandas()
    segments = segments.rename(columns={"from": "u", "to": "v"}).set_index(["u", "v"])
    network = skyway.Network.from_geopandas(nodes.set_index("id"), segments)
    assert (network.node_count, network.segment_count) == (sydney.node_count, sydney.segment_count)


def test_numbers_of_numpy_and_positions_as_pos_are_taken():
    graph = nx.Graph()
    for number in np.arange(3):
        graph.add_node(number, pos=(np.float32(100.0 * number), 0.0), pads=np.int64(2), name=pd.NA if number else "depot")
    graph.add_edge(np.int64(0), np.int64(1), length=np.float64(120.0))
    graph.add_edge(np.int64(1), np.int64(2))
    network = skyway.Network.from_networkx(graph)
    assert network.node_ids == (0, 1, 2)
    back = network.to_networkx()
    assert (back.edges[0, 1]["weight"], back.edges[1, 2]["weight"]) == (120.0, 100.0)
    assert back.nodes[0]["pads"] == 2 and back.nodes[0]["name"] == "depot"


def test_files_are_read_by_their_content(sydney, tmp_path):
    packed = tmp_path / "sydney.json.gz"
    packed.write_bytes(gzip.compress(sydney.node_link().encode()))
    same(sydney, skyway.Network.from_file(packed))
    (tmp_path / "small_nodes.csv").write_text("id,x,y\n1,0,0\n2,30,40\n", encoding="utf-8")
    (tmp_path / "small_edges.csv").write_text("from,to\n1,2\n", encoding="utf-8")
    assert skyway.Network.from_file(tmp_path / "small_nodes.csv").to_networkx().edges[1, 2]["weight"] == 50.0
