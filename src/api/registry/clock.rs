//! `/v1/clock`: the time that quotes, hours and arrivals are in.

use crate::api::rest::answer::{Answer, json};
use crate::api::rest::extract::Call;
use crate::registry::Registry;
use crate::wire::ClockReading;

/// Tells the time that the registry goes by, and how fast it passes. Quotes, hours and arrivals are in this time.
#[utoipa::path(
    get,
    path = "/v1/clock",
    responses((status = 200, description = "The clock.", body = ClockReading)),
)]
pub(super) async fn get_clock(Call(registry, _, _): Call<Registry>) -> Answer {
    json(&ClockReading {
        kind: registry.clock().kind(),
        time: registry.clock().now().to_string().into(),
        rate: registry.clock().rate(),
    })
}
