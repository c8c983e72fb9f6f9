//! Faults of the engine: each planted one is seen by the checker before an answer leaves, and what is wrong is never sent.

use crate::daemon::{Daemon, Plan, write};
use crate::registry_client::{Answer, Client};
use crate::square::{circle, network};
use serde_json::{Value, json};
use skyway::formats::write_network;
use skyway::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};

/// How often an alarm that is due is looked for, and how long between two looks.
const LOOKS: usize = 500;
const BETWEEN_LOOKS: std::time::Duration = std::time::Duration::from_millis(10);

/// A report, and what is done before it.
struct Story {
    network: String,
    settings: &'static [&'static str],
    before: Vec<(&'static str, Value)>,
    report: Value,
}

/// What the edge did.
struct Seen {
    answer: Value,
    record: Value,
    cases: u64,
    events: usize,
    alarms: usize,
}

impl Story {
    /// A drone 30 m along n11 - n21 meets an obstacle ahead.
    fn around() -> Self {
        Self {
            network: network(),
            settings: &[],
            before: Vec::new(),
            report: json!({
                "service": {"from": "n11", "to": "n21"},
                "destination": "n41",
                "type": "navigational",
                "location": [130.0, 100.0],
            }),
        }
    }

    /// The same with its way back closed.
    fn shut_in() -> Self {
        let closure = json!({"id": "o", "reason": "works", "nodes": ["n11"]});
        Self {
            before: vec![("POST /v1/closures", closure)],
            ..Self::around()
        }
    }

    /// A drone at n11 on a leg that the network does not have.
    fn removed() -> Self {
        let mut story = Self::around();
        story.report["service"]["to"] = json!("n41");
        story.report["type"] = json!("service_level");
        story.report["location"] = json!({"node": "n11"});
        story
    }

    /// With the flight model: a drone on its way reports less battery than its plan has.
    fn with_less_battery() -> Self {
        let plan = json!({"id": "p", "source": "n11", "destination": "n41", "drone_id": "d1"});
        let mut story = Self::around();
        story.settings = &["flight.airframe=phantom3"];
        story.before = vec![("POST /v1/plans", plan)];
        story.report["drone"] = json!({"id": "d1", "battery_fraction": 0.5});
        story.report["service"] = json!({"plan_id": "p", "from": "n11", "to": "n21"});
        story
    }

    /// With the flight model: a leg of ten minutes, over which a zone closes soon after the drone has left it.
    fn long_leg() -> Self {
        let mut zone = circle("soon", "soon", [4_800.0, 0.0], 50.0);
        zone["properties"]["windows"] = json!([{"from": "now+685s"}]);
        Self {
            network: line(),
            settings: &["flight.airframe=phantom3"],
            before: vec![("PUT /v1/zones/soon", zone)],
            report: json!({
                "service": {"from": "a", "to": "b"},
                "destination": "b",
                "type": "service_level",
                "location": {"node": "a"},
                "airborne": true,
                "drone": {"battery_fraction": 1.0},
            }),
        }
    }

    /// With the flight model: two drones in need beside each other, of which the first has the nearest pad.
    fn one_pad() -> Self {
        let plan = json!({"id": "p", "source": "n11", "destination": "n41", "drone_id": "d1"});
        let mut story = Self::around();
        story.settings = &["flight.airframe=phantom3"];
        story.report["type"] = json!("operational");
        let mut first = story.report.clone();
        first["drone"] = json!({"id": "d1"});
        first["service"] = json!({"plan_id": "p", "from": "n11", "to": "n21"});
        story.before = vec![("POST /v1/plans", plan), ("POST /v1/failures", first)];
        story
    }

    /// With a zone over the node at which a drone stands.
    fn grounded() -> Self {
        let zone = circle("over", "over", [100.0, 100.0], 20.0);
        Self {
            before: vec![("PUT /v1/zones/over", zone)],
            report: json!({
                "service": {"from": "n11", "to": "n21"},
                "destination": "n41",
                "type": "service_level",
                "location": {"node": "n11"},
                "airborne": false,
            }),
            ..Self::around()
        }
    }

    /// Tells the story to an edge with a bug, or without one.
    async fn told(&self, bug: Option<&'static str>) -> Seen {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("network.geojson").display().to_string();
        write(&file, &self.network);
        let mut what = vec!["edge", "--network", &file, "--no-store"];
        for setting in self.settings {
            what.extend(["--set", setting]);
        }
        let plan = Plan::new("edge", folder.path(), &what).with_bug(bug);
        let daemon = plan.start().await;
        let client = Client::new(&plan.address);
        let clock = client.until("GET /v1/clock", &Value::Null, 200).await;
        let soon = soon_after(&clock);
        for (line, body) in &self.before {
            let body = &with_instant(body, &soon);
            let Answer::Came { status, body, .. } = client.ask(line, &[], body).await else {
                panic!("{line}: {}", plan.log());
            };
            assert!(status < 300, "{line}: {body}");
        }
        let seen = self.seen(&client, &Client::new(&plan.admin)).await;
        Daemon::kill(daemon);
        seen
    }

