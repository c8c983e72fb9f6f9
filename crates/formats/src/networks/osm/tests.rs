//! Extracts written by an encoder of their own, byte by byte, so that it shares no mistake with the reader.

use super::*;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::io::Write;

/// A field of a message: its number, and a number or bytes.
enum Field<'f> {
    Number(u64),
    Bytes(&'f [u8]),
}

fn varint(bytes: &mut Vec<u8>, mut number: u64) {
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
}

fn message(fields: &[(u64, Field<'_>)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (number, field) in fields {
        match field {
            Field::Number(value) => {
                varint(&mut bytes, number << 3);
                varint(&mut bytes, *value);
            }
            Field::Bytes(content) => {
                varint(&mut bytes, number << 3 | 2);
                varint(&mut bytes, content.len() as u64);
                bytes.extend_from_slice(content);
            }
        }
    }
    bytes
}

fn zigzag(number: i64) -> u64 {
    ((number << 1) ^ (number >> 63)) as u64
}

fn packed(numbers: impl IntoIterator<Item = u64>) -> Vec<u8> {
    let mut bytes = Vec::new();
    numbers
        .into_iter()
        .for_each(|number| varint(&mut bytes, number));
    bytes
}

/// Numbers as their differences.
fn differences(numbers: &[i64]) -> Vec<u8> {
    let before = [0].iter().chain(numbers);
    packed(
        numbers
            .iter()
            .zip(before)
            .map(|(number, before)| zigzag(number - before)),
    )
}

fn blob(kind: &str, content: &[u8]) -> Vec<u8> {
    let header = message(&[
        (1, Field::Bytes(kind.as_bytes())),
        (3, Field::Number(content.len() as u64)),
    ]);
    let mut bytes = (header.len() as u32).to_be_bytes().to_vec();
    bytes.extend(header);
    bytes.extend(content);
    bytes
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).expect("memory");
    let compressed = encoder.finish().expect("memory");
    let size = Field::Number(bytes.len() as u64);
    message(&[(2, size), (3, Field::Bytes(&compressed))])
}

fn header(feature: &str) -> Vec<u8> {
    let schema = message(&[
        (4, Field::Bytes(b"OsmSchema-V0.6")),
        (4, Field::Bytes(feature.as_bytes())),
    ]);
    blob("OSMHeader", &zlib(&schema))
}

/// Keys with their values.
type Tags<'m> = Vec<[&'m str; 2]>;

/// A way: its id, its nodes, its tags.
type DrawnWay<'m> = (i64, Vec<i64>, Tags<'m>);

/// A relation: its id, its ways with their roles, its tags.
type DrawnRelation<'m> = (i64, Vec<(i64, &'m str)>, Tags<'m>);

/// A map: nodes with steps of 100 nanodegrees, ways, and multipolygons.
#[derive(Default)]
struct Map<'m> {
    nodes: Vec<(i64, [i64; 2])>,
    ways: Vec<DrawnWay<'m>>,
    relations: Vec<DrawnRelation<'m>>,
}

impl Map<'_> {
    fn extract(&self) -> Vec<u8> {
        self.packed_by(zlib)
    }

    fn packed_by(&self, pack: fn(&[u8]) -> Vec<u8>) -> Vec<u8> {
        let mut texts = vec![""];
        let mut place = |text| match texts.iter().position(|known| *known == text) {
            Some(place) => place as u64,
            None => {
                texts.push(text);
                texts.len() as u64 - 1
            }
        };
        let column = |take: fn(&(i64, [i64; 2])) -> i64| {
            differences(&self.nodes.iter().map(take).collect::<Vec<_>>())
        };
        let dense = message(&[
            (1, Field::Bytes(&column(|node| node.0))),
            (8, Field::Bytes(&column(|node| node.1[1]))),
            (9, Field::Bytes(&column(|node| node.1[0]))),
        ]);
        let mut groups = vec![message(&[(2, Field::Bytes(&dense))])];
        for (id, nodes, tags) in &self.ways {
            let keys = packed(tags.iter().map(|tag| place(tag[0])));
            let values = packed(tags.iter().map(|tag| place(tag[1])));
            let way = message(&[
                (1, Field::Number(*id as u64)),
                (2, Field::Bytes(&keys)),
                (3, Field::Bytes(&values)),
                (8, Field::Bytes(&differences(nodes))),
            ]);
            groups.push(message(&[(3, Field::Bytes(&way))]));
        }
        for (id, members, tags) in &self.relations {
            let keys = packed(tags.iter().map(|tag| place(tag[0])));
            let values = packed(tags.iter().map(|tag| place(tag[1])));
            let roles = packed(members.iter().map(|member| place(member.1)));
            let ids: Vec<i64> = members.iter().map(|member| member.0).collect();
            let relation = message(&[
                (1, Field::Number(*id as u64)),
                (2, Field::Bytes(&keys)),
                (3, Field::Bytes(&values)),
                (8, Field::Bytes(&roles)),
                (9, Field::Bytes(&differences(&ids))),
                (10, Field::Bytes(&packed(members.iter().map(|_| 1)))),
            ]);
            groups.push(message(&[(4, Field::Bytes(&relation))]));
        }
        let strings: Vec<(u64, Field<'_>)> = texts
            .iter()
            .map(|text| (1, Field::Bytes(text.as_bytes())))
            .collect();
        let strings = message(&strings);
        let mut block = vec![(1, Field::Bytes(&strings))];
        block.extend(groups.iter().map(|group| (2, Field::Bytes(group))));
        let data = pack(&message(&block));
        [
            header("DenseNodes"),
            blob("OSMOther", b"?"),
            blob("OSMData", &data),
        ]
        .concat()
    }

    /// Four nodes from `first` on: a square with its south-western corner here, in steps.
    fn square(&mut self, first: i64, corner: [i64; 2], side: i64) -> Vec<i64> {
        let [west, south] = corner;
        let corners = [[0, 0], [side, 0], [side, side], [0, side]];
        let nodes = (first..).zip(corners.map(|[x, y]| [west + x, south + y]));
        self.nodes.extend(nodes);
        vec![first, first + 1, first + 2, first + 3, first]
    }
}

