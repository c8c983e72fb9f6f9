//! A shop that orders by the script, and where it and the reader of the page are told what has arrived.

use super::map::Map;
use super::market::{Market, SHOP};
use super::script::ShopScript;
use crate::clock::Clock;
use axum::Router;
use axum::extract::{Path, State};
use axum::routing::post;
use http::StatusCode;
use jiff::Timestamp;
use serde::Deserialize;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use tokio::net::TcpListener;
use tokio::sync::mpsc::Sender;
use tokio_util::sync::CancellationToken;

/// A shop.
#[derive(Debug)]
pub(super) struct Shop {
    pub(super) script: ShopScript,
    pub(super) map: Arc<Map>,
    pub(super) market: Arc<Market>,
    pub(super) clock: Clock,
}

impl Shop {
    /// Orders until it is told to stop. What goes wrong is logged; the next order comes all the same.
    pub(super) async fn work(mut self, stop: CancellationToken) {
        let work = async {
            for number in 1_u64.. {
                self.order(number).await;
            }
        };
        tokio::select! {
            () = stop.cancelled() => {}
            () = work => {}
        }
    }

    async fn order(&mut self, number: u64) {
        let planned = self.script.order(&self.map);
        let due = self.clock.now().saturating_add(planned.wait);
        self.clock.sleep_until(due.unwrap_or(Timestamp::MAX)).await;
        let [from, to] = planned.ends.map(|node| self.map.id(node));
        let reference = format!("order {number}, {from} to {to}");
        match self.market.order(&self.map, &planned, &reference).await {
            Ok(Some(delivery)) => tracing::info!(delivery = delivery.id, "the shop has ordered"),
            Ok(None) => tracing::info!(reference, "nothing is offered to the shop"),
            Err(error) => tracing::info!(reference, %error, "the shop could not order"),
        }
    }
}

/// A message of a webhook, as far as it is told on.
#[derive(Debug, Deserialize)]
struct Notice {
    r#type: String,
    data: Arrival,
}

#[derive(Debug, Deserialize)]
struct Arrival {
    delivery_id: String,
}

/// What takes the messages of webhooks, on this machine alone.
#[derive(Debug)]
pub(super) struct Receiver {
    listener: TcpListener,
    address: SocketAddr,
}

impl Receiver {
    /// Takes a free port.
    pub(super) async fn open() -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await?;
        let address = listener.local_addr()?;
        Ok(Self { listener, address })
    }

    /// Where it is reached.
    pub(super) fn address(&self) -> SocketAddr {
        self.address
    }

    /// Tells on what has arrived, a line each, until it is told to stop.
    pub(super) async fn serve(self, lines: Sender<String>, stop: CancellationToken) {
        let router = Router::new()
            .route("/{tenant}", post(take))
            .with_state(lines);
        let served = axum::serve(self.listener, router);
        tokio::select! {
            () = stop.cancelled() => {}
            ended = served.into_future() => tracing::error!(?ended, "the demo's receiver has ended"),
        }
    }
}

async fn take(
    State(lines): State<Sender<String>>,
    Path(tenant): Path<String>,
    axum::Json(notice): axum::Json<Notice>,
) -> StatusCode {
    match lines.send(line(&tenant, &notice)).await {
        Ok(()) => StatusCode::NO_CONTENT,
        Err(_) => StatusCode::SERVICE_UNAVAILABLE,
    }
}

/// A message for people.
fn line(tenant: &str, Notice { r#type, data }: &Notice) -> String {
    let what = &data.delivery_id;
    let who = if tenant == SHOP {
        "the corner shop"
    } else {
        "you"
    };
    match &**r#type {
        "delivery.delivered" => format!("delivered to {who}: {what}"),
        other => format!("{other}: {what}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_has_arrived_is_told_to_whoever_ordered_it() {
        let notice: Notice = serde_json::from_value(json!({
            "type": "delivery.delivered",
            "timestamp": "2026-11-27T18:00:00Z",
            "data": {"delivery_id": "d-1", "status": "delivered"},
        }))
        .expect("a message");
        assert_eq!(line(SHOP, &notice), "delivered to the corner shop: d-1");
        assert_eq!(line("local", &notice), "delivered to you: d-1");
    }
}
