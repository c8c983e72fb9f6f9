//! A token just made, and the lines that a file of tokens has of it.

use super::tokens::{
    TOKEN_BYTES, TOKEN_PREFIX, caller, digest_of, network_of, read_end, role_named,
};
use crate::access::{Caller, LOCAL_TENANT, Role};
use jiff::Timestamp;
use std::sync::Arc;

/// A token just made. The token itself is told once and kept nowhere.
pub struct NewToken {
    /// What the bearer sends.
    pub token: String,
    /// What the file has, in hexadecimal.
    pub sha256: String,
    /// What it may do.
    pub role: Role,
    /// To whose things.
    pub subject: Arc<str>,
    /// To which tenant its bearer belongs.
    pub tenant: Arc<str>,
    /// To which network an edge is kept.
    pub network: Option<Arc<str>>,
    /// Until when, where it has an end.
    pub ends_at: Option<Timestamp>,
}

impl NewToken {
    /// A token of so much randomness for a role, by its name, a subject, and a tenant: the local one where none is named; an
    /// edge may be kept to a network.
    ///
    /// # Errors
    /// When there is no such role, the subject or the tenant is none, the role none that is kept to a network, or the end
    /// no instant; what to write instead.
    pub fn of(
        random: &[u8; TOKEN_BYTES],
        role: &str,
        subject: &str,
        (tenant, network): (Option<&str>, Option<&str>),
        ends_at: Option<&str>,
    ) -> Result<Self, String> {
        let Caller { role, tenant, .. } = caller(role_named(role)?, subject, tenant)?;
        let token = format!("{TOKEN_PREFIX}{}", hex::encode(random));
        Ok(Self {
            sha256: hex::encode(digest_of(&token)),
            token,
            role,
            subject: Arc::from(subject),
            tenant,
            network: network_of(role, network)?,
            ends_at: ends_at.map(read_end).transpose()?,
        })
    }

    /// What to add to the file of tokens.
    pub fn stanza(&self) -> String {
        let subject = toml::Value::String(self.subject.to_string());
        let tenant = Some(&self.tenant).filter(|tenant| &***tenant != LOCAL_TENANT);
        let tenant = tenant.map(|tenant| format!("tenant = \"{tenant}\"\n"));
        let network = self.network.as_deref().map(|network| {
            let network = toml::Value::String(network.to_owned());
            format!("network = {network}\n")
        });
        let end = self
            .ends_at
            .map(|ends_at| format!("ends_at = \"{ends_at}\"\n"));
        format!(
            "[[token]]\nsha256 = \"{}\"\nrole = \"{}\"\nsubject = {subject}\n{}{}{}",
            self.sha256,
            self.role.name(),
            tenant.unwrap_or_default(),
            network.unwrap_or_default(),
            end.unwrap_or_default()
        )
    }
}
