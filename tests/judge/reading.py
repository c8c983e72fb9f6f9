"""The judge's own reading of a report: where the drone is, what closes its leg, from where it may go on.

It is lenient where the rules leave a thing open: such a start is `maybe`, which is neither asked for nor refused.
"""

import dataclasses
import heapq
import math

from geometry import Interval, Point, along, distance, merged, project
from reports import Report
from world import DOUBT_M, HORIZON_S, NOW_S, Closure, Network, Segment, World, Zone

TOLERANCE_M = 50.0
DEFAULT_AIRSPEED_MPS = 16.0
FAR_FROM_LEG_M = 2000.0
# A drone so near to a node that both readings hold: it stands there, it is on its way.
AT_NODE_M = 0.5
# How long zones may still open for a drone that flies by the clock, at most.
FLIGHT_S = 4 * 3600.0
CLOSING_TYPES = ("environmental", "navigational", "regulatory")


@dataclasses.dataclass
class Start:
    """A way into the network: the node, the length to it, and whether the rules allow it."""

    node: str
    length_m: float
    allowed: str
    kind: str
    # The leg that it is flown on, where that is not the report's.
    leg: tuple[str, str] | None = None


@dataclasses.dataclass
class Cause:
    """What lies on the leg: from where to where in metres from A, or nowhere known."""

    interval: Interval | None
    is_zone: bool
    is_sure: bool = True


