//! A write whose answer was lost is sent again, and answered as it was then. Meanwhile everything may have changed: the
//! edge has read what became of it in a list, or the registry was restored from a backup.

use crate::line::cut;
use crate::stage::{Central, Outpost};
use jiff::SignedDuration;
use skyway::edge::Decision;

/// An edge that has the zone `x` with its registry, and hears nothing more of it; what it writes arrives.
async fn deaf() -> (Central, Outpost) {
    let central = Central::open().await;
    central.put_zone("x", 150.0, 0.0, 20.0).await;
    let north = Outpost::set(&central, "north");
    north.settle(&central).await;
    north.line.bend(|_| Err(cut()));
    (central, north)
}

impl Outpost {
    /// Waits until the registry has heard something of this edge once more, whose answer is lost.
    async fn told_in_vain(&self, central: &Central, doing: impl Future<Output = ()>) {
        let head = central.head().await;
        self.line.lose_answers(true);
        doing.await;
        self.until("it is told", async || central.head().await > head)
            .await;
        self.line.take_no_writes(true);
        self.until("all answers are lost", async || !self.line.is_writing())
            .await;
        self.line.lose_answers(false);
    }

    /// Waits until it has tried so often that it gives a change up.
    async fn gives_up(&self) {
        self.until("it is given up", async || {
            self.hand.advance(SignedDuration::from_secs(1));
            !self.holds().is_empty()
        })
        .await;
    }

    /// Reads everything anew, as the log goes back no further, while what is written does not arrive.
    async fn read_list(&self, central: &Central) {
        central.compact().await;
        let lists = self.line.lists();
        self.line.straighten();
        self.has_read(central).await;
        assert_eq!(self.line.lists(), lists + 1);
        self.line.take_no_writes(false);
    }
}

#[tokio::test]
async fn what_was_put_and_lifted_by_others_since_is_lifted_here() {
    let (central, north) = deaf().await;
    north
        .told_in_vain(&central, north.put_zone("y", 350.0, 0.0, 20.0))
        .await;
    central.lift_zone("y").await;
    north.read_list(&central).await;
    north.settle(&central).await;
    assert_eq!(north.ids(), ["x"]);
    assert_eq!(north.zones(), central.zones().await);
    assert!(north.holds().is_empty());
    north.end().await;
}

#[tokio::test]
async fn what_was_changed_here_since_is_put_there_as_something_new() {
    let (central, north) = deaf().await;
    north
        .told_in_vain(&central, north.put_zone("y", 350.0, 0.0, 20.0))
        .await;
    central.lift_zone("y").await;
    north.put_zone("y", 350.0, 0.0, 30.0).await;
    north.read_list(&central).await;
    north.settle(&central).await;
    assert_eq!(central.zones().await[1], ("y".to_owned(), 30.0));
    assert_eq!(north.zones(), central.zones().await);
    assert_eq!((north.holds().len(), north.sync().forwards_refused), (0, 0));
    north.end().await;
}

#[tokio::test]
async fn what_was_lifted_here_since_is_gone_already() {
    let (central, north) = deaf().await;
    north
        .told_in_vain(&central, north.put_zone("y", 350.0, 0.0, 20.0))
        .await;
    central.lift_zone("y").await;
    north.lift_zone("y").await;
    north.read_list(&central).await;
    north.settle(&central).await;
    assert_eq!(north.ids(), ["x"]);
    assert_eq!(north.zones(), central.zones().await);
    assert_eq!((north.holds().len(), north.sync().forwards_refused), (0, 0));
    north.end().await;
}

#[tokio::test]
async fn what_was_lifted_put_and_lifted_again_is_lifted_once() {
    let (central, north) = deaf().await;
    north.told_in_vain(&central, north.lift_zone("x")).await;
    north.put_zone("x", 150.0, 0.0, 30.0).await;
    north.lift_zone("x").await;
    north.line.straighten();
    north.line.take_no_writes(false);
    north.settle(&central).await;
    assert!(north.ids().is_empty() && central.zones().await.is_empty());
    assert_eq!((north.holds().len(), north.sync().forwards_refused), (0, 0));
    north.end().await;
}

