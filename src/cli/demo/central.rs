//! The registry of a demo, which can be taken away and brought back while edges go on.

use super::super::stop::Stop;
use crate::config::RegistryConfig;
use crate::process::registry::{RegistryService, RegistryStart};
use crate::registry::WriteOptions;
use jiff::Timestamp;
use std::net::SocketAddr;

/// The id of the demo's network at its registry.
pub(super) const NETWORK: &str = "sydney";

/// A registry that runs, or could.
pub(super) struct Central {
    config: RegistryConfig,
    running: Option<RegistryService>,
}

impl Central {
    /// Starts a registry and puts a network into it.
    pub(super) async fn start(config: RegistryConfig, geojson: &str) -> Result<Self, Stop> {
        let mut central = Self {
            config,
            running: None,
        };
        let service = central.run().await?;
        let manner = WriteOptions {
            subject: "demo".to_owned(),
            key: None,
            fingerprint: String::new(),
            if_match: None,
            validate_only: false,
            on_behalf_of: None,
        };
        let put = service.registry().put_network(NETWORK, geojson, &manner);
        put.await
            .map_err(|refusal| Stop::failed(refusal.to_string()))?;
        // It comes back where it was.
        central.config.listen = service.addresses().listen;
        central.config.admin_listen = service.addresses().admin;
        central.running = Some(service);
        Ok(central)
    }

    /// Where it is reached while it runs.
    pub(super) fn address(&self) -> SocketAddr {
        self.config.listen
    }

    /// Takes the registry away, or brings it back at this time; gives whether it runs now.
    pub(super) async fn toggle(&mut self, now: Timestamp) -> Result<bool, Stop> {
        match self.running.take() {
            Some(service) => {
                service.stop().await.map_err(Stop::failed)?;
                Ok(false)
            }
            None => {
                self.config.clock.start = Some(now);
                self.running = Some(self.run().await?);
                Ok(true)
            }
        }
    }

    /// Ends it, if it runs.
    pub(super) async fn end(self) -> Result<(), Stop> {
        match self.running {
            Some(service) => service.stop().await.map(drop).map_err(Stop::failed),
            None => Ok(()),
        }
    }

    async fn run(&self) -> Result<RegistryService, Stop> {
        let start = RegistryStart {
            config: self.config.clone(),
            tokens: None,
            new_epoch: false,
        };
        RegistryService::start(start).await.map_err(Stop::failed)
    }
}
