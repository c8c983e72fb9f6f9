"""What the dashboard and the alerts name is what the daemons tell: each metric is on a real page of one of them."""

import contextlib
import json
import pathlib
import re
import socket

import yaml

from backups import Daemon
from machine import DEPLOY, Caller, expect, run, until

NAME = re.compile(r"\bskyway_[a-z_]+")


def told_by_daemons(program: pathlib.Path, folder: pathlib.Path) -> set[str]:
    """The names on the pages of an edge and of its registry, after something of everything that is counted has happened."""
    folder.mkdir()
    with contextlib.ExitStack() as stack:
        registry = Daemon(program, "registry", folder, 18180)
        stack.callback(registry.process.kill)
        network = run(program, "network", "convert", "--to", "geojson", "--quiet").stdout.encode()
        registry.caller().done("PUT", "/v1/networks/sydney", network, content_type="application/geo+json")
        more = ("--registry-url", "http://127.0.0.1:18180", "--set", "limits.event_streams=0", "--set", "limits.preface_deadline=50ms")
        edge = Daemon(program, "edge", folder, 18080, *more)
        stack.callback(edge.process.kill)
        client = edge.caller()
        until("the edge is ready", lambda: client.ask("GET", "/readyz")[0] == 200)
        report = {"service": {"from": 379, "to": 406}, "destination": 450, "dry_run": True}
        client.done("POST", "/v1/failures", report)
        expect(client.ask("GET", "/v1/zones/nowhere")[0] == 404, "there is a zone that was never declared")
        status = client.ask("GET", "/v1/events")[0]
        expect(status in (429, 503), f"a stream beyond the limit is not shed: {status}")
        with socket.create_connection(("127.0.0.1", 18080)) as silent:
            expect(silent.recv(1) == b"", "a silent connection is not closed")
        pages = page(registry)
        registry.process.end()
        until("a question to the registry failed", lambda: "skyway_registry_failures_total" in page(edge))
        pages += page(edge)
    return set(re.findall(r"^(skyway_[a-z_]+)[ {]", pages, re.MULTILINE))


def page(daemon: Daemon) -> str:
    """The metrics of a daemon."""
    return Caller("127.0.0.1", daemon.port + 1).done("GET", "/metrics")["text"]


def run_all(program: pathlib.Path, folder: pathlib.Path) -> str:
    """Compares the names."""
    told = told_by_daemons(program, folder)
    dashboard = json.loads((DEPLOY / "grafana/dashboards/skyway.json").read_text())
    queries = [target["expr"] for panel in dashboard["panels"] for target in panel.get("targets", [])]
    rules = [rule for group in yaml.safe_load((DEPLOY / "prometheus/alerts.yml").read_text())["groups"] for rule in group["rules"]]
    recorded = {rule["record"] for rule in rules if "record" in rule}
    used = {name for text in queries + [rule["expr"] for rule in rules] for name in NAME.findall(text)}
    expect(len(used) > 30, f"only {len(used)} metrics were found in dashboard and alerts")
    expect(used <= told, f"no daemon tells {sorted(used - told)}")
    named = {name for text in queries for name in re.findall(r"\bskyway:[a-z0-9_:]+", text)}
    expect(named <= recorded, f"no rule records {sorted(named - recorded)}")
    return f"{len(used)} metrics of dashboard and alerts, each told by a daemon"