class Reading:
    """One report in one world, as the rules say it is to be understood."""

    def __init__(self, world: World, report: Report) -> None:
        self.world = world
        self.report = report
        network = world.network
        self.a, self.b = report.leg
        self.segment: Segment | None = network.by_ends.get(report.leg)
        self.from_at, self.to_at = network.nodes[self.a].at, network.nodes[self.b].at
        self.straight_m = distance(self.from_at, self.to_at)
        self.length_m = self.segment.length_m if self.segment else self.straight_m
        self.airspeed_mps = report.airspeed_mps or (
            12.0 if world.flown and report.airframe == "m100" else DEFAULT_AIRSPEED_MPS
        )
        self.stopping_m = self.airspeed_mps * 2 + self.airspeed_mps**2 / 7
        # Without a battery to reckon with a drone is answered by distance, and what closes within the horizon is closed.
        has_battery = report.battery is not None or report.plan is not None
        self.by_times = world.flown and (has_battery or report.failure == "operational")
        self.zones = world.zones + ([report.zone] if report.zone is not None else [])
        self.where = self._where()
        self.fraction, self.aside_m = 0.0, 0.0
        if report.place is not None:
            self.fraction, self.aside_m = project(report.place, self.from_at, self.to_at)
        self.at_m = self.fraction * self.length_m
        self.far_m = min(self.length_m, self.at_m + self.airspeed_mps * report.age_s)
        if self.where == "unknown":
            self.at_m, self.far_m = 0.0, self.length_m
        self.on_ground = report.airborne is False
        self.closes_leg = report.failure in CLOSING_TYPES
        self.blocked: dict[str, str] = {}
        self.closed_nodes: dict[str, str] = {}
        self._close()
        self.causes = self._causes()
        self.is_doubtful = False
        self.inside: Interval | None = self._inside()
        self.starts: list[Start] = []
        # The longer way out of a zone, and where the shorter one leads.
        self.longer: tuple[str, str] | None = None
        self._find_starts()

    # --- where it is ---

    def _where(self) -> str:
        if self.report.place is None:
            return "unknown"
        if self.report.stands_at is not None:
            return "node"
        return "off" if project(self.report.place, self.from_at, self.to_at)[1] > TOLERANCE_M else "leg"

    # --- what is closed ---

    def counts(self, thing: Zone | Closure) -> str:
        """Whether it closes for a drone that flies now: `maybe` for what opens or closes on its way."""
        if self.by_times:
            if not thing.meets(NOW_S - 120, NOW_S + FLIGHT_S):
                return "no"
            return "maybe" if thing.windows else "yes"
        return "yes" if thing.meets(NOW_S, NOW_S + HORIZON_S) else "no"

    def _close(self) -> None:
        network = self.world.network
        for zone in self.zones:
            counts = self.counts(zone)
            if counts == "no":
                continue
            for segment in network.segments:
                put(self.blocked, segment.id, weaker(self.hits(zone, segment), counts))
            for node in network.nodes.values():
                put(self.closed_nodes, node.id, weaker(self.covers(zone, node), counts))
        for closure in self.world.closures:
            counts = "maybe" if closure.is_doubtful else self.counts(closure)
            for segment_id in closure.segments:
                put(self.blocked, segment_id, counts)
            for node_id in closure.nodes:
                put(self.closed_nodes, node_id, counts)
        if self.closes_leg and self.segment is not None:
            put(self.blocked, self.segment.id, "yes")
        if self.report.failure == "operational" and self.segment is not None:
            put(self.blocked, self.segment.id, "maybe")
        own = self.report.plan["id"] if self.report.plan else None
        for plan in self.world.plans:
            if plan["id"] != own:
                for segment_id in plan["segments"]:
                    put(self.blocked, segment_id, "maybe")

    def hits(self, zone: Zone, segment: Segment) -> str:
        return self.world._hits(zone, segment) if zone is self.report.zone else self.world.hits(zone, segment)

    def covers(self, zone: Zone, node) -> str:
        return self.world._covers(zone, node) if zone is self.report.zone else self.world.covers(zone, node)

    def pads_at(self, node: str, since_s: float | None = None, until_s: float | None = None) -> int:
        """Pads that nothing closes, or nothing between two instants, occupied or not."""
        pads = self.world.network.nodes[node].pads
        for closure in self.world.closures:
            meets = since_s is None or closure.meets(since_s, until_s)
            if node in closure.pads and self.counts(closure) != "no" and meets:
                return 0
        if self.report.pads_node == node:
            return max(0, pads - (self.report.pads_fewer or pads))
        return pads

    # --- what lies on the leg ---

    def _causes(self) -> list[Cause]:
        causes = []
        for zone in self.zones:
            if self.counts(zone) == "no" or (self.by_times and not zone.meets(NOW_S - 60, NOW_S + 600)):
                continue
            if self.segment is not None and not zone.reaches(
                self.segment.lower_m, self.segment.upper_m, self.segment.reference
            ):
                continue
            for grown, is_sure in ((-DOUBT_M, True), (DOUBT_M, False)):
                # In flight a zone that begins later lies there later.
                lies = is_sure and (not self.by_times or zone.active_at(NOW_S))
                for low, high in self.world.near(zone, self.from_at, self.to_at, grown):
                    causes.append(Cause((low * self.length_m, high * self.length_m), True, lies))
        if self.closes_leg:
            causes.append(Cause(self.point_on_leg(self.report.cause), False))
        for closure in self.world.closures:
            if self.segment is not None and self.segment.id in closure.segments and self.counts(closure) != "no":
                is_sure = self.counts(closure) == "yes" and not closure.is_doubtful
                causes.append(Cause(self.point_on_leg(closure.cause), False, is_sure))
        if self.segment is None:
            causes.append(Cause(None, False))
        return causes

    def point_on_leg(self, place: Point | None) -> Interval | None:
        if place is None:
            return None
        at_m = project(place, self.from_at, self.to_at)[0] * self.length_m
        return (at_m, at_m)

    def zone_parts(self, is_sure: bool) -> list[Interval]:
        """Where zones lie on the leg, those that overlap as one."""
        parts = [cause.interval for cause in self.causes if cause.is_zone and cause.is_sure == is_sure]
        return [(low, high) for low, high in merged(parts) if high - low > 1e-9 or self.length_m == 0]

    def _inside(self) -> Interval | None:
        """The part of the leg within zones that the drone is in."""
        if self.where not in ("leg", "node"):
            return None
        sure = holding(self.zone_parts(True), self.at_m)
        possible = holding(self.zone_parts(False), self.at_m)
        # Aside of its leg a drone may be in a zone that its leg is not in, and the other way round.
        by_place = any(
            zone.shape.distance_to(self.report.place) <= zone.margin_m
            for zone in self.zones
            if self.counts(zone) != "no"
        )
        reaching = any(
            self.covers(zone, self.world.network.nodes[self.a]) != "no"
            for zone in self.zones
            if self.counts(zone) != "no"
        )
        if (sure is None) != (possible is None) or (self.where == "leg" and (sure is not None) != by_place):
            self.is_doubtful = True
        if self.where == "node" and (sure is not None) != reaching:
            self.is_doubtful = True
        if sure is not None and self.far_m > self.at_m and sure[1] < self.far_m:
            self.is_doubtful = True
        if sure is None and any(low <= self.far_m and high >= self.at_m for low, high in self.zone_parts(False)):
            self.is_doubtful = True
        if sure is not None and not self.active_now():
            self.is_doubtful = True
        if sure is not None and self.where == "leg":
            # At the edge by less than figures are told to.
            edges = [end for end in sure if 0.0 < end < self.length_m]
            self.is_doubtful |= any(abs(self.at_m - end) < 0.25 for end in edges)
        return sure

    def active_now(self) -> bool:
        """Whether one of the zones at its place is active this moment, and not only soon."""
        return any(
            zone.active_at(NOW_S)
            and self.world.near(zone, self.from_at, self.to_at, 0.0)
            and zone.shape.distance_to(self.point) <= zone.margin_m + DOUBT_M
            for zone in self.zones
        )

    @property
    def point(self) -> Point:
        """Its place on the leg."""
        return along(self.from_at, self.to_at, self.fraction)

    # --- from where it goes on ---

    def _find_starts(self) -> None:
        if self.where == "off":
            self._starts_aside()
        elif self.inside is not None and not self.on_ground:
            self._starts_from_inside()
        else:
            self._starts_on_leg()
        if self.is_doubtful and self.inside is None and self.where in ("leg", "node") and not self.on_ground:
            # It may be inside, or a zone that is to begin may count: then it may have to leave straight.
            self.starts += [Start(node, away, "maybe", "straight") for node, away in self.straight_ways(leaving=True)]
        if self.is_doubtful or (self.segment is not None and self.straight_m == 0.0):
            for start in self.starts:
                start.allowed = "maybe"

    def enterable(self, node: str) -> str:
        return opposite(self.closed_nodes.get(node, "no"))

    def free(self, low_m: float, high_m: float, ignore: Interval | None = None) -> str:
        """Whether nothing with a known place lies on a part of the leg."""
        verdict = "yes"
        for cause in self.causes:
            if cause.interval is None:
                continue
            low, high = cause.interval
            if ignore is not None and cause.is_zone and low >= ignore[0] - 1.0 and high <= ignore[1] + 1.0:
                continue
            if high < low_m or low > high_m:
                continue
            grazes = min(high, high_m) - max(low, low_m) <= 0.0 if cause.is_zone else False
            verdict = weaker(verdict, "maybe" if grazes or not cause.is_sure else "no")
        return verdict

    def onward_causes(self) -> str:
        """Whether every cause that closes the leg has a known place: what has none is ahead, of who is not at its end."""
        if self.is_at_end():
            return "yes"
        unknown = [cause for cause in self.causes if cause.interval is None]
        if any(cause.is_sure for cause in unknown):
            return "no"
        return "maybe" if unknown or self.report.failure == "operational" else "yes"

    def is_at_end(self) -> bool:
        """Whether all of the leg is flown, so that nothing of it is ahead."""
        return self.where == "leg" and self.at_m >= self.length_m

    def free_back(self, high_m: float, ignore: Interval | None = None) -> str:
        """Whether the way back is free, of what has no place as well."""
        unplaced = [cause for cause in self.causes if cause.interval is None and self.is_at_end()]
        if any(cause.is_sure for cause in unplaced):
            return "no"
        return weaker("maybe" if unplaced else "yes", self.free(0.0, high_m, ignore))

    def _starts_on_leg(self) -> None:
        if self.where == "node":
            # Closed or not, it may leave over any open segment of its node.
            self.starts.append(Start(self.a, 0.0, "yes", "none"))
        else:
            back = weaker(self.enterable(self.a), self.free_back(self.far_m))
            if self.where == "leg" and self.may_have_passed():
                back = "maybe"
            if self.where == "leg" and self.at_m <= AT_NODE_M:
                back = "maybe"
            if self.where == "unknown" and any(cause.interval is not None for cause in self.causes):
                # It is unknown on which side of that it is, or whether it is inside.
                back = "maybe"
            self.starts.append(Start(self.a, self.away(self.far_m), back, "leg"))
        onward = weaker(weaker(self.enterable(self.b), self.free(self.at_m, self.length_m)), self.onward_causes())
        if self.closed_nodes.get(self.a, "no") != "no" and onward == "yes":
            # What closes A closes the leg, and lies behind.
            onward = "maybe"
        if self.segment is not None and self.blocked.get(self.segment.id) == "maybe" and onward == "yes":
            onward = "maybe"
        if self.near_ahead() and self.where == "leg":
            # It cannot stop before that: once inside it leaves by the shorter way, which may be either.
            back = weaker("maybe", back)
            self.starts[-1].allowed = back
            onward = weaker(weaker(self.enterable(self.b), self.onward_causes()), "maybe")
        self.starts.append(Start(self.b, self.away(self.length_m - self.at_m), onward, "leg"))

    def away(self, along_m: float) -> float:
        """How far it is to an end of the leg: from past that, as far as the drone is from it."""
        is_past = self.where == "leg" and min(self.fraction, 1 - self.fraction) < 1e-6
        return max(along_m, self.aside_m) if is_past else along_m

    def may_have_passed(self) -> bool:
        """Whether it may have passed since what it saw ahead when it told its place."""
        placed = [cause.interval for cause in self.causes if cause.interval is not None and not cause.is_zone]
        return any(self.at_m <= low <= self.far_m for low, _ in placed)

    def _starts_from_inside(self) -> None:
        low, high = self.inside
        back_m, on_m = self.far_m - low, high - self.at_m
        back = "no"
        if low > 0.0:
            back = weaker(self.enterable(self.a), self.free_back(self.far_m, self.inside))
            if self.may_have_passed():
                back = weaker("maybe", weaker(self.enterable(self.a), self.free(0.0, self.at_m, self.inside)))
        onward = "no"
        if high < self.length_m:
            onward = weaker(
                weaker(self.enterable(self.b), self.free(self.at_m, self.length_m, self.inside)), self.onward_causes()
            )
        if back != "no" and onward != "no":
            if abs(back_m - on_m) < 2.0 or "maybe" in (back, onward):
                back = onward = "maybe"
            elif back_m < on_m:
                onward, self.longer = "no", (self.b, self.a)
            else:
                back, self.longer = "no", (self.a, self.b)
        self.starts.append(Start(self.a, self.away(self.far_m), back, "leg"))
        self.starts.append(Start(self.b, self.away(self.length_m - self.at_m), onward, "leg"))
        if self.where == "node":
            self._other_ways_out()
        if back != "yes" and onward != "yes":
            # Straight out: which of the nearest nodes is left open.
            self.starts += [Start(node, away, "maybe", "straight") for node, away in self.straight_ways(leaving=True)]

    def _other_ways_out(self) -> None:
        """A drone that hovers at a node may leave its zone over another segment too, where that leads out."""
        network = self.world.network
        for segment in network.beside[self.a]:
            node = segment.other(self.a)
            if node == self.b or self.enterable(node) == "no":
                continue
            ends = (self.from_at, network.nodes[node].at)
            parts = []
            for zone in self.zones:
                reaches = zone.reaches(segment.lower_m, segment.upper_m, segment.reference)
                if self.counts(zone) != "no" and reaches:
                    parts += self.world.near(zone, *ends, -DOUBT_M)
            is_shut = any(
                segment.id in closure.segments and self.counts(closure) == "yes" for closure in self.world.closures
            )
            together = merged(parts)
            leads_out = len(together) <= 1 and all(low <= 1e-9 and high < 1.0 for low, high in together)
            if leads_out and not is_shut:
                self.starts.append(Start(node, segment.length_m, "maybe", "leg", (self.a, node)))

    def _starts_aside(self) -> None:
        ways = self.straight_ways(leaving=self.in_zone_aside())
        for index, (node, away) in enumerate(ways):
            clean = index == 0 and not self.in_zone_aside() and self.is_clear(node)
            self.starts.append(Start(node, away, "yes" if clean else "maybe", "straight"))

    def in_zone_aside(self) -> bool:
        return any(
            self.counts(zone) != "no" and zone.shape.distance_to(self.report.place) <= zone.margin_m + DOUBT_M
            for zone in self.zones
        )

    def near_ahead(self) -> bool:
        """Whether something with a known place lies nearer ahead than the drone can stop."""
        if self.where != "leg" or self.on_ground:
            return False
        lows = [cause.interval[0] for cause in self.causes if cause.interval is not None]
        return any(self.at_m <= low <= self.far_m + self.stopping_m + 1.0 for low in lows)

    def straight_ways(self, leaving: bool) -> list[tuple[str, float]]:
        """Open nodes whose straight line is clear of zones that reach at any height, nearest first."""
        place = self.report.place
        ways = []
        for node in self.world.network.nodes.values():
            if self.closed_nodes.get(node.id, "no") == "yes":
                continue
            zone = self.crossed(place, node.at, leaving, -DOUBT_M)
            if zone is None or not zone.everywhere_high():
                ways.append((distance(place, node.at), node.id))
        return [(node, away) for away, node in sorted(ways)]

    def is_clear(self, node: str) -> bool:
        """Whether the straight line to a node is clear whatever the heights."""
        place, at = self.report.place, self.world.network.nodes[node].at
        return self.closed_nodes.get(node, "no") == "no" and self.crossed(place, at, False, DOUBT_M) is None

    def crossed(self, start: Point, end: Point, leaving: bool, grown_m: float) -> Zone | None:
        """A zone that a straight line enters; what it begins in it may leave, overlapping zones as one."""
        met, touching = [], []
        for zone in self.zones:
            if self.counts(zone) == "no" or (self.by_times and not zone.active_at(NOW_S)):
                continue
            met += [(part, zone) for part in self.world.near(zone, start, end, grown_m)]
            touching += self.world.near(zone, start, end, DOUBT_M)
        # Zones that all but touch may be one.
        together = merged(touching)
        left_at = together[0][1] if leaving and together and together[0][0] <= 1e-9 else -1.0
        return next((zone for (_, high), zone in met if high > left_at), None)

    # --- a plain search ---

    def shortest(self, sources: list[tuple[str, float]]) -> dict[str, float]:
        """Dijkstra over everything that is surely open. A closed source is left and not entered again."""
        network: Network = self.world.network
        far: dict[str, float] = {}
        heap = [(length, node) for node, length in sources]
        heapq.heapify(heap)
        while heap:
            length, node = heapq.heappop(heap)
            if node in far:
                continue
            far[node] = length
            for segment in network.beside[node]:
                onward = segment.other(node)
                if onward in far or self.blocked.get(segment.id, "no") != "no":
                    continue
                if self.closed_nodes.get(onward, "no") == "no":
                    heapq.heappush(heap, (length + segment.length_m, onward))
        return far

    def leads_nowhere(self, node: str) -> bool:
        """Whether neither the destination nor a pad can be reached from a node."""
        reached = self.shortest([(node, 0.0)])
        pads = [other for other in reached if self.pads_at(other) > 0 and self.closed_nodes.get(other, "no") == "no"]
        return self.report.destination not in reached and not pads

    def clean_lengths(self, overrun_m: float | None) -> dict[str, float]:
        """Every node that a clean start leads to, with the least length.

        Who is too near to something to stop overruns, and flies that twice: as far as the answer tells, else as
        far as it can be.
        """
        if overrun_m is None:
            overrun_m = min(self.stopping_m, self.length_m - self.far_m) if self.near_ahead() else 0.0
        turn_m = 2 * overrun_m
        sources = [
            (start.node, start.length_m + (turn_m if start.node == self.a else 0.0))
            for start in self.starts
            if start.allowed == "yes"
        ]
        return self.shortest(sources)


def put(table: dict[str, str], name: str, verdict: str) -> None:
    if verdict == "yes" or (verdict == "maybe" and table.get(name) != "yes"):
        table[name] = verdict


def weaker(one: str, other: str) -> str:
    """What holds of both: `no` before `maybe` before `yes`."""
    for verdict in ("no", "maybe"):
        if verdict in (one, other):
            return verdict
    return "yes"


def opposite(verdict: str) -> str:
    return {"yes": "no", "no": "yes"}.get(verdict, verdict)


def holding(intervals: list[Interval], at_m: float) -> Interval | None:
    return next(((low, high) for low, high in intervals if low <= at_m <= high), None)


def is_finite(value) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
