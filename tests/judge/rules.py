"""The judge: what is wrong with one answer to one report in one world.

It reads the answer and the world, and nothing of the engine. `judge` gives the faults, and what the answer was an
instance of, by which runs are held to cover everything.
"""

import dataclasses
import re

import flown
from case import OUTCOMES, Case, Fault, Verdict
from flags import check_flags, check_flags_known
from outcomes import check_ground, check_outcome
from reading import is_finite
from reports import Report
from stretch import check_held, check_stretch
from world import World

# What `if_airborne` says again, or does not say.
OF_ONE_OUTCOME = ("first_stretch", "first_stretch_m", "recomposed_length_m", "remaining_length_m", "remaining_time_s")
OF_ONE_OUTCOME += ("flags", "unsafe_way", "legs", "flight", "if_airborne")
REVISION = re.compile(r"\d+-\d+")


def judge(world: World, report: Report, answer: dict) -> tuple[list[Fault], set[str]]:
    """All that is wrong with an answer, and what it is an instance of."""
    verdict = Verdict()
    if not verdict.expect("problem" not in answer, "answered", f"it is refused: {str(answer.get('problem'))[:300]}"):
        return verdict.faults, set()
    case = Case(world, report, answer)
    look_at(case)
    faults = case.verdict.faults
    check_stamp(case)
    covered = instances(case)
    airborne = answer.get("if_airborne")
    if airborne is not None:
        in_air = dataclasses.replace(report, airborne=True)
        inner = Case(world, in_air, {**answer, **dict.fromkeys(OF_ONE_OUTCOME), **airborne})
        inner.is_inner = True
        look_at(inner)
        faults += [Fault(fault.rule, f"if airborne: {fault.text}") for fault in inner.verdict.faults]
        covered |= {f"flag {flag}" for flag in inner.flags}
    return faults, covered


def look_at(case: Case) -> None:
    """One outcome with its path."""
    told = case.expect(case.outcome in OUTCOMES, "outcome", f"{case.outcome!r} is none")
    if not told:
        return
    check_flags_known(case)
    if case.outcome == "no_route":
        check_without_path(case)
    elif case.nodes:
        check_path(case)
        if case.is_whole:
            if case.holds_on_ground:
                check_held(case)
            else:
                check_stretch(case)
            check_lengths(case)
    else:
        case.expect(case.outcome == "hold", "path", f"{case.outcome} has none")
    check_ground(case)
    if not case.holds_on_ground:
        check_outcome(case)
    if case.is_whole and not case.holds_on_ground:
        check_flags(case)
    if case.world.flown:
        flown.check(case)
    elif case.is_whole and case.outcome != "hold" and not case.is_inner:
        check_nominal_time(case)


def check_nominal_time(case: Case) -> None:
    """By distance: at the airspeed, or as slowly as a segment says."""
    told = case.answer.get("remaining_time_s")
    if not case.expect(is_finite(told), "time", f"remaining_time_s is {told!r}"):
        return
    speed, network = case.reading.airspeed_mps, case.world.network
    limits = [min(speed, network.by_id[name].speed_limit_mps or speed) for name in case.segments]
    flown_s = sum(network.by_id[name].length_m / limit for name, limit in zip(case.segments, limits))
    own = case.reading.segment
    least_s = flown_s + case.stretch_m / speed
    most_s = flown_s + case.stretch_m / min(speed, (own and own.speed_limit_mps) or speed)
    case.expect(
        least_s - 0.01 <= told <= most_s + 0.01,
        "time",
        f"{told} s, by lengths and speeds {least_s:.3f} to {most_s:.3f}",
    )


def instances(case: Case) -> set[str]:
    """What an answer is an instance of."""
    covered = {f"outcome {case.outcome}", f"place {case.report.kind}", f"type {case.report.failure}"}
    covered |= {f"flag {flag}" for flag in case.flags}
    if case.stretch:
        covered.add(f"start {case.stretch.get('kind')}")
    if case.world.flown:
        covered.add("flown")
    if case.reading.is_doubtful:
        covered.add("in doubt")
    return covered


# --- shape ---


