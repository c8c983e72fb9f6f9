//! Which services fit what a customer looks for.

use super::Dispatch;
use super::fleet::{AT_ONCE, Demand};
use super::records::Kept;
use super::wanted::{Stated, Wanted};
use skyway_contract::{
    FleetDrone, FleetDroneState, PassedOver, Provider, ProviderState, PublishedService,
    ServiceOffer, ServiceOffers, ServiceSearch,
};
use skyway_market::area::Area;
use skyway_market::matching::{Fit, Misfit, Supply, fit};
use skyway_market::ranking::rank;
use skyway_registry::documents::{DocumentKind, DocumentQuery};
use skyway_service::refusal::{Code, Refusal};
use std::cmp::Ordering;
use std::collections::BTreeMap;

/// The most services that are looked at.
const SERVICES_MAX: usize = 2_000;
/// The most that are told of those that fit, and of those that do not.
const TOLD_MAX: usize = 100;

/// Who sells a service.
#[derive(Debug)]
struct Seller {
    is_suspended: bool,
    /// Its drones that could be sent now; none before they were asked for.
    available: Option<Vec<Kept<FleetDrone>>>,
}

/// Those who sell, as far as they were looked at.
#[derive(Debug, Default)]
pub(super) struct Sellers(BTreeMap<String, Seller>);

/// What of a service's supply counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Availability {
    /// A drone has to be free now.
    Now,
    /// An order may wait for one: where it has a deadline, those that are free now say whether that can be kept.
    Later,
}

impl Dispatch {
    /// What is offered for an errand: the services that fit, the best first, and why others do not.
    ///
    /// # Errors
    /// When the search is not valid, there is no such network, or the store does not answer.
    pub async fn search_services(&self, search: &ServiceSearch) -> Result<ServiceOffers, Refusal> {
        let stated = Stated {
            network: &search.network,
            source: &search.source,
            destination: &search.destination,
            payload_kg: search.payload_kg,
            start_time: search.start_time.as_deref(),
            arrive_by: search.arrive_by.as_deref(),
            price_max: search.price_max.as_ref(),
            on_time_min_fraction: search.on_time_min_fraction,
        };
        let wanted = self.wanted(stated, "search").await?;
        let mut sellers = Sellers::default();
        let (mut offers, mut passed_over) = (Vec::new(), Vec::new());
        for service in self.services_over(&wanted.network).await? {
            let id = service.id.clone().unwrap_or_default();
            let found = self
                .match_service(&wanted, &service, Availability::Now, &mut sellers)
                .await?;
            match found {
                Ok((fit, drones)) => offers.push(offer(&id, &service, fit, drones)),
                Err(misfit) => passed_over.push(misfit.of(&id)),
            }
        }
        let measured = self.measured_on_time(&wanted.network).await?;
        for offer in &mut offers {
            offer.measured_on_time = measured.get(&offer.service_id).copied();
        }
        rank(&mut offers, search.rank_by);
        offers.truncate(TOLD_MAX);
        passed_over.truncate(TOLD_MAX);
        Ok(ServiceOffers {
            offers,
            passed_over,
        })
    }

    /// The services over a network, by id.
    pub(super) async fn services_over(
        &self,
        network: &str,
    ) -> Result<Vec<PublishedService>, Refusal> {
        let mut query = DocumentQuery {
            kind: DocumentKind::Service,
            of: None,
            states: Vec::new(),
            after: None,
            limit: AT_ONCE,
            is_newest_first: false,
        };
        let mut services = Vec::new();
        while services.len() < SERVICES_MAX {
            let page = self.documents.documents(&query).await?;
            let is_last = (page.len() as u64) < AT_ONCE;
            query.after = page.last().map(|last| last.id.clone());
            for document in page {
                let service: Kept<PublishedService> = Kept::read(document)?;
                if service.value.network == network {
                    services.push(identified(service));
                }
            }
            if is_last {
                break;
            }
        }
        services.truncate(SERVICES_MAX);
        Ok(services)
    }

    /// A service by its id.
    ///
    /// # Errors
    /// When there is none, or the store does not answer.
    pub(super) async fn service_by_id(&self, id: &str) -> Result<PublishedService, Refusal> {
        let document = self.documents.document(DocumentKind::Service, id).await?;
        let document = document.ok_or_else(|| Refusal::not_found("service", id))?;
        Ok(identified(Kept::read(document)?))
    }

    /// Whether a service fits, and how many of its drones are free; what it does not fit for.
    pub(super) async fn match_service(
        &self,
        wanted: &Wanted,
        service: &PublishedService,
        availability: Availability,
        sellers: &mut Sellers,
    ) -> Result<Result<(Fit, u32), Misfit>, Refusal> {
        let provider = service.provider.as_deref().unwrap_or_default();
        // Reading a fleet takes longer than all else of an order, and one without a deadline may wait for any drone.
        let needs_fleet = availability == Availability::Now || wanted.arrive_by.is_some();
        let seller = self.seller(provider, needs_fleet, sellers).await?;
        let demand = Demand {
            network: &wanted.network,
            payload_kg: wanted.payload_kg,
            now: self.clock.now(),
        };
        let fitting = seller
            .available
            .iter()
            .flatten()
            .filter(|drone| demand.fits(&drone.value, service));
        let fetches = fitting.filter_map(|drone| {
            let home = wanted.ways.node(drone.value.home.text())?;
            wanted.errand.round_m(home)?;
            wanted.errand.fetch_m(home)
        });
        let fetches: Vec<f64> = fetches.collect();
        let free = u32::try_from(fetches.len()).unwrap_or(u32::MAX);
        let supply = Supply {
            is_suspended: seller.is_suspended,
            outside: outside(wanted, service),
            length_m: wanted.errand.length_m(),
            drones: match availability {
                Availability::Now => free,
                Availability::Later => free.max(1),
            },
            fetch_m: fetches.into_iter().min_by(f64::total_cmp).unwrap_or(0.0),
        };
        Ok(fit(service, &wanted.sought(), &supply).map(|fit| (fit, free)))
    }

