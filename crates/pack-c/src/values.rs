//! What C gets, value by value, as `include/skyway_pack.h` lays it out. Its comments say what each means.

#![expect(missing_docs, reason = "the header that C reads has them")]

use core::ffi::c_int;
use skyway_pack::{Clock, HeightReference, Hop, Leg, Node, Pack, State, Stop, Way};

pub(crate) const DETOUR: c_int = 1;
pub(crate) const ALTERNATE: c_int = 2;

/// A number of two bytes that is unknown, or is none.
const NONE_16: u16 = u16::MAX;
const NONE_32: u32 = u32::MAX;

/// A pack that was read.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CPack {
    pub bytes: *const u8,
    pub length: usize,
}

/// A plan as a whole.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CPlan {
    pub token: u64,
    pub epoch: u64,
    pub not_after_ms: i64,
    pub departs_ms: i64,
    pub version: u32,
    pub leg_count: u16,
    pub clock: u8,
    pub height_reference: u8,
    pub is_planar: u8,
    pub is_timed: u8,
    pub has_first_stretch: u8,
    pub network_sha256: [u8; 32],
    pub key_id: [u8; 8],
    /// Ends with a zero.
    pub plan: [u8; 129],
}

/// A node.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CNode {
    pub index: u32,
    pub lon_e7_or_x_cm: i32,
    pub lat_e7_or_y_cm: i32,
    pub height_dm: i16,
}

/// A leg.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CLeg {
    pub from: CNode,
    pub to: CNode,
    pub departs_ds: u32,
    pub battery_e4: u16,
    pub dip_from_half_m: u8,
    pub dip_to_half_m: u8,
    pub lands_before: u8,
    pub detour: u8,
    pub alternate: u8,
}

/// A stay on a pad.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CStop {
    pub not_before_ds: u32,
    pub battery_e4: u16,
    pub stops: u8,
}

/// A way off the plan.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CWay {
    pub action: c_int,
    pub begins_with: CStop,
    pub leg: u16,
    pub rejoins: u16,
    pub battery_e4: u16,
    pub hop_count: u8,
    pub is_reserve_used: u8,
}

/// A segment of a way.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CHop {
    pub from: CNode,
    pub to: CNode,
    pub stop: CStop,
    pub dip_from_half_m: u8,
    pub dip_to_half_m: u8,
}

impl CPlan {
    pub(crate) fn of(pack: &Pack<'_>) -> Self {
        let (token, epoch, version) = pack.order();
        let mut plan = [0; 129];
        for (place, byte) in plan.iter_mut().zip(pack.plan().bytes().take(128)) {
            *place = byte;
        }
        Self {
            token,
            epoch,
            not_after_ms: pack.not_after_ms(),
            departs_ms: pack.departs_ms(),
            version,
            leg_count: pack.leg_count(),
            clock: match pack.clock() {
                Clock::Real => 0,
                Clock::Simulated => 1,
                Clock::External => 2,
            },
            height_reference: match pack.height_reference() {
                HeightReference::Unknown => 0,
                HeightReference::Agl => 1,
                HeightReference::Amsl => 2,
                HeightReference::Wgs84 => 3,
            },
            is_planar: pack.is_planar().into(),
            is_timed: pack.is_timed().into(),
            has_first_stretch: pack.has_first_stretch().into(),
            network_sha256: pack.network_sha256(),
            key_id: pack.key_id().0,
            plan,
        }
    }
}

impl CNode {
    fn of(node: Node) -> Self {
        Self {
            index: node.index,
            lon_e7_or_x_cm: node.place[0],
            lat_e7_or_y_cm: node.place[1],
            height_dm: node.height_dm.unwrap_or(i16::MIN),
        }
    }
}

impl CLeg {
    pub(crate) fn of(leg: Leg) -> Self {
        let [dip_from_half_m, dip_to_half_m] = leg.dips_half_m;
        Self {
            from: CNode::of(leg.from),
            to: CNode::of(leg.to),
            departs_ds: leg.departs_ds.unwrap_or(NONE_32),
            battery_e4: leg.battery_e4.unwrap_or(NONE_16),
            dip_from_half_m,
            dip_to_half_m,
            lands_before: leg.lands_before.into(),
            detour: state(leg.detour),
            alternate: state(leg.alternate),
        }
    }
}

fn state(state: State) -> u8 {
    match state {
        State::Pending => 0,
        State::Given => 1,
        State::None => 2,
        State::Void => 3,
        State::LeftOut => 4,
    }
}

impl CStop {
    fn of(stop: Option<Stop>) -> Self {
        let battery_e4 = stop.map_or(NONE_16, |stop| stop.battery_e4);
        let not_before_ds = stop.and_then(|stop| stop.not_before_ds);
        Self {
            not_before_ds: not_before_ds.unwrap_or(NONE_32),
            battery_e4,
            stops: stop.is_some().into(),
        }
    }
}

impl CWay {
    pub(crate) fn of(leg: u16, action: c_int, way: &Way<'_>) -> Self {
        Self {
            action,
            begins_with: CStop::of(way.begins_with()),
            leg,
            rejoins: way.rejoins().unwrap_or(NONE_16),
            battery_e4: way.battery_e4().unwrap_or(NONE_16),
            hop_count: way.hop_count(),
            is_reserve_used: way.is_reserve_used().into(),
        }
    }
}

impl CHop {
    pub(crate) fn of(hop: Hop) -> Self {
        let [dip_from_half_m, dip_to_half_m] = hop.dips_half_m;
        Self {
            from: CNode::of(hop.from),
            to: CNode::of(hop.to),
            stop: CStop::of(hop.stop),
            dip_from_half_m,
            dip_to_half_m,
        }
    }
}
