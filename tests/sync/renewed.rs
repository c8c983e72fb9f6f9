//! Closures that have ended and come again: others are told, though the registry keeps what has ended for a while. And those
//! that have ended here before others were told that they would.

use crate::line::cut;
use crate::stage::{Central, Outpost};
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

    async fn close_for(&self, id: &str, life: SignedDuration) {
        let until = self.edge.clock().now() + life;
        let draft = wire::ClosureDraft {
            id: Some(id.to_owned()),
            segments: vec!["b4-b5".to_owned()],
            until: Some(until.to_string()),
            ..wire::ClosureDraft::default()
        };
        let closed = self.edge.close(&self.caller, draft, Idempotency::default());
        closed.await.expect("a closure");
    }

    /// It is to end in a minute.
    async fn shorten(&self, id: &str) {
        let until = self.edge.clock().now() + SignedDuration::from_mins(1);
        let change = wire::ClosureChange {
            until: Some(until.to_string()),
            ..wire::ClosureChange::default()
        };
        let (edge, caller) = (&self.edge, &self.caller);
        let changed = edge.change_closure(caller, id, change, None);
        changed.await.expect("changed");
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
        north
            .close_for("works", SignedDuration::from_mins(10))
            .await;
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

/// Two edges that know a closure for ten hours, one of them cut off.
async fn cut_off() -> (Central, Outpost, Outpost) {
    let (central, north, south) = Outpost::pair().await;
    north
        .close_for("works", SignedDuration::from_hours(10))
        .await;
    south.is_closed().await;
    north.settle(&central).await;
    north.line.cut();
    (central, north, south)
}

/// The registry is back, and what had ended at the north is closed nowhere.
async fn is_open_everywhere((central, north, south): (Central, Outpost, Outpost)) {
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    south
        .until("it is open", async || south.blocked() == 0)
        .await;
    assert_eq!((north.blocked(), central.closures().await.len()), (0, 0));
    north.was_taken_at_its_word();
    north.end().await;
    south.end().await;
}

#[tokio::test]
async fn what_was_shortened_and_ended_before_that_was_told_ends_everywhere() {
    let (central, north, south) = cut_off().await;
    north.shorten("works").await;
    north.time_passes().await;
    is_open_everywhere((central, north, south)).await;
}

#[tokio::test]
async fn what_was_made_anew_and_ended_before_it_was_told_to_be_lifted_ends_everywhere() {
    let (central, north, south) = cut_off().await;
    let lifted = north
        .edge
        .lift_closure(&north.caller, "works", None, None)
        .await;
    lifted.expect("lifted");
    north.close_for("works", SignedDuration::from_mins(1)).await;
    north.time_passes().await;
    is_open_everywhere((central, north, south)).await;
}

#[tokio::test]
async fn what_was_shortened_after_a_write_whose_answer_was_lost_ends_everywhere() {
    let (central, north, south) = Outpost::pair().await;
    north.line.bend(|_| Err(cut()));
    north.line.lose_answers(true);
    north
        .close_for("works", SignedDuration::from_hours(10))
        .await;
    south.is_closed().await;
    north.line.take_no_writes(true);
    north
        .until("all answers are lost", async || !north.line.is_writing())
        .await;
    north.line.lose_answers(false);
    north.shorten("works").await;
    north.time_passes().await;
    north.line.take_no_writes(false);
    north.line.straighten();
    is_open_everywhere((central, north, south)).await;
}

#[tokio::test]
async fn what_has_ended_here_gives_way_to_what_was_renewed_elsewhere() {
    let (central, north, south) = Outpost::pair().await;
    north.meets_an_obstacle("r1").await;
    south.is_closed().await;
    north.settle(&central).await;
    north.line.cut();
    for (outpost, minutes) in [(&north, 5), (&south, 10)] {
        outpost.hand.advance(SignedDuration::from_mins(minutes));
        outpost.meets_an_obstacle("r2").await;
    }
    south.settle(&central).await;
    north.time_passes().await;
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    assert_eq!((north.blocked(), central.closures().await.len()), (1, 1));
    north.was_taken_at_its_word();
    north.end().await;
    south.end().await;
}
