//! When a label makes another one at its node needless.

use super::label::{How, Label, NO_LABEL};
use super::memory::ItineraryScratch;
use super::run::{Mode, Run};

impl Run<'_, '_> {
    /// True where a label cannot be an improvement, or one at its node can do all that it can.
    pub(super) fn is_needless(&mut self, label: &Label) -> bool {
        if !self.is_worth(self.terms.key(&label.family, label.node)) {
            return true;
        }
        let mut other = self.scratch.head(label.node);
        while other != NO_LABEL {
            self.effort.checks += 1;
            let there = self.scratch.labels[other as usize];
            let may_be_needless = there.family.is_no_worse_at_first(&label.family);
            if may_be_needless && self.dominates(&there, label) {
                self.note_tie(&there, label);
                return true;
            }
            other = there.next;
        }
        false
    }

    /// Keeps a label unless it cannot be an improvement or another one at its node makes it needless.
    pub(super) fn offer(&mut self, label: Label) {
        let key = self.terms.key(&label.family, label.node);
        if !self.is_worth(key) {
            return;
        }
        let (mut before, mut other) = (NO_LABEL, self.scratch.head(label.node));
        while other != NO_LABEL {
            self.effort.checks += 1;
            let there = &self.scratch.labels[other as usize];
            let after = there.next;
            let may_be_needless = there.family.is_no_worse_at_first(&label.family);
            let may_stand_for = label.family.is_no_worse_at_first(&there.family);
            if may_be_needless || may_stand_for {
                let there = *there;
                if may_be_needless && self.dominates(&there, &label) {
                    self.note_tie(&there, &label);
                    return;
                }
                if may_stand_for && self.dominates(&label, &there) {
                    self.note_tie(&there, &label);
                    self.scratch.unlink(before, other);
                    other = after;
                    continue;
                }
            }
            (before, other) = (other, after);
        }
        self.scratch.push(label, key);
    }

    /// Of two labels one is dropped for the other one: two ways may have the same weight.
    fn note_tie(&mut self, one: &Label, other: &Label) {
        let is_as_heavy = one.family.weight == other.family.weight;
        self.may_tie |= self.mode == Mode::Hovering && is_as_heavy && one.way != other.way;
    }

    /// True where every plan that goes on from `other` has one from `one` that is as good; `one` is no worse at first.
    fn dominates(&mut self, one: &Label, other: &Label) -> bool {
        let is_start = |label: &Label| matches!(label.how, How::Start(_));
        if is_start(other) && !is_start(one) {
            // A closed node lets out who begins there, and nobody else.
            return false;
        }
        let (earlier, later) = (&one.family, &other.family);
        if !earlier.has_battery_of(later, self.terms.tau_s) {
            return false;
        }
        match self.mode {
            Mode::Hovering => true,
            Mode::Earlier => {
                if !self.keeps_the_pad(one, other) || earlier.hi_s < later.hi_s {
                    let key = self.terms.key(later, other.node);
                    if key.beats(self.doubt) {
                        self.doubt = key;
                    }
                }
                true
            }
            Mode::Exact => {
                self.keeps_the_pad(one, other)
                    && (earlier.hi_s >= later.hi_s || !self.parted(one, other))
            }
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