    /// The cheapest service that fits and has a drone that could fly it, whether or not one is free; else why none does.
    pub(super) async fn cheapest(
        &self,
        wanted: &Wanted,
    ) -> Result<Result<(PublishedService, Fit), Vec<PassedOver>>, Refusal> {
        let mut sellers = Sellers::default();
        let (mut passed_over, mut fitting) = (Vec::new(), Vec::new());
        for service in self.services_over(&wanted.network).await? {
            let found = self
                .match_service(wanted, &service, Availability::Later, &mut sellers)
                .await?;
            match found {
                Ok((fit, _)) => fitting.push((service, fit)),
                Err(misfit) => passed_over.push(misfit.of(id_of(&service))),
            }
        }
        fitting.sort_by(|(_, one), (_, other)| by_price(one, other));
        for (service, fit) in fitting {
            if self.has_able(wanted, &service).await? {
                return Ok(Ok((service, fit)));
            }
            passed_over.push(Misfit::NoDrone.of(id_of(&service)));
        }
        passed_over.truncate(TOLD_MAX);
        Ok(Err(passed_over))
    }

    /// Whether nothing of a provider is offered for now.
    pub(super) async fn is_suspended(&self, provider: &str) -> Result<bool, Refusal> {
        let mut sellers = Sellers::default();
        let seller = self.seller(provider, false, &mut sellers).await?;
        Ok(seller.is_suspended)
    }

    /// A provider, with its free drones where they count.
    async fn seller<'s>(
        &self,
        provider: &str,
        needs_fleet: bool,
        sellers: &'s mut Sellers,
    ) -> Result<&'s Seller, Refusal> {
        if !sellers.0.contains_key(provider) {
            let kind = DocumentKind::Provider;
            let document = self.documents.document(kind, provider).await?;
            let stated: Option<Kept<Provider>> = document.map(Kept::read).transpose()?;
            let state = stated.map(|provider| provider.value.state);
            let seller = Seller {
                is_suspended: state == Some(ProviderState::Suspended),
                available: None,
            };
            sellers.0.insert(provider.to_owned(), seller);
        }
        let seller = sellers.0.get_mut(provider);
        let seller =
            seller.ok_or_else(|| Refusal::new(Code::Internal, "a provider was not looked at"))?;
        if needs_fleet && seller.available.is_none() {
            let available = self.fleet(provider, &[FleetDroneState::Available]).await?;
            seller.available = Some(available);
        }
        Ok(seller)
    }
}

/// A service with the id and the provider of its document, where its body leaves them out.
fn identified(service: Kept<PublishedService>) -> PublishedService {
    let Kept {
        document,
        mut value,
    } = service;
    value.id.get_or_insert(document.id);
    value.provider.get_or_insert(document.tenant);
    value
}

/// The cheaper one first, or of those as cheap the earlier one. Of several currencies the first by its code counts, so that the
/// choice does not depend on the order of services.
fn by_price(one: &Fit, other: &Fit) -> Ordering {
    let of = |fit: &Fit| (fit.price.currency.clone(), fit.price.amount, fit.arrives_at);
    of(one).cmp(&of(other))
}

fn id_of(service: &PublishedService) -> &str {
    service.id.as_deref().unwrap_or_default()
}

/// The node that the area of a service leaves out, if it does; an area that cannot be read leaves out all.
fn outside<'w>(wanted: &'w Wanted, service: &PublishedService) -> Option<&'w str> {
    let geometry = service.area.as_ref()?;
    let topology = wanted.ways.topology();
    let Ok(area) = Area::read(geometry, topology.frame()) else {
        return Some(&wanted.pickup);
    };
    if !area.contains(topology.position(wanted.errand.pickup)) {
        return Some(&wanted.pickup);
    }
    if !area.contains(topology.position(wanted.errand.drop)) {
        return Some(&wanted.drop);
    }
    None
}

fn offer(id: &str, service: &PublishedService, fit: Fit, drones: u32) -> ServiceOffer {
    let quality = service.quality.as_ref();
    ServiceOffer {
        service_id: id.to_owned(),
        name: service.name.clone(),
        provider: service.provider.clone().unwrap_or_default(),
        price: fit.price,
        pickup_at: fit.pickup_at.to_string(),
        arrives_at: fit.arrives_at.to_string(),
        length_m: fit.length_m,
        drones,
        promised_on_time_fraction: quality.map(|quality| quality.on_time_fraction),
        measured_on_time: None,
        reasons: fit.reasons,
    }
}

/// That nothing is offered, and why.
pub(super) fn no_offer(passed_over: &[PassedOver]) -> Refusal {
    let faults = passed_over.iter().map(|passed| skyway_contract::Fault {
        code: passed.code.clone(),
        pointer: format!("/services/{}", passed.service_id),
        message: passed.text.clone(),
        hint: None,
    });
    let mut refusal = Refusal::new(Code::NoOffer, "no service fits what was asked for");
    refusal.faults = faults.take(20).collect();
    refusal
}
