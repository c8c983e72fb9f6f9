"""A slow request leads to its trace: the exemplars of an edge that traces, read and kept by Prometheus as it is deployed."""

import pathlib
import urllib.parse

import yaml

from backups import Daemon
from installation import REPORT, prometheus_command
from machine import DEPLOY, Caller, Process, expect, until

TRACE = "4bf92f3577b34da6a3ce929d0e0e4736"
BUCKETS = 'skyway_request_duration_seconds_bucket{operation="report_failure"}'


def run_all(program: pathlib.Path, tools: pathlib.Path, folder: pathlib.Path) -> str:
    """One edge, whose collector is away, and Prometheus with the storage and the flags of deploy/."""
    folder.mkdir()
    edge = Daemon(program, "edge", folder, 18080, "--set", "traces.endpoint=http://127.0.0.1:9/v1/traces")
    told = yaml.safe_load((DEPLOY / "prometheus/prometheus.yml").read_text())
    told["global"] = {"scrape_interval": "1s"}
    told["scrape_configs"] = [{"job_name": "skyway-edge", "static_configs": [{"targets": [f"127.0.0.1:{edge.port + 1}"]}]}]
    del told["rule_files"]
    configuration = folder / "prometheus.yml"
    configuration.write_text(yaml.safe_dump(told))
    prometheus = Process("prometheus", prometheus_command(tools, configuration, folder / "tsdb"), folder / "prometheus.log")
    try:
        until("Prometheus", lambda: Caller("127.0.0.1", 9090).ask("GET", "/-/ready")[0] == 200)
        asked = f"/api/v1/query_exemplars?query={urllib.parse.quote(BUCKETS)}&start=0&end=99999999999"

        def kept() -> list:
            edge.caller().done("POST", "/v1/failures", REPORT, traceparent=f"00-{TRACE}-00f067aa0ba902b7-01")
            return Caller("127.0.0.1", 9090).done("GET", asked)["data"]

        found = until("Prometheus keeps an exemplar", kept)
        traces = {exemplar["labels"]["trace_id"] for series in found for exemplar in series["exemplars"]}
        expect(traces == {TRACE}, f"the exemplars name {traces}")
        edge.process.end()
    finally:
        prometheus.kill()
    return "exemplars: the trace of a request, from its bucket at the edge into Prometheus"
