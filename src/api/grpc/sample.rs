//! Random shapes of the wire, seeded: for the tests that they survive the way through messages.

use crate::wire;
use jiff::Timestamp;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde_json::{Value, json};
use std::borrow::Cow;

/// Draws values.
pub(super) struct Sampler {
    random: ChaCha8Rng,
}

/// A random value of a type.
pub(super) trait Sample {
    fn sample(sampler: &mut Sampler) -> Self;
}

impl Sampler {
    pub(super) fn new(seed: u64) -> Self {
        Self {
            random: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    pub(super) fn below(&mut self, bound: u64) -> u64 {
        self.random.next_u64() % bound
    }

    pub(super) fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len() as u64) as usize]
    }

    fn coin(&mut self) -> bool {
        self.below(2) == 0
    }

    fn number(&mut self) -> f64 {
        match self.below(4) {
            0 => self.one_of(&[0.0, -0.0, f64::MAX, f64::MIN_POSITIVE, 0.1 + 0.2]),
            _ => (self.below(2_000_000_001) as f64 - 1e9) / 7.0,
        }
    }

    fn text(&mut self) -> String {
        let words = ["", "a", "leg 7", "Süd—Bahnhof", "12", "\"\\\n", "\u{1F681}"];
        format!("{}{}", self.one_of(&words), self.one_of(&words))
    }

    /// An instant between the years 1600 and 2300, to the nanosecond.
    pub(super) fn time(&mut self) -> String {
        let second = self.below(22_000_000_000) as i64 - 11_000_000_000;
        let nanos = [0, 1, 500_000_000, 999_999_999];
        let nanosecond = self.one_of(&nanos);
        let instant = Timestamp::new(second, nanosecond).expect("in the range of instants");
        instant.to_string()
    }

    pub(super) fn json(&mut self) -> Value {
        json!({"type": self.text(), "coordinates": [[self.number(), 1.5], null, true, i64::MAX]})
    }

    fn position(&mut self) -> Value {
        json!([self.number(), self.number()])
    }

    fn rings(&mut self) -> Value {
        let mut ring = |length: u64| (0..length).map(|_| self.position()).collect::<Vec<_>>();
        json!([ring(4), ring(5)])
    }

    /// A zone's feature in the form that the edge writes.
    pub(super) fn zone(&mut self) -> Value {
        let geometry = match self.below(3) {
            0 => json!({"type": "Polygon", "coordinates": self.rings()}),
            1 => json!({"type": "MultiPolygon", "coordinates": [self.rings(), self.rings()]}),
            _ => json!({"type": "Point", "coordinates": self.position()}),
        };
        let mut properties = serde_json::Map::new();
        for name in ["name", "reason", "authority"] {
            if self.coin() {
                properties.insert(name.to_owned(), Value::from(self.text()));
            }
        }
        for end in ["lower", "upper"] {
            if self.coin() {
                let reference = self.one_of(&["agl", "amsl", "wgs84"]);
                properties.insert(format!("{end}_m"), Value::from(self.number()));
                properties.insert(format!("{end}_reference"), Value::from(reference));
            }
        }
        if self.coin() {
            let both = json!({"from": self.time(), "until": self.time()});
            let open = json!({"until": self.time()});
            properties.insert("windows".to_owned(), json!([both, open, {}]));
        }
        if geometry["type"] == "Point" {
            properties.insert("radius_m".to_owned(), Value::from(self.number()));
        }
        properties.insert("margin_m".to_owned(), Value::from(self.number()));
        let id = format!("zone-{}", self.below(100));
        json!({"type": "Feature", "id": id, "geometry": geometry, "properties": properties})
    }
}

macro_rules! sample_numbers {
    ($($type:ty),*) => {$(
        impl Sample for $type {
            fn sample(sampler: &mut Sampler) -> Self {
                let number = sampler.below(1 << 20) as $type;
                sampler.one_of(&[0, 1, <$type>::MAX, number])
            }
        }
    )*};
}

sample_numbers!(u16, u32, u64, usize);

impl Sample for bool {
    fn sample(sampler: &mut Sampler) -> Self {
        sampler.coin()
    }
}

impl Sample for f64 {
    fn sample(sampler: &mut Sampler) -> Self {
        sampler.number()
    }
}

impl Sample for String {
    fn sample(sampler: &mut Sampler) -> Self {
        sampler.text()
    }
}

impl Sample for Cow<'_, str> {
    fn sample(sampler: &mut Sampler) -> Self {
        Cow::Owned(sampler.text())
    }
}

impl<T: Sample> Sample for Box<T> {
    fn sample(sampler: &mut Sampler) -> Self {
        Self::new(T::sample(sampler))
    }
}

impl Sample for wire::RegistryRevision {
    fn sample(sampler: &mut Sampler) -> Self {
        Self {
            epoch: Sample::sample(sampler),
            revision: Sample::sample(sampler),
        }
    }
}

