//! Whether bytes are a pack: every field is looked at once, so that nothing that is read later can be out of bounds.

use crate::fault::Fault;
use crate::layout::{
    FORMAT, FULL_BATTERY, HEADER, HOP, LEG, MAGIC, NETWORK_NAME_MAX, NODE, NODES_MAX, NONE_16,
    Numbers, PLAN_ID_MAX, SHIFT_MAX, SIGNATURE, STOP, STOPS, State, UNIT, WAY, flag, header, leg,
    stop, way,
};
use crate::pack::Pack;

/// Checks everything but the signature.
pub(crate) fn check(pack: &Pack<'_>) -> Result<(), Fault> {
    let bytes = pack.bytes;
    if bytes.len() < HEADER {
        return Err(match bytes.starts_with(&MAGIC) {
            true => Fault::Length,
            false => Fault::Magic,
        });
    }
    check_header(bytes)?;
    let units = usize::from(bytes.u16(header::UNITS));
    let length = pack.ways_at() + units * UNIT + SIGNATURE;
    if bytes.len() != length || usize::try_from(bytes.u32(header::LENGTH)) != Ok(length) {
        return Err(Fault::Length);
    }
    check_texts(pack)?;
    (0..pack.node_count()).try_for_each(|number| check_node(pack, number))?;
    (0..pack.leg_count()).try_for_each(|number| check_leg(pack, number))
}

fn check_header(bytes: &[u8]) -> Result<(), Fault> {
    if !bytes.starts_with(&MAGIC) {
        return Err(Fault::Magic);
    }
    match bytes.u8(header::FORMAT) {
        FORMAT => {}
        other => return Err(Fault::Format(other)),
    }
    let flags = bytes.u8(header::FLAGS);
    let is_clock = (flags >> flag::CLOCK_AT) & 3 != 3;
    let fields = [
        (header::FLAGS, flags & flag::SPARE == 0 && is_clock),
        (
            header::PLAN_LENGTH,
            bytes.u8(header::PLAN_LENGTH) <= PLAN_ID_MAX,
        ),
        (
            header::NETWORK_LENGTH,
            bytes.u8(header::NETWORK_LENGTH) <= NETWORK_NAME_MAX,
        ),
        (
            header::NODES,
            usize::from(bytes.u16(header::NODES)) <= NODES_MAX,
        ),
        (header::SHIFT, bytes.u8(header::SHIFT) <= SHIFT_MAX),
        (header::SPARE, bytes.u8(header::SPARE) == 0),
    ];
    match fields.iter().find(|(_, is_right)| !is_right) {
        Some(&(at, _)) => Err(Fault::Field(at)),
        None => Ok(()),
    }
}

fn check_texts(pack: &Pack<'_>) -> Result<(), Fault> {
    let bytes = pack.bytes;
    let plan = HEADER + usize::from(bytes.u8(header::PLAN_LENGTH));
    let network = plan + usize::from(bytes.u8(header::NETWORK_LENGTH));
    for (from, until) in [(HEADER, plan), (plan, network)] {
        let text = bytes.get(from..until).unwrap_or_default();
        core::str::from_utf8(text).map_err(|_| Fault::Field(from))?;
    }
    let filling = bytes.get(network..pack.nodes_at()).unwrap_or_default();
    match filling.iter().all(|byte| *byte == 0) {
        true => Ok(()),
        false => Err(Fault::Field(network)),
    }
}

/// A place that is no number of 32 bits is none.
fn check_node(pack: &Pack<'_>, number: usize) -> Result<(), Fault> {
    let bytes = pack.bytes;
    let at = pack.nodes_at() + number * NODE;
    let is_place = |axis: usize| {
        let offset = i64::from(bytes.i24(at + 4 + 3 * axis)) << bytes.u8(header::SHIFT);
        let place = i64::from(bytes.i32(header::ORIGIN + 4 * axis)) + offset;
        i32::try_from(place).is_ok()
    };
    match is_place(0) && is_place(1) {
        true => Ok(()),
        false => Err(Fault::Field(at + 4)),
    }
}

