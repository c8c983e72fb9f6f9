//! What a customer wants, read strictly: from where to where, what, when, and for how much.

use super::Dispatch;
use super::ways::{Errand, Ways};
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{Id, Money};
use skyway_market::matching::Sought;
use skyway_market::money::is_currency;
use skyway_service::intake::Faults;
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;

/// The heaviest payload, in kilograms; more is a slip of units.
const PAYLOAD_MAX_KG: f64 = 100.0;
/// How far ahead a pickup may be: edges compose no flight beyond.
pub(super) const START_AHEAD_MAX: SignedDuration = SignedDuration::from_hours(24 * 7);
/// How long after the earliest pickup the latest arrival may be: until then the order waits for a drone.
const ARRIVAL_AFTER_MAX: SignedDuration = SignedDuration::from_hours(24 * 7);

/// What is stated of an errand, as it came.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stated<'a> {
    pub(super) network: &'a str,
    pub(super) source: &'a Id<'static>,
    pub(super) destination: &'a Id<'static>,
    pub(super) payload_kg: f64,
    pub(super) start_time: Option<&'a str>,
    pub(super) arrive_by: Option<&'a str>,
    pub(super) price_max: Option<&'a Money>,
    pub(super) on_time_min_fraction: Option<f64>,
}

/// An errand that can be looked for.
#[derive(Debug)]
pub(super) struct Wanted {
    pub(super) network: String,
    pub(super) pickup: String,
    pub(super) drop: String,
    pub(super) payload_kg: f64,
    now: Timestamp,
    /// From when it may be picked up; never in the past.
    pub(super) ready_at: Timestamp,
    pub(super) arrive_by: Option<Timestamp>,
    pub(super) price_max: Option<Money>,
    on_time_min_fraction: Option<f64>,
    pub(super) ways: Arc<Ways>,
    pub(super) errand: Errand,
}

impl Wanted {
    /// The same, as services are matched with it.
    pub(super) fn sought(&self) -> Sought<'_> {
        Sought {
            payload_kg: self.payload_kg,
            now: self.now,
            ready_at: self.ready_at,
            arrive_by: self.arrive_by,
            price_max: self.price_max.as_ref(),
            on_time_min_fraction: self.on_time_min_fraction,
        }
    }
}

impl Dispatch {
    /// Reads what is wanted.
    ///
    /// # Errors
    /// When there is no such network, or something of it cannot be; when the store does not answer.
    pub(super) async fn wanted(&self, stated: Stated<'_>, what: &str) -> Result<Wanted, Refusal> {
        let ways = self.ways(stated.network).await?;
        let now = self.clock.now();
        let mut faults = Faults::default();
        let topology = ways.topology();
        let pickup = faults.node("/source", topology, stated.source);
        let drop = faults.node("/destination", topology, stated.destination);
        for (pointer, node) in [("/source", pickup), ("/destination", drop)] {
            if let Some(node) = node.filter(|node| topology.pads(*node) == 0) {
                let message = format!("node '{}' has no pad to land on", topology.node_id(node));
                faults.add("no_pads", pointer, message, None);
            }
        }
        if pickup.is_some() && pickup == drop {
            let message = "the parcel is at this node already".to_owned();
            faults.add("same_node", "/destination", message, None);
        }
        let payload_kg = Some(stated.payload_kg);
        let payload_kg = faults.number("/payload_kg", payload_kg, 0.0, PAYLOAD_MAX_KG);
        faults.fraction("/on_time_min_fraction", stated.on_time_min_fraction);
        check_dearest(stated.price_max, &mut faults);
        let (ready_at, arrive_by) = read_times(&stated, now, &mut faults);
        faults.check(Code::PlanInvalid, what)?;
        let (Some(pickup), Some(drop)) = (pickup, drop) else {
            return Err(Refusal::new(Code::Internal, "a node was not read"));
        };
        Ok(Wanted {
            network: stated.network.to_owned(),
            pickup: stated.source.text().to_owned(),
            drop: stated.destination.text().to_owned(),
            payload_kg: payload_kg.unwrap_or_default(),
            now,
            ready_at,
            arrive_by,
            price_max: stated.price_max.cloned(),
            on_time_min_fraction: stated.on_time_min_fraction,
            errand: Errand::between(&ways, pickup, drop).await?,
            ways,
        })
    }
}

fn check_dearest(price: Option<&Money>, faults: &mut Faults) {
    let Some(price) = price else {
        return;
    };
    if !is_currency(&price.currency) {
        let message = format!("'{}' is no currency", price.currency);
        let hint = Some("write three capital letters, such as AUD".to_owned());
        faults.add("currency_invalid", "/price_max/currency", message, hint);
    }
    if price.amount.is_sign_negative() {
        let message = format!("{} is negative", price.amount);
        faults.add("out_of_range", "/price_max/amount", message, None);
    }
}

/// From when it may be picked up, and until when it has to arrive.
fn read_times(
    stated: &Stated<'_>,
    now: Timestamp,
    faults: &mut Faults,
) -> (Timestamp, Option<Timestamp>) {
    let start = faults.instant("/start_time", stated.start_time);
    let ready_at = start.unwrap_or(now).max(now);
    if ready_at.duration_since(now) > START_AHEAD_MAX {
        let message = "it is more than 7 days ahead".to_owned();
        faults.add("out_of_range", "/start_time", message, None);
    }
    let arrive_by = faults.instant("/arrive_by", stated.arrive_by);
    if arrive_by.is_some_and(|latest| latest <= ready_at) {
        let message = "it has to arrive before it may be picked up".to_owned();
        faults.add("out_of_range", "/arrive_by", message, None);
    }
    if arrive_by.is_some_and(|latest| latest.duration_since(ready_at) > ARRIVAL_AFTER_MAX) {
        let message = "it is more than 7 days after the earliest pickup".to_owned();
        let hint = Some("state an earlier one, or leave it out".to_owned());
        faults.add("out_of_range", "/arrive_by", message, hint);
    }
    (ready_at, arrive_by)
}
