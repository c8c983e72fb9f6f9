"""What an edge takes of memory and disk, for docs/operations.md: at its start, after reports to everywhere, with zones."""

import itertools
import pathlib
import re

from backups import Daemon
from machine import expect

REPORTS, BATCH, ZONES = 10_000, 500, 500
# Far above what is measured: what leaks or grows without a bound is found, not what is a little more than yesterday.
MEMORY_MIB_MAX, BYTES_PER_REPORT_MAX = 300, 8_192


def run_all(program: pathlib.Path, folder: pathlib.Path) -> str:
    """Measures one edge over Sydney."""
    folder.mkdir()
    edge = Daemon(program, "edge", folder, 18080)
    client = edge.caller()
    at_start = memory_mib(edge)
    features = client.done("GET", "/v1/network")["features"]
    segments = [feature["properties"] for feature in features if feature["geometry"]["type"] == "LineString"]
    nodes = [feature["id"] for feature in features if feature["geometry"]["type"] == "Point"]
    # Strides that have nothing in common with the numbers of segments and nodes: each combination comes once.
    drawn = ((segments[(97 * number) % len(segments)], nodes[(101 * number) % len(nodes)]) for number in itertools.count())
    for _ in range(REPORTS // BATCH):
        reports = [
            {"service": {"from": segment["from"], "to": segment["to"]}, "destination": node, "dry_run": True}
            for segment, node in itertools.islice(drawn, BATCH)
        ]
        client.done("POST", "/v1/failures:batch", {"failures": reports})
    after_reports = memory_mib(edge)
    for number in range(ZONES):
        place = [151.19 + 0.0005 * (number % 40), -33.88 + 0.0005 * (number // 40)]
        zone = {"type": "Feature", "geometry": {"type": "Point", "coordinates": place}, "properties": {"radius_m": 5}}
        client.done("POST", "/v1/zones", zone, content_type="application/geo+json")
    with_zones = memory_mib(edge)
    edge.process.end()
    stored = (folder / "edge.db").stat().st_size
    expect(max(after_reports, with_zones) < MEMORY_MIB_MAX, f"an edge takes {after_reports:.0f} and {with_zones:.0f} MiB")
    expect(stored / REPORTS < BYTES_PER_REPORT_MAX, f"the file has {stored / REPORTS:.0f} bytes for a report")
    return (
        f"an edge over Sydney: {at_start:.0f} MiB at its start, {after_reports:.0f} MiB after {REPORTS} reports, {with_zones:.0f} MiB with {ZONES} zones; "
        f"its file {stored / 2**20:.0f} MiB, {stored / REPORTS / 1024:.1f} KiB for a report"
    )


def memory_mib(edge: Daemon) -> float:
    """What is resident."""
    status = pathlib.Path(f"/proc/{edge.process.pid()}/status").read_text()
    return int(re.search(r"^VmRSS:\s+(\d+) kB$", status, re.MULTILINE)[1]) / 1024
