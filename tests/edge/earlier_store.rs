//! A store file that an earlier version wrote, and this one opens: `stores/2026-11-21.db`, by the first version that kept
//! one. Its plans have `current` and `proposed` versions without epochs, and states that are no more.

#![expect(
    clippy::disallowed_methods,
    reason = "the test copies a file that an earlier version wrote"
)]

use crate::stage::{EPOCH, names};
use serde_json::{Value, json};
use skyway::clock::Clock;
use skyway::edge::{
    Caller, Edge, FlightSettings, Opening, PageRequest, PlanFilter, Settings, SqliteFile,
    StoreFile, Table,
};
use skyway::flight::Airframe;
use skyway::formats::load_network;
use skyway::wire::{Cancellation, EndedAs, PlanFlag, PlanState};
use std::path::{Path, PathBuf};
use std::sync::Arc;

const WRITTEN: &[u8] = include_bytes!("stores/2026-11-21.db");
const NETWORK: &str = include_str!("stores/square.geojson");
/// Ten seconds after what it has was written.
const THEN: &str = "2026-11-22T09:00:10Z";

fn copied(folder: &Path) -> PathBuf {
    let path = folder.join("edge.db");
    std::fs::write(&path, WRITTEN).expect("a copy");
    path
}

async fn open(path: &Path) -> Arc<Edge> {
    open_with(path, Settings::default()).await
}

async fn open_with(path: &Path, settings: Settings) -> Arc<Edge> {
    let network = load_network(NETWORK).expect("a network");
    let (clock, _hand) = Clock::by_hand(THEN.parse().expect("an instant"));
    let opening = Opening::new(
        Arc::new(network.topology),
        NETWORK.into(),
        EPOCH,
        settings,
        clock,
    );
    let file = SqliteFile::open(path).await.expect("it is opened");
    Edge::open(opening, Box::new(file)).await.expect("an edge")
}

/// An edge with an airframe, which is named or a default, and what its status says of that.
async fn airframe(path: &Path, names_airframe: bool) -> (String, &'static str) {
    let settings = Settings {
        flight: Some(FlightSettings::of(Airframe::phantom3())),
        names_airframe,
        ..Settings::default()
    };
    let edge = open_with(path, settings).await;
    let status = edge.status();
    edge.end().await;
    (status.airframe, status.airframe_by)
}

#[tokio::test]
async fn a_store_of_before_keeps_no_airframe_until_one_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = copied(folder.path());
    for _ in 0..2 {
        assert_eq!(airframe(&path, false).await, ("none".to_owned(), "store"));
    }
    let phantom = || "DJI Phantom 3".to_owned();
    assert_eq!(airframe(&path, true).await, (phantom(), "setting"));
    assert_eq!(airframe(&path, false).await, (phantom(), "default"));
    let fresh = folder.path().join("fresh.db");
    for _ in 0..2 {
        assert_eq!(airframe(&fresh, false).await, (phantom(), "default"));
    }
}

/// What is listed, without what each start makes anew.
fn listed(edge: &Edge) -> Value {
    let (caller, page) = (Caller::anyone(), PageRequest::default());
    let value = |list: serde_json::Result<Value>| list.expect("JSON");
    let zones = value(serde_json::to_value(
        edge.zones(&caller, &page).expect("zones"),
    ));
    let closures = edge.closures(&caller, &page).expect("closures");
    let proposals = edge.proposals(&caller, &page).expect("proposals");
    json!({
        "zones": zones["features"],
        "closures": value(serde_json::to_value(closures))["closures"],
        "proposals": value(serde_json::to_value(proposals))["proposals"],
    })
}

fn ids(list: &Value) -> Vec<&str> {
    let entries = list.as_array().expect("a list").iter();
    entries.filter_map(|entry| entry["id"].as_str()).collect()
}

fn holds_all_of_it(edge: &Edge) {
    let caller = Caller::anyone();
    let plan = |id: &str| edge.plan(&caller, id).expect("a plan");
    let flown = plan("flown");
    assert_eq!(flown.state, PlanState::Activated, "it had departed");
    assert_eq!(flown.flags, [PlanFlag::Affected]);
    let reported = &flown.reported;
    assert_eq!((reported.version, reported.epoch), (1, 0));
    assert_eq!(names(&reported.path.nodes), ["a", "b", "c", "d"]);
    assert_eq!(flown.wanted.as_ref().map(|wanted| wanted.version), Some(2));
    let later = plan("later");
    assert_eq!(later.state, PlanState::Activated, "by its times");
    assert_eq!(later.reported.version, 2, "its drone had taken it over");
    let gone = plan("gone");
    assert_eq!(gone.state, PlanState::Ended);
    assert_eq!(gone.ended_as, Some(EndedAs::Cancelled));
    let everything = listed(edge);
    assert_eq!(ids(&everything["zones"]), ["fair", "fire"]);
    assert_eq!(ids(&everything["closures"]), ["fair", "fire", "works"]);
    assert_eq!(ids(&everything["proposals"]).len(), 3);
    let in_force: Vec<&Value> = everything["closures"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|closure| &closure["in_force"])
        .collect();
    assert_eq!(in_force, [false, true, false]);
    assert_eq!(edge.status().checker_cases, 0);
}

#[tokio::test]
async fn the_file_of_the_first_version_is_opened_and_goes_on_in_the_words_of_today() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = copied(folder.path());
    let mut file = SqliteFile::open(&path).await.expect("it is opened");
    let plans = file.load(Table::Plans).await.expect("plans");
    assert_eq!(plans.len(), 3);
    assert!(plans.iter().all(|(_, body)| body.contains("\"current\":")));
    let decisions = file.load(Table::Decisions).await.expect("decisions");
    Box::new(file).close().await;

    let edge = open(&path).await;
    holds_all_of_it(&edge);
    // Numbers that its versions may have been given are not given again.
    let caller = Caller::anyone();
    let cancelled = edge
        .cancel_plan(&caller, "later", Cancellation::default())
        .await;
    cancelled.expect("a change that is stored");
    let shown = listed(&edge);
    for (id, _) in &decisions {
        let record = edge.recomposition(&caller, id, true).await;
        assert!(record.is_ok(), "{id} is not kept");
    }
    edge.end().await;

    let mut file = SqliteFile::open(&path).await.expect("it is opened");
    let plans = file.load(Table::Plans).await.expect("plans");
    let later = plans.iter().find(|(key, _)| key == "later");
    let (_, later) = later.expect("the plan that changed");
    assert!(
        later.contains("\"reported\":") && !later.contains("\"current\":"),
        "{later}"
    );
    Box::new(file).close().await;
    let again = open(&path).await;
    assert_eq!(listed(&again), shown);
    let later = again.plan(&caller, "later").expect("a plan");
    assert_eq!(later.ended_as, Some(EndedAs::Cancelled));
    let all = again.plans(&caller, &PageRequest::default(), &PlanFilter::default());
    assert_eq!(all.expect("plans").plans.len(), 3);
}
