//! When a label makes another one at its node needless.

use super::label::{How, Label, NO_LABEL};
use super::memory::ItineraryScratch;
use super::run::{Mode, Run};

/// Whether a label makes another one needless.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Dominance {
    Holds,
    /// Unless something opens between the two.
    UnlessParted,
    Fails,
}

/// Of the labels that a label may make needless, or be made needless by, the one between which and it the least may open. The
/// others are not looked at: where traffic is dense something opens between almost any two.
#[derive(Clone, Copy, Debug)]
struct Nearest {
    hi_s: f64,
    label: u32,
}

impl Nearest {
    const NONE: Self = Self {
        hi_s: f64::NAN,
        label: NO_LABEL,
    };

    fn of(label: &Label, place: u32) -> Self {
        Self {
            hi_s: label.family.hi_s,
            label: place,
        }
    }

    /// Whether it is there, and no earlier than a label.
    fn is_later(self, label: &Label) -> bool {
        self.hi_s >= label.family.hi_s
    }

    /// Whether it is there, and no later than a label.
    fn is_earlier(self, label: &Label) -> bool {
        self.hi_s <= label.family.hi_s
    }
}

impl Run<'_, '_> {
    /// True where a label cannot be an improvement, or one at its node can do all that it can.
    pub(super) fn is_needless(&mut self, label: &Label) -> bool {
        if !self.is_worth(self.terms.key(&label.family, label.node)) {
            return true;
        }
        let mut other = self.scratch.head(label.node);
        let mut nearest = Nearest::NONE;
        while other != NO_LABEL {
            self.effort.checks += 1;
            let there = self.scratch.labels[other as usize];
            if there.family.is_no_worse_at_first(&label.family) {
                match self.dominance((&there, label), nearest.is_later(&there)) {
                    Dominance::Holds => {
                        self.note_tie(&there, label);
                        return true;
                    }
                    Dominance::UnlessParted => nearest = Nearest::of(&there, other),
                    Dominance::Fails => {}
                }
            }
            other = there.next;
        }
        self.is_dominated_by(nearest, label)
    }

    /// Whether nothing opens between a label and the one before it.
    fn is_dominated_by(&mut self, nearest: Nearest, label: &Label) -> bool {
        let Some(there) = self.scratch.labels.get(nearest.label as usize).copied() else {
            return false;
        };
        !self.parted(&there, label)
    }

    /// Keeps a label unless it cannot be an improvement or another one at its node makes it needless.
    pub(super) fn offer(&mut self, label: Label) {
        let key = self.terms.key(&label.family, label.node);
        if !self.is_worth(key) {
            return;
        }
        let (mut before, mut other) = (NO_LABEL, self.scratch.head(label.node));
        let (mut nearest_before, mut nearest_after) = (Nearest::NONE, Nearest::NONE);
        while other != NO_LABEL {
            self.effort.checks += 1;
            let there = &self.scratch.labels[other as usize];
            let after = there.next;
            let may_be_needless = there.family.is_no_worse_at_first(&label.family);
            let may_stand_for = label.family.is_no_worse_at_first(&there.family);
            if may_be_needless || may_stand_for {
                let there = *there;
                let by_it = match may_be_needless {
                    true => self.dominance((&there, &label), nearest_before.is_later(&there)),
                    false => Dominance::Fails,
                };
                if by_it == Dominance::Holds {
                    self.note_tie(&there, &label);
                    return;
                }
                let of_it = match may_stand_for {
                    true => self.dominance((&label, &there), nearest_after.is_earlier(&there)),
                    false => Dominance::Fails,
                };
                match of_it {
                    Dominance::Holds => {
                        self.note_tie(&there, &label);
                        self.scratch.unlink(before, other);
                        other = after;
                        continue;
                    }
                    Dominance::UnlessParted => nearest_after = Nearest::of(&there, other),
                    Dominance::Fails => {}
                }
                // Not one that has just been dropped for this label: both would be lost.
                if by_it == Dominance::UnlessParted {
                    nearest_before = Nearest::of(&there, other);
                }
            }
            (before, other) = (other, after);
        }
        if self.is_dominated_by(nearest_before, &label) {
            return;
        }
        if let Some(there) = self
            .scratch
            .labels
            .get(nearest_after.label as usize)
            .copied()
            && !self.parted(&label, &there)
        {
            self.scratch.remove(nearest_after.label);
        }
        self.scratch.push(label, key);
    }

    /// Of two labels one is dropped for the other one: two ways may have the same weight.
    fn note_tie(&mut self, one: &Label, other: &Label) {
        let is_as_heavy = one.family.weight == other.family.weight;
        self.may_tie |= self.mode == Mode::Hovering && is_as_heavy && one.way != other.way;
    }

    /// Whether every plan that goes on from `other` has one from `one` that is as good; `one` is no worse at first. Where that may
    /// depend on what opens between them, and a nearer one is known, it is not looked at.
    fn dominance(&mut self, (one, other): (&Label, &Label), has_nearer: bool) -> Dominance {
        let may_be_parted = self.mode == Mode::Exact && one.family.hi_s < other.family.hi_s;
        if has_nearer && may_be_parted {
            return Dominance::Fails;
        }
        let is_start = |label: &Label| matches!(label.how, How::Start(_));
        if is_start(other) && !is_start(one) {
            // A closed node lets out who begins there, and nobody else.
            return Dominance::Fails;
        }
        let (earlier, later) = (&one.family, &other.family);
        if !earlier.has_battery_of(later, self.terms.tau_s) {
            return Dominance::Fails;
        }
        match self.mode {
            Mode::Hovering => Dominance::Holds,
            Mode::Earlier => {
                if !self.keeps_the_pad(one, other) || earlier.hi_s < later.hi_s {
                    let key = self.terms.key(later, other.node);
                    if key.beats(self.doubt) {
                        self.doubt = key;
                    }
                }
                Dominance::Holds
            }
            Mode::Exact if !self.keeps_the_pad(one, other) => Dominance::Fails,
            Mode::Exact if may_be_parted => Dominance::UnlessParted,
            Mode::Exact => Dominance::Holds,
        }
    }

    /// True unless `other` could still land here, on a pad that is free longer than the one that `one` has just left.
    fn keeps_the_pad(&self, one: &Label, other: &Label) -> bool {
        let node = one.node;
        let pads = self.terms.world.pads;
        if !pads.is_station(node) || self.terms.may_stop(one.how) || !self.terms.may_stop(other.how)
        {
            return true;
        }
        let How::Stop { arrived_s } = one.how else {
            return false;
        };
        let descent_s = self.terms.world.legs.vertical_s(node);
        let latest_s = other.family.hi_s + descent_s;
        !pads.rises_within(node, arrived_s + descent_s, latest_s)
    }

    /// True where an opening lies between the two.
    fn parted(&mut self, one: &Label, other: &Label) -> bool {
        let ItineraryScratch {
            openings,
            forbidden,
            active,
            ..
        } = &mut *self.scratch;
        openings.part(
            (&self.terms, active, forbidden),
            one.node,
            &one.family,
            &other.family,
            self.best,
            &mut self.effort.checks,
        )
    }
}
