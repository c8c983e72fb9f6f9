"""A record in which all is well, and faults planted in it one by one, each to be found."""

import copy
import json

import accounting
import separation
import zones
from record import Record

BEGAN_S = 1_795_773_600


def text_of(at_s: float) -> str:
    """Seconds after the start, as text."""
    minutes, seconds = divmod(at_s, 60)
    return f"2026-11-27T10:{int(minutes):02d}:{seconds:06.3f}Z"


# A square of nodes, 1,000 m wide.
PLACES = {"a": (0, 0), "b": (1000, 0), "c": (1000, 1000), "d": (0, 1000)}


def network() -> dict:
    properties = {"kind": "node", "pads": 1}
    features = [
        {"type": "Feature", "id": name, "geometry": {"coordinates": list(at)}, "properties": properties}
        for name, at in PLACES.items()
    ]
    return {"kind": "network", "network": {"skyway": {"coordinates": "planar"}, "features": features}}


def leg(one: str, other: str, departs_s: float, height_m: float = 50.0) -> dict:
    """100 s from corner to corner."""
    ends = [[*PLACES[name], height_m] for name in (one, other)]
    name = "-".join(sorted((one, other)))
    times = {"departs_at": text_of(departs_s), "arrives_at": text_of(departs_s + 100)}
    return {"from": one, "to": other, "segment": name, "geometry": ends, **times}


def version(plan: str, legs: list[dict], number: int = 1, sent_s: float = 0.0, **told) -> dict:
    times = {"sent_at": text_of(sent_s), "departs_at": legs[0]["departs_at"], "arrives_at": legs[-1]["arrives_at"]}
    outcome = "composed" if number == 1 else "rerouted"
    about = {"kind": "version", "plan_id": plan, "drone_id": plan, "version": number, "outcome": outcome}
    return {**about, "first_stretch": None, "flags": [], "stops": [], "legs": legs, **times, **told}


def event(kind: str, at_s: float, data: dict) -> dict:
    return {"kind": "event", "event": {"kind": kind, "at": text_of(at_s), "data": data}}


def zone(name: str, at_s: float, centre: list, radius_m: float, **told) -> dict:
    geometry = {"type": "Point", "coordinates": centre}
    properties = {"radius_m": radius_m, "margin_m": 10.0, **told}
    return event("zone_put", at_s, {"zone": {"id": name, "geometry": geometry, "properties": properties}})


def outcome(plan: str, at_s: float, *causes: str, told: str = "rerouted", kind: str = "plan_affected") -> dict:
    return event(kind, at_s, {"plan": {"id": plan}, "outcome": told, "causes": list(causes)})


def relieved(plan: str, at_s: float, *causes: str) -> dict:
    return outcome(plan, at_s, *causes, told="unaffected", kind="plan_relieved")


def acknowledged(plan: str, at_s: float, number: int) -> dict:
    return event("plan_acknowledged", at_s, {"plan": {"id": plan, "reported": {"version": number}}})


def replanned(name: str, at_s: float, count: int, **outcomes: int) -> dict:
    return event("replanned", at_s, {"closure_id": name, "plan_count": count, "outcomes": outcomes})


def restarted(at_s: float) -> dict:
    return {"kind": "restarted", "at": text_of(at_s)}


def listed(plan: str, at_s: float, reported: int, wanted: int | None, sent_s: float, *causes: str) -> dict:
    told = {"wanted": wanted, "outcome": "rerouted", "sent_at": text_of(sent_s), "affected_by": list(causes)}
    return {"kind": "listed", "at": text_of(at_s), "id": plan, "state": "activated", "reported": reported, **told}


def stop(node: str, lands_s: float, leaves_s: float) -> dict:
    return {"node": node, "pad": 0, "kind": "charge", "lands_at": text_of(lands_s), "takes_off_at": text_of(leaves_s)}


