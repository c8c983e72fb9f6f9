//! Orders placed: a quote accepted, or a request that is filled.

use super::Dispatch;
use super::offers::{Availability, Sellers, no_offer};
use super::quotes::{ACCEPTED, accepted_times, forbidden, note_customer};
use super::records::{Kept, Order, Progress, absent, fresh, open_states, seen, text, timed_id};
use super::views::{Eyes, view};
use super::wanted::Stated;
use jiff::Timestamp;
use skyway_contract::{
    Delivery, DeliveryOrder, DeliveryStatus, Id, Money, PublishedService, Quote, Recipient,
};
use skyway_market::matching::Misfit;
use skyway_registry::documents::{Commit, Committed, DocumentKind, Seen};
use skyway_registry::store::{KeptReply, ReplyKey, StoreError};
use skyway_registry::{Reply, WriteOptions};
use skyway_service::access::Caller;
use skyway_service::intake::Faults;
use skyway_service::refusal::{Code, Refusal};

/// How often something is decided anew because others got in between.
pub(super) const DECISIONS: u32 = 16;
/// The longest idempotency key, in bytes.
const KEY_BYTES_MAX: usize = 256;
/// The longest number that a customer has for an order, in bytes.
const REFERENCE_BYTES_MAX: usize = 128;
/// Why an order without a service waits.
const NO_SERVICE: &str = "no service fits it yet";

/// What an order is for, once it has been read.
#[derive(Debug, Default)]
struct Errand {
    quote: Option<Kept<Quote>>,
    network: String,
    source: Option<Id<'static>>,
    destination: Option<Id<'static>>,
    payload_kg: f64,
    start_time: Option<Timestamp>,
    arrive_by: Option<String>,
    promised_at: Option<String>,
    service: Option<(String, String)>,
    /// On which version of its service it is decided, so that none is ordered that is deleted meanwhile.
    service_seen: Option<Seen>,
    price: Option<Money>,
    reason: Option<String>,
}

impl Dispatch {
    /// Places an order. With an idempotency key it is done once, and the same request gets the same answer.
    ///
    /// # Errors
    /// When the order is not valid, its quote cannot be accepted, its service does not fit, or the store does not answer.
    pub async fn create_delivery(
        &self,
        caller: &Caller,
        order: &DeliveryOrder,
        manner: &WriteOptions,
    ) -> Result<Reply, Refusal> {
        let key = manner.key.as_deref();
        if key.is_some_and(|key| key.is_empty() || key.len() > KEY_BYTES_MAX) {
            let detail = format!("the idempotency key has to have 1 to {KEY_BYTES_MAX} bytes");
            return Err(Refusal::new(Code::ParameterInvalid, detail));
        }
        if let Some(reply) = self.answered_before(manner).await? {
            return Ok(reply);
        }
        let customer = caller.acts_for(order.customer.as_deref());
        let customer = customer.ok_or_else(forbidden)?;
        check_order(order, customer)?;
        self.check_open(customer).await?;
        for _ in 0..DECISIONS {
            let errand = match &order.quote_id {
                Some(id) => self.quoted(caller, customer, id).await,
                None => self.requested(order).await,
            };
            let errand = match errand {
                Ok(errand) => errand,
                // The same request, sent twice at once, may have accepted the quote meanwhile.
                Err(refusal) if refusal.code == Code::AlreadyExists => {
                    let before = self.answered_before(manner).await?;
                    return before.ok_or(refusal);
                }
                Err(refusal) => return Err(refusal),
            };
            let (commit, reply) = self.placing(customer, order, errand, manner).await?;
            match self.documents.commit(&commit).await? {
                Committed::Done => {
                    self.orders.notify_one();
                    self.messages.notify_one();
                    return Ok(reply.into());
                }
                Committed::Moved => {}
                Committed::Repeated { fingerprint, reply } => {
                    return repeated(&fingerprint, reply, manner);
                }
            }
        }
        Err(StoreError::Contended.into())
    }