def check_stamp(case: Case) -> None:
    answer = case.answer
    case.expect(REVISION.fullmatch(str(answer.get("revision"))), "stamp", f"the revision {answer.get('revision')!r}")
    network = answer.get("network") or {}
    sha = str(network.get("sha256"))
    case.expect(network.get("name") and re.fullmatch("[0-9a-f]{64}", sha), "stamp", f"the network {network!r}")
    case.expect(isinstance(answer.get("valid_until"), str), "stamp", "valid_until is not told")
    ids = case.nodes + [case.stretch.get("enters"), case.stretch.get("from"), case.stretch.get("to")]
    numbers = [node for node in ids if node is not None and not isinstance(node, str)]
    case.expect(not numbers, "ids", f"{numbers[:3]} are no strings")
    case.expect(isinstance(answer.get("warnings"), list), "shape", "warnings are no list")


def check_without_path(case: Case) -> None:
    answer = case.answer
    case.expect(not case.nodes and not case.segments, "no_route", f"it has the path {case.nodes}")
    case.expect(not case.stretch, "no_route", f"it has a first stretch: {case.stretch}")
    case.expect(answer.get("remaining_length_m") is None, "no_route", "it has a length")
    names = case.is_inner or answer.get("severed_by") or answer.get("causes")
    case.expect(names, "no_route", "it names no cause")
    case.expect(not case.flags, "flag", f"{case.flags} without a path")
    if "first_stretch" in answer or "flags" in answer:
        case.expect(answer.get("unsafe_way"), "unsafe_way", "no_route does not tell the least bad way")


# --- the path ---


def check_path(case: Case) -> None:
    """Its segments exist, join, and are open; nothing closed is entered."""
    network, reading = case.world.network, case.reading
    nodes = case.nodes = [str(node) for node in case.nodes]
    if not case.expect(
        len(case.segments) == len(nodes) - 1, "path", f"{len(nodes)} nodes, {len(case.segments)} segments"
    ):
        return
    unknown = [node for node in nodes if node not in network.nodes]
    unknown += [name for name in case.segments if name not in network.by_id]
    if not case.expect(not unknown, "path", f"{unknown} are not in the network"):
        return
    case.is_whole = True
    for segment_id, start, end in zip(case.segments, nodes, nodes[1:]):
        segment = network.by_id[segment_id]
        joined = set(segment.ends) == {start, end}
        case.is_whole &= case.expect(joined, "path", f"{segment_id} does not join {start} and {end}")
        blocked = closed_for(case, reading.blocked, segment_id)
        case.expect(blocked != "yes", "closed", f"the segment {segment_id} is closed")
    for node in nodes[1:]:
        closed = closed_for(case, reading.closed_nodes, node)
        case.expect(closed != "yes", "closed", f"the closed node {node} is entered")


def closed_for(case: Case, table: dict[str, str], name: str) -> str:
    """What a hold waits for is open once it goes on."""
    verdict = table.get(name, "no")
    if verdict == "yes" and case.outcome == "hold" and not lasts(case, name):
        return "maybe"
    return verdict


def lasts(case: Case, name: str) -> bool:
    """Whether something without an end closes it."""
    network, reading = case.world.network, case.reading
    for zone in reading.zones:
        if zone.windows and all(until is not None for _, until in zone.windows):
            continue
        if name in network.by_id and reading.hits(zone, network.by_id[name]) == "yes":
            return True
        if name in network.nodes and reading.covers(zone, network.nodes[name]) == "yes":
            return True
    for closure in case.world.closures:
        if not closure.windows and not closure.is_doubtful and name in closure.segments | closure.nodes:
            return True
    return bool(reading.closes_leg and reading.segment is not None and reading.segment.id == name)


# --- lengths ---


def check_lengths(case: Case) -> None:
    network, answer = case.world.network, case.answer
    sum_m = case.stretch_m + sum(network.by_id[name].length_m for name in case.segments)
    slack = 1e-5 * (len(case.segments) + 1) + 1e-9 * sum_m
    total = answer.get("remaining_length_m")
    if case.outcome == "hold" and not case.segments and total is None:
        return
    if not case.expect(is_finite(total), "length", f"remaining_length_m is {total!r}"):
        return
    case.expect(abs(total - sum_m) <= slack, "length", f"{total} m told, {sum_m} m of stretch and segments")
    if answer.get("strategy_used") == "exact" and answer.get("recomposed_length_m") is not None:
        rest = total - case.stretch_m
        case.expect(
            abs(answer["recomposed_length_m"] - rest) <= slack,
            "length",
            f"{answer['recomposed_length_m']} m recomposed, not {rest}",
        )
