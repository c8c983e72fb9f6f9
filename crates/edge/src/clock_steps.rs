//! The clock as clients read it, one that they move, and a wall clock that has stepped, as operators see and confirm it.

use crate::writer::commands::{Command, Done, unexpected};
use crate::{Edge, words};
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{self as wire, ClockKind};
use skyway_service::access::Caller;
use skyway_service::intake::Faults;
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;

/// A client moves the clock on by no more than this at once.
const ADVANCE_MAX: SignedDuration = SignedDuration::from_hours(24);

impl Edge {
    /// The clock that all times of this edge come from.
    pub fn clock_reading(&self, _caller: &Caller) -> wire::ClockReading<'static> {
        wire::ClockReading {
            kind: self.clock.kind(),
            time: words::instant(self.clock.now()),
            rate: self.clock.rate(),
        }
    }

    /// Moves the clock on: whatever is due until then happens first, each at its own instant, with all that it leads to.
    /// Between two instants others have their turn. Where the caller goes before the end, the clock stands where it
    /// has come to, and the same call again goes on from there.
    ///
    /// # Errors
    /// When no client moves this clock, or not there; when the writer cannot take it.
    pub async fn advance_clock(
        self: &Arc<Self>,
        _caller: &Caller,
        advance: &wire::ClockAdvance,
    ) -> Result<wire::ClockAdvanced<'static>, Refusal> {
        let to = self.checked_advance(advance)?;
        let mut fired = 0;
        loop {
            self.offer_what_opened().await?;
            let (outcome, _) = self.command(Command::AdvanceTo(to)).await?;
            let Done::Advanced {
                fired: now_fired,
                is_there,
                ..
            } = outcome.done
            else {
                return Err(unexpected());
            };
            fired += now_fired;
            if is_there {
                break;
            }
            tokio::task::yield_now().await;
        }
        self.offer_what_opened().await?;
        Ok(wire::ClockAdvanced {
            time: words::instant(self.clock.now()),
            fired,
            stamp: self.stamp(),
        })
    }

    fn checked_advance(&self, advance: &wire::ClockAdvance) -> Result<Timestamp, Refusal> {
        if self.clock.kind() != ClockKind::External {
            let detail = "no client moves the clock of this edge; start it with --clock external";
            return Err(Refusal::new(Code::ClockNotExternal, detail));
        }
        let mut faults = Faults::default();
        let to = faults.instant("/to", Some(&advance.to));
        let Some(to) = to else {
            return Err(faults.refusal(Code::BodyInvalid, "instant"));
        };
        let now = self.clock.now();
        let by = to.duration_since(now);
        if by.is_negative() {
            let detail = format!("the clock shows {now} already, and goes forward only");
            return Err(Refusal::new(Code::ClockBackwards, detail));
        }
        if by > ADVANCE_MAX {
            let detail = format!("{to} is more than 24 h after {now}; go there in several steps");
            return Err(Refusal::new(Code::ClockTooFar, detail));
        }
        Ok(to)
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
            // What was seen by a clock that went ahead would be later than all that is seen now.
            self.drones.forget_after(self.clock.now());
        }
        let (_, snapshot) = self.command(Command::Tick).await?;
        Ok(wire::ClockState {
            now: words::instant(self.clock.now()),
            confirmed_step_s: apart.map(|apart| apart.as_secs_f64()),
            stamp: self.stamp_of(&snapshot),
        })
    }
}
