"""Shows that the judge finds faults: right answers pass, and the same answers bent do not.

The answers are worked out here, on a network of eight roofs, without an edge. `planted` then asks edges whose engine
makes such faults itself, where the binary has them.
"""

import copy

from case import FLAGS
from energy import PHANTOM3, Drone, Heights, fly
from geometry import Circle, Plane
from reports import Report
from rules import judge
from world import NOW_S, Closure, Network, Node, Segment, Wind, World, Zone, text_of

#   e ------- f ------- g ------- h
#   |         |         |         |
#   a ------- b ------- c ------- d
PLACES = {
    "a": (0.0, 0.0),
    "b": (1000.0, 0.0),
    "c": (2000.0, 0.0),
    "d": (3000.0, 0.0),
    "e": (0.0, 400.0),
    "f": (1000.0, 500.0),
    "g": (2000.0, 600.0),
    "h": (3000.0, 700.0),
}
PADS = {"a": 2, "d": 2, "f": 2}
PAIRS = ["ab", "bc", "cd", "ef", "fg", "gh", "ae", "bf", "cg", "dh"]
BATTERY = 0.9


def network() -> Network:
    nodes = [Node(name, at, PADS.get(name, 0), None, "agl") for name, at in PLACES.items()]
    segments = []
    for one, other in PAIRS:
        length = ((PLACES[one][0] - PLACES[other][0]) ** 2 + (PLACES[one][1] - PLACES[other][1]) ** 2) ** 0.5
        segments.append(Segment(f"{one}-{other}", (one, other), length, None, None, "agl", None))
    return Network(Plane(None), nodes, segments, False)


def round_zone(name: str, x: float, y: float, radius: float, windows=()) -> Zone:
    windows = [(NOW_S + since, NOW_S + until) for since, until in windows]
    return Zone(name, Circle((x, y), radius), 10.0, None, "agl", None, "agl", windows, {})


def world(*zones: Zone, flown: bool = False, plans=(), closures=()) -> World:
    return World(network(), list(zones), list(closures), Wind(), flown, list(plans))


def report(failure: str, leg: str, place, **facts) -> Report:
    stands = facts.pop("stands_at", None)
    facts = {"airborne": True} | facts
    destination = facts.pop("destination", "d")
    return Report({}, "by hand", (leg[0], leg[1]), destination, failure, place=place, stands_at=stands, **facts)


def answer(outcome: str, nodes: str, stretch: dict | None, flags=(), **more) -> dict:
    """A whole answer; lengths are reckoned from the network."""
    roofs = network()
    segments = [roofs.by_ends[pair] for pair in zip(nodes, nodes[1:])]
    sum_m = sum(segment.length_m for segment in segments)
    first_m = stretch["length_m"] if stretch else 0.0
    told = {
        "outcome": outcome,
        "path": {"nodes": list(nodes), "segments": [segment.id for segment in segments]},
        "first_stretch": stretch,
        "first_stretch_m": first_m,
        "recomposed_length_m": sum_m if nodes else None,
        "remaining_length_m": first_m + sum_m if nodes else None,
        "remaining_time_s": (first_m + sum_m) / 16 if nodes else None,
        "strategy_used": "exact",
        "stage": "global",
        "flags": list(flags),
        "warnings": [],
        "severed_by": [] if nodes else [{"cause": "report"}],
        "energy": "unchecked",
        "revision": "1-1",
        "network": {"name": "roofs", "sha256": "0" * 64},
        "valid_until": text_of(NOW_S + 60),
    }
    if not nodes:
        told["unsafe_way"] = {"reason": "nothing is open", "code": "between_causes", "nodes": [], "length_m": 0.0}
    return told | more


def on_leg(leg: str, fraction: float, enters: str, length_m: float, overrun_m: float = 0.0) -> dict:
    roofs = network()
    segment = roofs.by_ends.get((leg[0], leg[1]))
    (ax, ay), (bx, by) = PLACES[leg[0]], PLACES[leg[1]]
    begin = [ax + (bx - ax) * fraction, ay + (by - ay) * fraction, 30.0]
    stretch = {"kind": "leg", "from": leg[0], "to": leg[1], "fraction": fraction, "enters": enters}
    stretch |= {"length_m": length_m, "geometry": [begin, [*PLACES[enters], 30.0]]}
    if segment is not None:
        stretch["segment"] = segment.id
    if overrun_m:
        stretch["overrun_m"] = overrun_m
    return stretch


