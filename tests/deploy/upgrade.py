"""Upgrade and roll-back between two programs: each opens what the other one stored, and each follows the other.

SKYWAY_OLD_BINARY names the older one; without it both are the same, and only what a later version left is refused.
"""

import contextlib
import pathlib
import shutil
import sqlite3
import subprocess

from backups import Daemon, names, zone
from machine import Process, expect, run, until

REQUEST = {"drone_id": "acme-1", "from": "379", "to": "450"}


def run_all(folder: pathlib.Path, old: pathlib.Path, new: pathlib.Path) -> str:
    """Everything that two versions have to do with each other."""
    folder.mkdir()
    turns = [("old", old), ("new", new), ("old again", old), ("new again", new)]
    edge_store(folder / "edge", turns)
    registry_store(folder / "registry", turns)
    follow(folder / "old-edge", registry=new, edge=old)
    follow(folder / "old-registry", registry=old, edge=new)
    refuse_later(folder, new)
    versions = " and ".join(run(program, "--version").stdout.strip() for program in (old, new))
    return f"{versions}: each opens the other's stores and follows the other; a store of a later version is refused"


def edge_store(folder: pathlib.Path, turns: list) -> None:
    """An edge whose program changes to and fro: zones, their tags and plans stay."""
    folder.mkdir()
    tags: dict[str, str] = {}
    for number, (name, program) in enumerate(turns):
        edge = Daemon(program, "edge", folder, 18080)
        client = edge.caller()
        for known, tag in tags.items():
            status, _, headers = client.ask("GET", f"/v1/zones/{known}")
            expect(status == 200 and headers["etag"] == tag, f"{name}: {known} has {status} {headers['etag']}, not {tag}")
        zone(client, "/v1/zones", f"zone-{number}")
        tags[f"zone-{number}"] = client.ask("GET", f"/v1/zones/zone-{number}")[2]["etag"]
        edge.process.end()


def registry_store(folder: pathlib.Path, turns: list) -> None:
    """A registry whose program changes to and fro: its log stays, in one epoch."""
    folder.mkdir()
    network = run(turns[0][1], "network", "convert", "--to", "geojson", "--quiet").stdout.encode()
    for number, (name, program) in enumerate(turns):
        registry = Daemon(program, "registry", folder, 18180)
        client = registry.caller()
        if number == 0:
            client.done("PUT", "/v1/networks/sydney", network, content_type="application/geo+json")
        zone(client, "/v1/networks/sydney/zones", f"zone-{number}")
        found = names(client, "/v1/networks/sydney/zones", "objects")
        expect(found == {f"zone-{known}" for known in range(number + 1)}, f"{name}: there are {found}")
        log = client.done("GET", "/v1/networks/sydney/changes?after=0&epoch=1&limit=100")
        expect(log["revision"] == number + 2, f"{name}: the log is at {log['revision']}, not {number + 2}")
        registry.process.end()


def follow(folder: pathlib.Path, registry: pathlib.Path, edge: pathlib.Path) -> None:
    """An edge of one version and a registry of the other tell each other what they have."""
    folder.mkdir()
    with contextlib.ExitStack() as stack:
        log = Daemon(registry, "registry", folder, 18180)
        stack.callback(log.process.kill)
        network = run(registry, "network", "convert", "--to", "geojson", "--quiet").stdout.encode()
        log.caller().done("PUT", "/v1/networks/sydney", network, content_type="application/geo+json")
        follower = Daemon(edge, "edge", folder, 18080, "--registry-url", "http://127.0.0.1:18180")
        stack.callback(follower.process.kill)
        until("the edge is ready", lambda: follower.caller().ask("GET", "/readyz")[0] == 200)
        zone(log.caller(), "/v1/networks/sydney/zones", "from-the-registry")
        zone(follower.caller(), "/v1/zones", "from-the-edge")
        both = {"from-the-registry", "from-the-edge"}
        until("the edge has both zones", lambda: names(follower.caller(), "/v1/zones", "features") == both)
        until("the registry has both zones", lambda: names(log.caller(), "/v1/networks/sydney/zones", "objects") == both)
        follower.process.end()
        log.process.end()


def refuse_later(folder: pathlib.Path, program: pathlib.Path) -> None:
    """A store that a later version has changed is refused, with what to do, and left as it is."""
    stores = {
        "edge": "UPDATE meta SET number = 99 WHERE name = 'schema'",
        "registry": "UPDATE facts SET value = '99' WHERE name = 'schema'",
    }
    for role, change in stores.items():
        store = folder / f"later-{role}.db"
        shutil.copy(folder / role / f"{role}.db", store)
        with contextlib.closing(sqlite3.connect(store)) as database:
            expect(database.execute(change).rowcount == 1, f"the schema of {store} is not where it was")
            database.commit()
        before = store.read_bytes()
        command = [program, role, "--store", store, "--listen", "127.0.0.1:18080", "--admin-listen", "127.0.0.1:18081"]
        refused = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False, cwd=folder)
        expect(refused.returncode != 0, f"{role} starts with a store of a later version")
        is_clear = "99" in refused.stderr and "version" in refused.stderr
        expect(is_clear, f"{role} does not say why it refuses a store of a later version:\n{refused.stderr}")
        expect(store.read_bytes() == before, f"{role} changed a store that it refused")
