//! `skyway delivery track`: a delivery, followed until it ends.

use crate::cli::edge::runtime;
use crate::cli::output::Output;
use crate::cli::registry_arguments::RegistryArguments;
use crate::cli::remote::{Remote, segment};
use crate::cli::stop::{Stop, Verdict};
use crate::wire::{DeliveryStatus, DeliveryTrack};
use clap::Args;
use serde_json::Value;
use std::time::Duration;

/// How often in a row a stream that told nothing is begun again.
const ATTEMPTS: u32 = 10;
/// And after which time.
const AGAIN_AFTER: Duration = Duration::from_secs(1);

const EXAMPLES: &str = "\
Examples:
  skyway delivery track d-7f3a
  skyway delivery track d-7f3a --json --registry https://registry.example --token-file shop.token

Exit codes: 0 when it is delivered, 1 when it ends otherwise or for a failure, 2 for arguments that make no sense, \
4 when the registry cannot be reached.";

/// Arguments of `skyway delivery track`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Track {
    /// The delivery
    #[arg(value_name = "ID")]
    id: String,
    #[command(flatten)]
    registry: RegistryArguments,
    /// Write each event as a line of JSON
    #[arg(long)]
    json: bool,
}

impl Track {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let remote = self.registry.remote()?;
        let ended_as = runtime()?.block_on(self.follow(&remote, output))?;
        Ok(match ended_as {
            DeliveryStatus::Delivered => Verdict::Done,
            _ => Verdict::Negative,
        })
    }

    /// Tells what changes until the delivery has ended; tells how.
    async fn follow(&self, remote: &Remote, output: &Output) -> Result<DeliveryStatus, Stop> {
        let path = format!("/v1/deliveries/{}/track", segment(&self.id));
        let (mut failed, mut told) = (0, String::new());
        loop {
            let begun = remote.events(&path).await;
            let mut events = match begun {
                Ok(events) => events,
                Err(Stop::Unreachable(message)) if failed < ATTEMPTS => {
                    failed += 1;
                    output.warn(&message);
                    tokio::time::sleep(AGAIN_AFTER).await;
                    continue;
                }
                Err(stop) => return Err(stop),
            };
            let mut is_silent = true;
            while let Some(data) = events.next().await {
                (failed, is_silent) = (0, false);
                let track: DeliveryTrack = serde_json::from_str(&data).map_err(|error| {
                    Stop::failed(format!("the registry's event cannot be read: {error}"))
                })?;
                // A drone tells its place each second, also where it stands.
                let line = self.line(&track)?;
                if line != told {
                    output.line(&line)?;
                    told = line;
                }
                if track.status.is_final() {
                    return Ok(track.status);
                }
            }
            if is_silent {
                // A stream begins with what is known, so that one without an event is none of a registry.
                let message = format!("{path} ended without an event");
                if failed == ATTEMPTS {
                    return Err(Stop::failed(message));
                }
                failed += 1;
                output.warn(&message);
            }
            tokio::time::sleep(AGAIN_AFTER).await;
        }
    }

    fn line(&self, track: &DeliveryTrack) -> Result<String, Stop> {
        if self.json {
            let event: Value = serde_json::to_value(track).map_err(Stop::failed)?;
            return Ok(event.to_string());
        }
        let mut line = track.status.name().to_owned();
        if let Some(expected_at) = &track.expected_at {
            line += &format!(", expected at {expected_at}");
        }
        if let Some(place) = &track.place {
            line += &format!(", at {:.5},{:.5}", place.lon, place.lat);
            if let Some(battery_fraction) = place.battery_fraction {
                line += &format!(", battery {:.0} %", battery_fraction * 100.0);
            }
        }
        if let Some(reason) = &track.reason {
            line += &format!(": {reason}");
        }
        Ok(line)
    }
}
