"""What is refused says its code, its place and the remedy, and leaves the process as it was."""

import datetime
import math
import pickle
import random

import geopandas as gpd
import networkx as nx
import pytest
import shapely
import skyway
from skyway import errors, program

ZONE = {"type": "Feature", "id": "z", "geometry": {"type": "Point", "coordinates": [151.2, -33.8]}, "properties": {"radius": 3}}
POSITIONED = {"x": 0.0, "y": 0.0}


def no_way_back(network):
    return network.recompose((379, 406), 450, remaining_path=[1, 3])


CASES = {
    "unknown node": (lambda n: n.recompose((379, 4060), 450), errors.RequestError, "unknown_node", "service[1]", "'476'"),
    "unknown destination": (lambda n: n.recompose((379, 406), "x"), errors.RequestError, "unknown_node", "destination", "'476'"),
    "no leg": (lambda n: n.recompose(379, 450), errors.RequestError, "not_a_leg", "service", "(379, 406)"),
    "text as leg": (lambda n: n.recompose("ab", 450), errors.RequestError, "not_a_leg", "service", "(379, 406)"),
    "strategy": (
        lambda n: n.recompose((379, 406), 450, strategy="fast"),
        errors.RequestError,
        "unknown_value",
        "strategy",
        "two_phased",
    ),
    "failure": (
        lambda n: n.recompose((379, 406), failure="rain"),
        errors.RequestError,
        "unknown_value",
        "failure",
        "environmental",
    ),
    "swapped": (
        lambda n: n.recompose((379, 406), location=(-33.8, 151.2)),
        errors.RequestError,
        "not_a_place",
        "location",
        "swapped",
    ),
    "not a place": (lambda n: n.recompose((379, 406), location=[1]), errors.RequestError, "not_a_place", "location", "longitude"),
    "cell size": (
        lambda n: n.recompose((379, 406), cell_size_m=-1),
        errors.RequestError,
        "out_of_range",
        "cell_size_m",
        "above 0",
    ),
    "close": (
        lambda n: n.recompose((379, 406), close=[353, "999-1"]),
        errors.RequestError,
        "cannot_close",
        "close[1]",
        "segment",
    ),
    "path": (no_way_back, errors.RequestError, "not_the_remaining_path", "remaining_path", "behind"),
    "zone": (lambda n: n.with_closures(zones=ZONE), errors.AirspaceError, "zone_unknown_field", "/properties/radius", "radius_m"),
    "brought zone": (
        lambda n: n.recompose((379, 406), zone=ZONE),
        errors.AirspaceError,
        "zone_unknown_field",
        "/properties/radius",
        "radius_m",
    ),
    "time": (lambda n: n.with_closures(at="noon"), errors.AirspaceError, "not_a_time", "at", "RFC 3339"),
    "no offset": (
        lambda n: n.with_closures(at=datetime.datetime(2026, 1, 1)),
        errors.FlightError,
        "time_without_offset",
        "at",
        "utc",
    ),
    "percent": (
        lambda n: skyway.Flight(battery_fraction=40),
        errors.FlightError,
        "out_of_range",
        "flight.battery_fraction",
        "0.8",
    ),
    "wind": (lambda n: skyway.Flight(wind=(400, 3)), errors.FlightError, "out_of_range", "flight.wind", "(225, 7)"),
    "airframe": (lambda n: skyway.Flight(airframe="kite"), errors.FlightError, "unknown_airframe", "flight.airframe", "m100"),
    "objective": (
        lambda n: n.compose(1, 9, flight=skyway.Flight(objective="fun")),
        errors.RequestError,
        "unknown_value",
        "flight.objective",
        "energy",
    ),
    "airspeed": (lambda n: n.compose(1, 9, airspeed_mps=0), errors.RequestError, "out_of_range", "airspeed_mps", "above 0"),
    "stops": (lambda n: n.compose(1, 9, stops=[(3, 1.0)]), errors.FlightError, "no_flight", "stops", "Flight"),
    "row": (
        lambda n: n.recompose_many([379, 379], [406, 406], [450, 0]),
        errors.RequestError,
        "unknown_node",
        "destination[1]",
        "'476'",
    ),
    "lengths": (
        lambda n: n.recompose_many([379], [406, 1], [450]),
        errors.RequestError,
        "columns_differ",
        "service_to",
        "one length",
    ),
    "map by distance": (lambda n: n.map(n.compose(1, 9)), errors.FlightError, "no_map", "flight", "Flight"),
    "proof by distance": (lambda n: n.compose(1, 9).certificate(), errors.FlightError, "no_proof", "flight", "Flight"),
    "threads": (
        lambda n: n.recompose_many([379], [406], [450], threads=0),
        errors.RequestError,
        "out_of_range",
        "threads",
        "None",
    ),
    "flight": (lambda n: n.compose(1, 9, flight={"wind": 3}), errors.FlightError, "not_a_flight", "flight", "skyway.Flight"),
    "closes one": (lambda n: n.recompose((379, 406), close=353), errors.RequestError, "not_a_list", "close", "list"),
    "wind of one": (lambda n: skyway.Flight(wind=[7]), errors.FlightError, "out_of_range", "flight.wind", "(225, 7)"),
    "labels": (lambda n: n.map(labels="some"), errors.RequestError, "unknown_value", "labels", "ends"),
    "width": (lambda n: n.map(width_px=3), errors.RequestError, "out_of_range", "width_px", "320"),
    "no file": (
        lambda n: skyway.Network.from_file("missing.json"),
        errors.NetworkError,
        "unreadable_file",
        "missing.json",
        "file",
    ),
    "bundled": (lambda n: skyway.Network.bundled("atlantis"), errors.NetworkError, "unknown_network", "name", "sydney"),
    "joining": (
        lambda n: skyway.Network.generated(9, joining="x"),
        errors.NetworkError,
        "unknown_joining",
        "joining",
        "delaunay",
    ),
    "directed": (
        lambda n: skyway.Network.from_networkx(nx.DiGraph()),
        errors.NetworkError,
        "directed_graph",
        "graph",
        "nx.Graph",
    ),
    "no position": (
        lambda n: skyway.Network.from_networkx(nx.path_graph(2)),
        errors.NetworkError,
        "no_position",
        "node 0",
        "lon",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_refusal_names_its_place_and_the_remedy(sydney, name):
    ask, kind, code, place, remedy = CASES[name]
    with pytest.raises(kind) as refused:
        ask(sydney)
    assert (refused.value.code, refused.value.place) == (code, place)
    assert remedy in refused.value.hint
    assert refused.value.hint in str(refused.value) and refused.value.message in str(refused.value)
    assert sydney.recompose((379, 406), 450).outcome == "rerouted"


def test_nothing_that_is_handed_in_ends_the_process(sydney):
    odd = [
        None,
        True,
        -1,
        0,
        2**70,
        1.5,
        math.nan,
        math.inf,
        "",
        "379",
        b"379",
        (1,),
        [1, 2],
        {},
        "unknown",
        (math.inf, 0),
        object(),
        "\ud800",
    ]
    names = [
        "failure",
        "location",
        "cause_location",
        "remaining_path",
        "zone",
        "strategy",
        "scope",
        "close",
        "cell_size_m",
        "flight",
    ]
    draw = random.Random(24)
    asks = [
        lambda: sydney.recompose(
            draw.choice([(379, 406)] * 9 + odd), draw.choice([450] * 9 + odd), **{draw.choice(names): draw.choice(odd)}
        ),
        lambda: sydney.compose(draw.choice([1, *odd]), draw.choice([450, *odd]), airspeed_mps=draw.choice([16.0, *odd])),
        lambda: sydney.recompose_many(*(draw.choice([[379], *odd]) for _ in range(3))),
        lambda: sydney.with_closures(zones=draw.choice(odd), close=draw.choice([(), *odd]), at=draw.choice([None, *odd])),
        lambda: skyway.Network.from_text(draw.choice(odd)),
        lambda: sydney.verify(draw.choice(odd)),
    ]
    refused = 0
    for _ in range(3_000):
        try:
            draw.choice(asks)()
        except skyway.InternalError:
            raise
        except (skyway.SkywayError, TypeError, ValueError, OverflowError, AttributeError):
            refused += 1
    assert refused > 1_000
    assert sydney.recompose((379, 406), 450).outcome == "rerouted"


def test_a_network_that_cannot_be_flown_is_refused_by_its_feature():
    graph = nx.Graph()
    graph.add_node("a", **POSITIONED)
    graph.add_node("b", x=float("nan"), y=0.0)
    with pytest.raises(skyway.NetworkError) as refused:
        skyway.Network.from_networkx(graph)
    assert refused.value.code in ("network_invalid", "network_unreadable")
    graph.nodes["b"]["x"] = 0.0
    graph.add_edge("a", "b")
    with pytest.raises(skyway.NetworkError) as refused:
        skyway.Network.from_networkx(graph)
    assert "'a' - 'b'" in refused.value.place and "coincide" in refused.value.message


def test_tables_without_points_or_ends_are_refused():
    line = gpd.GeoDataFrame({"id": [1]}, geometry=[shapely.LineString([(0, 0), (1, 1)])])
    with pytest.raises(skyway.NetworkError) as refused:
        skyway.Network.from_geopandas(line, line)
    assert refused.value.code == "not_a_point"
    point = gpd.GeoDataFrame({"id": [1]}, geometry=[shapely.Point(0, 0)])
    with pytest.raises(skyway.NetworkError) as refused:
        skyway.Network.from_geopandas(point, line)
    assert refused.value.code == "no_ends" and "from" in refused.value.hint


def test_a_refusal_survives_a_trip_to_another_process():
    refusal = skyway.RequestError("no", "code", "place", "hint")
    again = pickle.loads(pickle.dumps(refusal))
    assert (type(again), again.code, again.place, again.hint) == (skyway.RequestError, "code", "place", "hint")
    problem = pickle.loads(pickle.dumps(skyway.Problem(404, {"code": "not_found", "detail": "none"})))
    assert (problem.status, problem.code) == (404, "not_found")


def test_a_program_that_is_missing_is_named_with_the_remedy(monkeypatch):
    monkeypatch.setenv("SKYWAY_PROGRAM", "/nowhere/skyway")
    with pytest.raises(skyway.ProgramError) as refused:
        program.program()
    assert refused.value.place == "SKYWAY_PROGRAM"
    monkeypatch.delenv("SKYWAY_PROGRAM")
    monkeypatch.setattr(program, "_skyway", object())
    monkeypatch.setenv("PATH", "")
    with pytest.raises(skyway.ProgramError) as refused:
        skyway.demo()
    assert refused.value.code == "no_program" and "cargo build" in refused.value.hint
