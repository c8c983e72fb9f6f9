"""Processes as an image, a unit or a test starts them, on a machine of their own.

`scripts/check-deploy` runs these tests in a network, a process table and a view of the file system that end with them
(`unshare`): ports and addresses are free, mounts are private, and nothing outlives a test.
"""

import contextlib
import http.client
import json
import os
import pathlib
import re
import shutil
import signal
import ssl
import subprocess
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
DEPLOY = ROOT / "deploy"
PAGE = ROOT / "docs/operations.md"
POLL_S = 0.05
# The network of deploy/compose.yaml, and where in it the services are that need no address: proxy, PostgreSQL, Prometheus.
NETWORK, HOST = "172.30.80.0/24", "172.30.80.1"
PATIENCE_S = 60.0


class Failed(Exception):
    """What a test expected is not so."""


def expect(holds: bool, what: str) -> None:
    """Fails unless it holds."""
    if not holds:
        raise Failed(what)


def until(what: str, holds, within_s: float = PATIENCE_S):
    """Asks again and again, until the answer is not false; refused connections are no answer yet."""
    give_up = time.monotonic() + within_s
    told = None
    while time.monotonic() < give_up:
        try:
            answer = holds()
            if answer:
                return answer
            told = None
        except (OSError, http.client.HTTPException) as error:
            told = error
        time.sleep(POLL_S)
    raise Failed(f"not within {within_s:.0f} s: {what}" + (f" ({told})" if told else ""))


