"""What the judge asks of answers with the flight model: battery, times, stops, and that nothing better was left out."""

import datetime
import heapq
import math

from case import WITHOUT_PADS, Case
from energy import (
    FLOOR,
    FULL,
    M100,
    PHANTOM3,
    RESERVE,
    TAU_S,
    Drone,
    Heights,
    Stretch,
    fly,
)
from reading import is_finite
from world import NOW_S

# Drones are not at the same time where segments come nearer to each other than this.
CROSSING_M = 20.0

STOP_S = 60.0
TIME_MARGIN_S, TIME_GROWTH = 60.0, 0.05
BATTERY_SLACK = 1e-4
# What a plain way has to have left beyond what is asked for, before leaving it aside is a fault.
SPARE = 0.006


def instant(text: str) -> float:
    """Seconds since 1970 of an RFC 3339 time."""
    whole, _, rest = text.rstrip("Z").partition(".")
    seconds = datetime.datetime.fromisoformat(whole + "+00:00").timestamp()
    return seconds + (float("0." + rest) if rest else 0.0)


def drone_of(case: Case) -> Drone:
    report = case.report
    airframe = M100 if report.airframe == "m100" else PHANTOM3
    return Drone(airframe, report.payload_kg, report.airspeed_mps, case.world.wind)


def heights_of(case: Case) -> Heights:
    if "heights" not in case.world.kept:
        case.world.kept["heights"] = Heights(case.world.network)
    return case.world.kept["heights"]


def check(case: Case) -> None:
    """Everything that the flight model adds."""
    if case.is_inner:
        return
    drone, flight = drone_of(case), case.answer.get("flight")
    battery = case.report.battery
    energy, assumed = case.answer.get("energy"), case.answer.get("assumed", [])
    if energy in ("checked", "assumed") and case.outcome != "no_route":
        case.expect(battery is not None or case.report.plan, "energy", f"{energy}, and the battery is unknown")
        case.expect(flight or not case.nodes, "energy", f"{energy}, and no flight is told")
    case.expect((energy == "assumed") == bool(assumed), "energy", f"{energy}, with {assumed} assumed")
    if battery is not None and case.is_whole:
        case.expect(energy in ("checked", "assumed"), "energy", f"{energy}, with the battery reported")
        case.expect("battery" not in assumed, "energy", "the battery is assumed, and it was reported")
        named = case.report.airframe is not None or case.report.plan
        case.expect(named or "airframe" in assumed, "energy", "the airframe is not assumed, and none was named")
    if flight and case.is_whole:
        check_battery(case, drone, flight)
        check_times(case, drone)
        check_stops(case, drone, flight)
    if battery is not None:
        check_needless(case, drone, battery)
    elif case.report.failure == "operational" and case.report.plan is None:
        case.expect(
            energy not in ("checked", "assumed"), "operational", f"{case.outcome}, {energy}, without a battery"
        )


# --- battery ---


def stretch_of(case: Case, drone: Drone) -> Stretch | None:
    """The first stretch, by the judge's model. Its line is the leg, or straight."""
    reading = case.reading
    if case.stretch_m == 0.0:
        return Stretch(0.0, 0.0, 0.0)
    node = case.world.network.nodes[case.nodes[0]]
    limit = reading.segment.speed_limit_mps if reading.segment is not None else None
    if case.start is not None and case.start.kind == "straight":
        return drone.stretch(reading.report.place, node.at, case.stretch_m, None, 0.0)
    other = reading.to_at if node.id == reading.a else reading.from_at
    heights = heights_of(case)
    ends = (reading.b, reading.a) if node.id == reading.a else (reading.a, reading.b)
    down_m, up_m = (0.0 if reading.segment is None else heights.dip_m(reading.segment, end) for end in ends)
    climb = heights.climb_m(*ends) + down_m - up_m
    part = min(1.0, case.stretch_m / reading.length_m) if reading.length_m > 0.0 else 1.0
    flown = drone.stretch(other, node.at, case.stretch_m, limit, climb * part)
    if flown is None:
        return None
    flown.most_wh += drone.airframe.climb_wh(drone.payload_kg, up_m)
    if case.overrun_m == 0.0:
        return flown
    # The overrun is flown with the leg and back against it.
    there = drone.stretch(node.at, other, case.overrun_m, limit, abs(climb))
    if there is None:
        return flown
    least = min(flown.least_wh, flown.least_wh * (1 - case.overrun_m / case.stretch_m) + there.least_wh)
    return Stretch(flown.time_s + there.time_s, least, flown.most_wh + there.most_wh)


