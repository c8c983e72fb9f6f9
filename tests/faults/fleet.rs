//! A fleet whose edge is killed: it flies on, what its drones were told is not lost, and all of them land.

use crate::daemon::{Plan, WAIT_AT_MOST};
use crate::registry_client::{Answer, Client};
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use skyway::clock::{Clock, ManualClock};
use skyway::demo::{Fleet, fly};
use std::time::Duration;
use tokio_util::sync::CancellationToken;

const START: &str = "2026-11-27T18:00:00Z";
const DRONES: u32 = 4;
/// How far the time of edge and fleet is moved at once.
const STEP: SignedDuration = SignedDuration::from_secs(5);
/// Longer than two deliveries take, with what is between them.
const STEPS: u32 = 240;

/// An edge whose clock is moved, and the time that the fleet goes by.
struct Story {
    client: Client,
    hand: ManualClock,
    now: Timestamp,
}

impl Story {
    /// What the edge tells, once `is_there` says so.
    async fn until(&self, path: &str, is_there: impl Fn(&Value) -> bool) -> Value {
        let mut last = Value::Null;
        let asking = async {
            loop {
                let answer = self
                    .client
                    .ask(&format!("GET {path}"), &[], &Value::Null)
                    .await;
                if let Answer::Came {
                    status: 200, body, ..
                } = answer
                {
                    last = serde_json::from_str(&body).expect("JSON");
                    if is_there(&last) {
                        return;
                    }
                }
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        let asked = tokio::time::timeout(WAIT_AT_MOST, asking).await;
        assert!(
            asked.is_ok(),
            "{path} does not come to be as it should: {last}"
        );
        last
    }

    async fn set_edge(&self) {
        let to = json!({"to": self.now.to_string()});
        self.client.until("POST /v1/clock:advance", &to, 200).await;
    }

    /// Lets time pass; all drones have told where they are then.
    async fn step(&mut self) {
        self.now += STEP;
        self.set_edge().await;
        self.hand.set(self.now);
        let now = Value::from(self.now.to_string());
        self.until("/v1/drones", |told| {
            let drones = told["drones"].as_array().expect("drones");
            drones.len() == DRONES as usize && drones.iter().all(|drone| drone["seen_at"] == now)
        })
        .await;
    }

    async fn plans(&self) -> Vec<Value> {
        let told = self.until("/v1/plans?page_size=1000", |_| true).await;
        told["plans"].as_array().expect("plans").clone()
    }

    /// Plans that are flown, and those that are over, of each of which its drone has landed.
    async fn under_way_and_over(&self) -> (Vec<Value>, usize) {
        let (over, under_way): (Vec<Value>, Vec<Value>) = self
            .plans()
            .await
            .into_iter()
            .partition(|plan| plan["state"] == "ended");
        for plan in &over {
            let landed = ["delivered", "diverted"]
                .iter()
                .any(|how| plan["ended_as"] == *how);
            assert!(landed, "{plan}");
        }
        (under_way, over.len())
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_fleet_flies_on_when_its_edge_is_killed_and_is_told_what_it_missed() {
    let folder = tempfile::tempdir().expect("a folder");
    let store = folder.path().join("edge.db").display().to_string();
    let what = [
        "edge",
        "--store",
        &store,
        "--clock",
        "external",
        "--clock-start",
        START,
    ];
    let plan = Plan::new("edge", folder.path(), &what);
    let daemon = plan.start().await;
    let address = plan.address.get().expect("it runs");
    let start: Timestamp = START.parse().expect("an instant");
    let (clock, hand) = Clock::by_hand(start);
    let mut story = Story {
        client: Client::of_edge(&plan.address),
        hand,
        now: start,
    };
    let base_url = format!("http://{address}");
    let fleet = Fleet {
        drones: DRONES,
        seed: 1,
        // No registry is there: the wind stays as it is.
        registry: (base_url.clone(), "none".to_owned()),
    };
    let stop = CancellationToken::new();
    let flying = tokio::spawn({
        let stop = stop.clone();
        async move { fly(&fleet, &base_url, clock, stop).await }
    });
    let mut under_way = Vec::new();
    while under_way.len() < DRONES as usize {
        story.step().await;
        under_way = story.under_way_and_over().await.0;
    }
    // Closed before each drone that is not at its end yet, and killed when the first of them may have been told.
    under_way.retain(|plan| has_legs_ahead(plan, story.now));
    let ahead: Vec<&Value> = under_way.iter().filter_map(node_ahead).collect();
    assert!(!ahead.is_empty(), "all are on their last legs");
    let closure = json!({"id": "cranes", "reason": "cranes", "nodes": ahead});
    story.client.until("POST /v1/closures", &closure, 201).await;
    daemon.kill();
    let plan = plan.at(address);
    let daemon = plan.start().await;
    story.set_edge().await;
    // Time stands still: nobody is late, and nobody has to be told for another reason.
    for plan in &under_way {
        let path = format!("/v1/plans/{}", plan["id"].as_str().expect("an id"));
        let before = plan["reported"]["version"].as_u64();
        story
            .until(&path, |plan| {
                plan["reported"]["version"].as_u64() > before && plan["wanted"].is_null()
            })
            .await;
    }
    let mut landed = 0;
    for _ in 0..STEPS {
        story.step().await;
        landed = story.under_way_and_over().await.1;
        if landed >= 2 * DRONES as usize {
            break;
        }
    }
    assert!(
        landed >= 2 * DRONES as usize,
        "{landed} have landed: {:?}",
        story.plans().await
    );
    stop.cancel();
    flying
        .await
        .expect("no panic")
        .expect("a network to fly in");
    daemon.stop();
}

/// Whether the last leg of what a drone flies begins only after some steps.
fn has_legs_ahead(plan: &Value, now: Timestamp) -> bool {
    let legs = plan["reported"]["legs"].as_array();
    let last = legs.and_then(|legs| legs.last());
    let departs_at = last.and_then(|leg| leg["departs_at"].as_str());
    let departs_at = departs_at.and_then(|text| text.parse::<Timestamp>().ok());
    departs_at.is_some_and(|departs_at| departs_at > now + STEP * 2)
}

/// The last but one node of what a drone flies.
fn node_ahead(plan: &Value) -> Option<&Value> {
    plan["reported"]["path"]["nodes"]
        .as_array()?
        .iter()
        .rev()
        .nth(1)
}
