//! The network changes while plans are flown, zones stand and reports are answered.

use crate::stage::{Stage, circle, ladder, loaded, names, node, segment, without};
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::edge::{Code, Decision, NewNetwork, PageRequest, Settings};
use skyway::network::{NetworkDraft, NodeDraft, Topology};
use skyway::wire::{Ack, EventKind, PlanFlag};
use std::sync::Arc;
use tokio_stream::StreamExt;

fn nodes_of(answer: &Value) -> Vec<&str> {
    let nodes = answer["path"]["nodes"].as_array().expect("nodes");
    nodes.iter().filter_map(Value::as_str).collect()
}

#[tokio::test]
async fn a_plan_whose_node_ahead_goes_is_recomposed_and_those_elsewhere_fly_on() {
    let stage = Stage::set();
    stage.compose("met", "d1", "a0", "a7").await;
    let free = stage.compose("free", "d2", "b0", "b2").await;
    stage.see("d1", 250.0, 0.0).await;
    let mut events = stage.edge.events(None).expect("a stream");
    let revision = stage.edge.stamp().revision;
    stage.rebuild(|draft| without(draft, "a5")).await;
    let stamp = stage.edge.stamp();
    assert_eq!(
        (stamp.topology_revision, stamp.revision == revision),
        (2, false)
    );

    let met = stage.plan("met");
    assert_eq!(met.flags, [PlanFlag::Affected]);
    assert_eq!(met.reported.version, 1);
    let left = names(&met.reported.path.nodes);
    assert_eq!(left, ["a0", "a1", "a2", "a3", "a4"], "what is left of it");
    let proposed = met.wanted.expect("a way round");
    let nodes = names(&proposed.path.nodes);
    assert_eq!(nodes.last().map(String::as_str), Some("a7"));
    assert!(!nodes.contains(&"a5".to_owned()), "{nodes:?}");
    assert_eq!(nodes[0], "a3", "from where its drone is: {nodes:?}");

    let now = stage.plan("free");
    assert_eq!((now.flags.len(), &now.wanted), (0, &None));
    assert_eq!(now.reported.path, free.reported.path);
    assert_eq!(now.reported.length_m, free.reported.length_m);
    assert_eq!(now.reported.arrives_at, free.reported.arrives_at);

    let first = events.next().await.expect("more").expect("no gap");
    assert_eq!(first.kind, EventKind::NetworkChanged);
    assert_eq!(first.event.data["nodes"], 15);
    let second = events.next().await.expect("more").expect("no gap");
    assert_eq!(second.kind, EventKind::PlanAffected);
    let ack = Ack {
        version: proposed.version,
        ..Ack::default()
    };
    let taken = stage.edge.acknowledge_plan(&stage.caller, "met", ack).await;
    assert!(taken.expect("taken over").flags.is_empty());
}

#[tokio::test]
async fn a_drone_whose_leg_is_taken_away_is_told_a_way_from_its_place() {
    let stage = Stage::set();
    stage.compose("p", "d1", "a0", "a7").await;
    stage.see("d1", 240.0, 0.0).await;
    stage
        .rebuild(|draft| {
            draft
                .segments
                .retain(|segment| !(segment.from == "a2" && segment.to == "a3"))
        })
        .await;
    let plan = stage.plan("p");
    assert_eq!(plan.flags, [PlanFlag::Affected]);
    let proposed = plan.wanted.expect("a way");
    assert_eq!(
        proposed.path, plan.reported.path,
        "nothing is left of the old one"
    );
    assert!(proposed.version > plan.reported.version);
    assert_eq!(
        names(&proposed.path.nodes).last().map(String::as_str),
        Some("a7")
    );
    // A zone on the new way is met as on any other.
    stage.zone(circle("fire", 550.0, 0.0, 10.0)).await;
    let again = stage.plan("p").wanted.expect("another way");
    assert!(!again.path.segments.contains(&"a5-a6".into()), "{again:?}");
    // When it goes, the drone still has to say that it flies the way it was told.
    let zone = stage.edge.zone(&stage.caller, "fire").expect("a zone");
    let write = skyway::edge::ZoneWrite {
        id: Some("fire".to_owned()),
        if_match: Some(zone.1),
        ..Default::default()
    };
    stage
        .edge
        .delete_zone(&stage.caller, write, None)
        .await
        .expect("deleted");
    assert_eq!(stage.plan("p").flags, [PlanFlag::Affected]);
    let ack = Ack {
        version: again.version,
        ..Ack::default()
    };
    let taken = stage.edge.acknowledge_plan(&stage.caller, "p", ack).await;
    assert!(taken.expect("taken over").flags.is_empty());
}

