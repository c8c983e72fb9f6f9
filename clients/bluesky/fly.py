#!/usr/bin/env python3
"""BlueSky flies drones on the plans of an edge, while zones close over them and failures are reported.

fly.py EDGE FOLDER [--drones 25] [--seed 1] [--network FILE]

The edge has to run with `--clock external`; BlueSky's time moves it, second by second. FOLDER gets BlueSky's own log of
where everybody was (output/TRACK_*.log) and the record of what was said (record.ndjson), which judge.py reads.
"""

import argparse
import contextlib
import dataclasses
import io
import json
import math
import pathlib
import random

import bluesky as bs
from bluesky import stack
from bluesky.core import simtime

from gateway import Gateway, Record, name_of, place, plan_of, recomposition, session, telemetry

NETWORK = pathlib.Path(__file__).resolve().parents[2] / "data/sydney-cbd.geojson"
STEP_S, STEPS = 0.1, 10
# What drones are planned with and may fly to catch up; BlueSky's M600 does 18.
PLANNED_MPS, FASTEST_MPS = 10.0, 12.0
# BlueSky takes speeds from 0.1 to 2 for Mach numbers.
SLOWEST_MPS = 2.05
# BlueSky's drones brake by 3.5 m/s².
BRAKING_MPS2, CLIMB_MPS, BANK_DEG, G_MPS2 = 3.0, 4.5, 35.0, 9.80665
# How far a turn may lead off the way, and how far off the beginning of a version may be.
TURN_OFF_M, NEAR_M = 3.0, 30.0
EARTH_M = 6_371_000.0
DEPARTURES_S, LIMIT_S = 100, 900
# When the script closes, opens, reports and cuts the line.
ZONE_EVERY_S, ZONE_LASTS_S, ZONES_UNTIL_S, FAILURE_EVERY_S, CUT_AT_S, LAND_NOW_AT_S = 12, 90, 240, 23, 90, 130


class Plane:
    """Metres east and north around a city."""

    def __init__(self, lon: float, lat: float) -> None:
        self.lon, self.lat, self.east = lon, lat, math.cos(math.radians(lat))

    def xy(self, lon: float, lat: float) -> tuple[float, float]:
        scale = math.radians(1) * EARTH_M
        return (lon - self.lon) * self.east * scale, (lat - self.lat) * scale

    def lon_lat(self, x: float, y: float) -> tuple[float, float]:
        scale = math.degrees(1) / EARTH_M
        return self.lon + x * scale / self.east, self.lat + y * scale


@dataclasses.dataclass
class Piece:
    """A straight piece of way: where it ends, and between which times it is flown."""

    x: float
    y: float
    height_m: float
    departs_s: float
    arrives_s: float
    leg: int | None
    # Whether it stands on a pad until then.
    stands: bool


