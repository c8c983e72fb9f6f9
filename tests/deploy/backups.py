"""Backup and restore, by the very commands of docs/operations.md: what stands there is what runs here."""

import os
import pathlib

from installation import EDGES, REGISTRIES, Installation
from machine import Caller, Process, commands, expect, run, until

ZONE = {"type": "Feature", "geometry": {"type": "Point", "coordinates": [151.2, -33.87]}, "properties": {"radius_m": 5, "reason": "backup"}}


class Daemon:
    """A daemon on this machine, on ports of its own, with its store in a folder."""

    def __init__(self, program: pathlib.Path, role: str, folder: pathlib.Path, port: int, *more: str) -> None:
        self.port = port
        command = [program, role, "--listen", f"127.0.0.1:{port}", "--admin-listen", f"127.0.0.1:{port + 1}", *more]
        self.process = Process(role, command, folder / f"{role}.log", cwd=folder, env={"PATH": os.environ["PATH"]})
        until(f"{role} serves", lambda: self.caller().ask("GET", "/livez")[0] == 200 or not self.process.is_running())
        expect(self.process.is_running(), f"{role} does not start:\n{self.process.log()}")

    def caller(self) -> Caller:
        """A client of it."""
        return Caller("127.0.0.1", self.port)

    def status(self) -> dict:
        """What it says of itself."""
        return Caller("127.0.0.1", self.port + 1).done("GET", "/status")


def zone(client: Caller, path: str, name: str) -> None:
    """Declares a zone."""
    client.done("POST", path, ZONE | {"id": name}, content_type="application/geo+json")


def names(client: Caller, path: str, member: str) -> set[str]:
    """The zones that are there."""
    return {found["id"] for found in client.all_of(path, member)}


def of_edge(program: pathlib.Path, folder: pathlib.Path) -> str:
    """An edge alone: what was there at the backup is there after the restore, and numbers go on."""
    folder.mkdir()
    environment = {"PATH": f"{program.parent}:{os.environ['PATH']}", "STORE": str(folder / "edge.db"), "BACKUP": str(folder / "backup.db")}
    edge = Daemon(program, "edge", folder, 18080)
    zone(edge.caller(), "/v1/zones", "before")
    commands("edge, backup", environment)
    zone(edge.caller(), "/v1/zones", "after")
    before = edge.status()["revision"]
    # The worst case: what the write-ahead log has is not in the file.
    edge.process.kill()
    commands("edge, restore", environment)
    edge = Daemon(program, "edge", folder, 18080)
    found = names(edge.caller(), "/v1/zones", "features")
    expect(found == {"before"}, f"after the restore there are {found}")
    epoch = int(edge.status()["revision"].split("-")[0])
    expect(epoch > int(before.split("-")[0]), "the epoch did not grow")
    zone(edge.caller(), "/v1/zones", "later")
    edge.process.end()
    return "an edge's file, backed up while it ran and put back: what was there at the backup is there, in a later epoch"


def of_registry_file(program: pathlib.Path, folder: pathlib.Path) -> str:
    """A registry over a file: it finds out by itself that it was restored, or is told."""
    folder.mkdir()
    environment = {"PATH": f"{program.parent}:{os.environ['PATH']}", "STORE": str(folder / "registry.db"), "BACKUP": str(folder / "backup.db")}
    registry = Daemon(program, "registry", folder, 18180)
    network = run(program, "network", "convert", "--to", "geojson", "--quiet").stdout.encode()
    registry.caller().done("PUT", "/v1/networks/sydney", network, content_type="application/geo+json")
    zone(registry.caller(), "/v1/networks/sydney/zones", "before")
    commands("registry, backup of a file", environment)
    zone(registry.caller(), "/v1/networks/sydney/zones", "after")
    expect(registry.status()["epoch"] == 1, "the first epoch is not 1")
    registry.process.kill()
    commands("registry, restore of a file", environment)
    registry = Daemon(program, "registry", folder, 18180)
    expect(registry.status()["epoch"] == 2, "a restored registry did not begin a new epoch by itself")
    found = names(registry.caller(), "/v1/networks/sydney/zones", "objects")
    expect(found == {"before"}, f"after the restore there are {found}")
    registry.process.end()
    (folder / "registry.db.high-water").unlink()
    registry = Daemon(program, "registry", folder, 18180, "--new-epoch")
    expect(registry.status()["epoch"] == 3, "--new-epoch began none")
    registry.process.end()
    return "a registry's file, the same: epoch 2 by its high-water mark, epoch 3 by --new-epoch where the mark was lost"


def of_postgres(installation: Installation) -> str:
    """The registries of an installation: stopped, their database put back, started with a new epoch; edges follow."""
    operator = installation.registries(installation.token("operator_token"))
    backup = installation.folder / "skyway.dump"
    environment = installation.database | {"BACKUP": str(backup)}
    zone(operator, "/v1/networks/sydney/zones", "before-backup")
    commands("registry, backup of PostgreSQL", environment)
    zone(operator, "/v1/networks/sydney/zones", "after-backup")
    direct = {edge: installation.direct(edge, installation.token("operator_token")) for edge in EDGES}
    for edge, client in direct.items():
        until(f"{edge} has the zone", lambda client=client: "after-backup" in names(client, "/v1/zones", "features"))
    for registry in REGISTRIES:
        installation.processes[registry].end()
    commands("registry, restore of PostgreSQL", environment)
    installation.start(REGISTRIES[0], "--new-epoch")
    installation.start(REGISTRIES[1])
    installation.await_ready(*REGISTRIES)
    for edge, client in direct.items():
        until(
            f"{edge} follows the new epoch",
            lambda client=client: str(client.done("GET", "/v1/zones?page_size=1")["registry_revision"]).startswith("2-"),
        )
        until(f"{edge} has let go what was lost", lambda client=client: "after-backup" not in names(client, "/v1/zones", "features"))
        expect("before-backup" in names(client, "/v1/zones", "features"), f"{edge} has lost a zone of the backup")
    operator = installation.registries(installation.token("operator_token"))
    zone(operator, "/v1/networks/sydney/zones", "after-restore")
    for edge, client in direct.items():
        until(f"{edge} goes on", lambda client=client: "after-restore" in names(client, "/v1/zones", "features"))
    return "the database of two registries, the same: epoch 2, and three edges that follow it"
