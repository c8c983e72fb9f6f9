//! Packs that tests begin with: plans that are drawn, and one that never changes.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use skyway_pack::write::{Contingency, Draft, DraftHop, DraftLeg, DraftWay, SigningKey};
use skyway_pack::{Clock, HeightReference, Node, State, Stop};

/// The key that signs what tests read.
pub(crate) fn key() -> SigningKey {
    SigningKey::of_seed(&[7; 32])
}

/// A plan over nodes in a row, each a kilometre from the next, without contingencies.
pub(crate) fn bare(legs: u32) -> Draft {
    let legs = (0..legs).map(|number| DraftLeg {
        from: node(number),
        to: node(number + 1),
        dips_half_m: [0, 4],
        battery_e4: Some(9_000 - 10 * number as u16),
        departs_ds: Some(625 * number),
        lands_before: number == 2,
        detour: Contingency::Without(State::None),
        alternate: Contingency::Without(State::None),
    });
    Draft {
        plan: "night-mail".to_owned(),
        network: "Sydney CBD".to_owned(),
        network_sha256: [3; 32],
        order: (0, 1_795_773_600_000, 2),
        not_after_ms: 1_795_777_200_000,
        departs_ms: 1_795_773_600_000,
        clock: Clock::Real,
        heights: HeightReference::Agl,
        is_planar: false,
        is_timed: true,
        has_first_stretch: false,
        legs: legs.collect(),
    }
}

/// The same with a detour over two nodes beside it, and an alternate behind it, for each leg.
pub(crate) fn covered(legs: u32) -> Draft {
    let mut draft = bare(legs);
    for (number, leg) in (0..).zip(&mut draft.legs) {
        let beside = 1_000 + 2 * number;
        leg.detour = Contingency::Way(DraftWay {
            battery_e4: Some(4_000),
            rejoins: (number + 1 < legs).then_some(number as u16 + 1),
            is_reserve_used: false,
            begins_with: None,
            hops: vec![hop(beside), hop(beside + 1), hop(number + 1)],
        });
        leg.alternate = Contingency::Way(DraftWay {
            battery_e4: Some(1_200),
            rejoins: None,
            is_reserve_used: true,
            begins_with: None,
            hops: vec![hop(2_000 + number)],
        });
    }
    draft
}

pub(crate) fn node(index: u32) -> Node {
    Node {
        index,
        place: [
            1_512_000_000 + 108_000 * (index % 5_000) as i32,
            -338_700_000 - 90_000 * (index % 7) as i32,
        ],
        height_dm: Some(300 + (index % 50) as i16),
    }
}

pub(crate) fn hop(to: u32) -> DraftHop {
    DraftHop {
        to: node(to),
        dips_half_m: [2, 0],
        stop: None,
    }
}

/// A plan of which everything is drawn.
pub(crate) fn drawn(seed: u64) -> Draft {
    let mut dice = ChaCha8Rng::seed_from_u64(seed);
    let count = dice.next_u32() % 30;
    let mut draft = bare(count);
    draft.plan = "p".repeat((dice.next_u32() % 129) as usize);
    draft.network = "ä".repeat((dice.next_u32() % 40) as usize);
    draft.is_planar = dice.next_u32().is_multiple_of(2);
    draft.has_first_stretch = dice.next_u32().is_multiple_of(2);
    draft.clock = [Clock::Real, Clock::Simulated, Clock::External][dice.next_u32() as usize % 3];
    let rejoining = draft.legs.iter().map(|leg| leg.from.index);
    let rejoining: Vec<u32> = rejoining.collect();
    for leg in &mut draft.legs {
        leg.detour = contingency(&mut dice, &rejoining);
        leg.alternate = contingency(&mut dice, &rejoining);
    }
    draft
}

fn contingency(dice: &mut ChaCha8Rng, rejoining: &[u32]) -> Contingency {
    let states = [State::Pending, State::None, State::Void, State::LeftOut];
    let drawn = dice.next_u32() as usize % 8;
    if let Some(state) = states.get(drawn) {
        return Contingency::Without(*state);
    }
    let mut hops: Vec<DraftHop> = (0..dice.next_u32() % 12)
        .map(|_| DraftHop {
            stop: stop(dice),
            dips_half_m: [dice.next_u32() as u8, dice.next_u32() as u8],
            ..hop(dice.next_u32() % 60)
        })
        .collect();
    let met = dice.next_u32() as usize % (rejoining.len() + 1);
    let rejoins = rejoining.get(met).copied();
    if let Some(index) = rejoins {
        hops.push(hop(index));
    }
    Contingency::Way(DraftWay {
        battery_e4: (dice.next_u32().is_multiple_of(2)).then(|| (dice.next_u32() % 10_001) as u16),
        rejoins: rejoins.map(|_| met as u16),
        is_reserve_used: dice.next_u32().is_multiple_of(2),
        begins_with: stop(dice),
        hops,
    })
}

fn stop(dice: &mut ChaCha8Rng) -> Option<Stop> {
    dice.next_u32().is_multiple_of(5).then(|| Stop {
        battery_e4: (dice.next_u32() % 10_001) as u16,
        not_before_ds: (dice.next_u32().is_multiple_of(2)).then(|| dice.next_u32() % 100_000),
    })
}
