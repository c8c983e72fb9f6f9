//! Changes made at an edge that was away and meets a newer version: applied where they enlarge, else held.

use crate::line::cut;
use crate::stage::{Central, NETWORK, Outpost};
use skyway::edge::Decision;
use skyway::edge::sync::ClientError;
use skyway::registry::SnapshotRequest;

/// An edge that is cut off with the zone `x` around a1-a2 in force, of 20 m.
async fn cut_off() -> (Central, Outpost) {
    let central = Central::open().await;
    central.put_zone("x", 150.0, 0.0, 20.0).await;
    let north = Outpost::set(&central, "north");
    north.settle(&central).await;
    north.line.cut();
    (central, north)
}

async fn reunite(central: &Central, north: &Outpost) {
    north.line.lead_to(Some(&central.registry));
    north.settle(central).await;
}

#[tokio::test]
async fn an_enlargement_is_written_in_place_of_the_newer_version() {
    let (central, north) = cut_off().await;
    central.put_zone("x", 150.0, 0.0, 30.0).await;
    north.put_zone("x", 150.0, 0.0, 90.0).await;
    reunite(&central, &north).await;
    assert_eq!(central.zones().await, [("x".to_owned(), 90.0)]);
    assert_eq!(north.zones(), central.zones().await);
    assert!(north.holds().is_empty());
    north.end().await;
}

#[tokio::test]
async fn a_shrinking_waits_and_theirs_stays_in_force() {
    let (central, north) = cut_off().await;
    central.put_zone("x", 150.0, 0.0, 90.0).await;
    north.put_zone("x", 150.0, 0.0, 5.0).await;
    reunite(&central, &north).await;
    assert_eq!(north.zones(), [("x".to_owned(), 90.0)]);
    assert_eq!(central.zones().await, north.zones());
    let hold = &north.holds()[0];
    assert_eq!((&*hold.reason, &hold.kept_as), ("changed_elsewhere", &None));
    let ours = hold.ours.as_ref().expect("what would be put");
    assert_eq!(ours["properties"]["radius_m"], 5.0);
    north.decide(hold, Decision::Accept).await;
    assert_eq!(north.zones(), [("x".to_owned(), 5.0)]);
    north.settle(&central).await;
    assert_eq!(central.zones().await, [("x".to_owned(), 5.0)]);
    north.end().await;
}

#[tokio::test]
async fn where_neither_holds_the_other_both_are_in_force() {
    let (central, north) = cut_off().await;
    central.put_zone("x", 350.0, 0.0, 20.0).await;
    north.put_zone("x", 550.0, 0.0, 20.0).await;
    reunite(&central, &north).await;
    assert_eq!(north.blocked(), 2);
    let hold = north.holds().remove(0);
    let aside = hold.kept_as.clone().expect("it is kept beside");
    assert_eq!(north.ids().len(), 2);
    assert!(north.ids().contains(&aside.to_string()));
    // Theirs moves on: the hold stands, ours stays.
    central.put_zone("x", 250.0, 0.0, 20.0).await;
    north.settle(&central).await;
    assert_eq!(north.blocked(), 2);
    assert_eq!(central.zones().await.len(), 1, "what is held is not told");
    north.decide(&hold, Decision::Accept).await;
    north.settle(&central).await;
    assert_eq!(north.ids(), ["x"]);
    assert_eq!(north.blocked(), 1);
    let (written, _) = central
        .registry
        .object(crate::stage::NETWORK, skyway::wire::ObjectKind::Zone, "x")
        .await
        .expect("a zone");
    assert!(written.contains("550.0"), "{written}");
    north.end().await;
}

#[tokio::test]
async fn a_rejected_change_leaves_theirs_alone() {
    let (central, north) = cut_off().await;
    central.put_zone("x", 350.0, 0.0, 20.0).await;
    north.put_zone("x", 550.0, 0.0, 20.0).await;
    reunite(&central, &north).await;
    north.decide(&north.holds()[0], Decision::Reject).await;
    assert_eq!((north.ids(), north.blocked()), (vec!["x".to_owned()], 1));
    let head = central.head().await;
    north.settle(&central).await;
    assert_eq!(central.head().await, head, "nothing was written");
    north.end().await;
}

#[tokio::test]
async fn a_removal_waits_and_the_zone_is_in_force_again() {
    let (central, north) = cut_off().await;
    central.put_zone("x", 150.0, 0.0, 30.0).await;
    north.lift_zone("x").await;
    assert_eq!(north.blocked(), 0);
    reunite(&central, &north).await;
    assert_eq!(north.zones(), [("x".to_owned(), 30.0)]);
    let hold = &north.holds()[0];
    assert_eq!((&hold.ours, &*hold.closures[0]), (&None, "x"));
    north.decide(hold, Decision::Accept).await;
    north.settle(&central).await;
    assert!(central.zones().await.is_empty() && north.ids().is_empty());
    north.end().await;
}

