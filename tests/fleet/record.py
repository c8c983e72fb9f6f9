"""Reads a record of `skyway-loadtest fleet`: what each drone flew, nominally, and was told.

Nothing here asks the edge. A drone flies its first version from when it was composed, and a later
one from the event that says that it was acknowledged.
"""

import dataclasses
import datetime
import json
import math
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "judge"))

from geometry import Circle, Plane, Polygons  # noqa: E402  (of the judge of answers)

# What tells a plan's drone an outcome.
OUTCOMES = ("plan_affected", "plan_relieved")
MARGIN_M = 10.0


@dataclasses.dataclass
class Move:
    """A line that a drone flies between two instants."""

    plan: str
    # None off the network.
    segment: str | None
    ends: tuple[str, str]
    enters_s: float
    leaves_s: float
    # Until when it is flown: a drone that takes over another version leaves it before its end.
    until_s: float
    line: list[tuple[float, float, float | None]]
    # From when it is flown, where its version was taken over on the way.
    since_s: float = -math.inf
    _along: list[float] = dataclasses.field(default_factory=list)

    def lengths(self) -> list[float]:
        """How long each piece of the line is, in the air."""
        return [
            math.dist((*one[:2], one[2] or 0.0), (*other[:2], other[2] or 0.0))
            for one, other in zip(self.line, self.line[1:])
        ]

    def at(self, at_s: float) -> tuple[float, float, float | None]:
        """Where the drone is, at the same speed all along."""
        if not self._along:
            self._along = [0.0]
            for length in self.lengths():
                self._along.append(self._along[-1] + length)
        took_s = self.leaves_s - self.enters_s
        part = 1.0 if took_s <= 0 else min(1.0, max(0.0, (at_s - self.enters_s) / took_s))
        reached = part * self._along[-1]
        for index, end in enumerate(self._along[1:]):
            if reached <= end or index == len(self._along) - 2:
                begin = self._along[index]
                share = 0.0 if end == begin else (reached - begin) / (end - begin)
                one, other = self.line[index], self.line[index + 1]
                height = None if one[2] is None or other[2] is None else one[2] + (other[2] - one[2]) * share
                return (one[0] + (other[0] - one[0]) * share, one[1] + (other[1] - one[1]) * share, height)
        return self.line[0]


@dataclasses.dataclass
class Stay:
    """A pad that a plan takes."""

    plan: str
    node: str
    pad: int
    lands_s: float
    leaves_s: float


@dataclasses.dataclass
class Version:
    """A version of a plan, and from when until when its drone flies it; never where it does not."""

    plan: str
    number: int
    outcome: str
    sent_s: float
    flags: list[str]
    moves: list[Move]
    stays: list[Stay]
    # With the flight model, the battery at the first node of each leg.
    batteries: list[float] = dataclasses.field(default_factory=list)
    from_s: float = math.inf
    until_s: float = math.inf

    def flown(self) -> list[Move]:
        """What is flown of it."""
        return [move for move in self.moves if move.until_s > max(move.enters_s, self.from_s)]


@dataclasses.dataclass
class Zone:
    """A zone, and from when until when it stands."""

    id: str
    shape: Circle | Polygons
    margin_m: float
    windows: list[tuple[float, float]]
    put_s: float
    gone_s: float = math.inf
    # When all that it meets were told, as the edge says.
    replanned_s: float = math.inf
    replanned: dict | None = None
    # Only zones of any height are judged.
    has_band: bool = False
    # By when it surely stood: later where the edge was killed before it said so.
    stood_s: float = 0.0

    def __post_init__(self) -> None:
        self.stood_s = max(self.stood_s, self.put_s)

    def meets(self, from_s: float, until_s: float) -> bool:
        """Whether it is in force at some time of a stretch of time."""
        from_s, until_s = max(from_s, self.put_s), min(until_s, self.gone_s)
        return any(from_s < min(until_s, end) and start < until_s for start, end in self.windows if from_s < end)


@dataclasses.dataclass
class Told:
    """An outcome that a plan's drone was told."""

    plan: str
    at_s: float
    outcome: str
    causes: frozenset[str]
    # How often airspace had changed until then, or the edge was killed.
    changes: int
    # Causes that were there already.
    known: frozenset[str] = frozenset()
    # Of what a list tells: the version that is to be flown, and when it was made.
    wanted: int = 0
    made_s: float = 0.0


