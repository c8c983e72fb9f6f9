//! What is said of a plan: taken over, declined or completed by its drone, released by an operator.
//!
//! Each can be said again, and says where the drone is, which counts as its telemetry does. With an
//! idempotency key it is done once, and answered the same as often as it is sent.

use super::entry::PlanEntry;
use super::own_plan;
use crate::Edge;
use crate::drones::Sighting;
use crate::drones::places::Untaken;
use crate::drones::telemetry::place_of;
use crate::planner::Version;
use crate::replies::Idempotency;
use crate::snapshot::Snapshot;
use crate::state::ends::{LANDED_WITHIN_M, landed_as};
use crate::writer::commands::{CancelledWhen, Command, DeclineReason};
use skyway_contract::{self as wire, EndedAs, Place};
use skyway_service::access::{Caller, Role};
use skyway_service::refusal::Refusal;
use std::sync::Arc;

/// Where a drone says that it is.
struct Whereabouts<'a> {
    location: Option<&'a Place>,
    leg: Option<u32>,
    fraction: Option<f64>,
}

/// Something that is said of a plan.
#[derive(Clone, Debug, PartialEq)]
pub enum PlanWord {
    /// Its drone takes a version over.
    Acknowledge(wire::Ack),
    /// Its drone does not.
    Decline(wire::Decline),
    /// Its drone has landed.
    Complete(wire::Completion),
    /// An operator says what became of it.
    Release(wire::Release),
    /// It is not to be flown any more.
    Cancel(wire::Cancellation),
}

impl PlanWord {
    fn name(&self) -> &'static str {
        match self {
            Self::Acknowledge(_) => "acknowledge_plan",
            Self::Decline(_) => "decline_plan",
            Self::Complete(_) => "complete_plan",
            Self::Release(_) => "release_plan",
            Self::Cancel(_) => "cancel_plan",
        }
    }
}

