//! What happens in the demo and when, as far as a seed determines it: deliveries, failures, zones.

use super::map::Map;
use crate::wire::FailureType;
use jiff::SignedDuration;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// 2 to the power -53: the step of doubles below 1 that have all the bits drawn.
const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
/// The share of deliveries on which something fails.
const FAILING_SHARE: f64 = 0.3;
/// How often which failure, out of the sum of these.
const FAILURES: [(FailureType, f64); 6] = [
    (FailureType::Navigational, 40.0),
    (FailureType::Environmental, 25.0),
    (FailureType::Regulatory, 10.0),
    (FailureType::Infrastructure, 10.0),
    (FailureType::Operational, 10.0),
    (FailureType::ServiceLevel, 5.0),
];
/// Nodes drawn, of which the farthest becomes the destination, so that flights cross the network.
const DESTINATIONS_DRAWN: usize = 3;
/// From how many nodes deliveries go out.
const DEPOTS: usize = 3;
/// Each kind of drone has tables of its own at the edge, so that there are few.
const PAYLOADS_KG: [f64; 3] = [0.0, 0.5, 1.0];
/// Random numbers beside those of the pilots, which count from 1, and of the operator, which has 0.
const DEPOTS_PART: u64 = u64::MAX;
const WIND_PART: u64 = u64::MAX - 1;
const FLEET_PART: u64 = u64::MAX - 2;
const SHOP_PART: u64 = u64::MAX - 3;
/// Places drawn for a zone; the operator takes the one that meets most plans.
const PLACES_DRAWN: usize = 4;
const ZONE_REASONS: [&str; 5] = [
    "crane at work",
    "police operation",
    "medical helicopter",
    "crowd on the street",
    "fire on a roof",
];

/// What a seed determines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Script {
    seed: u64,
}

impl Script {
    /// The script of a seed.
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// The part of a pilot; each has random numbers of its own, so that none disturbs another.
    pub(super) fn pilot(self, number: u32) -> PilotScript {
        PilotScript {
            chance: Chance::new(self.seed, u64::from(number)),
            depots: Chance::new(self.seed, DEPOTS_PART),
        }
    }

    /// Where the drones of a provider are based: at different nodes, as far as there are enough.
    pub(super) fn homes(self, map: &Map, count: usize) -> Vec<usize> {
        let mut chance = Chance::new(self.seed, FLEET_PART);
        let mut left = map.bases();
        let mut homes = Vec::new();
        while homes.len() < count {
            if left.is_empty() {
                left = map.stations().to_vec();
            }
            let Some(home) = chance.one_of(&left) else {
                break;
            };
            left.retain(|node| *node != home);
            homes.push(home);
        }
        homes
    }

    pub(super) fn shop(self) -> ShopScript {
        ShopScript {
            chance: Chance::new(self.seed, SHOP_PART),
        }
    }

    pub(super) fn operator(self) -> OperatorScript {
        OperatorScript {
            chance: Chance::new(self.seed, 0),
            wind: Chance::new(self.seed, WIND_PART),
        }
    }
}

/// Random numbers that a seed and a part determine.
#[derive(Clone, Debug)]
struct Chance(ChaCha8Rng);

impl Chance {
    fn new(seed: u64, part: u64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&part.to_le_bytes());
        Self(ChaCha8Rng::from_seed(key))
    }

    fn between(&mut self, lower: f64, upper: f64) -> f64 {
        let unit = (self.0.next_u64() >> 11) as f64 * STEP;
        lower + (upper - lower) * unit
    }

    fn seconds(&mut self, lower: f64, upper: f64) -> SignedDuration {
        SignedDuration::from_millis((self.between(lower, upper) * 1e3) as i64)
    }

    /// One of some; of none, none.
    fn one_of<T: Copy>(&mut self, all: &[T]) -> Option<T> {
        let place = self.between(0.0, all.len() as f64) as usize;
        all.get(place).copied()
    }
}

/// A delivery to be asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Delivery {
    /// The node it goes to, by the map.
    pub(super) destination: usize,
    pub(super) payload_kg: f64,
    /// What goes wrong on the way, if anything does.
    pub(super) failure: Option<PlannedFailure>,
}

