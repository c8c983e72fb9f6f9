#!/usr/bin/env python3
"""Drones on the line, told over child processes and broken lines: run.py BINARY [STORY ...]"""

import math
import pathlib
import subprocess
import sys
import threading
import time

import grpc
from edge import ROOT, WAIT_S, Edge, Line, in_folder, plans, session, until

CRANE = (151.2076, -33.8644, 60.0)
EXAMPLE = ROOT / "clients/python/drone.py"


def off_crane_m(lon: float, lat: float) -> float:
    """How far a place is from the middle of the crane's zone."""
    east = (lon - CRANE[0]) * math.cos(math.radians(CRANE[1]))
    return math.hypot(east, lat - CRANE[1]) * 111_320.0


def example(edge: Edge, source: int, destination: int):
    """The example, flying; its lines come one by one."""
    command = [sys.executable, "-B", EXAMPLE, edge.address, str(source), str(destination)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    lines: list[str] = []

    def read() -> None:
        lines.extend(iter(process.stdout.readline, ""))

    threading.Thread(target=read, daemon=True).start()
    return process, lines


def saw(lines: list[str], words: str) -> str:
    """Waits for a line."""
    return until(lambda: next((line for line in lines if words in line), None), f"'{words}' in {lines}")


@in_folder
def the_example_flies_around_a_zone_that_is_posted_on_its_way(binary, folder):
    edge = Edge(binary, folder, "--clock-rate=10").start()
    process, lines = example(edge, 1, 450)
    saw(lines, "told contingencies")
    edge.close_over(*CRANE)
    saw(lines, "flies version 2")
    places = []
    while process.poll() is None:
        places += [drone["location"] for drone in edge.ask("GET", "/v1/drones")["drones"]]
        time.sleep(0.05)
    saw(lines, "landed: delivered")
    nearest_m = min(off_crane_m(*place) for place in places)
    assert nearest_m > CRANE[2], f"{nearest_m:.1f} m from the middle of the zone"
    assert edge.stop() == 0
    return f"{len(places)} places, none nearer than {nearest_m:.0f} m"


@in_folder
def the_example_lands_though_its_edge_is_killed_in_flight(binary, folder):
    edge = Edge(binary, folder).start()
    process, lines = example(edge, 1, 11)
    saw(lines, "told contingencies")
    time.sleep(3.0)
    edge.kill()
    saw(lines, "the line broke")
    edge.start()
    until(lambda: sum("on the line" in line for line in lines) == 2, f"back on the line: {lines}")
    process.wait(timeout=WAIT_S)
    saw(lines, "landed: delivered")
    assert edge.stop() == 0
    return f"{sum('the line broke' in line for line in lines)} broken lines"


def bare(version):
    """A version without its contingencies, which may be worked out between two times that it is told."""
    for leg in version.legs:
        leg.ClearField("if_closed")
        leg.ClearField("alternate")
    return version


@in_folder
def a_version_is_told_again_over_a_broken_line_and_a_crash_and_taken_once(binary, folder):
    edge = Edge(binary, folder).start()
    edge.plan("d1", 1, 450)
    line = Line(edge).listen()
    welcome = line.hello("d1")
    edge.close_over(*CRANE)
    first = line.version()
    line.cut()
    line = Line(edge).listen()
    line.hello("d1", ends=welcome.session_id, received=first.id)
    again = line.version()
    assert (again.id, bare(again.version)) == (first.id, bare(first.version))
    edge.kill()
    assert line.ended.wait(WAIT_S)
    edge.start()
    line = Line(edge).listen()
    line.hello("d1", received=again.id)
    after = line.version()
    assert after.id == first.id and after.version.version == first.version.version
    for number in (1, 2):
        plan = line.acknowledge(after, number)
        assert plan.reported.version == after.version.version and not plan.HasField("wanted")
    line.cut()
    line = Line(edge).listen()
    line.hello("d1", received=after.id)
    line.say(request_id=9, received=session.ReceivedRequest(drone_id="d1", through=after.id))
    left = line.next("mail_left").left
    orders = [message for message in line.messages() if message.kind == session.MESSAGE_KIND_VERSION]
    assert not orders, orders
    assert edge.stop() == 0
    return f"version {after.version.version} told three times, taken once, {left} messages left"


@in_folder
def two_gateways_claim_one_drone(binary, folder):
    edge = Edge(binary, folder).start()
    one, other = Line(edge).listen(), Line(edge).listen()
    welcome = one.hello("d1", "d2")
    refused = other.hello("d1").refused[0]
    assert refused.reason.code == "drone_on_another_session", refused
    taken = other.hello("d1", ends=welcome.session_id)
    assert list(taken.drones) == ["d1"] and taken.ended[0].session_id == welcome.session_id
    lost = one.next("ended")
    assert (lost.drone_id, lost.taken_over_by) == ("d1", taken.session_id)
    back = one.hello("d1", ends=taken.session_id).refused[0]
    assert back.reason.code == "taken_over_too_often", back
    edge.plan("d1", 1, 450)
    assert other.next("message").drone_id == "d1"
    assert edge.stop() == 0
    return "one session, both told"


@in_folder
def a_drone_declines_twice(binary, folder):
    edge = Edge(binary, folder).start()
    plan = edge.plan("d1", 1, 450)
    line = Line(edge).listen()
    line.hello("d1")
    edge.close_over(*CRANE)
    versions = []
    for number in (1, 2):
        message = line.version()
        versions.append(message.version.version)
        declined = plans.DeclinePlanRequest(id=plan["id"], version=message.version.version, reason="obstacle")
        line.say(request_id=number, decline=declined)
        line.next("plan")
    alarms = edge.ask("GET", "/v1/alarms?ended=false")["alarms"]
    assert [alarm["kind"] for alarm in alarms] == ["declined"], alarms
    assert edge.stop() == 0
    return f"versions {versions}, then an alarm"


@in_folder
def who_does_not_read_keeps_nobody_waiting(binary, folder):
    edge = Edge(binary, folder).start()
    drones = [f"d{number}" for number in range(40)]
    for number, drone in enumerate(drones):
        edge.plan(drone, 1, 450, start_time=time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(time.time() + 60 + 60 * number)))
    slow = Line(edge)
    slow.say(hello=session.Hello(drones=[session.HelloDrone(drone_id=drone) for drone in drones[:20]]))
    readers = [Line(edge).listen() for _ in drones[20:]]
    for reader, drone in zip(readers, drones[20:]):
        reader.hello(drone)
    edge.close_over(*CRANE)
    for reader in readers:
        reader.version()
    # It reads at last, and has missed nothing.
    slow.listen()
    told = {slow.version().drone_id for _ in range(20)}
    assert told == set(drones[:20]), told
    assert edge.stop() == 0
    return f"{len(readers)} readers were told meanwhile, 20 drones later"


