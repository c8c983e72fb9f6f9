//! Amounts of money.

use rust_decimal::Decimal;
use serde::{Deserialize, Serialize};

/// An amount in a currency. The amount is a decimal number as text, never a float.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Money {
    /// The amount, such as `"12.40"`.
    #[serde(with = "rust_decimal::serde::str")]
    #[schema(value_type = String, example = "12.40", max_length = 32)]
    pub amount: Decimal,
    /// The currency: three letters of ISO 4217.
    #[schema(min_length = 3, max_length = 3, example = "AUD")]
    pub currency: String,
}
