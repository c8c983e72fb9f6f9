//! A way off the plan: from the first node of a leg to where it meets the plan again, or to where the drone lands.

use crate::layout::{HOP, NONE_32, Numbers, STOP, STOPS, UNIT, WAY, stop, way};
use crate::pack::{Node, Pack, known_16};

/// A way off the plan, from the first node of a leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Way<'a> {
    pack: Pack<'a>,
    from: u16,
    /// Where it lies in the bytes.
    at: usize,
}

/// A stay on a pad of a way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stop {
    /// The battery to take off with at least, in hundredths of a percent.
    pub battery_e4: u16,
    /// Not to take off before so many tenths of a second after the plan's departure.
    pub not_before_ds: Option<u32>,
}

/// One segment of a way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hop {
    /// The node it starts from.
    pub from: Node,
    /// The node it ends at.
    pub to: Node,
    /// How far below the heights of both nodes it is flown at its beginning and its end, in half metres.
    pub dips_half_m: [u8; 2],
    /// What the drone does at its end before it flies on.
    pub stop: Option<Stop>,
}

impl<'a> Way<'a> {
    pub(crate) fn at(pack: Pack<'a>, from: u16, offset: u16) -> Self {
        let at = pack.ways_at() + usize::from(offset) * UNIT;
        Self { pack, from, at }
    }

    fn bytes(&self) -> &'a [u8] {
        self.pack.bytes
    }

    /// The battery that it takes at its first node, in hundredths of a percent; `None` where that is unknown.
    pub fn battery_e4(&self) -> Option<u16> {
        known_16(self.bytes().u16(self.at + way::BATTERY))
    }

    /// The leg of the plan, counted from 0, at whose first node it ends, to be flown on from there; `None` where the drone
    /// lands at its end.
    pub fn rejoins(&self) -> Option<u16> {
        known_16(self.bytes().u16(self.at + way::REJOINS))
    }

    /// Whether it draws on the reserve.
    pub fn is_reserve_used(&self) -> bool {
        self.flags() & way::RESERVE_USED != 0
    }

    /// What the drone does at its first node before it flies anywhere.
    pub fn begins_with(&self) -> Option<Stop> {
        self.begins_with_stop()
            .then(|| self.stop_at(self.at + WAY))
            .flatten()
    }

    /// The node that it begins at.
    pub fn from(&self) -> Node {
        self.pack.node(self.from)
    }

    /// The node that it ends at.
    pub fn to(&self) -> Node {
        self.hops().last().map_or_else(|| self.from(), |hop| hop.to)
    }

    /// How many segments it has.
    pub fn hop_count(&self) -> u8 {
        self.bytes().u8(self.at + way::HOPS)
    }

    /// Its segments in their order.
    pub fn hops(&self) -> Hops<'a> {
        let begins_after = match self.begins_with_stop() {
            true => STOP,
            false => 0,
        };
        Hops {
            way: *self,
            left: self.hop_count(),
            from: self.from,
            at: self.at + WAY + begins_after,
        }
    }

    /// Whether it flies a segment, in either direction, by the indices of its ends.
    pub fn flies(&self, ends: (u32, u32)) -> bool {
        self.hops().any(|hop| {
            let flown = (hop.from.index, hop.to.index);
            flown == ends || flown == (ends.1, ends.0)
        })
    }

    pub(crate) fn flags(&self) -> u8 {
        self.bytes().u8(self.at + way::FLAGS)
    }

    fn begins_with_stop(&self) -> bool {
        self.flags() & way::BEGINS_WITH_STOP != 0
    }

    fn stop_at(&self, at: usize) -> Option<Stop> {
        let not_before = self.bytes().u32(at + stop::NOT_BEFORE);
        Some(Stop {
            battery_e4: known_16(self.bytes().u16(at + stop::BATTERY))?,
            not_before_ds: (not_before != NONE_32).then_some(not_before),
        })
    }
}

/// The segments of a way.
#[derive(Clone, Debug)]
pub struct Hops<'a> {
    way: Way<'a>,
    left: u8,
    from: u16,
    at: usize,
}

impl Iterator for Hops<'_> {
    type Item = Hop;

    fn next(&mut self) -> Option<Hop> {
        self.left = self.left.checked_sub(1)?;
        let bytes = self.way.bytes();
        let word = bytes.u16(self.at);
        let [one, other] = bytes.array(self.at + 2);
        self.at += HOP;
        let stop = match word & STOPS {
            0 => None,
            _ => {
                self.at += STOP;
                self.way.stop_at(self.at - STOP)
            }
        };
        let to = word & !STOPS;
        let from = core::mem::replace(&mut self.from, to);
        Some(Hop {
            from: self.way.pack.node(from),
            to: self.way.pack.node(to),
            dips_half_m: [one, other],
            stop,
        })
    }
}