def tokens_of(binary, folder, ends_at: str | None):
    """A file of tokens, an operator's and a drone's."""
    made = []
    for role, subject, more in (("operator", "*", []), ("drone", "d1", ["--ends-at", ends_at] if ends_at else [])):
        command = [binary, "token", "--role", role, "--subject", subject, *more]
        made.append(subprocess.run(command, capture_output=True, text=True, check=True))
    file = folder / "tokens.toml"
    file.write_text("\n".join(token.stderr for token in made))
    file.chmod(0o600)
    return file, [token.stdout.strip() for token in made]


@in_folder
def a_session_ends_with_its_token(binary, folder):
    ends_at = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(time.time() + 5))
    file, (operator, drone) = tokens_of(binary, folder, ends_at)
    edge = Edge(binary, folder, f"--tokens-file={file}").start()
    line = Line(edge, drone).listen()
    line.hello("d1")
    watcher = Line(edge, operator).listen()
    watcher.hello("d2")
    assert line.ended.wait(WAIT_S) and line.status.code() == grpc.StatusCode.UNAUTHENTICATED, line.status
    assert not watcher.ended.is_set()
    digests = [text.split('"')[1] for text in file.read_text().splitlines() if text.startswith("sha256")]
    file.write_text(file.read_text() + f'\n[[revoked]]\nsha256 = "{digests[0]}"\n')
    assert watcher.ended.wait(WAIT_S) and watcher.status.code() == grpc.StatusCode.UNAUTHENTICATED
    assert edge.stop() == 0
    return "one by its end, one revoked without a restart"


@in_folder
def a_drain_hands_a_thousand_sessions_over(binary, folder):
    edge = Edge(binary, folder).start()
    lines = [Line(edge) for _ in range(1000)]
    for number, line in enumerate(lines):
        line.say(hello=session.Hello(drones=[session.HelloDrone(drone_id=f"d{number}")]))
    until(lambda: edge.metric("skyway_drones_on_sessions") == len(lines), "a thousand drones on the line")
    began = time.monotonic()
    ended = edge.stop()
    took_s = time.monotonic() - began
    assert ended == 0, ended
    for line in lines:
        line.listen()
    for line in lines:
        assert line.ended.wait(WAIT_S) and line.status.code() == grpc.StatusCode.UNAVAILABLE, line.status
    return f"all ended as unavailable, the edge after {took_s:.1f} s"


STORIES = [
    a_version_is_told_again_over_a_broken_line_and_a_crash_and_taken_once,
    two_gateways_claim_one_drone,
    a_drone_declines_twice,
    who_does_not_read_keeps_nobody_waiting,
    a_session_ends_with_its_token,
    a_drain_hands_a_thousand_sessions_over,
    the_example_flies_around_a_zone_that_is_posted_on_its_way,
    the_example_lands_though_its_edge_is_killed_in_flight,
]


def main() -> int:
    """Tells all stories, or those that are named."""
    binary, *named = sys.argv[1:]
    for story in STORIES:
        if named and story.__name__ not in named:
            continue
        began = time.monotonic()
        told = story(pathlib.Path(binary).resolve())
        print(f"{story.__name__.replace('_', ' ')}: {told} ({time.monotonic() - began:.1f} s)", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
