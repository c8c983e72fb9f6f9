"""The engine in the process and the command line give the same answers, node for node."""

import json
import random

import geopandas as gpd
import pytest
import skyway
from conftest import SEED, drawn_legs

LENGTHS = ("remaining_length_m", "recomposed_length_m", "first_stretch_m")
COUNTS = ("outcome", "strategy_used", "stage", "searches", "area_nodes", "area_segments", "settled_nodes")
OPTIMA = ("local_optimum_m", "global_optimum_m", "remaining_optimum_m")


def assert_same(answer: skyway.Recomposition, told: dict, about: object) -> None:
    assert [str(node) for node in answer.nodes] == told["path"]["nodes"], about
    assert list(answer.segments) == told["path"]["segments"], about
    for name in COUNTS:
        assert getattr(answer, name) == told[name], (name, about)
    for name in (*LENGTHS, *OPTIMA):
        assert getattr(answer, name) == told.get(name), (name, about)
    assert answer.fallback_reason == told.get("fallback_reason"), about
    assert [code for code, _ in answer.warnings] == [warning["code"] for warning in told["warnings"]], about


@pytest.mark.parametrize("strategy", skyway.STRATEGIES)
def test_every_strategy_answers_as_the_command_line(program, generated, generated_file, strategy):
    draw = random.Random(SEED)
    questions = []
    for (start, end), destination in drawn_legs(generated, 60):
        scope, failure = draw.choice(("local", "global")), draw.choice(skyway.FAILURES)
        close = draw.sample(generated.node_ids, 5) if draw.random() < 0.5 else []
        questions.append(((start, end), destination, scope, failure, close))
    reports = [
        {
            "service": {"from": leg[0], "to": leg[1]},
            "destination": destination,
            "type": failure,
            "strategy": strategy,
            "scope": scope,
            "close": close,
        }
        | {"optimum": True, "location": {"node": leg[0]}}
        for leg, destination, scope, failure, close in questions
    ]
    told = program.answers(generated_file, reports)
    # A network of its own: a table that another test made changes how many nodes are settled.
    network = skyway.Network.from_file(generated_file)
    for (leg, destination, scope, failure, close), expected in zip(questions, told, strict=True):
        answer = network.recompose(leg, destination, failure=failure, strategy=strategy, scope=scope, close=close, optimum=True)
        assert_same(answer, expected, (leg, destination, scope, failure, close))


@pytest.fixture
def sydney() -> skyway.Network:
    """Anew for each question, as for the command line: a table that an earlier question made changes how many nodes are settled."""
    return skyway.Network.bundled("sydney")


def test_places_in_degrees_are_read_as_the_command_line_does(program, sydney):
    told = json.loads(
        program.run(
            "reroute",
            "--service",
            "379,406",
            "--destination",
            450,
            "--location",
            "151.2102,-33.8624",
            "--cause-location",
            406,
            "--json",
        )
    )
    answer = sydney.recompose((379, 406), 450, location=(151.2102, -33.8624), cause_location=406)
    assert_same(answer, told, "off the leg")
    assert answer.first_stretch_m > 0.0
    unknown = json.loads(program.run("reroute", "--service", "379,406", "--destination", 450, "--location", "unknown", "--json"))
    assert_same(skyway.Network.bundled("sydney").recompose((379, 406), 450, location="unknown"), unknown, "unknown")


