//! What is worked out of all that edges have told: how often what fails where, and how late which service is.

use super::Dispatch;
use super::positions::shifted;
use super::records::Kept;
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{
    Delivery, DeliveryStatus, FailureRate, FailureType, Lateness, NetworkStatistics,
    PublishedService,
};
use skyway_market::{poisson_interval, wilson};
use skyway_registry::documents::{DocumentKind, DocumentQuery, FailureCount};
use skyway_service::access::{Caller, Role};
use skyway_service::intake::Faults;
use skyway_service::refusal::{Code, Refusal};
use std::collections::BTreeMap;

/// The most failure rates that are told.
const RATES_MAX: u64 = 10_000;
/// What is looked at where nothing is said.
const LOOKED_BACK: SignedDuration = SignedDuration::from_hours(30 * 24);
/// The longest span that is looked at.
pub(super) const SPAN_MAX: SignedDuration = SignedDuration::from_hours(366 * 24);
/// Deliveries ordered so long before the span may have arrived in it: 7 days until the pickup, 7 more until the latest arrival.
const ORDERED_BEFORE: SignedDuration = SignedDuration::from_hours(15 * 24);
/// The most deliveries that are looked at; of more the newest count.
const DELIVERIES_MAX: usize = 50_000;
/// How many are read at once.
const AT_ONCE: u64 = 500;
const DAY_S: f64 = 86_400.0;

/// A span of time.
#[derive(Clone, Copy, Debug)]
struct Span {
    from: Timestamp,
    until: Timestamp,
}

impl Dispatch {
    /// What is known of a network over a span of time, given in RFC 3339. Edges are told of failures alone; a provider
    /// sees how late its own services are.
    ///
    /// # Errors
    /// When there is no such network, the span is none, or the store does not answer.
    pub async fn statistics(
        &self,
        caller: &Caller,
        network: &str,
        from: Option<&str>,
        until: Option<&str>,
    ) -> Result<NetworkStatistics, Refusal> {
        let span = self.span(from, until)?;
        self.registry.topology(network).await?;
        let (from_ms, until_ms) = (span.from.as_millisecond(), span.until.as_millisecond());
        let counts = self
            .documents
            .count_failures(network, from_ms, until_ms, RATES_MAX);
        let days = span.until.duration_since(span.from).as_secs_f64() / DAY_S;
        let counts = counts.await?;
        let failures = counts.iter().filter_map(|count| rate(count, days));
        let lateness = match caller.role {
            Role::Operator | Role::Anyone => self.lateness(network, None, span).await?,
            Role::Provider => self.lateness(network, Some(&caller.tenant), span).await?,
            Role::Drone | Role::Edge | Role::Metrics | Role::Customer => Vec::new(),
        };
        Ok(NetworkStatistics {
            network: network.to_owned(),
            from: span.from.to_string(),
            until: span.until.to_string(),
            failures: failures.collect(),
            lateness,
        })
    }

    fn span(&self, from: Option<&str>, until: Option<&str>) -> Result<Span, Refusal> {
        let mut faults = Faults::default();
        let until = faults.instant("?until", until);
        let until = until.unwrap_or_else(|| self.clock.now());
        let from = faults.instant("?from", from);
        let from = from.unwrap_or_else(|| shifted(until, -LOOKED_BACK));
        let span = until.duration_since(from);
        if span <= SignedDuration::ZERO || span > SPAN_MAX {
            let message = format!("from {from} until {until} is not a span of up to 366 days");
            faults.add("window_reversed", "?from", message, None);
        }
        faults.check(Code::ParameterInvalid, "query")?;
        Ok(Span { from, until })
    }

    /// How late the services over a network are, of all providers or of one, by the deliveries that arrived in a span; by the
    /// newest of them where there are too many.
    async fn lateness(
        &self,
        network: &str,
        provider: Option<&str>,
        span: Span,
    ) -> Result<Vec<Lateness>, Refusal> {
        let ordered_from = ordered_at(shifted(span.from, -ORDERED_BEFORE));
        let mut query = DocumentQuery {
            kind: DocumentKind::Delivery,
            of: provider.map(str::to_owned),
            states: vec![DeliveryStatus::Delivered.name().to_owned()],
            after: Some(ordered_at(span.until)),
            limit: AT_ONCE,
            is_newest_first: true,
        };
        let mut late_s: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        let mut looked_at = 0;
        loop {
            if looked_at >= DELIVERIES_MAX {
                let counted_from = query.after;
                tracing::info!(
                    network,
                    looked_at,
                    counted_from,
                    "older deliveries are left out of the lateness"
                );
                break;
            }
            let mut page = self.documents.documents(&query).await?;
            page.retain(|document| document.id > ordered_from);
            let is_last = (page.len() as u64) < AT_ONCE;
            looked_at += page.len();
            query.after = page.last().map(|last| last.id.clone());
            for document in page {
                let delivery = Kept::<Delivery>::read(document)?.value;
                let is_own = provider.is_none_or(|own| delivery.provider.as_deref() == Some(own));
                if delivery.network != network || !is_own {
                    continue;
                }
                if let (Some(service), Some(late)) = (&delivery.service_id, late(&delivery, span)) {
                    late_s.entry(service.clone()).or_default().push(late);
                }
            }
            if is_last {
                break;
            }
        }
        let mut told = Vec::with_capacity(late_s.len());
        for (service_id, late_s) in late_s {
            let tolerance_s = self.tolerance_s(&service_id).await?;
            told.push(lateness(service_id, late_s, tolerance_s));
        }
        Ok(told)
    }

