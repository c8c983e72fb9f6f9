"""Plans of other drones, which take pads and legs: asked of the edge, and read as it tells them."""

import random

from flown import instant
from talk import Edge
from world import World

PLANS = 10


def keep(edge: Edge, dice: random.Random, world: World, before: list[dict]) -> None:
    """Has plans composed where there are none yet, and puts what all of them take into the world."""
    network = world.network
    if not before:
        goals = [node for node in network.nodes.values() if node.pads == 1] or list(network.nodes.values())
        for number in range(PLANS):
            goal = dice.choice(goals)
            source = dice.choice(sorted(network.nodes))
            if source == goal.id:
                continue
            body = {"id": f"p{number}", "source": source, "destination": goal.id, "drone_id": f"other:{number}"}
            body |= {"payload_kg": 0.25, "battery_fraction": dice.choice([0.5, 0.9])}
            # Without a way there is no plan.
            edge.rest.call("POST", "/v1/plans", body)
    for number in range(PLANS):
        told = edge.rest.call("GET", f"/v1/plans/p{number}")
        if told.code is None:
            world.plans.append(taken_by(told.body))
    for plan in world.plans:
        for earlier in before:
            if earlier["id"] == plan["id"]:
                add(plan, earlier)
        # What is told after the answers may have been taken after them.
        plan["held"] = list(plan["stays"])


def read_again(edge: Edge, world: World) -> None:
    """Adds what plans took meanwhile: a zone is in force before they follow it."""
    for plan in world.plans:
        told = edge.rest.call("GET", f"/v1/plans/{plan['id']}")
        if told.code is None:
            add(plan, taken_by(told.body))


def add(plan: dict, more: dict) -> None:
    """Every version that was sent keeps what it takes, and is not told whole any more once there is a newer one."""
    plan["stays"] += [stay for stay in more["stays"] if stay not in plan["stays"]]
    plan["segments"] |= more["segments"]
    plan["ends"] |= more["ends"]
    plan["sent"] |= more["sent"]
    plan["seen"] |= more["seen"]


def taken_by(plan: dict) -> dict:
    """Pads with their times, and segments, of all that its drone may be flying."""
    names = ("current", "proposed", "reported", "wanted")
    versions = [plan[name] for name in names if plan.get(name)]
    versions += [version for version in plan.get("versions") or [] if isinstance(version, dict) and "path" in version]
    stays, segments, ends = [], set(), set()
    for version in versions:
        path = version["path"]
        segments |= set(path["segments"])
        if path["nodes"]:
            ends.add(str(path["nodes"][-1]))
        for stop in (version.get("flight") or {}).get("stops") or []:
            stays.append((str(stop["node"]), stop["pad"], instant(stop["lands_at"]), instant(stop["takes_off_at"])))
    flown = versions[0] if versions else {"path": {"nodes": []}}
    nodes = [str(node) for node in flown["path"]["nodes"]]
    return {
        "id": plan["id"],
        "segments": segments,
        "stays": stays,
        "ends": ends,
        "nodes": nodes,
        "drone": plan.get("drone_id"),
        # Numbers of the versions that were sent, and of those that were told whole.
        "sent": {version["version"] for version in plan.get("versions") or []},
        "seen": {version["version"] for version in versions},
    }
