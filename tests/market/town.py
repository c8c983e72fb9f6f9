"""A registry, an edge over Sydney, a provider with its drones, and a customer with an endpoint that is told."""

import atexit
import base64
import contextlib
import hashlib
import hmac
import http.server
import json
import os
import pathlib
import random
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Longer than anything takes, so that what hangs fails.
WAIT_S = 240.0
FINAL = {"delivered", "diverted", "returned", "failed", "cancelled"}
HOOK = "shop:main"
# The endpoint refuses no message more often: waits double, and bad luck would make them minutes.
REFUSALS_MAX = 5


def until(found, what: str, within_s: float = WAIT_S):
    """Waits for something, which may fail until it is there."""
    ends = time.monotonic() + within_s
    while True:
        try:
            if result := found():
                return result
        except (OSError, ValueError, KeyError):
            pass
        if time.monotonic() > ends:
            raise AssertionError(f"not within {within_s} s: {what}")
        time.sleep(0.05)


def free_port() -> int:
    """A port that nobody has now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Daemon:
    """`skyway edge` or `skyway registry`, on one port from start to start."""

    def __init__(self, binary: pathlib.Path, folder: pathlib.Path, kind: str, *arguments: str) -> None:
        self.kind, self.port, self._folder = kind, free_port(), folder
        self._command = [binary, kind, f"--listen=127.0.0.1:{self.port}", "--admin-listen=127.0.0.1:0", *arguments]
        self._process = None
        # A story that fails leaves no process behind.
        atexit.register(lambda: self._process and self._process.kill())

    @property
    def url(self) -> str:
        """Where it is reached."""
        return f"http://127.0.0.1:{self.port}"

    def start(self) -> "Daemon":
        """Starts it, or starts it again."""
        environment = {name: value for name, value in os.environ.items() if not name.startswith("SKYWAY_")}
        with (self._folder / f"{self.kind}.log").open("ab") as log:
            self._process = subprocess.Popen(self._command, stdout=log, stderr=log, env=environment)
        until(lambda: self.ask("GET", "/livez", raw=True), f"the {self.kind} lives")
        return self

    def kill(self) -> None:
        """Ends it at once, as a crash does."""
        self._process.kill()
        self._process.wait()

    def stop(self) -> int:
        """Ends it in order; gives what it ends with."""
        self._process.send_signal(signal.SIGTERM)
        return self._process.wait(timeout=WAIT_S)

    def ask(self, method: str, path: str, body=None, raw: bool = False, **headers):
        """A request over REST: the answer's JSON."""
        data = body if isinstance(body, bytes) or body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.url + path, data=data, method=method)
        request.add_header("content-type", "application/json")
        for name, value in headers.items():
            request.add_header(name.replace("_", "-"), value)
        try:
            with urllib.request.urlopen(request, timeout=30) as answer:
                read = answer.read()
        except urllib.error.HTTPError as refused:
            told = refused.read().decode()
            # What another attempt may mend is told from what it does not.
            if refused.code in (409, 429, 500, 503, 504):
                raise OSError(f"{method} {path}: {refused.code} {told}") from refused
            raise AssertionError(f"{method} {path}: {refused.code} {told}") from refused
        return read or b"ok" if raw else json.loads(read)


class Receiver:
    """The customer's endpoint: it fails half of the time, and checks every signature by itself."""

    def __init__(self, seed: int, now=time.time) -> None:
        self._random, self._lock, self._now = random.Random(seed), threading.Lock(), now
        self.secret, self.faults = None, []
        self.failed = self.repeated = 0
        # The events of each delivery, in the order in which they were first taken.
        self.taken: dict[str, list[str]] = {}
        self._ids: set[str] = set()
        self._refused: dict[str, int] = {}
        receiver = self

        class Handler(http.server.BaseHTTPRequestHandler):
            """One call."""

            protocol_version = "HTTP/1.1"

            def handle(self) -> None:
                # Who calls is killed now and then, and its connection with it.
                with contextlib.suppress(ConnectionError):
                    super().handle()

            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["content-length"]))
                self.send_response(receiver.take(self.headers, body))
                self.send_header("content-length", "0")
                self.end_headers()

            def log_message(self, *_) -> None:
                """Says nothing."""

        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    @property
    def url(self) -> str:
        """Where it is called."""
        return f"http://127.0.0.1:{self._server.server_address[1]}/hooks"

    def close(self) -> None:
        """Is called no more."""
        self._server.shutdown()
        self._server.server_close()

    def take(self, headers, body: bytes) -> int:
        """The status that a call is answered with."""
        with self._lock:
            message_id = headers["webhook-id"]
            if not self._is_signed(headers, body):
                self.faults.append(f"{message_id} has no valid signature")
                return 400
            refused = self._refused.get(message_id, 0)
            if self._random.random() < 0.5 and refused < REFUSALS_MAX:
                self._refused[message_id] = refused + 1
                self.failed += 1
                return 503
            if message_id in self._ids:
                self.repeated += 1
                return 204
            self._ids.add(message_id)
            told = json.loads(body)
            self.taken.setdefault(told["data"]["delivery_id"], []).append(told["type"])
            if set(told["data"]) - {"delivery_id", "status", "expected_at"}:
                self.faults.append(f"{message_id} tells more than it should: {told}")
            return 204

    def _is_signed(self, headers, body: bytes) -> bool:
        """As the Standard Webhooks specification has it."""
        sent_at = headers["webhook-timestamp"]
        if abs(self._now() - int(sent_at)) > 300:
            return False
        key = base64.b64decode(self.secret.removeprefix("whsec_"))
        signed = f"{headers['webhook-id']}.{sent_at}.".encode() + body
        expected = base64.b64encode(hmac.new(key, signed, hashlib.sha256).digest()).decode()
        given = headers["webhook-signature"].split(" ")
        return any(hmac.compare_digest(signature, f"v1,{expected}") for signature in given)