#[tokio::test]
async fn a_plan_whose_destination_goes_is_ended_with_the_reason() {
    let stage = Stage::set();
    stage.compose("p", "d1", "a0", "a7").await;
    let mut events = stage.edge.events(None).expect("a stream");
    stage.rebuild(|draft| without(draft, "a7")).await;
    let mut ended = None;
    while ended.is_none() {
        let event = events.next().await.expect("more").expect("no gap");
        ended = (event.kind == EventKind::PlanEnded).then_some(event);
    }
    let data = &ended.expect("told").event.data;
    assert_eq!(data["why"], "source_or_destination_gone");
    assert_eq!(data["plan"]["reported"]["nodes"][7], "a7");
    let plan = stage.edge.plan(&stage.caller, "p");
    assert_eq!(plan.expect_err("it is forgotten").code, Code::NotFound);
    stage.compose("next", "d1", "a0", "a6").await;
}

#[tokio::test]
async fn plans_on_both_sides_of_the_change_still_conflict() {
    let stage = Stage::set();
    stage.compose("east", "d1", "a0", "a3").await;
    stage.rebuild(|draft| without(draft, "b7")).await;
    let west = stage.compose("west", "d2", "a3", "a0").await;
    assert_eq!(&*west.conflicts[0].plan_id, "east");
    stage
        .edge
        .cancel_plan(&stage.caller, "east", Default::default())
        .await
        .expect("cancelled");
    assert!(stage.plan("west").conflicts.is_empty());
}

#[tokio::test]
async fn a_zone_closes_what_is_built_under_it_and_plans_meet_it() {
    let stage = Stage::set();
    stage.zone(circle("park", 350.0, 50.0, 20.0)).await;
    let question =
        json!({"service": {"from": "a2", "to": "a3"}, "destination": "b5", "dry_run": true});
    let over_b3 = stage.answer(question.clone()).await;
    stage
        .rebuild(|draft| {
            draft.nodes.push(node("x", 350.0, 50.0));
            draft.segments.push(segment("a3", "x"));
            draft.segments.push(segment("x", "b4"));
        })
        .await;
    let zone = stage
        .edge
        .closure(&stage.caller, "park")
        .expect("its closure");
    assert_eq!(zone.segments, ["a3-x", "b4-x"]);
    let stands = stage.edge.node("x").expect("a node");
    assert!(stands.closed);
    let answer = stage.answer(question).await;
    assert!(!nodes_of(&answer).contains(&"x"), "{answer}");
    assert_eq!(answer["remaining_length_m"], over_b3["remaining_length_m"]);
}

#[tokio::test]
async fn a_zone_that_comes_to_lie_on_a_way_affects_the_plan_and_is_named() {
    let stage = Stage::set();
    stage
        .rebuild(|draft| {
            draft.nodes.push(NodeDraft {
                pads: 1,
                ..node("roof", 350.0, 400.0)
            })
        })
        .await;
    stage.compose("p", "d1", "a0", "a7").await;
    // Of a segment's line only: the zone closes it when its ends come to lie on two sides.
    stage.zone(circle("mast", 450.0, -60.0, 20.0)).await;
    assert!(stage.plan("p").flags.is_empty());
    stage
        .rebuild(|draft| {
            let moved = draft
                .nodes
                .iter_mut()
                .find(|node| node.id == "a5")
                .expect("a node");
            moved.position = [500.0, -120.0];
        })
        .await;
    let plan = stage.plan("p");
    assert_eq!(plan.flags, [PlanFlag::Affected]);
    let proposed = plan.wanted.expect("a way round");
    assert!(
        !proposed.path.segments.contains(&"a4-a5".into()),
        "{proposed:?}"
    );
}

