//! An edge that ends, or is ended, and starts again.

use crate::memory_disk::MemoryDisk;
use crate::stage::{EPOCH, Stage, circle, names, network};
use crate::store_file::Medium;
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::clock::Clock;
use skyway::edge::{
    AlarmFilter, Caller, Code, Decision, Edge, FeedImport, Idempotency, OpenError, Opening,
    PageRequest, PlanFilter, Settings, StoreFault, StoreFile, ZoneWrite,
};
use skyway::formats::load_network;
use skyway::wire::{EndedAs, PlanFlag, PlanState};
use std::sync::Arc;

/// All that clients can list, without what changes from one start to the next.
fn told(stage: &Stage) -> Value {
    let page = PageRequest::default();
    let (edge, caller) = (&stage.edge, &stage.caller);
    let mut lists = [
        serde_json::to_value(edge.zones(caller, &page).expect("zones")),
        serde_json::to_value(edge.closures(caller, &page).expect("closures")),
        serde_json::to_value(edge.proposals(caller, &page).expect("proposals")),
        serde_json::to_value(edge.holds(caller, &page).expect("holds")),
        serde_json::to_value(
            edge.alarms(caller, &page, AlarmFilter::default())
                .expect("alarms"),
        ),
        serde_json::to_value(
            edge.plans(caller, &page, &PlanFilter::default())
                .expect("plans"),
        ),
    ]
    .map(|list| list.expect("JSON"));
    for list in &mut lists {
        let list = list.as_object_mut().expect("an object");
        list.remove("revision");
        for plan in list
            .get_mut("plans")
            .and_then(Value::as_array_mut)
            .into_iter()
            .flatten()
        {
            plan.as_object_mut().expect("a plan").remove("revision");
        }
    }
    json!({
        "lists": lists,
        "zone": edge.zone(caller, "crane").map(|(feature, etag)| json!([feature, etag])).ok(),
        "blocked": edge.status().blocked_segments,
        "unacknowledged": edge.status().plans_unacknowledged,
    })
}

async fn close_pads(stage: &Stage, id: &str) {
    let draft = serde_json::from_value(json!({"id": id, "pads": ["b7"], "reason": "works"}));
    let closed = stage.edge.close(
        &stage.caller,
        draft.expect("a draft"),
        Idempotency::default(),
    );
    closed.await.expect("a closure");
}

/// Something of every kind.
async fn live(stage: &Stage) {
    stage.compose("p1", "d1", "a0", "a4").await;
    stage.compose("p2", "d2", "b7", "b3").await;
    stage.compose("p3", "d3", "a7", "a6").await;
    stage
        .edge
        .cancel_plan(&stage.caller, "p3", Default::default())
        .await
        .expect("cancelled");
    stage.zone(circle("crane", 650.0, 0.0, 10.0)).await;
    let mut windowed = circle("show", 450.0, 100.0, 10.0);
    windowed["properties"]["windows"] =
        json!([{"from": "2026-11-21T07:30:00Z", "until": "2026-11-21T08:00:00Z"}]);
    stage.zone(windowed).await;
    close_pads(stage, "works").await;
    let report = json!({"type": "navigational", "drone": {"id": "d1"}, "service": {"plan_id": "p1", "leg": 0}});
    let answer = stage.answer(report).await;
    assert_eq!(answer["publication"]["state"], "published", "{answer}");
    let brought = json!({"type": "regulatory", "service": {"from": "a3", "to": "a4"}, "destination": "a7",
        "zone": circle("brought", 300.0, 0.0, 5.0)});
    let answer = stage.answer(brought).await;
    assert!(
        !answer["publication"]["proposal_ids"]
            .as_array()
            .expect("ids")
            .is_empty(),
        "{answer}"
    );
    import_refused(stage).await;
    stage.settle().await;
}

/// A feed whose only zone is refused, of which the shape is proposed.
async fn import_refused(stage: &Stage) {
    let mut odd = circle("odd", 650.0, 100.0, 5.0);
    odd["properties"]["upper_m"] = json!("high");
    let import = FeedImport {
        feed: "city".to_owned(),
        ..FeedImport::default()
    };
    let told = stage
        .edge
        .import_zones(&stage.caller, odd.to_string(), import);
    assert_eq!(told.await.expect("read").counts.proposed, 1);
}

/// For a while every node is closed, so that no drone has a way.
async fn alarm(stage: &Stage) {
    let topology = stage.edge.topology();
    let nodes: Vec<&str> = topology
        .nodes()
        .map(|node| topology.node_id(node))
        .collect();
    let draft = serde_json::from_value(json!({"id": "shut", "nodes": nodes})).expect("a draft");
    let closed = stage
        .edge
        .close(&stage.caller, draft, Idempotency::default());
    let etag = closed.await.expect("a closure").etag.into_owned();
    let lifted = stage
        .edge
        .lift_closure(&stage.caller, "shut", Some(etag), None);
    lifted.await.expect("lifted");
}