    /// Checks that a customer may order more. Orders that come at once may go a little beyond the bound.
    async fn check_open(&self, customer: &str) -> Result<(), Refusal> {
        let states: Vec<&str> = open_states().collect();
        let kind = DocumentKind::Delivery;
        let count = self.documents.count_standing(kind, customer, &states, None);
        let open = count.await?;
        if open < self.settings.open_max {
            return Ok(());
        }
        let detail = format!("'{customer}' has {open} orders that are not over");
        Err(Refusal::new(Code::LimitReached, detail))
    }

    /// What the same request was answered before; none where it has no idempotency key, or was not answered.
    async fn answered_before(&self, manner: &WriteOptions) -> Result<Option<Reply>, Refusal> {
        let Some(key) = &manner.key else {
            return Ok(None);
        };
        let kept = self.documents.kept_reply(&manner.subject, key).await?;
        kept.map(|(fingerprint, reply)| repeated(&fingerprint, reply, manner))
            .transpose()
    }

    /// What a quote that is accepted is for.
    async fn quoted(&self, caller: &Caller, customer: &str, id: &str) -> Result<Errand, Refusal> {
        let quote = self.kept_quote(caller, id).await?;
        if quote.value.customer != customer {
            return Err(Refusal::not_found("quote", id));
        }
        if quote.document.state == ACCEPTED {
            let detail = format!("the quote '{id}' was accepted before");
            return Err(Refusal::new(Code::AlreadyExists, detail));
        }
        if self.is_suspended(&quote.value.provider).await? {
            let service = &quote.value.request.service_id;
            return Err(no_offer(&[Misfit::Suspended.of(service)]));
        }
        let now = self.clock.now();
        let expires_at: Option<Timestamp> = quote.value.expires_at.parse().ok();
        let Some(expires_at) = expires_at.filter(|expires_at| *expires_at > now) else {
            let detail = format!("the quote '{id}' held until {}", quote.value.expires_at);
            return Err(Refusal::new(Code::QuoteExpired, detail));
        };
        let told = &quote.value;
        let request = &told.request;
        let (start, promised_at) = accepted_times(told, expires_at, now);
        let service = &request.service_id;
        let seen = self.service_seen(service).await?;
        let seen = seen.ok_or_else(|| offered_no_more(service, start))?;
        Ok(Errand {
            network: told.network.clone(),
            source: Some(request.source.clone()),
            destination: Some(request.destination.clone()),
            payload_kg: request.payload_kg,
            start_time: Some(start),
            arrive_by: request.arrive_by.clone(),
            promised_at: promised_at.map(|promised_at| promised_at.to_string()),
            service: Some((service.clone(), told.provider.clone())),
            service_seen: Some(seen),
            price: Some(told.price.clone()),
            reason: None,
            quote: Some(quote),
        })
    }

