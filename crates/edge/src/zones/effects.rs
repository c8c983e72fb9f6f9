//! What a zone or closure closes and which plans it meets, as clients see it.

use crate::plans::fleet::Detour;
use crate::views::{IDS_MAX, PLANS_TOLD_MAX, affected_plan};
use crate::words::{instant, node_ids, segment_ids};
use skyway_contract as wire;
use skyway_engine::airspace::{Airspace, Closure};
use skyway_formats::miss_hint;
use std::borrow::Cow;

/// What a closure that has been put closes, and whom it meets: those whose drones were told something, and how many wait.
pub(crate) fn effect_with_pending(
    airspace: &Airspace,
    closure: &Closure,
    (detours, pending): (&[&Detour], usize),
) -> wire::ZoneEffect<'static> {
    let effect = effect(airspace, closure, detours);
    let plan_count = effect.plan_count + pending;
    let rest = format!("/v1/plans?affected_by={}", escaped(&closure.id));
    wire::ZoneEffect {
        plan_count,
        pending,
        next: (plan_count > effect.plans.len()).then_some(Cow::Owned(rest)),
        ..effect
    }
}

/// An id in a query (RFC 3986, 2.3): everything but unreserved characters is escaped.
fn escaped(id: &str) -> String {
    let mut text = String::with_capacity(id.len());
    for byte in id.bytes() {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' => {
                text.push(char::from(byte));
            }
            other => text.push_str(&format!("%{other:02X}")),
        }
    }
    text
}

/// What a closure closes, and whom it meets.
pub(crate) fn effect(
    airspace: &Airspace,
    closure: &Closure,
    detours: &[&Detour],
) -> wire::ZoneEffect<'static> {
    let topology = airspace.topology();
    let (segments, nodes) = (&closure.hits.segments, &closure.hits.nodes);
    let told = detours.iter().take(PLANS_TOLD_MAX);
    let meets_nothing = segments.is_empty() && nodes.is_empty();
    let zone = closure.zone().filter(|_| meets_nothing);
    wire::ZoneEffect {
        in_force: airspace.is_active(closure, airspace.as_of()),
        closes_from: airspace.closes_from(closure, airspace.as_of()).map(instant),
        segment_count: segments.len(),
        segments: segment_ids(topology, &segments[..segments.len().min(IDS_MAX)]),
        node_count: nodes.len(),
        nodes: node_ids(topology, &nodes[..nodes.len().min(IDS_MAX)]),
        plan_count: detours.len(),
        plans: told.map(|detour| affected_plan(topology, detour)).collect(),
        hint: zone.map(|zone| match zone.terms().closes() {
            true => Cow::Owned(miss_hint(zone, topology)),
            false => Cow::Borrowed(
                "it is shown and closes nothing, as its kind or its authorization says",
            ),
        }),
        pending: 0,
        next: None,
    }
}
