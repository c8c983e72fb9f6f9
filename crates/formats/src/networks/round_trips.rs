//! Networks drawn by chance, with everything that a network can say, go out in each format and come back the same.

use super::geojson::{read_network, write_network};
use super::graphml::{read_graphml, write_graphml};
use super::load::{fingerprint, load_network};
use super::node_link::write_node_link;
use super::stated::draft_of;
use crate::geo::{Altitude, AltitudeBand, AltitudeReference};
use crate::network::{Coordinates, NetworkDraft, NodeDraft, Role, Seeded, SegmentDraft, Topology};

const NETWORKS: u64 = 300;
/// Words with what one format or the other has to write in a way of its own.
const WORDS: [&str; 12] = [
    "",
    "a",
    "Town Hall",
    "\"q\"",
    "<&>'",
    "tab\tand\nline",
    "\r\n",
    " edge ",
    "07",
    "+7",
    "Ærø 🚁",
    "]]>",
];

/// A network that a seed determines.
pub(crate) fn drawn(seed: u64) -> NetworkDraft {
    let chance = &mut Seeded::new(seed);
    let coordinates = match chance.below(2) {
        0 => Coordinates::Planar,
        _ => Coordinates::Geographic,
    };
    let (kind_of_ids, count) = (chance.below(3), 2 + chance.below(9));
    let nodes: Vec<NodeDraft> = (0..count)
        .map(|index| NodeDraft {
            id: match kind_of_ids {
                0 | 1 => (i64::from(index) * 977 - 500).to_string(),
                _ => format!("{}{index}", word(chance)),
            },
            position: position(chance, coordinates),
            altitude: altitude(chance),
            pads: chance.below(5),
            role: [Role::DeliveryTarget, Role::RechargingStation, Role::Both]
                [usize::from(chance.below(3))],
            name: (chance.below(2) == 0).then(|| word(chance)),
        })
        .collect();
    let mut segments = Vec::new();
    for (place, from) in nodes.iter().enumerate() {
        for to in &nodes[place + 1..] {
            if chance.below(3) == 0 {
                segments.push(segment(chance, from, to, segments.len()));
            }
        }
    }
    NetworkDraft {
        name: word(chance),
        attribution: word(chance),
        coordinates,
        integer_ids: kind_of_ids == 0,
        nodes,
        segments,
        ..NetworkDraft::default()
    }
}

fn word(chance: &mut Seeded) -> String {
    let word = WORDS[usize::from(chance.below(WORDS.len() as u16))];
    word.to_owned()
}

fn position(chance: &mut Seeded, coordinates: Coordinates) -> [f64; 2] {
    match coordinates {
        Coordinates::Planar => [chance.between(-2e3, 2e3), chance.between(-2e3, 2e3)],
        // As many decimals as a file has.
        Coordinates::Geographic => [chance.between(9.0, 9.1), chance.between(-55.1, -55.0)]
            .map(|degrees| (degrees * 1e7).round() / 1e7),
    }
}

fn altitude(chance: &mut Seeded) -> Option<Altitude> {
    let references = [
        AltitudeReference::Agl,
        AltitudeReference::Amsl,
        AltitudeReference::Wgs84,
    ];
    let reference = *references.get(usize::from(chance.below(4)))?;
    let value_m = chance.between(-10.0, 120.0);
    Some(Altitude { value_m, reference })
}

fn segment(chance: &mut Seeded, from: &NodeDraft, to: &NodeDraft, number: usize) -> SegmentDraft {
    let (lower, upper) = (altitude(chance), altitude(chance));
    let is_turned = lower.zip(upper).is_some_and(|(lower, upper)| {
        lower.reference == upper.reference && lower.value_m > upper.value_m
    });
    let (lower, upper) = match is_turned {
        true => (upper, lower),
        false => (lower, upper),
    };
    SegmentDraft {
        id: (chance.below(2) == 0).then(|| format!("{}s{number}", word(chance))),
        from: from.id.clone(),
        to: to.id.clone(),
        length_m: (chance.below(4) > 0).then(|| chance.between(1e-3, 9e3)),
        band: AltitudeBand { lower, upper },
        speed_limit_mps: (chance.below(2) == 0).then(|| chance.between(1.0, 30.0)),
    }
}

#[test]
fn the_native_format_keeps_everything() {
    for seed in 0..NETWORKS {
        let network = drawn(seed);
        assert_eq!(
            read_network(&write_network(&network)),
            Ok(network),
            "seed {seed}"
        );
    }
}

#[test]
fn graphml_keeps_everything() {
    for seed in 0..NETWORKS {
        let network = drawn(seed);
        let written = write_graphml(&network).expect("ids that XML can hold");
        assert_eq!(written.losses, Vec::<String>::new(), "seed {seed}");
        let read = read_graphml(&written.text);
        let read =
            read.unwrap_or_else(|errors| panic!("seed {seed}: {errors:?}\n{}", written.text));
        assert_eq!(read.draft, network, "seed {seed}\n{}", written.text);
        assert_eq!(read.unread.lines(), Vec::<String>::new(), "seed {seed}");
    }
}

#[test]
fn node_link_keeps_everything() {
    for seed in 0..NETWORKS {
        let network = drawn(seed);
        let topology = Topology::build(network, fingerprint(&[])).expect("a network");
        let written = write_node_link(&topology);
        let again = load_network(&written);
        let again = again.unwrap_or_else(|error| panic!("seed {seed}: {:?}", error.lines()));
        assert_eq!(again.unread.lines(), Vec::<String>::new(), "seed {seed}");
        let [stated, stated_again] =
            [&topology, &again.topology].map(|topology| write_network(&draft_of(topology)));
        assert_eq!(stated_again, stated, "seed {seed}\n{written}");
    }
}
