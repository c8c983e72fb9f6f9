"""Random worlds: a network, what is closed over it, the wind. All of it from seeds, as data that an edge is given.

The judge reads the same values. It never asks the edge what it made of them.
"""

import dataclasses
import math
import random

from geometry import Circle, Interval, Plane, Point, Polygons, along, distance

# The clock of the edge stands here, all but still, so that both sides know the time.
NOW_TEXT = "2026-11-27T10:00:00Z"
NOW_S = 1_795_773_600.0
HORIZON_S = 600.0
MARGIN_M = 10.0
# What lies nearer to a boundary than this is on either side of it.
DOUBT_M = 0.05


@dataclasses.dataclass
class Node:
    id: str
    at: Point
    pads: int
    altitude_m: float | None
    reference: str


@dataclasses.dataclass
class Segment:
    id: str
    ends: tuple[str, str]
    length_m: float
    lower_m: float | None
    upper_m: float | None
    reference: str
    speed_limit_mps: float | None

    def other(self, node: str) -> str:
        return self.ends[1] if self.ends[0] == node else self.ends[0]


class Network:
    """Nodes and segments, on their plane."""

    def __init__(self, plane: Plane, nodes: list[Node], segments: list[Segment], numbered: bool) -> None:
        self.plane = plane
        self.numbered = numbered
        self.nodes = {node.id: node for node in nodes}
        self.segments = segments
        self.by_ends: dict[tuple[str, str], Segment] = {}
        self.beside: dict[str, list[Segment]] = {node.id: [] for node in nodes}
        for segment in segments:
            one, other = segment.ends
            self.by_ends[one, other] = self.by_ends[other, one] = segment
            self.beside[one].append(segment)
            self.beside[other].append(segment)
        self.by_id = {segment.id: segment for segment in segments}
        xs = [node.at[0] for node in nodes]
        ys = [node.at[1] for node in nodes]
        self.box = (min(xs), min(ys), max(xs), max(ys))
        self._near: dict[tuple[str, float], set[str]] = {}

    def near(self, segment: Segment, within_m: float) -> set[str]:
        """What comes so near to a segment somewhere."""
        if (segment.id, within_m) not in self._near:
            first, second = (self.nodes[node].at for node in segment.ends)
            line = Polygons([[[first, second]]])
            lines = ((other.id, *(self.nodes[node].at for node in other.ends)) for other in self.segments)
            found = {name for name, start, end in lines if line.near(start, end, within_m)}
            self._near[segment.id, within_m] = found
        return self._near[segment.id, within_m]

    def id_on_wire(self, node: str) -> int | str:
        return int(node) if self.numbered else node

    def place_on_wire(self, point: Point) -> dict | list:
        x, y = self.plane.from_plane(point)
        return {"x": x, "y": y} if self.plane.centre is None else [x, y]

    def document(self) -> dict:
        """The network's file."""
        features = []
        for node in self.nodes.values():
            properties: dict = {"kind": "node", "pads": node.pads, "role": "both" if node.pads else "delivery_target"}
            if node.altitude_m is not None:
                properties |= {"altitude_m": node.altitude_m, "altitude_reference": node.reference}
            geometry = {"type": "Point", "coordinates": list(self.plane.from_plane(node.at))}
            features.append(
                {"type": "Feature", "id": self.id_on_wire(node.id), "geometry": geometry, "properties": properties}
            )
        for segment in self.segments:
            one, other = (self.nodes[end] for end in segment.ends)
            properties = {"kind": "segment", "from": self.id_on_wire(one.id), "to": self.id_on_wire(other.id)}
            properties["length_m"] = segment.length_m
            for name in ("lower", "upper"):
                limit = getattr(segment, f"{name}_m")
                if limit is not None:
                    properties |= {f"{name}_m": limit, f"{name}_reference": segment.reference}
            if segment.speed_limit_mps is not None:
                properties["speed_limit_mps"] = segment.speed_limit_mps
            ends = [list(self.plane.from_plane(node.at)) for node in (one, other)]
            geometry = {"type": "LineString", "coordinates": ends}
            features.append({"type": "Feature", "geometry": geometry, "properties": properties})
        kind = "planar" if self.plane.centre is None else "geographic"
        skyway = {"format": 1, "coordinates": kind}
        return {"type": "FeatureCollection", "name": "judged", "skyway": skyway, "features": features}


