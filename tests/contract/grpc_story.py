"""A day at the edge: a drone speaks gRPC, by what reflection tells, an operator REST; both are held against each other.

A plan is composed, a leg of it fails, a zone is drawn over its way, seen in a preview, posted and lifted again.
"""

import queue
import threading

import grpc

from checks import Checks
from dialects import Grpc, Rest, as_dict

HEALTH = "grpc.health.v1.Health"
SERVICES = {
    HEALTH,
    "skyway.v1.Airspace",
    "skyway.v1.Clock",
    "skyway.v1.Drones",
    "skyway.v1.Network",
    "skyway.v1.Plans",
    "skyway.v1.Recomposition",
}
SOURCE, DESTINATION = 379, 62
PLAN_ID, ZONE_ID = "story-plan", "story-zone"
ZONE_RADIUS_M = 25.0
EVENT_S = 10.0


class Watch:
    """Events as they come, read by a thread of its own."""

    def __init__(self, client: Grpc) -> None:
        self._stream = client.watch("skyway.v1.Airspace", "WatchEvents", {}, timeout_s=120.0)
        self._events: queue.Queue = queue.Queue()
        self.seen: list[dict] = []
        # The stream is open when its headers are there; what happens from then on is told.
        self._stream.initial_metadata()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        try:
            for event in self._stream:
                self._events.put(as_dict(event))
        except grpc.RpcError as error:
            self._events.put({"kind": f"ENDED: {error.code().name}"})

    def wait_for(self, kind: str) -> dict | None:
        """The next event of a kind; none where it does not come."""
        try:
            while True:
                event = self._events.get(timeout=EVENT_S)
                self.seen.append(event)
                if event["kind"] == f"EVENT_KIND_{kind}":
                    return event
        except queue.Empty:
            return None

    def cancel(self) -> None:
        """Ends the stream."""
        self._stream.cancel()


def run(url: str, address: str) -> Checks:
    """Tells the story."""
    checks = Checks("gRPC story")
    rest, client = Rest(url), Grpc(address)
    try:
        reflection_and_health(checks, client)
        watch = Watch(client)
        try:
            story(checks, rest, client, watch)
        finally:
            watch.cancel()
    finally:
        client.close()
    return checks


def reflection_and_health(checks: Checks, client: Grpc) -> None:
    found = client.services()
    checks.expect(SERVICES <= found, f"reflection lists {sorted(SERVICES - found)}")
    for service in ["", *sorted(SERVICES - {HEALTH})]:
        answer = client.call(HEALTH, "Check", {"service": service})
        checks.equal((answer.code, answer.body.get("status")), (None, "SERVING"), f"health of '{service}'")


def story(checks: Checks, rest: Rest, client: Grpc, watch: Watch) -> None:
    plan = compose(checks, rest, client, watch)
    if plan is None:
        return
    nodes = plan["reported"]["path"]["nodes"]
    before = report_on_both(checks, rest, client, "before the zone")
    zone_over_the_way(checks, rest, client, watch, nodes, before)
    after = report_on_both(checks, rest, client, "after the zone")
    checks.equal(after, before, "the old answer returns when the zone is lifted")
    real_failure(checks, rest, client, watch, nodes)


def compose(checks: Checks, rest: Rest, client: Grpc, watch: Watch) -> dict | None:
    request = {"id": PLAN_ID, "source": str(SOURCE), "destination": str(DESTINATION), "drone_id": "story-drone"}
    answer = client.call("skyway.v1.Plans", "CreatePlan", request)
    if not checks.equal(answer.code, None, f"a plan is composed: {answer.told()}"):
        return None
    plan = answer.body
    nodes = plan["reported"]["path"]["nodes"]
    checks.equal((nodes[0], nodes[-1]), (str(SOURCE), str(DESTINATION)), "the plan's ends")
    checks.expect(len(nodes) >= 4, f"a way of several legs: {nodes}")
    checks.equal(len(plan["reported"]["legs"]), len(nodes) - 1, "legs of the plan")
    event = watch.wait_for("PLAN_COMPOSED")
    checks.expect(event is not None, f"the plan is an event: {watch.seen}")
    told = rest.call("GET", f"/v1/plans/{PLAN_ID}").body
    checks.equal([str(node) for node in told["reported"]["path"]["nodes"]], nodes, "REST tells the same plan")
    checks.equal(told["reported"]["length_m"], plan["reported"]["length_m"], "and its length")
    return plan


def report_on_both(checks: Checks, rest: Rest, client: Grpc, when: str) -> tuple:
    """The same report, of the plan's first leg, over both; it leaves nothing behind."""
    service = {"plan_id": PLAN_ID, "leg": 0}
    report = {"type": "navigational", "service": service, "optimum": True, "dry_run": True}
    over_rest = rest.call("POST", "/v1/failures", report)
    report["type"] = "FAILURE_TYPE_NAVIGATIONAL"
    over_grpc = client.call("skyway.v1.Recomposition", "ReportFailure", report)
    checks.equal((over_rest.code, over_grpc.code), (None, None), f"{when}: both answer")
    if over_rest.code is not None or over_grpc.code is not None:
        return ()
    told, answer = over_rest.body, over_grpc.body["answer"]
    one = (told["outcome"], tuple(map(str, told["path"]["nodes"])), told["remaining_length_m"])
    other = (
        answer["outcome"].removeprefix("OUTCOME_").lower(),
        tuple(answer["path"]["nodes"]),
        answer["remaining_length_m"],
    )
    checks.equal(other, one, f"{when}: the same path and length over both")
    checks.equal(one[0], "rerouted", f"{when}: the outcome")
    optimum_m = told["remaining_optimum_m"]
    checks.expect(abs(one[2] - optimum_m) <= 1e-6 * optimum_m, f"{when}: {one[2]} m is the optimum {optimum_m} m")
    return one


