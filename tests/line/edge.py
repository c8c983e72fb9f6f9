"""An edge as a child process that is killed and started again, and a client of its sessions."""

import atexit
import json
import os
import pathlib
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request

import grpc

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "proto"))
session = grpc.protos("skyway/v1/session.proto")
plans, plan_services = grpc.protos_and_services("skyway/v1/plans.proto")
drone_services = grpc.services("skyway/v1/drones.proto")

# Longer than anything takes, so that what hangs fails.
WAIT_S = 60.0


class Edge:
    """`skyway edge` over a store of its own, on one port from start to start."""

    def __init__(self, binary: pathlib.Path, folder: pathlib.Path, *arguments: str) -> None:
        self.folder, self.port = folder, 0
        self._binary, self._arguments = binary, arguments
        self._process = None
        # A story that fails leaves no edge behind.
        atexit.register(lambda: self._process and self._process.kill())

    def __enter__(self) -> "Edge":
        return self.start()

    def __exit__(self, *_) -> None:
        self.kill()

    def start(self) -> "Edge":
        """Starts it, or starts it again."""
        ports_file = self.folder / "ports.json"
        ports_file.unlink(missing_ok=True)
        command = [self._binary.resolve(), "edge", f"--store={self.folder / 'edge.db'}", f"--listen=127.0.0.1:{self.port}",
                   "--admin-listen=127.0.0.1:0", f"--ports-file={ports_file}", *self._arguments]
        environment = {name: value for name, value in os.environ.items() if not name.startswith("SKYWAY_")}
        log = (self.folder / "edge.log").open("ab")
        self._process = subprocess.Popen(command, stdout=log, stderr=log, env=environment)
        ports = until(lambda: json.loads(ports_file.read_text()), "its ports")
        self.port, self._admin_port = ports["listen"], ports["admin_listen"]
        return self

    def kill(self) -> None:
        """Ends it at once, as a crash does."""
        self._process.kill()
        self._process.wait()

    def stop(self) -> int:
        """Ends it in order; gives what it ends with."""
        self._process.send_signal(signal.SIGTERM)
        return self._process.wait(timeout=WAIT_S)

    @property
    def address(self) -> str:
        """Where gRPC is."""
        return f"127.0.0.1:{self.port}"

    def ask(self, method: str, path: str, body=None, token: str | None = None):
        """A request over REST: the answer's JSON."""
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(f"http://{self.address}{path}", data=data, method=method)
        request.add_header("content-type", "application/json")
        if token:
            request.add_header("authorization", f"Bearer {token}")
        with urllib.request.urlopen(request, timeout=WAIT_S) as answer:
            return json.loads(answer.read())

    def metric(self, name: str) -> float:
        """A metric without labels."""
        with urllib.request.urlopen(f"http://127.0.0.1:{self._admin_port}/metrics", timeout=WAIT_S) as answer:
            lines = answer.read().decode().splitlines()
        return float(next(line.split()[1] for line in lines if line.startswith(f"{name} ")))

    def close_over(self, lon: float, lat: float, radius_m: float) -> dict:
        """A round no-fly zone."""
        return self.ask("POST", "/v1/zones", {
            "type": "Feature", "geometry": {"type": "Point", "coordinates": [lon, lat]},
            "properties": {"radius_m": radius_m, "reason": "crane"}})

    def plan(self, drone: str, source: int, destination: int, **more) -> dict:
        """A plan for a drone."""
        return self.ask("POST", "/v1/plans", {"source": source, "destination": destination, "drone_id": drone, **more})


class Line:
    """A session from the side of a client."""

    def __init__(self, edge: Edge, token: str | None = None) -> None:
        # Nothing of another test's connections.
        options = [("grpc.use_local_subchannel_pool", 1)]
        self.channel = grpc.insecure_channel(edge.address, options=options)
        self._said: queue.Queue = queue.Queue()
        self.told: queue.Queue = queue.Queue()
        self._kept: list = []
        self.ended = threading.Event()
        self.status = None
        metadata = [("authorization", f"Bearer {token}")] if token else None
        self._call = drone_services.DronesStub(self.channel).Session(iter(self._said.get, None), metadata=metadata)

    def listen(self) -> "Line":
        """Reads what is told, beside the caller."""
        threading.Thread(target=self._read, daemon=True).start()
        return self

    def _read(self) -> None:
        try:
            for told in self._call:
                self.told.put(told)
        except grpc.RpcError as error:
            self.status = error
        self.ended.set()

    def say(self, **body) -> None:
        """Says something."""
        self._said.put(session.SessionRequest(**body))

    def hello(self, *drones: str, ends: str | None = None, received: str | None = None):
        """Comes on the line: the welcome."""
        named = [session.HelloDrone(drone_id=drone, ends_session=ends, received_through=received) for drone in drones]
        self.say(hello=session.Hello(drones=named))
        return self.next("welcome")

    def next(self, body: str):
        """The next that is told of this kind; what comes before it is kept."""
        for place, told in enumerate(self._kept):
            if told.HasField(body):
                return getattr(self._kept.pop(place), body)
        while True:
            told = self.told.get(timeout=WAIT_S)
            if told.HasField(body):
                return getattr(told, body)
            self._kept.append(told)

    def version(self):
        """The next message that tells a version to be flown."""
        while True:
            message = self.next("message")
            if message.kind == session.MESSAGE_KIND_VERSION:
                return message

    def acknowledge(self, message, request_id: int = 1):
        """Takes a version over: the plan then."""
        taken = plans.AcknowledgePlanRequest(id=message.plan_id, version=message.version.version)
        self.say(request_id=request_id, acknowledge=taken)
        return self.next("plan")

    def messages(self) -> list:
        """All messages that have been told and not been taken."""
        told = [*self._kept, *self.told.queue]
        return [one.message for one in told if one.HasField("message")]

    def cut(self) -> None:
        """Breaks the connection, without a word."""
        self.channel.close()


def until(found, what: str):
    """Waits until something is there."""
    give_up = time.monotonic() + WAIT_S
    while time.monotonic() < give_up:
        try:
            value = found()
        except (OSError, ValueError):
            value = None
        if value:
            return value
        time.sleep(0.02)
    raise AssertionError(f"not within {WAIT_S:.0f} s: {what}")


def in_folder(story):
    """A story with a folder of its own."""
    def told(binary: pathlib.Path) -> str:
        with tempfile.TemporaryDirectory(prefix="skyway-line-") as folder:
            return story(binary, pathlib.Path(folder))
    told.__name__, told.__doc__ = story.__name__, story.__doc__
    return told
