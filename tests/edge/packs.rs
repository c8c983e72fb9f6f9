//! Packs of plans: what they say of legs that are covered, pending, void or beyond them, and whose they are.

use crate::flying::{corridor, on, settings, street};
use crate::memory_disk::MemoryDisk;
use crate::stage::{Stage, circle, names};
use serde_json::json;
use skyway::config::PackKeys;
use skyway::edge::{Caller, Code, Role, WriterStep};
use skyway::pack::write::SigningKey;
use skyway::pack::{Advice, Pack, State, Unknown, bytes_max};
use skyway::wire;
use std::sync::{Arc, Mutex};

impl Stage {
    fn pack(&self, plan: &str) -> Vec<u8> {
        let pack = self.edge.pack(&self.caller, plan, None).expect("a pack");
        pack.0.to_vec()
    }

    fn etag(&self, plan: &str) -> String {
        self.edge.pack(&self.caller, plan, None).expect("a pack").1
    }

    fn public(&self) -> [u8; 32] {
        use base64::Engine;
        let keys = self.edge.list_pack_keys();
        let last = keys.keys.last().expect("a key");
        let public = base64::engine::general_purpose::STANDARD.decode(&*last.public_key);
        public.expect("base64").try_into().expect("32 bytes")
    }
}

fn states(bytes: &[u8]) -> Vec<(State, State)> {
    let pack = Pack::read_unverified(bytes).expect("a pack");
    let states = pack.legs().map(|leg| (leg.detour, leg.alternate));
    states.collect()
}

/// The ids of the nodes of a way, by the network in index form.
fn ids(stage: &Stage, indices: impl Iterator<Item = u32>) -> Vec<String> {
    let (text, _) = stage.edge.network_compact().expect("a network");
    let network: wire::CompactNetwork<'_> = serde_json::from_slice(&text).expect("JSON");
    let named: Vec<_> = indices
        .map(|index| network.ids[index as usize].clone())
        .collect();
    names(&named)
}

#[tokio::test]
async fn a_pack_says_what_the_plan_says() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a3").await;
    stage.settle().await;
    let bytes = stage.pack("p1");
    let pack = Pack::read(&bytes, &stage.public()).expect("signed by this edge");
    let plan = stage.plan("p1");
    assert_eq!(pack.plan(), "p1");
    assert_eq!(pack.order(), (0, plan.reported.epoch, 1));
    let sha256: String = pack
        .network_sha256()
        .iter()
        .map(|it| format!("{it:02x}"))
        .collect();
    assert_eq!(sha256, plan.stamp.network.sha256);
    let arrives: jiff::Timestamp = plan.reported.arrives_at.parse().expect("an instant");
    assert_eq!(pack.not_after_ms(), arrives.as_millisecond() + 600_000);
    // By distance it has neither times nor batteries.
    assert!(!pack.is_timed());
    assert!(
        pack.legs()
            .all(|leg| leg.departs_ds.is_none() && leg.battery_e4.is_none())
    );
    for (number, told) in (0..).zip(&plan.reported.legs) {
        let leg = pack.leg(number).expect("a leg");
        let ends = ids(&stage, [leg.from.index, leg.to.index].into_iter());
        assert_eq!(ends, names(&[told.from.clone(), told.to.clone()]));
        let detour = pack.detour(number).expect("a detour");
        let nodes = ids(&stage, detour.hops().map(|hop| hop.to.index));
        let expected = told.if_closed.as_ref().expect("a detour");
        assert_eq!(nodes, names(&expected.nodes[1..]));
        let rejoins = detour
            .rejoins()
            .map(|leg| plan.reported.path.nodes[usize::from(leg)].clone());
        let is_end = expected.rejoins == plan.reported.path.nodes.last().cloned();
        assert!(rejoins == expected.rejoins || (is_end && rejoins.is_none()));
    }
    assert_eq!(
        stage
            .edge
            .pack(&stage.caller, "p1", Some(1))
            .expect("a pack")
            .0,
        bytes
    );
}