class Record:
    """All of a run."""

    def __init__(self, lines) -> None:
        self.run: dict = {}
        self.plane = Plane(None)
        self.network: dict = {}
        self.versions: dict[str, dict[int, Version]] = {}
        # By plan, when its pack was read, and the pack.
        self.packs: dict[str, tuple[float, bytes]] = {}
        self.zones: dict[str, Zone] = {}
        self.told: list[Told] = []
        # What drones were told by lists alone, after a kill.
        self.listed: list[Told] = []
        # When the edge was there again after each kill.
        self.kills: list[float] = []
        self.ended: dict[str, float] = {}
        self.alarms: list[dict] = []
        self.standing: dict[str, dict] = {}
        self.refused = 0
        self._acknowledged: dict[str, list[tuple[float, int]]] = {}
        self._changes = 0
        self._lines: dict | None = None
        for line in lines:
            entry = json.loads(line)
            getattr(self, f"_read_{entry['kind']}")(entry)
        for plan, versions in self.versions.items():
            self._set_times(plan, versions)

    def flown(self) -> list[Version]:
        """All versions that drones fly, or part of them."""
        every = (version for versions in self.versions.values() for version in versions.values())
        return [version for version in every if version.from_s < version.until_s]

    def near(self, zone: Zone) -> list[Version]:
        """Flown versions with a line whose box meets a zone's; each line is looked at once."""
        if self._lines is None:
            self._lines = {}
            for version in self.flown():
                for move in version.moves:
                    key = (move.segment, move.ends) if move.segment else (id(move), move.ends)
                    xs, ys = [corner[0] for corner in move.line], [corner[1] for corner in move.line]
                    box = (min(xs), min(ys), max(xs), max(ys))
                    self._lines.setdefault(key, (box, {}))[1][version.plan, version.number] = version
        left, low, right, high = zone.shape.box()
        reach_m = zone.margin_m
        near: dict[tuple[str, int], Version] = {}
        for box, versions in self._lines.values():
            if box[2] >= left - reach_m and box[0] <= right + reach_m:
                if box[3] >= low - reach_m and box[1] <= high + reach_m:
                    near.update(versions)
        return list(near.values())

    def _read_run(self, entry: dict) -> None:
        self.run = entry

    def _read_refused(self, _entry: dict) -> None:
        self.refused += 1

    def _read_plan(self, entry: dict) -> None:
        self.standing[entry["id"]] = entry

    def _read_restarted(self, entry: dict) -> None:
        self.kills.append(instant(entry["at"]))
        self._changes += 1

    def _read_found(self, entry: dict) -> None:
        if entry["zone"]["id"] not in self.zones:
            zone = self._zone(entry["zone"], instant(entry["sent_at"]))
            zone.stood_s = instant(entry["at"])
            self.zones[zone.id] = zone

    def _read_listed(self, entry: dict) -> None:
        """What a list says and no event did, as far as the list tells since when it is so."""
        plan, at_s = entry["id"], instant(entry["at"])
        if entry["state"] == "ended":
            self.ended.setdefault(plan, at_s)
        # What an edge tells before it has stored it may be undone by a kill: its drone has no answer then.
        turns = [turn for turn in self._acknowledged.get(plan, []) if turn[1] <= entry["reported"]]
        if entry["reported"] != 1 and all(number != entry["reported"] for _, number in turns):
            turns.append((at_s, entry["reported"]))
        self._acknowledged[plan] = turns
        causes = frozenset(entry["affected_by"])
        known = causes & self.zones.keys()
        if entry["wanted"] is not None:
            made_s = instant(entry["sent_at"])
            told = Told(plan, at_s, entry["outcome"], causes, self._changes, known, entry["wanted"], made_s)
            self.listed.append(told)
        elif entry["state"] == "contingent":
            self.listed.append(Told(plan, at_s, "no_route", causes, self._changes, known, made_s=at_s))

    def _read_network(self, entry: dict) -> None:
        self.network = network = entry["network"]
        places = [f["geometry"]["coordinates"] for f in network["features"] if f["properties"]["kind"] == "node"]
        if network["skyway"]["coordinates"] == "geographic":
            lons, lats = zip(*(place[:2] for place in places))
            self.plane = Plane(((min(lons) + max(lons)) / 2, (min(lats) + max(lats)) / 2))

    def _read_pack(self, entry: dict) -> None:
        self.packs[entry["plan_id"]] = (instant(entry["at"]), bytes.fromhex(entry["bytes"]))

    def _read_version(self, entry: dict) -> None:
        plan = entry["plan_id"]
        moves = [self._move(plan, leg) for leg in entry["legs"]]
        stretch = entry.get("first_stretch")
        sent_s = instant(entry["sent_at"])
        if stretch and stretch["kind"] != "none" and len(stretch["geometry"]) > 1:
            arrives_s = moves[0].enters_s if moves else instant(entry["departs_at"])
            line = [self._corner(corner) for corner in stretch["geometry"]]
            moves.insert(0, Move(plan, None, ("", stretch["enters"]), sent_s, arrives_s, arrives_s, line))
        stays = [
            Stay(plan, str(stop["node"]), stop["pad"], instant(stop["lands_at"]), instant(stop["takes_off_at"]))
            for stop in entry.get("stops") or []
        ]
        version = Version(plan, entry["version"], entry["outcome"], sent_s, entry.get("flags") or [], moves, stays)
        version.batteries = [leg.get("battery_before_fraction", math.nan) for leg in entry["legs"]]
        self.versions.setdefault(plan, {})[version.number] = version

    def _corner(self, corner: list) -> tuple[float, float, float | None]:
        x, y = self.plane.to_plane((corner[0], corner[1]))
        return (x, y, corner[2] if len(corner) > 2 else None)

    def _move(self, plan: str, leg: dict) -> Move:
        line = [self._corner(corner) for corner in leg["geometry"]]
        enters_s, leaves_s = instant(leg["departs_at"]), instant(leg["arrives_at"])
        return Move(plan, leg["segment"], (str(leg["from"]), str(leg["to"])), enters_s, leaves_s, leaves_s, line)

    def _read_event(self, entry: dict) -> None:
        event = entry["event"]
        kind, data, at_s = event["kind"], event["data"], instant(event["at"])
        if kind == "zone_put":
            self._changes += 1
            zone = self._zone(data["zone"], at_s)
            self.zones[zone.id] = zone
        elif kind == "zone_deleted":
            self._changes += 1
            if data["zone_id"] in self.zones:
                self.zones[data["zone_id"]].gone_s = at_s
        elif kind == "replanned" and data["closure_id"] in self.zones:
            self.zones[data["closure_id"]].replanned_s = at_s
            self.zones[data["closure_id"]].replanned = data
        elif kind in OUTCOMES:
            causes = frozenset(data["causes"])
            known = causes & self.zones.keys()
            self.told.append(Told(data["plan"]["id"], at_s, data["outcome"], causes, self._changes, known))
        elif kind == "plan_acknowledged":
            plan = data["plan"]
            self._acknowledged.setdefault(plan["id"], []).append((at_s, plan["reported"]["version"]))
        elif kind == "plan_ended":
            self.ended[data["plan"]["id"]] = at_s
        elif kind == "alarm_raised":
            self.alarms.append(data["alarm"])

    def _zone(self, feature: dict, at_s: float) -> Zone:
        told = feature["properties"]
        geometry = feature["geometry"]
        if geometry["type"] == "Point":
            shape: Circle | Polygons = Circle(self.plane.to_plane(tuple(geometry["coordinates"][:2])), told["radius_m"])
        else:
            polygons = [geometry["coordinates"]] if geometry["type"] == "Polygon" else geometry["coordinates"]
            shape = Polygons(
                [[[self.plane.to_plane(tuple(p[:2])) for p in ring[:-1]] for ring in polygon] for polygon in polygons]
            )
        windows = [
            (instant(w["from"]) if "from" in w else -math.inf, instant(w["until"]) if "until" in w else math.inf)
            for w in told.get("windows") or [{}]
        ]
        has_band = "lower_m" in told or "upper_m" in told
        return Zone(feature["id"], shape, told.get("margin_m", MARGIN_M), windows, at_s, has_band=has_band)

    def _set_times(self, plan: str, versions: dict[int, Version]) -> None:
        """Each is flown from when it was taken over until the next one is, or the plan ends."""
        first = min(versions)
        turns = [(versions[first].sent_s, first)] if first == 1 else []
        turns += sorted(self._acknowledged.get(plan, []))
        ends = [at_s for at_s, _ in turns[1:]] + [self.ended.get(plan, math.inf)]
        for (from_s, number), until_s in zip(turns, ends):
            version = versions.get(number)
            if version is None:
                continue
            version.from_s, version.until_s = from_s, min(until_s, self.ended.get(plan, math.inf))
            for move in version.moves:
                move.since_s = version.from_s
                move.until_s = min(move.leaves_s, version.until_s)


def instant(text: str) -> float:
    """Seconds since 1970, with all digits that a float has."""
    head, _, digits = text.rstrip("Z").partition(".")
    whole = datetime.datetime.fromisoformat(head + "+00:00").timestamp()
    return whole + (float(f"0.{digits}") if digits else 0.0)


def read(path: pathlib.Path) -> Record:
    with path.open() as lines:
        return Record(lines)


