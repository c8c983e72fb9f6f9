"""Events go on after a cut: none is missed and none is told twice."""

import asyncio
import itertools

import pytest
import skyway
from fake_server import FakeServer, event, hang_up, say, stream
from skyway.events import Stream

AT_ONCE = ": skyway\nretry: 1\n"
BUSY = {"code": "overloaded", "status": 503, "detail": "busy"}


def listen(url, count, **arguments):
    with skyway.Client(url) as client:
        return list(itertools.islice(client.events(**arguments), count))


def listen_in_coroutines(url, count, **arguments):
    async def collect():
        found = []
        async with skyway.AsyncClient(url) as client:
            async for one in client.events(**arguments):
                found.append(one)
                if len(found) == count:
                    break
        return found

    return asyncio.run(collect())


@pytest.mark.parametrize("ask", [listen, listen_in_coroutines])
def test_events_resume_after_every_kind_of_cut(ask):
    half_an_event = 'id: e-4\nevent: zone_put\ndata: {"id": "e-4", '
    steps = [
        stream(f"{AT_ONCE}id: e-0\n\n{event(1)}{event(2)}"),
        hang_up,
        stream(f"{AT_ONCE}id: e-2\n\n{event(3)}: still here\n\n{half_an_event}"),
        say(503, BUSY),
        stream(f"{AT_ONCE}id: e-3\n\n{event(4)}{event(5, 'plan_ended')}"),
    ]
    with FakeServer(steps) as server:
        found = ask(server.url, 5)
    assert [one.id for one in found] == ["e-1", "e-2", "e-3", "e-4", "e-5"]
    assert [one.data["number"] for one in found] == [1, 2, 3, 4, 5]
    assert (found[4].kind, found[4].at) == ("plan_ended", "2026-11-25T10:00:00Z")
    asked = [one["headers"].get("last-event-id") for one in server.asked]
    assert asked == [None, "e-2", "e-2", "e-3", "e-3"]


def test_the_first_id_counts_before_any_event_has_come():
    with FakeServer([stream(f"{AT_ONCE}id: e-7\n\n"), stream(f"{AT_ONCE}{event(8)}")]) as server:
        assert [one.id for one in listen(server.url, 1)] == ["e-8"]
    assert [one["headers"].get("last-event-id") for one in server.asked] == [None, "e-7"]


def test_a_listener_begins_after_an_event():
    with FakeServer([stream(f"{AT_ONCE}{event(8)}")]) as server:
        listen(server.url, 1, after="e-7")
    assert server.asked[0]["headers"]["last-event-id"] == "e-7"


@pytest.mark.parametrize("ask", [listen, listen_in_coroutines])
def test_events_that_are_gone_end_the_stream(ask):
    gone = {"code": "events_gone", "status": 410, "detail": "too old"}
    last_words = 'event: gone\ndata: {"code": "events_gone", "status": 410, "detail": "too slow"}\n\n'
    for steps in ([say(410, gone)], [stream(f"{AT_ONCE}{event(1)}{last_words}")]):
        with FakeServer(steps) as server, pytest.raises(skyway.Problem) as problem:
            ask(server.url, 9)
        assert (problem.value.code, problem.value.status) == ("events_gone", 410)


@pytest.mark.parametrize("ask", [listen, listen_in_coroutines])
def test_a_server_that_stays_away_is_given_up(ask):
    with (
        FakeServer([stream(f"{AT_ONCE}{event(1)}")] + [hang_up] * 50) as server,
        pytest.raises(skyway.ConnectionBroken) as broken,
    ):
        ask(server.url, 9, give_up_after_s=0.05)
    assert broken.value.code == "no_answer" and broken.value.place == server.url


def test_a_server_may_stay_away_for_days():
    patient = Stream(after=None, give_up_after_s=None)
    pauses_s = [patient.pause_s() for _ in range(2000)]
    assert pauses_s[:3] == [2.0, 4.0, 8.0]
    assert max(pauses_s) == pauses_s[-1] == 30.0


def test_data_in_several_lines_is_one_text():
    text = 'id: e-1\nevent: note\ndata: {"data":\ndata: {"number": 3}}\n\n'
    with FakeServer([stream(AT_ONCE + text)]) as server:
        assert listen(server.url, 1)[0].data == {"number": 3}


def test_a_text_may_hold_any_character():
    strange = "\u2028\x85\x0b rüstig 🛸"
    text = f'id: e-1\nevent: note\ndata: {{"data": {{"text": "{strange}"}}}}\n\n'.replace("\x0b", "\\u000b")
    with FakeServer([stream(AT_ONCE + text)]) as server:
        assert listen(server.url, 1)[0].data == {"text": strange}
