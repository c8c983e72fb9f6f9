#!/usr/bin/env python3
"""Judges a flight by BlueSky's own log: judge.py FOLDER [--network FILE]

It shares no code with the edge, nor with the gateway and the flyer. FOLDER is what fly.py wrote: where everybody was, by
BlueSky, and what was said. It ends with 1 where a rule is broken.

zone       Nobody who could stop enters an active zone. To stop takes v * 2 s + v² / 7, from where BlueSky has the drone when
           the zone is posted; the same holds of an obstacle that a drone has reported ahead of itself.
answer     Every version that a drone was told it took over or declined within two seconds, unless a newer one came.
way        Who took a version over flies along it, 10 s later at the latest.
end        Everybody lands at the destination, or at the end of a version that diverts it there.
"""

import argparse
import json
import math
import pathlib
import sys

NETWORK = pathlib.Path(__file__).resolve().parents[2] / "data/sydney-cbd.geojson"
EARTH_M = 6_371_008.8
REACTION_S, BRAKING_MPS2 = 2.0, 3.5
OBSTACLE_M = 2.0
ANSWER_S = 2.0
WAY_M, WAY_AFTER_S = 15.0, 10.0
LANDED_M = 5.0
SHOWN = 20


class Row:
    """Where BlueSky had a drone at one moment, in metres around the first row of the log."""

    __slots__ = ("t", "x", "y", "height_m", "speed_mps")

    def __init__(self, t: float, x: float, y: float, height_m: float, speed_mps: float) -> None:
        self.t, self.x, self.y, self.height_m, self.speed_mps = t, x, y, height_m, speed_mps


class Flight:
    """The log, the record and the nodes of the network."""

    def __init__(self, log: str, record: str, network: str) -> None:
        self.said = [json.loads(line) for line in record.splitlines()]
        rows = [line.split(",") for line in log.splitlines() if line and not line.startswith("#")]
        self.origin = (float(rows[0][3]), float(rows[0][2]))
        self.tracks: dict[str, list[Row]] = {}
        for t, drone, lat, lon, height_m, speed_mps in rows:
            x, y = self.metres(float(lon), float(lat))
            self.tracks.setdefault(drone, []).append(Row(float(t), x, y, float(height_m), float(speed_mps)))
        features = json.loads(network)["features"]
        nodes = [feature for feature in features if feature["properties"]["kind"] == "node"]
        self.nodes = {str(node["id"]): self.metres(*node["geometry"]["coordinates"][:2]) for node in nodes}

    def metres(self, lon: float, lat: float) -> tuple[float, float]:
        """East and north of the origin."""
        east = math.radians(lon - self.origin[0]) * EARTH_M * math.cos(math.radians(self.origin[1]))
        return east, math.radians(lat - self.origin[1]) * EARTH_M

    def of(self, kind: str, **wanted) -> list[dict]:
        """What was said of a kind."""
        return [line for line in self.said if line["kind"] == kind and all(line[name] == value for name, value in wanted.items())]


class Verdict:
    """Faults, and what was looked at."""

    def __init__(self) -> None:
        self.faults: list[tuple[str, str]] = []
        self.counts: dict[str, int] = {}

    def fault(self, rule: str, text: str) -> None:
        self.faults.append((rule, text))

    def count(self, what: str, by: int = 1) -> None:
        self.counts[what] = self.counts.get(what, 0) + by


def judge(flight: Flight) -> Verdict:
    """All rules."""
    verdict = Verdict()
    lifted = {line["id"]: line["t"] for line in flight.of("lifted")}
    for zone in flight.of("zone"):
        verdict.count("zones")
        until = lifted.get(zone["id"], math.inf)
        for drone, track in flight.tracks.items():
            keeps_out(flight, verdict, (zone["id"], drone), track, zone, (zone["radius_m"], until))
    for obstacle in flight.of("obstacle"):
        verdict.count("obstacles")
        drone = obstacle["drone"]
        taken = [line["t"] for line in flight.of("said", drone=drone, what="acknowledge") if line["t"] >= obstacle["t"]]
        # Once it flies another way the place may be passed on that.
        keeps_out(flight, verdict, ("its obstacle", drone), flight.tracks[drone], obstacle, (OBSTACLE_M, min(taken, default=0) + 30.0))
    for plan in flight.of("plan"):
        answers(flight, verdict, plan["drone"])
        flies_its_way(flight, verdict, plan["drone"])
        lands(flight, verdict, plan)
    return verdict


def keeps_out(flight: Flight, verdict: Verdict, names: tuple[str, str], track: list[Row], round_one: dict, size) -> None:
    """A drone enters a circle only if it could not stop when that was closed."""
    radius_m, until = size
    x, y = flight.metres(round_one["lon"], round_one["lat"])
    during = [row for row in track if round_one["t"] <= row.t < until]
    off_m = [math.hypot(row.x - x, row.y - y) - radius_m for row in during]
    if "height_m" in round_one:
        # An obstacle has a height; other ways may lead over it.
        off_m = [max(off, abs(row.height_m - round_one["height_m"]) - OBSTACLE_M) for off, row in zip(off_m, during)]
    entries = [number for number in range(1, len(off_m)) if off_m[number] <= 0 < off_m[number - 1]]
    if off_m and off_m[0] <= 0 and during[0].t > round_one["t"] + 0.5:
        verdict.fault("zone", f"{names[1]} departs inside {names[0]} at {during[0].t:.1f} s")
    if not entries:
        return
    first = during[0]
    stops_m = first.speed_mps * REACTION_S + first.speed_mps**2 / (2 * BRAKING_MPS2)
    was_there = first.t <= round_one["t"] + 0.5
    if len(entries) == 1 and was_there and off_m[0] <= stops_m:
        # One that was inside already may brake beyond the edge before it flies out by the other side.
        verdict.count("entered, could not stop")
        return
    verdict.fault("zone", f"{names[1]} enters {names[0]} at {during[entries[0]].t:.1f} s, {max(-min(off_m), 0):.1f} m deep; when "
                  f"that was closed it was {off_m[0]:.0f} m away and stops within {stops_m:.0f} m")