class Pilot:
    """Flies one drone of BlueSky, by its heading, speed and height, along what it has taken over."""

    def __init__(self, drone: str, plan, plane: Plane, starts) -> None:
        self.drone, self.plane, self.starts = drone, plane, starts
        self.is_flying = self.has_landed = self.holds = False
        self.x, self.y, self.height_m = self.corner(plan.reported.legs[0].geometry[0])
        self.speed_mps = self.heading_deg = 0.0
        self.reference = plan.reported.legs[0].height_reference
        self.take_over(plan.reported)

    def corner(self, point) -> tuple[float, float, float]:
        return (*self.plane.xy(point.x, point.y), point.height_m)

    def second(self, timestamp) -> float:
        return (timestamp.ToDatetime(self.starts.tzinfo) - self.starts).total_seconds()

    def take_over(self, version) -> None:
        """From now on it flies this version, from where it is."""
        self.version, self.ahead = version, []
        # It has no way on, and stays on its pad until it is offered one.
        self.holds = version.outcome == "hold" and not version.legs
        self.start = (self.x, self.y, self.height_m)
        departs_s = self.second(version.departs_at)
        if version.HasField("first_stretch"):
            line = self.beginning(version)
            # The first leg may depart later than it gets there: a stay on a pad comes between.
            enters_s = departs_s + version.first_stretch.length_m / PLANNED_MPS
            self.ahead = [Piece(*end, departs_s, enters_s, None, False) for end in line[self.joins(line)[1] + 1:]]
        elif version.legs and self.is_flying:
            # It is taken to be at the first node, which it may not have reached yet.
            self.ahead = [Piece(*self.beginning(version)[0], departs_s, departs_s, None, False)]
        stops = {stop.before_leg for stop in version.flight.stops}
        for number, leg in enumerate(version.legs):
            times = (self.second(leg.departs_at), self.second(leg.arrives_at))
            self.ahead += [Piece(*self.corner(point), *times, number, number in stops) for point in leg.geometry[1:]]

    def beginning(self, version) -> list:
        """The line on which a version begins; where it has none the drone lands where it is."""
        stretch = version.first_stretch.geometry
        points = stretch or (version.legs[0].geometry if version.legs else [])
        return [self.corner(point) for point in points] or [(self.x, self.y, self.height_m)]

    def joins(self, line: list) -> tuple[float, int]:
        """How far it is from a line, and on which of its pieces."""
        pieces = list(zip(line, line[1:])) or [(line[0], line[0])]
        return min((round(off_m((self.x, self.y), *piece)[0], 1), number) for number, piece in enumerate(pieces))

    def can_begin(self, version) -> bool:
        return not self.is_flying or self.joins(self.beginning(version))[0] <= NEAR_M

    def may_depart(self, now_s: float) -> bool:
        return not self.is_flying and not self.has_landed and bool(self.ahead) and now_s >= self.ahead[0].departs_s

    def read(self, index: int) -> None:
        """Where BlueSky has it."""
        self.x, self.y = self.plane.xy(bs.traf.lon[index], bs.traf.lat[index])
        self.height_m, self.speed_mps, self.heading_deg = bs.traf.alt[index], bs.traf.gs[index], bs.traf.hdg[index]

    def steer(self, index: int, now_s: float) -> None:
        """Sets heading, speed and height for the next step."""
        self.read(index)
        self.pass_corners()
        if not self.ahead or self.holds or self.ahead[0].departs_s > now_s + STEP_S:
            bs.traf.selspd[index] = 0.0
            bs.traf.selalt[index] = self.height_m
            self.has_landed = not self.ahead and not self.holds and self.speed_mps < 0.1
            return
        piece = self.ahead[0]
        length_m, along_m = self.progress(piece)
        carrot = min(along_m + max(4.0, self.speed_mps), length_m) / length_m
        target = [a + carrot * (b - a) for a, b in zip(self.start, (piece.x, piece.y))]
        heading_deg = math.degrees(math.atan2(target[0] - self.x, target[1] - self.y)) % 360.0
        off_deg = abs((heading_deg - self.heading_deg + 180) % 360 - 180)
        wanted_mps = self.speed(piece, length_m, along_m, now_s)
        if off_deg > 45.0 and self.speed_mps > 4.0:
            # It brakes before it turns: a U-turn at speed is a loop.
            heading_deg, wanted_mps = self.heading_deg, SLOWEST_MPS
        bs.traf.ap.trk[index] = heading_deg
        bs.traf.selspd[index] = wanted_mps
        share = min((along_m + self.speed_mps * STEP_S) / length_m, 1.0)
        height_m = self.start[2] + share * (piece.height_m - self.start[2])
        bs.traf.selalt[index] = height_m
        bs.traf.selvs[index] = max(min(abs(height_m - self.height_m) / STEP_S, 5.0), 0.11)

    def pass_corners(self) -> None:
        """Leaves the pieces behind that it has flown."""
        while self.ahead:
            length_m, along_m = self.progress(self.ahead[0])
            if length_m - along_m > max(1.0, self.speed_mps * STEP_S):
                return
            piece = self.ahead[0]
            off_end_m = math.dist((self.x, self.y), (piece.x, piece.y))
            if len(self.ahead) == 1 and (off_end_m > 1.5 or self.speed_mps > 2.5):
                # It is too fast to stop at its last corner, and comes back.
                self.start = (self.x, self.y, self.height_m)
                return
            self.ahead.pop(0)
            self.start = (piece.x, piece.y, piece.height_m)

    def progress(self, piece: Piece) -> tuple[float, float]:
        """The length of the piece that it is on, and how much of that it has flown."""
        length_m = max(math.dist(self.start[:2], (piece.x, piece.y)), 1e-3)
        return length_m, off_m((self.x, self.y), self.start, (piece.x, piece.y))[1] * length_m

    def speed(self, piece: Piece, length_m: float, along_m: float, now_s: float) -> float:
        """In time at the end of its leg, as slow as corners need, and no steeper than it climbs."""
        left_m = due_m = length_m - along_m
        for before, after in zip(self.ahead, self.ahead[1:]):
            if after.leg != piece.leg:
                break
            due_m += math.dist((before.x, before.y), (after.x, after.y))
        slope = abs(piece.height_m - self.start[2]) / length_m
        due_s = piece.arrives_s - now_s
        wanted_mps = due_m / due_s if due_s > STEP_S else FASTEST_MPS
        wanted_mps = min(wanted_mps, FASTEST_MPS, CLIMB_MPS / max(slope, 1e-3))
        behind = self.start
        for number, corner in enumerate(self.ahead):
            after = self.ahead[number + 1] if number + 1 < len(self.ahead) else None
            allowed_mps = corner_speed(behind, corner, after)
            room_m = max(left_m - self.speed_mps * STEP_S, 0.0)
            wanted_mps = min(wanted_mps, math.sqrt(allowed_mps**2 + 2 * BRAKING_MPS2 * room_m))
            if after is None or left_m > 60.0:
                break
            left_m += math.dist((corner.x, corner.y), (after.x, after.y))
            behind = (corner.x, corner.y)
        return max(wanted_mps, SLOWEST_MPS)

    def position(self):
        """Its telemetry."""
        lon, lat = self.plane.lon_lat(self.x, self.y)
        entry = telemetry.TelemetryEntry(
            drone_id=self.drone, location=place(lon, lat), altitude_m=self.height_m, altitude_reference=self.reference,
            ground_speed_mps=self.speed_mps, heading_deg=self.heading_deg % 360.0, airborne=self.is_flying and not self.is_on_pad())
        if self.is_flying and self.ahead and self.ahead[0].leg is not None:
            length_m, along_m = self.progress(self.ahead[0])
            entry.leg, entry.fraction = self.ahead[0].leg, min(max(along_m / length_m, 0.0), 1.0)
        return entry

    def is_on_pad(self) -> bool:
        """Whether it stands where its version has a stop."""
        stands = self.ahead[0].stands if self.ahead else self.holds
        return stands and self.speed_mps < 0.1


