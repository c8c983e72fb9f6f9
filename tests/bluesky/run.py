#!/usr/bin/env python3
"""BlueSky flies 25 drones against an edge of its own, and its log is judged; then the judge has to find planted faults.

run.py SKYWAY [--seed 1] [--keep FOLDER]    where SKYWAY is the program; with the packages of clients/bluesky/requirements.txt
"""

import argparse
import copy
import math
import pathlib
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/line"), str(ROOT / "clients/bluesky")]
import judge  # noqa: E402  (of clients/bluesky)
from edge import Edge  # noqa: E402  (of tests/line)

STARTS = "2026-11-27T18:00:00Z"
FLIGHT_S = 240
# What a flight has to have in it, so that its verdict says something.
LEAST = {"zones": 10, "obstacles": 1, "versions told": 20, "taken over": 20, "delivered": 15, "diverted": 1}


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("skyway", type=pathlib.Path)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--keep", type=pathlib.Path, help="where the log and the record are left")
    given = arguments.parse_args()
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="skyway-bluesky-") as scratch:
        folder = given.keep or pathlib.Path(scratch) / "flight"
        with Edge(given.skyway, pathlib.Path(scratch), "--clock=external", f"--clock-start={STARTS}", "--set=flight.airframe=m100") as edge:
            command = [sys.executable, "-B", str(ROOT / "clients/bluesky/fly.py"), edge.address, str(folder), f"--seed={given.seed}"]
            subprocess.run(command, check=True, timeout=FLIGHT_S)
            log = (pathlib.Path(scratch) / "edge.log").read_text(errors="replace")
            refused = [line for line in log.splitlines() if "did not let an answer pass" in line]
        flight = judge.Flight(*judge.read(folder, judge.NETWORK))
    verdict = judge.judge(flight)
    faults = [f"{rule}: {text}" for rule, text in verdict.faults] + refused
    faults += [f"coverage: {verdict.counts.get(what, 0)} {what}, fewer than {least}"
               for what, least in LEAST.items() if verdict.counts.get(what, 0) < least]
    faults += [f"refused: {line}" for line in flight.of("refused")]
    print(", ".join(f"{count} {what}" for what, count in verdict.counts.items()), flush=True)
    if not verdict.faults:
        faults += self_test(flight)
    for fault in faults:
        print(f"FAILED: {fault}")
    print(f"BlueSky, seed {given.seed}: {len(faults)} faults, {time.monotonic() - began:.0f} s")
    return 1 if faults else 0


def self_test(flight: judge.Flight) -> list[str]:
    """The judge finds each planted fault by its rule, in what it has passed."""
    missed = []
    for plant in (through_a_zone, silent, another_way, stopped_early, called_delivered, never_landed):
        bent = copy.deepcopy(flight)
        rule, drone = plant(bent)
        found = [text for broken, text in judge.judge(bent).faults if broken == rule and drone in text]
        what = plant.__name__.replace("_", " ")
        if found:
            print(f"  planted, {what}: {found[0]}")
        else:
            missed.append(f"self-test: {what}: the judge finds nothing of {drone} by its rule '{rule}'")
    return missed


def through_a_zone(flight: judge.Flight) -> tuple[str, str]:
    """The track of a drone that kept out of a zone is shifted over the middle of it."""
    for zone in flight.of("zone"):
        x, y = flight.metres(zone["lon"], zone["lat"])
        for drone in zone["met"]:
            track = flight.tracks.get(drone, [])
            later = [row for row in track if zone["t"] + 20 <= row.t < zone["t"] + 60 and row.speed_mps > 5]
            there = [row for row in track if row.t <= zone["t"]]
            if later and there and math.dist((there[-1].x, there[-1].y), (x, y)) > zone["radius_m"] + 70:
                east, north = x - later[len(later) // 2].x, y - later[len(later) // 2].y
                for row in later:
                    row.x, row.y = row.x + east, row.y + north
                return "zone", drone
    return "zone", "any drone that a zone met early enough"


def silent(flight: judge.Flight) -> tuple[str, str]:
    """A drone ignores a version: it says nothing, and flies on as before."""
    drone, line = taken(flight)
    flight.said.remove(line)
    return "answer", drone


def another_way(flight: judge.Flight) -> tuple[str, str]:
    """A drone says that it took a version over, and flies elsewhere."""
    drone, line = taken(flight)
    for row in flight.tracks[drone]:
        if row.t > line["t"] + judge.WAY_AFTER_S:
            row.y += judge.WAY_M + 5.0
    return "way", drone


def stopped_early(flight: judge.Flight) -> tuple[str, str]:
    """The track of a drone ends some seconds before its landing."""
    drone = flight.of("landed", ended_as="delivered")[0]["drone"]
    del flight.tracks[drone][-60:]
    return "end", drone


def called_delivered(flight: judge.Flight) -> tuple[str, str]:
    """One that was diverted counts as delivered."""
    line = flight.of("landed", ended_as="diverted")[0]
    line["ended_as"] = "delivered"
    return "end", line["drone"]


def never_landed(flight: judge.Flight) -> tuple[str, str]:
    """A drone does not land."""
    line = flight.of("landed")[0]
    flight.said.remove(line)
    return "end", line["drone"]


def taken(flight: judge.Flight) -> tuple[str, dict]:
    """A drone that flew a version for long before and after what it was told, and where it said so."""
    for line in flight.of("said", what="acknowledge"):
        later = [row for row in flight.tracks.get(line["drone"], []) if row.t > line["t"] + judge.WAY_AFTER_S]
        told = flight.of("told", drone=line["drone"], what="version", version=line["version"])
        others = [other for other in flight.of("told", drone=line["drone"], what="version") if other["t"] > line["t"]]
        if len(later) > 100 and told and not others:
            return line["drone"], line
    raise SystemExit("FAILED: nobody has taken a version over early enough for the self-test")


if __name__ == "__main__":
    sys.exit(main())