#[tokio::test]
async fn closures_keep_what_is_left_of_them_and_stay_when_nothing_is() {
    let stage = Stage::set();
    let draft = json!({"id": "works", "segments": ["a1-a2", "a5-a6"], "pads": ["a7"]});
    let close = |draft: Value| serde_json::from_value(draft).expect("a draft");
    let closed = stage
        .edge
        .close(&stage.caller, close(draft), Default::default())
        .await;
    closed.expect("closed");
    let draft = json!({"id": "one", "segments": ["a5-a6"]});
    let closed = stage
        .edge
        .close(&stage.caller, close(draft), Default::default())
        .await;
    closed.expect("closed");
    stage.rebuild(|draft| without(draft, "a5")).await;
    let works = stage
        .edge
        .closure(&stage.caller, "works")
        .expect("it stands");
    assert_eq!(
        (works.segments, names(&works.pads)),
        (vec!["a1-a2".into()], vec!["a7".to_owned()])
    );
    assert!(stage.edge.node("a7").expect("a node").pads_closed);
    let one = stage
        .edge
        .closure(&stage.caller, "one")
        .expect("it is listed");
    assert_eq!(one.segment_count, 0);
}

#[tokio::test]
async fn quotas_and_proposals_of_reports_follow_the_network() {
    let stage = Stage::set();
    for (drone, place) in [("d1", 1), ("d2", 5)] {
        stage.see(drone, f64::from(place) * 100.0 + 50.0, 0.0).await;
        let (from, to) = (format!("a{place}"), format!("a{}", place + 1));
        let report = json!({"type": "navigational", "service": {"from": from, "to": to},
            "location": {"x": f64::from(place) * 100.0 + 50.0, "y": 0.0}, "destination": "a7", "drone": {"id": drone}});
        let answer = stage.answer(report).await;
        assert_eq!(answer["publication"]["state"], "published", "{answer}");
    }
    let anonymous =
        json!({"type": "navigational", "service": {"from": "b5", "to": "b6"}, "destination": "b7"});
    let proposed = stage.answer(anonymous).await;
    assert_eq!(proposed["publication"]["state"], "proposed");
    stage.rebuild(|draft| without(draft, "a5")).await;
    let gone = stage
        .edge
        .closure(&stage.caller, "report:a5-a6")
        .expect("listed");
    assert_eq!(gone.segment_count, 0);
    let page = PageRequest::default();
    let proposal = stage
        .edge
        .proposals(&stage.caller, &page)
        .expect("a list")
        .proposals
        .remove(0);
    assert_eq!(proposal.segments, ["b5-b6"]);
    let accepted = stage
        .edge
        .decide_proposal(&stage.caller, &proposal.id, Decision::Accept)
        .await;
    accepted.expect("accepted");
    let closure = stage
        .edge
        .closure(&stage.caller, "report:b5-b6")
        .expect("closed");
    assert_eq!(closure.segments, ["b5-b6"]);
}

/// A report and a change of the network at once; the answer, where it was given on the network before.
async fn answered_beside_a_change(stage: &Stage) -> Option<Value> {
    stage.compose("p", "d1", "a0", "a7").await;
    stage.see("d1", 150.0, 0.0).await;
    let report = json!({"type": "navigational", "service": {"plan_id": "p", "leg": 1}, "location": {"x": 150.0, "y": 0.0}, "drone": {"id": "d1"}});
    let parsed = skyway::formats::parse_report(report.to_string().as_bytes()).expect("a report");
    let before = stage.edge.stamp().topology_revision;
    let change = stage.edge.replace_network(loaded(&renumbered()));
    let (change, answered) = tokio::join!(change, stage.edge.report_failure(&stage.caller, parsed));
    change.expect("put into service");
    stage.settle().await;
    let told = serde_json::to_value(answered.expect("an outcome").to_wire()).expect("JSON");
    Some(told).filter(|told| told["topology_revision"] == before)
}

