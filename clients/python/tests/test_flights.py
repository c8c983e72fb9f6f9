"""Plans with battery and wind, certificates and maps."""

import json
import xml.etree.ElementTree

import pytest
import skyway

AT = "2026-11-27T18:00:00Z"


def without_effort(told: dict) -> dict:
    """What a plan is, without how long its search took: its limits depend on nothing here, so all else is equal."""
    return {name: value for name, value in told.items() if name != "search"}


@pytest.mark.parametrize(
    ("flight", "arguments"),
    [
        ({"battery_fraction": 0.9, "wind": [225, 7]}, ("--battery", 0.9, "--wind", "225/7")),
        ({"payload_kg": 0.5, "objective": "energy"}, ("--payload-kg", 0.5, "--objective", "energy")),
        (
            {"airframe": "m100", "reserve_fraction": 0.3, "deadline_s": 3600},
            ("--airframe", "m100", "--reserve", 0.3, "--deadline", "1h"),
        ),
    ],
)
def test_a_flown_plan_is_that_of_the_command_line(program, sydney, flight, arguments):
    told = json.loads(program.run("compose", "--source", 1, "--destination", 450, "--start-time", AT, *arguments, "--json"))
    plan = sydney.compose(1, 450, flight=skyway.Flight(start_time=AT, **flight))
    assert without_effort(plan.document()) == without_effort(told)
    assert plan.outcome == "composed" and plan.energy_wh > 0.0
    assert plan.nodes[0] == 1 and plan.nodes[-1] == 450


def test_a_long_delivery_stops_to_charge(program):
    corridor = skyway.Network.bundled("corridor")
    plan = corridor.compose(1, 280, flight=skyway.Flight(start_time=AT, deadline_s=14 * 3600, payload_kg=0.25, wind=(225, 7)))
    asked = ("compose", "--network", "corridor", "--source", 1, "--destination", 280, "--payload-kg", 0.25, "--wind", "225/7")
    told = json.loads(program.run(*asked, "--deadline", "14h", "--start-time", AT, "--json"))
    assert [stop["node"] for stop in plan.stops] == [int(stop["node"]) for stop in told["stops"]]
    assert plan.stops


def test_a_plan_by_distance_is_that_of_the_command_line(program, sydney):
    told = json.loads(program.run("compose", "--source", 1, "--destination", 450, "--close", 353, "--json"))
    plan = sydney.compose(1, 450, close=[353])
    assert [str(node) for node in plan.nodes] == told["path"]["nodes"]
    assert (plan.length_m, plan.duration_s) == (told["length_m"], told["flight_time_s"])
    assert plan.document()["legs"] == told["legs"]
    assert len(plan.to_frame()) == len(plan.segments)


def test_a_drone_in_flight_is_told_what_the_command_line_tells(program, sydney):
    asked = ("reroute", "--service", "379,406", "--destination", 450, "--battery", 0.4, "--start-time", AT, "--json")
    told = json.loads(program.run(*asked))
    answer = sydney.recompose((379, 406), 450, flight=skyway.Flight(battery_fraction=0.4, start_time=AT))
    assert answer.outcome == told["outcome"]
    assert [str(node) for node in answer.nodes] == told["plan"]["path"]["nodes"]
    assert answer.battery_at_arrival_fraction == told["plan"]["battery_at_arrival_fraction"]


def test_stops_are_served_in_order(sydney):
    plan = sydney.compose(1, 1, flight=skyway.Flight(start_time=AT), stops=[(9, 90), (14, 60)])
    assert plan.nodes.index(9) < plan.nodes.index(14)


def test_certificates_hold_for_the_program_and_for_the_package(program, sydney, tmp_path):
    proofs = {
        "exact.json": sydney.recompose((379, 406), 450).certificate(),
        "closed.json": sydney.recompose((379, 406), 450, close=[353]).certificate(),
        "plan.json": sydney.compose(1, 450, flight=skyway.Flight(start_time=AT)).certificate(),
    }
    for name, text in proofs.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
        program.run("verify", tmp_path / name)
        assert sydney.verify(text).holds, name
    shorter = json.loads(proofs["exact.json"])
    shorter["length_m"] = 1.0
    assert not sydney.verify(json.dumps(shorter)).holds
    with pytest.raises(skyway.RequestError) as refused:
        sydney.recompose((379, 406), 450, strategy="radius").certificate()
    assert refused.value.code == "no_proof" and "exact" in refused.value.hint


def test_everything_has_a_map(sydney):
    answer = sydney.recompose((379, 406), 450, strategy="two_phased", explain=True)
    flown = sydney.compose(1, 450, flight=skyway.Flight(start_time=AT))
    pictures = [sydney.map(), sydney.map(answer), sydney.map(flown), answer.map(title="detour")]
    for picture in pictures:
        xml.etree.ElementTree.fromstring(picture._repr_svg_())
        assert picture.svg in picture._repr_html_()
    assert len({picture.svg for picture in pictures}) == len(pictures)
    assert "detour" in pictures[-1].svg
