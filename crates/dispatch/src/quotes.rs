//! Prices that hold for a while: composed at an edge, with the wind, the pads and the traffic there.

use super::Dispatch;
use super::edges::{ComposedFlight, EdgeError, FlightRequest};
use super::fleet::Demand;
use super::offers::{Availability, Sellers, no_offer};
use super::records::{Kept, absent, fresh, id_until, text, timed_id};
use super::wanted::{START_AHEAD_MAX, Stated, Wanted};
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{FleetDrone, FleetDroneState, Money, PublishedService, Quote, QuoteRequest};
use skyway_market::matching::{Misfit, SPEED_MPS};
use skyway_market::tariff::{Carriage, price};
use skyway_registry::documents::{Commit, Committed, Document, DocumentKind};
use skyway_service::access::{Caller, Owners, is_tenant};
use skyway_service::intake::Faults;
use skyway_service::refusal::{Code, Refusal};

/// How long a quote holds: as long as the edge's own.
const HOLDS_FOR: SignedDuration = SignedDuration::from_mins(5);
/// What the id of a quote begins with.
const ID_PREFIX: &str = "q";
/// The state of the document of a quote that can be accepted.
pub(super) const OPEN: &str = "open";
/// The state of the document of one that was.
pub(super) const ACCEPTED: &str = "accepted";

impl Dispatch {
    /// Asks an edge for the flight that an errand takes, and holds its price.
    ///
    /// # Errors
    /// When the service does not fit, the edge refuses or does not answer, or the store does not answer.
    pub async fn create_quote(
        &self,
        caller: &Caller,
        mut request: QuoteRequest,
    ) -> Result<Quote, Refusal> {
        let customer = caller.acts_for(request.customer.as_deref());
        let customer = customer.ok_or_else(forbidden)?.to_owned();
        check_customer(&customer)?;
        self.check_open_quotes(&customer).await?;
        let service = self.service_by_id(&request.service_id).await?;
        let mut wanted = self.wanted_of(&request, &service).await?;
        let mut sellers = Sellers::default();
        let found = self
            .match_service(&wanted, &service, Availability::Now, &mut sellers)
            .await?;
        let misfit = |misfit: &Misfit| no_offer(&[misfit.of(&request.service_id)]);
        let (fit, _) = found.map_err(|found| misfit(&found))?;
        if let Some(opens_at) = fit.opens_at {
            if opens_at.duration_since(self.clock.now()) > START_AHEAD_MAX {
                return Err(misfit(&Misfit::Hours {
                    ready_at: wanted.ready_at,
                    opens_at: Some(opens_at),
                }));
            }
            wanted.ready_at = opens_at;
            request.start_time = Some(opens_at.to_string());
        }
        let drone = self.nearest_drone(&wanted, &service).await?;
        let drone = drone.ok_or_else(|| misfit(&Misfit::NoDrone))?;
        let (edge, flight) = self
            .composed_at_edge(&wanted, &service, &drone.value)
            .await?;
        if wanted
            .arrive_by
            .is_some_and(|latest| flight.drop_at > latest)
        {
            let arrives_at = flight.drop_at;
            return Err(misfit(&Misfit::Arrival { arrives_at }));
        }
        let now = self.clock.now();
        let quote = Quote {
            id: timed_id(ID_PREFIX, now)?,
            price: priced(&service, &wanted, &flight)?,
            request,
            customer,
            provider: drone.document.tenant.clone(),
            network: wanted.network.clone(),
            pickup_at: flight.pickup_at.to_string(),
            arrives_at: flight.drop_at.to_string(),
            length_m: flight.carried_m,
            edge,
            expires_at: now.saturating_add(HOLDS_FOR).unwrap_or(now).to_string(),
        };
        self.keep_quote(&quote, now).await?;
        Ok(quote)
    }

    /// A quote.
    ///
    /// # Errors
    /// When there is none that the caller may see, or the store does not answer.
    pub async fn quote(&self, caller: &Caller, id: &str) -> Result<Quote, Refusal> {
        Ok(self.kept_quote(caller, id).await?.value)
    }

