//! What keeps a drone from its destination, in the words of the wire.

use super::Ground;
use crate::words::{instant, node_id, text};
use skyway_contract::{self as wire, Fault};
use skyway_engine::delivery::{NoDelivery, severance};
use skyway_engine::itinerary::{FlightCause, FlightOpening};
use skyway_engine::recompose::Severance;
use skyway_formats::flight_cause_text;
use skyway_service::refusal::{Code, Refusal};
use std::borrow::Cow;

/// Instants are told to the microsecond.
const ROUNDED_S: f64 = 1e-6;

impl Ground {
    /// Causes with their ids, places and times.
    pub(super) fn causes(&self, causes: &[FlightCause]) -> Vec<wire::FlightCause<'static>> {
        causes.iter().map(|cause| self.cause(cause)).collect()
    }

    fn cause(&self, cause: &FlightCause) -> wire::FlightCause<'static> {
        let topology = self.skies.topology();
        let (code, message) = flight_cause_text(&self.skies, cause);
        let mut told = wire::FlightCause {
            code: Cow::Borrowed(code),
            message: Cow::Owned(message),
            id: None,
            plan_id: None,
            node: None,
            segment: None,
            missing_fraction: None,
            from: None,
            until: None,
        };
        let time = |seconds: f64| self.skies.instant(seconds).map(instant);
        let segment = |segment| Cow::Owned(topology.segment_id(segment).into_owned());
        match cause {
            FlightCause::Closure(number) => {
                if let Some(Severance::Closure(id)) = severance(&self.skies, cause) {
                    told.id = Some(Cow::Owned(id));
                }
                let closed = self.skies.closed().closure(*number);
                let window = closed.map(|(_, window)| window);
                told.from = window.and_then(|window| time(window.from_s));
                told.until = window.and_then(|window| time(window.until_s));
            }
            FlightCause::Traffic(leg) => {
                let plan = self.skies.others().plan_of(leg);
                told.plan_id = plan.map(|plan| text(plan));
                told.segment = Some(segment(leg.segment));
                told.from = time(leg.enters_s);
                told.until = time(leg.leaves_s);
            }
            FlightCause::Request(closed) => told.segment = Some(segment(*closed)),
            FlightCause::Unflyable {
                from, segment: at, ..
            } => {
                told.node = Some(node_id(topology, *from));
                told.segment = at.map(segment);
            }
            FlightCause::Energy {
                from,
                segment: at,
                missing,
                ..
            } => {
                told.node = Some(node_id(topology, *from));
                told.segment = Some(segment(*at));
                told.missing_fraction = Some(*missing);
            }
            FlightCause::Pads(node) => told.node = Some(node_id(topology, *node)),
            FlightCause::BelowReserve | FlightCause::Deadline | FlightCause::Network => {}
        }
        told
    }

    /// The plan that there would be but for the deadline.
    pub(super) fn opening(&self, opens: FlightOpening) -> Option<wire::Opening<'static>> {
        // Who states that landing as the deadline gets the plan, however instants are rounded.
        let arrives_s = opens.arrives_s + ROUNDED_S;
        Some(wire::Opening {
            departs_at: instant(self.skies.instant(opens.leaves_s)?),
            arrives_at: instant(self.skies.instant(arrives_s)?),
        })
    }

    /// Why there is no plan over some nodes, every cause by itself.
    pub(super) fn refusal(
        &self,
        no_delivery: &NoDelivery,
        way: &[&str],
        revision: &str,
    ) -> Refusal {
        let way: Vec<String> = way.iter().map(|node| format!("node '{node}'")).collect();
        let way = way.join(" to ");
        let deadline = self.skies.instant(no_delivery.deadline_s).map_or_else(
            || "any deadline".to_owned(),
            |deadline| deadline.to_string(),
        );
        let certainty = match no_delivery.proved {
            true => "no plan that this drone can fly",
            false => "no plan that the search found within its limits",
        };
        let causes = self.causes(&no_delivery.causes);
        let mut faults: Vec<Fault> = causes.iter().map(fault_of).collect();
        if let Some(opens) = no_delivery.opens.and_then(|opens| self.opening(opens)) {
            faults.push(Fault {
                code: "opens".to_owned(),
                pointer: "/deadline".to_owned(),
                message: format!(
                    "without the deadline a plan would leave at {} and land at {}",
                    opens.departs_at, opens.arrives_at
                ),
                hint: Some(format!("give a deadline of {} or later", opens.arrives_at)),
            });
        }
        let told: Vec<&str> = faults.iter().map(|fault| fault.message.as_str()).collect();
        let detail = format!(
            "{certainty} leads from {way} by {deadline} at revision {revision}: {}",
            told.join("; ")
        );
        Refusal {
            faults,
            ..Refusal::new(Code::NoRoute, detail)
        }
    }
}

/// A cause as one of the things that are wrong with a request.
fn fault_of(cause: &wire::FlightCause<'_>) -> Fault {
    let pointer = match &*cause.code {
        "deadline" => "/deadline",
        "below_reserve" => "/battery_fraction",
        _ => "/destination",
    };
    let times = match (&cause.from, &cause.until) {
        (Some(from), Some(until)) => format!(" from {from} until {until}"),
        (Some(from), None) => format!(" from {from} on"),
        (None, Some(until)) => format!(" until {until}"),
        (None, None) => String::new(),
    };
    let plan = cause.plan_id.as_ref();
    let plan = plan.map_or_else(String::new, |plan| format!(" (plan '{plan}')"));
    Fault {
        code: cause.code.clone().into_owned(),
        pointer: pointer.to_owned(),
        message: format!("{}{plan}{times}", cause.message),
        hint: None,
    }
}
