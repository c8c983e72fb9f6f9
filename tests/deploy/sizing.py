"""What an edge takes of memory and disk, for docs/operations.md: for each segment, after reports to everywhere, with zones."""

import itertools
import pathlib
import re

from backups import Daemon
from machine import expect, run

REPORTS, BATCH, ZONES, DECISIONS = 10_000, 500, 500, 500
# Far above what is measured: what leaks or grows without a bound is found, not what is a little more than yesterday.
MEMORY_MIB_MAX, BYTES_PER_REPORT_MAX, BYTES_PER_SEGMENT_MAX = 300, 8_192, 2_048
# Two generated networks, from whose difference it follows what a segment takes.
SMALL_NODES, LARGE_NODES = 2_000, 20_000


def run_all(program: pathlib.Path, folder: pathlib.Path) -> str:
    """Measures edges over generated networks, and one over Sydney."""
    folder.mkdir()
    return f"{by_segments(program, folder)}; {over_sydney(program, folder)}"


def by_segments(program: pathlib.Path, folder: pathlib.Path) -> str:
    """What an edge takes at its start, without a store, by the size of its network."""
    segments, memory = [], []
    for nodes in (SMALL_NODES, LARGE_NODES):
        network = folder / f"{nodes}.geojson"
        run(program, "network", "generate", "--nodes", nodes, "--output", network)
        edge = Daemon(program, "edge", folder, 18080, "--no-store", "--network", str(network))
        segments.append(edge.status()["segments"])
        memory.append(memory_mib(edge))
        edge.process.end()
    for_each = (memory[1] - memory[0]) * 2**20 / (segments[1] - segments[0])
    expect(for_each < BYTES_PER_SEGMENT_MAX, f"an edge takes {for_each:.0f} bytes for a segment")
    without_any = memory[0] - for_each * segments[0] / 2**20
    return f"an edge: {without_any:.0f} MiB, and {for_each:.0f} bytes for each segment (from {segments[0]} and {segments[1]})"


def over_sydney(program: pathlib.Path, folder: pathlib.Path) -> str:
    """What it takes after reports to everywhere, and with zones."""
    edge = Daemon(program, "edge", folder, 18080)
    client = edge.caller()
    at_start = memory_mib(edge)
    features = client.done("GET", "/v1/network")["features"]
    segments = [feature["properties"] for feature in features if feature["geometry"]["type"] == "LineString"]
    nodes = [feature["id"] for feature in features if feature["geometry"]["type"] == "Point"]
    # Strides that have nothing in common with the numbers of segments and nodes: each combination comes once.
    drawn = ((segments[(97 * number) % len(segments)], nodes[(101 * number) % len(nodes)]) for number in itertools.count())
    for _ in range(REPORTS // BATCH):
        what_ifs = [
            {"service": {"from": segment["from"], "to": segment["to"]}, "destination": node, "dry_run": True}
            for segment, node in itertools.islice(drawn, BATCH)
        ]
        client.done("POST", "/v1/failures:batch", {"failures": what_ifs})
    after_reports = memory_mib(edge)
    for number in range(ZONES):
        place = [151.19 + 0.0005 * (number % 40), -33.88 + 0.0005 * (number // 40)]
        zone = {"type": "Feature", "geometry": {"type": "Point", "coordinates": place}, "properties": {"radius_m": 5}}
        client.done("POST", "/v1/zones", zone, content_type="application/geo+json")
    with_zones = memory_mib(edge)
    edge.process.end()
    before = (folder / "edge.db").stat().st_size
    # What-ifs stay in memory; what is decided is stored.
    edge = Daemon(program, "edge", folder, 18080)
    reports = [
        {"service": {"from": segment["from"], "to": segment["to"]}, "destination": node}
        for segment, node in itertools.islice(drawn, DECISIONS)
    ]
    edge.caller().done("POST", "/v1/failures:batch", {"failures": reports})
    edge.process.end()
    stored = (folder / "edge.db").stat().st_size - before
    expect(max(after_reports, with_zones) < MEMORY_MIB_MAX, f"an edge takes {after_reports:.0f} and {with_zones:.0f} MiB")
    expect(0 < stored / DECISIONS < BYTES_PER_REPORT_MAX, f"the file has {stored / DECISIONS:.0f} bytes for a report")
    return (
        f"over Sydney {at_start:.0f} MiB at its start, {after_reports:.0f} MiB after {REPORTS} reports, {with_zones:.0f} MiB with {ZONES} zones; "
        f"its file {before / 2**20:.1f} MiB then, and {stored / DECISIONS / 1024:.1f} KiB more for a report that is no what-if"
    )


def memory_mib(edge: Daemon) -> float:
    """What is resident."""
    status = pathlib.Path(f"/proc/{edge.process.pid()}/status").read_text()
    return int(re.search(r"^VmRSS:\s+(\d+) kB$", status, re.MULTILINE)[1]) / 1024
