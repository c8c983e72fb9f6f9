"""Holds what the registry answers and what was told against what was ordered; without a look at anything but that."""

import copy
import dataclasses

from town import FINAL


@dataclasses.dataclass
class Evidence:
    """What a seed came to, by public answers alone."""

    # The ids that orders were acknowledged with, by their idempotency keys: as often as they were.
    acknowledged: dict[str, list[str]]
    # The list of deliveries, and of drones, at the end.
    listing: list[dict]
    drones: list[dict]
    # The events that the endpoint took of each delivery, in their order, and what it found wrong.
    told: dict[str, list[str]]
    # The plans that drones say that they have flown to the end, and what they were told wrong.
    flown: list[str]
    # The nodes that a drone has come to by each plan, as it says.
    visited: dict[str, set[str]]
    faults: list[str]
    # Those that were answered as called off.
    called_off: list[str]


def judge(evidence: Evidence) -> list[str]:
    """Everything that is wrong; nothing where all is right."""
    faults = list(evidence.faults)
    ids = [delivery["id"] for delivery in evidence.listing]
    faults += [f"{one} is listed {ids.count(one)} times" for one in sorted(set(ids)) if ids.count(one) > 1]
    known: dict[str, str] = {}
    for key, answers in evidence.acknowledged.items():
        if len(set(answers)) != 1:
            faults.append(f"order {key} was acknowledged as {sorted(set(answers))}")
        for one in set(answers):
            if one not in ids:
                faults.append(f"{one}, acknowledged for order {key}, is lost")
            if known.setdefault(one, key) != key:
                faults.append(f"{one} was acknowledged for orders {known[one]} and {key}")
    faults += [f"{one} was never acknowledged" for one in sorted(set(ids) - set(known))]
    faults += [f"{one} is told of and not listed" for one in sorted(set(evidence.told) - set(ids))]
    for delivery in evidence.listing:
        faults += delivery_faults(delivery, evidence)
    return faults + drone_faults(evidence)


def delivery_faults(delivery: dict, evidence: Evidence) -> list[str]:
    """What is wrong with one."""
    name, faults = delivery["id"], []
    statuses = [change["status"] for change in delivery["history"]]
    if statuses[:1] != ["created"]:
        faults.append(f"{name} does not begin with created: {statuses}")
    if [status for status in statuses if status in FINAL] != statuses[-1:]:
        faults.append(f"{name} does not end in one final status: {statuses}")
    if delivery["status"] != statuses[-1]:
        faults.append(f"{name} is {delivery['status']}, and its history ends with {statuses[-1]}")
    told, expected = evidence.told.get(name, []), [f"delivery.{status}" for status in statuses]
    if told != expected:
        faults.append(f"{name}: the endpoint was told {told}, and it was {expected}")
    is_delivered = delivery["status"] == "delivered"
    if is_delivered and not delivery.get("proof"):
        faults.append(f"{name} was delivered without a proof")
    plan = (delivery.get("allocation") or {}).get("plan_id")
    times = evidence.flown.count(plan)
    if is_delivered and times != 1:
        faults.append(f"{name} was delivered, and its plan {plan} flown {times} times")
    if is_delivered and delivery["destination"] not in evidence.visited.get(plan, ()):
        faults.append(f"{name} was delivered, and the drone of its plan {plan} never at its drop, {delivery['destination']}")
    if delivery["status"] == "cancelled" and times:
        faults.append(f"{name} was called off, and its plan {plan} flown {times} times")
    if name in evidence.called_off and delivery["status"] != "cancelled":
        faults.append(f"{name} was answered as called off, and is {delivery['status']}")
    return faults


def drone_faults(evidence: Evidence) -> list[str]:
    """What is wrong with who flew what."""
    faults, flights = [], {}
    for delivery in evidence.listing:
        if allocation := delivery.get("allocation"):
            flights.setdefault(allocation["drone_id"], []).append((*carried(delivery), delivery["id"], allocation["plan_id"]))
    for drone, flown in flights.items():
        flown.sort()
        for (_, ends, first, plan), (begins, _, second, other) in zip(flown, flown[1:]):
            if begins < ends:
                faults.append(f"{drone} flew {first} and {second} at once: until {ends} and from {begins}")
            if plan == other:
                faults.append(f"{drone} flew {first} and {second} by one plan, {plan}")
    faults += [f"{plan} was flown twice" for plan in sorted(set(evidence.flown)) if evidence.flown.count(plan) > 1]
    # One that has landed elsewhere waits for people: also where its parcel was handed over.
    landed = {(delivery.get("allocation") or {}).get("drone_id") for delivery in evidence.listing if delivery["status"] in ("diverted", "returned")}
    for drone in evidence.drones:
        states = ["available", "out_of_service"] if drone["id"] in landed else ["available"]
        if drone["state"] not in states or drone.get("delivery_id"):
            faults.append(f"{drone['id']} is {drone['state']} for {drone.get('delivery_id')} when all is over")
    return faults


