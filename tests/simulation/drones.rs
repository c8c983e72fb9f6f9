//! Drones that report failures to an edge and have plans composed, and what is seen of the edge beside them.

use crate::history::Version;
use crate::history::edges::{Route, crosses};
use crate::outpost::Outpost;
use crate::places::{draw_node, draw_segment, position_m};
use crate::rounds::Chance;
use serde_json::{Value, json};
use skyway::edge::{Edge, Idempotency};
use skyway::formats::parse_report;
use std::sync::Arc;
use std::time::Duration;

/// Asks an edge, and looks at it, until the run is over.
pub(crate) async fn fly(outpost: Arc<Outpost>) {
    let world = outpost.world.clone();
    let who = outpost.who();
    let mut chance = world.chance(who, 1);
    let mut number = 0;
    while !world.over.is_cancelled() {
        let pause = Duration::from_millis(chance.below(600));
        world.pause(who, pause).await;
        let Some(edge) = outpost.edge() else {
            continue;
        };
        // What is due happens with the next order, as nothing here sleeps for it.
        edge.tick().await.expect("the writer works");
        number += 1;
        match chance.below(5) {
            0 => look(&outpost),
            1 => compose(&outpost, &edge, number, &mut chance).await,
            2 => report(&outpost, &edge, false, &mut chance).await,
            _ => report(&outpost, &edge, true, &mut chance).await,
        }
    }
}

fn look(outpost: &Outpost) {
    let world = &outpost.world;
    if let Some(sight) = outpost.sight() {
        let (at, count, waiting) = (sight.at, sight.zones.len(), sight.waiting.len());
        let text = format!("has {at}, {count} zones, {waiting} waiting");
        world.tell(outpost.who(), text);
        world.notes().sights.push(sight);
    }
}

async fn report(outpost: &Outpost, edge: &Arc<Edge>, dry_run: bool, chance: &mut Chance) {
    let (from, to) = draw_segment(chance);
    let (destination, kind) = (draw_node(chance), chance.below(2));
    let failure = ["environmental", "navigational"][kind as usize];
    let body = json!({
        "service": {"from": from, "to": to}, "destination": destination, "dry_run": dry_run,
        "failure": failure, "drone": {"id": format!("drone-{}", chance.below(5))},
    });
    let parsed = parse_report(body.to_string().as_bytes()).expect("a report");
    let answered = match edge.report_failure(&outpost.caller, parsed).await {
        Ok(answered) => serde_json::to_value(answered.to_wire()).expect("JSON"),
        Err(refusal) => {
            let text = format!("a report is refused: {refusal}");
            return outpost.world.tell(outpost.who(), text);
        }
    };
    // What a report closes is no zone: the zones in force are those that it was worked out on.
    note(
        outpost,
        edge,
        &answered["registry_revision"],
        &answered["path"]["nodes"],
    );
}

async fn compose(outpost: &Outpost, edge: &Arc<Edge>, number: u64, chance: &mut Chance) {
    let id = format!("plan-{}-{}-{number}", outpost.number, outpost.begun());
    let (source, destination) = (draw_node(chance), draw_node(chance));
    let request = json!({"id": id, "drone_id": id, "source": source, "destination": destination});
    let request = serde_json::from_value(request).expect("a delivery request");
    let caller = &outpost.caller;
    match edge
        .compose_plan(caller, request, Idempotency::default())
        .await
    {
        Ok(plan) => {
            let plan = serde_json::to_value(plan).expect("JSON");
            let nodes = &plan["reported"]["path"]["nodes"];
            if plan["revision"] != *edge.stamp().revision {
                // It was not answered until it was stored, and something has changed since.
                return;
            }
            note(outpost, edge, &plan["registry_revision"], nodes);
        }
        Err(refusal) => {
            let text = format!("a plan is refused: {refusal}");
            outpost.world.tell(outpost.who(), text);
        }
    }
}

/// Notes the way that was answered, and holds it against what is in force here.
fn note(outpost: &Outpost, edge: &Arc<Edge>, revision: &Value, nodes: &Value) {
    let world = &outpost.world;
    if !outpost.edge().is_some_and(|up| Arc::ptr_eq(&up, edge)) {
        // It has crashed before anyone heard of it.
        return;
    }
    let ids = nodes.as_array().into_iter().flatten();
    let line_m: Vec<[f64; 2]> = ids.filter_map(Value::as_str).map(position_m).collect();
    let at = revision.as_str().and_then(Version::read);
    world.tell(outpost.who(), format!("answers by {revision}: {nodes}"));
    world.count("routes");
    let (Some(at), Some(sight)) = (at, outpost.sight()) else {
        return;
    };
    for (id, tag) in &sight.zones {
        let shape = world.notes().shapes.get(tag).copied();
        if shape.is_some_and(|shape| crosses(&line_m, shape)) {
            let name = outpost.name();
            world.violation(format!(
                "{name} answered a route through zone {id} ({tag}), which is in force there"
            ));
        }
    }
    // What waited when an answer was worked out is known only as long as the edge has read nothing since: an answer
    // that was stored first may come later.
    if at == sight.at {
        world.notes().routes.push(Route {
            edge: sight.edge.clone(),
            moment: sight.moment,
            at,
            line_m,
            lifted: sight.waiting.keys().cloned().collect(),
        });
    } else {
        world.count("routes of earlier revisions");
    }
    world.notes().sights.push(sight);
}
