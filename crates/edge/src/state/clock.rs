//! What the state makes of the clock: how far one has come that a client moves, and of a wall clock that steps, that nothing
//! opens by it until somebody confirms the step.
//!
//! The time goes on as before the step. A window counts if it counts by the time or by the stepped clock; what ends
//! by itself ends when both say so.

use super::State;
use super::timers::HeardClock;
use crate::writer::commands::Done;
use jiff::{SignedDuration, Timestamp};
use serde_json::json;
use skyway_contract::EventKind;
use skyway_service::clock::{Reading, STEP};
use std::sync::Arc;

/// A stepped clock that has moved on by less than this is where it was.
const SAME: SignedDuration = SignedDuration::from_secs(1);

impl State {
    /// How far the clock has come that is to be moved to an instant.
    pub(super) fn advanced(&self, to: Timestamp) -> Done {
        let has_more = self.next_due().is_some_and(|due| due <= to);
        Done::Advanced {
            to,
            fired: self.fired,
            is_there: to <= self.now && !has_more,
        }
    }

    /// Whether a reading of the clock is news.
    pub(crate) fn has_clock_news(&self, reading: &Reading) -> bool {
        match (self.clock.apart, reading.apart) {
            (Some(known), Some(apart)) => (apart - known).abs() > SAME,
            (None, None) => self.clock.confirmations != reading.confirmations,
            _ => true,
        }
    }

    /// Takes a reading of the clock; to be called before orders are carried out at its time.
    pub(crate) fn hear_clock(&mut self, reading: &Reading) {
        if !self.has_clock_news(reading) {
            return;
        }
        let seconds = |span: SignedDuration| span.as_millis() as f64 / 1e3;
        let known = self.clock.apart;
        let is_step = match (known, reading.apart) {
            (Some(known), Some(apart)) => (apart - known).abs() > STEP,
            (None, apart) => apart.is_some(),
            (Some(_), None) => false,
        };
        if let Some(apart) = reading.apart.filter(|_| is_step) {
            tracing::error!(
                apart_s = seconds(apart),
                "the wall clock has stepped; nothing opens by it until an operator confirms it"
            );
            let data = json!({"apart_s": seconds(apart)});
            self.happen(EventKind::ClockStepped, data);
        }
        if reading.apart.is_none() {
            let is_confirmed = self.clock.confirmations != reading.confirmations;
            if is_confirmed {
                self.listen_anew(reading.now);
            }
            let why = match is_confirmed {
                true => "confirmed",
                false => "came_back",
            };
            let data = json!({"apart_s": known.map(seconds), "why": why});
            self.happen(EventKind::ClockSettled, data);
        }
        self.clock = HeardClock {
            apart: reading.apart,
            confirmations: reading.confirmations,
            has_turned: true,
        };
        self.next.clock_apart = reading.apart;
        self.next.airspace = Arc::new(self.next.airspace.beside_clock(reading.apart));
    }
}