def make_network(dice: random.Random, side_m: float) -> Network:
    """Rooftops in a square, each joined with its nearest; some pairs upright, some lines exactly north."""
    count = dice.randint(30, 80)
    geographic = dice.random() < 0.5
    heights = dice.choice(["none", "agl", "agl", "amsl", "mixed"])
    numbered = dice.random() < 0.6
    points = [(dice.uniform(0, side_m), dice.uniform(0, side_m)) for _ in range(count)]
    for _ in range(3):
        points.append((points[dice.randrange(count)][0], dice.uniform(0, side_m)))
    names = dice.sample(range(1, 1000), len(points) + 2)
    nodes = []
    for name, at in zip(names, points):
        identity = str(name) if numbered else f"n{name}"
        nodes.append(Node(identity, at, dice.choice([0, 0, 1, 1, 2, 3]), *altitude(dice, heights)))
    plane = Plane((151.2, -33.87) if dice.random() < 0.7 else (-97.9, 29.88)) if geographic else Plane(None)
    if geographic:
        plane = settle(plane, nodes)
    segments = join(dice, nodes, side_m)
    for name in names[len(points) :]:
        segments.append(upright(dice, nodes, str(name) if numbered else f"n{name}", numbered))
    return Network(plane, nodes, segments, numbered)


def settle(plane: Plane, nodes: list[Node]) -> Plane:
    """Rounds places to seven decimals of a degree, about the centre that the network then has."""
    places = [plane.from_plane(node.at) for node in nodes]
    rounded = [(round(lon, 7), round(lat, 7)) for lon, lat in places]
    lons, lats = zip(*rounded)
    settled = Plane(((min(lons) + max(lons)) / 2, (min(lats) + max(lats)) / 2))
    for node, place in zip(nodes, rounded):
        node.at = settled.to_plane(place)
    return settled


def altitude(dice: random.Random, heights: str) -> tuple[float | None, str]:
    if heights == "none" or (heights == "mixed" and dice.random() < 0.4):
        return None, "agl"
    reference = heights if heights in ("agl", "amsl") else dice.choice(["agl", "amsl"])
    return float(dice.randint(10, 110)), reference


def segment_id(one: str, other: str, numbered: bool) -> str:
    """`A-B`, the first in node order first."""
    first, second = sorted((one, other), key=int) if numbered else sorted((one, other), key=str.encode)
    return f"{first}-{second}"


def join(dice: random.Random, nodes: list[Node], side_m: float) -> list[Segment]:
    neighbours = dice.choice([3, 4, 5])
    numbered = nodes[0].id.isdigit()
    pairs: set[tuple[int, int]] = set()
    for index, node in enumerate(nodes):
        order = sorted(range(len(nodes)), key=lambda other: distance(node.at, nodes[other].at))
        for other in order[1 : neighbours + 1]:
            if 1.0 < distance(node.at, nodes[other].at) < 0.45 * side_m:
                pairs.add((min(index, other), max(index, other)))
    segments = []
    for first, second in sorted(pairs):
        one, other = nodes[first], nodes[second]
        straight = distance(one.at, other.at)
        length = straight if dice.random() < 0.6 else straight * dice.uniform(1.0, 1.15)
        segments.append(
            Segment(
                segment_id(one.id, other.id, numbered),
                (one.id, other.id),
                round(length + 5e-4, 3),
                *band(dice, one, other),
                dice.uniform(6, 14) if dice.random() < 0.12 else None,
            )
        )
    return segments


def band(dice: random.Random, one: Node, other: Node) -> tuple[float | None, float | None, str]:
    """Often that of both roofs, which is steep where they differ."""
    if one.altitude_m is None or other.altitude_m is None or one.reference != other.reference:
        return (None, None, "agl") if dice.random() < 0.5 else (40.0, 80.0, dice.choice(["agl", "amsl"]))
    lower = min(one.altitude_m, other.altitude_m) + 5
    upper = max(one.altitude_m, other.altitude_m) + 5 + dice.choice([0.0, 10.0, 30.0])
    return lower, upper + 1, one.reference


