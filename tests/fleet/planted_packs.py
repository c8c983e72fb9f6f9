"""A fleet of one drone whose pack is right, and packs that are bent, each to be found."""

import copy
import struct

import packs
import planted
from pack import NOTHING_16, Hop, Leg, Pack, Place, Stop, Way

STATE = 1


def place(name: str) -> Place:
    x, y = planted.PLACES[name]
    return (x * 100, y * 100)


def way(nodes: str, rejoins: int | None = None, battery: float = 0.3) -> Way:
    return Way(battery, rejoins, False, None, [Hop(place(name)) for name in nodes])


def right() -> Pack:
    """From a by b to c; around by d where a leg closes."""
    first = Leg(place("a"), place("b"), 0.4, 0.0, False, "given", "given", way("dc"), way(""))
    second = Leg(place("b"), place("c"), 0.3, 70.0, False, "given", "given", way("adc"), way(""))
    return Pack("one", 1, 1_795_773_610.0, [first, second])


def written(pack: Pack, spare_nodes: int = 0) -> bytes:
    """As docs/pack.md lays it out, without a signature that holds."""
    places = sorted(place(name) for name in planted.PLACES)
    nodes = b"".join(
        struct.pack("<I", index) + b"".join(axis.to_bytes(3, "little", signed=True) for axis in at) + b"\0\x80"
        for index, at in enumerate(places)
    ) + bytes(12 * spare_nodes)
    legs, ways = b"", b""
    for leg in pack.legs:
        offsets = []
        for found in (leg.detour, leg.alternate):
            offsets.append(len(ways) // 4)
            ways += way_bytes(found, places)
        ends = (places.index(leg.start), places.index(leg.end))
        told = (round(leg.battery * 10_000), round(leg.departs_s * 10), leg.lands_before, STATE, STATE, 0)
        legs += struct.pack("<HHBBHIBBBBHH", *ends, 0, 0, *told, *offsets)
    plan = pack.plan.encode()
    texts = plan + bytes(-(104 + len(plan)) % 4)
    length = 104 + len(texts) + len(nodes) + len(legs) + len(ways) + 64
    head = struct.pack("<4sBBBBI", b"SKPK", 1, 3, len(plan), 0, length)
    head += struct.pack("<HHHBB", len(pack.legs), len(places) + spare_nodes, len(ways) // 4, 0, 0)
    head += struct.pack("<IQQqqii", pack.version, 0, 1, 0, round(pack.departs_s * 1000), 0, 0)
    return head + bytes(40) + texts + nodes + legs + ways + bytes(64)


def way_bytes(found: Way, places: list[Place]) -> bytes:
    rejoins = NOTHING_16 if found.rejoins is None else found.rejoins
    flags = found.is_reserve_used + 2 * (found.begins_with is not None)
    told = struct.pack("<HHBBH", round(found.battery * 10_000), rejoins, len(found.hops), flags, 0)
    for hop in found.hops:
        told += struct.pack("<HBB", places.index(hop.to) | (0x8000 if hop.stop else 0), 0, 0)
        if hop.stop:
            told += struct.pack("<HHI", round(hop.stop.battery * 10_000), 0, round((hop.stop.not_before_s or 0) * 10))
    return told


def record(data: bytes, *more: dict, battery: float = 0.9, pads: dict | None = None):
    network = planted.network()
    for feature in network["network"]["features"]:
        feature["properties"] = feature["properties"] | {"pads": (pads or {}).get(feature["id"], 1)}
    for ends in ("ab", "bc", "cd", "da"):
        properties = {"kind": "segment", "from": ends[0], "to": ends[1], "length_m": 1000.0}
        network["network"]["features"].append({"type": "Feature", "properties": properties})
    legs = [planted.leg("a", "b", 10), planted.leg("b", "c", 110)]
    for leg, left in zip(legs, (battery, battery - 0.06)):
        leg["battery_before_fraction"] = left
    told = {"kind": "pack", "plan_id": "one", "at": planted.text_of(9), "bytes": data.hex()}
    run = {"kind": "run", "workload": "planted", "seed": 0}
    return planted.of([run, network, planted.version("one", legs), *more, told])


def bent(change) -> bytes:
    pack = copy.deepcopy(right())
    change(pack)
    return written(pack)


def set_detour(found: Way):
    return lambda pack: setattr(pack.legs[0], "detour", found)


def charging() -> Way:
    found = way("dc")
    found.hops[0].stop = Stop(0.8, None)
    return found


ZONE = planted.zone("late", 5, [500, 1000], 30)
UNSAFE = [
    record(bent(set_detour(way("c")))),
    record(bent(set_detour(way("dc", rejoins=1)))),
    record(bent(set_detour(way("dc", battery=0.95)))),
    record(bent(set_detour(way("dc", battery=0.2))), battery=0.28),
    record(bent(set_detour(way("d"))), pads={"d": 0}),
    record(bent(set_detour(charging())), pads={"d": 0}),
    record(written(right()), ZONE),
    record(written(right(), spare_nodes=160)),
]
SAFE = [
    record(written(right())),
    record(bent(set_detour(charging()))),
    record(written(right()), planted.zone("late", 10, [500, 1000], 30)),
]


def self_test() -> int:
    """1 where the judge overlooks what is planted, or finds what is not there."""
    failed, found = 0, 0
    everywhere = (float("-inf"), float("inf"))
    for number, planted_record in enumerate(UNSAFE):
        is_found = bool(packs.judge(planted_record, *everywhere).faults)
        found += is_found
        if not is_found:
            print(f"FAILED: packs: planted fault {number} is overlooked")
            failed = 1
    print(f"judge of packs: {found} of {len(UNSAFE)} planted faults found")
    for number, right_record in enumerate(SAFE):
        coverage = packs.judge(right_record, *everywhere)
        if coverage.faults or coverage.covered_percent() < 100:
            print(f"FAILED: packs: not a fault, {number}: {coverage}")
            failed = 1
    # What leads over the closed leg is no answer; the alternate, which is the node itself, is one.
    over = packs.judge(record(bent(set_detour(way("bc")))), *everywhere)
    if (over.detours, over.alternates, over.faults) != (1, 1, []):
        print(f"FAILED: packs: a detour over the closed leg is taken for an answer: {over}")
        failed = 1
    return failed