/// A flown plan over the corridor charges on its way, and its detours do.
#[tokio::test]
async fn a_flown_pack_says_with_which_battery() {
    let stage = corridor();
    let asked = json!({"id": "p1", "drone_id": "d1", "source": "1", "destination": "128"});
    let plan = stage.deliver(asked).await.expect("a plan");
    let bytes = stage.pack("p1");
    let pack = Pack::read(&bytes, &stage.public()).expect("signed by this edge");
    assert!(pack.is_timed());
    assert!(bytes.len() <= bytes_max(usize::from(pack.leg_count())));
    let flight = plan.reported.flight.as_ref().expect("a flight");
    let stops = &flight.stops;
    let (mut covered, mut charging) = (0, 0);
    for (number, told) in (0_u16..).zip(&plan.reported.legs) {
        let leg = pack.leg(number).expect("a leg");
        let has = told
            .flight
            .as_ref()
            .expect("a flight")
            .battery_before_fraction;
        let needs = f64::from(leg.battery_e4.expect("a battery")) / 1e4;
        let stop = stops
            .iter()
            .find(|stop| stop.before_leg == u32::from(number));
        // Before it flies on it charges, and climbs.
        let charged = stop
            .filter(|_| number > 0)
            .map(|stop| stop.battery_after_fraction);
        let limit = charged.unwrap_or(has);
        assert!(
            needs <= limit + 1e-4,
            "leg {number} needs {needs} of {limit}"
        );
        assert_eq!(leg.lands_before, charged.is_some(), "leg {number}");
        // As planned the drone has what each way takes.
        let battery = (has * 1e4).ceil() as u16;
        for way in [pack.detour(number), pack.alternate(number)]
            .into_iter()
            .flatten()
        {
            let needs = way.battery_e4().expect("a battery");
            assert!(needs <= battery, "leg {number}: {needs} of {battery}");
            charging += way.hops().filter(|hop| hop.stop.is_some()).count();
        }
        covered += usize::from(!matches!(
            pack.if_closed(number, Some(battery)),
            Advice::Unknown(_)
        ));
    }
    assert!(
        covered * 10 >= plan.reported.legs.len() * 9,
        "{covered} covered"
    );
    assert!(charging > 0, "no detour charges");
}

/// What is being worked out is not given out.
#[tokio::test]
async fn pending_contingencies_are_not_given_out() {
    let seen: Arc<Mutex<Vec<Vec<u8>>>> = Arc::default();
    let taken = seen.clone();
    let stage = Stage::watched(settings(), false, move |edge, step| {
        let pack = edge.pack(&Caller::anyone(), "p1", None);
        if let (WriterStep::Enforced, Ok((bytes, _))) = (step, pack) {
            taken.lock().expect("whole").push(bytes.to_vec());
        }
    });
    let asked = json!({"id": "p1", "drone_id": "d1", "source": "a0", "destination": "a3"});
    stage.deliver(asked).await.expect("a plan");
    let first = seen
        .lock()
        .expect("whole")
        .first()
        .cloned()
        .expect("a pack");
    assert_eq!(states(&first), [(State::Pending, State::Pending); 3]);
    let pack = Pack::read(&first, &stage.public()).expect("signed by this edge");
    let unknown = Advice::Unknown(Unknown::Contingency(State::Pending));
    assert_eq!(pack.if_closed(1, None), unknown);
    // Once they are there, the pack is another one.
    assert_ne!(stage.pack("p1"), first);
}

/// A zone beside the plan, over its detours: they are void at once, and the entity tag is another one.
#[tokio::test]
async fn void_contingencies_are_not_given_out() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a3").await;
    stage.settle().await;
    let before = stage.etag("p1");
    assert_eq!(
        stage.etag("p1"),
        before,
        "the same as long as nothing changes"
    );
    stage.zone(circle("beside", 150.0, 100.0, 10.0)).await;
    let states = states(&stage.pack("p1"));
    let detours: Vec<State> = states.iter().map(|(detour, _)| *detour).collect();
    assert_eq!(detours[1..], [State::Void, State::Given]);
    assert_ne!(stage.etag("p1"), before);
    assert!(!stage.plan("p1").flags.contains(&wire::PlanFlag::Affected));
}

/// One that begins while the detour is flown counts; one that begins long after does not.
#[tokio::test]
async fn announced_zones_void_what_they_meet_in_time() {
    for (from, state) in [
        ("2026-11-21T06:10:30Z", State::Void),
        ("2026-11-21T09:00:00Z", State::Given),
    ] {
        let stage = Stage::with(settings());
        let asked = json!({"id": "p1", "drone_id": "d1", "source": "a0", "destination": "a3"});
        stage.deliver(asked).await.expect("a plan");
        assert_eq!(states(&stage.pack("p1"))[1].0, State::Given);
        let mut zone = circle("later", 150.0, 100.0, 10.0);
        zone["properties"]["windows"] = json!([{"from": from}]);
        stage.zone(zone).await;
        let now = states(&stage.pack("p1"))[1].0;
        assert_eq!(now, state, "from {from}");
    }
}