def upright(dice: random.Random, nodes: list[Node], identity: str, numbered: bool) -> Segment:
    """A node above another one, and the segment that goes straight up."""
    below = dice.choice(nodes)
    height = float(dice.randint(15, 60))
    base = below.altitude_m if below.altitude_m is not None else 20.0
    above = Node(identity, below.at, dice.choice([0, 1]), base + height, below.reference)
    nodes.append(above)
    name = segment_id(below.id, above.id, numbered)
    return Segment(name, (below.id, above.id), height, base, base + height, below.reference, None)


@dataclasses.dataclass
class Zone:
    id: str
    shape: Circle | Polygons
    margin_m: float
    lower_m: float | None
    lower_reference: str
    upper_m: float | None
    upper_reference: str
    # Seconds since 1970; none: always.
    windows: list[tuple[float | None, float | None]]
    feature: dict

    def reaches(self, lower_m: float | None, upper_m: float | None, reference: str) -> bool:
        """Whether its band meets another one. What cannot be compared reaches."""
        over = (
            self.lower_m is not None
            and upper_m is not None
            and self.lower_reference == reference
            and self.lower_m > upper_m
        )
        under = (
            self.upper_m is not None
            and lower_m is not None
            and self.upper_reference == reference
            and self.upper_m < lower_m
        )
        return not over and not under

    def everywhere_high(self) -> bool:
        return self.lower_m is None and self.upper_m is None

    def meets(self, begins_s: float, ends_s: float) -> bool:
        """Whether a window of it meets a time."""
        if not self.windows:
            return True
        return any(
            (since is None or since <= ends_s) and (until is None or until >= begins_s) for since, until in self.windows
        )

    def active_at(self, at_s: float) -> bool:
        return self.meets(at_s, at_s)

    def ends_s(self, at_s: float) -> float | None:
        """When the window that covers an instant ends."""
        for since, until in self.windows:
            if (since is None or since <= at_s) and (until is None or until >= at_s):
                return until
        return None


def text_of(at_s: float) -> str:
    import datetime

    return datetime.datetime.fromtimestamp(at_s, datetime.UTC).isoformat().replace("+00:00", "Z")


WINDOWS = {
    "always": [],
    "now": [(-1800.0, 1800.0)],
    "now_open": [(-1800.0, None)],
    "later": [(5 * 3600.0, 6 * 3600.0)],
    "over": [(-7200.0, -3600.0)],
    "two": [(-7200.0, -3600.0), (-300.0, 900.0)],
}


def make_zone(dice: random.Random, network: Network, identity: str, scale_m: float) -> Zone:
    """About a leg, a node, or anywhere; most count now."""
    segment = dice.choice(network.segments)
    one, other = (network.nodes[end].at for end in segment.ends)
    centre = along(one, other, dice.choice([0.0, 0.2, 0.5, 0.8, 1.0, dice.random()]))
    if dice.random() < 0.3:
        centre = (centre[0] + dice.gauss(0, scale_m / 2), centre[1] + dice.gauss(0, scale_m / 2))
    radius = scale_m * dice.uniform(0.06, 0.5)
    kind = dice.choice(["circle", "circle", "polygon", "ring", "several"])
    shape, geometry = make_shape(dice, network.plane, kind, centre, radius)
    properties: dict = {"reason": "judged"}
    if kind == "circle":
        properties["radius_m"] = radius
    margin = dice.choice([MARGIN_M, MARGIN_M, MARGIN_M, 0.0, 25.0])
    properties["margin_m"] = margin
    lower, upper, references = None, None, ("agl", "agl")
    if dice.random() < 0.25:
        references = (dice.choice(["agl", "amsl"]),) * 2
        lower = dice.choice([None, dice.uniform(20, 90)])
        upper = dice.choice([None, (lower or 0.0) + dice.uniform(20, 90)])
        if lower is not None:
            properties |= {"lower_m": lower, "lower_reference": references[0]}
        if upper is not None:
            properties |= {"upper_m": upper, "upper_reference": references[1]}
    name = dice.choice(["always", "always", "always", "now", "now", "now_open", "soon", "later", "over", "two"])
    ahead = [(float(dice.randint(90, 400)), 2400.0)]
    chosen = ahead if name == "soon" else WINDOWS[name]
    windows = [tuple(None if end is None else NOW_S + end for end in window) for window in chosen]
    if windows:
        properties["windows"] = [
            {word: text_of(end) for word, end in zip(("from", "until"), window) if end is not None}
            for window in windows
        ]
    feature = {"type": "Feature", "id": identity, "geometry": geometry, "properties": properties}
    return Zone(identity, shape, margin, lower, references[0], upper, references[1], windows, feature)


