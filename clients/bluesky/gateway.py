"""The gateway: many drones on one session with an edge, in lock step with a simulator, and the record of what was said."""

import datetime
import json
import pathlib
import queue
import sys
import urllib.request

import grpc

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "proto"))
clock, clock_services = grpc.protos_and_services("skyway/v1/clock.proto")
plans, plan_services = grpc.protos_and_services("skyway/v1/plans.proto")
session, drone_services = grpc.protos("skyway/v1/session.proto"), grpc.services("skyway/v1/drones.proto")
telemetry, types = grpc.protos("skyway/v1/telemetry.proto"), grpc.protos("skyway/v1/types.proto")
recomposition = grpc.protos("skyway/v1/recomposition.proto")

UTC = datetime.timezone.utc
ANSWER_S = 30.0


class Record:
    """What was said, one line of JSON each, at seconds of the simulation."""

    def __init__(self, file: pathlib.Path) -> None:
        self._file, self.now_s = file.open("w"), 0.0

    def note(self, kind: str, **facts) -> None:
        self._file.write(json.dumps({"t": self.now_s, "kind": kind} | facts) + "\n")
        self._file.flush()


class Gateway:
    """One session with an edge whose clock is external."""

    def __init__(self, address: str, record: Record) -> None:
        self.address, self.record = address, record
        self.drones: list[str] = []
        self.mail: list = []
        self._received: dict[str, str] = {}
        self._asked, self._session_id = 0, None
        self._said = self._told = self._channel = None
        self.connect()
        reading = clock_services.ClockStub(self._channel).GetClock(clock.GetClockRequest())
        if reading.kind != types.CLOCK_KIND_EXTERNAL:
            raise SystemExit("the edge has to be started with --clock external")
        self.starts = reading.time.ToDatetime(UTC)

    def connect(self) -> None:
        """A new connection; the one before is cut, without a word."""
        if self._channel is not None:
            self._channel.close()
        self._channel = grpc.insecure_channel(self.address, options=[("grpc.use_local_subchannel_pool", 1)])
        self._told = None

    def come_on_line(self) -> None:
        """A session for all drones, in place of the one that they had."""
        self._said = queue.SimpleQueue()
        self._told = drone_services.DronesStub(self._channel).Session(iter(self._said.get, None))
        named = [session.HelloDrone(drone_id=drone, ends_session=self._session_id, received_through=self._received.get(drone))
                 for drone in self.drones]
        welcome = self.ask(hello=session.Hello(drones=named)).welcome
        self._session_id = welcome.session_id
        refused = [f"{drone.drone_id}: {drone.reason.code}" for drone in welcome.refused]
        self.record.note("session", id=welcome.session_id, drones=len(welcome.drones), refused=refused)

    def ask(self, **body):
        """Says something on the session, and gives its answer; what comes in between is mail."""
        self._asked += 1
        self._said.put(session.SessionRequest(request_id=self._asked, **body))
        for told in self._told:
            if told.HasField("message"):
                self.mail.append(told.message)
            elif told.request_id == self._asked:
                if told.HasField("problem"):
                    self.record.note("refused", asked=next(iter(body)), code=told.problem.code, detail=told.problem.detail)
                return told
        raise ConnectionError("the edge has ended the session")

    def compose(self, drone: str, source: str, destination: str, starts_s: float, airspeed_mps: float):
        """A plan for a drone, or nothing where there is none."""
        asked = plans.CreatePlanRequest(id=plan_of(drone), source=source, destination=destination, drone_id=drone,
                                        airspeed_mps=airspeed_mps)
        asked.start_time.FromDatetime(self.starts + datetime.timedelta(seconds=starts_s))
        try:
            plan = plan_services.PlansStub(self._channel).CreatePlan(asked)
        except grpc.RpcError as refused:
            if refused.code() in (grpc.StatusCode.FAILED_PRECONDITION, grpc.StatusCode.ABORTED):
                return None
            raise
        self.drones.append(drone)
        self.record.note("plan", drone=drone, plan=plan.id, source=source, destination=destination)
        return plan

    def advance(self, now_s: float) -> None:
        """Moves the clock of the edge to a time of the simulation."""
        asked = clock.AdvanceToRequest()
        asked.to.FromDatetime(self.starts + datetime.timedelta(seconds=now_s))
        self.ask(advance_to=asked)
        self.record.now_s = now_s

    def report(self, positions: list) -> None:
        """Telemetry of many; what is not taken is noted."""
        told = self.ask(telemetry=telemetry.ReportTelemetryRequest(positions=positions)).telemetry
        for answer in told.positions:
            if not answer.accepted or answer.warnings:
                self.record.note("telemetry", drone=answer.drone_id, accepted=answer.accepted,
                                 warnings=[warning.code for warning in answer.warnings])

    def fail(self, drone: str, **facts):
        """A failure report, and its answer."""
        report = recomposition.FailureReport(drone=recomposition.DroneFacts(id=drone), airborne=True, **facts)
        answer = self.ask(failure=report).recomposition
        outcome = types.Outcome.Name(answer.answer.outcome).removeprefix("OUTCOME_").lower()
        self.record.note("failure", drone=drone, type=facts["type"], outcome=outcome)
        return outcome

    def note_told(self, message) -> None:
        """Writes a message down, with the way of its version; received it is once it is answered."""
        new, way = message.version, []
        lines = ([new.first_stretch.geometry] if new.HasField("first_stretch") else []) + [leg.geometry for leg in new.legs]
        for line in lines:
            way += [[point.x, point.y] for point in line]
        self.record.note("told", drone=message.drone_id, message=message.id, what=name_of(message), version=new.version, way=way,
                         outcome=new.outcome, flags=[flag_of(flag) for flag in new.flags], text=message.text, causes=list(message.causes), ended_as=message.ended_as, nodes=list(new.path.nodes),
                         stretch=new.first_stretch.length_m if new.HasField("first_stretch") else None)
        self._received[message.drone_id] = message.id

    def take_over(self, drone: str, version, place, **progress) -> None:
        """The drone flies a version from now on."""
        self.record.note("said", drone=drone, what="acknowledge", version=version.version)
        self.ask(acknowledge=plans.AcknowledgePlanRequest(
            id=plan_of(drone), version=version.version, location=place, **progress))

    def decline(self, drone: str, version, place) -> None:
        """The drone has passed the beginning of a version."""
        self.record.note("said", drone=drone, what="decline", version=version.version)
        self.ask(decline=plans.DeclinePlanRequest(
            id=plan_of(drone), version=version.version, reason="passed", location=place))

    def received(self, message) -> None:
        """The drone has taken a message in."""
        self.ask(received=session.ReceivedRequest(drone_id=message.drone_id, through=message.id))

    def complete(self, drone: str, place) -> str:
        """The drone has landed: what became of its plan."""
        plan = self.ask(complete=plans.CompletePlanRequest(id=plan_of(drone), location=place)).plan
        ended_as = plans.EndedAs.Name(plan.ended_as).removeprefix("ENDED_AS_").lower()
        self.record.note("landed", drone=drone, ended_as=ended_as)
        return ended_as

    def post_zone(self, name: str, lon: float, lat: float, radius_m: float) -> str:
        """An operator closes a circle; gives what lifts it."""
        answer = self._rest("POST", "/v1/zones", {
            "type": "Feature", "id": name, "geometry": {"type": "Point", "coordinates": [lon, lat]},
            "properties": {"radius_m": radius_m}})
        effect = answer["effect"]
        self.record.note("zone", id=name, lon=lon, lat=lat, radius_m=radius_m, met=[plan["drone_id"] for plan in effect["plans"]])
        return answer["etag"]

    def lift_zone(self, name: str, etag: str) -> None:
        """An operator opens it again."""
        self._rest("DELETE", f"/v1/zones/{name}", None, etag)
        self.record.note("lifted", id=name)

    def _rest(self, method: str, path: str, body: dict | None, etag: str | None = None) -> dict:
        headers = {"content-type": "application/json"} | ({"if-match": etag} if etag else {})
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(f"http://{self.address}{path}", method=method, data=data, headers=headers)
        with urllib.request.urlopen(request, timeout=ANSWER_S) as answer:
            return json.loads(answer.read() or b"null")


def plan_of(drone: str) -> str:
    """Each drone flies one plan, which is named after it."""
    return f"of-{drone}"


def name_of(message) -> str:
    """The kind of a message, as documents have it."""
    return session.MessageKind.Name(message.kind).removeprefix("MESSAGE_KIND_").lower()


def flag_of(flag: int) -> str:
    """A flag of a version, as documents have it."""
    return recomposition.Flag.Name(flag).removeprefix("FLAG_").lower()


def place(lon: float, lat: float):
    """A place on Earth."""
    return types.Place(lon_lat=types.LonLat(lon=lon, lat=lat))
