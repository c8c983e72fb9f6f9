//! The clock as clients read it, and a wall clock that has stepped, as operators see and confirm it.

use super::Edge;
use super::commands::Command;
use super::words;
use crate::access::Caller;
use crate::refusal::Refusal;
use crate::wire;
use std::sync::Arc;

impl Edge {
    /// The clock that all times of this edge come from.
    pub fn clock_reading(&self, _caller: &Caller) -> wire::ClockReading<'static> {
        wire::ClockReading {
            kind: self.clock.source(),
            time: words::instant(self.clock.now()),
            rate: self.clock.rate(),
        }
    }

    /// Believes the wall clock from now on, where it has stepped: what it closes and opens, closes and opens.
    ///
    /// # Errors
    /// When the writer cannot take it; the clock is believed then all the same.
    pub async fn confirm_clock(
        self: &Arc<Self>,
        caller: &Caller,
    ) -> Result<wire::ClockState<'static>, Refusal> {
        let apart = self.clock.confirm();
        if let Some(apart) = apart {
            let apart_s = apart.as_secs_f64();
            tracing::warn!(subject = %caller.subject, apart_s, "the stepped clock was confirmed");
        }
        let (_, snapshot) = self.command(Command::Tick).await?;
        Ok(wire::ClockState {
            now: words::instant(self.clock.now()),
            confirmed_step_s: apart.map(|apart| apart.as_secs_f64()),
            stamp: self.stamp_of(&snapshot),
        })
    }
}