#[tokio::test]
async fn what_was_lifted_there_and_changed_here_is_put_there_again() {
    let (central, north) = cut_off().await;
    central.lift_zone("x").await;
    north.put_zone("x", 150.0, 0.0, 40.0).await;
    reunite(&central, &north).await;
    assert_eq!(central.zones().await, [("x".to_owned(), 40.0)]);
    assert_eq!(north.zones(), central.zones().await);
    assert!(north.holds().is_empty());
    north.end().await;
}

#[tokio::test]
async fn what_both_have_lifted_is_gone() {
    let (central, north) = cut_off().await;
    central.lift_zone("x").await;
    north.lift_zone("x").await;
    reunite(&central, &north).await;
    assert!(central.zones().await.is_empty() && north.ids().is_empty());
    assert!(north.holds().is_empty());
    assert_eq!(north.sync().forwards_refused, 0);
    north.end().await;
}

#[tokio::test]
async fn two_new_zones_of_one_id_meet_as_changes_do() {
    let (central, north) = Outpost::alone().await;
    north.line.cut();
    north.put_zone("x", 150.0, 0.0, 20.0).await;
    central.put_zone("x", 350.0, 0.0, 20.0).await;
    reunite(&central, &north).await;
    assert_eq!(north.blocked(), 2);
    assert_eq!(north.holds().len(), 1);
    north.end().await;
}

#[tokio::test]
async fn a_change_made_after_seeing_ours_is_no_conflict() {
    let central = Central::open().await;
    let north = Outpost::set(&central, "north");
    let south = Outpost::set(&central, "south");
    north.settle(&central).await;
    south.settle(&central).await;
    // Nothing said reaches north for a while, though what it writes does.
    north.line.bend(|page| {
        let _unheard = page;
        Err(skyway::edge::sync::ClientError::Transport(
            "lost".to_owned(),
        ))
    });
    north.line.lose_answers(true);
    north.put_zone("x", 150.0, 0.0, 20.0).await;
    south
        .until("it has come", async || south.blocked() == 1)
        .await;
    south.put_zone("x", 350.0, 0.0, 20.0).await;
    south.settle(&central).await;
    north.line.lose_answers(false);
    north.line.straighten();
    north.settle(&central).await;
    assert_eq!(north.zones(), south.zones());
    assert!(north.holds().is_empty(), "{:?}", north.holds());
    north.end().await;
    south.end().await;
}

/// No digest protects the answer to a write: a version that was bent on its way would hide all that comes before it.
#[tokio::test]
async fn a_bent_answer_to_a_write_is_asked_for_again() {
    let (central, north) = cut_off().await;
    north.put_zone("y", 350.0, 0.0, 20.0).await;
    let mut answers = 0;
    north.line.bend_written(move |mut written| {
        answers += 1;
        if answers == 1 {
            written.etag = Some("\"1-1025\"".to_owned());
        }
        written
    });
    reunite(&central, &north).await;
    central.put_zone("y", 350.0, 0.0, 30.0).await;
    north.settle(&central).await;
    assert_eq!(north.zones(), central.zones().await);
    assert!(north.holds().is_empty());
    north.end().await;
}

/// A list says nothing of what was made after it: a removal that waits for such a thing still has to be told.
#[tokio::test]
async fn a_removal_is_not_done_because_an_earlier_list_lacks_it() {
    let (central, north) = cut_off().await;
    central.put_zone("z", 550.0, 0.0, 20.0).await;
    let everything = SnapshotRequest {
        size: Some(1_000),
        token: None,
    };
    let list = central.registry.snapshot(NETWORK, &everything).await;
    let list = list.expect("a list");
    let cursor = format!("1-{}", list.revision);
    north.line.bend(|_| Err(cut()));
    north.line.bend_list(|_| Err(cut()));
    north.line.lead_to(Some(&central.registry));
    north.put_zone("y", 350.0, 0.0, 20.0).await;
    north
        .until("it is told", async || north.sync().outbox == 0)
        .await;
    north.line.take_no_writes(true);
    north.lift_zone("y").await;
    // The list that was on its way all along.
    north.line.bend_list(move |_| Ok(list.clone()));
    north.line.bend(|_| {
        Err(ClientError::Refused {
            status: 410,
            code: "changes_gone".to_owned(),
            detail: String::new(),
            retry_after_s: None,
        })
    });
    let is_read = async || {
        let revision = north.edge.stamp().registry_revision;
        revision.is_some_and(|revision| revision.to_string() == cursor)
    };
    north.until("the list is taken over", is_read).await;
    assert_eq!(north.sync().outbox, 1);
    north.line.straighten();
    north.line.take_no_writes(false);
    north.settle(&central).await;
    assert_eq!(north.ids(), ["x", "z"]);
    assert_eq!(north.zones(), central.zones().await);
    north.end().await;
}