def well() -> list[dict]:
    """Two drones that keep apart, a third that charges, and a zone that meets one of them."""
    return [
        {"kind": "run", "workload": "planted", "seed": 0},
        network(),
        version("one", [leg("a", "b", 10), leg("b", "c", 110)]),
        version("two", [leg("a", "b", 40), leg("b", "c", 140)], stops=[stop("a", 0, 40)]),
        version("three", [leg("c", "d", 400), leg("d", "a", 500)], stops=[stop("c", 300, 400)]),
        zone("far", 5, [500, 1400], 100),
        zone("wall", 20, [1000, 500], 50),
        outcome("one", 20.1, "wall"),
        outcome("two", 20.2, "wall"),
        replanned("wall", 20.2, 2, rerouted=2),
        version("one", [leg("b", "a", 111), leg("a", "d", 211)], 2, 20.1),
        acknowledged("one", 21, 2),
        version("two", [leg("b", "a", 142), leg("a", "d", 242)], 2, 20.2),
        acknowledged("two", 22, 2),
        event("zone_deleted", 290, {"zone_id": "wall"}),
        {"kind": "plan", "id": "one", "affected_by": []},
    ]


def bent(*changes) -> list[dict]:
    """The record with entries added, or, by their place, replaced or taken out."""
    entries = copy.deepcopy(well())
    for change in changes:
        if isinstance(change, tuple):
            place, entry = change
            entries[place] = entry
        else:
            entries.append(change)
    return [entry for entry in entries if entry is not None]


def place_of(kind: str, plan: str) -> int:
    """Where an event of a plan stands."""
    for index, entry in enumerate(well()):
        if entry["kind"] == "event" and entry["event"]["kind"] == kind:
            if entry["event"]["data"].get("plan", {}).get("id") == plan:
                return index
    raise KeyError(plan)


LINE = {"type": "Polygon", "coordinates": [[[400, 990], [600, 990], [600, 1100], [400, 1100], [400, 990]]]}
WINDOW = {"windows": [{"from": text_of(440), "until": text_of(600)}]}
PASSED = {"windows": [{"from": text_of(600), "until": text_of(700)}]}


def polygon(name: str, at_s: float) -> dict:
    return event("zone_put", at_s, {"zone": {"id": name, "geometry": LINE, "properties": {"margin_m": 10.0}}})


def late(plan: str = "late", **told) -> dict:
    """A plan that is composed after the zones came."""
    return version(plan, [leg("c", "d", 430)], sent_s=300, **told)


def unseparated(*more: dict) -> list[dict]:
    """A drone that follows another one too near, and says so."""
    return bent(version("four", [leg("c", "d", 420)], flags=["unseparated"]), *more)


