//! An edge that is made up: it takes flights on as a real one does, and refuses or stays silent where a test says so.

use jiff::{SignedDuration, Timestamp};
use skyway::dispatch::{
    CalledOff, ComposedFlight, EdgeAddress, EdgeAnswer, EdgeClient, EdgeError, FlightRequest,
};
use skyway::wire::{EndedAs, PlanState};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Mutex;

/// Metres from the beginning of the street, by node.
pub(crate) const STREET: [(&str, f64); 6] = [
    ("depot", 0.0),
    ("shop", 1_000.0),
    ("door", 2_500.0),
    ("hut", 4_000.0),
    ("roof", 6_000.0),
    ("tower", 9_000.0),
];
const SPEED_MPS: f64 = 16.0;

#[derive(Clone, Debug)]
pub(crate) struct PlanThere {
    pub(crate) drone: String,
    pub(crate) delivery: String,
    pub(crate) state: PlanState,
    pub(crate) ended_as: Option<EndedAs>,
    flight: ComposedFlight,
}

impl PlanThere {
    pub(crate) fn is_active(&self) -> bool {
        self.state != PlanState::Ended
    }
}

#[derive(Debug, Default)]
struct There {
    plans: BTreeMap<String, PlanThere>,
    refused: BTreeSet<String>,
    /// Whether it refuses what it has taken on already.
    denies: bool,
    /// Questions that never arrive.
    lost_questions: u32,
    /// Questions that are done, and whose answers never arrive.
    lost_answers: u32,
    /// Where it never answers what it is asked to compose: how often it was asked.
    left_hanging: Option<usize>,
}

#[derive(Debug, Default)]
pub(crate) struct MadeUpEdge(Mutex<There>);

impl MadeUpEdge {
    fn there<T>(&self, with: impl FnOnce(&mut There) -> T) -> T {
        with(&mut self.0.lock().expect("no panic elsewhere"))
    }

    pub(crate) fn refuse(&self, drone: &str) {
        self.there(|there| there.refused.insert(drone.to_owned()));
    }

    pub(crate) fn accept(&self, drone: &str) {
        self.there(|there| there.refused.remove(drone));
    }

    /// From now on it refuses whatever it is asked to take on, also what it has.
    pub(crate) fn deny(&self) {
        self.there(|there| there.denies = true);
    }

    pub(crate) fn lose_questions(&self, count: u32) {
        self.there(|there| there.lost_questions = count);
    }

    /// From now on it takes what it is asked to compose, and never answers.
    pub(crate) fn hang(&self) {
        self.there(|there| there.left_hanging = Some(0));
    }

    pub(crate) fn left_hanging(&self) -> usize {
        self.there(|there| there.left_hanging.unwrap_or_default())
    }

    pub(crate) fn lose_answers(&self, count: u32) {
        self.there(|there| there.lost_answers = count);
    }

    pub(crate) fn plans(&self) -> BTreeMap<String, PlanThere> {
        self.there(|there| there.plans.clone())
    }

    /// It loses its store.
    pub(crate) fn forget(&self) {
        self.there(|there| there.plans.clear());
    }

    /// A drone departs, or its flight ends.
    pub(crate) fn set(&self, plan: &str, state: PlanState, ended_as: Option<EndedAs>) {
        self.there(|there| {
            let plan = there.plans.get_mut(plan).expect("a plan");
            plan.state = state;
            plan.ended_as = ended_as;
        });
    }

    fn compose_now(&self, request: &FlightRequest) -> Result<ComposedFlight, EdgeError> {
        self.there(|there| {
            if there.lost_questions > 0 {
                there.lost_questions -= 1;
                return Err(silent());
            }
            let flight = there.take_on(request)?;
            if there.lost_answers > 0 {
                there.lost_answers -= 1;
                return Err(silent());
            }
            Ok(flight)
        })
    }

