//! How a delivery stands by the news of its flight, and its drone.
//!
//! One table for both:
//!
//! | flight | before the pickup | with the parcel | after the drop |
//! |---|---|---|---|
//! | accepted | `assigned` | | |
//! | activated, nonconforming, contingent | `picking_up` | `in_flight` | `delivered` |
//! | the same, waiting on a pad | `holding` | `holding` | `delivered` |
//! | ended: at its end, as an operator says | `delivered` | `delivered` | `delivered` |
//! | ended: landed at home, or at the pickup | `created` | `returned` | `delivered` |
//! | ended: landed elsewhere | `created` | `diverted` | `delivered` |
//! | ended: cancelled, by the customer | `cancelled` | `cancelled` | `delivered` |
//! | ended: cancelled, otherwise | `created` | `failed` | `delivered` |
//! | ended: lost | `created` | `failed` | `delivered` |
//!
//! `created` is `failed` where it may not be tried again. A final status stays as it is; the way home changes the drone
//! alone. Every flight ends at home, so a landing there delivers no parcel whose drop is elsewhere. A flight that begins at the
//! pickup has the parcel from its departure on; one whose drop is at home delivers it with its landing there.

use skyway_contract::{DeliveryStatus, EndedAs, FleetDroneState, FlightNews, PlanState};

/// What the status follows from, beside the news.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terms<'a> {
    /// How the delivery stands.
    pub status: DeliveryStatus,
    /// The node of the pickup.
    pub pickup: &'a str,
    /// The node of the drop.
    pub drop: &'a str,
    /// The node where the flight begins and ends: that of the drone.
    pub home: &'a str,
    /// Whether it was called off on the ground.
    pub is_called_off: bool,
    /// Whether it may be tried again, should its flight end before the pickup.
    pub may_retry: bool,
}

/// What news make of a delivery and its drone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Standing {
    /// How the delivery stands.
    pub status: DeliveryStatus,
    /// Why, or what is to be known of its flight.
    pub reason: Option<String>,
    /// How its drone stands; as before where nothing follows.
    pub drone: Option<FleetDroneState>,
    /// Whether the flight is over, so that its drone has nothing to do with the delivery any more.
    pub is_over: bool,
}

/// How far a parcel is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Parcel {
    Waits,
    OnBoard,
    Dropped,
}

/// What a delivery and its drone are by the news of its flight. The same news again change nothing.
pub fn fold(terms: &Terms<'_>, news: &FlightNews) -> Standing {
    let is_over = news.state == PlanState::Ended;
    let (status, reason) = if terms.status.is_final() {
        (terms.status, None)
    } else {
        status(terms, news)
    };
    Standing {
        status,
        reason,
        drone: drone(terms, news),
        is_over,
    }
}

/// How far the parcel is. The pickup is a stop unless the flight begins there, and the drop one unless it ends there.
fn parcel(terms: &Terms<'_>, news: &FlightNews) -> Parcel {
    let until_pickup = u32::from(terms.pickup != terms.home);
    let until_drop = until_pickup + 1;
    if terms.drop != terms.home && news.stops_served >= until_drop {
        return Parcel::Dropped;
    }
    if news.stops_served >= until_pickup {
        return Parcel::OnBoard;
    }
    Parcel::Waits
}

fn status(terms: &Terms<'_>, news: &FlightNews) -> (DeliveryStatus, Option<String>) {
    let parcel = parcel(terms, news);
    if parcel == Parcel::Dropped {
        return (DeliveryStatus::Delivered, None);
    }
    match news.state {
        // Told late, it takes nothing back.
        PlanState::Accepted if has_departed(terms.status) => (terms.status, None),
        PlanState::Accepted => (DeliveryStatus::Assigned, None),
        PlanState::Activated | PlanState::Nonconforming | PlanState::Contingent => {
            let status = match parcel {
                _ if news.holds => DeliveryStatus::Holding,
                Parcel::OnBoard => DeliveryStatus::InFlight,
                _ => DeliveryStatus::PickingUp,
            };
            (status, note(news))
        }
        PlanState::Ended => ended(terms, news, parcel),
    }
}

