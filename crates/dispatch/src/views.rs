//! What of a delivery is told to whom.

use super::records::{Asking, Order};
use skyway_contract::{Delivery, Recipient};
use skyway_service::access::{Caller, Role};

/// With whose eyes a delivery is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Eyes {
    /// Its customer sees all of it.
    Customer,
    /// Its provider sees neither the recipient nor what the customer would have paid.
    Provider,
    /// An operator sees the flight: no price, no recipient, and of the proof time and place.
    Operator,
}

impl Eyes {
    /// Those of a caller who may see it.
    pub(super) fn of(caller: &Caller, delivery: &Delivery) -> Self {
        match caller.role {
            Role::Anyone => Self::Customer,
            Role::Customer | Role::Provider if *caller.tenant == *delivery.customer => {
                Self::Customer
            }
            Role::Customer | Role::Provider => Self::Provider,
            Role::Drone | Role::Operator | Role::Edge | Role::Metrics => Self::Operator,
        }
    }
}

/// A delivery as it is told.
pub(super) fn view(order: &Order, eyes: Eyes, recipient: Option<Recipient>) -> Delivery {
    let mut told = order.delivery.clone();
    // A drone that an edge is being asked for may yet be another one.
    if order.dispatch.asking == Asking::Reserving {
        told.allocation = None;
    }
    told.recipient = None;
    match eyes {
        Eyes::Customer => told.recipient = recipient,
        Eyes::Provider => told.price_max = None,
        Eyes::Operator => {
            told.price = None;
            told.price_max = None;
            told.reference = None;
            if let Some(proof) = &mut told.proof {
                proof.photo = None;
                proof.code = None;
            }
        }
    }
    told
}