/// Something that goes wrong on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlannedFailure {
    pub(super) failure: FailureType,
    /// When that share of the path is flown.
    pub(super) after_fraction: f64,
}

/// What happens to one drone.
#[derive(Debug)]
pub(super) struct PilotScript {
    chance: Chance,
    /// What all pilots draw the same depots from.
    depots: Chance,
}

impl PilotScript {
    /// Where the drone is at the beginning.
    pub(super) fn home(&mut self, map: &Map) -> usize {
        self.chance.one_of(map.stations()).unwrap_or_default()
    }

    /// How long it is before the first delivery, in simulated time: so that not all start at once.
    pub(super) fn first_wait(&mut self) -> SignedDuration {
        self.chance.seconds(0.0, 60.0)
    }

    /// How long a landed drone stays.
    pub(super) fn turnaround(&mut self) -> SignedDuration {
        self.chance.seconds(15.0, 60.0)
    }

    /// The next delivery from a node.
    pub(super) fn delivery(&mut self, map: &Map, from: usize) -> Delivery {
        let mut depots = self.depots.clone();
        let drawn = (0..DEPOTS).filter_map(|_| depots.one_of(map.stations()));
        let depots: Vec<usize> = drawn.collect();
        // Out to a customer and back to a depot, where pads fill up.
        let ends = match depots.iter().all(|depot| *depot == from) || depots.contains(&from) {
            true => map.stations(),
            false => &depots,
        };
        let others: Vec<usize> = ends.iter().copied().filter(|&node| node != from).collect();
        let mut destination = from;
        for _ in 0..DESTINATIONS_DRAWN {
            let drawn = self.chance.one_of(&others).unwrap_or(from);
            let distance_m = |node: usize| map.position(from).distance_m(map.position(node));
            if distance_m(drawn) > distance_m(destination) {
                destination = drawn;
            }
        }
        let fails = self.chance.between(0.0, 1.0) < FAILING_SHARE;
        let failure = PlannedFailure {
            failure: self.failure(),
            after_fraction: self.chance.between(0.1, 0.6),
        };
        Delivery {
            destination,
            payload_kg: self.chance.one_of(&PAYLOADS_KG).unwrap_or_default(),
            failure: fails.then_some(failure),
        }
    }

    fn failure(&mut self) -> FailureType {
        let all: f64 = FAILURES.iter().map(|(_, weight)| weight).sum();
        let mut drawn = self.chance.between(0.0, all);
        for (failure, weight) in FAILURES {
            if drawn < weight {
                return failure;
            }
            drawn -= weight;
        }
        FailureType::Navigational
    }
}

/// Something that a shop orders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlannedOrder {
    /// How long after the one before, in simulated time.
    pub(super) wait: SignedDuration,
    /// The nodes of the pickup and the drop, by the map.
    pub(super) ends: [usize; 2],
    pub(super) payload_kg: f64,
}

/// What a shop orders.
#[derive(Debug)]
pub(super) struct ShopScript {
    chance: Chance,
}

impl ShopScript {
    pub(super) fn order(&mut self, map: &Map) -> PlannedOrder {
        let chance = &mut self.chance;
        let wait = chance.seconds(150.0, 300.0);
        let source = chance.one_of(map.stations()).unwrap_or_default();
        let stations = map.stations().iter().copied();
        let others: Vec<usize> = stations.filter(|node| *node != source).collect();
        PlannedOrder {
            wait,
            ends: [source, chance.one_of(&others).unwrap_or(source)],
            payload_kg: chance.one_of(&PAYLOADS_KG).unwrap_or_default(),
        }
    }
}

/// A zone to be put.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlannedZone {
    /// How long after the one before, in simulated time.
    pub(super) wait: SignedDuration,
    /// Nodes that it may be put around, by the map.
    pub(super) places: Vec<usize>,
    pub(super) radius_m: f64,
    pub(super) life: SignedDuration,
    pub(super) reason: &'static str,
}

/// What the operator does.
#[derive(Debug)]
pub(super) struct OperatorScript {
    chance: Chance,
    wind: Chance,
}