    /// How late a delivery of a service may be and count as in time, in seconds; not at all where it promises nothing.
    async fn tolerance_s(&self, service: &str) -> Result<f64, Refusal> {
        let kind = DocumentKind::Service;
        let document = self.documents.document(kind, service).await?;
        let service: Option<Kept<PublishedService>> = document.map(Kept::read).transpose()?;
        let quality = service.and_then(|service| service.value.quality);
        Ok(quality.map_or(0.0, |quality| quality.tolerance_s))
    }
}

/// Before the ids of all deliveries that were ordered from an instant on: they begin with it.
fn ordered_at(at: Timestamp) -> String {
    format!("d{:012x}", at.as_millisecond().max(0))
}

/// How late a delivery was that arrived in a span, in seconds; none where it did not, or nothing was promised.
fn late(delivery: &Delivery, span: Span) -> Option<f64> {
    let proof = delivery.proof.as_ref()?;
    let arrived: Timestamp = proof.at.parse().ok()?;
    let promised: Timestamp = delivery.promised_at.as_deref()?.parse().ok()?;
    let is_within = span.from <= arrived && arrived < span.until;
    is_within.then(|| arrived.duration_since(promised).as_secs_f64())
}

fn lateness(service_id: String, mut late_s: Vec<f64>, tolerance_s: f64) -> Lateness {
    late_s.sort_by(f64::total_cmp);
    let in_time = late_s.partition_point(|late| *late <= tolerance_s);
    Lateness {
        service_id,
        on_time: wilson(in_time as u64, late_s.len() as u64),
        median_s: quantile(&late_s, 0.5),
        p95_s: quantile(&late_s, 0.95),
    }
}

/// The smallest of some sorted numbers that this share of them does not exceed; 0 of none.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}

/// A count as a rate with its interval; none of a type that only a later version knows.
fn rate(count: &FailureCount, days: f64) -> Option<FailureRate> {
    let name = serde_json::Value::String(count.failure_type.clone());
    let failure_type: FailureType = serde_json::from_value(name).ok()?;
    let (low, high) = poisson_interval(count.count);
    Some(FailureRate {
        segment: Some(count.segment.clone()).filter(|segment| !segment.is_empty()),
        hour: count.hour,
        failure_type,
        failures: count.count,
        per_day: count.count as f64 / days,
        low_per_day: low / days,
        high_per_day: high / days,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_numbers_that_were_seen() {
        let sorted: Vec<f64> = (1..=20).map(f64::from).collect();
        assert_eq!(quantile(&sorted, 0.5), 10.0);
        assert_eq!(quantile(&sorted, 0.95), 19.0);
        assert_eq!(quantile(&sorted[..1], 0.95), 1.0);
        assert_eq!(quantile(&[], 0.5), 0.0);
    }

    #[test]
    fn what_is_late_by_the_tolerance_is_in_time() {
        let told = lateness("s".to_owned(), vec![61.0, -5.0, 60.0, 0.0], 60.0);
        assert_eq!((told.on_time.count, told.on_time.of), (3, 4));
        assert_eq!((told.median_s, told.p95_s), (0.0, 61.0));
    }

    #[test]
    fn a_rate_is_over_the_days_that_were_looked_at() {
        let mut count = FailureCount {
            segment: String::new(),
            hour: 7,
            failure_type: "environmental".to_owned(),
            count: 10,
        };
        let told = rate(&count, 5.0).expect("a rate");
        assert_eq!((told.segment, told.failures, told.per_day), (None, 10, 2.0));
        // Garwood 1936: 4.795 to 18.39 for a count of 10.
        assert!((told.low_per_day * 5.0 - 4.795).abs() < 0.001);
        assert!((told.high_per_day * 5.0 - 18.390).abs() < 0.001);
        count.failure_type = "unknown".to_owned();
        assert!(rate(&count, 5.0).is_none());
    }
}
