//! A small town with the flight model on, asked in either dialect.

use crate::harness::{Api, WAIT_AT_MOST};
use jiff::{SignedDuration, Timestamp};
use prost::Message;
use serde_json::{Value, json};
use skyway::api::grpc::{FromProto, IntoProto, proto};
use skyway::clock::ManualClock;
use skyway::edge::{FlightSettings, Settings};
use skyway::flight::Airframe;
use skyway::formats::{
    IntoTerm, load_network, read_flight_document, read_flight_question, recorded_question,
    write_network,
};
use skyway::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};
use skyway::verify::verify_flight;
use skyway::wire;
use std::sync::Arc;

/// How the edge is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Dialect {
    Rest,
    Grpc,
}

pub(crate) const DIALECTS: [Dialect; 2] = [Dialect::Rest, Dialect::Grpc];

/// Why something is refused: the code, and the pointers of what is wrong with their hints.
pub(crate) type Refused = (String, Vec<(String, Option<String>)>);

/// ```text
///              n
///            /   \
/// a --- b --------- c --- d      1500 m each; a and d have two pads, b and c one, n none
/// ```
fn draft() -> NetworkDraft {
    let node = |id: &str, x: f64, y: f64, pads: u16| NodeDraft {
        id: id.to_owned(),
        position: [x, y],
        pads,
        ..NodeDraft::default()
    };
    let segment = |from: &str, to: &str| SegmentDraft {
        from: from.to_owned(),
        to: to.to_owned(),
        ..SegmentDraft::default()
    };
    NetworkDraft {
        nodes: vec![
            node("a", 0.0, 0.0, 2),
            node("b", 1_500.0, 0.0, 1),
            node("c", 3_000.0, 0.0, 1),
            node("d", 4_500.0, 0.0, 2),
            node("n", 2_250.0, 1_200.0, 0),
        ],
        segments: vec![
            segment("a", "b"),
            segment("b", "c"),
            segment("c", "d"),
            segment("b", "n"),
            segment("n", "c"),
        ],
        coordinates: Coordinates::Planar,
        name: "town".to_owned(),
        ..NetworkDraft::default()
    }
}

/// A town, and how it is asked.
pub(crate) struct Town {
    pub(crate) api: Api,
    pub(crate) hand: ManualClock,
    pub(crate) dialect: Dialect,
}

/// An hour and minute of the day of all stories.
pub(crate) fn at(time: &str) -> Timestamp {
    let text = match time.len() {
        5 => format!("2026-11-27T{time}:00Z"),
        _ => format!("2026-11-27T{time}Z"),
    };
    text.parse().expect("an instant")
}

/// The same as it is written.
pub(crate) fn text(time: &str) -> String {
    at(time).to_string()
}

impl Town {
    pub(crate) async fn open(dialect: Dialect, time: &str) -> Self {
        Self::with(dialect, time, FlightSettings::of(Airframe::phantom3())).await
    }

    pub(crate) async fn with(dialect: Dialect, time: &str, flight: FlightSettings) -> Self {
        Self::over(&draft(), dialect, time, Some(flight)).await
    }

    /// Over another network; by distance without a flight model.
    pub(crate) async fn over(
        draft: &NetworkDraft,
        dialect: Dialect,
        time: &str,
        flight: Option<FlightSettings>,
    ) -> Self {
        let settings = Settings {
            flight,
            // A town has few segments.
            closed_fraction_max: 0.5,
            // Its drones tell where they are only where that matters.
            silent_after: SignedDuration::from_hours(24),
            ..Settings::default()
        };
        Self::set(draft, dialect, time, settings).await
    }

    /// The same, where drones are asked when they fall silent.
    pub(crate) async fn listening(
        draft: &NetworkDraft,
        dialect: Dialect,
        time: &str,
        flight: Option<FlightSettings>,
    ) -> Self {
        let settings = Settings {
            flight,
            closed_fraction_max: 0.5,
            ..Settings::default()
        };
        Self::set(draft, dialect, time, settings).await
    }

    async fn set(draft: &NetworkDraft, dialect: Dialect, time: &str, settings: Settings) -> Self {
        let text = write_network(draft);
        let loaded = load_network(&text).expect("a network");
        let topology = Arc::new(loaded.topology);
        let (api, hand) = Api::at(topology, text.into(), settings, at(time)).await;
        Self { api, hand, dialect }
    }

    /// Lets it be this time of the day.
    pub(crate) async fn wait_until(&self, time: &str) {
        self.hand.set(at(time));
        self.api.settled().await;
    }