def check_battery(case: Case, drone: Drone, flight: dict) -> None:
    """What is left after each stretch is what was there before it, less what it takes."""
    capacity = drone.airframe.battery_wh
    begins = flight.get("battery_at_departure_fraction")
    ends = flight.get("battery_at_arrival_fraction")
    if not case.expect(is_finite(begins) and is_finite(ends), "battery", f"{begins!r} and {ends!r}"):
        return
    stretch = stretch_of(case, drone)
    report_battery = case.report.battery
    if stretch is None:
        case.expect(False, "battery", "its first stretch cannot be flown in this wind")
        return
    if report_battery is not None:
        # The wind meets the line of a drone that is a little aside at a little other angle.
        most = report_battery - 0.99 * stretch.least_wh / capacity + BATTERY_SLACK
        rise = drone.airframe.climb_wh(drone.payload_kg, 130.0) if case.reading.on_ground else 0.0
        least = report_battery - (1.01 * stretch.most_wh + rise) / capacity - BATTERY_SLACK
        case.expect(
            least <= begins <= most,
            "battery",
            f"begins with {begins}, of {report_battery} reported {least:.5f} to {most:.5f} are left",
        )
    legs = case.answer.get("legs") or []
    levels = [begins, ends]
    if case.segments:
        if case.expect(len(legs) == len(case.segments), "legs", f"{len(legs)} legs for {len(case.segments)} segments"):
            levels += check_legs(case, drone, flight, legs)
    elif not flight.get("stops"):
        case.expect(abs(begins - ends) <= 0.03, "battery", f"from {begins} to {ends} without a leg")
    if case.stretch_m == 0.0:
        # What it has where it is, it did not draw for the plan.
        levels = levels[1:] if case.segments else levels[2:]
    check_reserve(case, flight, levels)


def check_legs(case: Case, drone: Drone, flight: dict, legs: list[dict]) -> list[float]:
    """Each by itself, and each beside the one before it."""
    network, heights = case.world.network, heights_of(case)
    capacity = drone.airframe.battery_wh
    levels = []
    before = flight["battery_at_departure_fraction"]
    by_leg = {}
    for stop in flight.get("stops") or []:
        by_leg[stop.get("before_leg", 0)] = stop
    for index, (leg, segment_id) in enumerate(zip(legs, case.segments)):
        told = leg.get("flight") or {}
        if not case.expect(is_finite(told.get("battery_before_fraction")), "legs", f"leg {index} tells no battery"):
            return levels
        starts, left = told["battery_before_fraction"], told["battery_after_fraction"]
        segment = network.by_id[segment_id]
        case.expect(
            (str(leg["from"]), str(leg["to"])) == (case.nodes[index], case.nodes[index + 1]),
            "legs",
            f"leg {index} is {leg['from']} to {leg['to']}",
        )
        case.expect(
            abs(leg["length_m"] - segment.length_m) < 1e-3,
            "legs",
            f"leg {index} is {leg['length_m']} m long, {segment.length_m} in the network",
        )
        stop = by_leg.get(index)
        if stop is not None:
            low, high = stop["battery_before_fraction"], stop["battery_after_fraction"]
            case.expect(low <= before + BATTERY_SLACK, "battery", f"lands with {low} after {before}")
            case.expect(
                starts <= high + BATTERY_SLACK, "battery", f"leg {index} begins with {starts}, the stop left {high}"
            )
            if index > 0 or case.stretch_m > 0.0:
                levels.append(low)
        else:
            case.expect(
                abs(starts - before) <= BATTERY_SLACK or (index == 0 and starts <= before + BATTERY_SLACK),
                "battery",
                f"leg {index} begins with {starts} after {before}",
            )
        flown = fly(drone, network, heights, segment, case.nodes[index])
        if case.expect(flown is not None, "unflyable", f"leg {index}, {segment_id}, cannot be flown in this wind"):
            taken = (starts - left) * capacity
            slack = BATTERY_SLACK * capacity
            case.expect(
                flown.least_wh - slack <= taken <= flown.most_wh + slack,
                "battery",
                f"leg {index} takes {taken:.4f} Wh, by the model {flown.least_wh:.4f} to {flown.most_wh:.4f}",
            )
        levels.append(left)
        before = left
    return levels


