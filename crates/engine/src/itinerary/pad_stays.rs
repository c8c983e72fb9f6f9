//! The stays on the pads of one node, and the step function `T(t)` that follows from them: until when a
//! drone that lands at `t` may stay.

use super::occupancy::OccupiedPad;
use std::sync::OnceLock;

/// A stretch of `T`: landing from here on, a drone may stay until then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FreeUntil {
    pub(super) from_s: f64,
    /// Minus infinity where no pad is free.
    pub(super) until_s: f64,
    /// True where `T` is higher than just before.
    pub(super) rises: bool,
}

/// A time in which a pad is taken.
#[derive(Clone, Copy, Debug)]
pub(super) struct TakenPad {
    /// `None` for all pads of the node.
    pub(super) pad: Option<u16>,
    pub(super) from_s: f64,
    pub(super) until_s: f64,
}

impl TakenPad {
    fn is_on(&self, pad: u16) -> bool {
        self.pad.is_none_or(|taken| taken == pad)
    }
}

/// All stays at a node, in no order.
#[derive(Clone, Debug, Default)]
pub(super) struct PadStays {
    stays: Vec<OccupiedPad>,
    /// Worked out when it is first asked for, and shared by all states that have these stays.
    free: OnceLock<Vec<FreeUntil>>,
}

impl PadStays {
    pub(super) fn put(&mut self, stay: OccupiedPad) {
        self.retain(|other| {
            (other.version, other.number) != (stay.version, stay.number) || other.plan != stay.plan
        });
        self.stays.push(stay);
    }

    pub(super) fn retain(&mut self, keeps: impl Fn(&OccupiedPad) -> bool) {
        self.stays.retain(keeps);
        self.free = OnceLock::new();
    }

    pub(super) fn all(&self) -> &[OccupiedPad] {
        &self.stays
    }

    /// `T` of a node that has so many pads.
    pub(super) fn free_until(&self, pads: u16) -> &[FreeUntil] {
        self.free.get_or_init(|| {
            let taken = self.stays.iter().map(|stay| TakenPad {
                pad: Some(stay.pad),
                from_s: stay.from_s,
                until_s: stay.until_s,
            });
            free_until(pads, &taken.collect::<Vec<_>>())
        })
    }
}

/// `T` of a node that has `pads` pads, from the times at which they are taken.
pub(super) fn free_until(pads: u16, taken: &[TakenPad]) -> Vec<FreeUntil> {
    let mut gaps: Vec<(f64, f64)> = Vec::new();
    for pad in 0..pads {
        let mut stays: Vec<&TakenPad> = taken.iter().filter(|stay| stay.is_on(pad)).collect();
        stays.sort_by(|one, other| one.from_s.total_cmp(&other.from_s));
        let mut free_from_s = f64::NEG_INFINITY;
        for stay in stays {
            if stay.from_s > free_from_s {
                gaps.push((free_from_s, stay.from_s));
            }
            free_from_s = free_from_s.max(stay.until_s);
        }
        if free_from_s < f64::INFINITY {
            gaps.push((free_from_s, f64::INFINITY));
        }
    }
    let mut instants_s: Vec<f64> = vec![f64::NEG_INFINITY];
    instants_s.extend(gaps.iter().flat_map(|&(from_s, until_s)| [from_s, until_s]));
    instants_s.retain(|instant_s| *instant_s < f64::INFINITY);
    instants_s.sort_by(f64::total_cmp);
    instants_s.dedup();
    let mut stretches: Vec<FreeUntil> = Vec::new();
    for from_s in instants_s {
        let free = gaps.iter().filter(|gap| gap.0 <= from_s && from_s < gap.1);
        let until_s = free.map(|gap| gap.1).fold(f64::NEG_INFINITY, f64::max);
        let before_s = stretches.last().map(|stretch| stretch.until_s);
        if before_s != Some(until_s) {
            stretches.push(FreeUntil {
                from_s,
                until_s,
                rises: before_s.is_some_and(|before_s| before_s < until_s),
            });
        }
    }
    stretches
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stay(pad: u16, from_s: f64, until_s: f64) -> TakenPad {
        TakenPad {
            pad: Some(pad),
            from_s,
            until_s,
        }
    }

    #[test]
    fn two_pads_give_the_later_end_of_their_gaps() {
        let taken = [stay(0, 100.0, 200.0), stay(1, 150.0, 300.0)];
        let steps: Vec<(f64, f64, bool)> = free_until(2, &taken)
            .iter()
            .map(|stretch| (stretch.from_s, stretch.until_s, stretch.rises))
            .collect();
        let never = f64::NEG_INFINITY;
        assert_eq!(
            steps,
            [
                (never, 150.0, false),
                (150.0, never, false),
                (200.0, f64::INFINITY, true),
            ]
        );
        let closed = TakenPad {
            pad: None,
            from_s: 0.0,
            until_s: f64::INFINITY,
        };
        assert_eq!(free_until(1, &[closed]).len(), 2);
        let nowhere = FreeUntil {
            from_s: never,
            until_s: never,
            rises: false,
        };
        assert_eq!(free_until(0, &taken), [nowhere]);
    }
}
