"""Drones of a provider as clients of a few sessions, each with several of them; they fly as clients/python/drone.py does."""

import queue
import random
import sys
import threading
import time

import grpc

from town import ROOT

sys.path.insert(0, str(ROOT / "clients/python"))
from drone import UTC, Drone, EdgeTime, at, clock, clock_services, drone_services, plans, session  # noqa: E402

ON_STREAM = 5
# Between two positions of a drone, in the machine's time.
EVERY_S = 0.1
COME_BACK_AFTER_S = 0.05
# How many of the versions that it could fly a drone declines.
DECLINES = 0.25
# Requests of a drone: what it says of a version, and that it has landed.
LANDED = 1_000
# A zone is put this far ahead of a drone, in its time, so that it can be told.
AHEAD_S = 12.0


class Courier(Drone):
    """A drone that tells which step of its delivery it has come to, and declines some versions."""

    def __init__(self, drone_id: str, chance: random.Random, kills) -> None:
        self._chance, self._kills = chance, kills
        self._passed: set[str] = set()
        self.has_landed, self.declined, self.taken = False, 0, 0
        # The plans at whose end it has landed.
        self.flown: list[str] = []
        # The nodes that it has come to, by plan.
        self.visited: dict[str, set[str]] = {}
        self.faults: list[str] = []
        super().__init__(drone_id)

    def wait(self) -> None:
        """It has nothing to fly."""
        if self.has_landed:
            self.flown.append(self.plan_id)
            self._note_visited(self.lands_at)
        super().wait()
        self.has_landed, self.height_reference = False, None

    def fly(self, plan_id, version) -> None:
        """It takes off again, where it had landed at a stop."""
        super().fly(plan_id, version)
        self.has_landed = False

    def _note_visited(self, now) -> None:
        """What it has come to on the version that it flies."""
        come = [leg.to for leg in self.version.legs if leg.arrives_at.ToDatetime(UTC) <= now]
        self.visited.setdefault(self.plan_id, set()).update(come)

    def answer(self, message, now):
        """What it says to a message from its mailbox."""
        if self.plan_id:
            self._note_visited(now)
        kind = session.MessageKind.Name(message.kind).removeprefix("MESSAGE_KIND_").lower()
        if kind == "assigned":
            self._is_assigned(message)
        if kind in ("version", "no_way", "alarm", "ended"):
            where = [round(value, 6) for value in self.place(now)[:2]] if self.pieces else None
            why = f"{message.version.outcome} for {list(message.causes)} {message.text}"
            print(f"{time.time():.3f} {self.id} at {where}: {kind} {why}", flush=True)
        if kind == "version" and message.plan_id == self.plan_id and self.is_newer(message.version):
            self._kills.reached("replanned")
            if self._chance.random() < DECLINES:
                self.received, self.declined = message.id, self.declined + 1
                number = message.version.version
                declined = plans.DeclinePlanRequest(id=self.plan_id, version=number, reason="passed", location=self._at(now))
                return session.SessionRequest(request_id=2, decline=declined)
        said = super().answer(message, now)
        self.taken += said.HasField("acknowledge")
        return said

    def _is_assigned(self, message) -> None:
        if self.plan_id == message.plan_id:
            return
        if self.plan_id and not self.has_landed:
            self.faults.append(f"{self.id} is assigned to {message.plan_id} while it flies {self.plan_id}")
        # It has landed, and that its edge has taken that it was not told: its edge was killed.
        self.wait()
        self._passed = set()
        self._kills.reached("assigned")

    def _at(self, now):
        return at(*self.place(now)[:2])

    def tell(self, now):
        """Its position while it flies, and that it has landed until that is answered; `None` where it waits."""
        if not self.plan_id or not self.pieces:
            return None
        self._pass_steps(now)
        if now < self.lands_at:
            return self.position(now)
        self.has_landed = True
        return session.SessionRequest(complete=plans.CompletePlanRequest(id=self.plan_id, location=self._at(now)))

    def _pass_steps(self, now) -> None:
        served = [stop for stop in self.version.flight.stops if stop.HasField("service_s")]
        if now >= self.pieces[0][0]:
            self._pass("departed")
        if len(served) == 1 or served and now >= served[0].takes_off_at.ToDatetime(UTC):
            self._pass("in_flight")
        if not served or now >= served[-1].takes_off_at.ToDatetime(UTC):
            self._pass("delivered")

    def _pass(self, step: str) -> None:
        if step not in self._passed:
            self._passed.add(step)
            self._kills.reached(step)

    def landing_answered(self, told) -> None:
        """A plan that is over or not there is flown no more. Of one that ends at a stop it says again that it is there."""
        is_over = told.plan.state == plans.PLAN_STATE_ENDED or told.problem.status in (404, 409, 410, 412)
        if self.has_landed and is_over:
            print(f"{self.id} landed: {told.problem.code or 'taken'}", flush=True)
            self.wait()

    def ahead(self, now):
        """The middle of the leg that it flies some seconds later, while it is on its way; `None` without one."""
        if not self.plan_id or now < self.pieces[0][0] if self.pieces else True:
            return None
        begins = [(start, end) for from_time, start, _, end in self.pieces if (from_time - now).total_seconds() > AHEAD_S]
        return [(a + b) / 2 for a, b in zip(*begins[0])][:2] if begins else None


