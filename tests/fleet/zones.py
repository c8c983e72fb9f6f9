"""Whether a drone is sent through a zone that is in force while it is there.

What was told before a zone came is no fault of the zone's: that its drone is told something else is accounted for
elsewhere.
"""

from fault import Fault
from record import Move, Record, Version, Zone

# What lies nearer to a boundary than this is on either side of it.
DOUBT_M = 0.5
DOUBT_S = 0.5


def judge(record: Record) -> list[Fault]:
    """Each version that is flown, against each zone that was in force before it was told."""
    faults = []
    for zone in record.zones.values():
        for version in record.near(zone) if not zone.has_band else ():
            if zone.stood_s <= version.sent_s < zone.gone_s:
                faults += through(version, zone)
    return faults


def through(version: Version, zone: Zone) -> list[Fault]:
    """The first leg of a version that leads through a zone. One that begins in it may leave it."""
    box = zone.shape.box()
    is_leaving = "leaving_zone" in version.flags or "cannot_stop" in version.flags
    for move in version.flown():
        inside = times_inside(move, zone, box)
        if is_leaving and inside and inside[0][0] <= move.enters_s + DOUBT_S:
            continue
        is_leaving = False
        for enters_s, leaves_s in inside:
            if zone.meets(enters_s + DOUBT_S, leaves_s - DOUBT_S):
                text = f"version {version.number} on {move.segment} in zone {zone.id} for {leaves_s - enters_s:.1f} s"
                return [Fault("zone", enters_s, version.plan, text)]
    return []


def times_inside(move: Move, zone: Zone, box: tuple[float, float, float, float]) -> list[tuple[float, float]]:
    """When a drone on a line is within a zone and its margin."""
    reach_m = zone.margin_m - DOUBT_M
    xs, ys = [corner[0] for corner in move.line], [corner[1] for corner in move.line]
    if max(xs) < box[0] - reach_m or min(xs) > box[2] + reach_m:
        return []
    if max(ys) < box[1] - reach_m or min(ys) > box[3] + reach_m:
        return []
    times = []
    took_s = move.leaves_s - move.enters_s
    begin_s = move.enters_s
    lengths = move.lengths()
    for one, other, length in zip(move.line, move.line[1:], lengths):
        share_s = took_s * length / (sum(lengths) or 1.0)
        for low, high in zone.shape.near(one[:2], other[:2], reach_m):
            enters_s, leaves_s = begin_s + low * share_s, min(begin_s + high * share_s, move.until_s)
            if leaves_s > enters_s:
                times.append((enters_s, leaves_s))
        begin_s += share_s
    return times
