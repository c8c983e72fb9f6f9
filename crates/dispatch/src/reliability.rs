//! How reliable services are, as measured: the share of their deliveries that came in time.

use super::Dispatch;
use jiff::{SignedDuration, Timestamp};
use skyway_contract::Share;
use skyway_service::access::Caller;
use skyway_service::refusal::Refusal;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// For how long shares are told before they are worked out anew.
const TOLD_FOR: SignedDuration = SignedDuration::from_secs(60);
/// Networks whose shares are kept; beyond it the first by id goes.
const NETWORKS_MAX: usize = 16;

/// Shares by service, and when they were worked out.
type Shares = (Timestamp, Arc<BTreeMap<String, Share>>);

/// The shares worked out lately, by network.
#[derive(Debug, Default)]
pub(super) struct Measured(Mutex<BTreeMap<String, Shares>>);

impl Dispatch {
    /// The shares of deliveries in time over a network, by service; of up to a minute ago.
    ///
    /// # Errors
    /// When there is no such network, or the store does not answer.
    pub(super) async fn measured_on_time(
        &self,
        network: &str,
    ) -> Result<Arc<BTreeMap<String, Share>>, Refusal> {
        let now = self.clock.now();
        let kept = {
            let kept = self.measured.0.lock();
            let kept = kept.unwrap_or_else(PoisonError::into_inner);
            kept.get(network).cloned()
        };
        let is_recent = |at: Timestamp| now.duration_since(at) < TOLD_FOR;
        if let Some((_, shares)) = kept.filter(|(at, _)| is_recent(*at)) {
            return Ok(shares);
        }
        // Shares are no secret of a provider: offers tell them to everyone.
        let anyone = Caller::anyone();
        let statistics = self.statistics(&anyone, network, None, None).await?;
        let lateness = statistics.lateness.into_iter();
        let shares = lateness.map(|service| (service.service_id, service.on_time));
        let shares = Arc::new(shares.collect::<BTreeMap<_, _>>());
        let mut kept = self
            .measured
            .0
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if kept.len() >= NETWORKS_MAX && !kept.contains_key(network) {
            kept.pop_first();
        }
        kept.insert(network.to_owned(), (now, shares.clone()));
        Ok(shares)
    }
}
