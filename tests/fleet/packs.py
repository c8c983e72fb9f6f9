"""What the packs of a fleet do for each leg that closes, all else being open: covered or not, and never unsafe.

The closures are made here: one for each leg that a drone enters, at its first node, as its plan has it. What its pack says is
then flown, by the flight model of the judge of answers and in the network of the record: over segments that are there, not
over the closed one, through no zone in force, and with the reserve left at every landing.
"""

import collections
import dataclasses
import math

import pack as packs
from energy import FLOOR, PHANTOM3, RESERVE, Drone, Heights, fly
from fault import Fault
from record import Record, Version
from world import Network, Node, Segment, Wind
from zones import times_inside

# Batteries are rounded to a hundredth of a percent, here and there.
SPARE = 3e-4


@dataclasses.dataclass
class Coverage:
    """How many closures there were, and what became of them."""

    closures: int = 0
    detours: int = 0
    alternates: int = 0
    # Of those that are not covered, what the pack says of the detour.
    unknown: collections.Counter = dataclasses.field(default_factory=collections.Counter)
    largest_bytes: int = 0
    faults: list[Fault] = dataclasses.field(default_factory=list)

    def covered_percent(self) -> float:
        return 100.0 * (self.detours + self.alternates) / max(1, self.closures)


class Sky:
    """The network of a record, with its nodes by their places as packs have them."""

    def __init__(self, record: Record) -> None:
        document = record.network
        self.unit = 1e7 if document["skyway"]["coordinates"] == "geographic" else 100.0
        self.named: dict[packs.Place, str] = {}
        nodes, segments = [], []
        for feature in document["features"]:
            told = feature["properties"]
            if told["kind"] == "node":
                name, place = str(feature["id"]), feature["geometry"]["coordinates"]
                self.named[self.place(place)] = name
                at = record.plane.to_plane((place[0], place[1]))
                reference = told.get("altitude_reference", "agl")
                nodes.append(Node(name, at, told.get("pads", 0), told.get("altitude_m"), reference))
            else:
                ends = (str(told["from"]), str(told["to"]))
                band = told.get("lower_m"), told.get("upper_m"), told.get("lower_reference", "agl")
                name = "-".join(sorted(ends))
                segments.append(Segment(name, ends, told.get("length_m"), *band, told.get("speed_limit_mps")))
        self.network = Network(record.plane, nodes, segments, True)
        for segment in segments:
            if segment.length_m is None:
                one, other = (self.network.nodes[end].at for end in segment.ends)
                segment.length_m = math.dist(one, other)
        self.heights = Heights(self.network)
        self.drone = Drone(PHANTOM3, 0.0, None, Wind())

    def place(self, coordinates: list[float]) -> packs.Place:
        return (round(coordinates[0] * self.unit), round(coordinates[1] * self.unit))

    def climbs(self, node: str) -> float:
        """What a take-off draws, as a part of the battery."""
        return PHANTOM3.climb_wh(0.0, self.heights.rise[node]) / PHANTOM3.battery_wh


def judge(record: Record, from_s: float, until_s: float) -> Coverage:
    coverage = Coverage()
    sky = Sky(record) if record.packs else None
    for plan, (at_s, data) in record.packs.items():
        coverage.largest_bytes = max(coverage.largest_bytes, len(data))
        read = packs.read(data)
        version = record.versions[plan].get(read.version)
        if version is None:
            coverage.faults.append(Fault("pack", at_s, plan, f"of version {read.version}, which there is not"))
            continue
        check_size(coverage, at_s, plan, data, len(read.legs))
        moves = [move for move in version.moves if move.segment is not None]
        for number, move in enumerate(moves):
            if from_s <= move.enters_s <= until_s:
                look_at(coverage, record, sky, (version, read), number, at_s)
    return coverage


def check_size(coverage: Coverage, at_s: float, plan: str, data: bytes, legs: int) -> None:
    most = 2048 + 150 * max(0, legs - 10)
    if len(data) > most:
        coverage.faults.append(Fault("pack", at_s, plan, f"{len(data)} bytes for {legs} legs, at most {most}"))


def look_at(
    coverage: Coverage, record: Record, sky: Sky, told: tuple[Version, packs.Pack], number: int, at_s: float
) -> None:
    version, read = told
    coverage.closures += 1
    way = read.action(number)
    if way is None:
        coverage.unknown[read.legs[number].detour_state] += 1
        return
    if way is read.legs[number].detour:
        coverage.detours += 1
    else:
        coverage.alternates += 1
    try:
        flown(record, sky, told, number, at_s)
    except Unsafe as unsafe:
        coverage.faults.append(Fault("pack", at_s, version.plan, f"leg {number} closed: {unsafe}"))


class Unsafe(Exception):
    """What a drone must not do."""


