//! The service `Plans`: delivery requests and the plans composed for them.

use super::Service;
use super::convert::{FromProto, IntoProto, instant_text};
use super::proto::{self, plans_server};
use super::requests::{finite, idempotency, invalid, opened, told};
use crate::access::Caller;
use crate::edge::{Edge, PageRequest, PlanFilter, PlanWord, Refusal};
use crate::wire;
use std::sync::Arc;
use tonic::{Request, Response, Status};

#[tonic::async_trait]
impl plans_server::Plans for Service {
    async fn create_plan(
        &self,
        request: Request<proto::CreatePlanRequest>,
    ) -> Result<Response<proto::Plan>, Status> {
        let (caller, message) = opened(request)?;
        let idempotency = idempotency(message.idempotency_key.clone(), &message);
        let delivery = told(delivery_request(message))?;
        let composed = self.edge.compose_plan(&caller, delivery, idempotency).await;
        answer(composed)
    }

    async fn list_plans(
        &self,
        request: Request<proto::ListPlansRequest>,
    ) -> Result<Response<proto::ListPlansResponse>, Status> {
        let (caller, message) = opened(request)?;
        let page = PageRequest {
            size: message.page_size,
            token: message.page_token,
        };
        let filter = PlanFilter {
            affected_by: message.affected_by,
            drone_id: message.drone_id,
            state: None,
            ended: message.ended,
        };
        let listed = told(self.edge.plans(&caller, &page, &filter))?;
        Ok(Response::new(listed.into_proto()))
    }

    async fn get_plan(
        &self,
        request: Request<proto::GetPlanRequest>,
    ) -> Result<Response<proto::Plan>, Status> {
        let (caller, message) = opened(request)?;
        answer(self.edge.plan(&caller, &message.id))
    }

    async fn acknowledge_plan(
        &self,
        request: Request<proto::AcknowledgePlanRequest>,
    ) -> Result<Response<proto::Plan>, Status> {
        let (caller, message) = opened(request)?;
        answer(acknowledge(&self.edge, &caller, message).await)
    }

    async fn decline_plan(
        &self,
        request: Request<proto::DeclinePlanRequest>,
    ) -> Result<Response<proto::Plan>, Status> {
        let (caller, message) = opened(request)?;
        answer(decline(&self.edge, &caller, message).await)
    }

    async fn complete_plan(
        &self,
        request: Request<proto::CompletePlanRequest>,
    ) -> Result<Response<proto::Plan>, Status> {
        let (caller, message) = opened(request)?;
        answer(complete(&self.edge, &caller, message).await)
    }
}

/// A drone takes a version over.
pub(super) async fn acknowledge(
    edge: &Arc<Edge>,
    caller: &Caller,
    message: proto::AcknowledgePlanRequest,
) -> Result<wire::Plan<'static>, Refusal> {
    let key = idempotency(message.idempotency_key.clone(), &message);
    let id = message.id.clone();
    let word = PlanWord::Acknowledge(acknowledgement(message)?);
    edge.say_of_plan(caller, &id, word, key).await
}

/// A drone does not take a version over.
pub(super) async fn decline(
    edge: &Arc<Edge>,
    caller: &Caller,
    message: proto::DeclinePlanRequest,
) -> Result<wire::Plan<'static>, Refusal> {
    let key = idempotency(message.idempotency_key.clone(), &message);
    let word = PlanWord::Decline(wire::Decline {
        version: version(message.version)?,
        reason: message.reason,
        location: place(message.location)?,
        leg: message.leg,
        fraction: share(message.fraction)?,
    });
    edge.say_of_plan(caller, &message.id, word, key).await
}

/// A drone has landed.
pub(super) async fn complete(
    edge: &Arc<Edge>,
    caller: &Caller,
    message: proto::CompletePlanRequest,
) -> Result<wire::Plan<'static>, Refusal> {
    let key = idempotency(message.idempotency_key.clone(), &message);
    let word = PlanWord::Complete(wire::Completion {
        location: place(message.location)?,
        leg: message.leg,
        fraction: share(message.fraction)?,
    });
    edge.say_of_plan(caller, &message.id, word, key).await
}

fn answer(plan: Result<wire::Plan<'static>, Refusal>) -> Result<Response<proto::Plan>, Status> {
    Ok(Response::new(told(plan)?.into_proto()))
}

/// The delivery request of a message; the edge checks it as that of REST.
pub(super) fn delivery_request(
    message: proto::CreatePlanRequest,
) -> Result<wire::DeliveryRequest, Refusal> {
    Ok(wire::DeliveryRequest {
        id: message.id,
        source: wire::Id::new(message.source),
        destination: message.destination.map(wire::Id::new),
        stops: service_stops(message.stops)?,
        start_time: message.start_time.as_ref().map(instant_text),
        payload_kg: finite(message.payload_kg, "/payload_kg")?,
        drone_id: message.drone_id,
        airspeed_mps: finite(message.airspeed_mps, "/airspeed_mps")?,
        airframe: message.airframe,
        battery_fraction: finite(message.battery_fraction, "/battery_fraction")?,
        objective: message.objective,
        deadline: message.deadline.as_ref().map(instant_text),
        priority: message.priority,
        delivery_id: message.delivery_id,
    })
}

/// Where a delivery is served on its way; none is as if nothing was said.
fn service_stops(
    stops: Vec<proto::ServiceStop>,
) -> Result<Option<Vec<wire::ServiceStop<'static>>>, Refusal> {
    let stops = stops.into_iter().enumerate().map(|(place, stop)| {
        let service_s = finite(Some(stop.service_s), &format!("/stops/{place}/service_s"))?;
        Ok(wire::ServiceStop {
            node: wire::Id::new(stop.node),
            service_s: service_s.unwrap_or_default(),
        })
    });
    let stops: Vec<_> = stops.collect::<Result<_, Refusal>>()?;
    Ok((!stops.is_empty()).then_some(stops))
}

/// The acknowledgement of a message.
pub(super) fn acknowledgement(
    message: proto::AcknowledgePlanRequest,
) -> Result<wire::Ack, Refusal> {
    Ok(wire::Ack {
        version: version(message.version)?,
        location: place(message.location)?,
        leg: message.leg,
        fraction: share(message.fraction)?,
    })
}

/// The version that a drone speaks of. They are counted from 1: 0 is what a message says that leaves it out.
fn version(number: u32) -> Result<u32, Refusal> {
    match number {
        0 => {
            let message = "the field 'version' is missing".to_owned();
            Err(invalid("missing_field", "/version", message))
        }
        _ => Ok(number),
    }
}

/// How far on a leg a drone says that it is: as REST has it, from 0 to 1.
fn share(fraction: Option<f64>) -> Result<Option<f64>, Refusal> {
    match fraction {
        Some(fraction) if !(0.0..=1.0).contains(&fraction) => {
            let message = format!("{fraction} is not between 0 and 1");
            Err(invalid("wrong_type", "/fraction", message))
        }
        _ => Ok(fraction),
    }
}

/// Where a drone says that it is.
fn place(message: Option<proto::Place>) -> Result<Option<wire::Place>, Refusal> {
    let unreadable = |message: String| invalid("wrong_type", "/location", message);
    let location = message.map(wire::Place::from_proto);
    let location = location
        .transpose()
        .map_err(|error| unreadable(error.to_string()))?;
    if let Some(wire::Place::Pair([x, y]) | wire::Place::Planar { x, y }) = &location {
        finite(Some(*x), "/location")?;
        finite(Some(*y), "/location")?;
    }
    Ok(location)
}