impl OperatorScript {
    /// The next wind, from the south-west: its speed in metres per second, and from where it comes in degrees. The airframe
    /// flies in up to 7.1 m/s.
    pub(super) fn wind(&mut self) -> (f64, f64) {
        let speed_mps = self.wind.between(2.0, 6.0);
        (speed_mps, self.wind.between(190.0, 260.0).round())
    }

    pub(super) fn zone(&mut self, map: &Map) -> PlannedZone {
        let chance = &mut self.chance;
        let wait = chance.seconds(60.0, 150.0);
        let drawn = (0..PLACES_DRAWN).filter_map(|_| chance.one_of(map.stations()));
        PlannedZone {
            wait,
            places: drawn.collect(),
            radius_m: chance.between(60.0, 140.0).round(),
            life: SignedDuration::from_mins(chance.between(2.0, 6.0) as i64),
            reason: chance.one_of(&ZONE_REASONS).unwrap_or("test"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::map::tests::network;

    fn story(seed: u64, number: u32) -> Vec<(Delivery, SignedDuration)> {
        let map = Map::of(&network()).expect("a map");
        let mut pilot = Script::new(seed).pilot(number);
        let mut at = pilot.home(&map);
        let mut story = Vec::new();
        for _ in 0..400 {
            let delivery = pilot.delivery(&map, at);
            at = delivery.destination;
            story.push((delivery, pilot.turnaround()));
        }
        story
    }

    #[test]
    fn a_seed_tells_the_same_story_and_another_one_another() {
        assert_eq!(story(7, 1), story(7, 1));
        assert_ne!(story(7, 1), story(7, 2));
        assert_ne!(story(7, 1), story(8, 1));
        let map = Map::of(&network()).expect("a map");
        let zone = |seed| Script::new(seed).operator().zone(&map);
        assert_eq!(zone(7), zone(7));
        assert_ne!(zone(7), zone(8));
    }

    #[test]
    fn every_delivery_leads_elsewhere_and_some_fail_in_every_way() {
        let map = Map::of(&network()).expect("a map");
        let mut from = Script::new(3).pilot(5).home(&map);
        let mut failures = Vec::new();
        let story = story(3, 5);
        for (delivery, turnaround) in &story {
            assert_ne!(delivery.destination, from);
            assert!(map.stations().contains(&delivery.destination));
            assert!(PAYLOADS_KG.contains(&delivery.payload_kg));
            assert!(*turnaround >= SignedDuration::from_secs(15));
            from = delivery.destination;
            if let Some(planned) = delivery.failure {
                assert!((0.1..0.6).contains(&planned.after_fraction));
                failures.push(planned.failure);
            }
        }
        assert!(
            (story.len() / 5..story.len() / 2).contains(&failures.len()),
            "{}",
            failures.len()
        );
        for (failure, _) in FAILURES {
            assert!(failures.contains(&failure), "{failure:?}");
        }
    }

    #[test]
    fn a_shop_orders_between_different_nodes_and_homes_are_bases_first() {
        let map = Map::of(&network()).expect("a map");
        let mut shop = Script::new(4).shop();
        for _ in 0..100 {
            let order = shop.order(&map);
            assert_ne!(order.ends[0], order.ends[1]);
            assert!(order.wait >= SignedDuration::from_secs(150));
        }
        let homes = Script::new(4).homes(&map, 3);
        assert_eq!((homes.len(), homes[0]), (3, 2));
        assert_eq!(homes, Script::new(4).homes(&map, 3));
    }

    #[test]
    fn zones_are_small_and_end() {
        let map = Map::of(&network()).expect("a map");
        let mut operator = Script::new(11).operator();
        for _ in 0..100 {
            let zone = operator.zone(&map);
            assert_eq!(zone.places.len(), PLACES_DRAWN);
            assert!((60.0..=140.0).contains(&zone.radius_m));
            assert!(
                zone.life >= SignedDuration::from_mins(2)
                    && zone.life <= SignedDuration::from_mins(6)
            );
            assert!(zone.wait >= SignedDuration::from_secs(60));
            let (speed_mps, from_deg) = operator.wind();
            assert!((2.0..=6.0).contains(&speed_mps) && (190.0..=260.0).contains(&from_deg));
        }
    }
}