class Stream:
    """One session of some drones, opened again for as long as it takes."""

    def __init__(self, address: str, drones: list[Courier]) -> None:
        self.drones, self._address = drones, address
        self._over, self._lock = threading.Event(), threading.Lock()
        self._said = self._edge_time = None
        self.sessions = 0
        self._threads = [threading.Thread(target=work, daemon=True) for work in (self._listen, self._tell)]
        for thread in self._threads:
            thread.start()

    def _listen(self) -> None:
        while not self._over.is_set():
            # Nothing of a connection to the edge that was killed.
            channel = grpc.insecure_channel(self._address, options=[("grpc.use_local_subchannel_pool", 1)])
            said: queue.Queue = queue.Queue()
            try:
                self._serve(channel, said)
            except grpc.RpcError as broken:
                print(f"the line broke: {broken.code()}", flush=True)
            with self._lock:
                self._said = None
            said.put(None)
            channel.close()
            self._over.wait(COME_BACK_AFTER_S)

    def _serve(self, channel, said: queue.Queue) -> None:
        edge_time = EdgeTime(clock_services.ClockStub(channel).GetClock(clock.GetClockRequest(), timeout=10))
        call = drone_services.DronesStub(channel).Session(iter(said.get, None))
        with self._lock:
            hellos = [drone.hello().hello.drones[0] for drone in self.drones]
        said.put(session.SessionRequest(hello=session.Hello(drones=hellos)))
        for told in call:
            with self._lock:
                self._take(told, said, edge_time)

    def _take(self, told, said: queue.Queue, edge_time: EdgeTime) -> None:
        if told.HasField("welcome"):
            self.sessions += 1
            self._said, self._edge_time = said, edge_time
            for drone in self.drones:
                drone.session_id = told.welcome.session_id
            # Who is refused comes with the next session.
            if told.welcome.refused:
                print(f"refused: {told.welcome.refused}", flush=True)
                said.put(None)
        elif told.HasField("message"):
            drone = next(drone for drone in self.drones if drone.id == told.message.drone_id)
            said.put(drone.answer(told.message, edge_time()))
        elif told.request_id >= LANDED:
            self.drones[told.request_id - LANDED].landing_answered(told)
        elif told.HasField("problem"):
            print(f"refused: {told.problem.code}: {told.problem.detail}", flush=True)

    def _tell(self) -> None:
        while not self._over.wait(EVERY_S):
            with self._lock:
                if not self._said:
                    continue
                for number, drone in enumerate(self.drones):
                    if request := drone.tell(self._edge_time()):
                        if request.HasField("complete"):
                            request.request_id = LANDED + number
                        self._said.put(request)

    def ahead(self) -> list:
        """Places that its drones come to."""
        with self._lock:
            if not self._said:
                return []
            return [place for drone in self.drones if (place := drone.ahead(self._edge_time()))]

    def close(self) -> None:
        """Ends it."""
        self._over.set()
        with self._lock:
            if self._said:
                self._said.put(None)
        for thread in self._threads:
            thread.join(timeout=20)


class Fleet:
    """All drones of a provider."""

    def __init__(self, address: str, ids: list[str], seed: int, kills) -> None:
        self.drones = [Courier(name, random.Random(f"{seed} {name}"), kills) for name in ids]
        parts = [self.drones[begin:begin + ON_STREAM] for begin in range(0, len(ids), ON_STREAM)]
        self.streams = [Stream(address, part) for part in parts]

    def ahead(self) -> list:
        """Places that drones in flight come to."""
        return [place for stream in self.streams for place in stream.ahead()]

    def total(self, name: str) -> int:
        """What all of them have counted."""
        return sum(getattr(drone, name) for drone in self.drones)

    def faults(self) -> list[str]:
        """What should not have been told to drones."""
        return [fault for drone in self.drones for fault in drone.faults]

    def close(self) -> None:
        """Ends all sessions."""
        for stream in self.streams:
            stream.close()