#[tokio::test]
async fn everything_survives_a_restart() {
    for medium in Medium::both() {
        let stage = Stage::over(medium.open().await).await;
        live(&stage).await;
        alarm(&stage).await;
        let before = told(&stage);
        let lists = before["lists"].as_array().expect("lists");
        for (list, name) in lists
            .iter()
            .zip([
                "features",
                "closures",
                "proposals",
                "holds",
                "alarms",
                "plans",
            ])
            .filter(|(_, name)| *name != "holds")
        {
            assert!(
                !list[name].as_array().expect(name).is_empty(),
                "the story has no {name}"
            );
        }
        let (id, revision) = (
            stage.edge.id().to_owned(),
            stage.edge.stamp().revision.into_owned(),
        );
        stage.edge.end().await;
        let stage = stage.again(medium.open().await).await;
        pretty_assertions(&before, &told(&stage));
        assert_eq!(stage.edge.id(), id);
        assert!(revision.starts_with("7-"), "{revision}");
        let again = stage.edge.stamp().revision.into_owned();
        let epoch = again.split('-').next().and_then(|it| it.parse().ok());
        assert!(
            epoch.is_some_and(|epoch: u64| epoch > 7),
            "a later epoch, though the clock gives the same: {again}"
        );
        stage.edge.end().await;
    }
}

#[tokio::test]
async fn a_zone_with_a_nested_record_can_be_read_after_a_restart() {
    let disk = MemoryDisk::default();
    let stage = Stage::over(disk.open()).await;
    let nested = |depth: usize| {
        let mut zone = circle("z", 650.0, 0.0, 10.0);
        let record = (1..depth).fold(json!({}), |record, _| json!({"a": record}));
        zone["properties"]["record"] = record;
        zone
    };
    let write = ZoneWrite::default();
    let put = stage
        .edge
        .create_zone(&stage.caller, nested(122), write, Idempotency::default());
    assert_eq!(put.await.expect_err("refused").code, Code::ZoneInvalid);
    // What a report brings is proposed where it can be read.
    let body = |depth| json!({"type": "regulatory", "service": {"from": "a3", "to": "a4"}, "destination": "a7", "zone": nested(depth)});
    let proposals = || {
        let proposals = stage.edge.proposals(&stage.caller, &PageRequest::default());
        let proposals = proposals.expect("proposals").proposals.into_iter();
        proposals.filter(|it| it.zone.is_some()).count()
    };
    stage.answer(body(116)).await;
    assert_eq!(proposals(), 0);
    stage.answer(body(32)).await;
    assert_eq!(proposals(), 1);
    stage.zone(nested(32)).await;
    let before = told(&stage);
    stage.edge.end().await;
    let stage = stage.again(disk.open()).await;
    pretty_assertions(&before, &told(&stage));
    stage.edge.zone(&stage.caller, "z").expect("it stands");
}

fn pretty_assertions(before: &Value, after: &Value) {
    let lines = |value| serde_json::to_string_pretty(value).expect("JSON");
    let (before, after) = (lines(before), lines(after));
    for (one, other) in before.lines().zip(after.lines()) {
        assert_eq!(one, other, "\nbefore:\n{before}\nafter:\n{after}");
    }
    assert_eq!(before, after);
}

#[tokio::test]
async fn nothing_is_given_twice_over_restarts() {
    let disk = MemoryDisk::default();
    let stage = Stage::over(disk.open()).await;
    stage.compose("p1", "d1", "a0", "a4").await;
    stage.zone(circle("z", 650.0, 0.0, 10.0)).await;
    let (_, etag) = stage.edge.zone(&stage.caller, "z").expect("a zone");
    stage.zone(circle("over-the-plan", 150.0, 0.0, 5.0)).await;
    let proposed = stage.plan("p1").wanted.expect("a version").version;
    stage.edge.end().await;

    let stage = stage.again(disk.open()).await;
    let write = |if_match: &str| ZoneWrite {
        id: Some("z".to_owned()),
        if_match: Some(if_match.to_owned()),
        validate_only: false,
    };
    let moved = circle("z", 650.0, 0.0, 20.0);
    let (ack, _) = stage
        .edge
        .put_zone(&stage.caller, moved.clone(), write(&etag))
        .await
        .expect("the version it has seen");
    let newer = ack.etag.expect("an etag").into_owned();
    assert_ne!(newer, etag);
    let stale = stage
        .edge
        .put_zone(&stage.caller, moved, write(&etag))
        .await
        .expect_err("stale");
    assert_eq!(
        (stale.code, stale.current_etag),
        (Code::PreconditionFailed, Some(newer))
    );
    stage
        .zone(circle("over-the-detour", 50.0, 100.0, 60.0))
        .await;
    let next = stage.plan("p1").wanted.map(|version| version.version);
    assert!(
        next.is_none_or(|next| next > proposed),
        "{next:?} after {proposed}"
    );
}

