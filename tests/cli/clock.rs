//! A clock that a client moves, from outside: a run stepped by it is the same twice, and an edge starts with it only where
//! that misleads no client.

#![expect(
    clippy::disallowed_types,
    reason = "a client of the daemon, from outside"
)]

use crate::binary::{Server, Workspace, skyway, starts_with};
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;

const START: &str = "2026-11-27T18:00:00Z";
/// What is put last, and by which a reader of events knows the end.
const LAST: &str = "the-last-zone";

/// An edge over Sydney with flown plans, and all that it has answered.
struct Run {
    server: Server,
    answers: Vec<String>,
    now: Timestamp,
    nodes: Vec<(String, Value)>,
}

impl Run {
    fn begin(desk: &Workspace) -> Self {
        let clock = ["--clock", "external", "--clock-start", START];
        let what = ["edge", "--no-store", "--set", "flight.airframe=m100"];
        let server = Server::start(desk, &[&what[..], &clock].concat());
        let mut run = Self {
            server,
            answers: Vec::new(),
            now: START.parse().expect("an instant"),
            nodes: Vec::new(),
        };
        let (_, network) = run.ask("GET /v1/network", &Value::Null);
        let features = network["features"].as_array().expect("features").iter();
        let points = features.filter(|feature| feature["geometry"]["type"] == "Point");
        let nodes =
            points.map(|node| (node["id"].clone(), node["geometry"]["coordinates"].clone()));
        run.nodes = nodes.map(|(id, place)| (text_of(&id), place)).collect();
        run
    }

    fn ask(&mut self, line: &str, body: &Value) -> (u16, Value) {
        let sent = match body {
            Value::Null => String::new(),
            body => body.to_string(),
        };
        // Ids of requests are its own, where it does not name them.
        let mut headers = "content-type: application/json\r\nx-request-id: hour\r\n".to_owned();
        if line.starts_with("DELETE") {
            headers.push_str("if-match: *\r\n");
        }
        let answer = Server::exchange(self.server.address, line, &headers, &sent);
        let (head, body) = answer.split_once("\r\n\r\n").expect("a head");
        let status = head
            .split(' ')
            .nth(1)
            .expect("a status")
            .parse()
            .expect("a number");
        let mut json: Value = serde_json::from_str(body).unwrap_or_default();
        mask_times(&mut json);
        self.answers
            .push(format!("{line} {sent} -> {status} {json}"));
        (status, json)
    }

    fn advance(&mut self, to: Timestamp) {
        let (status, told) = self.ask("POST /v1/clock:advance", &json!({"to": to.to_string()}));
        assert_eq!((status, &told["clock"]), (200, &json!("external")));
        self.now = to;
    }

    fn node(&self, number: usize) -> &(String, Value) {
        &self.nodes[number % self.nodes.len()]
    }

    /// What the events say, up to the last one.
    fn events(&mut self, epoch: &str) -> Vec<String> {
        self.ask(
            &format!("PUT /v1/zones/{LAST}"),
            &circle(&self.node(1).1, json!([])),
        );
        let mut stream = TcpStream::connect(self.server.address).expect("the daemon");
        let request = format!(
            "GET /v1/events?after={epoch}-0 HTTP/1.1\r\nhost: {}\r\n\r\n",
            self.server.address
        );
        stream.write_all(request.as_bytes()).expect("a reader");
        let mut events = Vec::new();
        for line in BufReader::new(stream).lines() {
            let line = line.expect("text");
            let Some(event) = line.strip_prefix("data: ") else {
                continue;
            };
            let mut event: Value = serde_json::from_str(event).expect("an event");
            assert_eq!(event["clock"], "external");
            mask_times(&mut event);
            let is_last = event["data"]["zone"]["id"] == LAST;
            events.push(event.to_string());
            if is_last {
                break;
            }
        }
        events
    }
}

fn text_of(id: &Value) -> String {
    id.as_str().map_or_else(|| id.to_string(), str::to_owned)
}

