//! Whether a service fits what is looked for: at what price and when, or why not.

use crate::hours::Hours;
use crate::tariff::{Carriage, price};
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{Money, PassedOver, PublishedService};
use thiserror::Error;

/// At which speed times are estimated before an edge has composed a flight, in metres per second: the airspeed that edges
/// assume.
pub const SPEED_MPS: f64 = 16.0;
/// How far a drone comes before it has to charge, in metres, and how fast beyond that with all its stops, in metres per second: as
/// the default airframe flew 11,000 deliveries (docs/results/deliveries.md).
const CHARGES_AFTER_M: f64 = 10_000.0;
const CHARGING_MPS: f64 = 5.5;

/// How long a way takes from a full battery on, in seconds: an estimate by which drones are compared.
pub fn way_s(length_m: f64) -> f64 {
    let beyond_m = (length_m - CHARGES_AFTER_M).max(0.0);
    (length_m - beyond_m) / SPEED_MPS + beyond_m / CHARGING_MPS
}

/// What is looked for.
#[derive(Clone, Copy, Debug)]
pub struct Sought<'a> {
    /// Payload in kilograms.
    pub payload_kg: f64,
    /// When a drone could leave.
    pub now: Timestamp,
    /// From when it may be picked up; never in the past.
    pub ready_at: Timestamp,
    /// The latest arrival.
    pub arrive_by: Option<Timestamp>,
    /// The dearest price.
    pub price_max: Option<&'a Money>,
    /// The least share of deliveries in time that is promised, from 0 to 1.
    pub on_time_min_fraction: Option<f64>,
}

/// What a service has for it.
#[derive(Clone, Copy, Debug)]
pub struct Supply<'a> {
    /// Whether its provider offers nothing just now.
    pub is_suspended: bool,
    /// The node of pickup or drop that its area leaves out.
    pub outside: Option<&'a str>,
    /// From pickup to drop by the shortest way, in metres; none where there is no way.
    pub length_m: Option<f64>,
    /// How many of its drones could be sent now.
    pub drones: u32,
    /// From the nearest of them to the pickup, in metres.
    pub fetch_m: f64,
}

/// How a service fits.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// What it would cost.
    pub price: Money,
    /// When the service opens, where the pickup waits for that.
    pub opens_at: Option<Timestamp>,
    /// When it would be picked up.
    pub pickup_at: Timestamp,
    /// When it would arrive.
    pub arrives_at: Timestamp,
    /// From pickup to drop, in metres.
    pub length_m: f64,
    /// Why it fits, in words.
    pub reasons: Vec<String>,
}

/// Why a service does not fit.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Misfit {
    /// Its provider offers nothing just now.
    #[error("its provider is suspended")]
    Suspended,
    /// A node is outside its area.
    #[error("node '{node}' is outside its area")]
    Area {
        /// The node.
        node: String,
    },
    /// The payload is too heavy.
    #[error("it carries {limit_kg} kg at most")]
    Payload {
        /// The heaviest payload in kilograms.
        limit_kg: f64,
    },
    /// It promises too little.
    #[error("it promises {} of its deliveries in time", promise(*.promised_fraction))]
    Quality {
        /// What it promises, from 0 to 1; none where it promises nothing.
        promised_fraction: Option<f64>,
    },
    /// There is no way from pickup to drop.
    #[error("no way leads from pickup to drop")]
    NoWay,
    /// None of its drones could be sent.
    #[error("none of its drones is free and fit for it")]
    NoDrone,
    /// It is not offered at the time of the pickup.
    #[error("it is not offered at {pickup_at}")]
    Validity {
        /// When it would be picked up.
        pickup_at: Timestamp,
    },
    /// It opens too late, or never.
    #[error("it is closed at {ready_at}{}", reopening(*.opens_at))]
    Hours {
        /// From when it may be picked up.
        ready_at: Timestamp,
        /// When the service opens; none where it never does.
        opens_at: Option<Timestamp>,
    },
    /// It would arrive too late.
    #[error("it would arrive at {arrives_at}")]
    Arrival {
        /// When it would arrive.
        arrives_at: Timestamp,
    },
    /// Its prices are in another currency.
    #[error("its prices are in {currency}")]
    Currency {
        /// The currency of its tariff.
        currency: String,
    },
    /// It would cost too much.
    #[error("it would cost {} {}", .price.amount, .price.currency)]
    Price {
        /// What it would cost.
        price: Money,
    },
    /// Its tariff has no price for this.
    #[error("its tariff has no price for this")]
    Unpriced,
}

impl Misfit {
    /// The code, by which clients tell reasons.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Suspended => "suspended",
            Self::Area { .. } => "area",
            Self::Payload { .. } => "payload",
            Self::Quality { .. } => "quality",
            Self::NoWay => "no_way",
            Self::NoDrone => "no_drone",
            Self::Validity { .. } => "validity",
            Self::Hours { .. } => "hours",
            Self::Arrival { .. } => "arrival",
            Self::Currency { .. } => "currency",
            Self::Price { .. } | Self::Unpriced => "price",
        }
    }

    /// The same as a message.
    pub fn of(&self, service_id: &str) -> PassedOver {
        PassedOver {
            service_id: service_id.to_owned(),
            code: self.code().to_owned(),
            text: self.to_string(),
        }
    }
}

fn promise(promised_fraction: Option<f64>) -> String {
    match promised_fraction {
        Some(fraction) => format!("{:.1} %", fraction * 100.0),
        None => "nothing about the share".to_owned(),
    }
}

fn reopening(opens_at: Option<Timestamp>) -> String {
    match opens_at {
        Some(opens_at) => format!(" and opens at {opens_at}"),
        None => String::new(),
    }
}

