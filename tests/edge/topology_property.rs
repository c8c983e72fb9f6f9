//! After any changes of the network, an edge stands as one that was started on the last network with the same zones.

use crate::stage::{Stage, circle, ladder, loaded, names, node, segment, without};
use serde_json::{Value, json};
use skyway::edge::{PageRequest, Settings};
use skyway::formats::read_network;
use skyway::network::NetworkDraft;

/// How many stories; the seed of each is its number.
const STORIES: u64 = 60;

/// Numbers from a seed, the same everywhere (SplitMix64).
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }
}

/// Something else in the network: a node that goes, moves or comes, a segment that goes or comes.
fn patch(draft: &mut NetworkDraft, draw: &mut Draw, step: usize) {
    let picked = draw.below(draft.nodes.len());
    let id = draft.nodes[picked].id.clone();
    match draw.below(5) {
        0 if draft.nodes.len() > 6 => without(draft, &id),
        1 => {
            let position = &mut draft.nodes[picked].position;
            position[0] += draw.below(60) as f64 + 1.0;
        }
        2 => {
            let (x, y) = (draw.below(700) as f64, draw.below(300) as f64 + 0.5);
            let new = format!("n{step}-{}", draw.below(1_000_000));
            draft.nodes.push(node(&new, x, y));
            draft.segments.push(segment(new, id));
        }
        3 if draft.segments.len() > 4 => {
            let gone = draw.below(draft.segments.len());
            draft.segments.remove(gone);
        }
        _ => {
            let other = draft.nodes[draw.below(draft.nodes.len())].id.clone();
            let joins = |segment: &skyway::network::SegmentDraft| {
                let ends = [&segment.from, &segment.to];
                ends.contains(&&id) && ends.contains(&&other)
            };
            if id != other && !draft.segments.iter().any(joins) {
                draft.segments.push(segment(id, other));
            }
        }
    }
}

/// All closures as clients see them, without their versions.
fn closures(stage: &Stage) -> Vec<Value> {
    let page = PageRequest::default();
    let listed = stage
        .edge
        .closures(&stage.caller, &page)
        .expect("a list")
        .closures;
    let told = listed.into_iter().map(|closure| {
        let mut told = serde_json::to_value(closure).expect("JSON");
        told["etag"] = Value::Null;
        told
    });
    told.collect()
}

/// The answers to a report at each segment, as far as the world makes them.
async fn answers(stage: &Stage, draft: &NetworkDraft) -> Vec<Value> {
    let destination = &draft.nodes[0].id;
    let mut told = Vec::new();
    for segment in &draft.segments {
        let report = json!({"type": "navigational", "service": {"from": segment.from, "to": segment.to},
            "destination": destination, "dry_run": true});
        let answer = stage.answer(report).await;
        // Of ways that are equally long an edge with other tables may take another one.
        let length_m = answer["remaining_length_m"].as_f64();
        let length_mm = length_m.map(|length_m| (length_m * 1e3).round());
        told.push(json!([answer["outcome"], length_mm]));
    }
    told
}

#[tokio::test]
async fn an_edge_after_changes_is_as_one_started_on_the_last_network() {
    for seed in 0..STORIES {
        let mut draw = Draw(seed);
        let changed = Stage::set();
        let mut zones = Vec::new();
        let mut draft = ladder();
        // Tables and plans from before are in the way of nothing.
        changed.compose("p", "d1", "a0", "a7").await;
        for step in 0..6 {
            if step % 2 == 0 {
                let (x, y) = (draw.below(700) as f64, draw.below(150) as f64);
                let zone = circle(&format!("z{step}"), x, y, draw.below(40) as f64 + 5.0);
                changed.zone(zone.clone()).await;
                zones.push(zone);
            }
            for _ in 0..=draw.below(3) {
                patch(&mut draft, &mut draw, step);
            }
            // As it is written and read, which is what both edges have.
            draft = read_network(&skyway::formats::write_network(&draft)).expect("a network");
            let replaced = changed.edge.replace_network(loaded(&draft)).await;
            replaced.unwrap_or_else(|refusal| panic!("seed {seed}, step {step}: {refusal}"));
            let _ = answers(&changed, &draft).await;
        }
        let network = loaded(&draft);
        let fresh = Stage::on(network.topology, network.geojson, Settings::default());
        for zone in zones {
            fresh.zone(zone).await;
        }
        assert_eq!(closures(&changed), closures(&fresh), "seed {seed}");
        let (one, other) = (
            answers(&changed, &draft).await,
            answers(&fresh, &draft).await,
        );
        assert_eq!(one, other, "seed {seed}");
        let blocked = |stage: &Stage| stage.edge.status().blocked_segments;
        assert_eq!(blocked(&changed), blocked(&fresh), "seed {seed}");
    }
}

#[tokio::test]
async fn contingencies_lead_over_nothing_that_is_gone() {
    let stage = Stage::set();
    let before = stage.compose("p", "d1", "a0", "a3").await;
    let detour = |plan: &skyway::wire::Plan<'_>| {
        let detour = plan.reported.legs[1].if_closed.as_ref();
        names(&detour.expect("worked out").nodes)
    };
    assert_eq!(detour(&before), ["a1", "b1", "b2", "a2"]);
    stage.rebuild(|draft| without(draft, "b2")).await;
    stage.settle().await;
    let after = stage.plan("p");
    assert!(after.flags.is_empty(), "its own way is as it was");
    let detour = detour(&after);
    assert!(!detour.contains(&"b2".to_owned()), "{detour:?}");
}