fn check_leg(pack: &Pack<'_>, number: u16) -> Result<(), Fault> {
    let bytes = pack.bytes;
    let at = pack.legs_at() + usize::from(number) * LEG;
    let is_node = |at: usize| usize::from(bytes.u16(at)) < pack.node_count();
    let follows = number == 0 || bytes.u16(at + leg::FROM) == bytes.u16(at - LEG + leg::TO);
    let fields = [
        (leg::FROM, is_node(at + leg::FROM) && follows),
        (leg::TO, is_node(at + leg::TO)),
        (leg::BATTERY, is_battery(bytes.u16(at + leg::BATTERY))),
        (leg::FLAGS, bytes.u8(at + leg::FLAGS) & !leg::LANDS == 0),
        (leg::SPARE, bytes.u8(at + leg::SPARE) == 0),
    ];
    if let Some((field, _)) = fields.iter().find(|(_, is_right)| !is_right) {
        return Err(Fault::Field(at + field));
    }
    let ways = [
        (leg::DETOUR_STATE, leg::DETOUR),
        (leg::ALTERNATE_STATE, leg::ALTERNATE),
    ];
    for (state, offset) in ways {
        let offset_value = bytes.u16(at + offset);
        match State::of(bytes.u8(at + state)) {
            None => return Err(Fault::Field(at + state)),
            Some(State::Given) => check_way(pack, bytes.u16(at + leg::FROM), offset_value)?,
            Some(_) if offset_value != NONE_16 => return Err(Fault::Field(at + offset)),
            Some(_) => {}
        }
    }
    Ok(())
}

fn check_way(pack: &Pack<'_>, from: u16, offset: u16) -> Result<(), Fault> {
    let bytes = pack.bytes;
    let at = pack.ways_at() + usize::from(offset) * UNIT;
    let last = last_node(
        bytes,
        (at, bytes.len() - SIGNATURE),
        from,
        pack.node_count(),
    )?;
    let rejoins = bytes.u16(at + way::REJOINS);
    let met = pack.legs_at() + usize::from(rejoins) * LEG;
    let is_met = rejoins < pack.leg_count() && bytes.u16(met + leg::FROM) == last;
    match rejoins == NONE_16 || is_met {
        true => Ok(()),
        false => Err(Fault::Field(at + way::REJOINS)),
    }
}

/// The number of the last node of a way that begins at a place and has to end before `end`.
fn last_node(
    bytes: &[u8],
    (at, end): (usize, usize),
    from: u16,
    nodes: usize,
) -> Result<u16, Fault> {
    let known = way::RESERVE_USED | way::BEGINS_WITH_STOP;
    let flags = bytes.u8(at + way::FLAGS);
    let is_clean = flags & !known == 0 && bytes.u16(at + way::SPARE) == 0;
    if at + WAY > end || !is_clean || !is_battery(bytes.u16(at + way::BATTERY)) {
        return Err(Fault::Field(at));
    }
    let mut place = at + WAY;
    if flags & way::BEGINS_WITH_STOP != 0 {
        place = after_stop(bytes, place, end)?;
    }
    let mut last = from;
    for _ in 0..bytes.u8(at + way::HOPS) {
        let word = bytes.u16(place);
        last = word & !STOPS;
        if place + HOP > end || usize::from(last) >= nodes {
            return Err(Fault::Field(place));
        }
        place += HOP;
        if word & STOPS != 0 {
            place = after_stop(bytes, place, end)?;
        }
    }
    Ok(last)
}

fn after_stop(bytes: &[u8], at: usize, end: usize) -> Result<usize, Fault> {
    let is_battery = bytes.u16(at + stop::BATTERY) <= FULL_BATTERY;
    let is_clean = is_battery && bytes.u16(at + stop::SPARE) == 0;
    match is_clean && at + STOP <= end {
        true => Ok(at + STOP),
        false => Err(Fault::Field(at)),
    }
}

/// Whether a number is a battery, or none.
fn is_battery(number: u16) -> bool {
    number <= FULL_BATTERY || number == NONE_16
}
