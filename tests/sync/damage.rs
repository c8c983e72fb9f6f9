//! Pages that arrive damaged, out of order, or with something in them that is not valid.

use crate::stage::{Central, NETWORK, Outpost};
use skyway::edge::Settings;
use skyway::edge::sync::{ClientError, RegistryClient, RegistryWrite};
use skyway::registry::Follow;
use skyway::wire::{
    ChangeOperation, ChangesPage, EdgeNews, EdgeNoted, EdgeReport, NetworkStatistics, NewsTaken,
    PositionBatch, RegistrySnapshot, Written,
};
use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A small generator of numbers (splitmix64): the same seed, the same numbers.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, limit: usize) -> usize {
        usize::try_from(self.roll() % (limit.max(1) as u64)).expect("small")
    }
}

fn rounds() -> u64 {
    #[expect(
        clippy::disallowed_methods,
        reason = "how long to try is said from outside"
    )]
    let said = std::env::var("SKYWAY_FAULT_ROUNDS").ok();
    said.map_or(1_000, |text| text.parse().expect("a number of rounds"))
}

/// What a page becomes on its way: one of many kinds of damage.
fn damaged(
    page: &ChangesPage,
    old: &ChangesPage,
    dice: &mut Dice,
) -> Result<ChangesPage, ClientError> {
    let mut page = page.clone();
    let last = page.changes.len() - 1;
    match dice.below(9) {
        0 | 1 => {
            return in_text(&page, |text| {
                let place = dice.below(text.len());
                text[place] ^= 1 << dice.below(8);
            });
        }
        2 => return in_text(&page, |text| text.truncate(dice.below(text.len()))),
        3 => page.changes.swap(dice.below(last), last),
        4 => {
            page.changes.remove(dice.below(last + 1));
        }
        5 => {
            let again = page.changes[dice.below(last + 1)].clone();
            page.changes.insert(dice.below(last + 1), again);
        }
        6 => return Ok(old.clone()),
        7 => {
            page.registry_id = "another".to_owned();
            page.checksum = page.digest();
        }
        _ => {
            let change = &mut page.changes[dice.below(last + 1)];
            match dice.below(4) {
                0 => change.revision += 1,
                1 => change.operation = ChangeOperation::Delete,
                2 => change.id.push('x'),
                _ => change.body = Some("{}".to_owned()),
            }
        }
    }
    Ok(page)
}

fn in_text(
    page: &ChangesPage,
    damage: impl FnOnce(&mut Vec<u8>),
) -> Result<ChangesPage, ClientError> {
    let mut text = serde_json::to_vec(page).expect("JSON");
    damage(&mut text);
    serde_json::from_slice(&text).map_err(|error| ClientError::Unreadable(error.to_string()))
}

/// However a page is damaged: nothing that is in force is lifted or shrinks, nothing comes that the registry did not
/// put, the damage is told, and the next good page is taken over.
#[tokio::test]
async fn whatever_happens_to_a_page_the_last_good_state_stays_in_service() {
    let central = Central::open().await;
    for place in 0..4 {
        let x = 50.0 + 100.0 * f64::from(place);
        central.put_zone(&format!("old{place}"), x, 0.0, 20.0).await;
    }
    let base = central.head().await;
    let request = skyway::registry::SnapshotRequest::default();
    let list = central.registry.snapshot(NETWORK, &request).await;
    let list = list.expect("a list");
    for place in 0..3 {
        let x = 50.0 + 100.0 * f64::from(place);
        central
            .put_zone(&format!("new{place}"), x, 100.0, 20.0)
            .await;
    }
    central.put_zone("old0", 50.0, 0.0, 40.0).await;
    central.put_zone("old1", 150.0, 0.0, 4.0).await;
    central.lift_zone("old2").await;
    let page = page_after(&central, base).await;
    let old = page_after(&central, base - 2).await;
    let good = central.zones().await;
    let widest: BTreeMap<String, f64> = [("new0", 20.0), ("new1", 20.0), ("new2", 20.0)]
        .into_iter()
        .chain([
            ("old0", 40.0),
            ("old1", 20.0),
            ("old2", 20.0),
            ("old3", 20.0),
        ])
        .map(|(id, radius_m)| (id.to_owned(), radius_m))
        .collect();
    let mut taken = 0;
    for seed in 0..rounds() {
        let mut dice = Dice(seed);
        let bent = damaged(&page, &old, &mut dice);
        if bent.as_ref() == Ok(&page) {
            continue;
        }
        let script = Script::of(&list, bent.clone());
        let north = Outpost::reading(script.clone(), Settings::default());
        north
            .until("it was judged", async || script.asked() > 1)
            .await;
        let stamp = north.edge.stamp();
        let cursor = stamp.registry_revision.expect("a cursor");
        assert_eq!(cursor.revision, base, "seed {seed}: {bent:?}");
        let zones: BTreeMap<String, f64> = north.zones().into_iter().collect();
        for id in ["old0", "old1", "old2", "old3"] {
            let kept = zones.get(id).is_some_and(|own| *own >= 20.0);
            assert!(kept, "seed {seed}: {id} of {zones:?} by {bent:?}");
        }
        for (id, radius_m) in &zones {
            let is_theirs = widest.get(id).is_some_and(|most| radius_m <= most);
            assert!(is_theirs, "seed {seed}: {id} {radius_m} by {bent:?}");
        }
        let sync = north.sync();
        assert!(sync.nacks > 0, "seed {seed}: {sync:?} by {bent:?}");
        taken += u64::from(zones.len() > 4);
        script.go_on(page.clone());
        north
            .until("the good page is in service", async || {
                let cursor = north.edge.stamp().registry_revision;
                cursor.is_some_and(|cursor| cursor.revision == page.revision)
            })
            .await;
        assert_eq!(north.zones(), good, "seed {seed}: {bent:?}");
        north.end().await;
    }
    println!(
        "{} damaged pages, restrictions taken over of {taken}",
        rounds()
    );
    assert!(
        taken > rounds() / 20,
        "restrictions are taken over of damaged pages"
    );
}

