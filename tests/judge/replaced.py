"""Networks that change under drones: a registry gets one without legs that are flown, and the edge follows it."""

import json
import pathlib
import random
import tempfile
import time

from geometry import along
from reports import Report
from talk import Edge, Rest, registry
from world import NOW_S, Network, Wind, World, make_network, text_of

WAIT_S, POLL_S = 30.0, 0.05
PLACES = (0.0, 0.1, 0.5, 0.9)


def judge_replaced(binary: pathlib.Path, seed: int, number: int, hold_against) -> int:
    """Reports of drones whose leg the new network does not have. Gives how many."""
    dice = random.Random(f"{seed}.{number}.replaced")
    network = make_network(dice, 1200.0)
    asked = 0
    with tempfile.TemporaryDirectory(prefix="skyway-judge-") as folder:
        with registry(binary, pathlib.Path(folder)) as central:
            log = Rest(central.url)
            put(log, network, None)
            settings = {"registry.url": central.url, "registry.network": "judged", "registry.poll_wait": "1s"}
            with Edge(binary, None, False, None, settings) as edge:
                wait_for(edge, log)
                flown = plan(edge, dice, network)
                less = without(network, set(flown))
                put(log, less, version(log))
                wait_for(edge, log)
                world = World(less, [], [], Wind(), False)
                reports = [report for leg, goal in flown.items() for report in on_gone(dice, less, leg, goal)]
                for report, answer in zip(reports, edge.batch([report.body for report in reports])):
                    hold_against(world, report, answer, f"{seed}.{number}")
                    asked += 1
    return asked


def put(log: Rest, network: Network, tag: str | None) -> None:
    headers = {"content-type": "application/geo+json"} | ({"if-match": tag} if tag else {"if-none-match": "*"})
    answer = log.call("PUT", "/v1/networks/judged", json.dumps(network.document()), headers)
    if answer.code is not None:
        raise RuntimeError(f"the registry refuses the network: {answer.told()}")


def version(log: Rest) -> str:
    """The `ETag` of the network, which is the registry's epoch and revision."""
    return log.call("GET", "/v1/networks/judged").headers["etag"]


def wait_for(edge: Edge, log: Rest) -> None:
    """Until the edge has the network that the registry has."""
    wanted = version(log).strip('"')
    give_up = time.monotonic() + WAIT_S
    while time.monotonic() < give_up:
        answer = edge.rest.call("GET", "/v1/closures")
        if answer.code is None and answer.body["registry_revision"] == wanted:
            return
        time.sleep(POLL_S)
    raise RuntimeError(f"the edge does not have the network {wanted} after {WAIT_S} s:\n{edge.log()}")


def plan(edge: Edge, dice: random.Random, network: Network) -> dict[tuple[str, str], str]:
    """Plans of some drones: the leg that each flies first, and where it goes."""
    flown = {}
    for number in range(8):
        source, goal = dice.sample(sorted(network.nodes), 2)
        body = {"id": f"p{number}", "source": source, "destination": goal, "drone_id": f"drone:{number}"}
        answer = edge.rest.call("POST", "/v1/plans", body)
        if answer.code is None:
            version = answer.body.get("current") or answer.body.get("wanted") or answer.body.get("reported")
            nodes = [str(node) for node in version["path"]["nodes"]]
            flown[nodes[0], nodes[1]] = goal
    return flown


def without(network: Network, legs: set[tuple[str, str]]) -> Network:
    gone = {network.by_ends[leg].id for leg in legs}
    left = [segment for segment in network.segments if segment.id not in gone]
    return Network(network.plane, list(network.nodes.values()), left, network.numbered)


def on_gone(dice: random.Random, network: Network, leg: tuple[str, str], goal: str) -> list[Report]:
    reports = []
    for fraction in PLACES:
        failure = dice.choice(["environmental", "navigational", "infrastructure", "service_level"])
        report = Report({}, "removed", leg, goal, failure, airborne=True)
        report.pads_node = leg[1] if failure == "infrastructure" else None
        one, other = (network.nodes[node].at for node in leg)
        report.place = along(one, other, fraction)
        body = report.body
        body |= {"type": failure, "service": {"from": leg[0], "to": leg[1]}, "destination": goal, "dry_run": True}
        body |= {"airborne": True, "timestamp": text_of(NOW_S)}
        body["location"] = network.place_on_wire(report.place)
        if fraction == 0.0:
            report.stands_at = leg[0]
            body["location"] = {"node": leg[0]}
        reports.append(report)
    return reports
