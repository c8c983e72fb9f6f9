//! What is said of a plan: taken over, declined, completed in either dialect; released and cancelled over REST.

use crate::town::{Dialect, Refused, Town, refused};
use prost::Message;
use serde_json::{Value, json};
use skyway::api::grpc::{FromProto, IntoProto, proto};
use skyway::wire;

/// What is said of a plan: an answer, or why it is refused.
pub(crate) type Said = Result<wire::Plan<'static>, Refused>;

/// A body without its idempotency key, which is a header of REST and a field of gRPC.
fn keyed(mut body: Value) -> (Value, Option<String>) {
    let fields = body.as_object_mut().expect("an object");
    let key = fields.remove("idempotency_key");
    let key = key.and_then(|key| key.as_str().map(str::to_owned));
    (body, key)
}

impl Town {
    pub(crate) async fn acknowledge(&self, id: &str, body: Value) -> Said {
        let (body, idempotency_key) = keyed(body);
        let ack: wire::Ack = read(&body);
        let message = proto::AcknowledgePlanRequest {
            id: id.to_owned(),
            version: ack.version,
            location: ack.location.map(IntoProto::into_proto),
            leg: ack.leg,
            fraction: ack.fraction,
            idempotency_key: idempotency_key.clone(),
        };
        let line = format!("POST /v1/plans/{id}/ack");
        self.say((&line, body, idempotency_key), "AcknowledgePlan", &message)
            .await
    }

    pub(crate) async fn decline(&self, id: &str, body: Value) -> Said {
        let (body, idempotency_key) = keyed(body);
        let decline: wire::Decline = read(&body);
        let message = proto::DeclinePlanRequest {
            id: id.to_owned(),
            version: decline.version,
            reason: decline.reason,
            location: decline.location.map(IntoProto::into_proto),
            leg: decline.leg,
            fraction: decline.fraction,
            idempotency_key: idempotency_key.clone(),
        };
        let line = format!("POST /v1/plans/{id}/decline");
        self.say((&line, body, idempotency_key), "DeclinePlan", &message)
            .await
    }

    pub(crate) async fn complete(&self, id: &str, body: Value) -> Said {
        let (body, idempotency_key) = keyed(body);
        let completion: wire::Completion = read(&body);
        let message = proto::CompletePlanRequest {
            id: id.to_owned(),
            location: completion.location.map(IntoProto::into_proto),
            leg: completion.leg,
            fraction: completion.fraction,
            idempotency_key: idempotency_key.clone(),
        };
        let line = format!("POST /v1/plans/{id}/complete");
        self.say((&line, body, idempotency_key), "CompletePlan", &message)
            .await
    }

    pub(crate) async fn release(&self, id: &str, ended_as: &str) -> Said {
        let body = json!({"ended_as": ended_as}).to_string();
        let line = format!("POST /v1/plans/{id}/release");
        self.say_over_rest(&line, &body, None).await
    }

    /// Cancels a plan; `place` is its query.
    pub(crate) async fn cancel(&self, id: &str, place: Value) -> Said {
        let (place, key) = keyed(place);
        let query: Vec<String> = place
            .as_object()
            .expect("an object")
            .iter()
            .map(|(name, value)| format!("{name}={value}"))
            .collect();
        let line = format!("DELETE /v1/plans/{id}?{}", query.join("&"));
        self.say_over_rest(&line, "", key.as_deref()).await
    }

    async fn say_over_rest(&self, line: &str, body: &str, key: Option<&str>) -> Said {
        let key = key.map(|key| ("idempotency-key", key));
        let headers: Vec<(&str, &str)> = key.into_iter().collect();
        let told = self.api.ask(line, &headers, body).await;
        self.api.settled().await;
        match told.status {
            200 => Ok(serde_json::from_str(&told.body).expect("a plan")),
            _ => Err(refused(&told.json())),
        }
    }

    async fn say(
        &self,
        (line, body, key): (&str, Value, Option<String>),
        method: &str,
        message: &impl Message,
    ) -> Said {
        if self.dialect == Dialect::Rest {
            return self
                .say_over_rest(line, &body.to_string(), key.as_deref())
                .await;
        }
        let method = format!("Plans/{method}");
        let plan = self.call::<proto::Plan>(&method, message).await;
        self.api.settled().await;
        plan.map(|plan| wire::Plan::from_proto(plan).expect("a plan"))
    }

    /// The open alarms of a kind, by the plans that they are about.
    pub(crate) async fn alarmed(&self, kind: &str) -> Vec<String> {
        let told = self.api.get("/v1/alarms?ended=false").await.is(200).json();
        let alarms = told["alarms"].as_array().cloned().unwrap_or_default();
        let of_kind = alarms.iter().filter(|alarm| alarm["kind"] == kind);
        of_kind
            .map(|alarm| alarm["plan_id"].as_str().unwrap_or_default().to_owned())
            .collect()
    }

    /// Puts a circle into force.
    pub(crate) async fn close(&self, id: &str, center: [f64; 2], radius_m: f64) {
        let zone = json!({
            "type": "Feature",
            "id": id,
            "geometry": {"type": "Point", "coordinates": center},
            "properties": {"radius_m": radius_m},
        });
        self.api.post("/v1/zones", &zone).await.is(201);
        self.api.settled().await;
    }
}

fn read<T: serde::de::DeserializeOwned>(body: &Value) -> T {
    serde_json::from_value(body.clone()).expect("what is said")
}
