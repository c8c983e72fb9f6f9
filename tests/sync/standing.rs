//! What an edge says of its registry: how far, how old, how fresh; and a defect that ends following.

use crate::stage::{Central, NETWORK, Outpost, raise, sync_settings, up_to};
use jiff::SignedDuration;
use skyway::edge::Settings;
use skyway::edge::sync::{ClientError, RegistryClient, RegistryWrite};
use skyway::wire::{
    ChangesPage, EdgeNews, EdgeNoted, EdgeReport, EventKind, Freshness, NetworkStatistics,
    NewsTaken, PositionBatch, RegistrySnapshot, Written,
};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

#[tokio::test]
async fn age_grows_while_the_registry_is_away_and_nothing_else_changes() {
    let central = Central::open().await;
    central.put_zone("a", 50.0, 0.0, 5.0).await;
    let north = Outpost::set(&central, "north");
    north.settle(&central).await;
    let mut events = north.events();
    north.line.cut();
    let start = north.edge.stamp();
    north.hand.advance(SignedDuration::from_secs(40));
    north
        .until("it is noticed", async || {
            north.edge.stamp().freshness == Freshness::Stale
        })
        .await;
    let told = up_to(&mut events, EventKind::RegistryLost).await;
    assert_eq!(told.len(), 1);
    north.hand.advance(SignedDuration::from_mins(5));
    let stamp = north.edge.stamp();
    assert_eq!(stamp.freshness, Freshness::Degraded);
    assert!(stamp.registry_age_s.is_some_and(|age_s| age_s > 330.0));
    assert_eq!(stamp.registry_revision, start.registry_revision);
    assert_eq!((north.blocked(), stamp.revision), (1, start.revision));
    assert!(north.edge.is_ready());
    assert!(north.sync().failures["transport"] > 0);
    north.line.lead_to(Some(&central.registry));
    north
        .until("it is back", async || {
            north.edge.stamp().freshness == Freshness::Fresh
        })
        .await;
    up_to(&mut events, EventKind::RegistryBack).await;
    assert!(
        north
            .edge
            .stamp()
            .registry_age_s
            .is_some_and(|age_s| age_s < 5.0)
    );
    north.end().await;
}

#[tokio::test]
async fn a_registry_that_was_never_heard_since_the_start_is_lost() {
    let central = Central::open().await;
    let north = Outpost::set(&central, "north");
    north.line.cut();
    let mut events = north.events();
    north
        .until("time passes", async || {
            let start = crate::stage::dawn();
            let lasted = north.edge.clock().now().duration_since(start);
            lasted > SignedDuration::from_secs(35)
        })
        .await;
    let told = up_to(&mut events, EventKind::RegistryLost).await;
    let (_, data) = told.last().expect("an event");
    assert!(data["age_s"].as_f64().is_some_and(|age_s| age_s >= 30.0));
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    up_to(&mut events, EventKind::RegistryBack).await;
    north.end().await;
}

#[tokio::test]
async fn the_registry_hears_how_far_each_edge_is() {
    let central = Central::open().await;
    central.put_zone("a", 50.0, 0.0, 5.0).await;
    let north = Outpost::set(&central, "north");
    north.settle(&central).await;
    let head = central.head().await;
    north
        .until("it is reported", async || {
            let reports = north.line.reports();
            reports.last().is_some_and(|report| report.revision == head)
        })
        .await;
    let edges = central.registry.edges().await.expect("a list").edges;
    assert_eq!((&*edges[0].id, edges[0].revision), ("north", head));
    let count = north.line.reports().len();
    for _ in 0..5 {
        north.hand.advance(SignedDuration::from_secs(2));
        north.edge.tick().await.expect("the writer works");
    }
    assert_eq!(
        north.line.reports().len(),
        count,
        "what is not new is not told again at once"
    );
    north.end().await;
}

#[tokio::test]
async fn an_edge_without_a_registry_is_its_own_authority() {
    let central = Central::open().await;
    let north = Outpost::with(&central.registry, "north", Settings::default());
    north.put_zone("a", 50.0, 0.0, 5.0).await;
    north.end().await;
    let (edge, _hand) = raise(Settings::default());
    assert_eq!(edge.stamp().freshness, Freshness::Degraded);
    assert!(edge.status().registry.is_some());
}

/// A client that has a defect: it fails so often before it works.
struct Faulty {
    line: crate::line::Line,
    left: Arc<AtomicU64>,
}

impl Faulty {
    fn trip(&self) {
        let left = self
            .left
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| {
                left.checked_sub(1)
            });
        assert!(left.is_err(), "a defect");
    }
}

impl RegistryClient for Faulty {
    async fn changes(
        &self,
        epoch: u64,
        after: u64,
        wait: Duration,
    ) -> Result<ChangesPage, ClientError> {
        self.trip();
        self.line.changes(epoch, after, wait).await
    }

    async fn snapshot(&self, page_token: Option<&str>) -> Result<RegistrySnapshot, ClientError> {
        self.trip();
        self.line.snapshot(page_token).await
    }

    async fn write(&self, write: &RegistryWrite) -> Result<Written, ClientError> {
        self.line.write(write).await
    }

    async fn report(&self, report: &EdgeReport) -> Result<EdgeNoted, ClientError> {
        self.line.report(report).await
    }

    async fn news(&self, news: &EdgeNews) -> Result<NewsTaken, ClientError> {
        self.line.news(news).await
    }

    async fn statistics(&self) -> Result<NetworkStatistics, ClientError> {
        self.line.statistics().await
    }

    async fn positions(&self, batch: &Arc<PositionBatch>) -> Result<(), ClientError> {
        self.line.positions(batch).await
    }
}

#[tokio::test]
async fn a_defect_is_counted_and_following_begins_anew() {
    let central = Central::open().await;
    central.put_zone("a", 50.0, 0.0, 5.0).await;
    let (edge, hand) = raise(Settings::default());
    let left = Arc::new(AtomicU64::new(3));
    let client = Faulty {
        line: crate::line::Line::to(&central.registry, "north", NETWORK),
        left: left.clone(),
    };
    let following = edge.follow_registry(client, sync_settings("north"));
    let waited = tokio::time::timeout(Duration::from_secs(40), async {
        while edge.status().zones == 0 {
            hand.advance(SignedDuration::from_millis(50));
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    });
    waited.await.expect("it follows at last");
    let sync = edge.status().registry.expect("it follows");
    assert_eq!(sync.restarts, 3);
    following.stop().await;
}
