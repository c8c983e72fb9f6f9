//! Which drone flies which delivery: orders that come within a moment are assigned together, one that comes alone at once.

use super::Dispatch;
use super::changes::Change;
use super::records::{Asking, CALLING_OFF, GIVEN_UP, Kept, Order, RESERVING};
use super::unheard::LookedAt;
use jiff::Timestamp;
use skyway_contract::DeliveryStatus;
use skyway_registry::documents::{DocumentKind, DocumentQuery};
use skyway_service::refusal::Refusal;
use std::collections::BTreeMap;
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
/// The most orders over one network that are assigned together; the next round goes on after them. No more are asked of
/// an edge before it has answered, as these drones fly nothing meanwhile.
pub(super) const TOGETHER_MAX: usize = 256;
/// The most orders whose edges are being asked at the same time.
const ASKED_AT_ONCE: usize = 64;
/// Of these, those of one edge: one that does not answer must not take the place of all others.
const ASKED_PER_EDGE: usize = 16;

/// An order whose edge is to be asked.
#[derive(Debug)]
pub(super) struct ToAsk {
    order: String,
    edge: EdgeName,
    /// From when on, in milliseconds since 1970.
    from_ms: i64,
}

/// The network of an edge, and its id there.
pub(super) type EdgeName = (String, String);

/// How many orders an edge has not answered: whether it flies them, or, given up, whether it ever will.
pub(super) type Reserved = BTreeMap<EdgeName, usize>;

impl ToAsk {
    pub(super) fn of(order: &Kept<Order>) -> Self {
        let delivery = &order.value.delivery;
        let allocation = delivery.allocation.as_ref();
        let edge = allocation.map_or_else(String::new, |allocation| allocation.edge.clone());
        Self {
            order: order.document.id.clone(),
            edge: (delivery.network.clone(), edge),
            from_ms: order.value.dispatch.next_look_ms,
        }
    }
}

/// Where the rounds of a process are.
#[derive(Debug, Default)]
struct Rounds {
    /// After which order the next round begins.
    after: Option<String>,
    /// Orders whose edges are being asked, and which edges these are.
    asking: BTreeMap<String, EdgeName>,
    /// Those that answer to them.
    asked: JoinSet<String>,
    /// How far flights were looked for that nothing is told of.
    looked_at: LookedAt,
}

impl Rounds {
    /// Whether an edge can be asked about an order now; that it is being asked is noted.
    fn begins(&mut self, to_ask: &ToAsk) -> bool {
        let of_edge = self.asking.values().filter(|edge| **edge == to_ask.edge);
        let has_room = self.asking.len() < ASKED_AT_ONCE && of_edge.count() < ASKED_PER_EDGE;
        if !has_room || self.asking.contains_key(&to_ask.order) {
            return false;
        }
        self.asking
            .insert(to_ask.order.clone(), to_ask.edge.clone());
        true
    }
}

/// Orders that wait, by network: of each as many as are assigned together.
#[derive(Debug, Default)]
struct Gathered {
    waiting: BTreeMap<String, Vec<Kept<Order>>>,
    /// The last order before which none was left out.
    through: Option<String>,
}

