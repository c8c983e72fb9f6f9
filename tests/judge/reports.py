"""Random failure reports over a world: drones anywhere, of all types, asked for by all strategies."""

import dataclasses
import math
import random

from geometry import Point, along, distance
from world import NOW_S, Network, Segment, World, make_zone, text_of

TYPES = ["environmental", "navigational", "regulatory", "infrastructure", "operational", "service_level"]
STRATEGIES = ["two_phased", "cell_density", "radius", "dijkstra", "astar", "bellman_ford"]
KINDS = ["on_leg", "in_zone", "at_node", "hover", "on_pad", "near_end", "off_leg", "unknown", "far", "old", "removed"]
WEIGHTS = [20, 21, 8, 6, 8, 5, 9, 6, 4, 6, 7]


@dataclasses.dataclass
class Report:
    """A report as it is sent, and what is true of the drone that sends it."""

    body: dict
    kind: str
    leg: tuple[str, str]
    destination: str
    failure: str
    detail: str | None = None
    # Where the report says that the drone is; none where that is unknown, or where it cannot be.
    place: Point | None = None
    stands_at: str | None = None
    age_s: float = 0.0
    airborne: bool | None = None
    cause: Point | None = None
    old_path: list[str] | None = None
    zone: object = None
    strategy: str = "exact"
    airspeed_mps: float | None = None
    airframe: str | None = None
    payload_kg: float = 0.0
    battery: float | None = None
    pads_node: str | None = None
    pads_fewer: int | None = None
    plan: dict | None = None
    objective: str = "distance"


