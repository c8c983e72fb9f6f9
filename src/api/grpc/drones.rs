//! The service `Drones`: telemetry, and drones on the line.

use super::Service;
use super::convert::IntoProto;
use super::convert_plan::telemetry_value;
use super::proto::{self, drones_server};
use super::requests::{opened, opened_with_id, told};
use super::session::Conversation;
use crate::wire;
use std::pin::Pin;
use tokio_stream::Stream;
use tonic::{Request, Response, Status, Streaming};

#[tonic::async_trait]
impl drones_server::Drones for Service {
    type SessionStream = Pin<Box<dyn Stream<Item = Result<proto::SessionResponse, Status>> + Send>>;

    async fn session(
        &self,
        request: Request<Streaming<proto::SessionRequest>>,
    ) -> Result<Response<Self::SessionStream>, Status> {
        let (caller, request_id, requests) = opened_with_id(request)?;
        let conversation = Conversation::begin(&self.edge, caller, request_id, requests);
        Ok(Response::new(Box::pin(conversation)))
    }

    async fn report_telemetry(
        &self,
        request: Request<proto::ReportTelemetryRequest>,
    ) -> Result<Response<proto::ReportTelemetryResponse>, Status> {
        let (caller, message) = opened(request)?;
        let answer = told(self.edge.telemetry(&caller, telemetry(message)).await)?;
        Ok(Response::new(answer.into_proto()))
    }
}

/// The positions of a message; the edge reads them one by one, as those of REST.
pub(super) fn telemetry(message: proto::ReportTelemetryRequest) -> wire::Telemetry {
    let positions = message.positions.into_iter().map(telemetry_value);
    wire::Telemetry {
        positions: positions.collect(),
    }
}
