//! What a delivery costs: the paper's `c_ij` of a leg, summed.

/// A price per kilogram and metre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tariff {
    /// US dollars for `payload_kg` over `distance_m`.
    pub price_usd: f64,
    /// The payload that the price is for, in kilograms.
    pub payload_kg: f64,
    /// The distance that the price is for, in metres.
    pub distance_m: f64,
}

impl Default for Tariff {
    /// The paper's: 0.1 USD for 2 kg within 10 km.
    fn default() -> Self {
        Self {
            price_usd: 0.1,
            payload_kg: 2.0,
            distance_m: 10_000.0,
        }
    }
}

impl Tariff {
    /// The cost of carrying a payload over a distance, in US dollars: in proportion to both.
    pub fn cost_usd(&self, payload_kg: f64, distance_m: f64) -> f64 {
        self.price_usd * (payload_kg / self.payload_kg) * (distance_m / self.distance_m)
    }
}