#[tokio::test]
async fn a_pack_is_of_a_version_that_may_be_flown() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a3").await;
    stage.zone(circle("ahead", 250.0, 0.0, 10.0)).await;
    stage.settle().await;
    let version = |number| {
        let pack = stage.edge.pack(&stage.caller, "p1", number)?;
        let pack = Pack::read_unverified(&pack.0).expect("a pack").order().2;
        Ok::<u32, skyway::edge::Refusal>(pack)
    };
    assert_eq!(version(None).ok(), Some(1), "what its drone says it flies");
    assert_eq!(version(Some(2)).ok(), Some(2));
    let refused = version(Some(3)).expect_err("there is none");
    assert_eq!(refused.code, Code::PlanStateConflict);
}

#[tokio::test]
async fn plans_of_others_have_no_pack() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a3").await;
    let of = |subject: &str| Caller::local(Role::Drone, subject);
    assert!(stage.edge.pack(&of("d1"), "p1", None).is_ok());
    let refused = stage
        .edge
        .pack(&of("d2"), "p1", None)
        .expect_err("another's");
    assert_eq!(refused.code, Code::NotFound);
    let refused = stage.edge.pack(&of("d1"), "p2", None).expect_err("none");
    assert_eq!(refused.code, Code::NotFound);
}

/// A street has no way around: only the node itself, or the one behind it.
#[tokio::test]
async fn what_is_not_covered_is_said() {
    let stage = on(&street(&[2, 0, 2]));
    let asked = json!({"id": "p1", "drone_id": "d1", "source": "s0", "destination": "s2"});
    stage.deliver(asked).await.expect("a plan");
    let bytes = stage.pack("p1");
    let pack = Pack::read(&bytes, &stage.public()).expect("signed by this edge");
    let (Advice::Detour(way) | Advice::Alternate(way)) = pack.if_closed(0, None) else {
        panic!("it is over a pad");
    };
    assert_eq!(
        (way.hop_count(), way.rejoins()),
        (0, None),
        "it lands again"
    );
    let leg = pack.leg(1).expect("a leg");
    assert_ne!(leg.detour, State::Pending);
}

/// Old packs are known by the keys that signed them; new ones are signed by the new key.
#[tokio::test]
async fn keys_are_rotated() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a3").await;
    let dawn = stage.edge.clock().now();
    let keys = PackKeys::of_seed([1; 32], dawn);
    stage.edge.use_pack_keys(keys.clone());
    let before = stage.pack("p1");
    let first = SigningKey::of_seed(&[1; 32]).public();
    assert!(Pack::read(&before, &first).is_ok());
    stage.edge.use_pack_keys(keys.rotated([2; 32], dawn));
    let after = stage.pack("p1");
    assert!(Pack::read(&after, &stage.public()).is_ok());
    assert!(Pack::read(&after, &first).is_err());
    let listed = stage.edge.list_pack_keys().keys;
    let states: Vec<_> = listed.iter().map(|key| key.state).collect();
    assert_eq!(
        states,
        [wire::PackKeyState::Retired, wire::PackKeyState::Active]
    );
}

/// After a restart a pack says the same of its legs.
#[tokio::test]
async fn a_restart_changes_no_contingency() {
    let disk = MemoryDisk::default();
    let stage = Stage::over_with(disk.open(), settings()).await;
    let asked = json!({"id": "p1", "drone_id": "d1", "source": "a0", "destination": "a7"});
    stage.deliver(asked).await.expect("a plan");
    let told = |stage: &Stage| {
        let bytes = stage.pack("p1");
        let pack = Pack::read_unverified(&bytes).expect("a pack");
        let ways: Vec<_> = (0..pack.leg_count())
            .flat_map(|leg| [pack.detour(leg), pack.alternate(leg)])
            .map(|way| {
                way.map(|way| {
                    (
                        way.battery_e4(),
                        way.rejoins(),
                        way.hops().collect::<Vec<_>>(),
                    )
                })
            })
            .collect();
        (ways, pack.legs().collect::<Vec<_>>())
    };
    let before = told(&stage);
    stage.edge.end().await;
    let stage = stage.again(disk.open()).await;
    assert_eq!(told(&stage), before);
}
