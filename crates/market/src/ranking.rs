//! In which order offers are told.

use jiff::Timestamp;
use skyway_contract::{OfferRank, ServiceOffer};
use std::cmp::Ordering;

/// Puts offers in order, the best first; what is equally good by price, arrival and id, in this order. Prices compare within a
/// currency; currencies stand in the order of their codes.
pub fn rank(offers: &mut [ServiceOffer], by: OfferRank) {
    offers.sort_by(|one, other| {
        let first = match by {
            OfferRank::Price => Ordering::Equal,
            OfferRank::Arrival => arrival(one).cmp(&arrival(other)),
            OfferRank::Reliability => reliability(other).total_cmp(&reliability(one)),
        };
        first
            .then_with(|| one.price.currency.cmp(&other.price.currency))
            .then_with(|| one.price.amount.cmp(&other.price.amount))
            .then_with(|| arrival(one).cmp(&arrival(other)))
            .then_with(|| one.service_id.cmp(&other.service_id))
    });
}

fn arrival(offer: &ServiceOffer) -> Timestamp {
    offer.arrives_at.parse().unwrap_or(Timestamp::MAX)
}

/// The share of deliveries in time: as measured, else as promised, else none.
fn reliability(offer: &ServiceOffer) -> f64 {
    let measured = offer.measured_on_time.filter(|share| share.of > 0);
    let measured = measured.map(|share| share.fraction);
    measured.or(offer.promised_on_time_fraction).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::rank;
    use crate::wilson;
    use skyway_contract::{Money, OfferRank, ServiceOffer};

    fn offer(id: &str, amount: &str, currency: &str, arrives_at: &str) -> ServiceOffer {
        ServiceOffer {
            service_id: id.to_owned(),
            name: id.to_owned(),
            provider: "p".to_owned(),
            price: Money {
                amount: amount.parse().unwrap(),
                currency: currency.to_owned(),
            },
            pickup_at: "2026-11-25T08:00:00Z".to_owned(),
            arrives_at: arrives_at.to_owned(),
            length_m: 1.0,
            drones: 1,
            promised_on_time_fraction: None,
            measured_on_time: None,
            reasons: Vec::new(),
        }
    }

    fn order(mut offers: Vec<ServiceOffer>, by: OfferRank) -> String {
        rank(&mut offers, by);
        offers
            .iter()
            .map(|offer| offer.service_id.as_str())
            .collect()
    }

    #[test]
    fn by_price_by_arrival_by_reliability() {
        let mut reliable = offer("c", "9.00", "AUD", "2026-11-25T08:20:00.5Z");
        reliable.promised_on_time_fraction = Some(0.9);
        let mut measured = offer("d", "10.00", "AUD", "2026-11-25T08:20:00Z");
        measured.promised_on_time_fraction = Some(0.99);
        measured.measured_on_time = Some(wilson(8, 10));
        let offers = vec![
            offer("a", "10.00", "AUD", "2026-11-25T08:10:00Z"),
            offer("b", "9.50", "AUD", "2026-11-25T08:30:00Z"),
            reliable,
            measured,
        ];
        assert_eq!(order(offers.clone(), OfferRank::Price), "cbad");
        assert_eq!(order(offers.clone(), OfferRank::Arrival), "adcb");
        assert_eq!(order(offers, OfferRank::Reliability), "cdba");
    }

    #[test]
    fn currencies_are_not_compared() {
        let offers = vec![
            offer("a", "1", "EUR", "2026-11-25T08:10:00Z"),
            offer("b", "9", "AUD", "2026-11-25T08:10:00Z"),
            offer("c", "8", "AUD", "2026-11-25T08:10:00Z"),
        ];
        assert_eq!(order(offers, OfferRank::Price), "cba");
    }
}
