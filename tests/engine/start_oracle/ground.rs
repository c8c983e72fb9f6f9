//! A line walked in small steps: where it lies in zones.

use super::world::{PlainWorld, Spot, apart_m, between};

/// Between two looks at the ground, in metres.
const STEP_M: f64 = 0.1;
/// What is nearer to a boundary than this, in metres, is in doubt.
pub(super) const DOUBT_M: f64 = 0.5;

/// Why a case is left out: something in it is too near to a boundary for steps to tell.
pub(super) type Doubt = &'static str;

/// A straight line, with the parts of it that lie in zones; those that overlap are one.
#[derive(Clone, Debug)]
pub(super) struct Walk {
    pub(super) length_m: f64,
    /// Shares of the line, rising.
    pub(super) parts: Vec<(f64, f64)>,
}

impl PlainWorld {
    fn clearance_m(&self, spot: Spot) -> f64 {
        let all = self.zones.iter().map(|zone| zone.clearance_m(spot));
        all.fold(f64::INFINITY, f64::min)
    }

    pub(super) fn walk(&self, from: Spot, to: Spot) -> Result<Walk, Doubt> {
        let length_m = apart_m(from, to);
        let steps = (length_m / STEP_M).ceil().max(1.0) as usize;
        let clearance_m = |step: usize| {
            let share = step as f64 / steps as f64;
            self.clearance_m(between(from, to, share))
        };
        let looks: Vec<f64> = (0..=steps).map(clearance_m).collect();
        // Between two looks it may come into a zone, or out of one into the next.
        let comes_near = |three: &[f64]| {
            let (before, here, after) = (three[0], three[1], three[2]);
            let is_lowest = here > 0.0 && here <= before.min(after);
            let is_highest = here <= 0.0 && here >= before.max(after);
            here.abs() < STEP_M && (is_lowest || is_highest)
        };
        if looks.windows(3).any(comes_near) {
            return Err("a line grazes a zone, or comes just from one into the next");
        }
        let mut parts: Vec<(f64, f64)> = Vec::new();
        let share = |step: usize| step as f64 / steps as f64;
        for step in 0..=steps {
            if looks[step] > 0.0 {
                continue;
            }
            match parts.last_mut() {
                Some(part) if step > 0 && looks[step - 1] <= 0.0 => part.1 = share(step),
                _ => parts.push((share(step), share(step))),
            }
        }
        for part in &mut parts {
            let step = 1.0 / steps as f64;
            if part.0 > 0.0 {
                part.0 = self.boundary((from, to), part.0 - step, part.0);
            }
            if part.1 < 1.0 {
                part.1 = self.boundary((from, to), part.1 + step, part.1);
            }
        }
        let walk = Walk { length_m, parts };
        match walk.is_clear_cut() {
            true => Ok(walk),
            false => Err("a part of a line in a zone, or outside, is very short"),
        }
    }

    /// Where a line passes from outside to inside, between two shares.
    fn boundary(&self, (from, to): (Spot, Spot), mut outside: f64, mut inside: f64) -> f64 {
        for _ in 0..60 {
            let middle = (outside + inside) / 2.0;
            match self.clearance_m(between(from, to, middle)) > 0.0 {
                true => outside = middle,
                false => inside = middle,
            }
        }
        inside
    }
}

impl Walk {
    fn is_clear_cut(&self) -> bool {
        let is_long = |share: f64| share * self.length_m > 4.0 * DOUBT_M;
        let gaps = self.parts.windows(2).map(|two| two[1].0 - two[0].1);
        let ends = self.parts.first().map(|part| part.0).into_iter();
        let ends = ends.chain(self.parts.last().map(|part| 1.0 - part.1));
        self.parts.iter().all(|part| is_long(part.1 - part.0))
            && gaps.into_iter().all(is_long)
            && ends.into_iter().all(|end| end <= 0.0 || is_long(end))
    }

    /// Whether some share of the line is too near to a boundary to be told inside or outside.
    pub(super) fn is_doubtful_at(&self, share: f64) -> bool {
        let bounds = self.parts.iter().flat_map(|part| [part.0, part.1]);
        let inner = bounds.filter(|bound| *bound > 0.0 && *bound < 1.0);
        inner
            .into_iter()
            .any(|bound| (bound - share).abs() * self.length_m < DOUBT_M)
    }

    /// The part in zones that a share of the line lies in.
    pub(super) fn part_at(&self, share: f64) -> Option<(f64, f64)> {
        let mut parts = self.parts.iter();
        parts
            .find(|part| part.0 <= share && share <= part.1)
            .copied()
    }

    /// Whether someone who walks from one share to another comes into a zone from outside.
    pub(super) fn enters(&self, from: f64, to: f64) -> bool {
        let begins_in = self.part_at(from);
        let (low, high) = (from.min(to), from.max(to));
        let met = self
            .parts
            .iter()
            .filter(|part| part.1 >= low && part.0 <= high);
        met.into_iter().any(|part| Some(*part) != begins_in)
    }
}
