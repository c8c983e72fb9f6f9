//! The service `Clock`: the time, and a simulator that moves it.

use super::Service;
use super::convert::{IntoProto, instant_text};
use super::proto::{self, clock_server};
use super::requests::{invalid, opened, told};
use crate::edge::Refusal;
use crate::wire;
use tonic::{Request, Response, Status};

#[tonic::async_trait]
impl clock_server::Clock for Service {
    async fn get_clock(
        &self,
        request: Request<proto::GetClockRequest>,
    ) -> Result<Response<proto::GetClockResponse>, Status> {
        let (caller, _) = opened(request)?;
        Ok(Response::new(self.edge.clock_reading(&caller).into_proto()))
    }

    async fn advance_to(
        &self,
        request: Request<proto::AdvanceToRequest>,
    ) -> Result<Response<proto::AdvanceToResponse>, Status> {
        let (caller, message) = opened(request)?;
        let advance = told(advance(&message))?;
        let answer = told(self.edge.advance_clock(&caller, &advance).await)?;
        Ok(Response::new(answer.into_proto()))
    }
}

/// How far the clock is to be moved.
pub(super) fn advance(message: &proto::AdvanceToRequest) -> Result<wire::ClockAdvance, Refusal> {
    let missing = || invalid("missing", "/to", "the field 'to' is missing".to_owned());
    let to = message.to.as_ref().ok_or_else(missing)?;
    Ok(wire::ClockAdvance {
        to: instant_text(to),
    })
}