async fn page_after(central: &Central, after: u64) -> ChangesPage {
    let follow = Follow {
        after,
        ..Follow::default()
    };
    let page = central
        .registry
        .changes(NETWORK, &follow, std::future::ready(()))
        .await;
    page.expect("a page")
}

/// A registry that says what it is told to: a list, and one page after the other.
#[derive(Clone)]
struct Script {
    list: RegistrySnapshot,
    pages: Arc<Mutex<VecDeque<Result<ChangesPage, ClientError>>>>,
    asked: Arc<AtomicU64>,
}

impl Script {
    fn of(list: &RegistrySnapshot, page: Result<ChangesPage, ClientError>) -> Self {
        Self {
            list: list.clone(),
            pages: Arc::new(Mutex::new(VecDeque::from([page]))),
            asked: Arc::default(),
        }
    }

    /// How often a page was asked for.
    fn asked(&self) -> u64 {
        self.asked.load(Ordering::Relaxed)
    }

    fn go_on(&self, page: ChangesPage) {
        self.pages.lock().expect("whole").push_back(Ok(page));
    }
}

impl RegistryClient for Script {
    async fn changes(&self, _: u64, _: u64, _: Duration) -> Result<ChangesPage, ClientError> {
        self.asked.fetch_add(1, Ordering::Relaxed);
        let next = self.pages.lock().expect("whole").pop_front();
        next.unwrap_or_else(|| Err(ClientError::Transport("nothing more".to_owned())))
    }

    async fn snapshot(&self, _: Option<&str>) -> Result<RegistrySnapshot, ClientError> {
        Ok(self.list.clone())
    }

    async fn write(&self, _: &RegistryWrite) -> Result<Written, ClientError> {
        Err(ClientError::Transport("it only tells".to_owned()))
    }

    async fn report(&self, _: &EdgeReport) -> Result<EdgeNoted, ClientError> {
        Ok(EdgeNoted::default())
    }

    async fn news(&self, _: &EdgeNews) -> Result<NewsTaken, ClientError> {
        Err(ClientError::Transport("it only tells".to_owned()))
    }

    async fn statistics(&self) -> Result<NetworkStatistics, ClientError> {
        Err(ClientError::Transport("it only tells".to_owned()))
    }

    async fn positions(&self, _: &Arc<PositionBatch>) -> Result<(), ClientError> {
        Err(ClientError::Transport("it only tells".to_owned()))
    }
}