impl Edge {
    /// Takes what is said of a plan, once where it has an idempotency key.
    ///
    /// # Errors
    /// When there is no such plan of the caller's, what is said cannot be, or the key was used for
    /// something else.
    pub async fn say_of_plan(
        self: &Arc<Self>,
        caller: &Caller,
        id: &str,
        word: PlanWord,
        idempotency: Idempotency,
    ) -> Result<wire::Plan<'static>, Refusal> {
        // A key counts for one plan.
        let operation = format!("{} {id}", word.name());
        let (edge, author, id) = (self.clone(), caller.clone(), id.to_owned());
        let said = async move {
            let (author, id) = (&author, id.as_str());
            match word {
                PlanWord::Acknowledge(ack) => edge.acknowledge_plan(author, id, ack).await,
                PlanWord::Decline(decline) => edge.decline_plan(author, id, decline).await,
                PlanWord::Complete(landed) => edge.complete_plan(author, id, landed).await,
                PlanWord::Release(release) => edge.release_plan(author, id, release).await,
                PlanWord::Cancel(cancelled) => edge.cancel_plan(author, id, cancelled).await,
            }
        };
        let now = self.clock.now();
        self.write_replies
            .once(&caller.subject, operation, idempotency, now, said)
            .await
    }

    /// Cancels a plan. In flight its segments are free for others only where its place is told, or
    /// it has been seen just now: else it may be anywhere on its ways. What an operator cancels before its request has
    /// come, which may be on its way, is refused when it does.
    ///
    /// # Errors
    /// When there is none that the caller may change, or it is over.
    pub async fn cancel_plan(
        self: &Arc<Self>,
        caller: &Caller,
        id: &str,
        cancellation: wire::Cancellation,
    ) -> Result<wire::Plan<'static>, Refusal> {
        let snapshot = self.snapshot();
        let plan = match own_plan(&snapshot, caller, id) {
            Err(_) if matches!(caller.role, Role::Operator | Role::Anyone) => {
                // Its request may come between.
                let when = match cancellation.before_departure {
                    true => CancelledWhen::BeforeDeparture,
                    false => CancelledWhen::Unplaced,
                };
                let id = id.to_owned();
                let command = Command::CancelPlan { id, when };
                return self.said_of_plan(caller, command).await;
            }
            plan => plan?,
        };
        let whereabouts = Whereabouts {
            location: cancellation.location.as_ref(),
            leg: cancellation.leg,
            fraction: cancellation.fraction,
        };
        let place = self.note_place(&snapshot, &plan, Some(&plan.reported), &whereabouts);
        let when = match (cancellation.before_departure, place) {
            (true, _) => CancelledWhen::BeforeDeparture,
            (false, Some(_)) => CancelledWhen::Placed,
            (false, None) => CancelledWhen::Unplaced,
        };
        let id = id.to_owned();
        let command = Command::CancelPlan { id, when };
        self.said_of_plan(caller, command).await
    }

    /// A drone takes a version over: whichever of those that were sent it says.
    ///
    /// # Errors
    /// When there is no such plan of the caller's, or the version was never sent.
    pub async fn acknowledge_plan(
        self: &Arc<Self>,
        caller: &Caller,
        id: &str,
        ack: wire::Ack,
    ) -> Result<wire::Plan<'static>, Refusal> {
        let snapshot = self.snapshot();
        let plan = own_plan(&snapshot, caller, id)?;
        let mut versions = plan.versions();
        let version = versions.find(|version| version.number == ack.version);
        let whereabouts = Whereabouts {
            location: ack.location.as_ref(),
            leg: ack.leg,
            fraction: ack.fraction,
        };
        self.note_place(&snapshot, &plan, version, &whereabouts);
        self.said_of_plan(
            caller,
            Command::AcknowledgePlan {
                id: id.to_owned(),
                version: ack.version,
            },
        )
        .await
    }

    /// A drone does not take a version over, and flies on as it reported; it is answered with another one.
    ///
    /// # Errors
    /// When there is no such plan of the caller's, or the version was never sent.
    pub async fn decline_plan(
        self: &Arc<Self>,
        caller: &Caller,
        id: &str,
        decline: wire::Decline,
    ) -> Result<wire::Plan<'static>, Refusal> {
        let snapshot = self.snapshot();
        let plan = own_plan(&snapshot, caller, id)?;
        let whereabouts = Whereabouts {
            location: decline.location.as_ref(),
            leg: decline.leg,
            fraction: decline.fraction,
        };
        self.note_place(&snapshot, &plan, Some(&plan.reported), &whereabouts);
        self.said_of_plan(
            caller,
            Command::DeclinePlan {
                id: id.to_owned(),
                version: decline.version,
                reason: match decline.reason.as_deref() {
                    Some("battery" | "payload" | "propulsion" | "land_now") => DeclineReason::Unfit,
                    Some("passed") => DeclineReason::Passed,
                    _ => DeclineReason::Obstructed,
                },
            },
        )
        .await
    }

    /// A drone has landed: its plan is over, and nothing of it is taken any more.
    ///
    /// # Errors
    /// When there is no such plan of the caller's.
    pub async fn complete_plan(
        self: &Arc<Self>,
        caller: &Caller,
        id: &str,
        completion: wire::Completion,
    ) -> Result<wire::Plan<'static>, Refusal> {
        let snapshot = self.snapshot();
        let plan = own_plan(&snapshot, caller, id)?;
        let whereabouts = Whereabouts {
            location: completion.location.as_ref(),
            leg: completion.leg,
            fraction: completion.fraction,
        };
        let place = self.note_place(&snapshot, &plan, Some(&plan.reported), &whereabouts);
        let topology = snapshot.topology();
        // The start of a leg is where it was, and not where it has landed.
        let place = place.filter(|_| completion.location.is_some());
        let place = place.map(|place| topology.frame().to_plane(place));
        let landed = place.map_or_else(
            || landed_as(&plan),
            |place| {
                let off_m = |node| place.distance_m(topology.position(node));
                let goal_m = off_m(plan.destination);
                // A node where it was diverted to may be as near as that.
                let is_nearest = plan
                    .reported
                    .last_node()
                    .is_none_or(|end| goal_m <= off_m(end));
                match goal_m <= LANDED_WITHIN_M && is_nearest {
                    true => EndedAs::Delivered,
                    false => EndedAs::Diverted,
                }
            },
        );
        self.said_of_plan(
            caller,
            Command::CompletePlan {
                id: id.to_owned(),
                landed,
                place,
            },
        )
        .await
    }

    /// An operator says what became of a plan of which nothing has been heard.
    ///
    /// # Errors
    /// When there is no such plan, or it has ended otherwise.
    pub async fn release_plan(
        self: &Arc<Self>,
        caller: &Caller,
        id: &str,
        release: wire::Release,
    ) -> Result<wire::Plan<'static>, Refusal> {
        own_plan(&self.snapshot(), caller, id)?;
        self.said_of_plan(
            caller,
            Command::ReleasePlan {
                id: id.to_owned(),
                ended_as: release.ended_as,
            },
        )
        .await
    }

    async fn said_of_plan(
        self: &Arc<Self>,
        caller: &Caller,
        command: Command,
    ) -> Result<wire::Plan<'static>, Refusal> {
        let (outcome, snapshot) = self.command(command.by(caller)).await?;
        self.told(outcome.done, &snapshot)
    }

    /// Where the drone of a plan says that it is, on a version where it names the leg, counts as
    /// telemetry. Gives the place where it is one; one that is none is passed over, as what else is
    /// said is true all the same.
    fn note_place(
        &self,
        snapshot: &Snapshot,
        plan: &Arc<PlanEntry>,
        version: Option<&Arc<Version>>,
        told: &Whereabouts<'_>,
    ) -> Option<[f64; 2]> {
        let stated = told.location.and_then(|place| place_of(place, snapshot));
        let on_leg = || version.and_then(|version| place_on(snapshot, version, told));
        let coordinates = stated.or_else(on_leg)?;
        let Some(drone) = plan.drone_id.as_deref() else {
            return Some(coordinates);
        };
        let seen_at = self.clock.now();
        let before = self.drones.last(drone);
        let sighting = Sighting {
            // What else was known of it goes on to be.
            ..before.unwrap_or_else(|| Sighting::at(coordinates, seen_at))
        };
        let airborne = sighting.airborne_now(seen_at);
        let sighting = Sighting {
            coordinates,
            seen_at,
            airborne,
            rests: None,
            agreement: None,
            ..sighting
        };
        match self.judge_place(snapshot, Some(plan), drone, &sighting) {
            Ok(()) => {
                let flies = |drone: &str| snapshot.plan_of_drone(drone).is_some();
                self.drones.see(drone, sighting, flies);
            }
            Err(Untaken::Impossible(_)) => return None,
            // Its telemetry has come ahead of what it says.
            Err(Untaken::Outdated) => {}
        }
        Some(coordinates)
    }
}

/// The place so far on a leg of a version.
fn place_on(snapshot: &Snapshot, version: &Version, told: &Whereabouts<'_>) -> Option<[f64; 2]> {
    let leg = usize::try_from(told.leg?).ok()?;
    let leg = version.composition.legs.get(leg)?;
    let fraction = told.fraction.unwrap_or(0.0);
    let topology = snapshot.topology();
    let [from, to] = [leg.from, leg.to].map(|node| topology.position(node));
    let is_fraction = (0.0..=1.0).contains(&fraction);
    is_fraction.then(|| topology.frame().from_plane(from.towards(to, fraction)))
}