/// How long something took is the machine's.
fn mask_times(json: &mut Value) {
    match json {
        Value::Object(members) => {
            for (name, value) in members {
                match name.as_str() {
                    "elapsed_us" => *value = Value::Null,
                    _ => mask_times(value),
                }
            }
        }
        Value::Array(values) => values.iter_mut().for_each(mask_times),
        _ => {}
    }
}

fn circle(place: &Value, windows: Value) -> Value {
    json!({
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": place},
        "properties": {"name": "Concert", "radius_m": 80, "windows": windows},
    })
}

/// A scripted hour: deliveries, drones that fly them and some that are low, versions that some take over, zones with
/// windows, failures. Gives the answers and the events, without the epoch.
fn hour() -> Vec<String> {
    let desk = Workspace::new();
    let mut run = Run::begin(&desk);
    let (_, readiness) = run.ask("GET /v1/plans", &Value::Null);
    let revision = readiness["revision"].as_str().expect("a revision");
    let epoch = revision.split('-').next().expect("an epoch").to_owned();
    let start = run.now;
    let mut plans: Vec<Value> = Vec::new();
    for minute in 0..60_i64 {
        run.advance(start + SignedDuration::from_mins(minute));
        let number = usize::try_from(minute).expect("a small number");
        if number % 2 == 0 && number < 40 {
            let (source, destination) = (run.node(number * 37), run.node(number * 53 + 101));
            let request = json!({
                "id": format!("p{number}"), "drone_id": format!("d{number}"), "payload_kg": 0.2,
                "source": source.0, "destination": destination.0,
            });
            let (status, plan) = run.ask("POST /v1/plans", &request);
            plans.extend((status == 201).then_some(plan));
        }
        if number % 6 == 1 {
            let (from, until) = (
                run.now + SignedDuration::from_secs(150),
                run.now + SignedDuration::from_mins(11),
            );
            let windows = json!([{"from": from.to_string(), "until": until.to_string()}]);
            let zone = circle(&run.node(number * 71).1, windows);
            run.ask(&format!("PUT /v1/zones/z{number}"), &zone);
        }
        if number % 12 == 11 {
            run.ask(&format!("DELETE /v1/zones/z{}", number - 4), &Value::Null);
        }
        let positions: Vec<Value> = plans
            .iter()
            .filter_map(|plan| position(plan, run.now))
            .collect();
        run.ask("POST /v1/telemetry", &json!({ "positions": positions }));
        if number % 3 == 2
            && let Some(flying) = positions.get(number % positions.len().max(1))
        {
            let kind = ["navigational", "environmental", "operational"][number % 9 / 3];
            let report = json!({
                "type": kind, "drone": {"id": flying["drone_id"]}, "location": flying["location"],
                "service": {"plan_id": flying["plan"], "leg": flying["leg"]},
            });
            let (_, answer) = run.ask("POST /v1/failures", &report);
            let version = &answer["plan"]["version"];
            if number % 2 == 0 && version.is_number() {
                let plan = flying["plan"].as_str().expect("an id");
                run.ask(
                    &format!("POST /v1/plans/{plan}/ack"),
                    &json!({"version": version}),
                );
            }
        }
    }
    // The rest of the day at once: whatever is due happens at its own instant.
    run.advance(start + SignedDuration::from_hours(12));
    let events = run.events(&epoch);
    assert_eq!(run.server.end(), 0);
    let told = run.answers.into_iter().chain(events);
    told.map(|line| line.replace(&epoch, "EPOCH")).collect()
}

/// Where the drone of a plan is by its first version, as telemetry says it.
fn position(plan: &Value, now: Timestamp) -> Option<Value> {
    let legs = plan["reported"]["legs"].as_array()?;
    let arrives = |leg: &Value| {
        leg["arrives_at"]
            .as_str()
            .and_then(|text| text.parse::<Timestamp>().ok())
    };
    let leg = legs
        .iter()
        .position(|leg| arrives(leg).is_some_and(|at| at > now))?;
    let drone = plan["drone_id"].as_str()?;
    let is_low = drone.ends_with('4') && leg > 0;
    Some(json!({
        "drone_id": drone, "plan": plan["id"], "location": {"node": legs[leg]["from"]}, "leg": leg, "fraction": 0.1,
        "airborne": true, "battery_fraction": if is_low { 0.35 } else { 0.8 },
    }))
}

