//! The service `Plans`: delivery requests and the plans composed for them.

use super::convert::{FromProto, IntoProto, NodeIds, instant_text};
use super::proto::{self, plans_server};
use super::requests::{finite, idempotency, invalid, opened, page, told};
use crate::edge::{Edge, PlanFilter, Refusal};
use crate::wire;
use std::sync::Arc;
use tonic::{Request, Response, Status};

/// Composes plans, and keeps them.
#[derive(Debug)]
pub(super) struct Service {
    edge: Arc<Edge>,
}

impl Service {
    pub(super) fn new(edge: Arc<Edge>) -> Self {
        Self { edge }
    }

    /// As the network in service has them.
    fn node_ids(&self) -> NodeIds {
        NodeIds::of(&self.edge.topology())
    }
}

#[tonic::async_trait]
impl plans_server::Plans for Service {
    async fn create_plan(
        &self,
        request: Request<proto::CreatePlanRequest>,
    ) -> Result<Response<proto::Plan>, Status> {
        let (caller, message) = opened(request)?;
        let idempotency = idempotency(message.idempotency_key.clone(), &message);
        let delivery = told(delivery_request(message, self.node_ids()))?;
        let composed = self.edge.compose_plan(&caller, delivery, idempotency).await;
        answer(composed)
    }

    async fn list_plans(
        &self,
        request: Request<proto::ListPlansRequest>,
    ) -> Result<Response<proto::ListPlansResponse>, Status> {
        let (caller, message) = opened(request)?;
        let page = page(message.page_size, message.page_token);
        let filter = PlanFilter {
            affected_by: message.affected_by,
            drone_id: message.drone_id,
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

    async fn cancel_plan(
        &self,
        request: Request<proto::CancelPlanRequest>,
    ) -> Result<Response<proto::Plan>, Status> {
        let (caller, message) = opened(request)?;
        answer(self.edge.cancel_plan(&caller, &message.id).await)
    }

    async fn acknowledge_plan(
        &self,
        request: Request<proto::AcknowledgePlanRequest>,
    ) -> Result<Response<proto::Plan>, Status> {
        let (caller, message) = opened(request)?;
        let id = message.id.clone();
        let ack = told(acknowledgement(message, self.node_ids()))?;
        answer(self.edge.acknowledge_plan(&caller, &id, ack).await)
    }
}

fn answer(plan: Result<wire::Plan<'static>, Refusal>) -> Result<Response<proto::Plan>, Status> {
    Ok(Response::new(told(plan)?.into_proto()))
}

/// The delivery request of a message; the edge checks it as that of REST.
pub(super) fn delivery_request(
    message: proto::CreatePlanRequest,
    ids: NodeIds,
) -> Result<wire::DeliveryRequest, Refusal> {
    Ok(wire::DeliveryRequest {
        id: message.id,
        source: ids.read(message.source),
        destination: ids.read(message.destination),
        start_time: message.start_time.as_ref().map(instant_text),
        payload_kg: finite(message.payload_kg, "/payload_kg")?,
        drone_id: message.drone_id,
        airspeed_mps: finite(message.airspeed_mps, "/airspeed_mps")?,
        airframe: message.airframe,
        battery_fraction: finite(message.battery_fraction, "/battery_fraction")?,
        objective: message.objective,
        deadline: message.deadline.as_ref().map(instant_text),
    })
}

/// The acknowledgement of a message.
pub(super) fn acknowledgement(
    message: proto::AcknowledgePlanRequest,
    ids: NodeIds,
) -> Result<wire::Ack, Refusal> {
    let unreadable = |message: String| invalid("wrong_type", "/location", message);
    let location = message
        .location
        .map(|place| wire::Place::from_proto(place, ids));
    let location = location
        .transpose()
        .map_err(|error| unreadable(error.to_string()))?;
    if let Some(wire::Place::Pair([x, y]) | wire::Place::Planar { x, y }) = &location {
        finite(Some(*x), "/location")?;
        finite(Some(*y), "/location")?;
    }
    Ok(wire::Ack {
        version: message.version,
        location,
    })
}