def check_reserve(case: Case, flight: dict, levels: list[float]) -> None:
    """Never below the reserve, and on the reserve only to an alternate, flagged."""
    report = case.report
    lowest = min(levels, default=FULL)
    is_below = lowest < RESERVE - BATTERY_SLACK
    passes_floor = report.failure == "operational" and report.detail in WITHOUT_PADS
    if is_below:
        case.expect("reserve_used" in case.flags, "flag", f"{lowest:.4f} of the battery, and reserve_used is missing")
        case.expect(case.outcome == "diverted", "battery", f"{case.outcome} with {lowest:.4f} of the battery")
        case.expect(passes_floor or lowest >= FLOOR - BATTERY_SLACK, "battery", f"{lowest:.4f} is below the floor")
    elif "reserve_used" in case.flags:
        lowest = min([lowest, flight["battery_at_departure_fraction"]])
        case.expect(
            lowest < RESERVE + BATTERY_SLACK, "flag", f"reserve_used with {lowest:.4f} of the battery at the least"
        )


# --- times ---


def check_times(case: Case, drone: Drone) -> None:
    """Each leg takes its time, after the one before it, and meets no zone while that is active."""
    network = case.world.network
    at_s = NOW_S - 0.1
    if case.outcome != "hold" and case.overrun_m == 0.0:
        # With the wind at the back nothing is faster.
        at_s += case.stretch_m / (drone.airspeed_mps + case.world.wind.speed_mps)
    for index, leg in enumerate(case.answer.get("legs") or []):
        if index >= len(case.segments):
            return
        departs, arrives = instant(leg["departs_at"]), instant(leg["arrives_at"])
        case.expect(departs >= at_s - 0.05, "time", f"leg {index} departs {at_s - departs:.2f} s too early")
        segment = network.by_id[case.segments[index]]
        flown = fly(drone, network, heights_of(case), segment, case.nodes[index])
        if flown is not None:
            one, other = (network.nodes[node].at for node in case.nodes[index : index + 2])
            speed = drone.ground_speed(one, other) if one != other else drone.airspeed_mps + case.world.wind.speed_mps
            least_s = segment.length_m / speed
            case.expect(
                arrives - departs >= least_s - 0.01,
                "time",
                f"leg {index} takes {arrives - departs:.2f} s, at least {least_s:.2f} are needed",
            )
        for zone in case.world.zones:
            if zone.windows and case.reading.hits(zone, segment) == "yes":
                check_window(case, zone, index, departs, arrives)
        at_s = arrives


def check_window(case: Case, zone, index: int, departs: float, arrives: float) -> None:
    """The window is widened by a minute and a twentieth of the flying time until the drone is there."""
    if case.stretch_m == 0.0 and index == 0 and case.reading.inside is not None:
        return
    for since, until in zone.windows:
        begins = -math.inf if since is None else since
        ends = math.inf if until is None else until
        met = departs < ends + widened(departs) - 0.5 and arrives > begins - widened(arrives) + 0.5
        case.expect(not met, "closed", f"leg {index} meets the zone {zone.id} while it is active")


def widened(at_s: float) -> float:
    """The margin of a window for a drone that is there then."""
    return TIME_MARGIN_S + TIME_GROWTH * max(0.0, at_s - NOW_S)


# --- stops ---


def check_stops(case: Case, drone: Drone, flight: dict) -> None:
    network, reading = case.world.network, case.reading
    for stop in flight.get("stops") or []:
        node = str(stop["node"])
        if not case.expect(
            node in network.nodes and node in case.nodes, "stops", f"a stop at {node}, which is not on its way"
        ):
            continue
        stands = reading.where == "node" and node == reading.a and case.report.airborne is not True
        case.expect(stop["pad"] < max(1, network.nodes[node].pads), "pads", f"pad {stop['pad']} of {node}")
        lands, leaves = instant(stop["lands_at"]), instant(stop["takes_off_at"])
        if not stands:
            open_then = reading.pads_at(node, lands + 1.0, leaves - 1.0) > 0
            case.expect(open_then, "pads", f"a stop at {node}, whose pads are none or closed")
        case.expect(leaves >= lands - 1e-6, "stops", f"takes off at {stop['takes_off_at']} before it lands")
        charge_s = max(0.0, leaves - lands)
        before, after = stop["battery_before_fraction"], stop["battery_after_fraction"]
        best = max(before, min(FULL, 1 - (1 - before) * math.exp(-charge_s / TAU_S)))
        case.expect(
            after <= best + BATTERY_SLACK, "stops", f"from {before} to {after} in {charge_s:.0f} s, at most {best:.4f}"
        )
        for plan in case.world.plans:
            if case.report.plan is not None and plan["id"] == case.report.plan["id"]:
                continue
            for node_taken, pad, since, until in plan["held"]:
                taken = node_taken == node and pad == stop["pad"] and lands < until - 0.01 and leaves > since + 0.01
                case.expect(not taken, "pads", f"pad {pad} of {node} is taken by the plan {plan['id']}")


