//! What opens early may make plans better: such plans are looked for beside the writer, and offered.
//!
//! No drone has to take an offer: the plan goes on being flown as it is, and the offer goes when its time is over.

use super::opened::Listener;
use crate::Edge;
use crate::background::{Background, begin_turn};
use crate::drones::progress;
use crate::planner::{Concern, Occasion, Sent, Version};
use crate::plans::entry::PlanEntry;
use crate::plans::fleet::{self, Detour, DetourMeans};
use crate::snapshot::Snapshot;
use crate::writer::commands::Command;
use imbl::OrdMap;
use jiff::Timestamp;
use skyway_engine::checked::{Case, FallenBackTo, Known};
use skyway_service::refusal::Refusal;
use std::io;
use std::ops::Bound;
use std::sync::atomic::Ordering;
use std::sync::{Arc, MutexGuard, PoisonError, Weak};

/// At most this many plans are looked at after each change; the others have their turn after the next.
const PLANS_MAX: usize = 200;

/// How far looks for better plans have come.
#[derive(Debug)]
pub(crate) struct Offers {
    /// Where a client moves the clock: whether there may be better plans to offer.
    listener: Option<Listener>,
    /// The plan that was looked at last.
    after: Option<Arc<str>>,
}

impl Offers {
    /// Nothing has been looked at.
    pub(crate) fn new(listener: Option<Listener>) -> Self {
        Self {
            listener,
            after: None,
        }
    }
}

impl Listener {
    /// Starts the thread that makes offers. It ends with the edge.
    pub(crate) fn start(self, edge: Weak<Edge>) -> io::Result<()> {
        let builder = std::thread::Builder::new().name("skyway-offers".to_owned());
        builder.spawn(move || {
            Background::Offers.step_back();
            while self.hear() {
                begin_turn();
                let Some(edge) = edge.upgrade() else {
                    return;
                };
                edge.offer_better_plans(|| edge.breaks_off(&self));
            }
        })?;
        Ok(())
    }
}

impl Edge {
    /// Where a client moves the clock: offers what has become better since this was last asked.
    pub(crate) async fn offer_what_opened(self: &Arc<Self>) -> Result<(), Refusal> {
        let has_opened = {
            let offers = self.offers();
            offers.listener.as_ref().is_some_and(Listener::has_heard)
        };
        if !has_opened {
            return Ok(());
        }
        let edge = self.clone();
        self.aside(move || edge.offer_better_plans(|| false)).await
    }

    /// Whether a look for better plans ends here: plans that closures meet have the cores first.
    fn breaks_off(&self, listener: &Listener) -> bool {
        let are_waiting = || !self.snapshot().pending.is_empty();
        if !are_waiting() {
            return false;
        }
        listener.break_off();
        // Where none waits any more, the writer may have been idle before it could notice.
        are_waiting()
    }

    /// Offers what is better now to plans that are flown as planned, until it is broken off.
    fn offer_better_plans(&self, breaks_off: impl Fn() -> bool) {
        let looked_at = self.snapshot();
        let may_gain = |snapshot: &Snapshot, plan: &PlanEntry| {
            let is_pending = snapshot.pending.contains_key(&plan.id);
            self.planner
                .minds(Concern::Improvement, Some(&plan.reported))
                && !plan.is_quote()
                && plan.is_as_planned()
                && plan.wanted.is_none()
                && !is_pending
        };
        let after = self.offers().after.clone();
        let plans = in_turn(&looked_at.plans, after.as_ref());
        let plans = plans.filter(|plan| may_gain(&looked_at, plan));
        for plan in plans.take(PLANS_MAX) {
            if breaks_off() {
                return;
            }
            self.offers().after = Some(plan.id.clone());
            // On busy cores a look at all of them takes long.
            let (snapshot, now) = (self.snapshot(), self.clock.now());
            let plan = snapshot.plans.get(&plan.id);
            let Some(plan) = plan.filter(|plan| may_gain(&snapshot, plan)) else {
                continue;
            };
            let Some(version) = self.better(&snapshot, plan, now) else {
                continue;
            };
            let command = Command::OfferVersion {
                plan: plan.id.clone(),
                instead_of: plan.reported.number,
                version: Box::new(version),
            };
            if let Err(refusal) = self.writer.tell(command.made_on(snapshot.topology())) {
                tracing::warn!(%refusal, "a better version could not be offered to its plan");
                return;
            }
        }
    }

    fn offers(&self) -> MutexGuard<'_, Offers> {
        // Neither of its values is ever half changed, whatever has failed elsewhere.
        let offers = self.offers.lock();
        offers.unwrap_or_else(PoisonError::into_inner)
    }

    /// What the drone of a plan would better fly from where it is, if there is anything.
    fn better(
        &self,
        snapshot: &Snapshot,
        plan: &Arc<PlanEntry>,
        now: Timestamp,
    ) -> Option<Version> {
        let topology = snapshot.topology();
        let progress = progress::progress_or_wait(topology, plan, &self.drones, now)?;
        let scene = snapshot.scene(now);
        let means = DetourMeans {
            scene,
            planner: &*self.planner,
            drones: &self.drones,
        };
        let Detour {
            request, answer, ..
        } = fleet::detour(plan, &progress, &means);
        if !self.planner.improves(plan, &progress, &answer) {
            return None;
        }
        let known = Known::default();
        let checked = self.planner.check(scene, &request, &known, &answer);
        let Err(fault) = checked else {
            let course = self
                .planner
                .course(scene, plan, (Occasion::Change, &request), &answer)?;
            let sent = Sent {
                number: plan.next_version.fetch_add(1, Ordering::Relaxed),
                epoch: self.epoch,
                at: now,
                acknowledge_by: now.checked_add(self.settings.acknowledge_within).ok(),
            };
            return Some(Version::of(course, answer.told(), topology, sent));
        };
        let case = Case {
            fault,
            outcome: answer.told().outcome,
            nodes: answer.told().path.nodes.clone(),
            fallback: FallenBackTo::Reported,
        };
        let subjects = (None, Some(&*plan.id), plan.drone_id.as_deref());
        self.tell_case(snapshot, &case, subjects, now);
        None
    }
}

/// All plans by their ids: first those that come after one.
fn in_turn<'p>(
    plans: &'p OrdMap<Arc<str>, Arc<PlanEntry>>,
    after: Option<&Arc<str>>,
) -> impl Iterator<Item = &'p Arc<PlanEntry>> {
    let begins = after.map_or(Bound::Unbounded, Bound::Excluded);
    let later = plans.range::<_, Arc<str>>((begins, Bound::Unbounded));
    let earlier =
        after.map(|after| plans.range::<_, Arc<str>>((Bound::Unbounded, Bound::Included(after))));
    let in_order = later.chain(earlier.into_iter().flatten());
    in_order.map(|(_, plan)| plan)
}