def answers(flight: Flight, verdict: Verdict, drone: str) -> None:
    """Each version told is answered."""
    told = flight.of("told", drone=drone, what="version")
    said = flight.of("said", drone=drone)
    ended = flight.of("landed", drone=drone)
    for number, message in enumerate(told):
        verdict.count("versions told")
        for flag in message["flags"]:
            verdict.count(f"flagged {flag}")
        until = message["t"] + ANSWER_S
        answered = any(line["version"] == message["version"] and line["t"] <= until for line in said)
        overtaken = number + 1 < len(told) and told[number + 1]["t"] <= until
        landed = any(line["t"] <= until for line in ended)
        if not answered and not overtaken and not landed:
            verdict.fault("answer", f"{drone} neither took version {message['version']} over nor declined it, told at {message['t']} s")
    for line in said:
        verdict.count("taken over" if line["what"] == "acknowledge" else "declined")


def flies_its_way(flight: Flight, verdict: Verdict, drone: str) -> None:
    """Who took a version over flies along it."""
    ways = {line["version"]: line["way"] for line in flight.of("told", drone=drone) if line["version"]}
    taken = flight.of("said", drone=drone, what="acknowledge")
    for number, line in enumerate(taken):
        way = [flight.metres(*point) for point in ways[line["version"]]]
        until = taken[number + 1]["t"] if number + 1 < len(taken) else math.inf
        during = [row for row in flight.tracks.get(drone, []) if line["t"] + WAY_AFTER_S <= row.t < until]
        if not way:
            continue
        offs_m = [(off_line_m((row.x, row.y), way), row.t) for row in during]
        verdict.count("places on ways", len(offs_m))
        worst_m, at_s = max(offs_m, default=(0.0, 0.0))
        if worst_m > WAY_M:
            verdict.fault("way", f"{drone} is {worst_m:.0f} m off version {line['version']} at {at_s:.1f} s, which it took over at {line['t']} s")


def lands(flight: Flight, verdict: Verdict, plan: dict) -> None:
    """It lands at its destination, or where a version has diverted it to."""
    drone = plan["drone"]
    ended = flight.of("landed", drone=drone)
    if not ended:
        verdict.fault("end", f"{drone} has not landed")
        return
    versions = {line["version"]: line for line in flight.of("told", drone=drone) if line["version"]}
    taken = flight.of("said", drone=drone, what="acknowledge")
    flown = versions[taken[-1]["version"]] if taken else None
    node = flown["nodes"][-1] if flown and flown["nodes"] else plan["destination"]
    verdict.count(ended[0]["ended_as"])
    # Who has never departed stands where it was.
    last = flight.tracks.get(drone, [])[-1:]
    place = (last[0].x, last[0].y) if last else flight.nodes[plan["source"]]
    off_m = math.dist(place, flight.nodes[node])
    if off_m > LANDED_M:
        verdict.fault("end", f"{drone} has stopped {off_m:.0f} m from node {node}")
    if node != plan["destination"] and flown["outcome"] != "diverted":
        verdict.fault("end", f"{drone} has landed at {node}, not at {plan['destination']}, and nobody has diverted it")
    if (ended[0]["ended_as"] == "delivered") != (node == plan["destination"]):
        verdict.fault("end", f"{drone} has landed at {node} for {plan['destination']}, and the edge calls that {ended[0]['ended_as']}")


def off_line_m(place: tuple[float, float], line: list[tuple[float, float]]) -> float:
    """How far a place is from a line of several pieces."""
    least_m = math.dist(place, line[0])
    for (x, y), (end_x, end_y) in zip(line, line[1:]):
        east, north = end_x - x, end_y - y
        length_2 = east**2 + north**2
        share = ((place[0] - x) * east + (place[1] - y) * north) / length_2 if length_2 > 0 else 0.0
        share = min(max(share, 0.0), 1.0)
        least_m = min(least_m, math.dist(place, (x + share * east, y + share * north)))
    return least_m


def read(folder: pathlib.Path, network: pathlib.Path) -> tuple[str, str, str]:
    """The log, the record and the network, as text."""
    logs = sorted(folder.glob("output/TRACK_*.log"))
    if len(logs) != 1:
        raise SystemExit(f"{folder}/output has {len(logs)} logs of TRACK, and not one")
    return logs[0].read_text(), (folder / "record.ndjson").read_text(), network.read_text()


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=pathlib.Path)
    arguments.add_argument("--network", type=pathlib.Path, default=NETWORK)
    given = arguments.parse_args()
    verdict = judge(Flight(*read(given.folder, given.network)))
    for rule, text in verdict.faults[:SHOWN]:
        print(f"FAILED: {rule}: {text}")
    print(", ".join(f"{count} {what}" for what, count in verdict.counts.items()))
    print(f"{len(verdict.faults)} faults")
    return 1 if verdict.faults else 0


if __name__ == "__main__":
    sys.exit(main())