# --- nothing better ---


def plain_ways(case: Case, drone: Drone) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """By energy: what every node is reached with at most drawn; by length: each one's least, with what that draws."""
    reading, network, heights = case.reading, case.world.network, heights_of(case)
    by_energy: list[tuple[float, str]] = []
    by_length: list[tuple[float, float, str]] = []
    for start in reading.starts:
        if start.allowed != "yes" or reading.near_ahead():
            continue
        drawn = first_draw(case, drone, start)
        if drawn is not None:
            heapq.heappush(by_energy, (drawn, start.node))
            heapq.heappush(by_length, (start.length_m, drawn, start.node))
    least_wh: dict[str, float] = {}
    shortest: dict[str, tuple[float, float]] = {}
    # A drone in the air cannot wait until others have flown by.
    taken_by_others = flown_by_others(case)

    def onward(node: str, done):
        for segment in network.beside[node]:
            other = segment.other(node)
            is_open = reading.blocked.get(segment.id, "no") == "no" and reading.closed_nodes.get(other, "no") == "no"
            if other in done or not is_open or segment.id in taken_by_others:
                continue
            flown = fly(drone, network, heights, segment, node)
            if flown is not None:
                yield other, segment.length_m, flown.most_wh

    while by_energy:
        drawn, node = heapq.heappop(by_energy)
        if node in least_wh:
            continue
        least_wh[node] = drawn
        for other, _, taken in onward(node, least_wh):
            heapq.heappush(by_energy, (drawn + taken, other))
    while by_length:
        length, drawn, node = heapq.heappop(by_length)
        if node in shortest:
            continue
        shortest[node] = (length, drawn)
        for other, more, taken in onward(node, shortest):
            heapq.heappush(by_length, (length + more, drawn + taken, other))
    return least_wh, shortest


def first_draw(case: Case, drone: Drone, start) -> float | None:
    """What the way to a start draws at most, in watt-hours; with a take-off, of a drone that may stand."""
    reading, network, heights = case.reading, case.world.network, heights_of(case)
    rise = 0.0
    if reading.where == "node" and case.report.airborne is not True:
        rise = drone.airframe.climb_wh(drone.payload_kg, max(heights.rise[reading.a], 30.0))
    if start.length_m == 0.0:
        return rise
    node = network.nodes[start.node]
    if start.kind == "straight":
        flown = drone.stretch(reading.report.place, node.at, start.length_m, None, 0.0)
        return None if flown is None else flown.most_wh + drone.airframe.climb_wh(drone.payload_kg, 120.0)
    back = start.node == reading.a
    ends = (reading.b, reading.a) if back else (reading.a, reading.b)
    limit = reading.segment.speed_limit_mps if reading.segment is not None else None
    climb = heights.climb_m(*ends)
    flown = drone.stretch(network.nodes[ends[0]].at, node.at, start.length_m, limit, climb)
    return None if flown is None else flown.most_wh + rise


