"""Plane geometry of the judge: its own projection, shapes with margins, and where a line is near a shape.

Everything is in metres on a plane. Nothing here knows networks, zones or answers.
"""

import math

# WGS 84.
SEMI_MAJOR_M = 6_378_137.0
FLATTENING = 1 / 298.257223563
ECCENTRICITY_SQUARED = FLATTENING * (2 - FLATTENING)

Point = tuple[float, float]
Interval = tuple[float, float]


class Plane:
    """Longitude and latitude laid on a plane about a centre; a planar network is its own plane."""

    def __init__(self, centre: Point | None) -> None:
        self.centre = centre
        if centre is None:
            return
        latitude = math.radians(centre[1])
        bend = 1 - ECCENTRICITY_SQUARED * math.sin(latitude) ** 2
        prime_vertical = SEMI_MAJOR_M / math.sqrt(bend)
        meridian = SEMI_MAJOR_M * (1 - ECCENTRICITY_SQUARED) / bend**1.5
        self._east_m = math.radians(1) * prime_vertical * math.cos(latitude)
        self._north_m = math.radians(1) * meridian

    def to_plane(self, place: Point) -> Point:
        """Degrees, or metres of a planar network, as metres."""
        if self.centre is None:
            return place
        return ((place[0] - self.centre[0]) * self._east_m, (place[1] - self.centre[1]) * self._north_m)

    def from_plane(self, point: Point) -> Point:
        """Metres as what goes over the wire."""
        if self.centre is None:
            return point
        return (self.centre[0] + point[0] / self._east_m, self.centre[1] + point[1] / self._north_m)


def distance(one: Point, other: Point) -> float:
    return math.hypot(one[0] - other[0], one[1] - other[1])


def along(start: Point, end: Point, fraction: float) -> Point:
    return (start[0] + (end[0] - start[0]) * fraction, start[1] + (end[1] - start[1]) * fraction)


def project(point: Point, start: Point, end: Point) -> tuple[float, float]:
    """The fraction of start -> end that is nearest to a point, and how far off it is."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    squared = dx * dx + dy * dy
    if squared == 0.0:
        return 0.0, distance(point, start)
    fraction = ((point[0] - start[0]) * dx + (point[1] - start[1]) * dy) / squared
    fraction = min(1.0, max(0.0, fraction))
    return fraction, distance(point, along(start, end, fraction))


class Circle:
    """All points within a radius of a centre."""

    def __init__(self, centre: Point, radius_m: float) -> None:
        self.centre = centre
        self.radius_m = radius_m

    def distance_to(self, point: Point) -> float:
        """0 within it."""
        return max(0.0, distance(point, self.centre) - self.radius_m)

    def near(self, start: Point, end: Point, margin_m: float) -> list[Interval]:
        """Parts of start -> end, as fractions, that are within a margin of it."""
        return merged([disc_interval(start, end, self.centre, self.radius_m + margin_m)])

    def box(self) -> tuple[float, float, float, float]:
        (x, y), r = self.centre, self.radius_m
        return (x - r, y - r, x + r, y + r)


class Polygons:
    """Polygons, each an outer ring and its holes; rings are open lists of points."""

    def __init__(self, polygons: list[list[list[Point]]]) -> None:
        self.polygons = polygons
        self._edges = [
            (ring[index - 1], ring[index]) for polygon in polygons for ring in polygon for index in range(len(ring))
        ]
        xs = [point[0] for polygon in polygons for point in polygon[0]]
        ys = [point[1] for polygon in polygons for point in polygon[0]]
        self._box = (min(xs), min(ys), max(xs), max(ys))

    def box(self) -> tuple[float, float, float, float]:
        return self._box

    def contains(self, point: Point) -> bool:
        return any(
            in_ring(point, polygon[0]) and not any(in_ring(point, hole) for hole in polygon[1:])
            for polygon in self.polygons
        )

    def distance_to(self, point: Point) -> float:
        """0 within it."""
        if self.contains(point):
            return 0.0
        return min(project(point, first, second)[1] for first, second in self._edges)

    def near(self, start: Point, end: Point, margin_m: float) -> list[Interval]:
        """Parts of start -> end, as fractions, that are within a margin of it."""
        pieces: list[Interval | None] = []
        cuts = [0.0, 1.0]
        for first, second in self._edges:
            pieces.append(disc_interval(start, end, first, margin_m))
            pieces.append(strip_interval(start, end, first, second, margin_m))
            cut = crossing(start, end, first, second)
            if cut is not None:
                cuts.append(cut)
        cuts.sort()
        for low, high in zip(cuts, cuts[1:]):
            if self.contains(along(start, end, (low + high) / 2)):
                pieces.append((low, high))
        return merged(pieces)


def in_ring(point: Point, ring: list[Point]) -> bool:
    """By the number of edges that a ray to the right crosses."""
    x, y = point
    inside = False
    before = ring[-1]
    for corner in ring:
        if (corner[1] > y) != (before[1] > y):
            at = before[0] + (y - before[1]) * (corner[0] - before[0]) / (corner[1] - before[1])
            if x < at:
                inside = not inside
        before = corner
    return inside


def disc_interval(start: Point, end: Point, centre: Point, radius_m: float) -> Interval | None:
    """Where start -> end is within a disc."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    px, py = start[0] - centre[0], start[1] - centre[1]
    a = dx * dx + dy * dy
    c = px * px + py * py - radius_m * radius_m
    if a == 0.0:
        return (0.0, 1.0) if c <= 0 else None
    b = px * dx + py * dy
    root = b * b - a * c
    if root < 0:
        return None
    root = math.sqrt(root)
    return clipped((-b - root) / a, (-b + root) / a)


