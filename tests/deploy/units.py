"""The Debian package and its units, run by a systemd of its own: installed, started, watched, configured wrongly, upgraded, removed."""

import os
import pathlib
import subprocess

from machine import Caller, Process, block, expect, run, until

BOOT = pathlib.Path(__file__).with_name("boot")
DAEMONS = {"edge": 8080, "registry": 8180}
# Everything within is done by root already.
SUDO = '#!/bin/sh\nif [ "$1" = -u ]; then user=$2; shift 2; exec runuser -u "$user" -- "$@"; fi\nexec "$@"\n'


class Machine:
    """A machine that systemd runs."""

    def __init__(self, folder: pathlib.Path, package: pathlib.Path) -> None:
        root = folder / "machine"
        root.mkdir(parents=True)
        command = ["unshare", "--mount", "--pid", "--fork", "--kill-child", "--uts", "--ipc", "--cgroup", BOOT, root, package]
        self._booted = Process("systemd", command, folder / "boot.log")
        until("systemd is there", self._is_there)

    def _is_there(self) -> bool:
        expect(self._booted.is_running(), f"systemd does not boot:\n{self._booted.log()}")
        return self.ask("systemctl", "is-active", "alone.target") == "active"

    def _inside(self) -> list[str]:
        first = pathlib.Path(f"/proc/{self._booted.pid()}/task/{self._booted.pid()}/children").read_text().split()
        return ["nsenter", f"--target={first[0]}", "--mount", "--pid", "--uts", "--ipc", "--cgroup"] if first else ["false"]

    def ask(self, *command: str) -> str:
        """What a command says within, whether it succeeds or not."""
        return subprocess.run([*self._inside(), *command], capture_output=True, text=True, check=False, cwd="/").stdout.strip()

    def do(self, *command: str) -> str:
        """A command within, which has to succeed."""
        return run(*self._inside(), *command, cwd="/").stdout.strip()

    def shown(self, daemon: str, name: str) -> str:
        """A property of a unit."""
        return self.do("systemctl", "show", "--value", f"--property={name}", f"skyway-{daemon}.service")

    def journal(self, daemon: str) -> str:
        """What a daemon logged."""
        return self.ask("journalctl", "--no-pager", "--output=cat", f"--unit=skyway-{daemon}.service")

    def add(self, path: str, text: str) -> None:
        """Writes a file within."""
        self.do("sh", "-c", f"mkdir -p {os.path.dirname(path)} && printf '%s' \"$0\" > {path}", text)

    def close(self) -> None:
        """Ends the machine at once."""
        self._booted.kill()


def run_all(folder: pathlib.Path, package: pathlib.Path) -> str:
    """All that a unit has to do."""
    machine = Machine(folder, package)
    try:
        expect(machine.do("stat", "--format=%U:%G %a", "/etc/skyway") == "root:skyway 750", "/etc/skyway is open to others")
        for daemon, port in DAEMONS.items():
            starts_and_ends(machine, daemon, port)
        is_watched(machine)
        is_not_started_in_vain(machine)
        is_set_up_by_the_page(machine)
        is_upgraded_and_removed(machine)
    finally:
        machine.close()
    return "package and units under systemd: ready when it serves, watched, ended in order, not started in vain, set up by docs/operations.md, upgraded, removed"


def start(machine: Machine, daemon: str) -> None:
    """Starts a unit, which returns when the daemon has told that it serves."""
    done = machine.ask("systemctl", "start", f"skyway-{daemon}.service")
    state = machine.shown(daemon, "ActiveState")
    expect(state == "active", f"skyway-{daemon} is {state} {done}:\n{machine.journal(daemon)}")


def starts_and_ends(machine: Machine, daemon: str, port: int) -> None:
    """What systemd takes for started serves; told to end it ends well."""
    start(machine, daemon)
    expect(Caller("127.0.0.1", port).ask("GET", "/readyz")[0] == 200, f"the {daemon} does not answer when its unit is started")
    expect(machine.shown(daemon, "StatusText") == f"serving on 127.0.0.1:{port}", "the status is another one")
    user = machine.do("stat", "--format=%U %a", f"/var/lib/skyway-{daemon}/{daemon}.db")
    expect(user == "skyway 600", f"the store of the {daemon} belongs to {user}")
    if daemon == "edge":
        threads = machine.do("ps", "-L", "-o", "ni=,comm=", "-p", machine.shown(daemon, "MainPID")).splitlines()
        niceness = dict(reversed(thread.split(maxsplit=1)) for thread in threads)
        steps_back = (niceness.get("skyway-store"), niceness.get("skyway-tables"))
        expect(steps_back == ("10", "19"), f"the unit keeps threads from stepping back: {threads}")
    huge_pages = machine.do("sh", "-c", f"grep THP_enabled /proc/{machine.shown(daemon, 'MainPID')}/status || true")
    expect(not huge_pages.endswith("1"), f"the unit keeps the {daemon} from refusing huge pages")
    machine.do("systemctl", "stop", f"skyway-{daemon}.service")
    expect(machine.shown(daemon, "Result") == "success", f"the {daemon} did not end well:\n{machine.journal(daemon)}")
    expect(f"the {daemon} has ended" in machine.journal(daemon), f"the {daemon} was not asked to end")