def off_m(point, start, end) -> tuple[float, float]:
    """How far a point is from a line, and at which share of the line that is."""
    east, north = end[0] - start[0], end[1] - start[1]
    share = ((point[0] - start[0]) * east + (point[1] - start[1]) * north) / max(east**2 + north**2, 1e-9)
    share = min(max(share, 0.0), 1.0)
    return math.dist(point, (start[0] + share * east, start[1] + share * north)), share


def corner_speed(behind, corner: Piece, after: Piece | None) -> float:
    """How fast a corner may be flown, so that its turn leads off the way by no more than it may."""
    if after is None or after.departs_s - corner.arrives_s > 2.0:
        return 0.0
    before_rad = math.atan2(corner.x - behind[0], corner.y - behind[1])
    after_rad = math.atan2(after.x - corner.x, after.y - corner.y)
    radius_m = TURN_OFF_M / max(1.0 - math.cos(after_rad - before_rad), 1e-3)
    return max(math.sqrt(radius_m * G_MPS2 * math.tan(math.radians(BANK_DEG))), SLOWEST_MPS)


class Script:
    """What happens on the way, drawn from a seed: zones close and open, obstacles and failures are reported."""

    def __init__(self, gateway: Gateway, pilots: list[Pilot], seed: int) -> None:
        self.gateway, self.pilots, self.dice = gateway, pilots, random.Random(seed)
        self.standing: list[tuple[int, str, str]] = []

    def act(self, now_s: int) -> None:
        while self.standing and self.standing[0][0] <= now_s:
            _, name, etag = self.standing.pop(0)
            self.gateway.lift_zone(name, etag)
        flying = [pilot for pilot in self.pilots if pilot.is_flying and len(pilot.ahead) > 2]
        if not flying or now_s > ZONES_UNTIL_S:
            return
        if now_s % ZONE_EVERY_S == 0:
            self.close(now_s, self.dice.choice(flying))
        if now_s % FAILURE_EVERY_S == 0:
            self.obstruct(self.dice.choice(flying))
        if now_s == LAND_NOW_AT_S:
            pilot = self.dice.choice(flying)
            self.gateway.fail(pilot.drone, type=recomposition.FAILURE_TYPE_OPERATIONAL, service=service_of(pilot),
                              detail=recomposition.OPERATIONAL_DETAIL_LAND_NOW, location=pilot.position().location)
        if now_s == CUT_AT_S:
            self.gateway.connect()
            self.gateway.come_on_line()

    def close(self, now_s: int, pilot: Pilot) -> None:
        """A zone on one of the next pieces of somebody's way."""
        number = self.dice.randrange(min(len(pilot.ahead) - 1, 5))
        (x, y), piece = pilot_corner(pilot, number), pilot.ahead[number]
        share = self.dice.uniform(0.3, 0.7)
        lon, lat = pilot.plane.lon_lat(x + share * (piece.x - x), y + share * (piece.y - y))
        name = f"zone-at-{now_s}"
        etag = self.gateway.post_zone(name, lon, lat, self.dice.uniform(15.0, 40.0))
        self.standing.append((now_s + ZONE_LASTS_S, name, etag))

    def obstruct(self, pilot: Pilot) -> None:
        """An obstacle ahead on the leg that a drone is on, where it is seen early enough."""
        piece = pilot.ahead[0]
        length_m, along_m = pilot.progress(piece)
        if piece.leg is None or length_m - along_m < 80.0:
            return
        share = (along_m + 70.0) / length_m
        lon, lat = pilot.plane.lon_lat(*(a + share * (b - a) for a, b in zip(pilot.start, (piece.x, piece.y))))
        height_m = pilot.start[2] + share * (piece.height_m - pilot.start[2])
        self.gateway.record.note("obstacle", drone=pilot.drone, lon=lon, lat=lat, height_m=height_m)
        outcome = self.gateway.fail(pilot.drone, type=recomposition.FAILURE_TYPE_NAVIGATIONAL, service=service_of(pilot),
                                    location=pilot.position().location, cause_location=place(lon, lat))
        pilot.holds = pilot.holds or outcome == "no_route"


