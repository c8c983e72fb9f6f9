#!/usr/bin/env python3
"""One drone: it asks for a plan, stays on the line, flies what it is told, and lands. Or drones of a provider, which wait
on the line for the deliveries that they are assigned to.

drone.py EDGE FROM TO              as in: drone.py 127.0.0.1:8080 1 450
drone.py EDGE --assigned ID ...    as in: drone.py 127.0.0.1:8080 --assigned acme:1 acme:2

It flies by the times of its plan, so it is where the newest version that it has taken over has it at each moment. A new
version is taken over if it begins near the drone, and declined otherwise. When the line breaks, the drone flies on and comes
back with the name of its old session.
"""

import argparse
import asyncio
import datetime
import math
import pathlib
import sys
import time

import grpc

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "proto"))
clock, clock_services = grpc.protos_and_services("skyway/v1/clock.proto")
plans, plan_services = grpc.protos_and_services("skyway/v1/plans.proto")
session, drone_services = grpc.protos("skyway/v1/session.proto"), grpc.services("skyway/v1/drones.proto")
telemetry, types = grpc.protos("skyway/v1/telemetry.proto"), grpc.protos("skyway/v1/types.proto")

EVERY_S = 1.0
# A version that begins farther away, in metres, has been overtaken by the flight.
NEAR_M = 150.0
METRES_PER_DEGREE = 111_320.0
UTC = datetime.timezone.utc


def distance_m(here, there):
    """Between two places of a geographic network, over ground."""
    east = (there[0] - here[0]) * math.cos(math.radians(here[1]))
    return math.hypot(east, there[1] - here[1]) * METRES_PER_DEGREE


def corner(point):
    """Longitude, latitude and height of a point of a way."""
    return (point.x, point.y, point.height_m)


def at(lon, lat):
    """A place on earth."""
    return types.Place(lon_lat=types.LonLat(lon=lon, lat=lat))


class EdgeTime:
    """The time that the edge goes by, which may pass faster than the machine's."""

    def __init__(self, reading):
        self.began, self.rate = datetime.datetime.now(UTC), reading.rate
        self.shown = reading.time.ToDatetime(UTC)

    def __call__(self):
        return self.shown + (datetime.datetime.now(UTC) - self.began) * self.rate


class Drone:
    """What it flies, and where that has it."""

    def __init__(self, drone_id, plan=None):
        self.id = drone_id
        self.session_id = self.received = None
        self.wait()
        if plan:
            self.fly(plan.id, plan.reported)

    def wait(self):
        """It stands where it is, for the next plan."""
        self.plan_id = self.version = None
        self.lands_at, self.pieces = datetime.datetime.max.replace(tzinfo=UTC), []

    def fly(self, plan_id, version):
        """From now on it flies this version: pieces of way with the times of their ends. Between them it is served."""
        self.plan_id, self.version, self.lands_at = plan_id, version, version.arrives_at.ToDatetime(UTC)
        if version.legs:
            self.height_reference = version.legs[0].height_reference
        elif version.outcome == "hold":
            self.lands_at = datetime.datetime.max.replace(tzinfo=UTC)
        legs, starts = version.legs, version.departs_at.ToDatetime(UTC)
        if self.pieces and not legs and not version.HasField("first_stretch"):
            return self.stay(self.place(starts))
        self.pieces = []
        if version.HasField("first_stretch"):
            line = version.first_stretch.geometry
            enters = legs[0].departs_at.ToDatetime(UTC) if legs else self.lands_at
            self.pieces.append((starts, corner(line[0]), enters, corner(line[-1])))
        for leg in legs:
            times = (leg.departs_at.ToDatetime(UTC), leg.arrives_at.ToDatetime(UTC))
            self.pieces.append((times[0], corner(leg.geometry[0]), times[1], corner(leg.geometry[-1])))

    def stay(self, here):
        """It stays there, on the ground, for as long as it is told no way."""
        self.pieces = [(self.lands_at, here, self.lands_at, here)]

    def place(self, now):
        """Where it is: on a piece of way, or at the end of the last one that it has flown."""
        place = self.pieces[0][1]
        for from_time, start, until, end in self.pieces:
            if now < from_time:
                break
            share = min((now - from_time) / (until - from_time), 1.0) if until > from_time else 1.0
            place = tuple(a + share * (b - a) for a, b in zip(start, end))
        return place

    def hello(self):
        """It comes on the line, in place of the session that it had."""
        drone = session.HelloDrone(drone_id=self.id, ends_session=self.session_id, received_through=self.received)
        return session.SessionRequest(hello=session.Hello(drones=[drone]))

    def position(self, now):
        """Its telemetry."""
        lon, lat, height_m = self.place(now)
        entry = telemetry.TelemetryEntry(
            drone_id=self.id, location=at(lon, lat), altitude_m=height_m, altitude_reference=self.height_reference,
            airborne=self.pieces[0][0] <= now < self.lands_at)
        entry.timestamp.FromDatetime(now)
        return session.SessionRequest(telemetry=telemetry.ReportTelemetryRequest(positions=[entry]))

    def is_newer(self, version):
        """Whether a version comes after the one that it flies."""
        return (version.token, version.epoch, version.version) > (self.version.token, self.version.epoch, self.version.version)

    def answer(self, message, now):
        """What it says to a message from its mailbox."""
        self.received = message.id
        kind = session.MessageKind.Name(message.kind).removeprefix("MESSAGE_KIND_").lower()
        new = message.version
        print(f"told {kind} {message.id}", f"version {new.version}" if new.version else message.text, flush=True)
        if kind == "assigned" and not self.plan_id:
            self.fly(message.plan_id, new)
            print(f"{self.id} flies plan {self.plan_id}: {' '.join(new.path.nodes)}", flush=True)
        elif kind == "ended" and message.plan_id == self.plan_id:
            self.wait()
        elif kind == "version" and message.plan_id == self.plan_id and self.is_newer(new):
            lon, lat, _ = self.place(now)
            begins = new.first_stretch.geometry or [point for leg in new.legs for point in leg.geometry]
            if begins and distance_m((lon, lat), corner(begins[0])) > NEAR_M:
                declined = plans.DeclinePlanRequest(id=self.plan_id, version=new.version, reason="passed", location=at(lon, lat))
                return session.SessionRequest(request_id=2, decline=declined)
            self.fly(self.plan_id, new)
            print(f"flies version {new.version}: {' '.join(new.path.nodes)}", flush=True)
            taken = plans.AcknowledgePlanRequest(id=self.plan_id, version=new.version, location=at(lon, lat))
            return session.SessionRequest(request_id=1, acknowledge=taken)
        through = session.ReceivedRequest(drone_id=self.id, through=message.id)
        return session.SessionRequest(received=through)