#[tokio::test]
async fn what_was_due_while_it_was_away_happens_at_the_start() {
    let disk = MemoryDisk::default();
    let stage = Stage::over(disk.open()).await;
    live(&stage).await;
    assert!(stage.edge.closure(&stage.caller, "report:a0-a1").is_ok());
    assert_eq!(stage.plan("p1").flags, [PlanFlag::Affected]);
    stage.edge.end().await;
    // The life of what a navigational report closes is 15 minutes; plans are over an hour after their arrivals.
    stage.hand.advance(SignedDuration::from_mins(100));
    let stage = stage.again(disk.open()).await;
    assert!(
        stage.edge.closure(&stage.caller, "report:a0-a1").is_err(),
        "its life is over"
    );
    let lost = stage.plan("p1");
    assert_eq!(lost.state, PlanState::Ended);
    assert_eq!(
        lost.ended_as,
        Some(EndedAs::Lost),
        "nothing has been heard of it for an hour"
    );
    assert_eq!(stage.edge.status().active_plans, 0);
    assert!(
        stage.edge.snapshot().airspace().is_in_force("show"),
        "its window has begun"
    );
    stage.edge.end().await;
    // And it is stored.
    let stage = stage.again(disk.open()).await;
    assert!(stage.edge.closure(&stage.caller, "report:a0-a1").is_err());
    assert_eq!(stage.plan("p1").state, PlanState::Ended);
}

#[tokio::test]
async fn life_goes_on_after_a_restart() {
    let disk = MemoryDisk::default();
    let stage = Stage::over(disk.open()).await;
    live(&stage).await;
    stage.edge.end().await;
    let stage = stage.again(disk.open()).await;
    let page = PageRequest::default();
    // The drone takes over what it was told before.
    let version = stage.plan("p1").wanted.expect("a version").version;
    let ack = serde_json::from_value(json!({"version": version})).expect("an ack");
    let plan = stage
        .edge
        .acknowledge_plan(&stage.caller, "p1", ack)
        .await
        .expect("taken over");
    assert_eq!(names(&plan.reported.path.nodes)[0], "a0");
    // The operator decides what waited for one, under the ids told before.
    let proposals = stage
        .edge
        .proposals(&stage.caller, &page)
        .expect("proposals")
        .proposals;
    let zone = proposals
        .iter()
        .find(|proposal| proposal.zone.is_some())
        .expect("the zone brought");
    stage
        .edge
        .decide_proposal(&stage.caller, &zone.id, Decision::Accept)
        .await
        .expect("accepted");
    // Quotas count what was closed before: three closures of one drone at a time.
    for leg in 0..4 {
        let report = json!({"type": "navigational", "drone": {"id": "d2"}, "service": {"plan_id": "p2", "leg": leg}});
        stage.answer(report).await;
    }
    // What reports close is stored soon after; with an acknowledgement all before it is.
    stage.zone(circle("last", 750.0, 100.0, 5.0)).await;
    let before = told(&stage);
    disk.crash();
    let stage = stage.again(disk.open()).await;
    pretty_assertions(&before, &told(&stage));
    let report = json!({"type": "navigational", "drone": {"id": "d2"}, "service": {"from": "b0", "to": "b1"}});
    stage.see("d2", 50.0, 100.0).await;
    let answer = stage.answer(report).await;
    assert_eq!(answer["publication"]["reason"], "drone_quota", "{answer}");
}

#[tokio::test]
async fn what_was_acknowledged_survives_a_crash_at_every_commit() {
    for commits in 0..9 {
        let disk = MemoryDisk::default();
        let stage = Stage::impatient(disk.open()).await;
        disk.hang_after(commits);
        let mut acknowledged = Vec::new();
        for number in 0..6 {
            let id = format!("z{number}");
            let zone = circle(&id, 100.0 * f64::from(number), 50.0, 5.0);
            let put = stage.edge.create_zone(
                &stage.caller,
                zone,
                ZoneWrite::default(),
                Idempotency::default(),
            );
            if put.await.is_ok_and(|ack| ack.durable) {
                acknowledged.push(id);
            }
        }
        let expected = commits.min(6) as usize;
        assert_eq!(acknowledged.len(), expected, "with {commits} commits");
        disk.crash();
        let stage = stage.again(disk.open()).await;
        let zones = stage
            .edge
            .zones(&stage.caller, &PageRequest::default())
            .expect("zones")
            .features;
        let ids: Vec<&str> = zones
            .iter()
            .filter_map(|zone| zone["id"].as_str())
            .collect();
        assert_eq!(ids, acknowledged, "with {commits} commits");
    }
}