#[tokio::test]
async fn a_report_under_way_on_the_old_network_spoils_nothing_on_the_new() {
    // The writer may have put the new network into service before the report is looked at; that is another story.
    for _ in 0..100 {
        let stage = Stage::set();
        if let Some(told) = answered_beside_a_change(&stage).await {
            // Its orders have waited behind the change.
            let closure = stage.edge.closure(&stage.caller, "report:a1-a2");
            assert_eq!(closure.expect("published").segments, ["a1-a2"], "{told}");
            // Source gone: the plan is ended; the answer is still explained on the network that it was given on.
            let id = told["id"].as_str().expect("an id");
            let record = stage.edge.recomposition(&stage.caller, id, true).await;
            let record = serde_json::to_value(record.expect("kept").to_wire()).expect("JSON");
            return assert_eq!(record["answer"]["path"], told["path"]);
        }
    }
    panic!("no report was answered before the change");
}

/// A network beside which all indices are others: nodes go, and the order along the curve changes.
pub(crate) fn renumbered() -> NetworkDraft {
    let mut draft = ladder();
    without(&mut draft, "a0");
    without(&mut draft, "b7");
    draft.nodes.push(node("far", 2_000.0, 3_000.0));
    draft
}

#[tokio::test]
async fn a_stored_answer_is_given_again_only_on_its_network() {
    let stage = Stage::set();
    let report = json!({"id": "r1", "type": "navigational", "service": {"from": "a1", "to": "a2"}, "destination": "a4"});
    let first = stage.answer(report.clone()).await;
    assert_eq!(stage.answer(report.clone()).await["replayed"], true);
    stage.rebuild(|draft| without(draft, "b7")).await;
    let again = stage.answer(report).await;
    assert_eq!(again["replayed"], false);
    assert_eq!(again["remaining_length_m"], first["remaining_length_m"]);
}

#[tokio::test]
async fn answers_are_kept_over_a_few_networks_and_not_over_many() {
    let stage = Stage::set();
    let report = json!({"type": "navigational", "service": {"from": "a1", "to": "a2"}, "destination": "a4", "dry_run": true});
    let mut ids = Vec::new();
    for step in 0..5 {
        let answer = stage.answer(report.clone()).await;
        ids.push(answer["id"].as_str().expect("an id").to_owned());
        stage
            .rebuild(|draft| draft.nodes.push(node(&format!("n{step}"), 50.0, 500.0)))
            .await;
    }
    stage.answer(report).await;
    let mut kept = Vec::new();
    for id in &ids {
        let found = stage.edge.recomposition(&stage.caller, id, false).await;
        kept.push(found.is_ok());
    }
    assert_eq!(kept, [false, false, true, true, true]);
}

#[tokio::test]
async fn sightings_stay_where_they_were_when_the_plane_moves() {
    // Degrees: a node far away moves the plane's origin by kilometres.
    let mut draft = ladder();
    draft.coordinates = skyway::network::Coordinates::Geographic;
    for node in &mut draft.nodes {
        node.position = [
            8.0 + node.position[0] / 71_000.0,
            50.0 + node.position[1] / 111_000.0,
        ];
    }
    let network = loaded(&draft);
    let settings = Settings {
        closed_fraction_max: 0.5,
        ..Settings::default()
    };
    let stage = Stage::on(network.topology, network.geojson, settings);
    let place = 8.0 + 350.0 / 71_000.0;
    let zone = json!({"type": "Feature", "id": "fire",
        "geometry": {"type": "Point", "coordinates": [8.0 + 650.0 / 71_000.0, 50.0]},
        "properties": {"radius_m": 10.0, "margin_m": 0}});
    stage.zone(zone).await;
    stage.see_at("d1", json!([place, 50.0])).await;
    stage
        .rebuild(|draft| draft.nodes.push(node("far", 8.4, 50.3)))
        .await;
    let fire = stage
        .edge
        .closure(&stage.caller, "fire")
        .expect("it stands");
    assert_eq!(fire.segments, ["a6-a7"], "the same ground on another plane");
    let report = json!({"type": "navigational", "service": {"from": "a3", "to": "a4"}, "destination": "a5", "drone": {"id": "d1"}});
    let answer = stage.answer(report).await;
    assert_eq!(answer["publication"]["state"], "published", "{answer}");
}