def strip_interval(start: Point, end: Point, first: Point, second: Point, margin_m: float) -> Interval | None:
    """Where start -> end is beside an edge, within a margin of it."""
    ex, ey = second[0] - first[0], second[1] - first[1]
    length = math.hypot(ex, ey)
    if length == 0.0:
        return None
    ex, ey = ex / length, ey / length
    px, py = start[0] - first[0], start[1] - first[1]
    dx, dy = end[0] - start[0], end[1] - start[1]
    forward = linear_interval(px * ex + py * ey, dx * ex + dy * ey, 0.0, length)
    sideways = linear_interval(px * ey - py * ex, dx * ey - dy * ex, -margin_m, margin_m)
    if forward is None or sideways is None:
        return None
    return clipped(max(forward[0], sideways[0]), min(forward[1], sideways[1]))


def linear_interval(value: float, slope: float, low: float, high: float) -> Interval | None:
    """Where `value + t slope` is between two bounds."""
    if abs(slope) < 1e-15:
        return (-math.inf, math.inf) if low <= value <= high else None
    one, other = (low - value) / slope, (high - value) / slope
    return (min(one, other), max(one, other))


def clipped(low: float, high: float) -> Interval | None:
    low, high = max(0.0, low), min(1.0, high)
    return (low, high) if low <= high else None


def crossing(start: Point, end: Point, first: Point, second: Point) -> float | None:
    """The fraction of start -> end at which it crosses an edge."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    ex, ey = second[0] - first[0], second[1] - first[1]
    cross = dx * ey - dy * ex
    if cross == 0.0:
        return None
    px, py = first[0] - start[0], first[1] - start[1]
    here = (px * ey - py * ex) / cross
    there = (px * dy - py * dx) / cross
    return here if 0.0 <= here <= 1.0 and 0.0 <= there <= 1.0 else None


def merged(pieces: list[Interval | None]) -> list[Interval]:
    """Intervals in order, overlapping ones as one."""
    together: list[Interval] = []
    for low, high in sorted(piece for piece in pieces if piece is not None):
        if together and low <= together[-1][1] + 1e-12:
            together[-1] = (together[-1][0], max(together[-1][1], high))
        else:
            together.append((low, high))
    return together