def make_squeeze(network: Network, segment: Segment, begins_s: float) -> Zone:
    """A small zone over the middle of a leg that begins at an instant."""
    one, other = (network.nodes[end].at for end in segment.ends)
    centre, radius = along(one, other, 0.5), 15.0
    shape = Circle(centre, radius)
    windows = [(begins_s, begins_s + 3600.0)]
    told = [{"from": text_of(begins_s), "until": text_of(begins_s + 3600.0)}]
    properties = {"reason": "judged", "radius_m": radius, "margin_m": MARGIN_M, "windows": told}
    geometry = {"type": "Point", "coordinates": list(network.plane.from_plane(centre))}
    feature = {"type": "Feature", "id": "squeeze", "geometry": geometry, "properties": properties}
    return Zone("squeeze", shape, MARGIN_M, None, "agl", None, "agl", windows, feature)


def make_shape(dice: random.Random, plane: Plane, kind: str, centre: Point, radius: float):
    """The shape on the plane, and as it goes over the wire."""
    if kind == "circle":
        return Circle(centre, radius), {"type": "Point", "coordinates": list(plane.from_plane(centre))}
    if kind == "polygon":
        polygons = [[star(dice, centre, radius)]]
    elif kind == "ring":
        polygons = [[star(dice, centre, radius), star(dice, centre, radius * 0.35)]]
    else:
        beside = (centre[0] + 2.5 * radius, centre[1] + dice.uniform(-1, 1) * radius)
        polygons = [[star(dice, centre, radius)], [star(dice, beside, radius * 0.8)]]
    on_wire = [
        [[list(plane.from_plane(corner)) for corner in (*ring, ring[0])] for ring in polygon] for polygon in polygons
    ]
    if len(on_wire) == 1:
        return Polygons(polygons), {"type": "Polygon", "coordinates": on_wire[0]}
    return Polygons(polygons), {"type": "MultiPolygon", "coordinates": on_wire}


def star(dice: random.Random, centre: Point, radius: float) -> list[Point]:
    """A ring about a centre that does not cross itself, at least 0.6 of a radius away and at most one."""
    corners = dice.randint(4, 8)
    turn = dice.uniform(0, 1)
    ring = []
    for index in range(corners):
        angle = 2 * math.pi * (index + turn) / corners
        reach = radius * dice.uniform(0.75, 1.0)
        ring.append((centre[0] + reach * math.cos(angle), centre[1] + reach * math.sin(angle)))
    return ring


@dataclasses.dataclass
class Closure:
    """What an operator closed, or a report did: without a shape."""

    id: str
    segments: set[str]
    nodes: set[str]
    pads: set[str]
    windows: list[tuple[float | None, float | None]]
    # Where its cause is, where a report said so.
    cause: Point | None
    by_report: bool = False
    body: dict | None = None
    # A closure that counts for some and not for others.
    is_doubtful: bool = False

    def meets(self, begins_s: float, ends_s: float) -> bool:
        if not self.windows:
            return True
        return any(
            (since is None or since <= ends_s) and (until is None or until >= begins_s) for since, until in self.windows
        )


