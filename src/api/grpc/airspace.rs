//! The service `Airspace`: events.

use super::Service;
use super::convert::IntoProto;
use super::proto::{self, airspace_server};
use super::requests::{opened, told};
use std::pin::Pin;
use tokio_stream::{Stream, StreamExt};
use tonic::{Request, Response, Status};

#[tonic::async_trait]
impl airspace_server::Airspace for Service {
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
