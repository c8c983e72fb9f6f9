"""What the judge asks of outcomes: they say what the path does, and nothing better was left aside."""

import flown
from case import WITHOUT_PADS, Case
from world import NOW_S


def check_ground(case: Case) -> None:
    """On the ground inside an active zone a drone stays; it is not sent up."""
    reading = case.reading
    if reading.where != "node" or reading.report.airborne is True:
        return
    if reading.inside is None or reading.is_doubtful or not reading.active_now():
        return
    if reading.on_ground:
        case.expect(case.outcome == "hold", "ground", f"on its pad inside a zone it is told {case.outcome}")
    elif case.outcome == "hold":
        case.expect(
            case.answer.get("if_airborne"), "ground", "it is unknown whether it flies, and if_airborne is not told"
        )
    if case.outcome == "hold" and case.nodes:
        case.expect(
            case.nodes[0] == reading.a, "ground", f"it holds at {reading.a} and its way begins at {case.nodes[0]}"
        )
    zones = [
        zone
        for zone in reading.zones
        if zone.active_at(NOW_S) and reading.covers(zone, case.world.network.nodes[reading.a]) == "yes"
    ]
    hold = (case.answer.get("flight") or {}).get("hold")
    if case.outcome == "hold" and hold and zones:
        ends = [zone.ends_s(NOW_S) for zone in zones]
        if all(end is not None for end in ends):
            until = flown.instant(hold["until"])
            case.expect(until >= max(ends) - 1.0, "ground", f"it leaves at {hold['until']}, before its zone has ended")


def check_outcome(case: Case) -> None:
    """The outcome says what the path does, and nothing better was left aside."""
    reading, report = case.reading, case.report
    is_told = bool(case.start and case.start.node == reading.a and case.stretch)
    clean = reading.clean_lengths(case.overrun_m if is_told else None)
    if case.outcome in ("rerouted", "unaffected") and case.nodes:
        case.expect(
            case.nodes[-1] == report.destination,
            "outcome",
            f"{case.outcome} leads to {case.nodes[-1]}, not to {report.destination}",
        )
    if case.outcome == "unaffected":
        check_unaffected(case)
    if not case.world.flown:
        check_needless(case, clean)
        check_shortest(case, clean)
    if case.outcome == "diverted" and case.nodes:
        check_diverted(case, clean)
    if report.failure == "operational" and case.outcome in ("rerouted", "unaffected") and case.is_whole:
        check_flies_on(case, clean)


def check_flies_on(case: Case, clean: dict[str, float]) -> None:
    """Without a figure that shows that it can, a drone goes on only to where it would have been diverted to."""
    reading, report = case.reading, case.report
    needs_pad = report.detail not in WITHOUT_PADS
    if case.world.flown and (
        (needs_pad and report.battery is not None) or case.world.wind.speed_mps > 0.0 or report.plan
    ):
        return
    if needs_pad:
        case.expect(
            reading.pads_at(report.destination) > 0,
            "operational",
            f"{case.outcome}, and no figure shows that it can be flown",
        )
    usable = [
        length for node, length in clean.items() if is_open(case, node) and (not needs_pad or reading.pads_at(node) > 0)
    ]
    limit = (1.0 if needs_pad else 1.2) * min(usable, default=case.total_m) + 0.1
    case.expect(
        case.total_m <= limit,
        "operational",
        f"{case.outcome} over {case.total_m} m without a figure that shows it, and one can land after {limit:.1f}",
    )


def is_open(case: Case, node: str) -> bool:
    """Whether one may land there: a closed node may be where the drone stands."""
    return case.reading.closed_nodes.get(node, "no") == "no"


def check_unaffected(case: Case) -> None:
    reading, old = case.reading, case.report.old_path
    case.expect(case.report.failure != "operational" or case.world.flown, "unaffected", "an operational failure")
    if old is not None and case.nodes:
        is_old = case.nodes in (old, old[1:])
        case.expect(is_old, "unaffected", f"{case.nodes} is not what is left of {old}")
    if reading.closes_leg and reading.report.cause is None:
        case.expect(False, "unaffected", "the leg has failed, and the cause has no place behind the drone")


def check_needless(case: Case, clean: dict[str, float]) -> None:
    """Who can go on cleanly is not told otherwise. By distance."""
    reading, report = case.reading, case.report
    reaches = report.destination in clean and clean[report.destination] >= 0.0
    pads = [node for node in clean if reading.pads_at(node) > 0 and is_open(case, node)]
    if case.outcome == "no_route":
        if report.failure == "operational":
            usable = [node for node in clean if is_open(case, node)] if report.detail in WITHOUT_PADS else pads
            case.expect(not usable, "needless", f"no_route, though {usable[:3]} can be reached cleanly")
        else:
            case.expect(
                not reaches,
                "needless",
                f"no_route, though {report.destination} is {clean.get(report.destination)} m away",
            )
            case.expect(reaches or not pads, "needless", f"no_route, though pads at {pads[:3]} can be reached cleanly")
    if case.outcome in ("diverted", "hold") and report.failure != "operational":
        case.expect(
            not reaches,
            "needless",
            f"{case.outcome}, though {report.destination} is {clean.get(report.destination)} m away",
        )


def check_shortest(case: Case, clean: dict[str, float]) -> None:
    """What calls itself exact is no longer than Dijkstra over the allowed starts."""
    used = case.answer.get("strategy_used")
    is_global = used in ("dijkstra", "astar", "bellman_ford") and case.answer.get("stage") == "global"
    is_global = is_global and case.report.body.get("scope") != "local" and case.outcome == "rerouted"
    if case.outcome not in ("rerouted", "unaffected") or not (used == "exact" or is_global):
        return
    if case.reading.where == "node" and case.reading.inside is not None:
        # The shorter way out goes before the shorter way on.
        return
    best = clean.get(case.report.destination)
    if best is not None and case.is_whole:
        case.expect(
            case.total_m <= best + case.slack_m + 1e-6 * best,
            "shortest",
            f"{used} is {case.total_m} m long, Dijkstra's is {best}",
        )


def check_diverted(case: Case, clean: dict[str, float]) -> None:
    """It leads to a node with a pad, the nearest by length where energy is not reckoned with."""
    reading, report, node = case.reading, case.report, case.nodes[-1]
    needs_pad = not (report.failure == "operational" and report.detail in WITHOUT_PADS)
    pads = reading.pads_at(node) if node in case.world.network.nodes else 0
    if needs_pad:
        case.expect(pads > 0, "diverted", f"{node} has no pad that is open")
    if report.failure != "operational" and not case.world.flown:
        # A drone on its reserve may be diverted to where it was going.
        case.expect(node != report.destination, "diverted", "it leads to the destination")
    if case.world.flown or not case.is_whole:
        return
    clean = {other: length for other, length in clean.items() if is_open(case, other)}
    with_pads = [length for other, length in clean.items() if reading.pads_at(other) > 0]
    total = case.total_m
    if needs_pad:
        best = min(with_pads, default=total)
        case.expect(total <= best + case.slack_m, "diverted", f"{node} is {total} m away, a pad is open at {best}")
        return
    nearest = min(clean.values(), default=total)
    limit = 1.2 * nearest if pads > 0 else nearest
    case.expect(total <= limit + case.slack_m, "diverted", f"{node} is {total} m away, another node {nearest}")
    if pads == 0 and with_pads:
        case.expect(
            min(with_pads) > 1.2 * total - case.slack_m,
            "diverted",
            f"{node} has no pad, one {min(with_pads)} m away has",
        )
