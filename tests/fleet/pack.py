"""Reads a pack, by the table of docs/pack.md alone. Whether its signature holds is for others to say."""

import dataclasses
import struct

NOTHING_16, NOTHING_32, NO_HEIGHT = 0xFFFF, 0xFFFFFFFF, -0x8000
STATES = ("pending", "given", "none", "void", "left_out")
# A node by its place, in 1e-7 degrees or in centimetres.
Place = tuple[int, int]


@dataclasses.dataclass
class Stop:
    battery: float
    not_before_s: float | None


@dataclasses.dataclass
class Hop:
    to: Place
    stop: Stop | None = None


@dataclasses.dataclass
class Way:
    battery: float | None
    rejoins: int | None
    is_reserve_used: bool
    begins_with: Stop | None
    hops: list[Hop]


@dataclasses.dataclass
class Leg:
    start: Place
    end: Place
    battery: float | None
    departs_s: float | None
    lands_before: bool
    # `given`, or why not.
    detour_state: str
    alternate_state: str
    detour: Way | None
    alternate: Way | None


@dataclasses.dataclass
class Pack:
    plan: str
    version: int
    departs_s: float
    legs: list[Leg]

    def action(self, number: int) -> Way | None:
        """What its drone does at the first node of a leg that has closed; nothing where nothing is known."""
        for way in (self.legs[number].detour, self.legs[number].alternate):
            if way is not None and not self.is_closed(way, number):
                return way
        return None

    def is_closed(self, way: Way, number: int) -> bool:
        """Whether a way, or what is flown of the plan after it, leads over a leg."""
        leg = self.legs[number]
        flown, at = [], leg.start
        for hop in way.hops:
            flown.append({at, hop.to})
            at = hop.to
        after = self.legs[way.rejoins :] if way.rejoins is not None else []
        flown += [{later.start, later.end} for later in after]
        return {leg.start, leg.end} in flown


def read(data: bytes) -> Pack:
    magic, _, _, plan_length, network_length, length = struct.unpack_from("<4sBBBBI", data, 0)
    if magic != b"SKPK" or length != len(data):
        raise ValueError("no pack")
    legs, nodes, _units, shift = struct.unpack_from("<HHHB", data, 12)
    version, _token, _epoch, _not_after, departs_ms, lon, lat = struct.unpack_from("<IQQqqii", data, 20)
    at = (104 + plan_length + network_length + 3) // 4 * 4
    places = []
    for number in range(nodes):
        offset = at + 12 * number + 4
        east, north = (int.from_bytes(data[offset + 3 * axis : offset + 3 * axis + 3], "little", signed=True) for axis in (0, 1))
        places.append((lon + (east << shift), lat + (north << shift)))
    legs_at = at + 12 * nodes
    ways_at = legs_at + 20 * legs
    read_legs = []
    for number in range(legs):
        start, end, _, _, battery, departs, flags, detour, alternate, _, detour_at, alternate_at = struct.unpack_from(
            "<HHBBHIBBBBHH", data, legs_at + 20 * number
        )
        read_legs.append(
            Leg(
                places[start],
                places[end],
                known(battery),
                None if departs == NOTHING_32 else departs / 10,
                bool(flags & 1),
                STATES[detour],
                STATES[alternate],
                way(data, ways_at + 4 * detour_at, places) if detour == 1 else None,
                way(data, ways_at + 4 * alternate_at, places) if alternate == 1 else None,
            )
        )
    plan = data[104 : 104 + plan_length].decode()
    return Pack(plan, version, departs_ms / 1000, read_legs)


def known(battery: int) -> float | None:
    return None if battery == NOTHING_16 else battery / 10_000


def stop(data: bytes, at: int) -> Stop:
    battery, _, not_before = struct.unpack_from("<HHI", data, at)
    return Stop(battery / 10_000, None if not_before == NOTHING_32 else not_before / 10)


def way(data: bytes, at: int, places: list[Place]) -> Way:
    battery, rejoins, count, flags, _ = struct.unpack_from("<HHBBH", data, at)
    at += 8
    begins_with = None
    if flags & 2:
        begins_with = stop(data, at)
        at += 8
    hops = []
    for _ in range(count):
        word = struct.unpack_from("<H", data, at)[0]
        at += 4
        hop = Hop(places[word & 0x7FFF])
        if word & 0x8000:
            hop.stop = stop(data, at)
            at += 8
        hops.append(hop)
    return Way(known(battery), None if rejoins == NOTHING_16 else rejoins, bool(flags & 1), begins_with, hops)
