"""The scenarios of the parity test: good, lenient and bad ones, as both dialects say them, or REST where it alone does.

None of them leaves anything behind, so that the second dialect finds what the first one found.
"""

import dataclasses
from collections.abc import Callable

RECOMPOSITION, PLANS = "skyway.v1.Recomposition", "skyway.v1.Plans"
NETWORK, DRONES = "skyway.v1.Network", "skyway.v1.Drones"
CENTRE = [151.2108551, -33.862204]
SQUARE = [[151.2100, -33.8630], [151.2115, -33.8630], [151.2115, -33.8615], [151.2100, -33.8615], [151.2100, -33.8630]]
ZONE, CLOSURE, PLAN = "parity-zone", "parity-closure", "parity-plan"
LEG = {"from": "379", "to": "406"}
LONG_AGO, LONGER_AGO = "2020-01-01T00:00:00Z", "2019-01-01T00:00:00Z"
STALE = '"0-0"'


def bare(value):
    """Ids as text, enumerations without their prefix: what both dialects have in common."""
    if isinstance(value, list):
        return [bare(entry) for entry in value]
    return str(value)


def report_facts(body: dict) -> tuple:
    """Outcome, way, lengths and warnings of an answer to a report."""
    answer = body.get("answer", body)
    return (
        answer["outcome"].removeprefix("OUTCOME_").lower(),
        bare(answer["path"]["nodes"]),
        bare(answer["path"]["segments"]),
        answer.get("remaining_length_m"),
        answer["strategy_used"].removeprefix("STRATEGY_").lower(),
        [(warning["code"], warning["message"]) for warning in answer["warnings"]],
        body["publication"]["state"].removeprefix("PUBLICATION_STATE_").lower(),
    )


def batch_facts(body: dict) -> list:
    """What became of each report."""
    return [
        report_facts(entry["recomposition"]) if "recomposition" in entry else entry["problem"]["code"]
        for entry in body["answers"]
    ]


def zone_facts(body: dict) -> tuple:
    """What a zone closes."""
    effect = body["effect"]
    closed = (bare(effect["segments"]), bare(effect["nodes"]))
    counts = (int(effect["segment_count"]), int(effect["node_count"]), int(effect["plan_count"]))
    return (*closed, *counts, effect["in_force"], body["enforced"], body["durable"])


def closure_facts(body: dict) -> tuple:
    """What is closed, and why."""
    closure = body.get("closure", body)
    cause = closure["cause"].removeprefix("CLOSURE_CAUSE_").lower()
    return (closure["id"], cause, closure.get("reason"), bare(closure["segments"]), closure["etag"])


def plan_facts(body: dict) -> tuple:
    """How a plan stands, and where it leads."""
    reported = body["reported"]
    state = body["state"].removeprefix("PLAN_STATE_").lower()
    legs = [(leg["segment"], leg["if_closed"].get("extra_m")) for leg in reported["legs"]]
    return (body["id"], state, bare(reported["path"]["nodes"]), reported["length_m"], legs, reported["version"])


def node_facts(body: dict) -> tuple:
    """A node with its segments."""
    segments = [(segment["id"], segment["length_m"], segment["closed"]) for segment in body["segments"]]
    return (bare(body["id"]), body["pads"], body["role"], segments)


def nearest_facts(body: dict) -> list:
    """The nodes and how far they are."""
    return [(bare(node["id"]), node["distance_m"]) for node in body["nodes"]]


def telemetry_facts(body: dict) -> list:
    """What each drone was told."""
    told = body["positions"]
    return [
        (one.get("drone_id") or "", one["accepted"], [warning["code"] for warning in one["warnings"]]) for one in told
    ]


def page_facts(name: str) -> Callable[[dict], list]:
    """The ids on a page."""
    return lambda body: [bare(entry["id"]) for entry in body[name]]


@dataclasses.dataclass
class Scenario:
    """One request, as both dialects say it; what gRPC does not have, REST says alone."""

    name: str
    rest: tuple
    grpc: tuple | None = None
    # The code of the refusal; none: there is an answer, and its facts are compared.
    code: str | None = None
    facts: Callable[[dict], object] = report_facts
    # Codes of warnings that are among those of the answer.
    warnings: list | None = None