class Reporter:
    """Draws reports over one world."""

    def __init__(self, dice: random.Random, world: World) -> None:
        self.dice = dice
        self.world = world
        self.network = world.network
        self.ids = sorted(self.network.nodes)
        self.count = 0
        self.struck = [
            segment
            for segment in self.network.segments
            if any(world.hits(zone, segment) == "yes" and zone.meets(NOW_S, NOW_S + 300) for zone in world.zones)
        ]

        full = self.full_nodes()
        self.taken = [
            (segment.other(node), node)
            for segment in self.network.segments
            for node in segment.ends
            if node in full and segment.ends[0] != segment.ends[1]
        ]
        self.covered = sorted(
            node.id
            for node in self.network.nodes.values()
            if any(zone.active_at(NOW_S) and world.covers(zone, node) == "yes" for zone in world.zones)
        )

    def full_nodes(self) -> set[str]:
        """Nodes of which other plans have every pad before long."""
        taken: dict[str, set[int]] = {}
        for plan in self.world.plans:
            for node, pad, since, until in plan["stays"]:
                if since < NOW_S + 600 and until > NOW_S + 60:
                    taken.setdefault(node, set()).add(pad)
        return {node for node, pads in taken.items() if len(pads) >= self.network.nodes[node].pads}

    def draw(self) -> Report:
        dice = self.dice
        self.count += 1
        kind = dice.choices(KINDS, WEIGHTS)[0]
        if self.taken and dice.random() < 0.35:
            return self.draw_to_land()
        if self.world.plans and dice.random() < 0.15:
            planned = self.draw_planned()
            if planned is not None:
                return planned
        failure = dice.choices(TYPES, [20, 24, 10, 12, 20, 14])[0]
        leg, segment = self.draw_leg(kind)
        report = Report({}, kind, leg, self.draw_destination(leg), failure)
        body = report.body
        body["service"] = {"from": self.on_wire(leg[0]), "to": self.on_wire(leg[1])}
        body["destination"] = self.on_wire(report.destination)
        body["type"] = failure
        body["dry_run"] = True
        if dice.random() < 0.25:
            self.add_old_path(report)
        self.add_place(report)
        self.add_drone(report)
        self.add_failure(report, segment)
        self.add_strategy(report)
        return report

    def draw_to_land(self) -> Report:
        """It has to land beside a node whose pads another drone has."""
        dice = self.dice
        leg = dice.choice(self.taken)
        report = Report({}, "on_leg", leg, self.draw_destination(leg), "operational", airborne=True)
        report.detail = dice.choice(["propulsion", "land_now"])
        report.body |= {"type": "operational", "detail": report.detail, "dry_run": True, "airborne": True}
        report.body["service"] = {"from": self.on_wire(leg[0]), "to": self.on_wire(leg[1])}
        report.body["destination"] = self.on_wire(report.destination)
        one, other = (self.network.nodes[node].at for node in leg)
        report.place = along(one, other, dice.uniform(0.4, 0.98))
        report.body["location"] = self.network.place_on_wire(report.place)
        self.add_drone(report)
        return report

    def draw_long(self) -> Report | None:
        """It hovers at the start of a long leg, and flies slowly."""
        dice = self.dice
        longest = sorted(self.network.segments, key=lambda segment: -segment.length_m)[:8]
        leg = dice.choice(longest).ends
        if leg[0] == leg[1]:
            return None
        report = Report({}, "hover", leg, leg[1], "service_level", airborne=True, stands_at=leg[0])
        report.place = self.network.nodes[leg[0]].at
        report.airspeed_mps, report.battery = 8.0, 0.9
        report.body |= {"type": "service_level", "dry_run": True, "airborne": True, "destination": leg[1]}
        report.body["service"] = {"from": leg[0], "to": leg[1]}
        report.body["location"] = {"node": leg[0]}
        report.body["drone"] = {"id": "slow", "airspeed_mps": 8.0, "battery_fraction": 0.9}
        return report

    def draw_planned(self) -> Report | None:
        """By its plan, on the first leg of it."""
        dice = self.dice
        plan = dice.choice(self.world.plans)
        nodes = plan["nodes"]
        if len(nodes) < 2:
            return None
        failure = dice.choice(["environmental", "navigational", "operational", "service_level"])
        report = Report({}, "on_leg", (nodes[0], nodes[1]), nodes[-1], failure, airborne=True, plan=plan)
        report.old_path = nodes
        report.battery, report.payload_kg = dice.choice([0.25, 0.4, 0.6]), 0.25
        one, other = (self.network.nodes[node].at for node in nodes[:2])
        report.place = along(one, other, dice.uniform(0.05, 0.95))
        drone = {"id": plan["drone"], "battery_fraction": report.battery, "payload_kg": 0.25}
        report.body |= {"type": failure, "service": {"plan_id": plan["id"], "leg": 0}, "drone": drone}
        report.body |= {"dry_run": True, "airborne": True, "location": self.network.place_on_wire(report.place)}
        return report

    def on_wire(self, node: str):
        """An id as an integer or as text."""
        return node if self.dice.random() < 0.5 else self.network.id_on_wire(node)

    def draw_leg(self, kind: str) -> tuple[tuple[str, str], Segment | None]:
        dice = self.dice
        if kind == "removed":
            for _ in range(50):
                one, other = dice.sample(self.ids, 2)
                apart = distance(self.network.nodes[one].at, self.network.nodes[other].at)
                if (one, other) not in self.network.by_ends and apart > 1.0:
                    return (one, other), None
        if kind in ("at_node", "hover", "on_pad") and self.covered and dice.random() < 0.5:
            one = dice.choice(self.covered)
            segment = dice.choice(self.network.beside[one])
            return (one, segment.other(one)), segment
        choice = self.struck if self.struck and (kind == "in_zone" or dice.random() < 0.25) else self.network.segments
        segment = dice.choice(choice)
        ends = segment.ends if dice.random() < 0.5 else segment.ends[::-1]
        return ends, segment

    def draw_destination(self, leg: tuple[str, str]) -> str:
        if self.dice.random() < 0.12:
            return leg[1]
        while True:
            node = self.dice.choice(self.ids)
            if node != leg[0]:
                return node

    def add_old_path(self, report: Report) -> None:
        """A walk that begins with the leg and never turns back at once."""
        path = list(report.leg)
        for _ in range(self.dice.randint(0, 5)):
            onward = [segment.other(path[-1]) for segment in self.network.beside[path[-1]]]
            onward = [node for node in onward if node not in path]
            if not onward:
                break
            path.append(self.dice.choice(onward))
        report.old_path = path
        report.destination = path[-1]
        report.body["remaining_path"] = [self.on_wire(node) for node in path]
        report.body["destination"] = self.on_wire(path[-1])

    def add_place(self, report: Report) -> None:
        dice, body, kind = self.dice, report.body, report.kind
        one, other = (self.network.nodes[node].at for node in report.leg)
        length = distance(one, other)
        if kind == "unknown":
            if dice.random() < 0.6:
                body["location_unknown"] = True
            return
        if kind == "far":
            body["location"] = self.far_off()
            return
        if kind in ("at_node", "hover", "on_pad"):
            report.stands_at = report.leg[0]
            report.place = one
            body["location"] = {"node": self.on_wire(report.leg[0])}
            if kind != "at_node":
                report.airborne = body["airborne"] = kind == "hover"
            return
        fraction = dice.uniform(0.02, 0.98)
        if kind == "near_end":
            fraction = dice.choice([0.001, 0.01, 0.99, 0.999])
        if kind == "in_zone":
            fraction = self.fraction_in_zone(report.leg, fraction)
        point = along(one, other, fraction)
        if length > 0:
            aside = dice.gauss(0, 2)
            if kind == "off_leg":
                aside = dice.choice([-1, 1]) * dice.uniform(60, 300)
            point = (
                point[0] - (other[1] - one[1]) / length * aside,
                point[1] + (other[0] - one[0]) / length * aside,
            )
        report.place = point
        body["location"] = self.network.place_on_wire(point)
        if dice.random() < 0.6:
            report.airborne = body["airborne"] = True
        if kind == "old":
            report.age_s = dice.choice([1.0, 3.0, 10.0, 30.0, 120.0])
            body["timestamp"] = text_of(NOW_S - report.age_s)
        elif dice.random() < 0.3:
            body["timestamp"] = text_of(NOW_S)

    def far_off(self):
        if self.network.plane.centre is None:
            low_x, low_y, high_x, high_y = self.network.box
            return {"x": high_x + 5 * (high_x - low_x) + 5000.0, "y": low_y - 2 * (high_y - low_y) - 4000.0}
        return self.dice.choice([[0.0, 0.0], [2.35, 48.85], [self.network.plane.centre[1], 80.0]])

    def fraction_in_zone(self, leg: tuple[str, str], otherwise: float) -> float:
        """Often within a zone, or a little before it."""
        one, other = (self.network.nodes[node].at for node in leg)
        inside = [
            interval
            for zone in self.world.zones
            if zone.meets(NOW_S, NOW_S + 300)
            for interval in self.world.near(zone, one, other, 0.0)
        ]
        if not inside or distance(one, other) == 0.0:
            return otherwise
        low, high = self.dice.choice(inside)
        if self.dice.random() < 0.35:
            return max(0.0, low - self.dice.uniform(2, 80) / distance(one, other))
        return self.dice.uniform(low, high)

    def add_drone(self, report: Report) -> None:
        dice = self.dice
        drone: dict = {"id": f"d{self.count}"}
        if dice.random() < 0.3:
            report.airspeed_mps = drone["airspeed_mps"] = dice.choice([8.0, 12.0, 16.0, 20.0])
        if self.world.flown:
            if dice.random() < 0.5:
                report.payload_kg = drone["payload_kg"] = dice.choice([0.25, 0.5, 1.0])
            if dice.random() < 0.85:
                report.battery = drone["battery_fraction"] = dice.choice([0.09, 0.15, 0.22, 0.24, 0.3, 0.5, 0.9])
            if dice.random() < 0.15:
                report.airframe = drone["airframe"] = "m100"
                if report.payload_kg > 0.75:
                    report.payload_kg = drone["payload_kg"] = 0.5
        report.body["drone"] = drone

    def add_failure(self, report: Report, segment: Segment | None) -> None:
        dice, body = self.dice, report.body
        one, other = (self.network.nodes[node].at for node in report.leg)
        if report.failure == "operational" and dice.random() < 0.8:
            report.detail = body["detail"] = dice.choice(["battery", "payload", "propulsion", "land_now"])
        if report.failure == "infrastructure":
            report.pads_node = report.leg[1]
            if dice.random() < 0.4:
                report.pads_node = dice.choice(self.ids)
                body["node"] = self.on_wire(report.pads_node)
            if dice.random() < 0.3:
                report.pads_fewer = body["pads"] = 1
        if report.failure == "navigational" and segment is not None and dice.random() < 0.35:
            report.cause = along(one, other, dice.uniform(0.05, 0.95))
            body["cause_location"] = self.network.place_on_wire(report.cause)
        if report.failure == "regulatory" and dice.random() < 0.5:
            scale = max(self.network.box[2] - self.network.box[0], 200.0)
            report.zone = make_zone(dice, self.network, f"brought{self.count}", scale * 0.5)
            body["zone"] = report.zone.feature
        if report.failure == "environmental" and dice.random() < 0.15:
            body["wind_mps"] = dice.choice([6.0, 9.0, 14.0])

    def add_strategy(self, report: Report) -> None:
        dice, body = self.dice, report.body
        if dice.random() < 0.4:
            report.strategy = body["strategy"] = dice.choice(STRATEGIES)
            if report.strategy in ("dijkstra", "astar", "bellman_ford") and dice.random() < 0.5:
                body["scope"] = dice.choice(["local", "global"])
        if dice.random() < 0.15:
            body["optimum"] = True
        if self.world.flown and dice.random() < 0.25:
            report.objective = body["objective"] = dice.choice(["time", "energy"])


def scale_of(network: Network) -> float:
    lengths = sorted(math.dist(network.nodes[s.ends[0]].at, network.nodes[s.ends[1]].at) for s in network.segments)
    return 2 * lengths[len(lengths) // 2]