/// A page and a list with a zone in them that this edge cannot read.
fn poison_page(mut page: ChangesPage) -> ChangesPage {
    for change in &mut page.changes {
        if change.id == "bad" && change.body.is_some() {
            change.body = Some(r#"{"type":"Feature","id":"bad","geometry":null}"#.to_owned());
            change.sha256 = change.digest(NETWORK);
        }
    }
    page.checksum = page.digest();
    page
}

fn poison_list(mut page: RegistrySnapshot) -> RegistrySnapshot {
    for object in &mut page.objects {
        if object.id == "bad" {
            object.body = r#"{"type":"Feature","id":"bad","geometry":null}"#.to_owned();
            object.sha256 = object.digest(NETWORK);
        }
    }
    page.checksum = page.digest();
    page
}

#[tokio::test]
async fn what_cannot_be_read_blocks_removals_and_never_restrictions() {
    let central = Central::open().await;
    central.put_zone("a", 50.0, 0.0, 5.0).await;
    central.put_zone("b", 150.0, 0.0, 5.0).await;
    let north = Outpost::set(&central, "north");
    north.settle(&central).await;
    let cursor = north.edge.stamp().registry_revision;
    north.line.bend(|page| Ok(poison_page(page)));
    north.line.bend_list(|page| Ok(poison_list(page)));
    central.put_zone("bad", 650.0, 0.0, 5.0).await;
    north
        .until("it is refused", async || north.sync().nacks > 0)
        .await;
    let nack = north.sync().last_nack.expect("a reason");
    assert_eq!(
        (&*nack.code, nack.object.as_deref()),
        ("zone_invalid", Some("zone bad"))
    );
    // The log goes on: what is stricter is in force all the same, what is not waits.
    central.put_zone("c", 250.0, 0.0, 5.0).await;
    north
        .until("c is in force", async || {
            north.ids().contains(&"c".to_owned())
        })
        .await;
    central.lift_zone("a").await;
    central.put_zone("b", 150.0, 0.0, 9.0).await;
    central.put_zone("c", 250.0, 0.0, 1.0).await;
    central.put_zone("d", 350.0, 0.0, 5.0).await;
    north
        .until("d is in force", async || {
            north.ids().contains(&"d".to_owned())
        })
        .await;
    let zones = [("a", 5.0), ("b", 9.0), ("c", 5.0), ("d", 5.0)];
    let zones = zones.map(|(id, radius_m)| (id.to_owned(), radius_m));
    north
        .until("b is wider", async || north.zones() == zones)
        .await;
    assert_eq!(north.edge.stamp().registry_revision, cursor, "it stays");
    // The registry hears of it.
    north
        .until("it is reported", async || {
            let reports = north.line.reports();
            let last = reports.last().and_then(|report| report.nack.clone());
            last.is_some_and(|nack| nack.code == "zone_invalid")
        })
        .await;
    // Once the zone is put right or lifted, all is taken over.
    central.lift_zone("bad").await;
    north.settle(&central).await;
    assert_eq!(north.zones(), central.zones().await);
    assert_eq!(north.sync().last_nack, None);
    north.end().await;
}

#[tokio::test]
async fn a_list_whose_pages_are_damaged_is_read_again() {
    let central = Central::open().await;
    for place in 0..7 {
        let x = 50.0 + 100.0 * f64::from(place);
        central.put_zone(&format!("z{place}"), x, 0.0, 5.0).await;
    }
    let north = Outpost::set(&central, "north");
    let mut pages = 0;
    north.line.bend_list(move |mut page| {
        pages += 1;
        match pages {
            2 => page.object_count += 1,
            5 => page.objects.clear(),
            8 => page.revision += 1,
            9 => return Err(ClientError::Unreadable("cut".to_owned())),
            _ => return Ok(page),
        }
        // Sealed again, so that only what it says is wrong.
        page.checksum = page.digest();
        Ok(page)
    });
    north.settle(&central).await;
    assert_eq!(north.ids().len(), 7);
    assert!(north.sync().nacks >= 3, "{:?}", north.sync());
    north.end().await;
}

/// A zone is put and moved, and the first page of it is damaged. What is in force afterwards is what the good pages say:
/// up to the one before the move, the zone is where it was put.
#[tokio::test]
async fn a_version_in_doubt_opens_nothing_that_a_good_page_closes() {
    let central = Central::open().await;
    let request = skyway::registry::SnapshotRequest::default();
    let list = central.registry.snapshot(NETWORK, &request).await;
    let base = central.head().await;
    central.put_zone("moved", 50.0, 0.0, 5.0).await;
    let put = page_after(&central, base).await;
    central.put_zone("moved", 250.0, 0.0, 6.0).await;
    let mut damaged = page_after(&central, base).await;
    damaged.changes.remove(0);
    let moved = page_after(&central, put.revision).await;
    let script = Script::of(&list.expect("a list"), Ok(damaged));
    let north = Outpost::reading(script.clone(), Settings::default());
    let shows = async |radius_m: f64| north.zones() == [("moved".to_owned(), radius_m)];
    north
        .until("what is put is in force at once", async || shows(6.0).await)
        .await;
    for (page, radius_m) in [(put, 5.0), (moved, 6.0)] {
        let revision = page.revision;
        script.go_on(page);
        north
            .until("the good page is in service", async || {
                let cursor = north.edge.stamp().registry_revision;
                cursor.is_some_and(|cursor| cursor.revision == revision)
            })
            .await;
        assert!(shows(radius_m).await, "at {revision}: {:?}", north.zones());
    }
    north.end().await;
}