    /// What a request is for, and the service that fills it: the one that is named, or the cheapest that fits.
    async fn requested(&self, order: &DeliveryOrder) -> Result<Errand, Refusal> {
        let service = match &order.service_id {
            Some(id) => Some(self.service_by_id(id).await?),
            None => None,
        };
        let of_service = service.as_ref().map(|service| service.network.clone());
        let network = order.network.clone().or(of_service);
        let (Some(network), Some(source), Some(destination)) =
            (&network, &order.source, &order.destination)
        else {
            return Err(incomplete(order, network.is_none()));
        };
        let stated = Stated {
            network,
            source,
            destination,
            payload_kg: order.payload_kg.unwrap_or(0.0),
            start_time: order.start_time.as_deref(),
            arrive_by: order.arrive_by.as_deref(),
            price_max: order.price_max.as_ref(),
            on_time_min_fraction: None,
        };
        let wanted = self.wanted(stated, "order").await?;
        let found = match service {
            Some(service) if service.network != *network => {
                let detail = format!("the service is one of the network '{}'", service.network);
                return Err(Refusal::new(Code::NoOffer, detail));
            }
            Some(service) => {
                let (later, mut sellers) = (Availability::Later, Sellers::default());
                let matched = self
                    .match_service(&wanted, &service, later, &mut sellers)
                    .await?;
                let id = service.id.as_deref().unwrap_or_default();
                let (fit, _) = matched.map_err(|misfit| no_offer(&[misfit.of(id)]))?;
                Some((service, fit))
            }
            None => self.cheapest(&wanted).await?.ok(),
        };
        let service_seen = match &found {
            Some((service, _)) => self.service_seen(&names(service).0).await?,
            None => None,
        };
        // One that was deleted since it was looked at fills nothing.
        let found = found.filter(|_| service_seen.is_some());
        if let (None, Some(id)) = (&found, &order.service_id) {
            return Err(offered_no_more(id, wanted.ready_at));
        }
        let reason = found.is_none().then(|| NO_SERVICE.to_owned());
        let opens_at = found.as_ref().and_then(|(_, fit)| fit.opens_at);
        let (service, price) = match found {
            Some((service, fit)) => (Some(names(&service)), Some(fit.price)),
            None => (None, None),
        };
        Ok(Errand {
            quote: None,
            network: network.clone(),
            source: Some(source.clone()),
            destination: Some(destination.clone()),
            payload_kg: wanted.payload_kg,
            start_time: Some(opens_at.unwrap_or(wanted.ready_at)),
            arrive_by: order.arrive_by.clone(),
            promised_at: None,
            service,
            service_seen,
            price,
            reason,
        })
    }

    /// The version of a service that is there; none where it was deleted.
    pub(super) async fn service_seen(&self, id: &str) -> Result<Option<Seen>, Refusal> {
        let document = self.documents.document(DocumentKind::Service, id).await?;
        Ok(document.map(|document| seen(&document)))
    }

    /// The commit that places an order, and what is answered.
    async fn placing(
        &self,
        customer: &str,
        order: &DeliveryOrder,
        errand: Errand,
        manner: &WriteOptions,
    ) -> Result<(Commit, KeptReply), Refusal> {
        let now = self.clock.now();
        let id = timed_id("d", now)?;
        let (quote, service_seen) = (errand.quote.clone(), errand.service_seen.clone());
        let mut placed = Order {
            delivery: delivery(&id, customer, order, errand, now),
            dispatch: Progress::default(),
        };
        let reason = placed.delivery.reason.clone();
        placed.set_status(DeliveryStatus::Created, reason, now, None);
        let provider = placed.delivery.provider.clone().unwrap_or_default();
        let kind = DocumentKind::Delivery;
        let body = (DeliveryStatus::Created.name(), text(&placed));
        let mut commit = Commit {
            seen: [absent(kind, &id)]
                .into_iter()
                .chain(service_seen)
                .collect(),
            puts: vec![fresh(kind, &id, (customer, &provider), body, now)],
            messages: self.status_messages(&placed).await?,
            ..Commit::default()
        };
        if let Some(recipient) = &order.recipient {
            let kind = DocumentKind::Recipient;
            let body = ("", text(recipient));
            commit
                .puts
                .push(fresh(kind, &id, (customer, ""), body, now));
        }
        if let Some(quote) = quote {
            commit.seen.push(quote.seen());
            commit.puts.push(quote.accepted(now));
        }
        // Without the recipient: an answer is kept, and what is kept of a recipient stands in one place.
        let told = view(&placed, Eyes::Customer, None);
        let reply = KeptReply {
            created: true,
            etag: None,
            id,
            body: text(&told),
        };
        if let Some(key) = &manner.key {
            let key = ReplyKey {
                subject: manner.subject.clone(),
                key: key.clone(),
                fingerprint: manner.fingerprint.clone(),
                at_ms: now.as_millisecond(),
            };
            commit.reply = Some((key, reply.clone()));
        }
        Ok((commit, reply))
    }
}

/// The service and its provider, by id.
fn names(service: &PublishedService) -> (String, String) {
    let id = service.id.clone().unwrap_or_default();
    (id, service.provider.clone().unwrap_or_default())
}

