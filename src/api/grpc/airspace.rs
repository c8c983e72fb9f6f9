//! The service `Airspace`: zones and closures, what waits for an operator, and events.

use super::convert::{FromProto, IntoProto, instant_text};
use super::convert_zone::{feature_of, zone_of};
use super::proto::{self, airspace_server};
use super::requests::{idempotency, invalid, opened, page, told};
use crate::edge::{Code, Decision, Edge, Refusal, ZoneWrite};
use crate::wire;
use serde_json::Value;
use std::pin::Pin;
use std::sync::Arc;
use tokio_stream::{Stream, StreamExt};
use tonic::{Request, Response, Status};

/// Keeps the airspace.
#[derive(Debug)]
pub(super) struct Service {
    edge: Arc<Edge>,
}

impl Service {
    pub(super) fn new(edge: Arc<Edge>) -> Self {
        Self { edge }
    }

    /// An answer with the world it is of.
    fn closure(
        &self,
        closure: Result<wire::Closure<'static>, Refusal>,
    ) -> Result<Response<proto::ClosureAnswer>, Status> {
        let closure = told(closure)?;
        Ok(Response::new(proto::ClosureAnswer {
            closure: Some(closure.into_proto()),
            stamp: Some(self.edge.stamp().into_proto()),
        }))
    }
}

#[tonic::async_trait]
impl airspace_server::Airspace for Service {
    async fn create_zone(
        &self,
        request: Request<proto::CreateZoneRequest>,
    ) -> Result<Response<proto::ZoneAck>, Status> {
        let (caller, message) = opened(request)?;
        let idempotency = idempotency(message.idempotency_key.clone(), &message);
        let feature = told(feature(message.zone.as_ref()))?;
        let write = ZoneWrite {
            id: None,
            if_match: None,
            validate_only: message.validate_only,
        };
        let ack = self.edge.create_zone(&caller, feature, write, idempotency);
        Ok(Response::new(told(ack.await)?.into_proto()))
    }

    async fn put_zone(
        &self,
        request: Request<proto::PutZoneRequest>,
    ) -> Result<Response<proto::PutZoneResponse>, Status> {
        let (caller, message) = opened(request)?;
        let feature = told(feature(message.zone.as_ref()))?;
        let write = ZoneWrite {
            id: Some(message.id),
            if_match: message.etag,
            validate_only: message.validate_only,
        };
        let (ack, created) = told(self.edge.put_zone(&caller, feature, write).await)?;
        let ack = Some(ack.into_proto());
        Ok(Response::new(proto::PutZoneResponse { ack, created }))
    }

    async fn get_zone(
        &self,
        request: Request<proto::GetZoneRequest>,
    ) -> Result<Response<proto::ZoneAnswer>, Status> {
        let (caller, message) = opened(request)?;
        let (feature, etag) = told(self.edge.zone(&caller, &message.id))?;
        Ok(Response::new(proto::ZoneAnswer {
            zone: Some(zone_of(&feature)),
            etag,
            stamp: Some(self.edge.stamp().into_proto()),
        }))
    }

    async fn delete_zone(
        &self,
        request: Request<proto::DeleteZoneRequest>,
    ) -> Result<Response<proto::ZoneAck>, Status> {
        let (caller, message) = opened(request)?;
        let write = ZoneWrite {
            id: Some(message.id),
            if_match: message.etag,
            validate_only: message.validate_only,
        };
        let ack = told(self.edge.delete_zone(&caller, write, message.reason).await)?;
        Ok(Response::new(ack.into_proto()))
    }

    async fn list_zones(
        &self,
        request: Request<proto::ListZonesRequest>,
    ) -> Result<Response<proto::ListZonesResponse>, Status> {
        let (caller, message) = opened(request)?;
        let page = page(message.page_size, message.page_token);
        let listed = told(self.edge.zones(&caller, &page))?;
        Ok(Response::new(listed.into_proto()))
    }

