//! The door through which flight controllers in C read packs: `include/skyway_pack.h`, function by function.
//!
//! This is the only crate with unsafe code. What C hands in is a place in memory, which nobody but its caller can vouch for;
//! everything else is [`skyway_pack`], which has none. Nothing is kept between two calls: a pack is looked at anew with each
//! of them, so that a structure that C has bent leads to a fault and never out of bounds.

#![no_std]
#![deny(unsafe_op_in_unsafe_fn)]

#[cfg(feature = "std")]
extern crate std;

mod values;

pub use values::{CHop, CLeg, CPack, CPlan, CStop, CWay};

use core::ffi::c_int;
use skyway_pack::{Advice, Fault, Pack};
use values::{ALTERNATE, DETOUR};

/// Done.
const OK: c_int = 0;
/// There is nothing of this number.
const ERROR_NUMBER: c_int = -1;
/// A place in memory is missing.
const ERROR_NULL: c_int = -2;

#[cfg(not(feature = "std"))]
#[panic_handler]
fn stop(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

fn code(fault: Fault) -> c_int {
    match fault {
        Fault::Magic => -10,
        Fault::Format(_) => -11,
        Fault::Length => -12,
        Fault::Field(_) => -13,
        Fault::Key => -14,
        Fault::Signature => -15,
    }
}

/// Reads a pack and checks that a key has signed it; fills in `pack`, which points at `bytes` from then on.
///
/// # Safety
/// `bytes` points at `length` bytes, `key` at 32, `pack` at room for a pack, or any of them is null. The bytes stay as and where they are
/// as long as the pack is used.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skyway_pack_read(
    bytes: *const u8,
    length: usize,
    key: *const [u8; 32],
    pack: *mut CPack,
) -> c_int {
    if bytes.is_null() || key.is_null() || pack.is_null() {
        return ERROR_NULL;
    }
    // SAFETY: none is null, and the caller vouches for so many bytes at each.
    let (read, key) = unsafe { (core::slice::from_raw_parts(bytes, length), *key) };
    if let Err(fault) = Pack::read(read, &key) {
        return code(fault);
    }
    // SAFETY: it is not null, and the caller vouches for room for a pack.
    unsafe { pack.write(CPack { bytes, length }) };
    OK
}

/// What is looked at, as it was read before.
///
/// # Safety
/// `pack` is null, or points at a pack that `skyway_pack_read` has filled in, whose bytes are still there.
unsafe fn opened<'a>(pack: *const CPack) -> Result<Pack<'a>, c_int> {
    if pack.is_null() {
        return Err(ERROR_NULL);
    }
    // SAFETY: it is not null, and the caller vouches for what is there.
    let CPack { bytes, length } = unsafe { pack.read() };
    if bytes.is_null() {
        return Err(ERROR_NULL);
    }
    // SAFETY: it is not null, and the caller vouches for the bytes.
    let bytes = unsafe { core::slice::from_raw_parts(bytes, length) };
    Pack::read_unverified(bytes).map_err(code)
}

/// Fills in what the caller asked for.
///
/// # Safety
/// `into` is null, or points at room for such a value.
unsafe fn fill<T>(into: *mut T, value: Result<T, c_int>) -> c_int {
    match value {
        Err(error) => error,
        Ok(_) if into.is_null() => ERROR_NULL,
        Ok(value) => {
            // SAFETY: it is not null, and the caller vouches for the room.
            unsafe { into.write(value) };
            OK
        }
    }
}

/// What a pack says of its plan as a whole.
///
/// # Safety
/// `pack` is one that was read, whose bytes are still there; `plan` is room for a plan.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skyway_pack_plan(pack: *const CPack, plan: *mut CPlan) -> c_int {
    // SAFETY: the caller vouches for both.
    unsafe { fill(plan, opened(pack).map(|pack| CPlan::of(&pack))) }
}

/// A leg, counted from 0.
///
/// # Safety
/// `pack` is one that was read, whose bytes are still there; `leg` is room for a leg.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skyway_pack_leg(pack: *const CPack, number: u16, leg: *mut CLeg) -> c_int {
    let told = |pack: Pack<'_>| pack.leg(number).map(CLeg::of).ok_or(ERROR_NUMBER);
    // SAFETY: the caller vouches for both.
    unsafe { fill(leg, opened(pack).and_then(told)) }
}

/// What a drone does at the first node of a leg that has closed: 1 for the detour, 2 for the alternate, 0 where nothing is known;
/// of the former two `way` is filled in. Of a battery above 10000 nothing is known.
///
/// # Safety
/// `pack` is one that was read, whose bytes are still there; `way` is room for a way.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skyway_pack_if_closed(
    pack: *const CPack,
    leg: u16,
    battery_e4: u16,
    way: *mut CWay,
) -> c_int {
    // SAFETY: the caller vouches for it.
    let pack = match unsafe { opened(pack) } {
        Ok(pack) => pack,
        Err(error) => return error,
    };
    let battery_e4 = (battery_e4 <= 10_000).then_some(battery_e4);
    let (action, found) = match pack.if_closed(leg, battery_e4) {
        Advice::Detour(found) => (DETOUR, found),
        Advice::Alternate(found) => (ALTERNATE, found),
        Advice::Unknown(_) => return 0,
    };
    // SAFETY: the caller vouches for the room.
    match unsafe { fill(way, Ok(CWay::of(leg, action, &found))) } {
        OK => action,
        error => error,
    }
}

/// A segment of a way, counted from 0.
///
/// # Safety
/// `pack` is one that was read, whose bytes are still there; `way` is null or one of it; `hop` is room for a segment.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skyway_pack_hop(
    pack: *const CPack,
    way: *const CWay,
    number: u8,
    hop: *mut CHop,
) -> c_int {
    if way.is_null() {
        return ERROR_NULL;
    }
    // SAFETY: it is not null, and the caller vouches for what is there: numbers, of which any value will do.
    let (leg, action) = unsafe { ((*way).leg, (*way).action) };
    let told = |pack: Pack<'_>| {
        let way = match action {
            DETOUR => pack.detour(leg),
            _ => pack.alternate(leg),
        };
        let hop = way.and_then(|way| way.hops().nth(usize::from(number)));
        hop.map(CHop::of).ok_or(ERROR_NUMBER)
    };
    // SAFETY: the caller vouches for both.
    unsafe { fill(hop, opened(pack).and_then(told)) }
}