def reported(name: str, report: dict, grpc: dict | None = None, code=None, warnings=None) -> Scenario:
    """A report that leaves nothing behind; `grpc` is what that dialect says differently."""
    dry = {**report, "dry_run": True}
    call = (RECOMPOSITION, "ReportFailure", {**dry, **(grpc or {})})
    return Scenario(name, ("POST", "/v1/failures", dry), call, code, report_facts, warnings)


def over_rest(name: str, request: tuple, code=None, facts=None) -> Scenario:
    """What operators do, which gRPC does not have."""
    return Scenario(name, request, None, code, facts or report_facts)


def previewed(name: str, feature: dict, code=None) -> Scenario:
    """The preview of a zone."""
    return over_rest(name, ("POST", "/v1/zones:preview", feature), code, zone_facts)


def circle(centre: list, radius_m: float) -> tuple[dict, dict]:
    """A circle, as a feature and as a message."""
    geometry = {"type": "Point", "coordinates": centre}
    message = {"circle": {"centre": {"x": centre[0], "y": centre[1]}, "radius_m": radius_m}}
    return {"type": "Feature", "geometry": geometry, "properties": {"radius_m": radius_m}}, message


def polygon(ring: list) -> tuple[dict, dict]:
    """A polygon, likewise."""
    geometry = {"type": "Polygon", "coordinates": [ring]}
    positions = [{"x": x, "y": y} for x, y in ring]
    message = {"polygon": {"rings": [{"positions": positions}]}}
    return {"type": "Feature", "geometry": geometry, "properties": {}}, message


FEATURE, CIRCLE = circle(CENTRE, 60.0)
SQUARE_FEATURE, AREA = polygon(SQUARE)
REVERSED = [{"from": LONG_AGO, "until": LONGER_AGO}]
REVERSED_FEATURE = {**FEATURE, "properties": {**FEATURE["properties"], "windows": REVERSED}}
DELIVERY = {"source": "379", "destination": "62"}

# What is there before the first scenario.
SETTING = [
    ("POST", "/v1/zones", {**FEATURE, "id": ZONE}),
    ("POST", "/v1/closures", {"id": CLOSURE, "reason": "crane", "segments": ["389-408"]}),
    ("POST", "/v1/plans", {**DELIVERY, "id": PLAN}),
]

REPORTS = [
    reported("a leg by its nodes", {"service": LEG, "destination": "450"}, warnings=["missing_failure_type"]),
    reported("a remaining path", {"remaining_path": ["379", "406", "408", "450"]}),
    reported("a leg of a plan", {"service": {"plan_id": PLAN, "leg": 1}}),
    reported(
        "a strategy of the paper",
        {"service": LEG, "destination": "450", "strategy": "two_phased", "type": "regulatory"},
        {"strategy": "STRATEGY_TWO_PHASED", "type": "FAILURE_TYPE_REGULATORY"},
    ),
    reported(
        "a battery that runs out",
        {"service": LEG, "destination": "450", "type": "operational"},
        {"type": "FAILURE_TYPE_OPERATIONAL"},
    ),
    reported(
        "only a place",
        {"location": CENTRE},
        {"location": {"lon_lat": {"lon": CENTRE[0], "lat": CENTRE[1]}}},
        warnings=["leg_assumed"],
    ),
    reported("only a node", {"location": {"node": "406"}, "destination": "450"}),
    reported("a destination that is not there", {"service": LEG, "destination": "no-such"}),
    reported(
        "a plan that is not known",
        {"service": {**LEG, "plan_id": "no-such"}, "destination": "450"},
        warnings=["unknown_plan"],
    ),
    reported(
        "a time long ago",
        {"service": LEG, "destination": "450", "timestamp": LONG_AGO},
        warnings=["timestamp_doubtful"],
    ),
    reported(
        "an airspeed and a battery that cannot be",
        {"service": LEG, "destination": "450", "drone": {"airspeed_mps": -1.0, "battery_fraction": 62.0}},
        warnings=["airspeed_ignored", "battery_ignored"],
    ),
    reported(
        "an objective that is not computed", {"service": LEG, "objective": "energy"}, warnings=["objective_unsupported"]
    ),
    reported(
        "a zone that cannot be",
        {"service": LEG, "destination": "450", "zone": circle(CENTRE, -5.0)[0]},
        {"zone": circle(CENTRE, -5.0)[1]},
        warnings=["zone_ignored"],
    ),
    reported(
        "a zone whose window ends before it begins",
        {"service": LEG, "destination": "450", "zone": REVERSED_FEATURE},
        {"zone": {**CIRCLE, "windows": REVERSED}},
        warnings=["zone_ignored"],
    ),
    reported("a zone that can", {"service": LEG, "destination": "450", "zone": FEATURE}, {"zone": CIRCLE}),
    reported("an area", {"service": LEG, "destination": "450", "zone": SQUARE_FEATURE}, {"zone": AREA}),
    reported("nothing at all", {}, code="report_not_located"),
    reported("nodes that are not there", {"service": {"from": "x", "to": "y"}}, code="report_not_located"),
    Scenario(
        "a batch of which one says nothing",
        ("POST", "/v1/failures:batch", {"failures": [{"service": LEG, "dry_run": True}, {"dry_run": True}]}),
        (RECOMPOSITION, "ReportFailures", {"failures": [{"service": LEG, "dry_run": True}, {"dry_run": True}]}),
        facts=batch_facts,
    ),
]

