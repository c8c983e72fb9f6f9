"""Whether drones that fly what they were told keep apart: on segments, pads, nodes, crossings."""

import dataclasses
import math

from record import Move, Record, Version

HEADWAY_S = 30.0
NODE_HEADWAY_S = 5.0
HORIZONTAL_M, VERTICAL_M = 20.0, 10.0
# Nearer than this to a node that both come to, the time between them counts.
SHARED_NODE_M = 50.0
# Two that were planned to be exactly so far apart are.
DOUBT_S, DOUBT_M = 0.01, 0.05
# Positions are looked at so often; drones that are nearer than this then may come too near before
# the next look.
LOOK_S, NEAR_M = 1.0, 60.0


@dataclasses.dataclass(frozen=True, order=True)
class Fault:
    """Two that come too near each other."""

    rule: str
    at_s: float
    plans: tuple[str, str]
    text: str


def judge(record: Record, from_s: float = -math.inf, until_s: float = math.inf) -> list[Fault]:
    """All pairs that come too near each other within a stretch of time, by each rule and place."""
    flown = record.flown()
    moves = [move for version in flown for move in version.flown() if move.enters_s < until_s and move.until_s > from_s]
    faults = on_segments(moves) + on_pads(flown) + at_nodes(moves) + at_crossings(moves, from_s, until_s)
    faults = [said(record, fault) for fault in faults if from_s <= fault.at_s <= until_s]
    return sorted(faults)


def said(record: Record, fault: Fault) -> Fault:
    """Of a rule of its own where one of the two flies a version that says that it comes too near others, with an alarm."""
    alarmed = {alarm.get("plan_id") for alarm in record.alarms if alarm["kind"] == "unseparated"}
    for version in record.flown():
        if version.plan in alarmed.intersection(fault.plans) and "unseparated" in version.flags:
            if version.from_s <= fault.at_s <= version.until_s:
                return dataclasses.replace(fault, rule="flagged")
    return fault


def on_segments(moves: list[Move]) -> list[Fault]:
    by_segment: dict[str, list[Move]] = {}
    for move in moves:
        if move.segment is not None:
            by_segment.setdefault(move.segment, []).append(move)
    faults = []
    for segment, on_it in by_segment.items():
        on_it.sort(key=lambda move: move.enters_s)
        longest_s = max(move.until_s - move.enters_s for move in on_it)
        for index, one in enumerate(on_it):
            for other in on_it[index + 1 :]:
                apart_s = other.enters_s - one.enters_s
                if apart_s >= max(HEADWAY_S, longest_s):
                    break
                if one.plan == other.plan:
                    continue
                if one.ends == other.ends and apart_s < HEADWAY_S - DOUBT_S:
                    text = f"segment {segment}, {one.ends[0]} to {one.ends[1]}: {apart_s:.2f} s apart"
                    faults.append(Fault("headway", other.enters_s, pair(one, other), text))
                elif one.ends != other.ends and other.enters_s < one.until_s - DOUBT_S:
                    text = f"segment {segment}: both on it for {one.until_s - other.enters_s:.2f} s"
                    faults.append(Fault("head_on", other.enters_s, pair(one, other), text))
    return faults


def pair(one, other) -> tuple[str, str]:
    return tuple(sorted((one.plan, other.plan)))


def on_pads(flown: list[Version]) -> list[Fault]:
    by_pad: dict[tuple[str, int], list] = {}
    for version in flown:
        for stay in version.stays:
            lands_s, leaves_s = max(stay.lands_s, version.from_s), min(stay.leaves_s, version.until_s)
            if lands_s < leaves_s:
                by_pad.setdefault((stay.node, stay.pad), []).append((lands_s, leaves_s, stay))
    faults = []
    for (node, pad), stays in by_pad.items():
        stays.sort(key=lambda entry: entry[:2])
        for index, (_, leaves_s, one) in enumerate(stays):
            for lands_s, _, other in stays[index + 1 :]:
                if lands_s >= leaves_s - DOUBT_S:
                    break
                if one.plan != other.plan:
                    text = f"pad {pad} of node {node}: both for {leaves_s - lands_s:.2f} s"
                    faults.append(Fault("pad", lands_s, pair(one, other), text))
    return faults