#[tokio::test]
async fn the_file_of_another_network_is_refused() {
    let disk = MemoryDisk::default();
    let stage = Stage::over(disk.open()).await;
    stage.edge.end().await;
    let (_, text) = network();
    let renamed = std::str::from_utf8(&text)
        .expect("text")
        .replace("ladder", "stairs");
    let topology = load_network(&renamed).expect("a network").topology;
    let clock = Clock::real();
    let opening = Opening::new(
        Arc::new(topology),
        renamed.into(),
        EPOCH,
        Settings::default(),
        clock,
    );
    let refused = Edge::open(opening, disk.open())
        .await
        .expect_err("another network");
    let expected = StoreFault::OtherNetwork {
        stored: "ladder".to_owned(),
        given: "stairs".to_owned(),
    };
    assert!(
        matches!(&refused, OpenError::Store(fault) if *fault == expected),
        "{refused}"
    );
}

#[tokio::test]
async fn an_edge_in_place_needs_no_threads() {
    let disk = MemoryDisk::default();
    let (topology, geojson) = network();
    let clock = Clock::by_hand(crate::stage::DAWN.parse().expect("an instant")).0;
    let opening = Opening::new(topology, geojson, EPOCH, Settings::default(), clock).in_place();
    let edge = Edge::open(opening, disk.open()).await.expect("an edge");
    let caller = skyway::edge::Caller::anyone();
    let put = edge.create_zone(
        &caller,
        circle("z", 50.0, 50.0, 5.0),
        ZoneWrite::default(),
        Idempotency::default(),
    );
    assert!(put.await.expect("a zone").durable);
    edge.end().await;
    assert_eq!(disk.rows(skyway::edge::Table::Zones).len(), 1);
    let file: Box<dyn StoreFile> = disk.open();
    drop(file);
}

/// How long a start takes is printed, as a machine that is busy says nothing about an edge.
#[tokio::test]
async fn a_start_from_ten_thousand_zones() {
    let text = skyway::network::bundled::SYDNEY_CBD;
    let topology = Arc::new(load_network(text).expect("a network").topology);
    let medium = &Medium::both()[1];
    let clock = Clock::by_hand(crate::stage::DAWN.parse().expect("an instant")).0;
    let open = async || {
        let settings = Settings::default();
        let opening = Opening::new(
            topology.clone(),
            text.into(),
            EPOCH,
            settings,
            clock.clone(),
        );
        Edge::open(opening, medium.open().await)
            .await
            .expect("an edge")
    };
    let edge = open().await;
    let bounds = topology.bounds();
    let side = |low: f64, high: f64, step: u32| low + (high - low) * f64::from(step) / 100.0;
    let zone = |number: u32| {
        let centre = skyway::geo::Point::new(
            side(bounds.min.x, bounds.max.x, number % 100),
            side(bounds.min.y, bounds.max.y, number / 100),
        );
        let [x, y] = topology.frame().from_plane(centre);
        let radius_m = 5.0 + f64::from(number % 50);
        circle(&format!("zone-{number:05}"), x, y, radius_m)
    };
    for hundred in 0..100 {
        // Side by side, so that they share transactions.
        let posts = (0..100).map(|number| {
            let (edge, feature) = (edge.clone(), zone(100 * hundred + number));
            tokio::spawn(async move {
                let (caller, write) = (Caller::anyone(), ZoneWrite::default());
                let post = edge.create_zone(&caller, feature, write, Idempotency::default());
                post.await.expect("a zone");
            })
        });
        for post in posts.collect::<Vec<_>>() {
            post.await.expect("no panic");
        }
    }
    let writing = Clock::real().stopwatch();
    edge.end().await;
    let written_s = writing.elapsed().as_secs_f64();
    let blocked = edge.status().blocked_segments;
    let opening = Clock::real().stopwatch();
    let edge = open().await;
    let opened_s = opening.elapsed().as_secs_f64();
    println!("10,000 zones: written in {written_s:.3} s, started from in {opened_s:.3} s");
    let status = edge.status();
    assert_eq!((status.zones, status.blocked_segments), (10_000, blocked));
    edge.end().await;
}