const CORNER: [i64; 2] = [1_512_000_000, -338_600_000];
const YES: [&str; 2] = ["building", "yes"];
const MULTIPOLYGON: [&str; 2] = ["type", "multipolygon"];

/// A hall, a tower that is a part, a park, and a ring around a yard.
fn town() -> Map<'static> {
    let [west, south] = CORNER;
    let mut map = Map::default();
    let hall = map.square(1, CORNER, 5_000);
    let tower = map.square(11, [west + 1_000, south + 1_000], 2_000);
    let park = map.square(21, [west + 20_000, south], 5_000);
    let outer = map.square(31, [west, south + 40_000], 9_000);
    let yard = map.square(41, [west + 3_000, south + 43_000], 3_000);
    map.ways = vec![
        (100, hall, vec![YES, ["name", "Hall"], ["height", "12.5 m"]]),
        (
            101,
            tower,
            vec![
                ["building:part", "yes"],
                ["building:levels", "10"],
                ["min_height", "12.5"],
            ],
        ),
        (102, park, vec![["leisure", "park"]]),
        // The ring in two pieces, the second of them against it.
        (103, outer[..3].to_vec(), vec![]),
        (104, vec![outer[0], outer[3], outer[2]], vec![]),
        (105, yard, vec![]),
    ];
    map.relations = vec![
        (
            7,
            vec![(103, "outer"), (105, "inner"), (104, "")],
            vec![MULTIPOLYGON, YES, ["height", "tall"]],
        ),
        (8, vec![(100, "outline")], vec![["type", "building"], YES]),
    ];
    map
}

fn read(map: &Map<'_>) -> OsmBuildings {
    read_osm_buildings(&map.extract(), None).expect("buildings")
}

fn first_error(extract: &[u8]) -> String {
    let errors = read_osm_buildings(extract, None).expect_err("at fault");
    errors[0].to_string()
}

#[test]
fn a_town_is_read_with_parts_and_yards() {
    let town = read(&town());
    let told: Vec<_> = town
        .buildings
        .iter()
        .map(|building| {
            (
                building.id.as_str(),
                building.height_m,
                building.min_height_m,
            )
        })
        .collect();
    assert_eq!(
        told,
        [
            ("way/100", Some(12.5), None),
            ("way/101", Some(35.0), Some(12.5)),
            ("relation/7", None, None)
        ]
    );
    assert_eq!(town.buildings[0].name.as_deref(), Some("Hall"));
    let hall = vec![vec![
        [
            [151.2, -33.86],
            [151.2005, -33.86],
            [151.2005, -33.8595],
            [151.2, -33.8595],
            [151.2, -33.86],
        ]
        .to_vec(),
    ]];
    assert_eq!(town.buildings[0].outline.polygons(), hall);
    let ring = town.buildings[2].outline.polygons();
    assert_eq!(
        (ring.len(), ring[0].len()),
        (1, 2),
        "one polygon with its yard"
    );
    assert_eq!(
        town.repairs,
        ["relation/7: height=tall is no height that can be read"]
    );
}

