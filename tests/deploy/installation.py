"""deploy/compose.yaml as it stands, without a container engine: the same commands, settings, addresses, secrets and users,
the proxy and Prometheus by their own programs, PostgreSQL beside them.
"""

import contextlib
import json
import os
import pathlib
import shutil
import subprocess
import urllib.parse

import grpc
import yaml

from machine import DEPLOY, Caller, Container, Failed, Image, Process, commands, expect, mount, postgres, run, until

REGISTRIES = ("registry-1", "registry-2")
EDGES = ("edge-1", "edge-2", "edge-3")
EDGE_PORT, REGISTRY_PORT = 8080, 8180
PROXY_EDGES, PROXY_REGISTRIES = 8444, 8443
REPORT = {"type": "navigational", "service": {"from": 379, "to": 406}, "destination": 450, "dry_run": True}


class Installation:
    """The services of the file, of which each can be started and ended."""

    def __init__(self, folder: pathlib.Path, program: pathlib.Path, tools: pathlib.Path) -> None:
        self.folder = folder
        self.program = program
        self._tools = tools
        self.services = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]
        self.secrets = folder / "secrets"
        self.image = Image(folder / "image", program)
        self.processes: dict[str, Process] = {}
        self._containers: dict[str, Container] = {}
        self._prepare()

    def _prepare(self) -> None:
        environment = {**os.environ, "SKYWAY": str(self.program)}
        run(DEPLOY / "compose/prepare", self.secrets, env=environment)
        again = subprocess.run([DEPLOY / "compose/prepare", self.secrets], env=environment, capture_output=True, check=False)
        expect(again.returncode == 1 and b"already" in again.stderr, "secrets that are there are made anew")

    def more_tokens(self, role: str, count: int) -> list[str]:
        """Further tokens of a role for edges and registries, before they start."""
        tokens = []
        for number in range(count):
            made = run(self.program, "token", "--role", role, "--subject", f"{role}-{number}")
            tokens.append(made.stdout.strip())
            for name in ("edge_tokens", "registry_tokens"):
                with (self.secrets / name).open("a") as file:
                    file.write(made.stderr + "\n")
        return tokens

    def token(self, name: str) -> str:
        """A token that was prepared."""
        return (self.secrets / name).read_text().strip()

    @property
    def authority(self) -> pathlib.Path:
        """The certificate that the proxy's is checked with."""
        return self.secrets / "ca"

    def environment(self, service: str) -> dict[str, str]:
        """The settings of a service, as the file says them."""
        return dict(self.services[service].get("environment", {}))

    def address(self, service: str) -> str:
        """The address of a service."""
        return self.services[service]["networks"]["inside"]["ipv4_address"]

    def container(self, service: str) -> Container:
        """The container of a service, which keeps its state when it is started again."""
        if service not in self._containers:
            container = Container(self.image, self.folder / service, service, self.environment(service), self.address(service))
            container.secrets({name: self.secrets / name for name in self.services[service]["secrets"]})
            self._containers[service] = container
        return self._containers[service]

    def start(self, service: str, *more: str) -> None:
        """Starts a daemon and waits until it serves; `more` follows its command."""
        container = self.container(service)
        command = self.services[service].get("command")
        process = container.start([*(command or self.image.command), *more])
        self.processes[service] = process

        def serves() -> bool:
            if not process.is_running():
                raise Failed(f"{service} does not start:\n{process.log()}")
            return self.direct(service).ask("GET", "/livez")[0] == 200

        until(f"{service} serves", serves)

    def direct(self, service: str, token: str = "") -> Caller:
        """A client of a daemon itself, past the proxy."""
        port = REGISTRY_PORT if service in REGISTRIES else EDGE_PORT
        return Caller(self.address(service), port, token)

    def edges(self, token: str) -> Caller:
        """A client of the edges, as drones and operators reach them."""
        return Caller("localhost", PROXY_EDGES, token, self.authority)

    def registries(self, token: str) -> Caller:
        """A client of the registries, as edges and operators reach them."""
        return Caller("localhost", PROXY_REGISTRIES, token, self.authority)

    def is_ready(self, service: str) -> bool:
        """Whether a daemon says that it is."""
        return self.direct(service).ask("GET", "/readyz")[0] == 200

    def await_ready(self, *services: str) -> None:
        """Waits until daemons are ready."""
        for service in services:
            until(f"{service} is ready", lambda service=service: self.is_ready(service))

    def start_proxy(self) -> None:
        """The proxy with its configuration, where the file puts it; the edges have to be there, and without a network."""
        # The whole machine sees what only the containers of proxy and Prometheus would.
        at = pathlib.Path("/run/secrets")
        at.mkdir()
        mount(self.secrets, at)
        program = shutil.which("haproxy", path=f"{os.environ['PATH']}:/usr/sbin")
        command = [program, "-W", "-db", "-f", DEPLOY / "compose/haproxy.cfg"]
        self.processes["proxy"] = Process("proxy", command, self.folder / "proxy.log")

        def serves() -> bool:
            expect(self.processes["proxy"].is_running(), f"the proxy ends:\n{self.processes['proxy'].log()}")
            # It takes servers for ready until it has asked them: only then does it say that none is, as none has a network.
            return "No server" in self.edges("").ask("GET", "/readyz")[1].get("text", "")

        until("the proxy has asked all edges", serves)

    def proxy_log(self) -> str:
        """The end of what the proxy wrote: its servers that came and went, and the requests before a failure."""
        proxy = self.processes.get("proxy")
        return "\n".join(proxy.log().splitlines()[-20:]) if proxy else "(it was not started)"

    def start_prometheus(self) -> None:
        """Prometheus with its configuration, on the port of its image."""
        configuration = self.folder / "prometheus"
        configuration.mkdir()
        for name in ("prometheus.yml", "alerts.yml"):
            shutil.copy(DEPLOY / "prometheus" / name, configuration)
        command = prometheus_command(self._tools, configuration / "prometheus.yml", self.folder / "tsdb")
        self.processes["prometheus"] = Process("prometheus", command, self.folder / "prometheus.log")


