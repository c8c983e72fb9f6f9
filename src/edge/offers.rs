//! What opens early may make plans better: such plans are looked for beside the writer, and offered.
//!
//! Nobody has to take an offer: the plan goes on being flown as it is, and the offer goes when its time is over.

use super::Edge;
use super::fleet::{self, DetourAnswer, DetourMeans};
use super::orders::Order;
use super::plan_entry::PlanEntry;
use super::planner::{FlownAnswer, Scene, later};
use super::progress::{self, Progress};
use super::snapshot::Snapshot;
use crate::checked::{Case, FallenBackTo};
use crate::itinerary::Objective;
use crate::recompose::Outcome;
use jiff::Timestamp;
use std::io;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Weak};

/// At most this many plans are looked at after each change; the others fly on as they are.
const PLANS_MAX: usize = 200;
/// A way that is shorter by less, in metres, is not worth an offer.
const LEAST_GAIN_M: f64 = 10.0;
/// Nor a landing that is earlier by less, in seconds.
const LEAST_GAIN_S: f64 = 60.0;
/// Nor what saves less energy, in watt hours.
const LEAST_GAIN_WH: f64 = 0.5;

/// Where it is told that something has opened.
#[derive(Clone, Debug)]
pub(super) struct Opened(SyncSender<()>);

/// The other end.
#[derive(Debug)]
pub(super) struct Listener(Receiver<()>);

/// One word is enough, however much has opened.
pub(super) fn channel() -> (Opened, Listener) {
    let (opened, listener) = sync_channel(1);
    (Opened(opened), Listener(listener))
}

impl Opened {
    pub(super) fn tell(&self) {
        // Where one waits already, it will find this too.
        let _ = self.0.try_send(());
    }
}

impl Listener {
    /// Starts the thread that makes offers. It ends with the edge.
    pub(super) fn start(self, edge: Weak<Edge>) -> io::Result<()> {
        let builder = std::thread::Builder::new().name("skyway-offers".to_owned());
        builder.spawn(move || {
            while self.0.recv().is_ok() {
                let Some(edge) = edge.upgrade() else {
                    return;
                };
                edge.offer_better_plans();
            }
        })?;
        Ok(())
    }
}

impl Edge {
    /// Offers what is better now to plans that are flown as planned.
    fn offer_better_plans(&self) {
        let snapshot = self.snapshot();
        let now = self.clock.now();
        let may_gain = |plan: &&Arc<PlanEntry>| {
            let is_flown = plan.reported.flight.is_some();
            let is_pending = snapshot.pending.contains_key(&plan.id);
            is_flown
                && !plan.is_quote()
                && plan.is_as_planned()
                && plan.wanted.is_none()
                && !is_pending
        };
        let plans = snapshot.plans.values().filter(may_gain);
        for plan in plans.take(PLANS_MAX) {
            let Some(answer) = self.better(&snapshot, plan, now) else {
                continue;
            };
            let Some(version) = answer.version_without_number() else {
                continue;
            };
            let order = Order::OfferVersion {
                plan: plan.id.clone(),
                instead_of: plan.reported.number,
                version: Box::new(super::planner::Version {
                    number: plan.next_version.fetch_add(1, Ordering::Relaxed),
                    epoch: self.epoch,
                    sent_at: now,
                    acknowledge_by: now.checked_add(self.settings.acknowledge_within).ok(),
                    ..version
                }),
            };
            if let Err(refusal) = self.writer.tell(order.made_on(snapshot.topology())) {
                tracing::warn!(%refusal, "a better version could not be offered to its plan");
                return;
            }
        }
    }

    /// What the drone of a plan would better fly from where it is, if there is anything.
    fn better(
        &self,
        snapshot: &Snapshot,
        plan: &Arc<PlanEntry>,
        now: Timestamp,
    ) -> Option<FlownAnswer> {
        let progress = progress::progress(snapshot.topology(), plan, &self.drones, now)?;
        let means = DetourMeans {
            snapshot,
            airspace: &snapshot.airspace,
            trees: None,
            drones: &self.drones,
            flights: self.flights.as_deref(),
            now,
        };
        let mut scratch = self.scratches.take(snapshot.topology());
        let detour = fleet::detour(plan, &progress, &means, &mut scratch);
        self.scratches.give_back(scratch);
        let answer = match detour.answer {
            DetourAnswer::Flown(answer) if is_better(plan, &progress, &answer) => *answer,
            _ => return None,
        };
        let scene = Scene {
            snapshot,
            airspace: &snapshot.airspace,
            now,
        };
        let refused = self.flights.as_ref()?.refused(scene, plan, &answer);
        let Some(refused) = refused else {
            return Some(answer);
        };
        let case = Case {
            fault: refused.fault,
            outcome: answer.outcome,
            nodes: answer.way().nodes,
            fallback: FallenBackTo::Reported,
        };
        let subjects = (None, Some(&*plan.id), plan.drone_id.as_deref());
        self.tell_case(snapshot, &case, subjects, now);
        None
    }
}

/// Whether an answer is better than flying on by more than it costs to tell.
fn is_better(plan: &PlanEntry, progress: &Progress, answer: &FlownAnswer) -> bool {
    let leads_there = matches!(answer.outcome, Outcome::Rerouted | Outcome::Hold);
    let (Some((flown, way)), Some(current)) = (&answer.version, plan.reported.flight.as_deref())
    else {
        return false;
    };
    let lands_at = later(answer.departs_at, way.flight_time_s);
    let gains_s = plan
        .reported
        .arrives_at()
        .duration_since(lands_at)
        .as_secs_f64();
    let gains_m = progress.remaining_m - way.length_m;
    let legs = &current.composition.figures.legs;
    let ahead = legs.get(progress.leg..).unwrap_or_default();
    let ahead_wh: f64 = ahead.iter().map(|leg| leg.energy_wh).sum();
    let gains_wh = ahead_wh - flown.composition.figures.energy_wh;
    let lands_earlier = gains_s > LEAST_GAIN_S;
    leads_there
        && match current.composition.objective {
            Objective::Distance => {
                gains_m > LEAST_GAIN_M || (lands_earlier && gains_m > -LEAST_GAIN_M)
            }
            Objective::Time => lands_earlier,
            Objective::Energy => gains_wh > LEAST_GAIN_WH,
        }
}
