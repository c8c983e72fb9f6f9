//! What a registry says of itself to its keepers, and what it counts.

use super::Registry;
use super::store::NetworkState;
use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, EncodeMetric};
use prometheus_client::metrics::counter::ConstCounter;
use prometheus_client::metrics::gauge::ConstGauge;
use prometheus_client::registry::Registry as Metrics;
use serde::Serialize;
use skyway_service::refusal::Refusal;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// How a registry stands: counts and bounds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Status {
    /// Version of the program.
    pub version: &'static str,
    /// Which registry.
    pub registry_id: String,
    /// Which life of it.
    pub epoch: u64,
    /// Networks.
    pub networks: usize,
    /// Zones over all of them.
    pub zones: u64,
    /// Closures on all of them, ended ones too.
    pub closures: u64,
    /// Revisions that can be followed, of all of them.
    pub revisions: u64,
    /// Those who wait for changes.
    pub waiting: usize,
    /// Edges heard since the start.
    pub edges: usize,
    /// What is counted since the start.
    #[serde(flatten)]
    pub counted: Counted,
}

/// What is counted since the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Counted {
    /// Writes committed.
    pub commits: u64,
    /// Writes decided anew because others got in between.
    pub moved: u64,
    /// Writes that the store did not take.
    pub store_failures: u64,
    /// Commits that could not be remembered beside the store.
    pub high_water_failures: u64,
    /// Times that old revisions were dropped.
    pub compactions: u64,
}

impl Registry {
    /// How the registry stands.
    ///
    /// # Errors
    /// When the store does not answer.
    pub async fn status(&self) -> Result<Status, Refusal> {
        let identity = self.store.identity().await?;
        let networks = self.store.networks().await?;
        let sum = |of: fn(&NetworkState) -> u64| -> u64 { networks.iter().map(of).sum() };
        Ok(Status {
            version: env!("CARGO_PKG_VERSION"),
            registry_id: identity.registry_id,
            epoch: identity.epoch,
            networks: networks.len(),
            zones: sum(|state| state.zones),
            closures: sum(|state| state.closures),
            revisions: sum(|state| state.head - state.oldest),
            waiting: self.heads.waiting(),
            edges: self.followers.count(),
            counted: self.counted(),
        })
    }

    fn counted(&self) -> Counted {
        let value = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        Counted {
            commits: value(&self.counts.commits),
            moved: value(&self.counts.moved),
            store_failures: value(&self.counts.store_failures),
            high_water_failures: value(&self.counts.high_water_failures),
            compactions: value(&self.counts.compactions),
        }
    }

    /// Adds the figures of this registry to what is collected.
    pub fn register_metrics(self: &Arc<Self>, metrics: &mut Metrics) {
        let registry = self.clone();
        metrics.register_collector(Box::new(RegistryCollector { registry }));
    }
}

/// Reads the figures of a registry that need no question to its store.
#[derive(Debug)]
struct RegistryCollector {
    registry: Arc<Registry>,
}

impl Collector for RegistryCollector {
    fn encode(&self, mut encoder: DescriptorEncoder<'_>) -> Result<(), fmt::Error> {
        let registry = &self.registry;
        let gauges = [
            (
                "waiting",
                "Requests that wait for changes",
                registry.heads.waiting(),
            ),
            (
                "edges",
                "Edges heard since the start",
                registry.followers.count(),
            ),
            (
                "store_answers",
                "Whether the store answered when it was last asked",
                usize::from(registry.is_ready()),
            ),
        ];
        for (name, help, value) in gauges {
            let metric = ConstGauge::new(i64::try_from(value).unwrap_or(i64::MAX));
            let kind = metric.metric_type();
            metric.encode(encoder.encode_descriptor(name, help, None, kind)?)?;
        }
        let counted = registry.counted();
        let counters = [
            ("commits", "Writes committed", counted.commits),
            (
                "writes_moved",
                "Writes decided anew because others got in between",
                counted.moved,
            ),
            (
                "store_failures",
                "Writes that the store did not take",
                counted.store_failures,
            ),
            (
                "high_water_failures",
                "Commits that could not be remembered beside the store",
                counted.high_water_failures,
            ),
            (
                "compactions",
                "Times that old revisions were dropped",
                counted.compactions,
            ),
        ];
        for (name, help, value) in counters {
            let metric = ConstCounter::new(value);
            let kind = metric.metric_type();
            metric.encode(encoder.encode_descriptor(name, help, None, kind)?)?;
        }
        Ok(())
    }
}