ZONES = [
    previewed("a circle", FEATURE),
    previewed("a polygon", SQUARE_FEATURE),
    previewed("longitude and latitude swapped", circle(CENTRE[::-1], 60.0)[0], "zone_invalid"),
    previewed("a ring that is open", polygon(SQUARE[:-1])[0], "zone_invalid"),
    previewed(
        "a ring that crosses itself",
        polygon([SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3], SQUARE[0]])[0],
        "zone_invalid",
    ),
    previewed("a radius below nothing", circle(CENTRE, -60.0)[0], "zone_invalid"),
    previewed("a window that ends before it begins", REVERSED_FEATURE, "zone_invalid"),
    over_rest("a zone that is only checked", ("POST", "/v1/zones?validate_only=true", FEATURE), facts=zone_facts),
    over_rest("a zone that is there", ("POST", "/v1/zones", {**FEATURE, "id": ZONE}), "already_exists"),
    over_rest("a change without a version", ("PUT", f"/v1/zones/{ZONE}", FEATURE), "precondition_required"),
    over_rest(
        "a change of an old version", ("PUT", f"/v1/zones/{ZONE}", FEATURE, {"if-match": STALE}), "precondition_failed"
    ),
    over_rest("a change under another id", ("PUT", "/v1/zones/another", {**FEATURE, "id": ZONE}), "zone_invalid"),
    over_rest("a zone that was never there", ("GET", "/v1/zones/no-such"), "not_found"),
    over_rest("lifting a zone that is not there", ("DELETE", "/v1/zones/no-such"), "not_found"),
    over_rest(
        "lifting an old version", ("DELETE", f"/v1/zones/{ZONE}", None, {"if-match": STALE}), "precondition_failed"
    ),
    over_rest("a page that no page named", ("GET", "/v1/zones?page_token=never-given"), "parameter_invalid"),
]