/// What stands here has no version of the registry then, but what waits to be told has.
#[tokio::test]
async fn what_was_lifted_and_put_anew_here_is_new_there_where_a_list_lacks_it() {
    let (central, north) = deaf().await;
    north.line.take_no_writes(true);
    north.put_zone("x", 150.0, 0.0, 30.0).await;
    north.lift_zone("x").await;
    north.put_zone("x", 150.0, 0.0, 40.0).await;
    central.lift_zone("x").await;
    north.read_list(&central).await;
    north.settle(&central).await;
    assert_eq!(central.zones().await, [("x".to_owned(), 40.0)]);
    assert_eq!(north.zones(), central.zones().await);
    assert_eq!((north.holds().len(), north.sync().forwards_refused), (0, 0));
    north.end().await;
}

#[tokio::test]
async fn an_answer_from_before_a_backup_was_restored_does_not_count() {
    let mut central = Central::open().await;
    central.put_zone("x", 150.0, 0.0, 20.0).await;
    let north = Outpost::set(&central, "north");
    north.settle(&central).await;
    let backup = central.back_up();
    north.line.bend(|_| Err(cut()));
    north.line.delay_answers(true);
    north.put_zone("y", 350.0, 0.0, 20.0).await;
    north
        .until("it is told", async || central.zones().await.len() == 2)
        .await;
    central.restore_backup(backup).await;
    north.line.lead_to(Some(&central.registry));
    north.line.straighten();
    north.has_read(&central).await;
    assert_eq!(central.zones().await.len(), 1, "it was lost");
    north.line.delay_answers(false);
    north.settle(&central).await;
    assert_eq!(north.ids(), ["x", "y"]);
    assert_eq!(north.zones(), central.zones().await);
    north.end().await;
}

/// An edge that is deaf, and has lifted a zone that was changed and lifted there.
async fn at_odds() -> (Central, Outpost) {
    let (central, north) = deaf().await;
    central.put_zone("x", 150.0, 0.0, 30.0).await;
    central.lift_zone("x").await;
    north.lift_zone("x").await;
    (central, north)
}

#[tokio::test]
async fn a_removal_that_finds_nothing_waits_for_the_log() {
    let (central, north) = at_odds().await;
    let writes = north.line.writes().len();
    north
        .until("it was tried often", async || {
            north.hand.advance(SignedDuration::from_secs(1));
            north.line.writes().len() >= writes + 12
        })
        .await;
    assert_eq!((north.holds().len(), north.sync().outbox), (0, 1));
    north.line.straighten();
    north.settle(&central).await;
    assert!(north.ids().is_empty() && north.holds().is_empty());
    assert_eq!(north.sync().forwards_refused, 0);
    north.end().await;
}

#[tokio::test]
async fn a_removal_that_was_refused_is_told_again_when_it_is_released() {
    let (central, north) = at_odds().await;
    north.gives_up().await;
    let hold = north.holds().remove(0);
    assert_eq!((&*hold.reason, north.sync().outbox), ("refused_there", 0));
    north.decide(&hold, Decision::Accept).await;
    assert_eq!(north.sync().outbox, 1, "it waits to be told again");
    north.line.straighten();
    north.settle(&central).await;
    assert!(north.ids().is_empty() && north.holds().is_empty());
    north.end().await;
}

#[tokio::test]
async fn a_removal_that_finds_nothing_is_done_once_the_log_is_read() {
    let (central, north) = at_odds().await;
    north.gives_up().await;
    let hold = north.holds().remove(0);
    north.line.straighten();
    north.settle(&central).await;
    north.decide(&hold, Decision::Accept).await;
    // Nothing but what is new ends a question for the log here.
    for place in 0..4 {
        central
            .put_zone(&format!("z{place}"), 350.0, 0.0, 20.0)
            .await;
        north.has_read(&central).await;
    }
    north.settle(&central).await;
    assert_eq!(north.zones(), central.zones().await);
    assert!(north.holds().is_empty());
    north.end().await;
}

/// What was to be replaced is there as before, and what comes next has to replace that.
#[tokio::test]
async fn what_comes_after_a_refused_change_replaces_the_same_version() {
    let (central, north) = deaf().await;
    north.line.take_no_writes(true);
    north.put_zone("x", 150.0, 0.0, 30.0).await;
    north.lift_zone("x").await;
    north.line.refuse_next_write();
    north.line.take_no_writes(false);
    north
        .until("it is told", async || north.sync().outbox == 0)
        .await;
    assert!(central.zones().await.is_empty());
    assert_eq!(north.sync().forwards_refused, 1);
    north.end().await;
}