    async fn preview_zone(
        &self,
        request: Request<proto::PreviewZoneRequest>,
    ) -> Result<Response<proto::ZoneAck>, Status> {
        let (caller, message) = opened(request)?;
        let feature = told(feature(message.zone.as_ref()))?;
        let ack = told(self.edge.preview_zone(&caller, feature).await)?;
        Ok(Response::new(ack.into_proto()))
    }

    async fn list_closures(
        &self,
        request: Request<proto::ListClosuresRequest>,
    ) -> Result<Response<proto::ListClosuresResponse>, Status> {
        let (caller, message) = opened(request)?;
        let page = page(message.page_size, message.page_token);
        let listed = told(self.edge.closures(&caller, &page))?;
        Ok(Response::new(listed.into_proto()))
    }

    async fn get_closure(
        &self,
        request: Request<proto::GetClosureRequest>,
    ) -> Result<Response<proto::ClosureAnswer>, Status> {
        let (caller, message) = opened(request)?;
        self.closure(self.edge.closure(&caller, &message.id))
    }

    async fn create_closure(
        &self,
        request: Request<proto::CreateClosureRequest>,
    ) -> Result<Response<proto::ClosureAnswer>, Status> {
        let (caller, message) = opened(request)?;
        let idempotency = idempotency(message.idempotency_key.clone(), &message);
        let draft = closure_draft(message);
        self.closure(self.edge.close(&caller, draft, idempotency).await)
    }

    async fn change_closure(
        &self,
        request: Request<proto::ChangeClosureRequest>,
    ) -> Result<Response<proto::ClosureAnswer>, Status> {
        let (caller, message) = opened(request)?;
        let change = closure_change(&message);
        let changed = self
            .edge
            .change_closure(&caller, &message.id, change, message.etag);
        self.closure(changed.await)
    }

    async fn delete_closure(
        &self,
        request: Request<proto::DeleteClosureRequest>,
    ) -> Result<Response<proto::ClosureAnswer>, Status> {
        let (caller, message) = opened(request)?;
        let (etag, reason) = (message.etag, message.reason);
        let lifted = self.edge.lift_closure(&caller, &message.id, etag, reason);
        self.closure(lifted.await)
    }

    async fn list_proposals(
        &self,
        request: Request<proto::ListProposalsRequest>,
    ) -> Result<Response<proto::ListProposalsResponse>, Status> {
        let (caller, message) = opened(request)?;
        let page = page(message.page_size, message.page_token);
        let listed = told(self.edge.proposals(&caller, &page))?;
        Ok(Response::new(listed.into_proto()))
    }

    async fn decide_proposal(
        &self,
        request: Request<proto::DecideProposalRequest>,
    ) -> Result<Response<proto::ProposalAnswer>, Status> {
        let (caller, message) = opened(request)?;
        let decision = told(decision(message.decision))?;
        let decided = self.edge.decide_proposal(&caller, &message.id, decision);
        let proposal = told(decided.await)?;
        Ok(Response::new(proto::ProposalAnswer {
            proposal: Some(proposal.into_proto()),
            stamp: Some(self.edge.stamp().into_proto()),
        }))
    }

    async fn list_holds(
        &self,
        request: Request<proto::ListHoldsRequest>,
    ) -> Result<Response<proto::ListHoldsResponse>, Status> {
        let (caller, message) = opened(request)?;
        let page = page(message.page_size, message.page_token);
        let listed = told(self.edge.holds(&caller, &page))?;
        Ok(Response::new(listed.into_proto()))
    }

    async fn decide_hold(
        &self,
        request: Request<proto::DecideHoldRequest>,
    ) -> Result<Response<proto::HoldAnswer>, Status> {
        let (caller, message) = opened(request)?;
        let decision = told(decision(message.decision))?;
        let decided = self.edge.decide_hold(&caller, &message.id, decision);
        let hold = told(decided.await)?;
        Ok(Response::new(proto::HoldAnswer {
            hold: Some(hold.into_proto()),
            stamp: Some(self.edge.stamp().into_proto()),
        }))
    }

    async fn confirm_clock(
        &self,
        request: Request<proto::ConfirmClockRequest>,
    ) -> Result<Response<proto::ConfirmClockResponse>, Status> {
        let (caller, _) = opened(request)?;
        let state = told(self.edge.confirm_clock(&caller).await)?;
        Ok(Response::new(state.into_proto()))
    }