/// Whether a service fits. Times are estimates at [`SPEED_MPS`], prices those of the shortest way.
///
/// # Errors
/// The first reason why it does not.
pub fn fit(
    service: &PublishedService,
    sought: &Sought<'_>,
    supply: &Supply<'_>,
) -> Result<Fit, Misfit> {
    let length_m = check_supply(service, sought, supply)?;
    let Times {
        opens_at,
        pickup_at,
        arrives_at,
    } = times(service, sought, supply.fetch_m, length_m)?;
    let price = checked_price(service, sought, length_m)?;
    let mut reasons = vec![match &service.area {
        Some(_) => "pickup and drop are in its area".to_owned(),
        None => "it serves all of the network".to_owned(),
    }];
    reasons.push(format!("it carries up to {} kg", service.payload_max_kg));
    reasons.push(match supply.drones {
        1 => "1 drone is free".to_owned(),
        drones => format!("{drones} drones are free"),
    });
    if let Some(arrive_by) = sought.arrive_by {
        reasons.push(format!("it would arrive before {arrive_by}"));
    }
    if let Some(dearest) = sought.price_max {
        let (amount, currency) = (&dearest.amount, &dearest.currency);
        reasons.push(format!("it costs at most {amount} {currency}"));
    }
    Ok(Fit {
        price,
        opens_at,
        pickup_at,
        arrives_at,
        length_m,
        reasons,
    })
}

/// What needs neither clock nor tariff.
fn check_supply(
    service: &PublishedService,
    sought: &Sought<'_>,
    supply: &Supply<'_>,
) -> Result<f64, Misfit> {
    if supply.is_suspended {
        return Err(Misfit::Suspended);
    }
    if let Some(node) = supply.outside {
        let node = node.to_owned();
        return Err(Misfit::Area { node });
    }
    if sought.payload_kg > service.payload_max_kg {
        let limit_kg = service.payload_max_kg;
        return Err(Misfit::Payload { limit_kg });
    }
    let promised_fraction = service
        .quality
        .as_ref()
        .map(|quality| quality.on_time_fraction);
    if let Some(least) = sought.on_time_min_fraction
        && promised_fraction.is_none_or(|promised| promised < least)
    {
        return Err(Misfit::Quality { promised_fraction });
    }
    let length_m = supply.length_m.ok_or(Misfit::NoWay)?;
    if supply.drones == 0 {
        return Err(Misfit::NoDrone);
    }
    Ok(length_m)
}

/// When it would be picked up and arrive, and the opening that it waits for.
struct Times {
    opens_at: Option<Timestamp>,
    pickup_at: Timestamp,
    arrives_at: Timestamp,
}

/// The times by the hours of the service and the length of the way.
fn times(
    service: &PublishedService,
    sought: &Sought<'_>,
    fetch_m: f64,
    length_m: f64,
) -> Result<Times, Misfit> {
    // It comes while the parcel is made ready.
    let fetched_at = sought.ready_at.max(after(sought.now, fetch_m));
    let closed = |opens_at| Misfit::Hours {
        ready_at: fetched_at,
        opens_at,
    };
    let hours = Hours::read(&service.time_zone, &service.hours).map_err(|_| closed(None))?;
    let pickup_at = hours.next_opening(fetched_at).ok_or_else(|| closed(None))?;
    if !is_valid(service, pickup_at) {
        return Err(Misfit::Validity { pickup_at });
    }
    let arrives_at = after(pickup_at, length_m);
    if sought.arrive_by.is_some_and(|latest| arrives_at > latest) {
        // Would it be in time if the service were open?
        let in_time = Some(after(fetched_at, length_m)) <= sought.arrive_by;
        return Err(match in_time {
            true => closed(Some(pickup_at)),
            false => Misfit::Arrival { arrives_at },
        });
    }
    Ok(Times {
        opens_at: (pickup_at > fetched_at).then_some(pickup_at),
        pickup_at,
        arrives_at,
    })
}

/// Whether a service is offered at an instant; not where its limits cannot be read.
fn is_valid(service: &PublishedService, at: Timestamp) -> bool {
    let limit = |text: &Option<String>, otherwise: Timestamp| match text {
        Some(text) => text.parse::<Timestamp>().ok(),
        None => Some(otherwise),
    };
    let from = limit(&service.valid_from, Timestamp::MIN);
    let until = limit(&service.valid_until, Timestamp::MAX);
    from.is_some_and(|from| from <= at) && until.is_some_and(|until| at < until)
}

fn checked_price(
    service: &PublishedService,
    sought: &Sought<'_>,
    length_m: f64,
) -> Result<Money, Misfit> {
    let carriage = Carriage {
        length_m,
        payload_kg: sought.payload_kg,
        time_s: length_m / SPEED_MPS,
    };
    let price = price(&service.tariff, carriage).map_err(|_| Misfit::Unpriced)?;
    check_price(&price, sought.price_max)?;
    Ok(price)
}

/// Checks a price against the dearest that is asked for.
///
/// # Errors
/// When it is above it, or in another currency.
pub fn check_price(price: &Money, dearest: Option<&Money>) -> Result<(), Misfit> {
    let Some(dearest) = dearest else {
        return Ok(());
    };
    if price.currency != dearest.currency {
        let currency = price.currency.clone();
        return Err(Misfit::Currency { currency });
    }
    if price.amount > dearest.amount {
        let price = price.clone();
        return Err(Misfit::Price { price });
    }
    Ok(())
}

/// The instant after a flight of some metres, to the second.
fn after(from: Timestamp, length_m: f64) -> Timestamp {
    let time = SignedDuration::try_from_secs_f64((length_m / SPEED_MPS).ceil());
    let time = time.unwrap_or(SignedDuration::MAX);
    from.saturating_add(time).unwrap_or(Timestamp::MAX)
}

#[cfg(test)]
mod tests;