SEPARATION = [
    ("headway", bent(version("four", [leg("c", "d", 420)]))),
    ("head_on", bent(version("four", [leg("d", "c", 450)]))),
    ("pad", bent(version("four", [leg("c", "d", 460)], stops=[stop("c", 390, 460)]))),
    ("node", bent(version("four", [leg("b", "a", 502)]))),
    ("crossing", bent(
        version("four", [{**leg("a", "c", 430), "geometry": [[0, 1000, 55], [1000, 1000, 55]], "segment": "over"}]))),
    ("headway", unseparated()),
    ("flagged", unseparated(event("alarm_raised", 20, {"alarm": {"kind": "unseparated", "plan_id": "four"}}))),
]
# A version is taken over on a leg, behind the node where it would have met another plan.
NO_SEPARATION = [
    bent(version("four", [leg("c", "b", 700)]), version("four", [leg("a", "b", 602)], 2, 640), acknowledged("four", 650, 2)),
]
ZONES = [
    ("zone", bent(zone("late", 299, [500, 1000], 30), late())),
    ("zone", bent(polygon("late", 299), late())),
    ("zone", bent(zone("late", 299, [500, 1000], 30, **WINDOW), late())),
    # Its line leads by outside, within the margin.
    ("zone", bent(zone("late", 299, [500, 1035], 30), late())),
    ("zone", bent((10, version("one", [leg("a", "b", 111), leg("b", "c", 120)], 2, 20.1)))),
]
NO_ZONES = [
    bent(zone("late", 299, [500, 1035], 20), late()),
    bent(zone("late", 299, [500, 1000], 30, **PASSED), late()),
    bent(zone("late", 299, [500, 1000], 30), event("zone_deleted", 420, {"zone_id": "late"}), late()),
    bent(zone("late", 299, [1000, 1000], 30), late(flags=["leaving_zone"])),
]
# The edge is killed before it tells one of the plans; or that plan has another version since the moment in which the
# zone came.
UNHEARD = ((place_of("plan_affected", "two"), None), (9, restarted(21)), (14, None))
TAKEN_OVER = ((place_of("plan_affected", "two"), acknowledged("two", 20.5, 2)), (9, restarted(21)), (14, None))
LISTED = place_of("plan_acknowledged", "two")
# A zone comes around a drone in flight.
INSIDE = (zone("around", 430, [700, 1000], 50), outcome("three", 430.5, "around", told="no_route"))
NO_ACCOUNTING = [
    bent(*UNHEARD, (LISTED, listed("two", 21, 1, 2, 20.2, "wall"))),
    bent(*TAKEN_OVER, (LISTED, listed("two", 21, 2, None, 0))),
    # Others have flown on, and there is a way out.
    bent(*INSIDE, outcome("three", 445, "around", told="rerouted")),
    # It is told that it flies on once it has left the zone.
    bent(*INSIDE, relieved("three", 440, "around")),
]
ACCOUNTING = [
    ("untold", bent((place_of("plan_affected", "two"), None), (9, replanned("wall", 20.2, 1, rerouted=1)))),
    ("told_twice", bent(outcome("one", 295, "far"), outcome("one", 296, "far"))),
    # The zone still lies ahead; or it is told that a second time.
    ("told_twice", bent(
        zone("ahead", 405, [300, 1000], 50), outcome("three", 406, "ahead", told="no_route"), relieved("three", 410, "ahead"))),
    ("told_twice", bent(*INSIDE, relieved("three", 440, "around"), relieved("three", 445, "around"))),
    ("told_twice", bent(*INSIDE, outcome("three", 445, "around", told="no_route"))),
    ("told_twice", bent(*INSIDE, *(outcome("three", at_s, "around", told="rerouted") for at_s in (445, 446)))),
    ("named_in_vain", bent(outcome("three", 300, "nowhere"))),
    ("miscounted", bent((9, replanned("wall", 20.2, 3, rerouted=3)))),
    # The version that the list shows leads through the zone, as it was made before it came.
    ("untold", bent(
        *UNHEARD, (12, version("two", [leg("b", "c", 140)], 2, 19)), (LISTED, listed("two", 21, 1, 2, 19, "wall")))),
    # The kill has undone what was taken over.
    ("untold", bent(*TAKEN_OVER, (LISTED, listed("two", 21, 1, None, 0)))),
    ("standing_untold", bent({"kind": "plan", "id": "three", "affected_by": ["far"]})),
]


def of(entries: list[dict]) -> Record:
    return Record(json.dumps(entry) for entry in entries)


JUDGES = {"separation": separation.judge, "zones": zones.judge, "accounting": accounting.judge}


def self_test() -> int:
    """1 where a judge overlooks what is planted, or finds what is not there."""
    failed = 0
    for name, judge in JUDGES.items():
        for fault in judge(of(well())):
            print(f"FAILED: {name}: where all is well: {fault}")
            failed = 1
    for name, planted in (("separation", SEPARATION), ("zones", ZONES), ("accounting", ACCOUNTING)):
        found = 0
        for number, (rule, entries) in enumerate(planted):
            rules = {fault.rule for fault in JUDGES[name](of(entries))}
            found += rules == {rule}
            if rules != {rule}:
                told = ", ".join(sorted(rules)) or "nothing"
                print(f"FAILED: {name}: planted fault {number} is {rule}, found: {told}")
                failed = 1
        print(f"judge of {name}: {found} of {len(planted)} planted faults found")
    for name, right in (("separation", NO_SEPARATION), ("zones", NO_ZONES), ("accounting", NO_ACCOUNTING)):
        for number, entries in enumerate(right):
            for fault in JUDGES[name](of(entries)):
                print(f"FAILED: {name}: not a fault, {number}: {fault}")
                failed = 1
    return failed