def run(*command, **options) -> subprocess.CompletedProcess:
    """A command that has to succeed; its output is told when it does not."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False, **options)
    expect(done.returncode == 0, f"{command} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done


def block(name: str) -> str:
    """The commands that the page marks with a name."""
    found = re.search(rf"<!-- tested: {re.escape(name)} -->\n+```sh\n(.*?)```", PAGE.read_text(), re.DOTALL)
    expect(found is not None, f"docs/operations.md has no commands marked '{name}'")
    return found[1]


def commands(name: str, environment: dict[str, str]) -> None:
    """Runs the block of commands that the page marks with a name."""
    done = subprocess.run(["bash", "-euo", "pipefail", "-c", block(name)], env=environment, capture_output=True, text=True, check=False)
    expect(done.returncode == 0, f"'{name}' of docs/operations.md ended with {done.returncode}:\n{done.stdout}{done.stderr}")


def mount(source: pathlib.Path, target: pathlib.Path, read_only: bool = True) -> None:
    """Makes a file or folder be seen at another place."""
    run("mount", "--bind", source, target)
    if read_only:
        run("mount", "-o", "remount,ro,bind", target)


class Process:
    """A process that is watched: it logs into a file, and ends as it is told to."""

    def __init__(self, name: str, command: list, log: pathlib.Path, **options) -> None:
        self.name = name
        self._log = log
        self._from = log.stat().st_size if log.exists() else 0
        with log.open("ab") as file:
            self._process = subprocess.Popen([str(part) for part in command], stdout=file, stderr=file, **options)

    def pid(self) -> int:
        """Its number."""
        return self._process.pid

    def is_running(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    def log(self) -> str:
        """What it wrote."""
        with self._log.open("rb") as file:
            file.seek(self._from)
            return file.read().decode(errors="replace")

    def end(self, sent: signal.Signals = signal.SIGTERM, within_s: float = 60.0) -> float:
        """Tells it to end, which it has to do well; returns how long that took, in seconds."""
        expect(self.is_running(), f"{self.name} ended by itself:\n{self.log()[-2000:]}")
        start = time.monotonic()
        self._process.send_signal(sent)
        status = self._process.wait(timeout=within_s)
        expect(status == 0, f"{self.name} ended with {status}, not 0:\n{self.log()[-2000:]}")
        return time.monotonic() - start

    def kill(self) -> None:
        """Ends it at once."""
        if self.is_running():
            self._process.kill()
        self._process.wait()

    def wait(self, within_s: float = PATIENCE_S) -> int:
        """Its exit code, once it has ended."""
        return self._process.wait(timeout=within_s)


class Caller:
    """A client that keeps its connection, as drones do. It never sends a request twice."""

    def __init__(self, host: str, port: int, token: str = "", authority: pathlib.Path | None = None) -> None:
        self._token = token
        if authority is None:
            self._connection = http.client.HTTPConnection(host, port, timeout=30)
        else:
            context = ssl.create_default_context(cafile=str(authority))
            self._connection = http.client.HTTPSConnection(host, port, timeout=30, context=context)

    def ask(self, method: str, path: str, body=None, **headers) -> tuple[int, dict, http.client.HTTPMessage]:
        """Status, body and headers of an answer."""
        sent = {name.replace("_", "-"): value for name, value in headers.items()}
        if self._token:
            sent["authorization"] = f"Bearer {self._token}"
        if body is not None and not isinstance(body, bytes):
            sent.setdefault("content-type", "application/json")
            body = json.dumps(body).encode()
        try:
            self._connection.request(method, path, body, sent)
            answer = self._connection.getresponse()
            text = answer.read()
        except (OSError, http.client.HTTPException):
            self._connection.close()
            raise
        told = json.loads(text) if "json" in (answer.headers.get("content-type") or "") else {"text": text.decode()}
        return answer.status, told, answer.headers

    def done(self, method: str, path: str, body=None, **headers) -> dict:
        """The body of an answer that has to be a success."""
        status, told, _ = self.ask(method, path, body, **headers)
        expect(200 <= status < 300, f"{method} {path}: {status} {told}")
        return told

    def all_of(self, path: str, member: str) -> list:
        """All pages of a list."""
        found, token = [], ""
        while True:
            page = self.done("GET", f"{path}{'&' if '?' in path else '?'}page_size=500{token}")
            found += page[member]
            if not page.get("next_page_token"):
                return found
            token = f"&page_token={page['next_page_token']}"


class Image:
    """The last stage of deploy/Dockerfile, as a folder: what it copies, and the libraries of the image it is built on."""

    # What gcr.io/distroless/cc-debian12 has and the program may need.
    LIBRARIES = {"libc.so.6", "libm.so.6", "libgcc_s.so.1", "libpthread.so.0", "libdl.so.2", "ld-linux-x86-64.so.2"}

    def __init__(self, folder: pathlib.Path, program: pathlib.Path) -> None:
        self.folder = folder
        self.entry_point, self.command, self.user, self.work = [], [], "", ""
        stage = (DEPLOY / "Dockerfile").read_text().rsplit("\nFROM ", 1)[1]
        expect(stage.startswith("gcr.io/distroless/cc-debian12"), "the libraries of another image are not known here")
        for line in stage.splitlines()[1:]:
            word, _, rest = line.partition(" ")
            match word:
                case "COPY":
                    self._copy(rest.split(), program)
                case "USER":
                    self.user = rest
                case "WORKDIR":
                    self.work = rest
                case "ENTRYPOINT":
                    self.entry_point = json.loads(rest)
                case "CMD":
                    self.command = json.loads(rest)
                case "" | "#" | "EXPOSE":
                    pass
                case _:
                    raise Failed(f"deploy/Dockerfile: {word} is not known here")
        self._copy_libraries(program)
        for name in ("dev", "etc", "proc", "run/secrets", "tmp"):
            (folder / name).mkdir(parents=True, exist_ok=True)
        (folder / "etc/nsswitch.conf").write_text("hosts: files\n")

    def _copy(self, words: list[str], program: pathlib.Path) -> None:
        options = [word for word in words if word.startswith("--")]
        source, target = [word for word in words if not word.startswith("--")]
        to = self.folder / target.lstrip("/")
        to.parent.mkdir(parents=True, exist_ok=True)
        if source.endswith("/skyway"):
            shutil.copy(program, to)
            return
        expect(source == "/state", f"deploy/Dockerfile: what {source} is, is not known here")
        to.mkdir()
        for option in options:
            if option.startswith("--chown="):
                uid, gid = option.removeprefix("--chown=").split(":")
                os.chown(to, int(uid), int(gid))

    def _copy_libraries(self, program: pathlib.Path) -> None:
        told = subprocess.run(["ldd", program], capture_output=True, text=True, check=False).stdout
        for line in told.splitlines():
            path = next((word for word in line.split() if word.startswith("/")), None)
            if path is None:
                continue
            expect(pathlib.Path(path).name in self.LIBRARIES, f"the image has no {path}")
            to = self.folder / path.lstrip("/")
            to.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, to)


class Container:
    """A service of an image: its own state, secrets and, where it has an address, network; the image seen read-only."""

    def __init__(self, image: Image, folder: pathlib.Path, name: str, environment: dict[str, str], address: str = "") -> None:
        self.image = image
        self._network = join_network(name, address) if address else []
        self.name = name
        self.environment = environment
        self.folder = folder
        self._root = folder / "root"
        self._root.mkdir(parents=True)
        mount(image.folder, self._root)
        uid, gid = (int(number) for number in image.user.split(":"))
        self._state = folder / "state"
        self._state.mkdir(mode=0o700)
        os.chown(self._state, uid, gid)
        mount(self._state, self._root / image.work.lstrip("/"), read_only=False)
        # The addresses that an engine would tell by name.
        hosts = folder / "hosts"
        hosts.write_text(f"127.0.0.1 localhost\n{HOST} proxy postgres\n")
        (image.folder / "etc/hosts").touch()
        mount(hosts, self._root / "etc/hosts")

    def secrets(self, files: dict[str, pathlib.Path]) -> None:
        """Puts files to where the engine would put secrets, with the owner and permissions they have."""
        folder = self.folder / "secrets"
        folder.mkdir()
        for name, source in files.items():
            shutil.copy2(source, folder / name)
            owner = source.stat()
            os.chown(folder / name, owner.st_uid, owner.st_gid)
        mount(folder, self._root / "run/secrets")

    def start(self, command: list[str] | None = None) -> Process:
        """Starts the entry point with the command of the image, or with another."""
        uid, gid = self.image.user.split(":")
        inside = ["unshare", f"--root={self._root}", f"--wd={self.image.work}", f"--setgid={gid}", f"--setuid={uid}"]
        command = self.image.command if command is None else command
        return Process(self.name, [*self._network, *inside, *self.image.entry_point, *command], self.folder / "log", env=self.environment)

    def state(self) -> pathlib.Path:
        """The folder of its volume."""
        return self._state


@contextlib.contextmanager
def postgres(folder: pathlib.Path, password: str):
    """A PostgreSQL on port 5432, with the user and database of deploy/compose.yaml."""
    binaries = max(pathlib.Path("/usr/lib/postgresql").glob("*/bin"))
    folder.mkdir()
    shutil.chown(folder, "postgres", "postgres")
    as_user = {"user": "postgres", "group": "postgres", "cwd": "/"}
    pwfile = folder / "password"
    pwfile.write_text(password)
    shutil.chown(pwfile, "postgres", "postgres")
    data = folder / "data"
    run(binaries / "initdb", "--pgdata", data, "--username=skyway", f"--pwfile={pwfile}", "--auth=scram-sha-256", "--no-sync", **as_user)
    with (data / "pg_hba.conf").open("a") as file:
        file.write(f"host all all {NETWORK} scram-sha-256\n")
    command = [binaries / "postgres", "-D", data, "-k", folder, "-c", f"listen_addresses=127.0.0.1,{HOST}"]
    server = Process("postgres", command, folder / "log", **as_user)
    try:
        until("PostgreSQL", lambda: subprocess.run([binaries / "pg_isready", "-h", "127.0.0.1"], capture_output=True, check=False).returncode == 0)
        environment = {**os.environ, "PGPASSWORD": password, "PGHOST": "127.0.0.1", "PGUSER": "skyway"}
        run(binaries / "createdb", "skyway", env=environment)
        yield environment
    finally:
        server.kill()


def make_network() -> None:
    """Gives this machine its loopback, and the network of deploy/compose.yaml."""
    # Where names of networks are kept, and what services find in /run.
    run("mount", "-t", "tmpfs", "tmpfs", "/run")
    run("ip", "link", "set", "lo", "up")
    run("ip", "link", "add", "inside", "type", "bridge")
    run("ip", "address", "add", f"{HOST}/24", "dev", "inside")
    run("ip", "link", "set", "inside", "up")


def join_network(name: str, address: str) -> list[str]:
    """Makes the network of a service, with one address; what to put before a command that is to be in it."""
    run("ip", "netns", "add", name)
    # Names of interfaces are short.
    outside = f"to-{name}"[-15:]
    run("ip", "link", "add", outside, "type", "veth", "peer", "name", "eth0", "netns", name)
    run("ip", "link", "set", outside, "master", "inside", "up")
    run("ip", "-n", name, "address", "add", f"{address}/24", "dev", "eth0")
    for interface in ("lo", "eth0"):
        run("ip", "-n", name, "link", "set", interface, "up")
    return ["nsenter", f"--net=/run/netns/{name}"]