    pub(super) async fn kept_quote(
        &self,
        caller: &Caller,
        id: &str,
    ) -> Result<Kept<Quote>, Refusal> {
        let document = self.documents.document(DocumentKind::Quote, id).await?;
        let seen = document.filter(|document| {
            caller.sees(&Owners {
                tenant: &document.tenant,
                party: &document.party,
            })
        });
        Kept::read(seen.ok_or_else(|| Refusal::not_found("quote", id))?)
    }

    /// Checks that a customer may ask for another quote. Those that come at once may go a little beyond the bound.
    async fn check_open_quotes(&self, customer: &str) -> Result<(), Refusal> {
        let made_at = self.clock.now().saturating_sub(HOLDS_FOR);
        let last_expired = made_at.map(|made_at| id_until(ID_PREFIX, made_at));
        let (kind, after) = (DocumentKind::Quote, last_expired.as_deref().ok());
        let count = self
            .documents
            .count_standing(kind, customer, &[OPEN], after);
        let open = count.await?;
        if open < self.settings.open_max {
            return Ok(());
        }
        let remedy = "accept some, or wait until they have expired";
        let detail = format!("'{customer}' has {open} quotes that can be accepted; {remedy}");
        Err(Refusal::new(Code::LimitReached, detail))
    }

    async fn wanted_of(
        &self,
        request: &QuoteRequest,
        service: &PublishedService,
    ) -> Result<Wanted, Refusal> {
        let stated = Stated {
            network: &service.network,
            source: &request.source,
            destination: &request.destination,
            payload_kg: request.payload_kg,
            start_time: request.start_time.as_deref(),
            arrive_by: request.arrive_by.as_deref(),
            price_max: None,
            on_time_min_fraction: None,
        };
        self.wanted(stated, "request for a quote").await
    }

    /// The free drone of a service whose flight is the shortest.
    async fn nearest_drone(
        &self,
        wanted: &Wanted,
        service: &PublishedService,
    ) -> Result<Option<Kept<FleetDrone>>, Refusal> {
        let provider = service.provider.as_deref().unwrap_or_default();
        let demand = Demand {
            network: &wanted.network,
            payload_kg: wanted.payload_kg,
            now: self.clock.now(),
        };
        let available = self.fleet(provider, &[FleetDroneState::Available]).await?;
        let fitting = available.into_iter().filter_map(|drone| {
            let home = wanted.ways.node(drone.value.home.text())?;
            let is_fit = demand.fits(&drone.value, service);
            Some((wanted.errand.round_m(home).filter(|_| is_fit)?, drone))
        });
        let nearest = fitting.min_by(|one, other| one.0.total_cmp(&other.0));
        Ok(nearest.map(|(_, drone)| drone))
    }

    async fn composed_at_edge(
        &self,
        wanted: &Wanted,
        service: &PublishedService,
        drone: &FleetDrone,
    ) -> Result<(String, ComposedFlight), Refusal> {
        let edge = self.edge_of(&wanted.network).await?;
        let home = wanted.ways.node(drone.home.text());
        let fetch_m = home.and_then(|home| wanted.errand.fetch_m(home));
        let request = FlightRequest {
            plan_id: None,
            drone_id: None,
            delivery_id: None,
            home: drone.home.text().to_owned(),
            pickup: wanted.pickup.clone(),
            drop: wanted.drop.clone(),
            payload_kg: wanted.payload_kg,
            start_time: departure(wanted.ready_at, fetch_m.unwrap_or(0.0), self.clock.now()),
            airframe: drone.airframe.clone().or_else(|| service.airframe.clone()),
        };
        let _place = self.quoting.at(&edge.id)?;
        match self.edges.compose(&edge, &request).await {
            Ok(flight) => Ok((edge.id, flight)),
            Err(EdgeError::Refused { code, detail }) => {
                tracing::debug!(edge = edge.id, code, "an edge composes no quote");
                let detail = format!("the edge '{}' composes no flight for it: {detail}", edge.id);
                Err(Refusal::new(Code::NoRoute, detail))
            }
            Err(EdgeError::NotAnswered { detail }) => {
                Err(Refusal::new(Code::EdgeUnavailable, detail).retry_after_s(1))
            }
        }
    }