#[tokio::test]
async fn an_edge_without_a_network_is_not_ready_until_it_gets_one() {
    let nothing = Arc::new(Topology::nothing());
    let stage = Stage::on(nothing, Default::default(), Settings::default());
    assert!(!stage.edge.is_ready());
    let report = stage
        .report(json!({"service": {"from": "a1", "to": "a2"}, "destination": "a4"}))
        .await;
    let refusal = report.expect_err("no network");
    assert_eq!(
        (refusal.code, refusal.retry_after_s),
        (Code::NotReady, Some(1))
    );
    let delivery = serde_json::from_value(json!({"source": "a0", "destination": "a1"}));
    let delivery = delivery.expect("a request");
    let refused = stage
        .edge
        .compose_plan(&stage.caller, delivery, Default::default())
        .await;
    assert_eq!(refused.expect_err("no network").code, Code::NotReady);
    let feature = circle("z", 0.0, 0.0, 5.0);
    let refused = stage.edge.preview_zone(&stage.caller, feature).await;
    assert_eq!(refused.expect_err("no network").code, Code::NotReady);
    for refused in [
        stage.edge.network_geojson().map(drop),
        stage.edge.network_compact().map(drop),
        stage.edge.nearest([0.0, 0.0], 1).map(drop),
        stage.edge.node("a0").map(drop),
        stage
            .edge
            .telemetry(&stage.caller, Default::default())
            .await
            .map(drop),
        stage
            .edge
            .report_failures(&stage.caller, Vec::new())
            .await
            .map(drop),
    ] {
        assert_eq!(refused.expect_err("no network").code, Code::NotReady);
    }
    let page = PageRequest::default();
    assert!(
        stage
            .edge
            .zones(&stage.caller, &page)
            .expect("a list")
            .features
            .is_empty()
    );
    assert_eq!(stage.edge.status().nodes, 0);

    let mut ready = Box::pin(stage.edge.ready());
    assert!(futures_now(&mut ready).await.is_none());
    let empty = NewNetwork::new(Arc::new(Topology::nothing()), Default::default());
    let refused = stage.edge.replace_network(empty).await;
    assert_eq!(refused.expect_err("no nodes").code, Code::NetworkInvalid);
    stage
        .edge
        .replace_network(loaded(&ladder()))
        .await
        .expect("put into service");
    ready.await;
    stage.compose("p", "d1", "a0", "a7").await;
    stage.pass(SignedDuration::from_secs(1)).await;
}

/// What a future gives at once, if anything.
async fn futures_now<T>(future: &mut (impl Future<Output = T> + Unpin)) -> Option<T> {
    std::future::poll_fn(|context| {
        std::task::Poll::Ready(match std::pin::Pin::new(&mut *future).poll(context) {
            std::task::Poll::Ready(value) => Some(value),
            std::task::Poll::Pending => None,
        })
    })
    .await
}

#[tokio::test]
async fn metres_do_not_take_the_place_of_degrees() {
    let stage = Stage::set();
    let mut draft = ladder();
    draft.coordinates = skyway::network::Coordinates::Geographic;
    for node in &mut draft.nodes {
        node.position = [node.position[0] / 100_000.0, node.position[1] / 100_000.0];
    }
    let refused = stage.edge.replace_network(loaded(&draft)).await;
    assert_eq!(refused.expect_err("degrees").code, Code::NetworkInvalid);
    let revision = stage.edge.stamp().revision;
    stage
        .edge
        .replace_network(loaded(&ladder()))
        .await
        .expect("the same network");
    assert_eq!(
        stage.edge.stamp().revision,
        revision,
        "the same network changes nothing"
    );
}