def zone_over_the_way(checks: Checks, rest: Rest, client: Grpc, watch: Watch, nodes: list[str], before: tuple) -> None:
    """Over a node of both the plan and its recomposed way, which then both have to lead elsewhere."""
    shared = [node for node in nodes[1:-1] if node in before[1]] if before else []
    if not checks.expect(shared, f"the recomposed way meets the plan again: {nodes}, {before}"):
        return
    node = shared[-1]
    place = rest.call("GET", f"/v1/nodes/{node}").body["location"]
    near = client.call("skyway.v1.Network", "Nearest", {"location": {"x": place[0], "y": place[1]}})
    checks.equal(near.body["nodes"][0]["id"], node, "gRPC finds the node where REST says it is")
    zone = {
        "type": "Feature",
        "id": ZONE_ID,
        "geometry": {"type": "Point", "coordinates": place},
        "properties": {"name": "Story", "radius_m": ZONE_RADIUS_M},
    }
    preview = rest.call("POST", "/v1/zones:preview", zone)
    if not checks.equal(preview.code, None, f"the zone has a preview: {preview.told()}"):
        return
    checks.expect(node in preview.body["effect"]["nodes"], "the preview names the node")
    checks.equal(rest.call("GET", f"/v1/zones/{ZONE_ID}").code, "not_found", "a preview leaves nothing behind")
    ack = rest.call("POST", "/v1/zones", zone)
    if not checks.equal(ack.code, None, f"the zone is written: {ack.told()}"):
        return
    for closed in ("segments", "nodes"):
        checks.equal(ack.body["effect"][closed], preview.body["effect"][closed], f"{closed} closed as previewed")
    checks.expect(ack.body["enforced"], "the zone is enforced when it is acknowledged")
    checks.expect(watch.wait_for("ZONE_PUT") is not None, f"the zone is an event: {watch.seen}")
    affected = [plan["plan_id"] for plan in ack.body["effect"]["plans"]]
    checks.equal(affected, [PLAN_ID], "the plans that the zone meets")
    plan_is_affected(checks, client, watch)
    during = report_on_both(checks, rest, client, "under the zone")
    if during:
        checks.expect(node not in during[1], f"the way leads round the zone: {during[1]}")
        checks.expect(during[2] > before[2], f"and is longer: {during[2]} m instead of {before[2]} m")
    lifted = rest.call("DELETE", f"/v1/zones/{ZONE_ID}", headers={"if-match": ack.body["etag"]})
    checks.equal(lifted.code, None, f"the zone is lifted: {lifted.told()}")
    checks.expect(watch.wait_for("ZONE_DELETED") is not None, f"which is an event: {watch.seen}")


def plan_is_affected(checks: Checks, client: Grpc, watch: Watch) -> None:
    checks.expect(watch.wait_for("PLAN_AFFECTED") is not None, f"the affected plan is an event: {watch.seen}")
    plan = client.call("skyway.v1.Plans", "GetPlan", {"id": PLAN_ID}).body
    checks.equal(plan["flags"], ["PLAN_FLAG_AFFECTED"], "its flags")
    checks.equal(plan["affected_by"], [ZONE_ID], "what it is affected by")
    checks.expect(plan.get("wanted"), "its recomposed version is ready")


def real_failure(checks: Checks, rest: Rest, client: Grpc, watch: Watch, nodes: list[str]) -> None:
    """A report that counts: its leg is closed for everyone, and opened again by an operator."""
    report = {
        "type": "FAILURE_TYPE_NAVIGATIONAL",
        "service": {"plan_id": PLAN_ID, "leg": 0},
        "location": {"node": nodes[0]},
        "drone": {"id": "story-drone"},
    }
    answer = client.call("skyway.v1.Recomposition", "ReportFailure", report)
    if not checks.equal(answer.code, None, f"a report that counts: {answer.told()}"):
        return
    publication = answer.body["publication"]
    checks.equal(publication["state"], "PUBLICATION_STATE_PUBLISHED", f"its publication: {publication}")
    checks.expect(watch.wait_for("RECOMPOSED") is not None, f"the answer is an event: {watch.seen}")
    record = rest.call("GET", f"/v1/recompositions/{answer.body['id']}").body
    path = [str(node) for node in record["answer"]["path"]["nodes"]]
    checks.equal(path, answer.body["answer"]["path"]["nodes"], "REST keeps the same answer")
    closure = publication.get("closure_id", "")
    lifted = rest.call("DELETE", f"/v1/closures/{closure}")
    checks.equal(lifted.code, None, f"the closure is lifted: {lifted.told()}")
    cancelled = rest.call("DELETE", f"/v1/plans/{PLAN_ID}")
    checks.equal(cancelled.body.get("ended_as"), "cancelled", "the plan is cancelled")
    told = client.call("skyway.v1.Plans", "GetPlan", {"id": PLAN_ID}).body
    checks.equal(told.get("ended_as"), "ENDED_AS_CANCELLED", "which gRPC tells")