def at_nodes(moves: list[Move]) -> list[Fault]:
    """Every beginning and end of a leg is at a node; who flies on is there once."""
    at_node: dict[str, set[tuple[float, str]]] = {}
    for move in moves:
        for node, at_s in ((move.ends[0], move.enters_s), (move.ends[1], move.leaves_s)):
            if node and move.since_s <= at_s <= move.until_s:
                at_node.setdefault(node, set()).add((round(at_s, 3), move.plan))
    faults = {}
    for node, passages in at_node.items():
        ordered = sorted(passages)
        for index, (first_s, one) in enumerate(ordered):
            for second_s, other in ordered[index + 1 :]:
                if second_s - first_s >= NODE_HEADWAY_S - DOUBT_S:
                    break
                if one != other:
                    plans = tuple(sorted((one, other)))
                    text = f"node {node}: {second_s - first_s:.2f} s apart"
                    faults.setdefault((node, plans), Fault("node", second_s, plans, text))
    return list(faults.values())


def at_crossings(moves: list[Move], from_s: float, until_s: float) -> list[Fault]:
    """Looks at where all are, second by second, and closely at those who are near each other."""
    ordered = sorted(moves, key=lambda move: move.enters_s)
    if not ordered:
        return []
    faults: dict = {}
    airborne: list[Move] = []
    next_one = 0
    last_s = min(until_s, max(move.until_s for move in ordered))
    at_s = max(from_s, ordered[0].enters_s)
    while at_s < last_s:
        while next_one < len(ordered) and ordered[next_one].enters_s < at_s + LOOK_S:
            airborne.append(ordered[next_one])
            next_one += 1
        airborne = [move for move in airborne if move.until_s > at_s]
        if not airborne:
            if next_one == len(ordered):
                break
            at_s = ordered[next_one].enters_s
            continue
        for one, other in near_ones(airborne, at_s):
            fault = too_near(one, other, at_s, at_s + LOOK_S)
            if fault is not None:
                faults.setdefault(fault.plans, fault)
        at_s += LOOK_S
    return list(faults.values())


def near_ones(airborne: list[Move], at_s: float):
    """Pairs in the same square or in neighbouring ones."""
    squares: dict[tuple[int, int], list[Move]] = {}
    for move in airborne:
        x, y, _ = move.at(at_s)
        squares.setdefault((int(x // NEAR_M), int(y // NEAR_M)), []).append(move)
    for (column, row), here in squares.items():
        for index, one in enumerate(here):
            for other in here[index + 1 :]:
                yield one, other
        for beside in ((1, -1), (1, 0), (1, 1), (0, 1)):
            for other in squares.get((column + beside[0], row + beside[1]), ()):
                for one in here:
                    yield one, other


def too_near(one: Move, other: Move, from_s: float, until_s: float) -> Fault | None:
    """Whether they are too near while both fly these lines, where no segment or node is shared."""
    if one.plan == other.plan or (one.segment is not None and one.segment == other.segment):
        return None
    from_s = max(from_s, one.enters_s, one.since_s, other.enters_s, other.since_s)
    until_s = min(until_s, one.until_s, other.until_s)
    if from_s >= until_s:
        return None
    steps = 8
    for step in range(steps + 1):
        at_s = from_s + (until_s - from_s) * step / steps
        (x, y, height), (other_x, other_y, other_height) = one.at(at_s), other.at(at_s)
        apart_m = math.hypot(x - other_x, y - other_y)
        known = height is not None and other_height is not None
        above_m = abs(height - other_height) if known else 0.0
        is_clear = apart_m >= HORIZONTAL_M - DOUBT_M or above_m >= VERTICAL_M - DOUBT_M
        if is_clear or is_at_shared_node(one, other, (x, y)):
            continue
        text = f"segments {one.segment} and {other.segment}: {apart_m:.1f} m apart, {above_m:.1f} m above each other"
        return Fault("crossing", at_s, pair(one, other), text)
    return None


def is_at_shared_node(one: Move, other: Move, place: tuple[float, float]) -> bool:
    for end, corner in zip(one.ends, (one.line[0], one.line[-1])):
        if end and end in other.ends and math.hypot(corner[0] - place[0], corner[1] - place[1]) <= SHARED_NODE_M:
            return True
    return False
