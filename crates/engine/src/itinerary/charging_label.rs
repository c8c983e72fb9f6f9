//! A family of plans: one way flown so far, with the departure from the last stop still open.
//!
//! A family arrives at its node at any time of `[lo, hi]`. The battery on arrival at `t` is
//! `min(cap - e, 1 - e - m exp(-(t - D) / tau))`: `e` drawn since the last stop, `m` missing from full when charging
//! began, `D` the arrival if charging took no time. Leaving later means having charged longer.

use crate::flight::Charging;

/// Battery levels this much apart count as equal.
pub(super) const BATTERY_TOLERANCE: f64 = 1e-10;

/// Plans that differ in when they leave their last stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ChargingLabel {
    /// The objective's weight so far.
    pub(super) weight: f64,
    /// The earliest arrival, in seconds.
    pub(super) lo_s: f64,
    /// The latest.
    pub(super) hi_s: f64,
    /// Energy drawn since the last stop, as a fraction.
    drawn: f64,
    /// What was missing from a full battery when charging began.
    missing: f64,
    /// The arrival if charging took no time, in seconds.
    origin_s: f64,
    /// The level at which charging ends.
    cap: f64,
    /// Seconds of charging after which it has.
    capped_after_s: f64,
    /// Battery at `lo_s`.
    battery_lo: f64,
}

impl ChargingLabel {
    /// A single arrival: no departure is open.
    pub(super) fn point(weight: f64, at_s: f64, battery: f64) -> Self {
        Self {
            weight,
            lo_s: at_s,
            hi_s: at_s,
            drawn: 0.0,
            missing: 0.0,
            origin_s: at_s,
            cap: battery,
            capped_after_s: 0.0,
            battery_lo: battery,
        }
    }

    /// Charging from a level: `ready_s` is the arrival at the crossing altitude if charging takes no time, `until_s` the
    /// latest one.
    pub(super) fn charging(
        weight: f64,
        level: f64,
        ready_s: f64,
        until_s: f64,
        climb_energy: f64,
        charging: Charging,
    ) -> Self {
        let cap = charging.full.max(level);
        let missing = 1.0 - level;
        let capped_after_s = match level < charging.full {
            true => charging.tau_s * (missing / (1.0 - cap)).ln(),
            false => 0.0,
        };
        Self {
            weight,
            lo_s: ready_s,
            hi_s: until_s,
            drawn: climb_energy,
            missing,
            origin_s: ready_s,
            cap,
            capped_after_s,
            battery_lo: level - climb_energy,
        }
    }

    /// Waiting with a battery that does not change: after a swap, or in the air where hovering is free.
    pub(super) fn waiting(weight: f64, battery: f64, ready_s: f64, until_s: f64) -> Self {
        Self {
            lo_s: ready_s,
            hi_s: until_s,
            ..Self::point(weight, ready_s, battery)
        }
    }

    /// Battery on the latest arrival at or before `t_s`; `t_s` is not before `lo_s`.
    #[inline]
    pub(super) fn battery(&self, t_s: f64, tau_s: f64) -> f64 {
        let t_s = t_s.min(self.hi_s);
        let charged_s = t_s - self.origin_s;
        if charged_s >= self.capped_after_s {
            return self.cap - self.drawn;
        }
        if t_s <= self.lo_s {
            return self.battery_lo;
        }
        1.0 - self.drawn - self.missing * (-charged_s / tau_s).exp()
    }

    /// True where it weighs no more than the other and arrives no later.
    #[inline]
    pub(super) fn is_no_worse_at_first(&self, other: &Self) -> bool {
        self.weight <= other.weight && self.lo_s <= other.lo_s
    }

    /// Battery on the earliest arrival.
    #[inline]
    pub(super) fn battery_lo(&self) -> f64 {
        self.battery_lo
    }

    /// An upper bound of the battery on any arrival.
    #[inline]
    pub(super) fn battery_most(&self) -> f64 {
        self.cap - self.drawn
    }

    /// When charging has ended, as an arrival.
    fn capped_s(&self) -> f64 {
        self.origin_s + self.capped_after_s
    }

    /// The earliest arrival with at least this battery; it may be after `hi_s`. `None` where no charging suffices.
    #[inline]
    pub(super) fn sufficient_from_s(&self, battery: f64, tau_s: f64) -> Option<f64> {
        if self.battery_lo >= battery - BATTERY_TOLERANCE {
            return Some(self.lo_s);
        }
        if self.cap - self.drawn < battery - BATTERY_TOLERANCE {
            return None;
        }
        let missing_then = 1.0 - self.drawn - battery;
        let needed_s = match missing_then > 0.0 && self.missing > 0.0 {
            true => tau_s * (self.missing / missing_then).ln(),
            false => self.capped_after_s,
        };
        let from_s = self.origin_s + needed_s.min(self.capped_after_s);
        Some(from_s.max(self.lo_s))
    }

    /// The part of the family that arrives within an interval, which must meet `[lo, hi]`.
    pub(super) fn within(&self, lo_s: f64, hi_s: f64, tau_s: f64) -> Self {
        let lo_s = lo_s.max(self.lo_s);
        Self {
            battery_lo: self.battery(lo_s, tau_s),
            lo_s,
            hi_s: hi_s.min(self.hi_s),
            ..*self
        }
    }