def check_needless(case: Case, drone: Drone, battery: float) -> None:
    """Where a plain way can be flown the drone is told nothing else, and nothing that is proved is worse than it."""
    report, reading, capacity = case.report, case.reading, drone.airframe.battery_wh
    if reading.is_doubtful or not drone.can_fly:
        return
    least_wh, shortest = plain_ways(case, drone)
    least_wh = {node: drawn for node, drawn in least_wh.items() if reading.closed_nodes.get(node, "no") == "no"}
    free = [node for node in least_wh if reading.pads_at(node) > 0 and not is_taken(case, node)]
    left = {node: battery - drawn / capacity for node, drawn in least_wh.items()}
    goes_on = left.get(report.destination, 0.0) >= RESERVE + SPARE and report.failure != "operational"
    if case.outcome in ("no_route", "diverted"):
        case.expect(
            not goes_on,
            "needless",
            f"{case.outcome}, though {report.destination} can be reached with {left.get(report.destination)}",
        )
    if case.outcome == "no_route":
        floor = FLOOR + SPARE
        nodes = free
        if report.failure == "operational" and report.detail in WITHOUT_PADS:
            floor, nodes = SPARE, list(least_wh)
        reached = [node for node in nodes if left[node] >= floor]
        case.expect(
            not reached,
            "needless",
            f"no_route, though {reached[:3]} can be reached with {[round(left[node], 3) for node in reached[:3]]}",
        )
    if (
        case.outcome == "diverted"
        and case.is_whole
        and not (report.failure == "operational" and report.detail in WITHOUT_PADS)
    ):
        ends = (case.answer.get("flight") or {}).get("battery_at_arrival_fraction")
        best = max((left[node] for node in free if node != report.destination), default=0.0)
        if any(plan["sent"] - plan["seen"] for plan in case.world.plans):
            # A version that was not told whole may have the pad.
            best = 0.0
        if is_finite(ends) and best >= FLOOR + SPARE:
            case.expect(
                ends >= best - SPARE, "diverted", f"arrives with {ends}, another pad can be reached with {best:.4f}"
            )
    if (
        case.outcome == "diverted"
        and case.is_whole
        and report.failure == "operational"
        and report.detail in WITHOUT_PADS
    ):
        ends = (case.answer.get("flight") or {}).get("battery_at_arrival_fraction")
        draws = [drawn for drawn in least_wh.values()]
        if is_finite(ends) and draws:
            drawn = (battery - ends) * capacity
            nearest = min(draws)
            case.expect(
                drawn <= 1.2 * nearest + 0.3,
                "diverted",
                f"draws {drawn:.3f} Wh, another node is reached with {nearest:.3f}",
            )
    check_best(case, battery, shortest, least_wh, capacity)


def flown_by_others(case: Case) -> set[str]:
    """Where others may be: on their segments, at their nodes, and on what comes near a segment of theirs in the air.

    Beside it what the answer names as taken, each by a plan that flies it or has a version that was not told whole.
    """
    network = case.world.network
    own = case.report.plan["id"] if case.report.plan else None
    plans = {plan["id"]: plan for plan in case.world.plans if plan["id"] != own}
    theirs = {segment for plan in plans.values() for segment in plan["segments"]}
    taken = set()
    for segment in network.segments:
        if segment.id in theirs:
            beside = [other.id for node in segment.ends for other in network.beside[node]]
            taken |= {segment.id, *beside, *network.near(segment, CROSSING_M)}
    for cause in case.answer.get("causes") or []:
        plan = plans.get(cause.get("plan_id")) if cause["code"] == "traffic" else None
        if plan and (str(cause["segment"]) in plan["segments"] or plan["sent"] - plan["seen"]):
            taken.add(str(cause["segment"]))
    return taken


def is_taken(case: Case, node: str) -> bool:
    """Whether some plan stays or ends there, whenever."""
    return any(
        node in plan.get("ends", ()) or any(node == taken for taken, *_ in plan["stays"]) for plan in case.world.plans
    )


def check_best(case: Case, battery: float, shortest: dict, least_wh: dict, capacity: float) -> None:
    """A way that is proved to be the least is not worse than a plain one. Waiting competes with detours."""
    flight = case.answer.get("flight") or {}
    is_exact = case.answer.get("strategy_used") == "exact" and flight.get("proved")
    if not is_exact or case.outcome not in ("rerouted", "unaffected", "hold") or not case.is_whole:
        return
    destination = case.report.destination
    if flight.get("objective") == "distance" and destination in shortest:
        length, drawn = shortest[destination]
        if battery - drawn / capacity >= RESERVE + SPARE:
            case.expect(
                case.total_m <= length + 0.02 + case.slack_m, "shortest", f"proved, {case.total_m} m; a plain way is {length} m long"
            )
    if flight.get("objective") == "energy" and destination in least_wh:
        drawn = least_wh[destination]
        if battery - drawn / capacity >= RESERVE + SPARE:
            told = flight.get("energy_wh", 0.0)
            case.expect(told <= drawn + SPARE * capacity, "shortest", f"proved, {told} Wh; a plain way takes {drawn}")
