//! What a drone does where a leg has closed before it.

use crate::layout::State;
use crate::pack::Pack;
use crate::way::Way;

/// What a drone does that is at the first node of a leg, which has closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Advice<'a> {
    /// It takes the detour.
    Detour(Way<'a>),
    /// It flies to the alternate and lands there.
    Alternate(Way<'a>),
    /// Nothing is known.
    Unknown(Unknown),
}

/// Why nothing is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// The plan has no such leg.
    Leg,
    /// The pack has no contingency of this leg: what it knows of the detour.
    Contingency(State),
    /// The battery suffices for neither.
    Battery,
}

impl<'a> Pack<'a> {
    /// What a drone does at the first node of a leg that has closed, with so much battery in hundredths of a percent where it
    /// knows that: the detour, else the alternate unless the way there is closed too.
    pub fn if_closed(&self, number: u16, battery_e4: Option<u16>) -> Advice<'a> {
        let Some(leg) = self.leg(number) else {
            return Advice::Unknown(Unknown::Leg);
        };
        let closed = (leg.from.index, leg.to.index);
        let is_open = |way: &Way<'_>| !way.flies(closed) && !self.flies_after(way, closed);
        let suffices = |way: &Way<'_>| match (battery_e4, way.battery_e4()) {
            (Some(there_is), Some(needed)) => there_is >= needed,
            _ => true,
        };
        let detour = self.detour(number).filter(is_open);
        let alternate = self.alternate(number).filter(is_open);
        if let Some(way) = detour.filter(suffices) {
            return Advice::Detour(way);
        }
        if let Some(way) = alternate.filter(suffices) {
            return Advice::Alternate(way);
        }
        Advice::Unknown(match detour.or(alternate) {
            Some(_) => Unknown::Battery,
            None => Unknown::Contingency(leg.detour),
        })
    }

    /// Whether the plan flies a segment after a way has met it again, in either direction.
    fn flies_after(&self, way: &Way<'_>, ends: (u32, u32)) -> bool {
        let after = way.rejoins().unwrap_or(self.leg_count())..self.leg_count();
        let mut legs = after.filter_map(|number| self.leg(number));
        legs.any(|leg| {
            let flown = (leg.from.index, leg.to.index);
            flown == ends || flown == (ends.1, ends.0)
        })
    }
}
