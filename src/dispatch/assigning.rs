//! Which drone flies which delivery: orders that come within a moment are assigned together, one that comes alone at once.

use super::Dispatch;
use super::changes::Change;
use super::records::{Asking, CALLING_OFF, Kept, Order, RESERVING};
use crate::refusal::Refusal;
use crate::registry::documents::{DocumentKind, DocumentQuery};
use crate::wire::DeliveryStatus;
use jiff::Timestamp;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;
use tokio::task::JoinSet;

/// How long orders gather after a round.
const GATHERED_FOR: Duration = Duration::from_millis(100);
/// How often orders are looked at though nothing is known to have come: those that other processes took, and those whose
/// time has come.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// The most orders that are looked at in a round; the next round goes on after them.
const ORDERS_AT_ONCE: u64 = 1_000;
/// The most orders whose edges are being asked at the same time.
const ASKED_AT_ONCE: usize = 64;

/// Where the rounds of a process are.
#[derive(Debug, Default)]
struct Rounds {
    /// After which order the next round begins.
    after: Option<String>,
    /// Orders whose edges are being asked.
    asking: BTreeSet<String>,
    /// Those that answer to them.
    asked: JoinSet<String>,
}

impl Dispatch {
    /// Assigns drones to orders as they come, for ever.
    pub(super) async fn assign_orders(self: &Arc<Self>) {
        let mut rounds = Rounds::default();
        loop {
            // A lapse is as good as a notice.
            let _lapsed = tokio::time::timeout(LOOK_EVERY, self.orders.notified()).await;
            while let Some(done) = rounds.asked.try_join_next() {
                match done {
                    Ok(id) => {
                        rounds.asking.remove(&id);
                    }
                    // Who has panicked says not for which order: all are free to be asked again.
                    Err(_) => rounds.asking.clear(),
                }
            }
            match self.round(&mut rounds.after).await {
                Ok(orders) => self.ask_edges(orders, &mut rounds),
                Err(refusal) => tracing::warn!(%refusal, "orders are not assigned"),
            }
            tokio::time::sleep(GATHERED_FOR).await;
        }
    }

    /// Assigns drones once to the orders that wait, and asks their edges, one after the other. For those who drive it by
    /// hand; [`Dispatch::run`] does it as orders come.
    ///
    /// # Errors
    /// When the store does not answer.
    pub async fn assign_now(self: &Arc<Self>) -> Result<usize, Refusal> {
        let orders = self.round(&mut None).await?;
        for id in &orders {
            self.ask_edge(id).await?;
        }
        Ok(orders.len())
    }

    fn ask_edges(self: &Arc<Self>, orders: Vec<String>, rounds: &mut Rounds) {
        for id in orders {
            if rounds.asking.len() >= ASKED_AT_ONCE {
                // They are found again in the next round.
                self.orders.notify_one();
                return;
            }
            if !rounds.asking.insert(id.clone()) {
                continue;
            }
            let dispatch = self.clone();
            rounds.asked.spawn(async move {
                if let Err(refusal) = dispatch.ask_edge(&id).await {
                    tracing::warn!(delivery = id, %refusal, "an edge is not asked");
                }
                dispatch.orders.notify_one();
                id
            });
        }
    }

    /// One round over the orders that are open: reserves drones for those that wait. Tells whose edges are to be asked.
    async fn round(&self, after: &mut Option<String>) -> Result<Vec<String>, Refusal> {
        let now = self.clock.now();
        let mut to_ask = Vec::new();
        let mut waiting: BTreeMap<String, Vec<Kept<Order>>> = BTreeMap::new();
        for order in self.open_orders(after).await? {
            if order.value.dispatch.asking != Asking::Nothing {
                if order.is_to_be_asked(now) {
                    to_ask.push(order.document.id);
                }
            } else if now >= order.value.waits_until() {
                self.expire(order, now).await?;
            } else if order.value.dispatch.next_look_ms <= now.as_millisecond() {
                let network = order.value.delivery.network.clone();
                waiting.entry(network).or_default().push(order);
            }
        }
        for (network, orders) in waiting {
            match self.assign_over(&network, orders, now).await {
                Ok(reserved) => to_ask.extend(reserved),
                Err(refusal) => tracing::warn!(network, %refusal, "orders are not assigned"),
            }
        }
        Ok(to_ask)
    }

    /// A part of the orders that are open, from where the last part ended.
    async fn open_orders(&self, after: &mut Option<String>) -> Result<Vec<Kept<Order>>, Refusal> {
        let open = [DeliveryStatus::Created.name(), RESERVING, CALLING_OFF];
        let query = DocumentQuery {
            kind: DocumentKind::Delivery,
            of: None,
            states: open.map(str::to_owned).to_vec(),
            after: after.take(),
            limit: ORDERS_AT_ONCE,
        };
        let documents = self.documents.documents(&query).await?;
        if documents.len() as u64 == ORDERS_AT_ONCE {
            *after = documents.last().map(|last| last.id.clone());
            self.orders.notify_one();
        }
        documents.into_iter().map(Kept::read).collect()
    }

    /// Answers an order that has waited too long.
    async fn expire(&self, mut order: Kept<Order>, now: Timestamp) -> Result<(), Refusal> {
        let waited_for = order.value.delivery.reason.take();
        let reason = match waited_for {
            Some(waited_for) => format!("no drone was assigned in time: {waited_for}"),
            None => "no drone was assigned in time".to_owned(),
        };
        let is_told = order
            .value
            .set_status(DeliveryStatus::Failed, Some(reason), now, None);
        let change = Change {
            order,
            drone: None,
            is_told,
        };
        // Where it has moved meanwhile the next round looks again.
        self.commit_change(&change, now).await?;
        Ok(())
    }

    /// Notes what an order waits for, and from when on it is looked at again; nothing where that is noted.
    pub(super) async fn note(
        &self,
        mut order: Kept<Order>,
        reason: String,
        next_look: Timestamp,
        now: Timestamp,
    ) -> Result<(), Refusal> {
        let next_look_ms = next_look.as_millisecond();
        let is_noted = order.value.delivery.reason.as_deref() == Some(&reason)
            && order.value.dispatch.next_look_ms == next_look_ms;
        let is_as_before =
            order.value.delivery.reason.as_deref() == Some(&reason) && next_look <= now;
        if is_noted || is_as_before {
            return Ok(());
        }
        order.value.delivery.reason = Some(reason);
        order.value.dispatch.next_look_ms = next_look_ms;
        let change = Change {
            order,
            drone: None,
            is_told: false,
        };
        self.commit_change(&change, now).await?;
        Ok(())
    }
}