    async fn seen(&self, client: &Client, admin: &Client) -> Seen {
        let json = |text: String| serde_json::from_str::<Value>(&text).expect("JSON");
        let answer = client.until("POST /v1/failures", &self.report, 200).await;
        let answer = json(answer);
        let id = answer["id"].as_str().expect("an id");
        let record = format!("GET /v1/recompositions/{id}");
        let record = json(client.until(&record, &Value::Null, 200).await);
        let alarms = "GET /v1/alarms?kind=checker";
        let mut raised = json(client.until(alarms, &Value::Null, 200).await);
        // The writer raises it after the answer has left.
        let is_due = record["checker_case"].is_object();
        for _ in 0..LOOKS {
            let is_there = raised["alarms"]
                .as_array()
                .is_some_and(|all| !all.is_empty());
            if is_there || !is_due {
                break;
            }
            tokio::time::sleep(BETWEEN_LOOKS).await;
            raised = json(client.until(alarms, &Value::Null, 200).await);
        }
        let metrics = admin.until("GET /metrics", &Value::Null, 200).await;
        let count = |name: &str| {
            let mut lines = metrics.lines();
            let line = lines.find_map(|line| line.strip_prefix(name));
            line.map(|count| count.trim().parse::<u64>().expect("a count"))
        };
        Seen {
            cases: count("skyway_checker_cases_total ").expect("there from the start"),
            events: usize::from(record["checker_case"].is_object()),
            alarms: raised["alarms"].as_array().map_or(0, Vec::len),
            answer,
            record,
        }
    }
}

/// Two nodes far apart, and the leg between them.
fn line() -> String {
    let node = |id: &str, x: f64| NodeDraft {
        id: id.to_owned(),
        position: [x, 0.0],
        pads: 1,
        ..NodeDraft::default()
    };
    write_network(&NetworkDraft {
        name: "Line".to_owned(),
        coordinates: Coordinates::Planar,
        nodes: vec![node("a", 0.0), node("b", 9_600.0)],
        segments: vec![SegmentDraft {
            from: "a".to_owned(),
            to: "b".to_owned(),
            ..SegmentDraft::default()
        }],
        ..NetworkDraft::default()
    })
}

/// 685 s after what a clock says: within the margin of the end of a leg of 600 s, and without that of its entry.
fn soon_after(clock: &str) -> String {
    let clock: Value = serde_json::from_str(clock).expect("JSON");
    let time: jiff::Timestamp = clock["time"]
        .as_str()
        .expect("a time")
        .parse()
        .expect("one");
    let soon = time.checked_add(jiff::SignedDuration::from_secs(685));
    soon.expect("an instant").to_string()
}

/// A body with that instant in its place.
fn with_instant(body: &Value, soon: &str) -> Value {
    let text = body.to_string().replace("now+685s", soon);
    serde_json::from_str(&text).expect("JSON")
}

impl Seen {
    /// Nothing was wrong, and nothing says so.
    #[track_caller]
    fn is_clean(&self) {
        assert_eq!(self.cases, 0, "{:#}", self.record);
        assert!(self.record["checker_case"].is_null(), "{:#}", self.record);
        assert_eq!(self.alarms, 0);
    }

    /// The rule was broken, the case is told, and something else was sent.
    #[track_caller]
    fn breaks(&self, rule: &str) {
        let case = &self.record["checker_case"];
        assert_eq!(case["rule"], rule, "{:#}", self.record["answer"]);
        assert_eq!(self.cases, 1);
        assert_eq!((self.events, self.alarms), (1, 1));
        assert_eq!(self.answer["fallback_reason"], "checker");
        let is_same = self.answer["outcome"] == case["outcome"]
            && self.answer["path"]["nodes"] == case["nodes"];
        assert!(!is_same, "{:#}", self.answer);
        if case["fallback"] == "no_route" {
            assert_eq!(self.answer["outcome"], "no_route");
            assert!(self.answer["unsafe_way"].is_object());
        }
    }
}

#[tokio::test]
async fn without_a_bug_nothing_is_wrong() {
    for story in [
        Story::around(),
        Story::shut_in(),
        Story::removed(),
        Story::grounded(),
        Story::with_less_battery(),
        Story::long_leg(),
        Story::one_pad(),
    ] {
        story.told(None).await.is_clean();
    }
}

#[cfg(feature = "planted")]
mod planted {
    use super::*;

    #[tokio::test]
    async fn figures_of_another_start_are_seen() {
        Story::around()
            .told(Some("swapped-start"))
            .await
            .breaks("length");
    }

    #[tokio::test]
    async fn a_first_stretch_that_is_forgotten_is_seen() {
        let seen = Story::around().told(Some("stretch-forgotten")).await;
        seen.breaks("begins_at_drone");
    }

    #[tokio::test]
    async fn a_flag_without_ground_is_seen() {
        let seen = Story::around().told(Some("flag-without-ground")).await;
        seen.breaks("flag_without_ground");
    }

    #[tokio::test]
    async fn a_cause_that_is_dropped_is_seen() {
        let seen = Story::around().told(Some("dropped-cause")).await;
        seen.breaks("passes_cause");
    }

    #[tokio::test]
    async fn a_removed_leg_that_is_assumed_open_is_seen() {
        let seen = Story::removed().told(Some("removed-leg-open")).await;
        seen.breaks("passes_cause");
    }

    #[tokio::test]
    async fn the_battery_of_the_plan_is_seen() {
        let seen = Story::with_less_battery().told(Some("plans-battery")).await;
        seen.breaks("battery");
    }

    #[tokio::test]
    async fn a_drone_that_is_sent_up_through_a_zone_is_seen() {
        let seen = Story::grounded().told(Some("ground-sent-up")).await;
        seen.breaks("sent_up");
        assert_eq!(seen.answer["outcome"], "hold");
    }

    #[tokio::test]
    async fn a_closed_node_that_is_entered_is_seen() {
        let seen = Story::shut_in().told(Some("closed-node-entered")).await;
        seen.breaks("closed_node");
    }
}
