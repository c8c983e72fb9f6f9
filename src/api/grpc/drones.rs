//! The service `Drones`: telemetry.

use super::Service;
use super::convert::IntoProto;
use super::convert_plan::telemetry_value;
use super::proto::{self, drones_server};
use super::requests::{opened, told};
use crate::wire;
use tonic::{Request, Response, Status};

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
}
