"""The clients: what they send, what refusals become, and a real edge."""

import asyncio
import contextlib
import json
import subprocess

import geopandas as gpd
import pytest
import shapely
import skyway
from fake_server import FakeServer, say

REFUSED = {
    "code": "body_invalid",
    "status": 400,
    "detail": "the field 'destnation' is not known",
    "errors": [
        {"code": "unknown_field", "pointer": "/destnation", "message": "not known", "hint": "did you mean 'destination'?"}
    ],
}


def square(lon, lat, side_deg=0.001):
    return shapely.box(lon, lat, lon + side_deg, lat + side_deg)


@pytest.fixture
def frame():
    rows = {"id": ["crane", "parade"], "reason": ["crane", None]}
    return gpd.GeoDataFrame(rows, geometry=[square(151.207, -33.865), square(151.21, -33.863)], crs=4326)


def test_a_refusal_has_code_place_and_hint():
    async def ask(url):
        async with skyway.AsyncClient(url) as client:
            await client.compose(1, 450, drone_id="drone-7")

    with FakeServer([say(400, REFUSED)] * 2) as server:
        with skyway.Client(server.url) as client, pytest.raises(skyway.Problem) as refused:
            client.compose(1, 450, drone_id="drone-7")
        with pytest.raises(skyway.Problem) as refused_too:
            asyncio.run(ask(server.url))
    for problem in (refused.value, refused_too.value):
        assert (problem.status, problem.code, problem.place) == (400, "body_invalid", "/destnation")
        assert problem.hint == "did you mean 'destination'?" and problem.hint in str(problem)
        assert problem.errors == REFUSED["errors"]


def test_a_refusal_that_is_no_problem_document_is_one_all_the_same():
    steps = [say(502, "<html>bad gateway</html>", retry_after="7")]
    with FakeServer(steps) as server, skyway.Client(server.url) as client, pytest.raises(skyway.Problem) as refused:
        client.clock()
    assert (refused.value.code, refused.value.retry_after_s) == ("http_502", 7.0)
    assert "bad gateway" in refused.value.message


def test_no_answer_is_told_as_such():
    with FakeServer([]) as server:
        url = server.url
    with skyway.Client(url) as client, pytest.raises(skyway.ConnectionBroken) as broken:
        client.clock()
    assert broken.value.place == url and "skyway.demo()" in broken.value.hint


def test_requests_carry_token_key_and_body(frame):
    with FakeServer([say(200, {})] * 4) as server, skyway.Client(server.url, token="secret") as client:
        client.report_failure((379, 406), 450, failure="regulatory", dry_run=True, key="k-1")
        client.compose(1, 450, drone_id="drone-7", battery_fraction=0.9)
        client.post_zone(frame.iloc[:1])
        client.import_zones(frame, feed="city")
    reported, composed, posted, imported = server.asked
    assert all(one["headers"]["authorization"] == "Bearer secret" for one in server.asked)
    assert reported["headers"]["idempotency-key"] == "k-1"
    assert json.loads(reported["body"]) == {
        "service": {"from": 379, "to": 406},
        "destination": 450,
        "type": "regulatory",
        "dry_run": True,
    }
    assert json.loads(composed["body"]) == {"source": 1, "destination": 450, "drone_id": "drone-7", "battery_fraction": 0.9}
    assert len(composed["headers"]["idempotency-key"]) == 36
    zone = json.loads(posted["body"])
    assert (zone["id"], zone["properties"], zone["geometry"]["type"]) == ("crane", {"reason": "crane"}, "Polygon")
    assert posted["headers"]["content-type"] == "application/geo+json"
    assert imported["path"] == "/v1/zones:import?feed=city"
    assert [one["id"] for one in json.loads(imported["body"])["features"]] == ["crane", "parade"]
    assert json.loads(imported["body"])["features"][1]["properties"] == {}


def test_a_table_of_several_zones_is_not_posted_as_one(frame):
    with skyway.Client("http://127.0.0.1:9") as client, pytest.raises(skyway.RequestError) as refused:
        client.post_zone(frame)
    assert refused.value.code == "not_one_zone" and "import_zones" in refused.value.hint


def test_lists_are_read_page_by_page():
    pages = [{"plans": [{"id": "a"}], "next_page_token": "t"}, {"plans": [{"id": "b"}]}]
    with FakeServer([say(200, page) for page in pages]) as server, skyway.Client(server.url) as client:
        assert [plan["id"] for plan in client.plans(state="activated")] == ["a", "b"]
    assert [one["path"] for one in server.asked] == ["/v1/plans?state=activated", "/v1/plans?state=activated&page_token=t"]


@pytest.fixture(scope="module")
def edge(program):
    with skyway.demo(drones=2, for_s=300) as running:
        yield running