#[test]
fn a_run_that_a_client_steps_is_the_same_twice() {
    let (first, second) = (hour(), hour());
    for (number, (one, other)) in first.iter().zip(&second).enumerate() {
        assert_eq!(one, other, "line {number} of {}", first.len());
    }
    assert_eq!(first.len(), second.len());
    // It is an hour in which much happens.
    for kind in [
        "plan_composed",
        "plan_affected",
        "plan_acknowledged",
        "plan_unacknowledged",
        "plan_offered",
        "plan_ended",
        "windows_turned",
        "recomposed",
        "closure_ended",
        "replanned",
    ] {
        let kind = format!(r#""kind":"{kind}""#);
        let count = first.iter().filter(|line| line.contains(&kind)).count();
        assert!(count > 4, "{kind}: {count}");
    }
}

#[test]
fn an_edge_by_a_clients_clock_has_no_listener_for_others_and_no_registry() {
    let refused = |set: &[&str]| {
        let check = ["config", "check", "--quiet", "--clock", "external"];
        skyway(&[&check[..], set].concat()).exits(78).stderr
    };
    let tokens = ["--set", "allow_plaintext=true", "--tokens-file", "/nowhere"];
    let far = refused(&[&["--listen", "10.0.0.4:80"][..], &tokens].concat());
    assert!(
        far.contains("flag --clock: an external clock is for loopback only, and listen = 10.0.0.4:80 is not; leave clock.kind out"),
        "{far}"
    );
    assert_eq!(
        refused(&["--registry-url", "http://127.0.0.1:1"]),
        "error: flag --registry-url: registry.url names a registry, which has another clock than clock.kind = external; \
         leave one of the two out\n"
    );
    assert_eq!(
        refused(&["--clock-rate", "2"]),
        "error: flag --clock-rate: clock.rate is of no use with clock.kind = external, which passes as clients move it; \
         leave one of the two out\n"
    );
}

#[test]
fn a_store_belongs_to_the_clock_that_has_written_it() {
    let desk = Workspace::new();
    let stores = Workspace::new();
    let (own, other) = (stores.path("own.db"), stores.path("other.db"));
    let stepped = [
        "--clock",
        "external",
        "--clock-start",
        START,
        "--store",
        &own,
    ];
    let edge = Server::start(&desk, &[&["edge"][..], &stepped].concat());
    let json = "content-type: application/json\r\n";
    let to = json!({"to": "2026-11-27T19:30:00Z"}).to_string();
    Server::ask(edge.address, "POST /v1/clock:advance", json, &to);
    let closure = json!({"id": "c1", "segments": ["379-406"]}).to_string();
    Server::ask(edge.address, "POST /v1/closures", json, &closure);
    assert_eq!(edge.end(), 0);
    // It goes on where it was, whenever it is started again.
    let desk = Workspace::new();
    let edge = Server::start(&desk, &[&["edge"][..], &stepped].concat());
    let told = Server::ask(edge.address, "GET /v1/clock", "", "");
    assert!(
        told.ends_with(r#"{"kind":"external","time":"2026-11-27T19:30:00Z","rate":0.0}"#),
        "{told}"
    );
    assert_eq!(edge.end(), 0);
    let (_, told) = starts_with(&desk, &["--store", &own]).expect("it does not serve");
    let why =
        "the store was written by a clock that clients move, and clock.kind names another one";
    assert!(told.contains(why) && told.contains("--store"), "{told}");
    let desk = Workspace::new();
    assert_eq!(Server::start(&desk, &["edge", "--store", &other]).end(), 0);
    let (_, told) =
        starts_with(&desk, &["--store", &other, "--clock", "external"]).expect("it does not serve");
    let why = "clock.kind is external, and another clock has written the store";
    assert!(told.contains(why) && told.contains("--store"), "{told}");
}
