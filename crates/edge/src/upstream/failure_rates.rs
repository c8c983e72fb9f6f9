//! How often what fails where: the registry works it out of what all edges have told, and this edge pulls it, to tell it while
//! the registry is away.

use crate::Edge;
use skyway_contract::{FailureRate, FailureRates, NetworkStatistics};
use skyway_service::access::Caller;
use skyway_service::intake::Faults;
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;

/// The most rates that are kept; the most frequent come first.
const RATES_MAX: usize = 10_000;

impl Edge {
    /// Keeps what the registry has worked out, in place of what it told before.
    pub(crate) fn keep_failure_rates(&self, mut statistics: NetworkStatistics) {
        statistics.failures.truncate(RATES_MAX);
        self.failure_rates.store(Some(Arc::new(statistics)));
    }

    /// How often what fails, on all segments or on one; none while the registry has told nothing.
    ///
    /// # Errors
    /// When the network has no such segment.
    pub fn failure_rates(
        &self,
        _caller: &Caller,
        segment: Option<&str>,
    ) -> Result<FailureRates<'static>, Refusal> {
        let snapshot = self.on_network()?;
        let mut faults = Faults::default();
        segment.and_then(|id| faults.segment("?segment", snapshot.topology(), id));
        faults.check(Code::ParameterInvalid, "query")?;
        let told = self.failure_rates.load_full();
        let rates = told.iter().flat_map(|told| &told.failures);
        let is_asked =
            |rate: &&FailureRate| segment.is_none() || rate.segment.as_deref() == segment;
        Ok(FailureRates {
            from: told.as_ref().map(|told| told.from.clone()),
            until: told.as_ref().map(|told| told.until.clone()),
            failures: rates.filter(is_asked).cloned().collect(),
            stamp: self.stamp_of(&snapshot),
        })
    }
}