    /// The family after a leg: those that arrive with the reserve. `None` where none does.
    #[inline]
    pub(super) fn flown(
        &self,
        time_s: f64,
        energy: f64,
        reserve: f64,
        latest_s: f64,
        tau_s: f64,
    ) -> Option<Self> {
        let mut flown = Self {
            lo_s: self.lo_s + time_s,
            hi_s: (self.hi_s + time_s).min(latest_s),
            drawn: self.drawn + energy,
            origin_s: self.origin_s + time_s,
            battery_lo: self.battery_lo - energy,
            ..*self
        };
        if flown.battery_lo < reserve - BATTERY_TOLERANCE {
            flown.lo_s = flown.sufficient_from_s(reserve, tau_s)?;
            flown.battery_lo = reserve;
        }
        (flown.lo_s <= flown.hi_s).then_some(flown)
    }

    /// True where this one has at least the other's battery at every arrival of the other, counting its own last
    /// battery for arrivals after its last one. `self.lo_s` is not after `other.lo_s`.
    ///
    /// Between the ends and the instants at which charging ends the two levels differ by a constant and a multiple of
    /// one exponential, so the difference is monotone there: the ends decide.
    pub(super) fn has_battery_of(&self, other: &Self, tau_s: f64) -> bool {
        let lo_s = other.lo_s;
        let covers = |t_s: f64| {
            self.battery(t_s, tau_s) >= other.battery(t_s, tau_s) - BATTERY_TOLERANCE / 100.0
        };
        if self.battery_most() < other.battery_lo - BATTERY_TOLERANCE {
            return false;
        }
        if !covers(lo_s) {
            return false;
        }
        if other.hi_s <= lo_s {
            return true;
        }
        // After its last arrival or kink the other's battery no longer rises.
        let last_s = other.hi_s.min(other.capped_s().max(lo_s));
        let between = |t_s: f64| t_s > lo_s && t_s < last_s;
        covers(last_s)
            && [self.hi_s, self.capped_s()]
                .into_iter()
                .all(|t_s| !between(t_s) || covers(t_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHARGING: Charging = Charging {
        tau_s: 960.0,
        full: 0.98,
    };

    fn family(level: f64, ready_s: f64, until_s: f64) -> ChargingLabel {
        ChargingLabel::charging(0.0, level, ready_s, until_s, 0.01, CHARGING)
    }

    #[test]
    fn the_battery_follows_the_curve_up_to_the_cap() {
        let family = family(0.3, 100.0, 1e5);
        for charged_s in [0.0, 60.0, 600.0, 3_000.0, 9_000.0] {
            let level = CHARGING.level_after(0.3, charged_s);
            let battery = family.battery(100.0 + charged_s, CHARGING.tau_s);
            assert!((battery - (level - 0.01)).abs() < 1e-12, "{charged_s}");
        }
    }

    #[test]
    fn a_leg_begins_when_the_battery_suffices() {
        let flown = family(0.3, 100.0, 5_000.0).flown(50.0, 0.4, 0.2, 1e9, CHARGING.tau_s);
        let flown = flown.expect("it can charge");
        let needed_s = CHARGING.time_s(0.3, 0.61).expect("below full");
        assert!((flown.lo_s - (150.0 + needed_s)).abs() < 1e-9);
        assert!((flown.battery(flown.lo_s, CHARGING.tau_s) - 0.2).abs() < 1e-9);
        let too_far = family(0.3, 100.0, 5_000.0).flown(50.0, 0.78, 0.2, 1e9, CHARGING.tau_s);
        assert_eq!(too_far, None);
        let too_short_a_stay = family(0.3, 100.0, 200.0).flown(50.0, 0.4, 0.2, 1e9, CHARGING.tau_s);
        assert_eq!(too_short_a_stay, None);
    }

    #[test]
    fn ends_and_kinks_decide_whether_a_battery_is_covered() {
        // Sampled densely, whatever the two curves are.
        let levels = [0.2, 0.5, 0.9, 0.97, 0.98, 1.0];
        let ends_s = [0.0, 300.0, 1_500.0, 4_000.0];
        let mut covered = 0;
        for (one, other) in levels
            .iter()
            .flat_map(|one| levels.map(|other| (*one, other)))
        {
            for (drawn, until_s) in ends_s
                .iter()
                .flat_map(|until| [0.0, 0.05, 0.3].map(|drawn| (drawn, *until)))
            {
                let mine = family(one, 0.0, 2_000.0);
                let theirs = family(other, 0.0, until_s + drawn);
                // Without a reserve: only what the battery does not have cannot be flown.
                let Some(theirs) = theirs.flown(10.0, drawn, 0.0, 1e9, CHARGING.tau_s) else {
                    assert!(other < drawn, "{other} {drawn} {until_s}");
                    continue;
                };
                let at =
                    |step: u32| theirs.lo_s + (theirs.hi_s - theirs.lo_s) * f64::from(step) / 400.0;
                let sampled = (0..=400).map(at).all(|t_s| {
                    mine.battery(t_s, CHARGING.tau_s) >= theirs.battery(t_s, CHARGING.tau_s) - 1e-11
                });
                assert_eq!(
                    mine.has_battery_of(&theirs, CHARGING.tau_s),
                    sampled,
                    "{one} {other} {drawn} {until_s}"
                );
                covered += usize::from(sampled);
            }
        }
        assert!(covered > 100);
    }
}
