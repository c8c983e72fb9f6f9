"""The situations of docs/safe-answers.md, which were worked out by hand: the judge has to find each answer right."""

import json
import pathlib
import re

import bent
from geometry import distance
from reports import Report
from rules import judge
from world import Network

PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs/safe-answers.md"
ROUNDED_M = 0.01
BLOCK = re.compile(r"^### ([^\n]+)\n(?:(?!^### ).)*?```json\n(.*?)\n```", re.MULTILINE | re.DOTALL)


def told_right() -> int:
    """Prints what the judge finds wrong in the answers of the page, and gives how many situations there are, or -1."""
    found = 0
    blocks = BLOCK.findall(PAGE.read_text())
    for title, text in blocks:
        situation = json.loads(text)
        scene = world_of(situation)
        report = report_of(situation, scene.network)
        faults, _ = judge(scene, report, whole(situation["answer"], report, scene.network))
        for fault in faults:
            found += 1
            print(f"FAILED: docs/safe-answers.md, {title}: {fault}")
    return -1 if found else len(blocks)


def world_of(situation: dict):
    zones = []
    for zone in situation.get("zones", []):
        windows = [(-60.0, 60.0 * zone["minutes"])] if "minutes" in zone else []
        zones.append(bent.round_zone(zone["id"], *zone["center"], zone["radius_m"], windows))
    scene = bent.world(*zones)
    gone = set(situation.get("without", []))
    roofs = scene.network
    left = [segment for segment in roofs.segments if segment.id not in gone]
    scene.network = Network(roofs.plane, list(roofs.nodes.values()), left, False)
    return scene


def report_of(situation: dict, network: Network) -> Report:
    body = situation["report"]
    place, where = None, body.get("location")
    leg = (body["service"]["from"], body["service"]["to"])
    stands = where.get("node") if where else None
    if stands:
        place = network.nodes[stands].at
    elif where and distance((where["x"], where["y"]), network.nodes[leg[0]].at) < 10_000.0:
        place = (where["x"], where["y"])
    facts = {"detail": body.get("detail"), "airborne": body.get("airborne"), "stands_at": stands}
    facts["airspeed_mps"] = body.get("drone", {}).get("airspeed_mps")
    return Report({}, "by hand", leg, body["destination"], body["type"], place=place, **facts)


def whole(told: dict, report: Report, network: Network) -> dict:
    """The page tells what matters; the rest is put in."""
    nodes = "".join(told["path"]["nodes"])
    stretch = told.get("first_stretch")
    if nodes:
        stretch = stretch or {"kind": "none" if told["first_stretch_m"] == 0.0 else "leg"}
        stretch |= {"length_m": told["first_stretch_m"], "enters": nodes[0]} if "first_stretch_m" in told else {}
        if stretch["kind"] == "leg":
            along = report_fraction(report, network)
            stretch = {"from": report.leg[0], "to": report.leg[1], "fraction": along} | stretch
            segment = network.by_ends.get(report.leg)
            stretch |= {"segment": segment.id} if segment else {}
        else:
            stretch |= {"length_m": 0.0, "enters": nodes[0]}
        stretch["geometry"] = []
    full = bent.answer(told["outcome"], nodes, stretch, told.get("flags", []))
    for key, value in told.items():
        # Lengths on the page are rounded to centimetres.
        rounded = isinstance(value, float) and abs(value - (full.get(key) or 0.0)) < ROUNDED_M
        if key not in ("first_stretch", "path") and not rounded:
            full[key] = value
    return full


def report_fraction(report: Report, network: Network) -> float:
    one, other = (network.nodes[node].at for node in report.leg)
    return distance(report.place, one) / distance(one, other) if report.place else 1.0