class Town:
    """All of it over Sydney, in a folder."""

    def __init__(self, binary: pathlib.Path, folder: pathlib.Path, seed: int, store: str | None = None) -> None:
        self.binary, self.folder = binary, folder
        self.registry = Daemon(
            binary, folder, "registry", f"--store={store or folder / 'registry.db'}",
            "--set=deliveries.webhooks_anywhere=true").start()
        network = subprocess.run(
            [binary, "network", "convert", "--to", "geojson", "--quiet"], capture_output=True, check=True).stdout
        self.registry.ask("PUT", "/v1/networks/sydney", network, content_type="application/geo+json")
        self.edge = Daemon(
            binary, folder, "edge", f"--store={folder / 'edge.db'}", f"--registry-url={self.registry.url}",
            "--set=registry.edge_id=edge-1")
        self.edge._command.append(f"--set=registry.advertise={self.edge.url}")
        self.edge.start()
        until(lambda: self.edge.ask("GET", "/readyz", raw=True), "the edge is ready")
        self.receiver = Receiver(seed)
        self._fleet = None
        atexit.register(lambda: self._fleet and self._fleet.kill())

    def enroll(self, homes: list[int]) -> None:
        """A provider with a drone at each home, its service, and a customer with a webhook."""
        registry = self.registry
        registry.ask("PUT", "/v1/providers/acme", {"name": "Acme"})
        for number, home in enumerate(homes, 1):
            registry.ask("PUT", f"/v1/drones/acme:{number}", {"network": "sydney", "home": home, "payload_max_kg": 2.0})
        service = self.folder / "parcels.toml"
        service.write_text(
            'id = "acme:parcels"\nname = "Parcels"\nnetwork = "sydney"\npayload_max_kg = 2.0\n'
            'time_zone = "Australia/Sydney"\ntariff = { currency = "AUD", base = "4.00", per_km = "1.20" }\n')
        self.run("service", "publish", service)
        registry.ask("PUT", "/v1/customers/shop", {"name": "Shop"})
        webhook = registry.ask("PUT", f"/v1/webhooks/{HOOK}", {"url": self.receiver.url})
        self.receiver.secret = webhook["secret"]
        assert "secret" not in registry.ask("GET", f"/v1/webhooks/{HOOK}")
        with (self.folder / "fleet.log").open("ab") as log:
            command = [sys.executable, "-B", ROOT / "clients/python/drone.py", f"127.0.0.1:{self.edge.port}", "--assigned"]
            command += [f"acme:{number}" for number in range(1, len(homes) + 1)]
            self._fleet = subprocess.Popen(command, stdout=log, stderr=log)

    def run(self, *arguments) -> str:
        """What a command writes; it has to succeed."""
        environment = {name: value for name, value in os.environ.items() if not name.startswith("SKYWAY_")}
        command = [self.binary, *arguments, f"--registry={self.registry.url}"]
        ran = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=WAIT_S)
        assert ran.returncode == 0, f"{arguments}: {ran.returncode} {ran.stderr}"
        return ran.stdout

    def order(self, source: int, destination: int, key: str) -> str:
        """A delivery of the shop, ordered once however often it is asked for; its id."""
        order = {"network": "sydney", "source": source, "destination": destination, "payload_kg": 0.5, "customer": "shop",
                 "reference": key}
        ordered = until(lambda: self.registry.ask("POST", "/v1/deliveries", order, idempotency_key=key), f"order {key}")
        return ordered["id"]

    def ended(self, delivery: str, within_s: float = WAIT_S) -> dict:
        """A delivery once it has ended."""
        def final():
            found = self.registry.ask("GET", f"/v1/deliveries/{delivery}")
            return found if found["status"] in FINAL else None
        return until(final, f"the end of {delivery}", within_s)

    def check_told(self, deliveries: list[dict]) -> int:
        """Checks that the endpoint was told every status of every delivery, in order; tells how many."""
        count = 0
        for delivery in deliveries:
            expected = [f"delivery.{change['status']}" for change in delivery["history"]]
            until(lambda: len(self.receiver.taken.get(delivery["id"], [])) >= len(expected), f"all events of {delivery['id']}")
            told = self.receiver.taken[delivery["id"]]
            assert told == expected, f"{delivery['id']}: told {told}, was {expected}"
            count += len(told)
        assert not self.receiver.faults, self.receiver.faults
        return count

    def end(self) -> None:
        """Ends everything in order."""
        self._fleet.kill()
        self._fleet.wait()
        assert self.edge.stop() == 0
        assert self.registry.stop() == 0
