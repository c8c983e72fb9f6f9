//! What a delivery costs by the tariff of its service.

use crate::money::{is_currency, rounded};
use rust_decimal::Decimal;
use skyway_contract::{Money, ServiceTariff};
use thiserror::Error;

/// The largest amount that a tariff states, in its currency.
pub const AMOUNT_MAX: i64 = 1_000_000;
/// The most decimals that an amount of a tariff has.
pub const DECIMALS_MAX: u32 = 6;
/// The longest way and the longest flight that are priced, in thousandths of a metre and of a second.
const THOUSANDTHS_MAX: f64 = 1e12;

/// What a price is worked out from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carriage {
    /// From pickup to drop, in metres.
    pub length_m: f64,
    /// What is carried, in kilograms.
    pub payload_kg: f64,
    /// From pickup to drop, in seconds.
    pub time_s: f64,
}

/// Why a tariff is not one, or has no price.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum TariffError {
    /// Its currency is none by its form.
    #[error("'{currency}' is no currency; write three capital letters, such as AUD")]
    Currency {
        /// What was written.
        currency: String,
    },
    /// An amount is negative, too large or too fine.
    #[error(
        "{part} is {amount}; it has to be from 0 to {AMOUNT_MAX}, with at most {DECIMALS_MAX} decimals"
    )]
    Amount {
        /// Which part of the tariff.
        part: &'static str,
        /// What was written.
        amount: Decimal,
    },
    /// A length, a payload or a time that is no number, negative, or beyond all flights.
    #[error("a price needs lengths, payloads and times of a flight")]
    Carriage,
}

/// Checks that a tariff can price every flight.
///
/// # Errors
/// When its currency is none, or an amount is negative, too large or too fine.
pub fn check(tariff: &ServiceTariff) -> Result<(), TariffError> {
    if !is_currency(&tariff.currency) {
        let currency = tariff.currency.clone();
        return Err(TariffError::Currency { currency });
    }
    let parts = [
        ("base", tariff.base),
        ("per_km", tariff.per_km),
        ("per_kg_km", tariff.per_kg_km),
        ("per_minute", tariff.per_minute),
        ("minimum", tariff.minimum),
    ];
    let is_amount = |amount: Decimal| {
        !amount.is_sign_negative()
            && amount <= Decimal::from(AMOUNT_MAX)
            && amount.normalize().scale() <= DECIMALS_MAX
    };
    let wrong = parts.into_iter().find(|(_, amount)| !is_amount(*amount));
    match wrong {
        Some((part, amount)) => Err(TariffError::Amount { part, amount }),
        None => Ok(()),
    }
}

/// What a carriage costs: the sum of the tariff's parts, or its minimum where that is more, rounded half up to the minor
/// unit of its currency.
///
/// # Errors
/// When the tariff is none ([`check`]), or the carriage is that of no flight.
pub fn price(tariff: &ServiceTariff, carriage: Carriage) -> Result<Money, TariffError> {
    check(tariff)?;
    let length_km = thousandths(carriage.length_m)? / Decimal::ONE_THOUSAND;
    let payload_kg = thousandths(carriage.payload_kg)?;
    let time_min = thousandths(carriage.time_s)? / Decimal::from(60);
    let priced = [
        Some(tariff.base),
        tariff.per_km.checked_mul(length_km),
        payload_kg
            .checked_mul(length_km)
            .and_then(|load| tariff.per_kg_km.checked_mul(load)),
        tariff.per_minute.checked_mul(time_min),
    ];
    let sum = priced
        .into_iter()
        .try_fold(Decimal::ZERO, |sum, part| sum.checked_add(part?));
    let amount = sum.ok_or(TariffError::Carriage)?.max(tariff.minimum);
    Ok(Money {
        amount: rounded(amount, &tariff.currency),
        currency: tariff.currency.clone(),
    })
}

/// A quantity as a decimal with three decimals: money is worked out from numbers that everyone reads alike.
fn thousandths(quantity: f64) -> Result<Decimal, TariffError> {
    let scaled = (quantity * 1e3).round();
    if !(0.0..=THOUSANDTHS_MAX).contains(&scaled) {
        return Err(TariffError::Carriage);
    }
    Ok(Decimal::new(scaled as i64, 3))
}

#[cfg(test)]
mod tests {
    use super::{AMOUNT_MAX, Carriage, TariffError, check, price};
    use rust_decimal::Decimal;
    use skyway_contract::ServiceTariff;

    fn amount(text: &str) -> Decimal {
        text.parse().unwrap()
    }

    fn tariff() -> ServiceTariff {
        ServiceTariff {
            currency: "AUD".to_owned(),
            base: amount("4.50"),
            per_km: amount("1.20"),
            per_kg_km: amount("0.35"),
            per_minute: amount("0.10"),
            minimum: amount("6"),
        }
    }

    const CARRIAGE: Carriage = Carriage {
        length_m: 3_250.0,
        payload_kg: 1.5,
        time_s: 210.0,
    };

    #[test]
    fn the_parts_add_up() {
        // 4.50 + 1.20 x 3.25 + 0.35 x 1.5 x 3.25 + 0.10 x 3.5 = 10.45625
        let money = price(&tariff(), CARRIAGE).unwrap();
        assert_eq!(money.amount.to_string(), "10.46");
        assert_eq!(money.currency, "AUD");
    }

    #[test]
    fn the_minimum_is_the_least() {
        let near = Carriage {
            length_m: 10.0,
            time_s: 1.0,
            ..CARRIAGE
        };
        assert_eq!(price(&tariff(), near).unwrap().amount.to_string(), "6.00");
    }

    #[test]
    fn a_half_cent_goes_up() {
        let exact = ServiceTariff {
            base: amount("6.005"),
            ..tariff()
        };
        let nothing = Carriage {
            length_m: 0.0,
            payload_kg: 0.0,
            time_s: 0.0,
        };
        assert_eq!(price(&exact, nothing).unwrap().amount.to_string(), "6.01");
    }

    #[test]
    fn what_is_no_tariff_is_refused() {
        let foreign = ServiceTariff {
            currency: "dollars".to_owned(),
            ..tariff()
        };
        assert!(matches!(check(&foreign), Err(TariffError::Currency { .. })));
        for wrong in ["-0.01", "1000000.01", "0.0000001"] {
            let wrong = ServiceTariff {
                per_km: amount(wrong),
                ..tariff()
            };
            let refused = check(&wrong).unwrap_err();
            assert!(matches!(
                refused,
                TariffError::Amount { part: "per_km", .. }
            ));
        }
    }

    #[test]
    fn no_number_breaks_it() {
        let dearest = ServiceTariff {
            base: Decimal::from(AMOUNT_MAX),
            per_km: Decimal::from(AMOUNT_MAX),
            per_kg_km: Decimal::from(AMOUNT_MAX),
            per_minute: Decimal::from(AMOUNT_MAX),
            ..tariff()
        };
        let odd = [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9, 1e308, 5e-324];
        for length_m in odd {
            for payload_kg in odd {
                for time_s in odd {
                    let carriage = Carriage {
                        length_m,
                        payload_kg,
                        time_s,
                    };
                    // An amount or a refusal, and no panic.
                    let _ = price(&dearest, carriage);
                }
            }
        }
    }
}