CLOSURES = [
    over_rest("a closure", ("GET", f"/v1/closures/{CLOSURE}"), facts=closure_facts),
    over_rest("the closures", ("GET", "/v1/closures"), facts=page_facts("closures")),
    over_rest("a segment that is not there", ("POST", "/v1/closures", {"segments": ["1-1"]}), "closure_invalid"),
    over_rest("a closure of nothing", ("POST", "/v1/closures", {"reason": "none"}), "closure_invalid"),
    over_rest(
        "a closure that ends before it begins",
        ("POST", "/v1/closures", {"nodes": ["406"], "from": LONG_AGO, "until": LONGER_AGO}),
        "closure_invalid",
    ),
    over_rest("a closure that is there", ("POST", "/v1/closures", {"id": CLOSURE, "nodes": ["406"]}), "already_exists"),
    over_rest(
        "a change of an old closure",
        ("PATCH", f"/v1/closures/{CLOSURE}", {"confirmed": True}, {"if-match": STALE}),
        "precondition_failed",
    ),
    over_rest("lifting what a zone closes", ("DELETE", f"/v1/closures/{ZONE}"), "closure_of_zone"),
    over_rest("lifting what is open", ("DELETE", "/v1/closures/no-such"), "not_found"),
    over_rest("a proposal that was never made", ("POST", "/v1/proposals/no-such/accept"), "not_found"),
    over_rest("a hold that was never made", ("POST", "/v1/holds/no-such/reject"), "not_found"),
    over_rest("an answer that was never given", ("GET", "/v1/recompositions/no-such"), "not_found"),
    over_rest("a node", ("GET", "/v1/nodes/406"), facts=node_facts),
    over_rest("a node that is not there", ("GET", "/v1/nodes/no-such"), "not_found"),
]

REST_OF_IT = [
    Scenario("a plan", ("GET", f"/v1/plans/{PLAN}"), (PLANS, "GetPlan", {"id": PLAN}), facts=plan_facts),
    Scenario(
        "the plans", ("GET", "/v1/plans?page_size=1"), (PLANS, "ListPlans", {"page_size": 1}), facts=page_facts("plans")
    ),
    Scenario(
        "a page of nothing",
        ("GET", "/v1/plans?page_size=0"),
        (PLANS, "ListPlans", {"page_size": 0}),
        "parameter_invalid",
    ),
    Scenario(
        "a plan that is not there", ("GET", "/v1/plans/no-such"), (PLANS, "GetPlan", {"id": "no-such"}), "not_found"
    ),
    Scenario(
        "a plan that is there",
        ("POST", "/v1/plans", {**DELIVERY, "id": PLAN}),
        (PLANS, "CreatePlan", {**DELIVERY, "id": PLAN}),
        "already_exists",
    ),
    Scenario(
        "a plan from nowhere, too heavy",
        ("POST", "/v1/plans", {**DELIVERY, "source": "no-such", "payload_kg": 1e6}),
        (PLANS, "CreatePlan", {**DELIVERY, "source": "no-such", "payload_kg": 1e6}),
        "plan_invalid",
    ),
    Scenario(
        "a plan to a closed node",
        ("POST", "/v1/plans", {**DELIVERY, "destination": "406"}),
        (PLANS, "CreatePlan", {**DELIVERY, "destination": "406"}),
        "no_route",
    ),
    Scenario(
        "a version that was never sent",
        ("POST", f"/v1/plans/{PLAN}/ack", {"version": 7}),
        (PLANS, "AcknowledgePlan", {"id": PLAN, "version": 7}),
        "plan_state_conflict",
    ),
    Scenario(
        "the nearest nodes",
        ("GET", f"/v1/nearest?lon={CENTRE[0]}&lat={CENTRE[1]}&k=5"),
        (NETWORK, "Nearest", {"location": {"x": CENTRE[0], "y": CENTRE[1]}, "k": 5}),
        facts=nearest_facts,
    ),
    Scenario(
        "telemetry, of which one entry is nowhere",
        (
            "POST",
            "/v1/telemetry",
            {
                "positions": [
                    {"drone_id": "parity", "location": CENTRE},
                    {"drone_id": "lost", "location": {"node": "no-such"}},
                ]
            },
        ),
        (
            DRONES,
            "ReportTelemetry",
            {
                "positions": [
                    {"drone_id": "parity", "location": {"lon_lat": {"lon": CENTRE[0], "lat": CENTRE[1]}}},
                    {"drone_id": "lost", "location": {"node": "no-such"}},
                ]
            },
        ),
        facts=telemetry_facts,
    ),
    over_rest("the drones", ("GET", "/v1/drones"), facts=page_facts("drones")),
]

SCENARIOS = [*REPORTS, *ZONES, *CLOSURES, *REST_OF_IT]
