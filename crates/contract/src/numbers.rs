//! Numbers as JSON states them, read with their bounds.

use serde::Deserialize;
use serde::de::{Deserializer, Error};

/// The number of a version: they are counted from 1.
pub(crate) fn version_number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    let number = whole_number(deserializer)?;
    if number == 0 {
        return Err(D::Error::custom("versions are counted from 1"));
    }
    Ok(number)
}

/// A whole number where there is one.
pub(crate) fn some_whole_number<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<u32>, D::Error> {
    #[derive(Deserialize)]
    struct Whole(#[serde(deserialize_with = "whole_number")] u32);
    let number = Option::<Whole>::deserialize(deserializer)?;
    Ok(number.map(|Whole(number)| number))
}

/// A share from 0 to 1 where there is one.
pub(crate) fn some_share<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<f64>, D::Error> {
    let share = Option::<f64>::deserialize(deserializer)?;
    match share.filter(|share| !(0.0..=1.0).contains(share)) {
        None => Ok(share),
        Some(other) => Err(D::Error::custom(format!("{other} is not between 0 and 1"))),
    }
}

/// A number without a fraction, also where it is written with a point: in JSON 3 and 3.0 are one number.
fn whole_number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    let number = f64::deserialize(deserializer)?;
    let is_whole = number.fract() == 0.0 && (0.0..=f64::from(i32::MAX)).contains(&number);
    match is_whole {
        true => Ok(number as u32),
        false => Err(D::Error::custom(format!(
            "{number} is not a whole number that counts anything"
        ))),
    }
}
