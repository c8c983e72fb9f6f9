//! `skyway delivery cancel`: a delivery, called off before its drone departs.

use crate::cli::edge::runtime;
use crate::cli::output::Output;
use crate::cli::registry_arguments::RegistryArguments;
use crate::cli::remote::{JSON, segment};
use crate::cli::stop::{Stop, Verdict};
use crate::wire::{Delivery, DeliveryStatus};
use clap::Args;

const EXAMPLES: &str = "\
Examples:
  skyway delivery cancel d-7f3a

Exit codes: 0 when it is cancelled, 1 for a failure or where its drone has departed, 2 for arguments that make no sense, \
4 when the registry cannot be reached. Where the edge that has its flight does not answer at once, it ends as soon as that does: \
`skyway delivery track` tells when.";

/// Arguments of `skyway delivery cancel`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Cancel {
    /// The delivery
    #[arg(value_name = "ID")]
    id: String,
    #[command(flatten)]
    registry: RegistryArguments,
    /// Write the delivery as JSON
    #[arg(long)]
    json: bool,
}

impl Cancel {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let remote = self.registry.remote()?;
        let path = format!("/v1/deliveries/{}/cancel", segment(&self.id));
        let asked = remote.post(&path, &[], (JSON, String::new()));
        let answer = runtime()?.block_on(asked)?;
        let delivery: Delivery = serde_json::from_slice(&answer).map_err(|error| {
            Stop::failed(format!("the registry's answer cannot be read: {error}"))
        })?;
        if self.json {
            output.json(&serde_json::to_value(&delivery).map_err(Stop::failed)?)?;
        } else {
            let reason = delivery.reason.iter().map(|reason| format!(": {reason}"));
            output.line(&format!(
                "{}{}",
                delivery.status.name(),
                reason.collect::<String>()
            ))?;
        }
        Ok(match delivery.status {
            DeliveryStatus::Cancelled => Verdict::Done,
            _ => Verdict::Negative,
        })
    }
}