    async fn get_weather(
        &self,
        request: Request<proto::GetWeatherRequest>,
    ) -> Result<Response<proto::WeatherAnswer>, Status> {
        let (caller, _) = opened(request)?;
        Ok(Response::new(self.edge.weather(&caller).into_proto()))
    }

    async fn put_weather(
        &self,
        request: Request<proto::PutWeatherRequest>,
    ) -> Result<Response<proto::WeatherAnswer>, Status> {
        let (caller, message) = opened(request)?;
        told(check_stated(&message))?;
        let etag = message.etag;
        let weather = told(weather(message.wind))?;
        let answer = self.edge.put_weather(&caller, weather, etag).await;
        Ok(Response::new(told(answer)?.into_proto()))
    }

    type WatchEventsStream = Pin<Box<dyn Stream<Item = Result<proto::Event, Status>> + Send>>;

    async fn watch_events(
        &self,
        request: Request<proto::WatchEventsRequest>,
    ) -> Result<Response<Self::WatchEventsStream>, Status> {
        let (_, message) = opened(request)?;
        let events = told(self.edge.events(message.after.as_deref()))?;
        let messages = events.map(|event| Ok(told(event)?.event.clone().into_proto()));
        Ok(Response::new(Box::pin(messages)))
    }
}

fn feature(zone: Option<&proto::Zone>) -> Result<Value, Refusal> {
    let missing = || invalid("missing_field", "", "'zone' is missing".to_owned());
    zone.map(feature_of).ok_or_else(missing)
}

/// The weather of a message; the edge checks it as that of REST.
fn weather(wind: Vec<proto::Wind>) -> Result<wire::Weather, Refusal> {
    let read = |(place, wind)| {
        wire::Wind::from_proto(wind).map_err(|error| {
            let pointer = format!("/wind/{place}");
            invalid("wrong_type", &pointer, error.to_string())
        })
    };
    let wind: Result<Vec<wire::Wind>, Refusal> = wind.into_iter().enumerate().map(read).collect();
    Ok(wire::Weather { wind: wind? })
}

fn decision(number: i32) -> Result<Decision, Refusal> {
    match proto::Decision::try_from(number) {
        Ok(proto::Decision::Accept) => Ok(Decision::Accept),
        Ok(proto::Decision::Reject) => Ok(Decision::Reject),
        Ok(proto::Decision::Unspecified) | Err(_) => {
            let message = format!("{number} is no decision; accept is 1 and reject is 2");
            Err(invalid("unknown_value", "/decision", message))
        }
    }
}

/// The closure of a message; the edge checks it as that of REST.
pub(super) fn closure_draft(message: proto::CreateClosureRequest) -> wire::ClosureDraft {
    let node_ids = |nodes: Vec<String>| nodes.into_iter().map(wire::Id::new).collect();
    wire::ClosureDraft {
        id: message.id,
        reason: message.reason,
        segments: message.segments,
        nodes: node_ids(message.nodes),
        pads: node_ids(message.pads),
        from: message.from.as_ref().map(instant_text),
        until: message.until.as_ref().map(instant_text),
    }
}

/// What a message changes of a closure.
pub(super) fn closure_change(message: &proto::ChangeClosureRequest) -> wire::ClosureChange {
    wire::ClosureChange {
        confirmed: message.confirmed,
        until: message.until.as_ref().map(instant_text),
    }
}

/// As REST refuses a body without `wind`; here nobody could tell it from an empty one.
fn check_stated(message: &proto::PutWeatherRequest) -> Result<(), Refusal> {
    if message.clear || !message.wind.is_empty() {
        return Ok(());
    }
    let fault = wire::Fault {
        code: "missing_field".to_owned(),
        pointer: "/wind".to_owned(),
        message: "the field 'wind' is missing".to_owned(),
        hint: Some("state a wind, or set 'clear' where nothing is known of it any more".to_owned()),
    };
    Err(Refusal::at(Code::BodyInvalid, fault))
}
