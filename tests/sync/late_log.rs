//! Writes arrive while the log does not: what an edge has told itself comes back to it late, one revision after the other.

use crate::line::cut;
use crate::stage::{Central, Outpost};
use skyway::edge::sync::ClientError;
use skyway::wire::ChangesPage;

/// The first revision of a page.
fn one_revision(mut page: ChangesPage) -> Result<ChangesPage, ClientError> {
    let first = page.changes.first().map(|change| change.revision);
    page.changes.retain(|change| Some(change.revision) == first);
    page.revision = first.unwrap_or(page.revision);
    page.checksum = page.digest();
    Ok(page)
}

impl Outpost {
    async fn told(&self) {
        self.until("all is told", async || self.sync().outbox == 0)
            .await;
    }

    /// Waits until the log was read to its end, page by page.
    async fn read(&self, central: &Central) {
        self.line.bend(one_revision);
        self.has_read(central).await;
    }
}

/// What was lifted from here leaves nothing behind that would know its versions.
#[tokio::test]
async fn an_earlier_version_of_its_own_is_no_conflict() {
    let (central, north) = Outpost::alone().await;
    north.line.bend(|_| Err(cut()));
    north.put_zone("a", 50.0, 0.0, 10.0).await;
    north.told().await;
    north.lift_zone("a").await;
    north.told().await;
    north.line.take_no_writes(true);
    north.put_zone("a", 50.0, 0.0, 5.0).await;
    north.read(&central).await;
    assert_eq!(north.zones(), [("a".to_owned(), 5.0)]);
    assert_eq!((north.holds().len(), north.sync().outbox), (0, 1));
    north.line.take_no_writes(false);
    north.settle(&central).await;
    assert_eq!(central.zones().await, [("a".to_owned(), 5.0)]);
    north.end().await;
}

/// A zone that is put, lifted and put again, all of which the registry has heard before the edge reads any of it.
async fn told_thrice() -> (Central, Outpost) {
    let (central, north) = Outpost::alone().await;
    north.line.bend(|_| Err(cut()));
    north.put_zone("a", 50.0, 0.0, 10.0).await;
    north.told().await;
    north.lift_zone("a").await;
    north.told().await;
    north.put_zone("a", 50.0, 0.0, 20.0).await;
    north.told().await;
    north.line.take_no_writes(true);
    (central, north)
}

#[tokio::test]
async fn an_earlier_removal_of_its_own_is_no_conflict() {
    let (central, north) = told_thrice().await;
    north.put_zone("a", 50.0, 0.0, 15.0).await;
    north.read(&central).await;
    assert_eq!(north.zones(), [("a".to_owned(), 15.0)]);
    assert_eq!((north.holds().len(), north.sync().outbox), (0, 1));
    north.line.take_no_writes(false);
    north.settle(&central).await;
    assert_eq!(central.zones().await, [("a".to_owned(), 15.0)]);
    north.end().await;
}

#[tokio::test]
async fn a_removal_that_waits_outlives_earlier_versions_of_its_own() {
    let (central, north) = told_thrice().await;
    north.lift_zone("a").await;
    north.read(&central).await;
    assert_eq!(north.zones(), []);
    assert_eq!((north.holds().len(), north.sync().outbox), (0, 1));
    north.line.take_no_writes(false);
    north.settle(&central).await;
    assert_eq!(central.zones().await, []);
    north.end().await;
}

/// All removals look the same: the one that waits is not the one that comes back.
#[tokio::test]
async fn a_removal_that_waits_is_not_taken_for_an_earlier_one() {
    let (central, north) = told_thrice().await;
    north.lift_zone("a").await;
    north.line.straighten();
    north.has_read(&central).await;
    assert_eq!(north.zones(), []);
    assert_eq!((north.holds().len(), north.sync().outbox), (0, 1));
    north.line.take_no_writes(false);
    north.settle(&central).await;
    assert_eq!(central.zones().await, []);
    north.end().await;
}
