"""Whether every plan that a zone meets was told what to do, once, and by name."""

import dataclasses
import math

from fault import Fault
from record import Record, Told, Version, Zone
from zones import times_inside

# A drone that is in a zone's way for less than this after it came may have passed it.
JUST_PAST_S = 2.0
# So long after a kill that lost the count of a zone all have been told.
TOLD_AFTER_KILL_S = 60.0


def judge(record: Record) -> list[Fault]:
    by_plan: dict[str, list[Told]] = {}
    # By zone and plan, when it was last told.
    by_zone: dict[str, dict[str, float]] = {}
    for told in record.told:
        by_plan.setdefault(told.plan, []).append(told)
        for cause in told.causes:
            by_zone.setdefault(cause, {})[told.plan] = told.at_s
    for told in record.listed:
        for cause in told.causes:
            if is_answered(record, told, cause):
                by_zone.setdefault(cause, {})[told.plan] = told.at_s
    return (
        untold(record, by_zone)
        + told_twice(record, by_plan)
        + named_in_vain(record, by_plan)
        + miscounted(record, by_zone)
        + standing_untold(record, by_zone)
    )


def is_answered(record: Record, told: Told, cause: str) -> bool:
    """Whether what a list shows answers a closure that it names: the version was made after it, or does not meet it."""
    zone, version = record.zones.get(cause), record.versions[told.plan].get(told.wanted)
    if zone is None:
        return False
    return zone.put_s <= told.made_s or (version is not None and not is_met(version, zone))


def untold(record: Record, by_zone: dict[str, dict[str, float]]) -> list[Fault]:
    """What a drone flew when a zone came leads through it later, and no outcome names the zone."""
    faults = []
    for zone in record.zones.values():
        # What was lifted before all were told need not be told any more.
        told_s = told_by_s(record, zone)
        if zone.has_band or zone.gone_s < told_s:
            continue
        for version in record.near(zone):
            is_flown_then = version.from_s <= zone.put_s < version.until_s
            if not is_flown_then or not is_met(version, zone):
                continue
            named = by_zone.get(zone.id, {}).get(version.plan, -math.inf) >= zone.put_s
            has_ended = record.ended.get(version.plan, math.inf) < told_s
            if not named and not has_ended and not has_moved_on(record, version, zone):
                text = f"version {version.number} leads through zone {zone.id}, and no outcome names it"
                faults.append(Fault("untold", zone.put_s, version.plan, text))
    return faults


def told_by_s(record: Record, zone: Zone) -> float:
    """When all have been told of a zone: the edge says so, or a kill has lost its count."""
    if math.isfinite(zone.replanned_s):
        return zone.replanned_s
    return min((at_s + TOLD_AFTER_KILL_S for at_s in record.kills if at_s > zone.put_s), default=math.inf)


def has_moved_on(record: Record, version: Version, zone: Zone) -> bool:
    """Whether a kill left nothing to tell: its drone had taken over a version that the zone does not meet by then."""
    killed_s = min((at_s for at_s in record.kills if at_s > zone.put_s), default=-math.inf)
    others = record.versions[version.plan].values()
    return any(zone.put_s < other.from_s <= killed_s and not is_met(other, zone) for other in others)


def is_met(version: Version, zone: Zone, from_s: float | None = None) -> bool:
    """Whether the version, as it was to be flown when the zone came, or from another instant on, surely leads through it."""
    box = zone.shape.box()
    from_s = zone.put_s if from_s is None else from_s
    for move in version.moves:
        if move.segment is None or move.leaves_s <= from_s:
            continue
        whole = dataclasses.replace(move, until_s=move.leaves_s)
        for enters_s, leaves_s in times_inside(whole, zone, box):
            since_s = max(enters_s, from_s)
            if enters_s > from_s + JUST_PAST_S and is_in_window(zone, since_s, leaves_s):
                return True
    return False


def is_in_window(zone: Zone, from_s: float, until_s: float) -> bool:
    """By its windows alone: when it will be lifted is unknown."""
    return any(start <= until_s and from_s <= end for start, end in zone.windows)


def told_twice(record: Record, by_plan: dict[str, list[Told]]) -> list[Fault]:
    """Two outcomes in a row for the same closures, and neither airspace nor what of them lies ahead had changed between."""
    faults = []
    for plan, every in by_plan.items():
        for one, other in zip(every, every[1:]):
            is_same = one.causes and one.causes == other.causes and one.changes == other.changes
            if is_same and not has_found_a_way(one, other) and not is_relief(record, one, other):
                text = f"{one.outcome} and then {other.outcome} for {', '.join(sorted(one.causes))}"
                faults.append(Fault("told_twice", other.at_s, plan, text))
    return faults


def has_found_a_way(before: Told, told: Told) -> bool:
    """Whether a drone that had none is told a way: others may have flown on meanwhile, or freed a pad."""
    return before.outcome == "no_route" and told.outcome not in ("no_route", "unaffected")


def is_relief(record: Record, before: Told, told: Told) -> bool:
    """Whether a drone is told that it flies on as it was, as what it was told of lies behind it by then."""
    if told.outcome != "unaffected" or before.outcome == told.outcome:
        return False
    flown = [one for one in record.versions[told.plan].values() if one.from_s <= told.at_s < one.until_s]
    zones = [record.zones[cause] for cause in told.causes if cause in record.zones]
    return not any(is_met(version, zone, told.at_s) for version in flown for zone in zones)


def named_in_vain(record: Record, by_plan: dict[str, list[Told]]) -> list[Fault]:
    """An outcome names a zone that has not come yet, or that was never put."""
    faults = []
    for plan, every in by_plan.items():
        for told in every:
            for cause in told.causes:
                if cause not in told.known:
                    text = f"{told.outcome} for {cause}, which is not there"
                    faults.append(Fault("named_in_vain", told.at_s, plan, text))
    return faults


def miscounted(record: Record, by_zone: dict[str, dict[str, float]]) -> list[Fault]:
    """The edge says that all are told, and fewer were."""
    faults = []
    for zone in record.zones.values():
        if zone.replanned is None:
            continue
        outcomes = zone.replanned["outcomes"]
        silent = outcomes.get("unaffected", 0) + outcomes.get("ended", 0)
        count, named = zone.replanned["plan_count"], len(by_zone.get(zone.id, ()))
        if sum(outcomes.values()) != count or named < count - silent:
            text = f"zone {zone.id}: {count} plans, outcomes {outcomes}, and {named} were told"
            faults.append(Fault("miscounted", zone.replanned_s, "", text))
    return faults


def standing_untold(record: Record, by_zone: dict[str, dict[str, float]]) -> list[Fault]:
    """A plan says at the end what affects it, and its drone was never told."""
    faults = []
    for plan, standing in record.standing.items():
        for cause in standing.get("affected_by") or []:
            if cause in record.zones and plan not in by_zone.get(cause, ()):
                text = f"affected by {cause} at the end, which no outcome names"
                faults.append(Fault("standing_untold", record.zones[cause].put_s, plan, text))
    return faults