    /// Asks for a delivery, by a drone of its own where none is named.
    pub(crate) async fn deliver(&self, mut body: Value) -> Result<wire::Plan<'static>, Refused> {
        if body.get("drone_id").is_none() {
            let plan = body["id"].as_str().unwrap_or("unnamed");
            body["drone_id"] = json!(format!("drone-{plan}"));
        }
        self.ask_for(body).await
    }

    /// Asks for a plan, or a quote where no drone is named.
    pub(crate) async fn ask_for(&self, body: Value) -> Result<wire::Plan<'static>, Refused> {
        match self.dialect {
            Dialect::Rest => {
                let told = self.api.post("/v1/plans", &body).await;
                match told.status {
                    201 => Ok(serde_json::from_str(&told.body).expect("a plan")),
                    _ => Err(refused(&told.json())),
                }
            }
            Dialect::Grpc => {
                let request: wire::DeliveryRequest =
                    serde_json::from_value(body).expect("a delivery request");
                let stamp = |text: &Option<String>| text.as_deref().and_then(instant);
                let stops = request.stops.unwrap_or_default().into_iter();
                let stops = stops.map(|stop| proto::ServiceStop {
                    node: stop.node.text().to_owned(),
                    service_s: stop.service_s,
                });
                let message = proto::CreatePlanRequest {
                    source: request.source.text().to_owned(),
                    destination: request.destination.as_ref().map(|id| id.text().to_owned()),
                    start_time: stamp(&request.start_time),
                    deadline: stamp(&request.deadline),
                    priority: None,
                    stops: stops.collect(),
                    id: request.id,
                    payload_kg: request.payload_kg,
                    drone_id: request.drone_id,
                    airspeed_mps: request.airspeed_mps,
                    airframe: request.airframe,
                    battery_fraction: request.battery_fraction,
                    objective: request.objective,
                    idempotency_key: None,
                    delivery_id: request.delivery_id,
                };
                let plan = self
                    .call::<proto::Plan>("Plans/CreatePlan", &message)
                    .await?;
                Ok(wire::Plan::from_proto(plan).expect("a plan"))
            }
        }
    }

    /// Tells a plan.
    pub(crate) async fn plan(&self, id: &str) -> wire::Plan<'static> {
        // Versions are proposed without anybody waiting for it.
        self.api.settled().await;
        match self.dialect {
            Dialect::Rest => {
                let told = self.api.get(&format!("/v1/plans/{id}")).await.is(200);
                serde_json::from_str(&told.body).expect("a plan")
            }
            Dialect::Grpc => {
                let message = proto::GetPlanRequest { id: id.to_owned() };
                let plan = self.call::<proto::Plan>("Plans/GetPlan", &message).await;
                wire::Plan::from_proto(plan.expect("a plan")).expect("a plan")
            }
        }
    }

    /// Reports a failure.
    pub(crate) async fn report(&self, body: Value) -> wire::Recomposition<'static> {
        match self.dialect {
            Dialect::Rest => {
                let told = self.api.post("/v1/failures", &body).await.is(200);
                serde_json::from_str(&told.body).expect("a recomposition")
            }
            Dialect::Grpc => {
                let report: wire::FailureReport = serde_json::from_value(body).expect("a report");
                let message: proto::FailureReport = report.into_proto();
                let answer = self
                    .call::<proto::RecompositionAnswer>("Recomposition/ReportFailure", &message)
                    .await
                    .expect("an answer");
                wire::Recomposition::from_proto(answer).expect("a recomposition")
            }
        }
    }

    /// Tells where a drone is.
    pub(crate) async fn see(&self, entry: Value) -> wire::Position<'static> {
        let answer = match self.dialect {
            Dialect::Rest => {
                let body = json!({"positions": [entry]});
                let told = self.api.post("/v1/telemetry", &body).await.is(200);
                serde_json::from_str(&told.body).expect("an answer")
            }
            Dialect::Grpc => {
                let entry: wire::TelemetryEntry = serde_json::from_value(entry).expect("an entry");
                let entry = proto::TelemetryEntry {
                    drone_id: entry.drone_id,
                    location: Some(entry.location.into_proto()),
                    timestamp: entry.timestamp.as_deref().and_then(instant),
                    altitude_m: entry.altitude_m,
                    battery_fraction: entry.battery_fraction,
                    ground_speed_mps: entry.ground_speed_mps,
                    heading_deg: entry.heading_deg,
                    altitude_reference: entry.altitude_reference,
                    airborne: entry.airborne,
                    leg: entry.leg,
                    fraction: entry.fraction,
                };
                let message = proto::ReportTelemetryRequest {
                    positions: vec![entry],
                };
                let answer = self
                    .call::<proto::ReportTelemetryResponse>("Drones/ReportTelemetry", &message)
                    .await;
                let answer = answer.expect("an answer");
                wire::TelemetryAnswer::from_proto(answer).expect("an answer")
            }
        };
        // It is answered without waiting for what the writer makes of it.
        self.api.settled().await;
        let wire::TelemetryAnswer { mut positions, .. } = answer;
        positions.pop().expect("a position")
    }

    /// Puts the weather, as operators do.
    pub(crate) async fn put_weather(
        &self,
        weather: Value,
        etag: Option<&str>,
    ) -> Result<wire::WeatherAnswer<'static>, Refused> {
        let if_match = etag.map(|etag| ("if-match", etag));
        let headers: Vec<(&str, &str)> = if_match.into_iter().collect();
        let told = self
            .api
            .ask("PUT /v1/weather", &headers, &weather.to_string())
            .await;
        match told.status {
            200 => Ok(serde_json::from_str(&told.body).expect("weather")),
            _ => Err(refused(&told.json())),
        }
    }

    /// Calls a method of a service; unary calls need nothing of a client but HTTP/2.
    pub(crate) async fn call<A: Message + Default>(
        &self,
        method: &str,
        message: &impl Message,
    ) -> Result<A, Refused> {
        let bytes = message.encode_to_vec();
        let length = u32::try_from(bytes.len()).expect("a short message");
        let mut frame = vec![0];
        frame.extend(length.to_be_bytes());
        frame.extend(bytes);
        let url = format!("{}/skyway.v1.{method}", self.api.url());
        let client = reqwest::Client::builder()
            .no_proxy()
            .http2_prior_knowledge()
            .build()
            .expect("a client");
        let request = client.post(url).header("content-type", "application/grpc");
        let sent = request.header("te", "trailers").body(frame);
        let answer = sent.timeout(WAIT_AT_MOST).send().await.expect("an answer");
        if let Some(status) = tonic::Status::from_header_map(answer.headers())
            && status.code() != tonic::Code::Ok
        {
            let refusal = skyway::api::problem::of_grpc_status(&status).expect("a refusal");
            let faults = refusal.faults.into_iter();
            return Err((
                skyway::api::problem::row(refusal.code).name.to_owned(),
                faults.map(|fault| (fault.pointer, fault.hint)).collect(),
            ));
        }
        let body = answer.bytes().await.expect("a body");
        Ok(A::decode(&body[5..]).expect("a message"))
    }

    /// All that is kept of an answer, with the certificate of its plan.
    pub(crate) async fn record(&self, id: &str) -> Value {
        let path = format!("/v1/recompositions/{id}?certificate=true");
        self.api.get(&path).await.is(200).json()
    }

    /// Checks an answer: it can be computed again from its record alone, and an independent checker flies its plan.
    pub(crate) async fn check(&self, answer: &wire::Recomposition<'_>) {
        let mut record = self.record(&answer.id).await;
        let certificate = record["certificate"].take();
        let record: wire::Record<'static> = serde_json::from_value(record).expect("a record");
        let topology = self.api.edge.topology();
        let (airspace, read) = recorded_question(&record, &topology).expect("a question");
        let question = record.world.flight.as_ref().expect("what it was flown in");
        let question = read_flight_question(question, &airspace).expect("it can be read");
        let again = question.answer(&read.request);
        let outcome: wire::Outcome = again.outcome.into_term();
        assert_eq!(outcome, answer.answer.outcome, "computed again");
        let plan = again.composition.as_ref();
        let length_m = plan.map(|plan| plan.plan.distance_m);
        assert_eq!(length_m, answer.answer.remaining_length_m, "computed again");
        if length_m.is_none() {
            assert!(certificate.is_null(), "{certificate}");
            return;
        }
        let document = read_flight_document(&certificate.to_string(), &topology);
        let document = document.expect("a certificate");
        let checked = verify_flight(&document.plan, &document.premises(&topology));
        checked.expect("it can be flown");
    }
}

fn instant(text: &str) -> Option<proto::Timestamp> {
    let instant: Timestamp = text.parse().ok()?;
    Some(proto::Timestamp {
        seconds: instant.as_second(),
        nanos: instant.subsec_nanosecond(),
    })
}

pub(crate) fn refused(problem: &Value) -> Refused {
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let errors = problem["errors"].as_array().cloned().unwrap_or_default();
    let errors = errors.iter().map(|error| {
        let pointer = text(&error["pointer"]).unwrap_or_default();
        (pointer, text(&error["hint"]))
    });
    (text(&problem["code"]).unwrap_or_default(), errors.collect())
}
