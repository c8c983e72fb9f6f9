//! Everything that a pack tells, asked for once: that nothing of it panics.

use skyway_pack::{Advice, Pack};

/// Asks for everything, and gives how much was told.
pub(crate) fn walk(pack: &Pack<'_>) -> usize {
    let texts = pack.plan().len() + pack.network().len();
    let whole = (
        pack.order(),
        pack.clock(),
        pack.height_reference(),
        pack.network_sha256(),
    );
    let times = (pack.departs_ms(), pack.may_depart(0), pack.is_timed());
    let mut told = texts + size_of_val(&whole) + size_of_val(&times);
    for number in 0..=pack.leg_count() {
        told += usize::from(pack.leg(number).is_some());
        for way in [pack.detour(number), pack.alternate(number)] {
            let Some(way) = way else { continue };
            told += way.hops().filter(|hop| hop.stop.is_some()).count();
            told += usize::from(way.begins_with().is_some() || way.is_reserve_used());
            told += way.to().place.len() + usize::from(way.rejoins().unwrap_or_default());
        }
        for battery in [None, Some(0), Some(5_000), Some(u16::MAX)] {
            told += usize::from(matches!(pack.if_closed(number, battery), Advice::Detour(_)));
        }
    }
    told
}
