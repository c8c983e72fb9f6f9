"""Many recompositions: as one by one, exact as NetworkX, and without the lock of the interpreter."""

import array
import math
import threading

import networkx as nx
import numpy as np
import pytest
import skyway
from conftest import drawn_legs


def columns(network, count):
    legs = drawn_legs(network, count)
    return [leg[0] for leg, _ in legs], [leg[1] for leg, _ in legs], [destination for _, destination in legs]


def test_exact_is_the_shortest_path_of_networkx(generated):
    graph = generated.to_networkx()
    start, end, destination = columns(generated, 400)
    answers = generated.recompose_many(start, end, destination)
    reached = 0
    for row, (a, b, goal) in enumerate(zip(start, end, destination)):
        weight = graph.edges[a, b]["weight"]
        graph.remove_edge(a, b)
        try:
            shortest_m = nx.shortest_path_length(graph, a, goal, weight="weight")
        except nx.NetworkXNoPath:
            shortest_m = None
        if shortest_m is None:
            assert answers.outcome(row) in ("diverted", "no_route")
        else:
            assert answers.remaining_length_m[row] == pytest.approx(shortest_m, rel=1e-12)
            path = answers.nodes(row)
            assert (path[0], path[-1]) == (a, goal)
            assert nx.path_weight(graph, path, "weight") == pytest.approx(shortest_m, rel=1e-12)
            reached += 1
        graph.add_edge(a, b, weight=weight)
    assert reached > 300


@pytest.mark.parametrize("strategy", skyway.STRATEGIES)
def test_many_are_as_one_by_one(generated, strategy):
    start, end, destination = columns(generated, 150)
    closed = list(generated.node_ids[:3])
    answers = generated.recompose_many(start, end, destination, strategy=strategy, close=closed, threads=2)
    for row, question in enumerate(zip(start, end, destination)):
        one = generated.recompose(question[:2], question[2], strategy=strategy, close=closed)
        assert (answers.outcome(row), answers.nodes(row)) == (one.outcome, one.nodes), question
        # By a table a length is summed up in another order than by A*.
        length_m = math.nan if one.remaining_length_m is None else one.remaining_length_m
        assert answers.remaining_length_m[row] == pytest.approx(length_m, rel=1e-12, nan_ok=True)


def test_the_number_of_threads_changes_no_answer(generated):
    asked = columns(generated, 2_000)
    one, three = (generated.recompose_many(*asked, threads=threads) for threads in (1, 3))
    assert np.array_equal(one.path_nodes, three.path_nodes)
    assert np.array_equal(one.remaining_length_m, three.remaining_length_m, equal_nan=True)


def test_columns_come_as_whatever_holds_integers(generated):
    start, end, destination = columns(generated, 20)
    expected = generated.recompose_many(start, end, destination).path_nodes
    for kind in (np.array, lambda column: np.array(column, dtype="int32"), lambda column: array.array("q", column), tuple):
        answers = generated.recompose_many(kind(start), kind(end), kind(destination))
        assert np.array_equal(answers.path_nodes, expected)
    strided = np.repeat(np.array(start), 2)[::2]
    assert np.array_equal(generated.recompose_many(strided, end, destination).path_nodes, expected)


def test_text_ids_are_found_too():
    graph = nx.relabel_nodes(nx.convert_node_labels_to_integers(nx.grid_2d_graph(4, 4)), lambda node: f"roof {node}")
    for number, node in enumerate(graph):
        graph.nodes[node].update(x=100.0 * (number // 4), y=100.0 * (number % 4))
    network = skyway.Network.from_networkx(graph)
    answers = network.recompose_many(["roof 0"], ["roof 1"], ["roof 3"])
    assert answers.nodes(0) == network.recompose(("roof 0", "roof 1"), "roof 3").nodes
    assert answers.remaining_length_m[0] == 500.0
    assert list(answers.to_frame()["destination"]) == ["roof 3"]


def test_a_frame_has_a_row_for_each_report(generated):
    start, end, destination = columns(generated, 50)
    frame = generated.recompose_many(start, end, destination).to_frame()
    assert list(frame["destination"]) == destination
    assert set(frame["outcome"]) <= {"rerouted", "unaffected", "hold", "diverted", "no_route"}


def test_answers_are_frozen(generated):
    answers = generated.recompose_many(*columns(generated, 5))
    with pytest.raises(AttributeError):
        answers.strategy = "radius"
    with pytest.raises(ValueError, match="read-only"):
        answers.remaining_length_m[0] = 0.0
    with pytest.raises(AttributeError):
        generated.recompose((0, 1)).outcome = "rerouted"


def test_the_lock_of_the_interpreter_is_free_meanwhile(generated):
    asked = [np.repeat(np.array(column), 10) for column in columns(generated, 1_000)]
    began, ended = threading.Event(), threading.Event()

    def answer():
        began.set()
        generated.recompose_many(*asked, strategy="bellman_ford", threads=1)
        ended.set()

    worker = threading.Thread(target=answer)
    worker.start()
    began.wait()
    # With the lock held, this thread would take its next turn only when all is answered.
    turns = 0
    while not ended.wait(0.001):
        turns += 1
    worker.join()
    assert turns >= 10


def test_threads_may_ask_one_network_at_once(generated):
    legs = drawn_legs(generated, 300)
    expected = [generated.recompose(leg, destination, strategy="radius").nodes for leg, destination in legs]
    found = {}

    def ask(name):
        found[name] = [generated.recompose(leg, destination, strategy="radius").nodes for leg, destination in legs]

    threads = [threading.Thread(target=ask, args=(name,)) for name in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(found[name] == expected for name in range(4))
