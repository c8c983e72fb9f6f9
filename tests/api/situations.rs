//! The situations of docs/safe-answers.md: an edge is asked for each, and has to answer what was worked out by hand.

use crate::town::{DIALECTS, Dialect, Town};
use serde::Deserialize;
use serde_json::{Value, json};
use skyway::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};
use std::collections::BTreeMap;

/// The page states lengths to the centimetre.
const TOLERANCE_M: f64 = 0.006;
/// How many situations the page has; one that cannot be found would pass.
const SITUATIONS: usize = 10;

/// One situation as the page states it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Situation {
    #[serde(default)]
    zones: Vec<Zone>,
    /// Segments that the network does not have any more.
    #[serde(default)]
    without: Vec<String>,
    report: Value,
    answer: BTreeMap<String, Value>,
}

/// A circle, in force for some minutes or until it is lifted.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Zone {
    id: String,
    center: [f64; 2],
    radius_m: f64,
    minutes: Option<u32>,
}

/// The network of the page.
pub(crate) fn quarter(without: &[String]) -> NetworkDraft {
    let node = |id: &str, x: f64, y: f64, pads: u16| NodeDraft {
        id: id.to_owned(),
        position: [x, y],
        pads,
        ..NodeDraft::default()
    };
    let segments = [
        "a-b", "b-c", "c-d", "e-f", "f-g", "g-h", "a-e", "b-f", "c-g", "d-h",
    ];
    let segments = segments
        .iter()
        .filter(|id| !without.contains(&(**id).to_owned()));
    NetworkDraft {
        nodes: vec![
            node("a", 0.0, 0.0, 2),
            node("b", 1_000.0, 0.0, 0),
            node("c", 2_000.0, 0.0, 0),
            node("d", 3_000.0, 0.0, 2),
            node("e", 0.0, 400.0, 0),
            node("f", 1_000.0, 500.0, 2),
            node("g", 2_000.0, 600.0, 0),
            node("h", 3_000.0, 700.0, 0),
        ],
        segments: segments
            .filter_map(|id| id.split_once('-'))
            .map(|(from, to)| SegmentDraft {
                from: from.to_owned(),
                to: to.to_owned(),
                ..SegmentDraft::default()
            })
            .collect(),
        coordinates: Coordinates::Planar,
        name: "quarter".to_owned(),
        ..NetworkDraft::default()
    }
}

pub(crate) async fn open(dialect: Dialect, without: &[String]) -> Town {
    Town::over(&quarter(without), dialect, "10:00", None).await
}

impl Zone {
    fn feature(&self) -> Value {
        let mut properties = json!({"radius_m": self.radius_m});
        if let Some(minutes) = self.minutes {
            let until = format!("2026-11-27T10:{minutes:02}:00Z");
            properties["windows"] = json!([{"from": "2026-11-27T09:00:00Z", "until": until}]);
        }
        json!({
            "type": "Feature",
            "id": self.id,
            "geometry": {"type": "Point", "coordinates": self.center},
            "properties": properties,
        })
    }
}

/// The situations of the page, each with its heading.
fn situations() -> Vec<(String, Situation)> {
    let page = include_str!("../../docs/safe-answers.md");
    let sections = page.split("\n### ").skip(1);
    let stated = sections.filter_map(|section| {
        let (_, rest) = section.split_once("```json\n")?;
        let (block, _) = rest.split_once("\n```")?;
        let title = section.lines().next().unwrap_or_default().to_owned();
        let situation = serde_json::from_str(block);
        Some((
            title.clone(),
            situation.unwrap_or_else(|error| panic!("{title}: {error}")),
        ))
    });
    stated.collect()
}

/// Where what is told differs from what is expected: names that are not expected may hold anything.
fn difference(place: &str, expected: &Value, told: &Value) -> Option<String> {
    let differs = || Some(format!("{place}: {told}, expected {expected}"));
    match (expected, told) {
        (Value::Number(one), Value::Number(other)) => {
            let apart = one.as_f64()? - other.as_f64()?;
            if apart.abs() <= TOLERANCE_M {
                None
            } else {
                differs()
            }
        }
        (Value::Object(members), _) => members.iter().find_map(|(name, value)| {
            let found = told.get(name).unwrap_or(&Value::Null);
            difference(&format!("{place}/{name}"), value, found)
        }),
        // An empty list may be left out.
        (Value::Array(list), Value::Null) if list.is_empty() => None,
        _ if expected == told => None,
        _ => differs(),
    }
}

async fn asked(situation: &Situation, dialect: Dialect) -> Value {
    let town = open(dialect, &situation.without).await;
    for zone in &situation.zones {
        town.api.post("/v1/zones", &zone.feature()).await.is(201);
    }
    town.api.settled().await;
    let answer = town.report(situation.report.clone()).await;
    serde_json::to_value(answer).expect("JSON")
}

#[tokio::test]
async fn the_situations_of_the_page_are_answered_as_it_says() {
    let situations = situations();
    assert_eq!(situations.len(), SITUATIONS, "situations found on the page");
    let mut differences = Vec::new();
    for (title, situation) in &situations {
        for dialect in DIALECTS {
            let told = asked(situation, dialect).await;
            let expected = json!(situation.answer);
            let found = difference("", &expected, &told);
            differences
                .extend(found.map(|found| format!("{title} ({dialect:?}): {found}\n{told}")));
        }
    }
    assert!(differences.is_empty(), "{}", differences.join("\n"));
}