def is_watched(machine: Machine) -> None:
    """With a watchdog of a second, so that it takes no minute: it tells in time, and is started again when it does not."""
    machine.add("/run/systemd/system/skyway-edge.service.d/watch.conf", "[Service]\nWatchdogSec=1s\n")
    machine.do("systemctl", "daemon-reload")
    start(machine, "edge")
    first = machine.shown("edge", "WatchdogTimestampMonotonic")
    until("the edge has told that it turns", lambda: int(machine.shown("edge", "WatchdogTimestampMonotonic")) > int(first) + 2_000_000)
    expect(machine.shown("edge", "NRestarts") == "0", "the watchdog bit an edge that turns")
    machine.do("kill", "-STOP", machine.shown("edge", "MainPID"))
    until("the edge that stands still is started again", lambda: machine.shown("edge", "NRestarts") == "1")
    until("it serves again", lambda: machine.shown("edge", "ActiveState") == "active")
    machine.do("systemctl", "stop", "skyway-edge.service")
    machine.do("rm", "-r", "/run/systemd/system/skyway-edge.service.d")
    machine.do("systemctl", "daemon-reload")


def is_not_started_in_vain(machine: Machine) -> None:
    """A configuration with a fault stops the start once and for all."""
    machine.do("cp", "/etc/skyway/edge.toml", "/etc/skyway/edge.toml.kept")
    machine.do("sh", "-c", "echo 'lisen = \"127.0.0.1:80\"' >> /etc/skyway/edge.toml")
    machine.ask("systemctl", "start", "skyway-edge.service")
    until("the unit has failed", lambda: machine.shown("edge", "ActiveState") == "failed")
    expect(machine.shown("edge", "ExecMainStatus") == "78", "the exit code is not 78")
    expect(machine.shown("edge", "NRestarts") == "0", "it was started again in vain")
    expect("lisen" in machine.journal("edge"), "the journal does not say what is wrong")
    machine.do("mv", "/etc/skyway/edge.toml.kept", "/etc/skyway/edge.toml")


def is_set_up_by_the_page(machine: Machine) -> None:
    """Tokens, a registry with its network, and an edge that follows it, by the very commands of the page."""
    machine.add("/usr/local/bin/sudo", SUDO)
    machine.do("chmod", "0755", "/usr/local/bin/sudo")
    folder = "/srv/operator"
    machine.do("mkdir", folder)
    for name in ("tokens", "a machine, registry", "a machine, edge"):
        machine.do("bash", "-euo", "pipefail", "-c", f"cd {folder}\n{block(name)}")
    operator = machine.do("cat", f"{folder}/operator.token")
    expect(Caller("127.0.0.1", 8080).ask("GET", "/v1/zones")[0] == 401, "the edge serves any caller")

    def follows() -> bool:
        edges = Caller("127.0.0.1", 8180, operator).done("GET", "/v1/edges")["edges"]
        return [(edge["id"], edge["behind"]) for edge in edges] == [("edge-1", 0)]

    until("the edge follows", follows)
    for daemon in DAEMONS:
        machine.do("systemctl", "disable", "--now", f"skyway-{daemon}.service")


def is_upgraded_and_removed(machine: Machine) -> None:
    """What runs runs on with the new program; what is removed is stopped, and its airspace stays."""
    start(machine, "edge")
    before = machine.shown("edge", "MainPID")
    machine.do("dpkg", "--no-triggers", "--install", "/skyway.deb")
    until("the edge runs again", lambda: machine.shown("edge", "ActiveState") == "active")
    expect(machine.shown("edge", "MainPID") != before, "the old program still runs")
    expect(machine.shown("registry", "ActiveState") == "inactive", "an upgrade has started what did not run")
    machine.do("dpkg", "--no-triggers", "--purge", "skyway")
    gone = machine.ask("pgrep", "--exact", "skyway")
    expect(gone == "", "the edge outlives its package")
    machine.do("test", "-e", "/var/lib/skyway-edge/edge.db")
