//! What is written is what is read, and what a drone is told to do.

use crate::drafts::{bare, covered, drawn, hop, key, node};
use skyway_pack::write::{Contingency, DraftWay};
use skyway_pack::{Advice, Pack, State, Stop, Unknown, Way};

fn is_said(contingency: &Contingency, state: State, way: Option<Way<'_>>) {
    let (written, read) = match (contingency, way) {
        (Contingency::Way(written), Some(read)) => (written, read),
        (Contingency::Way(_), None) => return assert_eq!(state, State::LeftOut),
        (Contingency::Without(expected), way) => {
            assert!(way.is_none());
            return assert_eq!(state, *expected);
        }
    };
    assert_eq!(state, State::Given);
    assert_eq!(read.battery_e4(), written.battery_e4);
    assert_eq!(read.rejoins(), written.rejoins);
    assert_eq!(read.is_reserve_used(), written.is_reserve_used);
    assert_eq!(read.begins_with(), written.begins_with);
    let hops: Vec<_> = read.hops().collect();
    assert_eq!(hops.len(), written.hops.len());
    for (read, written) in hops.iter().zip(&written.hops) {
        assert_eq!((read.to, read.stop), (written.to, written.stop));
        assert_eq!(read.dips_half_m, written.dips_half_m);
    }
}

#[test]
fn what_is_written_is_read() {
    for seed in 0..300 {
        let draft = drawn(seed);
        let bytes = draft.write(&key()).expect("a pack");
        let pack = Pack::read(&bytes, &key().public()).expect("readable");
        assert_eq!(pack.plan(), draft.plan);
        assert!(draft.network.starts_with(pack.network()));
        assert_eq!(pack.order(), draft.order);
        assert_eq!(pack.clock(), draft.clock);
        assert_eq!(pack.is_planar(), draft.is_planar);
        assert_eq!(pack.has_first_stretch(), draft.has_first_stretch);
        assert_eq!(usize::from(pack.leg_count()), draft.legs.len());
        for (number, (read, written)) in (0..).zip(pack.legs().zip(&draft.legs)) {
            assert_eq!((read.from, read.to), (written.from, written.to));
            assert_eq!(read.battery_e4, written.battery_e4);
            assert_eq!(read.departs_ds, written.departs_ds);
            assert_eq!(read.lands_before, written.lands_before);
            is_said(&written.detour, read.detour, pack.detour(number));
            is_said(&written.alternate, read.alternate, pack.alternate(number));
        }
        assert_eq!(
            draft.write(&key()),
            Ok(bytes),
            "the same twice, seed {seed}"
        );
    }
}

/// What a drone does at the first node of leg 1 of three.
fn told(change: impl FnOnce(&mut Contingency, &mut Contingency), battery: Option<u16>) -> String {
    let mut draft = covered(3);
    let leg = &mut draft.legs[1];
    change(&mut leg.detour, &mut leg.alternate);
    let bytes = draft.write(&key()).expect("a pack");
    let pack = Pack::read(&bytes, &key().public()).expect("readable");
    match pack.if_closed(1, battery) {
        Advice::Detour(way) => format!("detour to {}", way.to().index),
        Advice::Alternate(way) => format!("alternate {}", way.to().index),
        Advice::Unknown(why) => format!("{why:?}"),
    }
}

fn way(hops: &[u32], rejoins: Option<u16>) -> Contingency {
    Contingency::Way(DraftWay {
        battery_e4: None,
        rejoins,
        is_reserve_used: false,
        begins_with: None,
        hops: hops.iter().map(|to| hop(*to)).collect(),
    })
}

#[test]
fn a_drone_takes_the_detour_else_the_alternate() {
    assert_eq!(told(|_, _| {}, None), "detour to 2");
    assert_eq!(told(|_, _| {}, Some(4_000)), "detour to 2");
    assert_eq!(told(|_, _| {}, Some(3_999)), "alternate 2001");
    assert_eq!(told(|_, _| {}, Some(1_199)), "Battery");
    let void = |detour: &mut Contingency, _: &mut Contingency| {
        *detour = Contingency::Without(State::Void);
    };
    assert_eq!(told(void, None), "alternate 2001");
    let neither = |detour: &mut Contingency, alternate: &mut Contingency| {
        *detour = Contingency::Without(State::Pending);
        *alternate = Contingency::Without(State::Pending);
    };
    assert_eq!(told(neither, None), "Contingency(Pending)");
}

/// The nearest alternate often lies at the end of the leg that has closed.
#[test]
fn no_way_over_the_closed_leg_is_given() {
    let over = |detour: &mut Contingency, alternate: &mut Contingency| {
        *detour = Contingency::Without(State::None);
        *alternate = way(&[2, 3], None);
    };
    assert_eq!(told(over, None), "Contingency(None)");
    let back = |detour: &mut Contingency, alternate: &mut Contingency| {
        *detour = way(&[1_500, 2, 1, 1_501, 2], Some(2));
        *alternate = way(&[], None);
    };
    assert_eq!(told(back, None), "alternate 1");
}

/// Out and back over one segment: the detour meets the plan before it comes back over what has closed.
#[test]
fn no_way_to_a_later_flight_over_the_closed_leg_is_given() {
    let mut draft = bare(2);
    draft.legs[1].to = node(0);
    draft.legs[0].detour = way(&[1_000, 1], Some(1));
    let bytes = draft.write(&key()).expect("a pack");
    let pack = Pack::read(&bytes, &key().public()).expect("readable");
    let unknown = Advice::Unknown(Unknown::Contingency(State::Given));
    assert_eq!(pack.if_closed(0, None), unknown);
    assert_eq!(
        pack.if_closed(2, None),
        Advice::Unknown(Unknown::Leg),
        "there is no third leg"
    );
}

#[test]
fn a_stop_stands_where_it_is_made() {
    let mut draft = bare(2);
    let stop = Stop {
        battery_e4: 8_000,
        not_before_ds: Some(900),
    };
    let mut detour = way(&[1_000, 1], Some(1));
    if let Contingency::Way(way) = &mut detour {
        way.begins_with = Some(stop);
        way.hops[0].stop = Some(stop);
    }
    draft.legs[0].detour = detour;
    let bytes = draft.write(&key()).expect("a pack");
    let pack = Pack::read(&bytes, &key().public()).expect("readable");
    let way = pack.detour(0).expect("a detour");
    assert_eq!(way.begins_with(), Some(stop));
    let stops: Vec<_> = way.hops().map(|hop| hop.stop).collect();
    assert_eq!(stops, [Some(stop), None]);
    assert_eq!((way.from().index, way.to().index), (0, 1));
}

/// It only stops a departure.
#[test]
fn nobody_departs_after_its_end() {
    let bytes = bare(1).write(&key()).expect("a pack");
    let pack = Pack::read(&bytes, &key().public()).expect("readable");
    assert!(pack.may_depart(pack.not_after_ms()));
    assert!(!pack.may_depart(pack.not_after_ms() + 1));
    assert_eq!(pack.not_after_ms() - pack.departs_ms(), 3_600_000);
}