def prometheus_command(tools: pathlib.Path, configuration: pathlib.Path, data: pathlib.Path) -> list:
    """Prometheus with the flags of the file, on the port of its image; files and data are elsewhere."""
    flags = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]["prometheus"]["command"]
    moved = {"--config.file": configuration, "--storage.tsdb.path": data}
    for flag in moved:
        expect(any(given.startswith(f"{flag}=") for given in flags), f"compose.yaml: Prometheus has no {flag}")
    others = [flag for flag in flags if flag.partition("=")[0] not in moved]
    return [tools / "prometheus", *(f"{flag}={path}" for flag, path in moved.items()), *others, "--web.listen-address=127.0.0.1:9090"]


@contextlib.contextmanager
def installed(folder: pathlib.Path, program: pathlib.Path, tools: pathlib.Path, drones: int, operators: int):
    """Everything of the file but Grafana, started and ready, with further tokens for drones and operators."""
    installation = Installation(folder, program, tools)
    installation.drones = installation.more_tokens("drone", drones)
    installation.operators = installation.more_tokens("operator", operators)
    try:
        with postgres(folder / "postgres", installation.token("postgres_password")) as database:
            installation.database = database
            for service in (*REGISTRIES, *EDGES):
                installation.start(service)
            installation.start_proxy()
            installation.start_prometheus()
            installation.await_ready(*REGISTRIES)
            give_network(installation)
            installation.await_ready(*EDGES)
            until("the proxy has seen an edge", lambda: installation.edges("").ask("GET", "/readyz")[0] == 200)
            yield installation
    except Failed as error:
        raise Failed(f"{error}\nthe proxy's last lines:\n{installation.proxy_log()}") from error
    finally:
        for process in installation.processes.values():
            process.kill()


def give_network(installation: Installation) -> None:
    """The edges wait for the network, which an operator gives to the registry."""
    expect(not any(installation.is_ready(edge) for edge in EDGES), "an edge is ready without a network")
    path = f"{installation.program.parent}:{os.environ['PATH']}"
    commands("network", {"PATH": path, "SECRETS": str(installation.secrets)})


def looks_right(installation: Installation) -> str:
    """A drone is answered and a zone spreads, both through the proxy; so does gRPC."""
    told = installation.edges(installation.token("drone_token")).done("POST", "/v1/failures", REPORT)
    expect(told["outcome"] == "rerouted" and told["freshness"] == "fresh", f"the drone is answered {told}")
    expect(installation.edges("").ask("POST", "/v1/failures", REPORT)[0] == 401, "a stranger is answered")
    operator = installation.edges(installation.token("operator_token"))
    zone = {"type": "Feature", "id": "first", "geometry": {"type": "Point", "coordinates": [151.2, -33.87]}, "properties": {"radius_m": 5}}
    ack = operator.done("POST", "/v1/zones", zone, content_type="application/geo+json")
    expect(ack["durable"], "the zone is not durable")
    for edge in EDGES:
        client = installation.direct(edge, installation.token("operator_token"))
        until(f"{edge} has the zone", lambda client=client: client.ask("GET", "/v1/zones/first")[0] == 200)
    credentials = grpc.ssl_channel_credentials(installation.authority.read_bytes())
    with grpc.secure_channel(f"localhost:{PROXY_EDGES}", credentials) as channel:
        check = channel.unary_unary("/grpc.health.v1.Health/Check")
        # HealthCheckResponse { status: SERVING }
        expect(check(b"", timeout=30) == b"\x08\x01", "the edges do not serve gRPC through the proxy")
    return "drones, operators and gRPC through the proxy; a zone posted at one edge is at three"