    fn call_off_now(&self, id: &str) -> Result<CalledOff, EdgeError> {
        self.there(|there| {
            if there.lost_questions > 0 {
                there.lost_questions -= 1;
                return Err(silent());
            }
            let Some(plan) = there.plans.get_mut(id) else {
                return Ok(CalledOff::Unknown);
            };
            match (plan.state, plan.ended_as) {
                (PlanState::Accepted, _) => {
                    plan.state = PlanState::Ended;
                    plan.ended_as = Some(EndedAs::Cancelled);
                    Ok(CalledOff::Cancelled)
                }
                (PlanState::Ended, Some(EndedAs::Cancelled)) => Ok(CalledOff::Cancelled),
                (PlanState::Ended, _) => Ok(CalledOff::Over),
                _ => Ok(CalledOff::Departed),
            }
        })
    }
}

impl There {
    fn take_on(&mut self, request: &FlightRequest) -> Result<ComposedFlight, EdgeError> {
        let Some(drone) = &request.drone_id else {
            return Ok(composed(request));
        };
        if self.denies {
            return Err(refused("no_route", "the pads are taken"));
        }
        let id = request.plan_id.clone().expect("a flight has an id");
        if let Some(plan) = self.plans.get(&id) {
            return Ok(ComposedFlight {
                state: plan.state,
                ended_as: plan.ended_as,
                ..plan.flight.clone()
            });
        }
        if self.refused.contains(drone) {
            return Err(refused("no_route", "no open way leads there"));
        }
        let mut plans = self.plans.iter();
        let is_other = |plan: &PlanThere| plan.drone == *drone && plan.is_active();
        if let Some((other, _)) = plans.find(|(_, plan)| is_other(plan)) {
            let detail = format!("drone '{drone}' flies plan '{other}' already");
            return Err(refused("plan_state_conflict", &detail));
        }
        let flight = composed(request);
        let plan = PlanThere {
            drone: drone.clone(),
            delivery: request.delivery_id.clone().expect("for a delivery"),
            state: PlanState::Accepted,
            ended_as: None,
            flight: flight.clone(),
        };
        self.plans.insert(id, plan);
        Ok(flight)
    }
}

fn refused(code: &str, detail: &str) -> EdgeError {
    EdgeError::Refused {
        code: code.to_owned(),
        detail: detail.to_owned(),
    }
}

fn silent() -> EdgeError {
    EdgeError::NotAnswered {
        detail: "the edge does not answer".to_owned(),
    }
}

fn place_m(node: &str) -> f64 {
    let found = STREET.iter().find(|(name, _)| *name == node);
    found.expect("a node of the street").1
}

fn composed(request: &FlightRequest) -> ComposedFlight {
    let after = |from: Timestamp, length_m: f64| {
        let time = SignedDuration::from_secs_f64(length_m / SPEED_MPS);
        from.checked_add(time).expect("within the calendar")
    };
    let between = |one: &str, other: &str| (place_m(one) - place_m(other)).abs();
    let pickup_at = after(request.start_time, between(&request.home, &request.pickup));
    let carried_m = between(&request.pickup, &request.drop);
    let drop_at = after(pickup_at, carried_m);
    ComposedFlight {
        state: PlanState::Accepted,
        ended_as: None,
        version: 1,
        pickup_at,
        drop_at,
        ends_at: after(drop_at, between(&request.drop, &request.home)),
        carried_m,
        carried_s: carried_m / SPEED_MPS,
    }
}

impl EdgeClient for MadeUpEdge {
    fn compose<'a>(
        &'a self,
        _: &'a EdgeAddress,
        request: &'a FlightRequest,
    ) -> EdgeAnswer<'a, ComposedFlight> {
        Box::pin(async move {
            // Others get in between.
            tokio::task::yield_now().await;
            let hangs = self.there(|there| {
                let asked = there.left_hanging.as_mut();
                asked.map(|asked| *asked += 1).is_some()
            });
            if hangs {
                std::future::pending::<()>().await;
            }
            self.compose_now(request)
        })
    }

    fn call_off<'a>(&'a self, _: &'a EdgeAddress, plan_id: &'a str) -> EdgeAnswer<'a, CalledOff> {
        Box::pin(async move {
            tokio::task::yield_now().await;
            self.call_off_now(plan_id)
        })
    }
}