def nowhere(node: str) -> dict:
    return {"kind": "none", "enters": node, "length_m": 0.0, "geometry": [[*PLACES[node], 30.0]]}


def flown_answer(nodes: str, stretch: dict, begins_s: float, **more) -> dict:
    """An answer with its legs, by the judge's own model."""
    roofs, drone = network(), Drone(PHANTOM3, 0.0, None, Wind())
    heights = Heights(roofs)
    told = answer("rerouted", nodes, stretch, energy="assumed", assumed=["airframe"], **more)
    taken = drone.power_w * stretch["length_m"] / 16 / 3600 / PHANTOM3.battery_wh
    battery, at_s, legs = BATTERY - taken, NOW_S + begins_s, []
    told["flight"] = {"objective": "distance", "proved": True, "battery_at_departure_fraction": battery, "stops": []}
    for start, end in zip(nodes, nodes[1:]):
        segment = roofs.by_ends[start, end]
        stretch_wh = fly(drone, roofs, heights, segment, start).least_wh
        left = battery - stretch_wh / PHANTOM3.battery_wh
        leg = {"from": start, "to": end, "segment": segment.id, "length_m": segment.length_m}
        leg |= {"departs_at": text_of(at_s), "arrives_at": text_of(at_s + segment.length_m / 16)}
        leg["flight"] = {"battery_before_fraction": battery, "battery_after_fraction": left, "energy_wh": stretch_wh}
        legs.append(leg)
        battery, at_s = left, at_s + segment.length_m / 16
    told["legs"] = legs
    told["flight"]["battery_at_arrival_fraction"] = battery
    told["remaining_time_s"] = at_s - NOW_S
    return told


# --- right answers, and how each is bent ---


def middle(fraction: float = 0.5):
    return (1000.0 + 1000.0 * fraction, 0.0)


def set_in(told: dict, *path_and_value) -> dict:
    *path, last, value = path_and_value
    inner = told
    for step in path:
        inner = inner[step]
    inner[last] = value
    return told


def swapped_start(told: dict) -> dict:
    told["path"]["nodes"][0] = "c"
    told["first_stretch"] = on_leg("bc", 0.4, "c", 600.0)
    return told


def to_end(outcome: str, fraction: float) -> dict:
    return answer(outcome, "cd", on_leg("bc", fraction, "c", 1000.0 * (1 - fraction)))


def forgotten(told: dict) -> dict:
    told |= {"first_stretch": nowhere("b"), "first_stretch_m": 0.0}
    told["remaining_length_m"] = told["recomposed_length_m"]
    return told


def delayed(told: dict, by_s: float) -> dict:
    from flown import instant

    for leg in told["legs"]:
        for name in ("departs_at", "arrives_at"):
            leg[name] = text_of(instant(leg[name]) + by_s)
    return told


def charged(told: dict, by: float) -> dict:
    """As if the battery were another one than the report's."""
    told["flight"]["battery_at_departure_fraction"] += by
    told["flight"]["battery_at_arrival_fraction"] += by
    for leg in told["legs"]:
        leg["flight"]["battery_before_fraction"] += by
        leg["flight"]["battery_after_fraction"] += by
    return told


def with_stop(told: dict) -> dict:
    """It charges at f for ten minutes."""
    from flown import instant

    lands = instant(told["legs"][0]["arrives_at"])
    before = told["legs"][0]["flight"]["battery_after_fraction"]
    stop = {"node": "f", "pad": 0, "kind": "charge", "before_leg": 1, "waits_s": 540.0}
    stop |= {"lands_at": text_of(lands), "takes_off_at": text_of(lands + 600.0)}
    told["flight"]["stops"] = [stop | {"battery_before_fraction": before, "battery_after_fraction": before}]
    for leg in told["legs"][1:]:
        for name in ("departs_at", "arrives_at"):
            leg[name] = text_of(instant(leg[name]) + 600.0)
    return told


