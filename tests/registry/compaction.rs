//! Old revisions are dropped while edges follow and take snapshots: an edge that is too late is
//! told so, and none misses anything.

use crate::drafts::NETWORK;
use crate::harness::{Place, Served};
use serde_json::Value;
use skyway::registry::Settings;
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};

/// How many zones are written, while only this many revisions are kept.
const ZONES: u64 = 60;
const KEPT: u64 = 4;

/// What a follower has, and how often it had to begin anew.
#[derive(Default)]
struct Follower {
    after: u64,
    zones: BTreeSet<String>,
    anew: u64,
}

impl Follower {
    /// Takes a page of the log, or everything where the log no longer has what comes next.
    async fn step(&mut self, served: &Served) {
        let path = format!("/changes?after={}&limit=3", self.after);
        let page = served.get(&path).await;
        if page.status == 410 {
            self.begin(served).await;
            return;
        }
        let page = page.is(200).json();
        for change in page["changes"].as_array().expect("changes") {
            let revision = change["revision"].as_u64().expect("a revision");
            assert_eq!(revision, self.after + 1, "a gap");
            self.after = revision;
            self.apply(
                &change["kind"],
                &change["id"],
                change["operation"] == "delete",
            );
        }
    }

    /// Takes the snapshot; where its revision is dropped between two pages, again from the first.
    async fn begin(&mut self, served: &Served) {
        'anew: loop {
            self.anew += 1;
            self.zones.clear();
            let mut token = String::new();
            loop {
                let path = format!("/snapshot?page_size=7&page_token={token}");
                let page = served.get(&path).await;
                if page.status == 410 {
                    continue 'anew;
                }
                let page = page.is(200).json();
                for object in page["objects"].as_array().expect("objects") {
                    self.apply(&object["kind"], &object["id"], false);
                }
                let Some(next) = page["next_page_token"].as_str() else {
                    self.after = page["revision"].as_u64().expect("a revision");
                    return;
                };
                token = next.to_owned();
            }
        }
    }

    fn apply(&mut self, kind: &Value, id: &Value, is_gone: bool) {
        let id = id.as_str().expect("an id").to_owned();
        if kind != "zone" {
            return;
        }
        match is_gone {
            true => self.zones.remove(&id),
            false => self.zones.insert(id),
        };
    }
}

#[tokio::test]
async fn who_is_too_late_begins_anew_and_misses_nothing() {
    let place = Place::new();
    let settings = Settings {
        revisions_kept: KEPT,
        ..Settings::default()
    };
    let served = Served::with_network(&place, settings).await;
    let is_over = AtomicBool::new(false);
    let writing = async {
        for number in 0..ZONES {
            let etag = served.post_zone(&format!("z-{number:02}")).await.etag();
            if number % 3 == 0 {
                let line = format!("DELETE /zones/z-{number:02}");
                let headers = [("if-match", &*etag)];
                served.write(&line, &headers, &Value::Null).await.is(200);
            }
            served.registry.compact().await.expect("compacts");
        }
        is_over.store(true, Ordering::Relaxed);
    };
    let mut follower = Follower::default();
    let following = async {
        while !is_over.load(Ordering::Relaxed) {
            follower.step(&served).await;
        }
    };
    tokio::join!(writing, following);
    let path = format!("GET /v1/networks/{NETWORK}/zones?page_size=1000");
    let listed = served.ask(&path, &[], "").await.is(200).json();
    let listed: BTreeSet<String> = listed["objects"]
        .as_array()
        .expect("zones")
        .iter()
        .map(|zone| zone["id"].as_str().expect("an id").to_owned())
        .collect();
    let mut before = 0;
    while follower.zones != listed {
        assert!(
            before != follower.after,
            "nothing more comes, and it is not the same"
        );
        before = follower.after;
        follower.step(&served).await;
    }
    assert_eq!(listed.len() as u64, ZONES - ZONES.div_ceil(3));
    let mut late = Follower::default();
    late.step(&served).await;
    assert_eq!(
        (late.zones, late.anew),
        (listed, 1),
        "a cursor that is gone"
    );
    served.end().await;
}