def test_an_edge_is_asked_for_all_of_it(edge, sydney, frame):
    with edge.client() as client:
        network = client.network()
        assert network.sha256 == sydney.sha256
        told = client.report_failure((379, 406), 450, location={"node": "379"}, dry_run=True)
        assert [int(node) for node in told["path"]["nodes"]] and told["outcome"] == "rerouted"
        plan = client.compose(1, 450, drone_id="python-1")
        assert client.plan(plan["id"])["id"] == plan["id"]
        assert plan["id"] in {one["id"] for one in client.plans(drone_id="python-1")}
        assert client.preview_zone(frame.iloc[:1])["effect"]["segment_count"] > 0
        assert "crane" not in {zone["id"] for zone in client.zones()}, "a preview has no effect"
        posted = client.post_zone(frame.iloc[:1])
        assert posted["effect"]["in_force"] and "crane" in {zone["id"] for zone in client.zones()}
        imported = client.import_zones(frame.iloc[1:], feed="city")
        assert imported["counts"]["created"] == 1
        client.delete_zone("crane", reason="gone")
        assert "crane" not in {zone["id"] for zone in client.zones()}
        assert client.recomposition(told["id"])["id"] == told["id"]
        client.cancel_plan(plan["id"])


def test_events_of_an_edge_are_heard_by_both_clients(edge, frame):
    async def hear():
        async with skyway.AsyncClient(edge.url) as client:
            heard = asyncio.create_task(first(client, "zone_put"))
            clock = await client.clock()
            # The zone is put again until the listener, who may still be on his way, has heard of it.
            while not heard.done():
                await client.post_zone(frame.iloc[:1])
                await client.delete_zone("crane")
            return clock, await heard

    async def first(client, kind):
        async for event in client.events():
            if event.kind == kind:
                return event
        return None

    clock, event = asyncio.run(hear())
    assert clock["kind"] == "simulated"
    assert event.data["zone"]["id"] == "crane"
    with edge.client() as client:
        again = next(one for one in client.events(after=event.id) if one.kind == "zone_deleted")
        assert again.id != event.id


def test_a_drone_hears_of_a_zone_on_its_way_in_its_mailbox(edge):
    def across(leg):
        """A zone over the middle of a leg."""
        (lon, lat), (to_lon, to_lat) = leg["geometry"][0][:2], leg["geometry"][-1][:2]
        return shapely.geometry.mapping(square((lon + to_lon) / 2, (lat + to_lat) / 2, 0.0001))

    def hear(client, kind):
        return next(message for message in client.mailbox("python-9") if message.kind == kind)

    async def hear_in_coroutines():
        async with skyway.AsyncClient(edge.url) as client:
            async with contextlib.aclosing(client.mailbox("python-9")) as messages:
                async for message in messages:
                    if message.kind == "version":
                        return message

    with edge.client() as client:
        plan = client.compose(1, 450, drone_id="python-9")
        client.post_zone({"type": "Feature", "id": "fire", "properties": {}, "geometry": across(plan["reported"]["legs"][-2])})
        told = hear(client, "version")
        assert told.data["plan_id"] == plan["id"] and told.data["version"]["version"] == 2
        assert told.at == told.data["at"]
        # It was not answered, so it is there for the next listener, under the same id.
        again = asyncio.run(hear_in_coroutines())
        assert (again.id, again.data["version"]["version"]) == (told.id, 2)
        client.acknowledge(plan["id"], 2)
        client.received("python-9", told.id)
        assert client.plan(plan["id"])["reported"]["version"] == 2
        with pytest.raises(skyway.Problem) as refused:
            client.acknowledge(plan["id"], 7)
        assert refused.value.status == 409
        assert client.decline(plan["id"], 2, reason="passed")["id"] == plan["id"]
        position = {"drone_id": "python-9", "location": {"node": "1"}, "airborne": False}
        assert client.telemetry([position])["positions"][0]["accepted"]
        client.cancel_plan(plan["id"])
        client.delete_zone("fire")
        assert hear(client, "ended").data["plan_id"] == plan["id"]


def test_the_program_comes_with_the_wheel(program):
    told = program.run("--version")
    assert told.startswith("skyway ")
    assert "skyway_no_such_command" in refusal_of(program, "skyway_no_such_command")


def refusal_of(program, *arguments):
    done = subprocess.run([*program.command, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    return done.stderr


def test_the_demo_has_a_registry_and_ends(program):
    with skyway.demo(drones=1, for_s=60) as running:
        assert running.registry_url and running.registry_url != running.url
    with skyway.Client(running.url) as client, pytest.raises(skyway.ConnectionBroken):
        client.clock()