def make_closure(dice: random.Random, network: Network, identity: str) -> Closure:
    body: dict = {"id": identity, "reason": "judged"}
    closure = Closure(identity, set(), set(), set(), [], None, body=body)
    kind = dice.choice(["segments", "segments", "node", "pads"])
    if kind == "segments":
        closure.segments = {segment.id for segment in dice.sample(network.segments, dice.randint(1, 4))}
        body["segments"] = sorted(closure.segments)
    elif kind == "node":
        closure.nodes = {dice.choice(list(network.nodes))}
        body["nodes"] = [network.id_on_wire(node) for node in sorted(closure.nodes)]
    else:
        closure.pads = set(dice.sample(sorted(network.nodes), 3))
        body["pads"] = [network.id_on_wire(node) for node in sorted(closure.pads)]
    if dice.random() < 0.3:
        until = NOW_S + dice.choice([1500.0, 4000.0])
        closure.windows = [(None, until)]
        body["until"] = text_of(until)
    return closure


@dataclasses.dataclass
class Wind:
    speed_mps: float = 0.0
    from_deg: float = 0.0


@dataclasses.dataclass
class World:
    """What an answer is judged by."""

    network: Network
    zones: list[Zone]
    closures: list[Closure]
    wind: Wind
    flown: bool
    # Other plans' stays and legs, by node and by segment: those answers keep clear of.
    plans: list[dict] = dataclasses.field(default_factory=list)
    # Kept by `segment_state`, for as long as nothing changes.
    kept: dict = dataclasses.field(default_factory=dict)

    def changed(self) -> None:
        self.kept.clear()

    def near(self, zone: Zone, start: Point, end: Point, grown_m: float) -> list[Interval]:
        """Parts of a line within a zone and its margin, the margin `grown_m` wider."""
        margin = zone.margin_m + grown_m
        low_x, low_y, high_x, high_y = zone.shape.box()
        if min(start[0], end[0]) > high_x + margin or max(start[0], end[0]) < low_x - margin:
            return []
        if min(start[1], end[1]) > high_y + margin or max(start[1], end[1]) < low_y - margin:
            return []
        if margin >= 0.0:
            return zone.shape.near(start, end, margin)
        # A shape without a margin cannot shrink: its part of the line does.
        least = -margin / max(distance(start, end), -margin)
        parts = [
            (low if low <= 0.0 else low + least, high if high >= 1.0 else high - least)
            for low, high in zone.shape.near(start, end, 0.0)
        ]
        return [(low, high) for low, high in parts if low < high]

    def hits(self, zone: Zone, segment: Segment) -> str:
        """Whether a zone closes a segment: `yes`, `no`, or `maybe` where the margin just touches it."""
        key = (zone.id, segment.id)
        if key not in self.kept:
            self.kept[key] = self._hits(zone, segment)
        return self.kept[key]

    def _hits(self, zone: Zone, segment: Segment) -> str:
        if not zone.reaches(segment.lower_m, segment.upper_m, segment.reference):
            return "no"
        one, other = (self.network.nodes[end].at for end in segment.ends)
        if not self.near(zone, one, other, DOUBT_M):
            return "no"
        return "yes" if self.near(zone, one, other, -DOUBT_M) else "maybe"

    def covers(self, zone: Zone, node: Node) -> str:
        """Whether a zone closes a node."""
        key = (zone.id, "node", node.id)
        if key not in self.kept:
            self.kept[key] = self._covers(zone, node)
        return self.kept[key]

    def _covers(self, zone: Zone, node: Node) -> str:
        away = zone.shape.distance_to(node.at) - zone.margin_m
        if away > DOUBT_M:
            return "no"
        if not zone.reaches(node.altitude_m, node.altitude_m, node.reference):
            return "no"
        return "yes" if away < -DOUBT_M or (zone.margin_m == 0.0 and away <= 0.0) else "maybe"


def make_airspace(dice: random.Random, network: Network, flown: bool, scale_m: float) -> World:
    """Zones, an operator's closures and the wind over a network."""
    zones = [make_zone(dice, network, f"z{index}", scale_m) for index in range(dice.randint(1, 5))]
    closures = [make_closure(dice, network, f"c{index}") for index in range(dice.randint(0, 3))]
    wind = Wind()
    if flown and dice.random() < 0.4:
        wind = Wind(dice.choice([3.0, 5.0, 6.5, 8.0]), float(dice.randrange(360)))
    return World(network, zones, closures, wind, flown)