async def fly_on_line(drone, edge_time, channel, is_done):
    """One session: telemetry up, messages down, until it has landed or has nothing more to fly."""
    line = drone_services.DronesStub(channel).Session()
    await line.write(drone.hello())

    async def listen():
        async for told in line:
            if told.HasField("welcome"):
                drone.session_id = told.welcome.session_id
                print(f"on the line: {list(told.welcome.drones)}", flush=True)
            elif told.HasField("message"):
                await line.write(drone.answer(told.message, edge_time()))
            elif told.HasField("problem"):
                print(f"refused: {told.problem.code}: {told.problem.detail}", flush=True)

    listening = asyncio.create_task(listen())
    while (now := edge_time()) < drone.lands_at and not is_done(drone) and not listening.done():
        if drone.plan_id:
            await line.write(drone.position(now))
        await asyncio.sleep(EVERY_S / edge_time.rate)
    if listening.done():
        # It says why the line has ended.
        return listening.result()
    listening.cancel()
    if drone.plan_id:
        await land(drone, edge_time, channel)


async def land(drone, edge_time, channel):
    """It says that it has landed; to an edge that it had told so before, once more."""
    landed = plans.CompletePlanRequest(id=drone.plan_id, location=at(*drone.place(edge_time())[:2]))
    try:
        ended = await plan_services.PlansStub(channel).CompletePlan(landed)
        if ended.state != plans.PLAN_STATE_ENDED:
            # At a stop it waits, on the line, to be told a way on.
            here, drone.lands_at = drone.place(edge_time()), datetime.datetime.max.replace(tzinfo=UTC)
            return drone.stay(here)
        print(f"landed: {plans.EndedAs.Name(ended.ended_as).removeprefix('ENDED_AS_').lower()}", flush=True)
    except grpc.aio.AioRpcError as refused:
        if refused.code() != grpc.StatusCode.FAILED_PRECONDITION:
            raise
    drone.wait()


async def keep_on_line(drone, edge_time, channel, is_done):
    """Over as many sessions as it takes."""
    while not is_done(drone):
        try:
            await fly_on_line(drone, edge_time, channel, is_done)
        except grpc.aio.AioRpcError as broken:
            print(f"the line broke: {broken.code().name.lower()}", flush=True)
            await asyncio.sleep(0.2)


async def main():
    """Asks for a plan and flies it, or waits for what is assigned."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("edge")
    arguments.add_argument("source", nargs="?")
    arguments.add_argument("destination", nargs="?")
    arguments.add_argument("--assigned", nargs="+", metavar="ID")
    given = arguments.parse_args()
    if not given.assigned and not given.destination:
        arguments.error("name a source and a destination, or drones with --assigned")
    async with grpc.aio.insecure_channel(given.edge) as channel:
        edge_time = EdgeTime(await clock_services.ClockStub(channel).GetClock(clock.GetClockRequest()))
        if given.assigned:
            waiting = [keep_on_line(Drone(drone_id), edge_time, channel, lambda _: False) for drone_id in given.assigned]
            await asyncio.gather(*waiting)
        asked = plans.CreatePlanRequest(source=given.source, destination=given.destination, drone_id=f"drone-{time.time_ns()}")
        plan = await plan_services.PlansStub(channel).CreatePlan(asked)
        print(f"plan {plan.id}: {' '.join(plan.reported.path.nodes)}", flush=True)
        await keep_on_line(Drone(plan.drone_id, plan), edge_time, channel, lambda drone: not drone.plan_id)


if __name__ == "__main__":
    asyncio.run(main())