def pilot_corner(pilot: Pilot, number: int) -> tuple[float, float]:
    """Where a piece of the way ahead begins."""
    return pilot.start[:2] if number == 0 else (pilot.ahead[number - 1].x, pilot.ahead[number - 1].y)


def service_of(pilot: Pilot):
    """The leg that a drone is on."""
    return recomposition.Service(plan_id=plan_of(pilot.drone), leg=pilot.ahead[0].leg)


class Sky:
    """BlueSky, the drones in it and their gateway, in lock step."""

    def __init__(self, gateway: Gateway, folder: pathlib.Path, plane: Plane, count: int, seed: int, pads: list[str]) -> None:
        self.gateway, self.pilots, dice = gateway, [], random.Random(f"{seed} plans")
        while len(self.pilots) < count:
            source, destination = dice.sample(pads, 2)
            drone = f"SK{len(self.pilots)}"
            plan = gateway.compose(drone, source, destination, dice.uniform(5, DEPARTURES_S), PLANNED_MPS)
            if plan is not None:
                self.pilots.append(Pilot(drone, plan, plane, gateway.starts))
        self.by_drone = {pilot.drone: pilot for pilot in self.pilots}
        with contextlib.redirect_stdout(io.StringIO()):
            bs.init(mode="sim", detached=True, workdir=str(folder))
        simtime.setdt(STEP_S)
        for line in ("ASAS OFF", "RESO OFF", "CRELOG TRACK 0.2", "TRACK ADD traf.id traf.lat traf.lon traf.alt traf.gs", "TRACK ON 0.2"):
            stack.stack(line)
        bs.sim.op()

    def second(self, now_s: int) -> None:
        """One second: BlueSky flies, the edge's clock follows, and everybody is told and answers."""
        for step in range(STEPS):
            self.step(now_s - 1 + step * STEP_S)
        self.gateway.advance(now_s)
        for pilot in self.pilots:
            if pilot.has_landed and pilot.is_flying:
                self.land(pilot)
        self.gateway.report([pilot.position() for pilot in self.pilots if not pilot.has_landed])
        while self.gateway.mail:
            self.hear(self.gateway.mail.pop(0))

    def step(self, now_s: float) -> None:
        for pilot in self.pilots:
            if pilot.may_depart(now_s):
                self.depart(pilot)
        for index, drone in enumerate(bs.traf.id):
            self.by_drone[drone].steer(index, now_s)
        with contextlib.redirect_stdout(io.StringIO()):
            bs.sim.step()

    def depart(self, pilot: Pilot) -> None:
        lon, lat = pilot.plane.lon_lat(pilot.x, pilot.y)
        first = pilot.ahead[0]
        heading_deg = math.degrees(math.atan2(first.x - pilot.x, first.y - pilot.y)) % 360.0
        bs.traf.cre(pilot.drone, "M600", lat, lon, heading_deg, pilot.height_m, 0.0)
        bs.traf.ap.bankdef[-1] = math.radians(BANK_DEG)
        pilot.is_flying = True

    def land(self, pilot: Pilot) -> None:
        pilot.is_flying = False
        bs.traf.delete(bs.traf.id2idx(pilot.drone))
        self.gateway.complete(pilot.drone, pilot.position().location)

    def leave_standing(self) -> None:
        """Who was diverted to the pad that it stood on has never departed."""
        for pilot in self.pilots:
            if not pilot.is_flying and not pilot.has_landed:
                pilot.has_landed = True
                self.gateway.complete(pilot.drone, pilot.position().location)

    def hear(self, message) -> None:
        """A drone is told something, and answers."""
        self.gateway.note_told(message)
        pilot, new = self.by_drone[message.drone_id], message.version
        flown = pilot.version
        if message.kind == session.MESSAGE_KIND_NO_WAY:
            pilot.holds = True
        newer = (new.token, new.epoch, new.version) > (flown.token, flown.epoch, flown.version)
        if pilot.has_landed or name_of(message) not in ("version", "offer") or not newer:
            self.gateway.received(message)
        elif pilot.can_begin(new):
            pilot.take_over(new)
            self.gateway.take_over(pilot.drone, new, pilot.position().location)
        else:
            self.gateway.decline(pilot.drone, new, pilot.position().location)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("edge")
    arguments.add_argument("folder", type=pathlib.Path)
    arguments.add_argument("--drones", type=int, default=25)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--network", type=pathlib.Path, default=NETWORK)
    given = arguments.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    nodes = [feature for feature in json.loads(given.network.read_text())["features"] if feature["properties"]["kind"] == "node"]
    pads = [str(node["id"]) for node in nodes if node["properties"]["pads"] > 0]
    gateway = Gateway(given.edge, Record(given.folder / "record.ndjson"))
    plane = Plane(*nodes[0]["geometry"]["coordinates"][:2])
    sky = Sky(gateway, given.folder, plane, given.drones, given.seed, pads)
    gateway.come_on_line()
    script, now_s = Script(gateway, sky.pilots, given.seed), 0
    while now_s < LIMIT_S and any(pilot.is_flying or pilot.ahead or pilot.holds for pilot in sky.pilots):
        now_s += 1
        script.act(now_s - 1)
        sky.second(now_s)
    sky.leave_standing()
    landed = sum(pilot.has_landed for pilot in sky.pilots)
    print(f"{landed} of {given.drones} drones landed in {now_s} s of BlueSky's time")


if __name__ == "__main__":
    main()