impl Gathered {
    /// Adds an order, by id the next.
    fn add(&mut self, order: Kept<Order>) {
        let network = order.value.delivery.network.clone();
        let of_network = self.waiting.entry(network).or_default();
        if of_network.len() < TOGETHER_MAX {
            of_network.push(order);
            return;
        }
        let last = of_network.last().map(|last| last.document.id.clone());
        self.through = [self.through.take(), last].into_iter().flatten().min();
    }
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
            if let Err(refusal) = self.end_unheard(&mut rounds.looked_at).await {
                tracing::warn!(%refusal, "flights that nothing is told of are not ended");
            }
            tokio::time::sleep(GATHERED_FOR).await;
        }
    }

    /// Ends flights that nothing is told of, assigns drones once to all orders that wait, and asks their edges, one after the
    /// other. For those who drive it by hand; [`Dispatch::run`] does it as orders come.
    ///
    /// # Errors
    /// When the store does not answer.
    pub async fn assign_now(self: &Arc<Self>) -> Result<usize, Refusal> {
        self.end_unheard(&mut LookedAt::default()).await?;
        let mut after = None;
        let mut asked = 0;
        loop {
            let orders = self.round(&mut after).await?;
            for to_ask in &orders {
                self.ask_edge(&to_ask.order).await?;
            }
            asked += orders.len();
            if after.is_none() {
                return Ok(asked);
            }
        }
    }

    fn ask_edges(self: &Arc<Self>, orders: Vec<ToAsk>, rounds: &mut Rounds) {
        for to_ask in orders {
            // For those that have no room now: they are found again once another has been answered.
            if !rounds.begins(&to_ask) {
                continue;
            }
            let id = to_ask.order;
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
    async fn round(&self, after: &mut Option<String>) -> Result<Vec<ToAsk>, Refusal> {
        let now = self.clock.now();
        let mut to_ask = Vec::new();
        let mut gathered = Gathered::default();
        let mut reserved = Reserved::new();
        for order in self.asked_orders().await? {
            let asked = ToAsk::of(&order);
            *reserved.entry(asked.edge.clone()).or_default() += 1;
            to_ask.extend(order.is_to_be_asked(now).then_some(asked));
        }
        for order in self.open_orders(after).await? {
            if order.value.dispatch.asking != Asking::Nothing {
                if order.is_to_be_asked(now) {
                    to_ask.push(ToAsk::of(&order));
                }
            } else if now >= order.value.waits_until() {
                self.expire(order, now).await?;
            } else if order.value.dispatch.next_look_ms <= now.as_millisecond() {
                gathered.add(order);
            }
        }
        let mut through = gathered.through;
        for (network, orders) in gathered.waiting {
            match self.assign_over(&network, orders, &reserved, now).await {
                Ok(part) => {
                    to_ask.extend(part.to_ask);
                    through = [through, part.through].into_iter().flatten().min();
                }
                Err(refusal) => tracing::warn!(network, %refusal, "orders are not assigned"),
            }
        }
        if through.is_some() {
            // Those that were left out have their turn, though those before them go on waiting.
            *after = through;
            self.orders.notify_one();
        }
        // Who has waited longest is asked for first, be it to fly or to call off.
        to_ask.sort_by_key(|asked| asked.from_ms);
        Ok(to_ask)
    }

    /// The orders with a drone whose edge has not answered, or was given up.
    async fn asked_orders(&self) -> Result<Vec<Kept<Order>>, Refusal> {
        let (mut asked, mut after) = (Vec::new(), None);
        loop {
            let states = [RESERVING, GIVEN_UP];
            asked.extend(self.orders_in(&states, &mut after).await?);
            if after.is_none() {
                return Ok(asked);
            }
        }
    }

    /// A part of the orders that wait, or are called off, from where the last part ended.
    async fn open_orders(&self, after: &mut Option<String>) -> Result<Vec<Kept<Order>>, Refusal> {
        let open = [DeliveryStatus::Created.name(), CALLING_OFF];
        let orders = self.orders_in(&open, after).await?;
        if after.is_some() {
            self.orders.notify_one();
        }
        Ok(orders)
    }

    /// Orders in some states, after one of them; gives after which the next part begins.
    async fn orders_in(
        &self,
        states: &[&str],
        after: &mut Option<String>,
    ) -> Result<Vec<Kept<Order>>, Refusal> {
        let query = DocumentQuery {
            kind: DocumentKind::Delivery,
            of: None,
            states: states.iter().map(|&state| state.to_owned()).collect(),
            after: after.take(),
            limit: ORDERS_AT_ONCE,
            is_newest_first: false,
        };
        let documents = self.documents.documents(&query).await?;
        if documents.len() as u64 == ORDERS_AT_ONCE {
            *after = documents.last().map(|last| last.id.clone());
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

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(order: usize, edge: &str) -> ToAsk {
        ToAsk {
            order: format!("d{order}"),
            edge: ("street".to_owned(), edge.to_owned()),
            from_ms: 0,
        }
    }

    #[test]
    fn an_edge_that_does_not_answer_leaves_room_for_the_others() {
        let mut rounds = Rounds::default();
        let mut begun = |order, edge| rounds.begins(&asked(order, edge));
        let silent = (0..100).filter(|order| begun(*order, "silent"));
        assert_eq!(silent.count(), 16);
        assert!(begun(100, "quick"));
        assert!(!begun(100, "quick"), "it is being asked");
        rounds.asking.remove("d0");
        assert!(rounds.begins(&asked(101, "silent")));
        assert!(!rounds.begins(&asked(102, "silent")));
    }

    #[test]
    fn no_more_are_asked_at_once_than_may_be() {
        let mut rounds = Rounds::default();
        let begun = (0..100).filter(|order| rounds.begins(&asked(*order, &order.to_string())));
        assert_eq!(begun.count(), 64);
    }
}
