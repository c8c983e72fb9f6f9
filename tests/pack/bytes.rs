//! Whatever the bytes are, nothing panics; what was bent is refused; and no pack is longer than it may be.

use crate::drafts::{bare, covered, drawn, hop, key};
use crate::walked::walk;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use skyway_pack::write::{Contingency, SigningKey, Unwritable};
use skyway_pack::{Fault, Pack, State, bytes_max};

/// How many drawn inputs each test reads; `SKYWAY_CASES` multiplies it.
fn cases(count: u64) -> u64 {
    let times = option_env!("SKYWAY_CASES").and_then(|text| text.parse::<u64>().ok());
    count * times.unwrap_or(1)
}

#[test]
fn no_bytes_make_the_reader_panic() {
    let mut dice = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..cases(20_000) {
        let mut bytes = vec![0; (dice.next_u32() % 400) as usize];
        dice.fill_bytes(&mut bytes);
        for (place, byte) in bytes.iter_mut().zip(*b"SKPK\x01") {
            *place = byte;
        }
        if let Ok(pack) = Pack::read_unverified(&bytes) {
            walk(&pack);
        }
    }
}

/// Bent where lengths, counts and offsets are, so that many pass the checks of the fields before.
#[test]
fn no_bent_pack_makes_the_reader_panic() {
    let mut dice = ChaCha8Rng::seed_from_u64(2);
    let mut read = 0;
    for case in 0..cases(20_000) {
        let mut bytes = drawn(case % 300).write(&key()).expect("a pack");
        for _ in 0..1 + dice.next_u32() % 4 {
            let place = dice.next_u32() as usize % bytes.len();
            bytes[place] = dice.next_u32() as u8;
        }
        if dice.next_u32().is_multiple_of(8) {
            bytes.truncate(dice.next_u32() as usize % bytes.len());
        }
        if let Ok(pack) = Pack::read_unverified(&bytes) {
            read += usize::from(walk(&pack) > 0);
        }
    }
    assert!(read > 1_000, "only {read} bent packs were read");
}

#[test]
fn each_flipped_bit_is_refused() {
    let public = key().public();
    let mut bytes = covered(10).write(&key()).expect("a pack");
    assert!(Pack::read(&bytes, &public).is_ok());
    for bit in 0..bytes.len() * 8 {
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(Pack::read(&bytes, &public).is_err(), "bit {bit}");
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
    assert!(Pack::read(&bytes, &public).is_ok());
}

#[test]
fn what_is_cut_or_longer_is_refused() {
    let public = key().public();
    let mut bytes = covered(3).write(&key()).expect("a pack");
    for length in 0..bytes.len() {
        assert!(Pack::read(&bytes[..length], &public).is_err(), "{length}");
    }
    bytes.push(0);
    assert_eq!(Pack::read(&bytes, &public), Err(Fault::Length));
}

/// Of a leg with a detour over three nodes and an alternate over one.
#[test]
fn ways_over_nodes_that_are_not_there_or_beyond_the_end_are_refused() {
    let bytes = covered(1).write(&key()).expect("a pack");
    let ways_at = bytes.len() - 64 - (8 + 3 * 4) - (8 + 4);
    let bent = |at: usize, byte: u8| {
        let mut bytes = bytes.clone();
        bytes[ways_at + at] = byte;
        // So that it would be a segment to node 0.
        bytes[ways_at + 32..ways_at + 36].fill(0);
        Pack::read_unverified(&bytes).err()
    };
    let nodes = bytes[14];
    assert_eq!(bent(8, nodes - 1), None);
    assert_eq!(bent(8, nodes), Some(Fault::Field(ways_at + 8)));
    assert_eq!(bent(20 + 4, 1), None);
    // A second segment of the alternate would be the signature.
    assert_eq!(bent(20 + 4, 2), Some(Fault::Field(ways_at + 32)));
}

#[test]
fn another_key_or_format_is_named() {
    let mut bytes = bare(2).write(&key()).expect("a pack");
    let other = SigningKey::of_seed(&[8; 32]);
    assert_eq!(Pack::read(&bytes, &other.public()), Err(Fault::Key));
    bytes[4] = 2;
    assert_eq!(Pack::read(&bytes, &key().public()), Err(Fault::Format(2)));
    assert_eq!(Pack::read(b"{}", &key().public()), Err(Fault::Magic));
}

/// 2 KiB for ten legs and 150 bytes for each further one, whatever is to be said.
#[test]
fn no_pack_is_longer_than_it_may_be() {
    for legs in 0..120 {
        let mut draft = covered(legs);
        draft.plan = "p".repeat(128);
        for (number, leg) in (0..).zip(&mut draft.legs) {
            if let Contingency::Way(way) = &mut leg.detour {
                let beside = (0..40).map(|more| hop(10_000 + 40 * number + more));
                way.hops.splice(0..0, beside);
            }
        }
        let bytes = draft.write(&key()).expect("a pack");
        assert!(bytes.len() <= bytes_max(legs as usize), "{legs} legs");
        let pack = Pack::read(&bytes, &key().public()).expect("readable");
        assert!(walk(&pack) > 0);
        let left_out = pack.legs().filter(|leg| leg.detour == State::LeftOut);
        assert!(legs < 10 || left_out.count() > 0, "{legs} legs have all");
    }
    assert_eq!(bytes_max(10), 2_048);
    assert_eq!(bytes_max(11), 2_198);
}

/// What is usual has room, however many legs there are.
#[test]
fn usual_contingencies_have_room() {
    for legs in 1..200 {
        let bytes = covered(legs).write(&key()).expect("a pack");
        let pack = Pack::read(&bytes, &key().public()).expect("readable");
        let is_given = |state| state == State::Given;
        assert!(pack.legs().all(|leg| is_given(leg.detour)), "{legs} legs");
        assert!(pack.legs().all(|leg| is_given(leg.alternate)));
    }
}

#[test]
fn what_cannot_be_packed_is_refused() {
    let mut draft = bare(2);
    draft.plan = "p".repeat(129);
    assert_eq!(draft.write(&key()), Err(Unwritable::PlanId));
    let mut draft = bare(3);
    draft.legs.remove(1);
    assert_eq!(draft.write(&key()), Err(Unwritable::Legs));
    let mut draft = bare(1);
    draft.legs[0].to.place = [i32::MIN, i32::MAX];
    let bytes = draft.write(&key()).expect("half the world is shifted");
    assert!(Pack::read(&bytes, &key().public()).is_ok());
}