    async fn keep_quote(&self, quote: &Quote, now: Timestamp) -> Result<(), Refusal> {
        let owners = (quote.customer.as_str(), quote.provider.as_str());
        let body = (OPEN, text(quote));
        let commit = Commit {
            seen: vec![absent(DocumentKind::Quote, &quote.id)],
            puts: vec![fresh(DocumentKind::Quote, &quote.id, owners, body, now)],
            ..Commit::default()
        };
        match self.documents.commit(&commit).await? {
            Committed::Done => Ok(()),
            _ => Err(Refusal::new(Code::Internal, "a quote has this id already")),
        }
    }
}

impl Kept<Quote> {
    /// The document to be put once it is accepted.
    pub(super) fn accepted(&self, now: Timestamp) -> Document {
        Document {
            state: ACCEPTED.to_owned(),
            version: self.document.version + 1,
            changed_ms: now.as_millisecond(),
            ..self.document.clone()
        }
    }
}

/// From when the parcel of a quote may be picked up where it is accepted now, and the promised arrival: as much later as the
/// pickup has come to be since the quote was composed, though never after the latest arrival.
pub(super) fn accepted_times(
    quote: &Quote,
    expires_at: Timestamp,
    now: Timestamp,
) -> (Timestamp, Option<Timestamp>) {
    let instant = |text: &str| text.parse::<Timestamp>().ok();
    let stated = quote.request.start_time.as_deref().and_then(instant);
    let ready_at = |since: Timestamp| stated.map_or(since, |stated| stated.max(since));
    let quoted_at = expires_at.saturating_sub(HOLDS_FOR).unwrap_or(now);
    let start = ready_at(now);
    let later = start.duration_since(ready_at(quoted_at));
    let arrives_at = instant(&quote.arrives_at).and_then(|at| at.saturating_add(later).ok());
    let latest = quote.request.arrive_by.as_deref().and_then(instant);
    let promised_at = arrives_at.map(|at| latest.map_or(at, |latest| at.min(latest)));
    (start, promised_at)
}

/// When a drone leaves home to be at the pickup when the parcel is ready, at the earliest now. An edge tells the exact times.
pub(super) fn departure(ready_at: Timestamp, fetch_m: f64, now: Timestamp) -> Timestamp {
    let fetch = SignedDuration::try_from_secs_f64(fetch_m / SPEED_MPS).unwrap_or_default();
    ready_at.saturating_sub(fetch).unwrap_or(now).max(now)
}

fn priced(
    service: &PublishedService,
    wanted: &Wanted,
    flight: &ComposedFlight,
) -> Result<Money, Refusal> {
    let carriage = Carriage {
        length_m: flight.carried_m,
        payload_kg: wanted.payload_kg,
        time_s: flight.carried_s,
    };
    price(&service.tariff, carriage)
        .map_err(|error| Refusal::new(Code::NoOffer, format!("the service has no price: {error}")))
}

fn check_customer(customer: &str) -> Result<(), Refusal> {
    let mut faults = Faults::default();
    note_customer(customer, &mut faults);
    faults.check(Code::PlanInvalid, "request for a quote")
}

/// Notes where a customer that is stated can be none.
pub(super) fn note_customer(customer: &str, faults: &mut Faults) {
    if !is_tenant(customer) {
        let message = format!("'{customer}' is no name of a customer");
        faults.add("id_invalid", "/customer", message, None);
    }
}

pub(super) fn forbidden() -> Refusal {
    Refusal::new(Code::Forbidden, "this token orders for its own tenant only")
}