def carried(delivery: dict) -> tuple[str, str]:
    """From when to when its drone had a delivery: from its last assignment to its end."""
    assigned = [change["at"] for change in delivery["history"] if change["status"] == "assigned"]
    return padded((assigned or [delivery["created_at"]])[-1]), padded(delivery["history"][-1]["at"])


def padded(instant: str) -> str:
    """An instant of RFC 3339 with all digits of its fraction, so that instants are sorted as their texts are."""
    whole, _, fraction = instant.removesuffix("Z").partition(".")
    return f"{whole}.{fraction:0<9}"


def right() -> Evidence:
    """Two deliveries by one drone, and nothing wrong."""
    def one(number: int) -> dict:
        statuses = ["created", "assigned", "picking_up", "in_flight", "delivered"]
        history = [{"status": status, "at": f"2026-11-27T0{number}:00:0{second}Z"} for second, status in enumerate(statuses)]
        return {"id": f"d-{number}", "status": "delivered", "history": history, "created_at": history[0]["at"],
                "destination": f"n-{number}", "proof": {"at": "then"}, "allocation": {"drone_id": "acme:1", "plan_id": f"p-{number}"}}
    listing = [one(1), one(2)]
    told = {one["id"]: [f"delivery.{change['status']}" for change in one["history"]] for one in listing}
    return Evidence({"first": ["d-1", "d-1"], "second": ["d-2"]}, listing, [{"id": "acme:1", "state": "available"}], told,
                    ["p-1", "p-2"], {"p-1": {"n-1"}, "p-2": {"n-2"}}, [], [])


def final_twice(evidence: Evidence) -> None:
    """A status after the last."""
    for delivery in evidence.listing[:1]:
        delivery["history"].append(delivery["history"][-1])
        evidence.told[delivery["id"]].append("delivery.delivered")


def unended(evidence: Evidence) -> None:
    """One that never ended, of which all was told."""
    evidence.listing[0]["history"].pop()
    evidence.listing[0]["status"] = "in_flight"
    evidence.told[evidence.listing[0]["id"]].pop()


def at_once(evidence: Evidence) -> None:
    """One drone with two deliveries."""
    for change, other in zip(evidence.listing[1]["history"], evidence.listing[0]["history"]):
        change["at"] = other["at"]


PLANTED = {
    "a webhook is dropped": lambda evidence: evidence.told["d-1"].remove("delivery.delivered"),
    "two webhooks change places": lambda evidence: evidence.told["d-1"].sort(),
    "a webhook is told as new twice": lambda evidence: evidence.told["d-2"].append("delivery.delivered"),
    "a delivery is listed twice": lambda evidence: evidence.listing.append(evidence.listing[0]),
    "a delivery is lost": lambda evidence: evidence.listing.pop(),
    "a delivery that nobody was answered": lambda evidence: evidence.acknowledged.pop("second"),
    "an order is two deliveries": lambda evidence: evidence.acknowledged["first"].append("d-2"),
    "two orders are one delivery": lambda evidence: evidence.acknowledged.update(third=["d-1"]),
    "a delivery ends twice": final_twice,
    "a delivery does not end": unended,
    "a delivery stands otherwise than its history": lambda evidence: evidence.listing[0].update(status="failed"),
    "a proof is missing": lambda evidence: evidence.listing[0].pop("proof"),
    "a plan is flown twice": lambda evidence: evidence.flown.append("p-1"),
    "a delivery that was called off goes on": lambda evidence: evidence.called_off.append("d-1"),
    "a drone has not been at the drop": lambda evidence: evidence.visited["p-1"].clear(),
    "a delivery is not flown": lambda evidence: evidence.flown.remove("p-2"),
    "a drone flies two at once": at_once,
    "a drone is out of service without a reason": lambda evidence: evidence.drones[0].update(state="out_of_service"),
    "a drone stays assigned": lambda evidence: evidence.drones[0].update(state="assigned", delivery_id="d-1"),
    "an endpoint is called without a signature": lambda evidence: evidence.faults.append("m-1 has no valid signature"),
}


def self_test() -> str:
    """Plants every fault in what is right, and sees that the judge finds each of them and nothing before."""
    assert not judge(right()), judge(right())
    for name, plant in PLANTED.items():
        bent = copy.deepcopy(right())
        plant(bent)
        found = judge(bent)
        assert found, f"not found: {name}"
        print(f"found: {name}: {found[0]}")
    return f"self-test: {len(PLANTED)} planted faults found, none in what is right"
