//! `skyway delivery order`: an order, by the best offer or as the registry fills it.

use crate::cli::edge::runtime;
use crate::cli::output::Output;
use crate::cli::registry_arguments::RegistryArguments;
use crate::cli::remote::{JSON, Remote};
use crate::cli::stop::{Stop, Verdict};
use crate::wire::{
    Delivery, DeliveryOrder, Id, OfferRank, Quote, QuoteRequest, ServiceOffers, ServiceSearch,
};
use clap::Args;
use jiff::Timestamp;
use serde::Serialize;
use serde::de::DeserializeOwned;

const EXAMPLES: &str = "\
Examples:
  skyway delivery order --network sydney --from 1 --to 450 --payload-kg 0.8 --key basket-7
  skyway delivery order --network sydney --from 1 --to 450 --payload-kg 0.8 --quote
  skyway delivery order --network sydney --from 1 --to 450 --arrive-by 2026-11-27T18:30:00Z --json

It writes the id of the delivery, for `skyway delivery track`.

Exit codes: 0 when it is ordered, 1 for a failure or where nothing fits, 2 for arguments that make no sense, \
4 when the registry cannot be reached.";

/// Arguments of `skyway delivery order`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Order {
    /// The network
    #[arg(long, value_name = "ID")]
    network: String,
    /// The node of the pickup
    #[arg(long, value_name = "NODE")]
    from: String,
    /// The node of the drop
    #[arg(long, value_name = "NODE")]
    to: String,
    /// Payload in kilograms
    #[arg(long, value_name = "KG", default_value_t = 0.0)]
    payload_kg: f64,
    /// When it may be picked up, in RFC 3339 [default: now]
    #[arg(long, value_name = "TIME")]
    start: Option<Timestamp>,
    /// The latest arrival, in RFC 3339
    #[arg(long, value_name = "TIME")]
    arrive_by: Option<Timestamp>,
    /// Look for the cheapest service, have it quoted, and accept the quote; without it the registry chooses
    #[arg(long)]
    quote: bool,
    /// Your own number for it
    #[arg(long, value_name = "TEXT")]
    reference: Option<String>,
    /// An idempotency key: the same order sent again under it is the same delivery. Not with --quote, as each quote is another one
    #[arg(long, value_name = "TEXT", conflicts_with = "quote")]
    key: Option<String>,
    #[command(flatten)]
    registry: RegistryArguments,
    /// Write the delivery as JSON
    #[arg(long)]
    json: bool,
}

impl Order {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let remote = self.registry.remote()?;
        let delivery = runtime()?.block_on(self.order(&remote, output))?;
        if self.json {
            output.json(&serde_json::to_value(&delivery).map_err(Stop::failed)?)?;
        } else {
            output.line(&delivery.id)?;
        }
        Ok(Verdict::Done)
    }

    async fn order(&self, remote: &Remote, output: &Output) -> Result<Delivery, Stop> {
        let order = match self.quote {
            true => DeliveryOrder {
                quote_id: Some(self.quoted(remote, output).await?.id),
                reference: self.reference.clone(),
                ..DeliveryOrder::default()
            },
            false => DeliveryOrder {
                network: Some(self.network.clone()),
                source: Some(Id::new(self.from.clone())),
                destination: Some(Id::new(self.to.clone())),
                payload_kg: Some(self.payload_kg),
                start_time: instant(self.start),
                arrive_by: instant(self.arrive_by),
                reference: self.reference.clone(),
                ..DeliveryOrder::default()
            },
        };
        ask(remote, "/v1/deliveries", self.key.as_deref(), &order).await
    }

    /// A quote of the cheapest service that fits.
    async fn quoted(&self, remote: &Remote, output: &Output) -> Result<Quote, Stop> {
        let search = ServiceSearch {
            network: self.network.clone(),
            source: Id::new(self.from.clone()),
            destination: Id::new(self.to.clone()),
            payload_kg: self.payload_kg,
            start_time: instant(self.start),
            arrive_by: instant(self.arrive_by),
            price_max: None,
            on_time_min_fraction: None,
            rank_by: OfferRank::Price,
        };
        let offers: ServiceOffers = ask(remote, "/v1/services:search", None, &search).await?;
        let Some(best) = offers.offers.first() else {
            let passed_over = offers.passed_over.iter();
            let reasons = passed_over.map(|one| format!("{}: {}", one.service_id, one.text));
            let mut messages = vec!["no service fits".to_owned()];
            messages.extend(reasons);
            return Err(Stop::Failed(messages));
        };
        let request = QuoteRequest {
            service_id: best.service_id.clone(),
            source: search.source,
            destination: search.destination,
            payload_kg: self.payload_kg,
            start_time: search.start_time,
            arrive_by: search.arrive_by,
            customer: None,
        };
        let quote: Quote = ask(remote, "/v1/quotes", None, &request).await?;
        output.note(&format!(
            "{} of {}: {} {}, arrives at {}",
            best.name, quote.provider, quote.price.amount, quote.price.currency, quote.arrives_at
        ));
        Ok(quote)
    }
}

fn instant(at: Option<Timestamp>) -> Option<String> {
    at.map(|at| at.to_string())
}

async fn ask<T: DeserializeOwned>(
    remote: &Remote,
    path: &str,
    key: Option<&str>,
    body: &impl Serialize,
) -> Result<T, Stop> {
    let body = serde_json::to_string(body).map_err(Stop::failed)?;
    let answer = match key {
        Some(key) => remote.post_once(path, key, body).await?,
        None => remote.post(path, &[], (JSON, body)).await?,
    };
    serde_json::from_slice(&answer)
        .map_err(|error| Stop::failed(format!("the registry's answer cannot be read: {error}")))
}