#[test]
fn a_box_takes_the_buildings_with_a_corner_in_it() {
    let around = |west: f64, south: f64, east: f64, north: f64| {
        let within = DegreeBox {
            west,
            south,
            east,
            north,
        };
        let read = read_osm_buildings(&town().extract(), Some(&within)).expect("buildings");
        read.buildings
            .into_iter()
            .map(|building| building.id)
            .collect::<Vec<_>>()
    };
    assert_eq!(
        around(151.0, -34.0, 152.0, -33.0),
        ["way/100", "way/101", "relation/7"]
    );
    assert_eq!(around(151.2, -33.8601, 151.20001, -33.8599), ["way/100"]);
    assert_eq!(around(151.2, -33.8561, 151.20001, -33.8559), ["relation/7"]);
    assert!(around(10.0, 10.0, 11.0, 11.0).is_empty());
}

#[test]
fn what_is_drawn_wrong_is_widened_and_told() {
    let mut map = Map::default();
    let square = map.square(1, CORNER, 5_000);
    let open = square[..4].to_vec();
    let bow_tie = vec![1, 3, 2, 4, 1];
    let line = vec![1, 2, 1];
    map.ways = vec![
        (1, open, vec![YES]),
        (2, bow_tie, vec![YES]),
        (3, line, vec![YES]),
    ];
    let wrong = read(&map);
    let corners = [
        [151.2, -33.86],
        [151.2005, -33.86],
        [151.2005, -33.8595],
        [151.2, -33.8595],
    ];
    assert_eq!(wrong.buildings.len(), 2);
    for building in &wrong.buildings {
        let ring = &building.outline.polygons()[0][0];
        assert!(
            corners.iter().all(|corner| ring.contains(corner)),
            "{building:?}"
        );
    }
    assert_eq!(
        wrong.repairs,
        [
            "way/1: ring 0 of polygon 0 is not closed; repeat its first position at its end; taken as wide as its corners reach",
            "way/2: ring 0 of polygon 0 crosses itself; taken as wide as its corners reach",
            "way/3: encloses nothing, and is left out",
        ]
    );
}

#[test]
fn what_the_extract_cuts_off_is_refused() {
    let mut map = town();
    map.nodes.retain(|(id, _)| *id != 13);
    assert_eq!(
        first_error(&map.extract()),
        "document (building 'way/101'): has a corner that the extract lacks; make the extract with complete ways and multipolygons, or leave its edge out with --bbox"
    );
    let mut map = town();
    map.ways.retain(|(id, ..)| *id != 104);
    assert!(
        first_error(&map.extract()).starts_with("document (building 'relation/7'): has a way that")
    );
}

#[test]
fn bytes_that_are_no_extract_are_refused_by_their_block() {
    let extract = town().extract();
    for (bytes, expected) in [
        (
            extract[..extract.len() - 1].to_vec(),
            "block 3: ends before its end",
        ),
        (extract[..2].to_vec(), "block 1: ends before its end"),
        (b"PK\x03\x04".repeat(9), "block 1: has a header larger than"),
        (
            header("HistoricalInformation"),
            "block 1: requires 'HistoricalInformation'",
        ),
        (blob("OSMData", b"\xff\xff"), "block 1: cannot be read: "),
        (
            blob("OSMData", &message(&[(3, Field::Bytes(b"no zlib"))])),
            "block 1: cannot be unpacked: ",
        ),
        (
            blob("OSMData", &message(&[(6, Field::Bytes(b"lz4"))])),
            "block 1: is not compressed with zlib",
        ),
        (
            blob("OSMData", &zlib(&vec![0; 33 << 20])),
            "block 1: is larger than the format allows",
        ),
    ] {
        let told = first_error(&bytes);
        assert!(told.starts_with(expected), "{told}");
    }
    let nothing = read_osm_buildings(&[], None).expect("no blocks");
    assert!(nothing.buildings.is_empty());
}

#[test]
fn positions_that_overflow_are_refused() {
    let mut map = Map::default();
    let nodes = map.square(1, CORNER, 5_000);
    map.nodes[1].1 = [i64::MAX / 2, 0];
    map.ways = vec![(1, nodes, vec![YES])];
    let told = first_error(&map.extract());
    assert!(
        told.contains("which is not a longitude and latitude"),
        "{told}"
    );
}

/// Every byte of an extract bent in turn: an answer or an error, never a panic.
#[test]
fn bent_extracts_do_no_harm() {
    let mut map = town();
    map.nodes.truncate(30);
    // Uncompressed, as the checksum of zlib would keep most of them out.
    let extract = map.packed_by(|bytes| message(&[(1, Field::Bytes(bytes))]));
    for place in 0..extract.len() {
        for bit in [0, 3, 7] {
            let mut bent = extract.clone();
            bent[place] ^= 1 << bit;
            // Whatever it says of the building, it comes back.
            let _ = read_osm_buildings(&bent, None);
        }
    }
}
