//! What is said of a plan, in either dialect: taken over, declined, completed, released, cancelled.

use crate::town::{Dialect, Refused, Town, refused};
use prost::Message;
use serde_json::{Value, json};
use skyway::api::grpc::{FromProto, IntoProto, proto};
use skyway::wire;

/// What is said of a plan: an answer, or why it is refused.
pub(crate) type Said = Result<wire::Plan<'static>, Refused>;

impl Town {
    pub(crate) async fn acknowledge(&self, id: &str, body: Value) -> Said {
        let ack: wire::Ack = read(&body);
        let message = proto::AcknowledgePlanRequest {
            id: id.to_owned(),
            version: ack.version,
            location: ack.location.map(IntoProto::into_proto),
            leg: ack.leg,
            fraction: ack.fraction,
            ..Default::default()
        };
        self.say((id, "ack", body), "AcknowledgePlan", &message)
            .await
    }

    pub(crate) async fn decline(&self, id: &str, body: Value) -> Said {
        let decline: wire::Decline = read(&body);
        let message = proto::DeclinePlanRequest {
            id: id.to_owned(),
            version: decline.version,
            reason: decline.reason,
            location: decline.location.map(IntoProto::into_proto),
            leg: decline.leg,
            fraction: decline.fraction,
            ..Default::default()
        };
        self.say((id, "decline", body), "DeclinePlan", &message)
            .await
    }

    pub(crate) async fn complete(&self, id: &str, body: Value) -> Said {
        let completion: wire::Completion = read(&body);
        let message = proto::CompletePlanRequest {
            id: id.to_owned(),
            location: completion.location.map(IntoProto::into_proto),
            leg: completion.leg,
            fraction: completion.fraction,
            ..Default::default()
        };
        self.say((id, "complete", body), "CompletePlan", &message)
            .await
    }

    pub(crate) async fn release(&self, id: &str, ended_as: &str) -> Said {
        let release: wire::Release = read(&json!({"ended_as": ended_as}));
        let ended_as = IntoProto::<i32>::into_proto(release.ended_as);
        let message = proto::ReleasePlanRequest {
            id: id.to_owned(),
            ended_as,
            ..Default::default()
        };
        let body = json!({"ended_as": release.ended_as});
        self.say((id, "release", body), "ReleasePlan", &message)
            .await
    }

    async fn say(
        &self,
        (id, verb, body): (&str, &str, Value),
        method: &str,
        message: &impl Message,
    ) -> Said {
        let said = match self.dialect {
            Dialect::Rest => {
                let told = self
                    .api
                    .post(&format!("/v1/plans/{id}/{verb}"), &body)
                    .await;
                match told.status {
                    200 => Ok(serde_json::from_str(&told.body).expect("a plan")),
                    _ => Err(refused(&told.json())),
                }
            }
            Dialect::Grpc => {
                let plan = self
                    .call::<proto::Plan>(&format!("Plans/{method}"), message)
                    .await;
                plan.map(|plan| wire::Plan::from_proto(plan, self.ids()).expect("a plan"))
            }
        };
        self.api.settled().await;
        said
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