def flown(record: Record, sky: Sky, told: tuple[Version, packs.Pack], number: int, at_s: float) -> None:
    """Flies what a pack says of a leg that has closed."""
    version, read = told
    way = read.action(number)
    moves = [move for move in version.moves if move.segment is not None]
    flight = Flight(record, sky, version, moves[number].ends, at_s)
    flight.node = moves[number].ends[0]
    flight.battery = version.batteries[number]
    flight.now_s = moves[number].enters_s
    flight.is_reserve_used = way.is_reserve_used
    if way.battery is not None and way.battery > flight.battery + SPARE:
        raise Unsafe(f"it takes {way.battery:.4f} of the battery, and there is {flight.battery:.4f}")
    if way.begins_with is not None:
        flight.stop(way.begins_with.battery)
    for hop in way.hops:
        flight.fly(sky.named.get(hop.to))
        if hop.stop is not None:
            flight.stop(hop.stop.battery)
    after = moves[way.rejoins :] if way.rejoins is not None else []
    for leg, move in enumerate(after, way.rejoins or 0):
        if move.ends[0] != flight.node:
            raise Unsafe(f"it meets the plan at {flight.node}, and leg {leg} begins at {move.ends[0]}")
        if read.legs[leg].lands_before:
            flight.stop(read.legs[leg].battery)
        flight.fly(move.ends[1])
    flight.land()
    if sky.network.nodes[flight.node].pads == 0 and flight.node != moves[-1].ends[1]:
        raise Unsafe(f"it ends at {flight.node}, which has no pad and is not where the plan ends")


class Flight:
    """A drone on its way, in the judge's own model."""

    def __init__(self, record: Record, sky: Sky, version: Version, closed: tuple[str, str], at_s: float) -> None:
        self.record, self.sky, self.version = record, sky, version
        self.closed = set(closed)
        # What was posted later no pack can know.
        self.zones = [zone for zone in record.zones.values() if zone.stood_s < at_s and not zone.has_band]
        self.node, self.battery, self.now_s = "", 0.0, 0.0
        self.is_reserve_used = False

    def fly(self, to: str | None) -> None:
        ends = (self.node, to)
        segment = self.sky.network.by_ends.get(ends)
        if to is None or segment is None:
            raise Unsafe(f"the network has no segment {self.node} to {to}")
        if set(ends) == self.closed:
            raise Unsafe("it flies the segment that has closed")
        stretch = fly(self.sky.drone, self.sky.network, self.sky.heights, segment, self.node)
        self.through_no_zone(ends, stretch.time_s)
        self.now_s += stretch.time_s
        # Where heights are unknown, only take-offs climb.
        is_known = all(self.sky.network.nodes[end].altitude_m is not None for end in ends)
        self.battery -= (stretch.most_wh if is_known else stretch.least_wh) / PHANTOM3.battery_wh
        self.node = to

    def through_no_zone(self, ends: tuple[str, str], took_s: float) -> None:
        one, other = (self.sky.network.nodes[end].at for end in ends)
        for zone in self.zones:
            move = dataclasses.replace(
                self.version.moves[0],
                enters_s=self.now_s,
                leaves_s=self.now_s + took_s,
                until_s=math.inf,
                line=[(*one, None), (*other, None)],
                _along=[],
            )
            for enters_s, leaves_s in times_inside(move, zone, zone.shape.box()):
                if zone.meets(enters_s, leaves_s):
                    raise Unsafe(f"it flies through zone {zone.id}")

    def land(self) -> None:
        least = FLOOR if self.is_reserve_used else RESERVE
        if self.battery < least - SPARE:
            raise Unsafe(f"it lands at {self.node} with {self.battery:.4f} of the battery, below {least}")

    def stop(self, level: float) -> None:
        """Lands, charges until the battery is at a level, and takes off."""
        self.land()
        if self.sky.network.nodes[self.node].pads == 0:
            raise Unsafe(f"it charges at {self.node}, which has no pad")
        self.battery = max(self.battery, level) - self.sky.climbs(self.node)


def table(coverage: Coverage) -> str:
    unknown = ", ".join(f"{count} {why}" for why, count in coverage.unknown.most_common()) or "none"
    covered = coverage.covered_percent()
    verdict = "met" if covered >= 90 else "**missed**"
    unsafe = "**missed**" if coverage.faults else "met"
    return "\n".join(
        [
            f"{coverage.closures} single closures: {coverage.detours} answered by a detour, {coverage.alternates} by an",
            f"alternate; not covered: {unknown}. The largest pack has {coverage.largest_bytes} bytes.\n",
            "| | goal | found | |",
            "|---|---:|---:|---|",
            f"| single closures covered by packs | 90 % | {covered:.1f} % | {verdict} |",
            f"| unsafe answers of packs | 0 | {len(coverage.faults)} | {unsafe} |",
        ]
    )