/// That a service is offered at no time any more.
fn offered_no_more(service: &str, pickup_at: Timestamp) -> Refusal {
    no_offer(&[Misfit::Validity { pickup_at }.of(service)])
}

fn delivery(
    id: &str,
    customer: &str,
    order: &DeliveryOrder,
    errand: Errand,
    now: Timestamp,
) -> Delivery {
    let (service_id, provider) = errand.service.unzip();
    let nowhere = || Id::new("");
    Delivery {
        id: id.to_owned(),
        customer: customer.to_owned(),
        provider,
        service_id,
        quote_id: order.quote_id.clone(),
        reference: order.reference.clone(),
        network: errand.network,
        source: errand.source.unwrap_or_else(nowhere),
        destination: errand.destination.unwrap_or_else(nowhere),
        payload_kg: errand.payload_kg,
        status: DeliveryStatus::Created,
        reason: errand.reason,
        created_at: now.to_string(),
        start_time: errand.start_time.unwrap_or(now).to_string(),
        arrive_by: errand.arrive_by,
        promised_at: errand.promised_at,
        expected_at: None,
        price_max: order.price_max.clone(),
        price: errand.price,
        allocation: None,
        history: Vec::new(),
        recompositions: Vec::new(),
        proof: None,
        recipient: None,
    }
}

/// What can be judged of an order by itself.
fn check_order(order: &DeliveryOrder, customer: &str) -> Result<(), Refusal> {
    let mut faults = Faults::default();
    note_customer(customer, &mut faults);
    let reference = order.reference.as_deref();
    faults.text("/reference", reference, REFERENCE_BYTES_MAX);
    if let Some(recipient) = &order.recipient {
        check_recipient(recipient, &mut faults);
    }
    if order.quote_id.is_some() {
        let stated = [
            ("/service_id", order.service_id.is_some()),
            ("/network", order.network.is_some()),
            ("/source", order.source.is_some()),
            ("/destination", order.destination.is_some()),
            ("/payload_kg", order.payload_kg.is_some()),
            ("/start_time", order.start_time.is_some()),
            ("/arrive_by", order.arrive_by.is_some()),
            ("/price_max", order.price_max.is_some()),
        ];
        for (pointer, _) in stated.into_iter().filter(|(_, is_stated)| *is_stated) {
            let message = "the quote states it already".to_owned();
            let hint = Some("leave it out, or ask for another quote".to_owned());
            faults.add("stated_twice", pointer, message, hint);
        }
    }
    faults.check(Code::PlanInvalid, "order")
}

fn check_recipient(recipient: &Recipient, faults: &mut Faults) {
    let texts = [
        ("/recipient/name", &recipient.name, 200),
        ("/recipient/phone", &recipient.phone, 64),
        ("/recipient/note", &recipient.note, 500),
    ];
    for (pointer, text, letters_max) in texts {
        // A letter has at most four bytes.
        faults.text(pointer, text.as_deref(), letters_max * 4);
    }
}

fn incomplete(order: &DeliveryOrder, lacks_network: bool) -> Refusal {
    let mut faults = Faults::default();
    let fields = [
        ("/network", lacks_network),
        ("/source", order.source.is_none()),
        ("/destination", order.destination.is_none()),
    ];
    for (pointer, _) in fields.into_iter().filter(|(_, is_missing)| *is_missing) {
        let message = "an order without a quote states it".to_owned();
        faults.add("missing_field", pointer, message, None);
    }
    faults.refusal(Code::PlanInvalid, "order")
}

/// The same request gets the same answer, another one a refusal.
fn repeated(fingerprint: &str, reply: KeptReply, manner: &WriteOptions) -> Result<Reply, Refusal> {
    if fingerprint == manner.fingerprint {
        return Ok(reply.into());
    }
    let detail = "this idempotency key was used with another request; take a new key";
    Err(Refusal::new(Code::IdempotencyMismatch, detail))
}
