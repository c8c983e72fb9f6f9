//! The service `Drones`: telemetry, and what is last known of each drone.

use super::convert::IntoProto;
use super::convert_plan::telemetry_value;
use super::proto::{self, drones_server};
use super::requests::{opened, page, told};
use crate::edge::Edge;
use crate::wire;
use std::sync::Arc;
use tonic::{Request, Response, Status};

/// Takes telemetry.
#[derive(Debug)]
pub(super) struct Service {
    edge: Arc<Edge>,
}

impl Service {
    pub(super) fn new(edge: Arc<Edge>) -> Self {
        Self { edge }
    }
}

#[tonic::async_trait]
impl drones_server::Drones for Service {
    async fn report_telemetry(
        &self,
        request: Request<proto::ReportTelemetryRequest>,
    ) -> Result<Response<proto::ReportTelemetryResponse>, Status> {
        let (caller, message) = opened(request)?;
        let value = |entry| telemetry_value(entry);
        let positions = message.positions.into_iter().map(value).collect();
        let telemetry = wire::Telemetry { positions };
        let answer = told(self.edge.telemetry(&caller, telemetry).await)?;
        Ok(Response::new(answer.into_proto()))
    }

    async fn list_drones(
        &self,
        request: Request<proto::ListDronesRequest>,
    ) -> Result<Response<proto::ListDronesResponse>, Status> {
        let (caller, message) = opened(request)?;
        let page = page(message.page_size, message.page_token);
        let listed = told(self.edge.drones(&caller, &page))?;
        Ok(Response::new(listed.into_proto()))
    }

    async fn get_clock(
        &self,
        request: Request<proto::GetClockRequest>,
    ) -> Result<Response<proto::GetClockResponse>, Status> {
        let (caller, _) = opened(request)?;
        Ok(Response::new(self.edge.clock_reading(&caller).into_proto()))
    }
}