def test_zones_close_what_they_close_for_the_command_line(program, sydney, tmp_path):
    circle = {"type": "Point", "coordinates": [151.2076, -33.8644]}
    zone = {"type": "Feature", "id": "crane", "geometry": circle, "properties": {"radius_m": 60, "reason": "crane"}}
    file = tmp_path / "zones.geojson"
    file.write_text(json.dumps(zone), encoding="utf-8")
    asked = ("reroute", "--service", "379,406", "--destination", 1, "--json")
    told, open_sky = json.loads(program.run(*asked, "--zones", file)), json.loads(program.run(*asked))
    assert told["path"] != open_sky["path"], "the zone lies on the way, or the test shows nothing"
    closed = sydney.with_closures(zones=zone)
    assert_same(closed.recompose((379, 406), 1), told, "with a zone")
    assert len(closed.closed[1]) == 45
    assert sydney.closed == ((), ()), "the network itself stays open"
    table = gpd.GeoDataFrame.from_features([zone], crs=4326).assign(id="crane").to_crs(7856)
    as_table = sydney.with_closures(zones=[table])
    assert as_table.closed == closed.closed
    brought = sydney.recompose((379, 406), 1, zone=zone, failure="regulatory")
    assert [str(node) for node in brought.nodes] == told["path"]["nodes"]


def test_explain_tells_the_areas_that_the_command_line_tells(program, sydney):
    told = json.loads(
        program.run("reroute", "--service", "379,406", "--destination", 450, "--strategy", "two_phased", "--explain", "--json")
    )
    answer = sydney.recompose((379, 406), 450, strategy="two_phased", explain=True)
    assert answer.document()["stages"] == told["stages"]
    assert [(one.stage, len(one.nodes)) for one in answer.stages] == [(one["stage"], len(one["nodes"])) for one in told["stages"]]
    assert not sydney.recompose((379, 406), 450, strategy="two_phased").stages


def test_parameters_reach_the_strategies(program, sydney):
    asked = ("reroute", "--service", "379,406", "--destination", 450, "--json")
    cells = json.loads(program.run(*asked, "--strategy", "cell_density", "--cell-size", 40))
    assert_same(sydney.recompose((379, 406), 450, strategy="cell_density", cell_size_m=40), cells, "cells")
    rectangle = json.loads(program.run(*asked, "--strategy", "two_phased", "--val-ratio", 1.5, "--no-stage-skipping"))
    answer = sydney.recompose((379, 406), 450, strategy="two_phased", val_ratio=1.5, stage_skipping=False)
    assert_same(answer, rectangle, "rectangle")
    assert answer != sydney.recompose((379, 406), 450, strategy="two_phased")


def test_what_a_network_closes_and_what_a_call_closes_is_the_same(program, sydney):
    asked = ("reroute", "--service", "379,406", "--destination", 450, "--close", 408, "--close", "353,404", "--json")
    told = json.loads(program.run(*asked))
    closed = sydney.with_closures(close=[408, (353, 404)])
    assert_same(closed.recompose((379, 406), 450), told, "of the network")
    assert_same(sydney.recompose((379, 406), 450, close=[408, "353-404"]), told, "of the call")
    assert (closed.closed[0], "353-404" in closed.closed[1]) == ((408,), True)
    further = closed.with_closures(close=[399])
    assert further.closed[0] == (399, 408), "closures add up"
    assert not {399, 408, 404} & set(further.recompose((379, 406), 450).nodes[:3])


def test_where_the_cause_is_decides_which_way_leads_back(program, sydney):
    place = (151.2102, -33.8624)
    asked = ("reroute", "--service", "379,406", "--destination", 450, "--location", "151.2102,-33.8624", "--json")
    for cause, first in ((379, 406), (406, 379)):
        told = json.loads(program.run(*asked, "--cause-location", cause))
        answer = skyway.Network.bundled("sydney").recompose((379, 406), 450, location=place, cause_location=cause)
        assert_same(answer, told, cause)
        assert answer.nodes[0] == first
    stated = [379, 406, 420, 450]
    answer = sydney.recompose((379, 406), 450, strategy="radius", remaining_path=stated)
    report = {"type": "navigational", "service": {"from": 379, "to": 406}, "destination": 450}
    report |= {"strategy": "radius", "remaining_path": stated}
    network = program.answers("sydney", [report | {"location": {"node": 379}}])
    assert_same(answer, network[0], "a stated path")