def cases() -> list[tuple[str, World, Report, dict, list[tuple[str, str, object]]]]:
    """A right answer in a world, and bent ones: what is bent, the rule that has to find it, how."""
    failed = report("navigational", "bc", middle(0.4))
    back = answer("rerouted", "bfgcd", on_leg("bc", 0.4, "b", 400.0))
    behind = round_zone("behind", 1300.0, 0.0, 40.0)
    flags = FLAGS
    flag_bends = [
        (f"flag without ground, {flag}", "flag", lambda told, flag=flag: set_in(told, "flags", [flag]))
        for flag in flags
    ]
    return [
        (
            "an obstacle on its leg",
            world(),
            failed,
            back,
            [
                ("swapped start", "path", swapped_start),
                ("first stretch forgotten", "start", forgotten),
                ("a longer way", "shortest", lambda _: answer("rerouted", "baefgcd", on_leg("bc", 0.4, "b", 400.0))),
                ("the failed leg flown", "start", lambda _: to_end("rerouted", 0.4)),
                ("a leg that is none", "path", lambda told: set_in(told, "path", "segments", 0, "b-g")),
                ("a sum that is none", "length", lambda told: set_in(told, "remaining_length_m", 3000.0)),
                ("a time that is none", "time", lambda told: set_in(told, "remaining_time_s", 100.0)),
                ("ids as numbers", "ids", lambda told: set_in(told, "first_stretch", "from", 7)),
                ("needless no_route", "needless", lambda _: answer("no_route", "", None)),
                ("needless diverted", "needless", lambda _: answer("diverted", "bf", on_leg("bc", 0.4, "b", 400.0))),
                ("unsafe way beside a path", "unsafe_way", lambda told: told | {"unsafe_way": {"nodes": ["c"]}}),
                ("no network", "stamp", lambda told: set_in(told, "network", None)),
                *flag_bends,
            ],
        ),
        (
            "an obstacle ahead and a zone behind",
            world(behind),
            report("navigational", "bc", middle(0.6)),
            answer("no_route", "", None),
            [
                ("dropped cause", "start", lambda _: to_end("unaffected", 0.6)),
                ("leaked", "no_route", lambda told: set_in(told, "path", "nodes", ["c"])),
            ],
        ),
        (
            "a zone ahead, one behind is none of its concern",
            world(behind),
            report("service_level", "bc", middle(0.6)),
            to_end("unaffected", 0.6),
            [
                (
                    "through the zone behind",
                    "start",
                    lambda _: answer("rerouted", "bfgcd", on_leg("bc", 0.6, "b", 600.0)),
                )
            ],
        ),
        (
            "a zone around it",
            world(round_zone("around", 1680.0, 0.0, 90.0)),
            report("service_level", "bc", middle(0.7)),
            answer("rerouted", "cd", on_leg("bc", 0.7, "c", 300.0), ["leaving_zone"]),
            [
                (
                    "the longer way out",
                    "start",
                    lambda _: answer("rerouted", "bfgcd", on_leg("bc", 0.7, "b", 700.0), ["leaving_zone"]),
                ),
                ("leaving_zone left out", "flag", lambda told: set_in(told, "flags", [])),
            ],
        ),
        (
            "ten metres before a zone",
            world(round_zone("near", 1700.0, 0.0, 90.0)),
            report("service_level", "bc", middle(0.59)),
            answer("rerouted", "bfgcd", on_leg("bc", 0.59, "b", 590 + 2 * 68.5714, 68.5714), ["cannot_stop"]),
            [("cannot_stop left out", "flag", lambda told: set_in(told, "flags", []))],
        ),
        removed_leg(),
        (
            "a closed node on the way",
            world(closures=[Closure("c0", set(), {"g"}, set(), [], None)]),
            report("navigational", "bc", (1000.0, 0.0), stands_at="b"),
            answer("diverted", "bf", nowhere("b")),
            [("closed node entered", "closed", lambda _: answer("rerouted", "bfgcd", nowhere("b")))],
        ),
        (
            "a zone over the pad on which it charges",
            world(round_zone("over-f", 1000.0, 500.0, 80.0, [(-600.0, 600.0)])),
            report("service_level", "fb", (1000.0, 500.0), stands_at="f", airborne=False),
            answer("hold", "fbcd", nowhere("f")),
            [
                (
                    "ground drone sent up",
                    "ground",
                    lambda _: answer("rerouted", "bcd", on_leg("fb", 0.0, "b", 500.0), ["leaving_zone"]),
                )
            ],
        ),
        (
            "it has to land",
            world(),
            report("operational", "bc", middle(0.6), detail="land_now", destination="g"),
            answer("diverted", "c", on_leg("bc", 0.6, "c", 400.0)),
            [("flown on", "operational", lambda _: answer("rerouted", "cg", on_leg("bc", 0.6, "c", 400.0)))],
        ),
        *flown_cases(),
    ]