def strangers_are_not_followed(installation: Installation) -> str:
    """An edge follows a registry by https only where its certificate is from the authority that is named, for its name."""
    other = installation.folder / "other-authority"
    run("openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=other", "-keyout", "/dev/null", "-out", other)
    token = installation.secrets / "edge_1_token"
    tried = {
        "another authority": ("https://localhost:8443", other, False),
        "another name": ("https://127.0.0.2:8443", installation.authority, False),
        "the authority": ("https://localhost:8443", installation.authority, True),
    }
    for what, (url, authority, is_followed) in tried.items():
        folder = installation.folder / what.replace(" ", "-")
        folder.mkdir()
        settings = {"registry.url": url, "registry.ca_file": authority, "registry.token_file": token, "registry.edge_id": "edge-1"}
        flags = [part for name, value in settings.items() for part in ("--set", f"{name}={value}")]
        listen = ["--listen", "127.0.0.1:18080", "--admin-listen", "127.0.0.1:18081", "--no-store"]
        edge = Process("stranger", [installation.program, "edge", *listen, *flags], folder / "log", env={}, cwd=folder)
        try:
            if is_followed:
                until("the edge follows", lambda: Caller("127.0.0.1", 18080).ask("GET", "/readyz")[0] == 200)
                continue

            def refused() -> bool:
                return Caller("127.0.0.1", 18081).done("GET", "/status")["registry"]["failures"].get("transport", 0) > 2

            until(f"{what} is refused", refused)
            expect(Caller("127.0.0.1", 18080).ask("GET", "/readyz")[0] == 503, f"the edge follows, although it is {what}")
        finally:
            edge.kill()
    return "no registry with a certificate of another authority or for another name is followed"


def is_observed(installation: Installation) -> str:
    """Prometheus reads all five daemons, nothing is wrong, and the dashboard's queries have answers."""
    prometheus = Caller("127.0.0.1", 9090)

    def query(text: str) -> list:
        return prometheus.done("GET", f"/api/v1/query?query={urllib.parse.quote(text)}")["data"]["result"]

    expected = len(EDGES) + len(REGISTRIES)
    until("Prometheus reads all daemons", lambda: len(query('up{job=~"skyway-.*"} == 1')) == expected)
    rules = prometheus.done("GET", "/api/v1/rules")["data"]["groups"]
    broken = [rule["name"] for group in rules for rule in group["rules"] if rule["health"] == "err"]
    expect(rules and not broken, f"rules that fail: {broken}")
    # Restarts and a restore have just happened: what waits (`for`) may be pending, and holds may wait for an operator.
    firing = {rule["name"] for group in rules for rule in group["rules"] if rule.get("state") == "firing"}
    # And how fast this machine is, is not what is tried here.
    expected_ones = {"SkywayHoldsWaiting", "SkywayFailuresSlowFast", "SkywayFailuresSlowSlow"}
    expect(firing <= expected_ones, f"after all that is over these fire: {firing}")
    dashboard = json.loads((DEPLOY / "grafana/dashboards/skyway.json").read_text())
    queries = [(panel["title"], target["expr"]) for panel in dashboard["panels"] for target in panel.get("targets", [])]
    # What has not happened here has no series.
    quiet = {"Shed for load", "Refusals", "Refused, failed, begun anew", "Closed by the server", "Tables found"}
    drone = installation.edges(installation.token("drone_token"))
    empty: set[str] = set()

    def all_have_data() -> bool:
        # Rates need two readings, and something between them.
        drone.done("POST", "/v1/failures", REPORT)
        texts = [(title, text.replace("$__rate_interval", "5m").replace("$edge", ".*")) for title, text in queries]
        empty.clear()
        empty.update(title for title, text in texts if not query(text))
        return empty <= quiet

    try:
        until("all panels have data", all_have_data)
    except Failed as error:
        raise Failed(f"panels without data: {empty - quiet}") from error
    return f"Prometheus reads {expected} daemons, no alert is left, and of {len({title for title, _ in queries})} panels all have data but {len(empty)}"
