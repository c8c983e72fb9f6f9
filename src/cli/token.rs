//! `skyway token`: a token for a drone, an operator, an edge, a collector of metrics, a provider or a customer.

use super::output::Output;
use super::stop::{Stop, Verdict};
use crate::config::NewToken;
use clap::Args;
use serde_json::json;

const EXAMPLES: &str = "\
Examples:
  skyway token --role operator --subject '*'            the token, and the lines to add to the file
  skyway token --role drone --subject acme --json       for a fleet: drones acme:1, acme:2, ...
  skyway token --role provider --tenant acme --subject desk
  (umask 077; skyway token --role drone --subject d-7 2>> tokens.toml > d-7.token)";

/// Arguments of `skyway token`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Token {
    /// What its bearer may do: drone, operator, edge, metrics, provider or customer
    #[arg(long)]
    role: String,
    /// To whose things: a drone's id, a fleet, or *
    #[arg(long)]
    subject: String,
    /// To which provider or customer it belongs, by its id; the others need none
    #[arg(long)]
    tenant: Option<String>,
    /// The only network that an edge speaks of at the registry, by its id there
    #[arg(long)]
    network: Option<String>,
    /// Until when it counts: an instant in RFC 3339; without one until it is revoked
    #[arg(long, value_name = "INSTANT")]
    ends_at: Option<String>,
    /// Write the token and its digest as JSON, and nothing to standard error
    #[arg(long)]
    json: bool,
}

impl Token {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let mut random = [0; 32];
        getrandom::fill(&mut random)
            .map_err(|error| Stop::failed(format!("the system has no random bits: {error}")))?;
        let (tenant, ends_at) = (self.tenant.as_deref(), self.ends_at.as_deref());
        let belongs = (tenant, self.network.as_deref());
        let new = NewToken::of(&random, &self.role, &self.subject, belongs, ends_at);
        let new = new.map_err(Stop::Usage)?;
        if self.json {
            output.json(&json!({
                "token": new.token,
                "sha256": new.sha256,
                "role": new.role.name(),
                "subject": *new.subject,
                "tenant": *new.tenant,
                "network": new.network.as_deref(),
                "ends_at": new.ends_at.map(|ends_at| ends_at.to_string()),
                "stanza": new.stanza(),
            }))?;
        } else {
            output.line(&new.token)?;
            output.note(new.stanza().trim_end());
        }
        Ok(Verdict::Done)
    }
}
