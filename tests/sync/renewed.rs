//! Closures that have ended and come again: others are told, though the registry keeps what has ended for a while.

use crate::stage::Outpost;
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::edge::Idempotency;
use skyway::wire;

/// Longer than the life of any closure of these stories.
const LIFE_AND_MORE: SignedDuration = SignedDuration::from_mins(16);

impl Outpost {
    /// A drone that is on its leg reports an obstacle there.
    async fn meets_an_obstacle(&self, id: &str) {
        let telemetry = wire::Telemetry {
            positions: vec![json!({"drone_id": "d1", "location": {"x": 140.0, "y": 0.0}})],
        };
        let seen = self.edge.telemetry(&self.caller, telemetry).await;
        seen.expect("seen");
        let body = json!({
            "id": id, "type": "navigational", "service": {"from": "a1", "to": "a2"},
            "destination": "a5", "drone": {"id": "d1"}, "location": {"x": 140.0, "y": 0.0},
            "timestamp": self.edge.clock().now().to_string(),
        });
        let parsed = skyway::formats::parse_report(body.to_string().as_bytes());
        let parsed = parsed.expect("a report");
        let answered = self.edge.report_failure(&self.caller, parsed).await;
        let answered: Value =
            serde_json::to_value(answered.expect("an outcome").to_wire()).expect("JSON");
        assert_eq!(answered["publication"]["state"], "published", "{answered}");
        self.edge.tick().await.expect("the writer works");
    }

    async fn is_closed(&self) {
        self.until("it has come", async || self.blocked() == 1)
            .await;
    }

    /// All that was closed has ended by itself.
    async fn time_passes(&self) {
        self.hand.advance(LIFE_AND_MORE);
        self.edge.tick().await.expect("the writer works");
        assert_eq!(self.blocked(), 0);
    }

    fn was_taken_at_its_word(&self) {
        assert_eq!((self.holds().len(), self.sync().forwards_refused), (0, 0));
    }
}

#[tokio::test]
async fn a_report_on_a_leg_whose_closure_has_ended_closes_it_at_every_edge_again() {
    let (central, north, south) = Outpost::pair().await;
    north.meets_an_obstacle("r1").await;
    south.is_closed().await;
    for outpost in [&north, &south] {
        outpost.time_passes().await;
    }
    // From the edge that told it first.
    north.meets_an_obstacle("r2").await;
    south.is_closed().await;
    for outpost in [&north, &south] {
        outpost.time_passes().await;
    }
    // From one that only heard of it.
    south.meets_an_obstacle("r3").await;
    north.is_closed().await;
    for outpost in [&north, &south] {
        outpost.time_passes().await;
    }
    // From one that came when it was over.
    let east = Outpost::set(&central, "east");
    east.hand.advance(
        north
            .edge
            .clock()
            .now()
            .duration_since(crate::stage::dawn()),
    );
    east.settle(&central).await;
    east.meets_an_obstacle("r4").await;
    north.is_closed().await;
    for outpost in [&north, &south, &east] {
        outpost.was_taken_at_its_word();
    }
    for outpost in [north, south, east] {
        outpost.end().await;
    }
}

#[tokio::test]
async fn an_operators_closure_that_has_ended_may_be_posted_again() {
    let (central, north, south) = Outpost::pair().await;
    for _ in 0..2 {
        let until = north.edge.clock().now() + SignedDuration::from_mins(10);
        let draft = wire::ClosureDraft {
            id: Some("works".to_owned()),
            segments: vec!["b4-b5".to_owned()],
            until: Some(until.to_string()),
            ..wire::ClosureDraft::default()
        };
        let closed = north
            .edge
            .close(&north.caller, draft, Idempotency::default());
        closed.await.expect("a closure");
        south.is_closed().await;
        for outpost in [&north, &south] {
            outpost.time_passes().await;
        }
    }
    north.settle(&central).await;
    north.was_taken_at_its_word();
    north.end().await;
    south.end().await;
}