def removed_leg():
    gone = world()
    roofs = network()
    gone.network = Network(roofs.plane, list(roofs.nodes.values()), [s for s in roofs.segments if s.id != "b-c"], False)
    stretch = on_leg("bc", 0.5, "b", 500.0)
    stretch.pop("segment")

    def open_leg(_) -> dict:
        told = to_end("rerouted", 0.5)
        told["first_stretch"].pop("segment")
        return told

    return (
        "its leg is not in the network",
        gone,
        report("service_level", "bc", middle()),
        answer("rerouted", "bfgcd", stretch),
        [("removed leg assumed open", "start", open_leg)],
    )


def flown_cases():
    failed = report("navigational", "bc", middle(0.4), battery=BATTERY)
    stretch = on_leg("bc", 0.4, "b", 400.0)
    # It closes at 400 s. The leg c - d is left at 219 s: widened by 71 s it begins at 329 s.
    later = round_zone("later", 2500.0, 0.0, 50.0, [(400.0, 900.0)])
    right = flown_answer("bfgcd", stretch, 25.0)
    plan = {"id": "p", "segments": set(), "stays": [], "held": [("f", 0, NOW_S, NOW_S + 3600.0)]}
    other_pad = {"id": "p", "segments": set(), "stays": [], "held": [("f", 1, NOW_S, NOW_S + 3600.0)]}
    cases = [
        (
            "flown, before a zone begins",
            world(later, flown=True),
            failed,
            right,
            [
                ("margin at entry", "closed", lambda told: delayed(told, 110.0)),
                ("the plan's battery taken for the report's", "battery", lambda told: charged(told, 0.08)),
                (
                    "a leg that draws nothing",
                    "battery",
                    lambda told: set_in(told, "legs", 1, "flight", "battery_after_fraction", 0.87),
                ),
                ("legs left out", "legs", lambda told: set_in(told, "legs", [])),
                ("a default that is not told", "energy", lambda told: told | {"energy": "checked", "assumed": []}),
                ("times before now", "time", lambda told: delayed(told, -40.0)),
                ("needless no_route", "needless", lambda _: answer("no_route", "", None)),
            ],
        ),
        (
            "flown, charging beside another drone",
            world(flown=True, plans=[other_pad]),
            failed,
            with_stop(flown_answer("bfgcd", stretch, 25.0)),
            [("pad taken twice", "pads", None)],
        ),
        (
            "flown, the battery is unknown",
            world(flown=True),
            report("operational", "bc", middle(0.4)),
            answer("diverted", "bf", on_leg("bc", 0.4, "b", 400.0)),
            [("flown on all the same", "operational", lambda _: answer("rerouted", "bfgcd", stretch))],
        ),
    ]
    cases[1][4][0] = ("pad taken twice", "pads", world(flown=True, plans=[plan]))
    return cases


def self_test() -> int:
    """Prints what is not found, and gives 1 where anything is not."""
    missed = bends = 0
    for name, scene, told_report, right, bent in cases():
        faults, _ = judge(scene, told_report, copy.deepcopy(right))
        for fault in faults:
            missed += 1
            print(f"FAILED: {name}: the right answer: {fault}")
        for what, rule, bend in bent:
            bends += 1
            place = bend if isinstance(bend, World) else scene
            wrong = copy.deepcopy(right) if isinstance(bend, World) else bend(copy.deepcopy(right))
            faults, _ = judge(place, told_report, wrong)
            if not any(fault.rule == rule for fault in faults):
                missed += 1
                print(f"FAILED: {name}, {what}: no fault by the rule {rule} among {[str(fault) for fault in faults]}")
    print(f"self-test: {len(cases())} right answers, {bends} bent ones, {missed} judged wrongly")
    return 1 if missed else 0