impl Sample for wire::Id<'_> {
    fn sample(sampler: &mut Sampler) -> Self {
        let odd = sampler.one_of(&["007", "+7", "-", "-0", "", "9223372036854775808", "n7"]);
        let number = sampler.one_of(&[0, -7, i64::MIN, i64::MAX, 12_345]);
        match sampler.below(4) {
            0 => Self::new(odd),
            _ => Self::from(number),
        }
    }
}

impl<T: Sample> Sample for Option<T> {
    fn sample(sampler: &mut Sampler) -> Self {
        sampler.coin().then(|| T::sample(sampler))
    }
}

impl<T: Sample> Sample for Vec<T> {
    fn sample(sampler: &mut Sampler) -> Self {
        let length = sampler.below(3);
        (0..length).map(|_| T::sample(sampler)).collect()
    }
}

impl<T: Sample> Sample for [T; 2] {
    fn sample(sampler: &mut Sampler) -> Self {
        [T::sample(sampler), T::sample(sampler)]
    }
}

impl Sample for wire::Place {
    fn sample(sampler: &mut Sampler) -> Self {
        let [x, y] = Sample::sample(sampler);
        match sampler.below(3) {
            0 => Self::Pair([x, y]),
            1 => Self::Planar { x, y },
            _ => Self::Node(Sample::sample(sampler)),
        }
    }
}

impl Sample for wire::Severance<'_> {
    fn sample(sampler: &mut Sampler) -> Self {
        match sampler.below(3) {
            0 => Self::Report,
            1 => Self::Network,
            _ => Self::Closure {
                id: Sample::sample(sampler),
            },
        }
    }
}

impl Sample for wire::Problem {
    fn sample(sampler: &mut Sampler) -> Self {
        Self {
            kind: Sample::sample(sampler),
            title: Sample::sample(sampler),
            status: Sample::sample(sampler),
            code: Sample::sample(sampler),
            detail: Sample::sample(sampler),
            errors: Sample::sample(sampler),
            request_id: Sample::sample(sampler),
            retry_after_s: Sample::sample(sampler),
            current_etag: Sample::sample(sampler),
            oldest_revision: None,
            enforced: None,
            durable: None,
        }
    }
}

impl Sample for wire::BatchEntry<'_> {
    fn sample(sampler: &mut Sampler) -> Self {
        match sampler.coin() {
            true => Self::Recomposition(Box::new(Sample::sample(sampler))),
            false => Self::Problem(Box::new(Sample::sample(sampler))),
        }
    }
}

impl Sample for wire::FailureReport {
    fn sample(sampler: &mut Sampler) -> Self {
        let path: Vec<wire::Id<'static>> = Sample::sample(sampler);
        Self {
            id: Sample::sample(sampler),
            failure: Sample::sample(sampler),
            detail: Sample::sample(sampler),
            node: Sample::sample(sampler),
            pads: Sample::sample(sampler),
            wind_mps: Sample::sample(sampler),
            gust_mps: Sample::sample(sampler),
            visibility_m: Sample::sample(sampler),
            airborne: Sample::sample(sampler),
            location_age_s: Sample::sample(sampler),
            leg: Sample::sample(sampler),
            fraction: Sample::sample(sampler),
            altitude_m: Sample::sample(sampler),
            altitude_reference: Sample::sample(sampler),
            service: Sample::sample(sampler),
            location: Sample::sample(sampler),
            location_unknown: Sample::sample(sampler),
            cause_location: Sample::sample(sampler),
            timestamp: sampler.coin().then(|| sampler.time()),
            zone: sampler.coin().then(|| sampler.zone()),
            drone: Sample::sample(sampler),
            // A list without entries is absent in a message, and says as much.
            remaining_path: (!path.is_empty()).then_some(path),
            destination: Sample::sample(sampler),
            strategy: Sample::sample(sampler),
            scope: Sample::sample(sampler),
            parameters: Sample::sample(sampler),
            objective: Sample::sample(sampler),
            optimum: Sample::sample(sampler),
            deadline: sampler.coin().then(|| sampler.time()),
            explain: Sample::sample(sampler),
            dry_run: Sample::sample(sampler),
            close: None,
        }
    }
}

/// A field of a shape, by its kind; see `mirror`.
macro_rules! sample_field {
    (plain, $sampler:expr) => {
        $crate::api::grpc::sample::Sample::sample($sampler)
    };
    (message, $sampler:expr) => {
        $crate::api::grpc::sample::Sample::sample($sampler)
    };
    (time, $sampler:expr) => {
        $sampler.time().into()
    };
    (maybe_time, $sampler:expr) => {
        <Option<bool> as $crate::api::grpc::sample::Sample>::sample($sampler)
            .map(|_| $sampler.time().into())
    };
    (json, $sampler:expr) => {
        $sampler.json()
    };
}

pub(super) use sample_field;
