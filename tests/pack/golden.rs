//! A pack that was written once has to stay readable, and to say the same.

use crate::drafts::{covered, key};
use skyway_pack::{Advice, Pack, State};

/// Written by format 1 when it began; no later program changes it.
const WRITTEN: &[u8] = include_bytes!("golden/format-1.pack");
const PUBLIC: [u8; 32] = *include_bytes!("golden/format-1.key");

#[test]
fn an_old_pack_is_read() {
    let pack = Pack::read(WRITTEN, &PUBLIC).expect("readable");
    assert_eq!(pack.plan(), "night-mail");
    assert_eq!(pack.network(), "Sydney CBD");
    assert_eq!(pack.order(), (0, 1_795_773_600_000, 2));
    assert_eq!(pack.not_after_ms(), 1_795_777_200_000);
    assert_eq!(pack.leg_count(), 4);
    let legs: Vec<_> = pack.legs().collect();
    assert_eq!(legs[2].from.place, [1_512_216_000, -338_880_000]);
    assert_eq!(legs[2].from.height_dm, Some(302));
    assert!(legs[2].lands_before && !legs[1].lands_before);
    assert!(legs.iter().all(|leg| leg.detour == State::Given));
    let Advice::Detour(way) = pack.if_closed(1, Some(5_000)) else {
        panic!("no detour");
    };
    let indices: Vec<u32> = way.hops().map(|hop| hop.to.index).collect();
    assert_eq!(indices, [1_002, 1_003, 2]);
    assert_eq!(way.rejoins(), Some(2));
}

/// Ed25519 signs the same bytes the same way, so that an entity tag stays as long as nothing changes.
#[test]
fn the_same_is_written_today() {
    assert_eq!(covered(4).write(&key()).as_deref(), Ok(WRITTEN));
    assert_eq!(key().public(), PUBLIC);
}