/// What is to be known of a flight beside its status.
fn note(news: &FlightNews) -> Option<String> {
    let text = match news.state {
        PlanState::Nonconforming => "its drone is elsewhere, earlier or later than planned",
        PlanState::Contingent => "its drone is silent, or has no way that it could be told",
        _ if news.holds => "its drone waits on a pad until its way opens",
        _ if news.outcome == "diverted" => "its drone diverts to another node",
        _ => return None,
    };
    Some(text.to_owned())
}

fn ended(terms: &Terms<'_>, news: &FlightNews, parcel: Parcel) -> (DeliveryStatus, Option<String>) {
    let ended_as = news.ended_as.unwrap_or(EndedAs::Lost);
    if ended_as == EndedAs::Delivered && has_delivered(terms, news, parcel) {
        return (DeliveryStatus::Delivered, None);
    }
    if ended_as == EndedAs::Cancelled && terms.is_called_off {
        let reason = "it was called off".to_owned();
        return (DeliveryStatus::Cancelled, Some(reason));
    }
    if parcel == Parcel::Waits || (parcel == Parcel::OnBoard && !has_departed(terms.status)) {
        return before_pickup(terms, ended_as);
    }
    match ended_as {
        EndedAs::Delivered | EndedAs::Diverted => landed(terms, news.landed_on.as_deref()),
        EndedAs::Cancelled => failed("its flight was cancelled with the parcel on board"),
        EndedAs::Lost => failed("nothing has been heard of its drone for long"),
    }
}

/// Whether a flight that has ended where it was to end has delivered a parcel that was not seen to be dropped before. Of one
/// whose drone was not seen to land, an operator has said that it has.
fn has_delivered(terms: &Terms<'_>, news: &FlightNews, parcel: Parcel) -> bool {
    let is_at_home = news.landed_on.as_deref() == Some(terms.home);
    !is_at_home || (parcel == Parcel::OnBoard && terms.drop == terms.home)
}

fn failed(reason: &str) -> (DeliveryStatus, Option<String>) {
    (DeliveryStatus::Failed, Some(reason.to_owned()))
}

fn before_pickup(terms: &Terms<'_>, ended_as: EndedAs) -> (DeliveryStatus, Option<String>) {
    let what = match ended_as {
        EndedAs::Cancelled => "its flight was cancelled before the pickup",
        EndedAs::Lost => "its drone was lost before the pickup",
        EndedAs::Delivered => "its drone came back before the pickup",
        EndedAs::Diverted => "its drone landed elsewhere before the pickup",
    };
    if terms.may_retry {
        let reason = format!("{what}; it waits for another drone");
        return (DeliveryStatus::Created, Some(reason));
    }
    failed(what)
}

/// A drone has landed with the parcel, and not at the drop.
fn landed(terms: &Terms<'_>, landed_on: Option<&str>) -> (DeliveryStatus, Option<String>) {
    match landed_on {
        Some(node) if node == terms.pickup || node == terms.home => {
            let reason = format!("its drone came back to node '{node}' with the parcel");
            (DeliveryStatus::Returned, Some(reason))
        }
        Some(node) => {
            let reason = format!("its drone landed on node '{node}' with the parcel");
            (DeliveryStatus::Diverted, Some(reason))
        }
        None => {
            let reason = "its drone landed elsewhere with the parcel".to_owned();
            (DeliveryStatus::Diverted, Some(reason))
        }
    }
}

/// Whether the drone of a delivery that stands so has taken off for it.
fn has_departed(status: DeliveryStatus) -> bool {
    !matches!(
        status,
        DeliveryStatus::Created | DeliveryStatus::Scheduled | DeliveryStatus::Assigned
    )
}

/// How the drone stands: available again where it is at home, out of service where it is elsewhere, or at an unknown place.
fn drone(terms: &Terms<'_>, news: &FlightNews) -> Option<FleetDroneState> {
    match news.state {
        PlanState::Accepted => None,
        PlanState::Activated | PlanState::Nonconforming | PlanState::Contingent => {
            Some(FleetDroneState::InFlight)
        }
        PlanState::Ended => {
            let is_at_home = match (&news.landed_on, news.ended_as) {
                (Some(node), _) => node == terms.home,
                (None, Some(EndedAs::Delivered)) => true,
                (None, Some(EndedAs::Cancelled)) => !has_departed(terms.status),
                (None, _) => false,
            };
            Some(if is_at_home {
                FleetDroneState::Available
            } else {
                FleetDroneState::OutOfService
            })
        }
    }
}

#[cfg(test)]
mod tests;
