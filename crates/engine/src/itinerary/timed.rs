//! Closures of an airspace as a search takes them: each window by itself, in seconds from an epoch.

use crate::airspace::{Cause, Closure};
use crate::flight::TimedClosure;
use jiff::Timestamp;

/// What a closure closes when, in seconds from `epoch`: one part for each of its windows.
///
/// Windows of zones are widened by the margins. Closures from failure reports count as unending: nobody knows when the
/// cause is gone.
pub fn timed_closures(closure: &Closure, epoch: Timestamp) -> Vec<TimedClosure> {
    let part = |from_s: f64, until_s: f64| TimedClosure {
        from_s,
        until_s,
        segments: closure.hits.segments.clone(),
        nodes: closure.hits.nodes.clone(),
        pads: closure.pads.clone(),
        widened: matches!(closure.cause, Cause::Zone(_)),
    };
    let is_unending = matches!(closure.cause, Cause::Report { .. });
    if is_unending || closure.windows.is_empty() {
        return vec![part(f64::NEG_INFINITY, f64::INFINITY)];
    }
    let seconds = |instant: Timestamp| instant.duration_since(epoch).as_secs_f64();
    let windows = closure.windows.iter().map(|window| {
        part(
            window.from().map_or(f64::NEG_INFINITY, seconds),
            window.until().map_or(f64::INFINITY, seconds),
        )
    });
    windows.collect()
}
