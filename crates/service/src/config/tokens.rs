//! Tokens: which bearer is who. The file has digests only, so that who reads it cannot call the edge.
//!
//! A token is 256 random bits, so its plain SHA-256 digest cannot be guessed back, and to look a digest up
//! tells a listener nothing of the tokens by its timing.

use crate::access::{Caller, LOCAL_TENANT, Role, TENANT_BYTES_MAX, is_tenant};
use jiff::Timestamp;
use serde::Deserialize;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, Read};
use std::path::Path;
use std::sync::Arc;
use thiserror::Error;

/// What every token begins with, so that people and scanners for leaked secrets know one.
pub(super) const TOKEN_PREFIX: &str = "sky_";
pub(super) const TOKEN_BYTES: usize = 32;
const DIGEST_BYTES: usize = 32;
/// Nothing larger is read: some ten thousand tokens.
const MAX_FILE_BYTES: u64 = 4 << 20;
/// No subject is longer; it is a drone's id, or a fleet's.
const MAX_SUBJECT_BYTES: usize = 128;

type DigestBytes = [u8; DIGEST_BYTES];

/// Why a file of tokens is of no use.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum TokensError {
    /// It cannot be read.
    #[error("cannot read {path}: {message}")]
    Unreadable {
        /// The file.
        path: String,
        /// What the system says.
        message: String,
    },
    /// Others than its owner may read or write it.
    #[error("others than its owner have access to {path} (mode {mode:03o}); chmod 600 {path}")]
    Exposed {
        /// The file.
        path: String,
        /// Its permissions.
        mode: u32,
    },
    /// It is not what a file of tokens should be.
    #[error("{path}:{line}: {message}")]
    Malformed {
        /// The file.
        path: String,
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// It has no token.
    #[error("{path} has no token; `skyway token` makes one")]
    Empty {
        /// The file.
        path: String,
    },
}

/// The tokens that are known, but for those that were revoked.
#[derive(Clone, Default, PartialEq, Eq)]
pub struct Tokens(BTreeMap<DigestBytes, KnownToken>);

/// Who comes with a token, and until when.
#[derive(Clone, Debug, PartialEq, Eq)]
struct KnownToken {
    caller: Caller,
    ends_at: Option<Timestamp>,
}

impl fmt::Debug for Tokens {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Tokens({})", self.0.len())
    }
}

/// The file, as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TokenFile {
    #[serde(default)]
    token: Vec<toml::Spanned<TokenEntry>>,
    #[serde(default)]
    revoked: Vec<toml::Spanned<RevokedEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RevokedEntry {
    sha256: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TokenEntry {
    sha256: String,
    role: String,
    subject: String,
    tenant: Option<String>,
    network: Option<String>,
    ends_at: Option<String>,
}

impl Tokens {
    /// Reads a file of tokens, which only its owner may have access to.
    ///
    /// # Errors
    /// When it cannot be read, is open to others, or is not what it should be.
    pub fn load(path: &Path) -> Result<Self, TokensError> {
        let name = path.display().to_string();
        let (text, mode) = read(path).map_err(|error| TokensError::Unreadable {
            path: name.clone(),
            message: error.to_string(),
        })?;
        match mode {
            Some(mode) if mode & 0o077 != 0 => Err(TokensError::Exposed { path: name, mode }),
            _ => Self::parse(&name, &text),
        }
    }

    /// Reads the text of a file of tokens; `path` is for errors.
    ///
    /// # Errors
    /// When it is not what it should be, at the first place where it is not.
    pub fn parse(path: &str, text: &str) -> Result<Self, TokensError> {
        let malformed = |offset: usize, message: String| TokensError::Malformed {
            path: path.to_owned(),
            line: 1 + text
                .bytes()
                .take(offset)
                .filter(|byte| *byte == b'\n')
                .count(),
            message,
        };
        let file: TokenFile = toml::from_str(text).map_err(|error| {
            let offset = error.span().map_or(0, |span| span.start);
            malformed(offset, error.message().to_owned())
        })?;
        let mut tokens = BTreeMap::new();
        for entry in file.token {
            let offset = entry.span().start;
            let (digest, known) =
                read_entry(entry.get_ref()).map_err(|message| malformed(offset, message))?;
            if tokens.insert(digest, known).is_some() {
                return Err(malformed(
                    offset,
                    "this token is in the file twice".to_owned(),
                ));
            }
        }
        for entry in file.revoked {
            let digest = read_digest(&entry.get_ref().sha256);
            let digest = digest.map_err(|message| malformed(entry.span().start, message))?;
            tokens.remove(&digest);
        }
        Ok(Self(tokens))
    }

    /// Who comes with this token, unless it has ended or was revoked.
    pub fn find(&self, bearer: &str, now: Timestamp) -> Option<Caller> {
        let known = self.0.get(&digest_of(bearer))?;
        let has_ended = known.ends_at.is_some_and(|ends_at| ends_at <= now);
        (!has_ended).then(|| known.caller.clone())
    }

    /// When the next one ends.
    pub fn next_end(&self, now: Timestamp) -> Option<Timestamp> {
        let ends = self.0.values().filter_map(|known| known.ends_at);
        ends.filter(|ends_at| *ends_at > now).min()
    }

    /// Whether there is none: no caller is let in.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// When the file of tokens, or who has access to it, was last changed, and how long it is: other tokens may be in it where
    /// that changes.
    ///
    /// # Errors
    /// When it cannot be looked at.
    #[expect(clippy::disallowed_methods, reason = "the door to the file of tokens")]
    pub fn stamp(path: &Path) -> io::Result<(Timestamp, u64)> {
        let found = std::fs::metadata(path)?;
        Ok((changed_at(&found)?, found.len()))
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.0.len()
    }
}

/// Reads the token that this process itself shows to another, from a file which only its owner may have access to.
///
/// # Errors
/// When the file cannot be read, is open to others, or has anything but one token.
pub fn read_bearer(path: &Path) -> Result<String, TokensError> {
    let name = path.display().to_string();
    let (text, mode) = read(path).map_err(|error| TokensError::Unreadable {
        path: name.clone(),
        message: error.to_string(),
    })?;
    if let Some(mode) = mode.filter(|mode| mode & 0o077 != 0) {
        return Err(TokensError::Exposed { path: name, mode });
    }
    let token = text.trim();
    let is_plain = token.chars().all(|letter| letter.is_ascii_graphic());
    match token.is_empty() || !is_plain {
        // What stands there is not repeated in the message.
        true => Err(TokensError::Malformed {
            path: name,
            line: 1,
            message: "it is not one token alone; write what `skyway token` printed".to_owned(),
        }),
        false => Ok(token.to_owned()),
    }
}

fn read_entry(entry: &TokenEntry) -> Result<(DigestBytes, KnownToken), String> {
    let digest = read_digest(&entry.sha256)?;
    let role = role_named(&entry.role)?;
    let known = KnownToken {
        caller: Caller {
            network: network_of(role, entry.network.as_deref())?,
            ..caller(role, &entry.subject, entry.tenant.as_deref())?
        },
        ends_at: entry.ends_at.as_deref().map(read_end).transpose()?,
    };
    Ok((digest, known))
}

fn read_digest(text: &str) -> Result<DigestBytes, String> {
    // What stands there may be a token put there by mistake: it is not repeated in the message.
    digest_from_hex(text).ok_or_else(|| {
        "sha256 is not 64 hexadecimal digits; write the digest of the token, never the token itself"
            .to_owned()
    })
}

pub(super) fn read_end(text: &str) -> Result<Timestamp, String> {
    let ends_at = text.parse();
    ends_at.map_err(|_| {
        format!("ends_at '{text}' is not an instant in RFC 3339, such as 2026-12-31T00:00:00Z")
    })
}

pub(super) fn role_named(name: &str) -> Result<Role, String> {
    let role = Role::OF_TOKENS.into_iter().find(|role| role.name() == name);
    role.ok_or_else(|| {
        format!("'{name}' is no role: write drone, operator, edge, metrics, provider or customer")
    })
}

fn tenant_of(role: Role, tenant: Option<&str>) -> Result<&str, String> {
    match tenant {
        Some(tenant) if is_tenant(tenant) => Ok(tenant),
        Some(tenant) => Err(format!(
            "the tenant '{tenant}' is not 1 to {TENANT_BYTES_MAX} letters, digits, '-', '_' and '.'"
        )),
        None if role.is_of_tenant() => Err(format!(
            "a {} needs a tenant; write the id of the {}",
            role.name(),
            role.name()
        )),
        None => Ok(LOCAL_TENANT),
    }
}

pub(super) fn caller(role: Role, subject: &str, tenant: Option<&str>) -> Result<Caller, String> {
    let tenant = tenant_of(role, tenant)?;
    let is_plain = !subject.chars().any(|c| c.is_control() || c.is_whitespace());
    if subject.is_empty() || subject.len() > MAX_SUBJECT_BYTES || !is_plain {
        return Err(format!(
            "the subject is not 1 to {MAX_SUBJECT_BYTES} characters without spaces; write a drone's id, a fleet, or *"
        ));
    }
    // What counts per subject, such as idempotency keys, is not shared between tenants that chose the same one.
    let subject = match role.is_of_tenant() {
        true => format!("{tenant}/{subject}"),
        false => subject.to_owned(),
    };
    Ok(Caller {
        role,
        subject: Arc::from(subject),
        tenant: Arc::from(tenant),
        network: None,
    })
}

/// The network that an edge is kept to, where one is named.
pub(super) fn network_of(role: Role, network: Option<&str>) -> Result<Option<Arc<str>>, String> {
    match network {
        Some(_) if role != Role::Edge => Err(format!(
            "a token of the role {} is kept to no network; leave network out",
            role.name()
        )),
        Some(name) if name.is_empty() || name.chars().any(char::is_control) => {
            Err("the network has no name; write its id at the registry".to_owned())
        }
        network => Ok(network.map(Arc::from)),
    }
}

pub(super) fn digest_of(token: &str) -> DigestBytes {
    Sha256::digest(token.as_bytes()).into()
}

fn digest_from_hex(text: &str) -> Option<DigestBytes> {
    let mut digest = [0; DIGEST_BYTES];
    hex::decode_to_slice(text, &mut digest).ok()?;
    Some(digest)
}

/// The text of a file and, where the system has them, its permissions.
#[expect(clippy::disallowed_types, reason = "the door to the file of tokens")]
fn read(path: &Path) -> io::Result<(String, Option<u32>)> {
    let file = std::fs::File::open(path)?;
    // Of the file that is open: by its name it could be another one a moment later.
    let mode = permissions(&file.metadata()?);
    let mut text = String::new();
    file.take(MAX_FILE_BYTES + 1).read_to_string(&mut text)?;
    if text.len() as u64 > MAX_FILE_BYTES {
        let message = format!("it is larger than {} MiB", MAX_FILE_BYTES >> 20);
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    Ok((text, mode))
}

/// When a file, or who has access to it, was last changed.
#[cfg(unix)]
fn changed_at(metadata: &std::fs::Metadata) -> io::Result<Timestamp> {
    use std::os::unix::fs::MetadataExt;
    let nanoseconds = i32::try_from(metadata.ctime_nsec()).map_err(io::Error::other)?;
    Timestamp::new(metadata.ctime(), nanoseconds).map_err(io::Error::other)
}

#[cfg(not(unix))]
fn changed_at(metadata: &std::fs::Metadata) -> io::Result<Timestamp> {
    Timestamp::try_from(metadata.modified()?).map_err(io::Error::other)
}

#[cfg(unix)]
pub(super) fn permissions(metadata: &std::fs::Metadata) -> Option<u32> {
    use std::os::unix::fs::PermissionsExt;
    Some(metadata.permissions().mode() & 0o777)
}

#[cfg(not(unix))]
pub(super) fn permissions(_: &std::fs::Metadata) -> Option<u32> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::NewToken;

    const RANDOM: [u8; TOKEN_BYTES] = [7; TOKEN_BYTES];
    const NOW: Timestamp = Timestamp::UNIX_EPOCH;

    fn stanza(role: &str, subject: &str) -> String {
        NewToken::of(&RANDOM, role, subject, (None, None), None)
            .expect("a token")
            .stanza()
    }

    #[test]
    fn a_new_token_is_found_by_its_bearer_and_no_other() {
        let new = NewToken::of(&RANDOM, "drone", "acme", (None, None), None).expect("a token");
        assert_eq!(new.token, format!("sky_{}", "07".repeat(32)));
        let tokens = Tokens::parse("tokens.toml", &new.stanza()).expect("tokens");
        let caller = tokens.find(&new.token, NOW).expect("a caller");
        assert_eq!((caller.role, &*caller.subject), (Role::Drone, "acme"));
        for other in [
            "",
            "sky_",
            &new.sha256,
            &new.token.to_uppercase(),
            &new.token[1..],
        ] {
            assert_eq!(tokens.find(other, NOW), None, "{other}");
        }
        assert_eq!(format!("{tokens:?}"), "Tokens(1)");
    }

    #[test]
    fn what_is_wrong_with_a_file_is_told_with_its_line_and_without_its_secrets() {
        let error = |text: &str| {
            let error = Tokens::parse("tokens.toml", text).expect_err("an error");
            error.to_string()
        };
        let good = stanza("operator", "*");
        let leaked = good.replace("sha256 = \"", "sha256 = \"sky_secret");
        let twice = format!("{good}\n{good}");
        let nobody = good.replace("operator", "anyone");
        let blank = good.replace('*', "");
        let extra = format!("{good}scope = \"all\"\n");
        let endless = format!("{good}ends_at = \"tomorrow\"\n");
        let no_digest = format!("{good}\n[[revoked]]\nsha256 = \"sky_secret\"\n");
        let messages = [
            &leaked, &twice, &nobody, &blank, &extra, &endless, &no_digest, "[[token",
        ];
        let messages = messages.map(error);
        insta::assert_snapshot!(messages.join("\n"), @r"
    tokens.toml:1: sha256 is not 64 hexadecimal digits; write the digest of the token, never the token itself
    tokens.toml:6: this token is in the file twice
    tokens.toml:1: 'anyone' is no role: write drone, operator, edge, metrics, provider or customer
    tokens.toml:1: the subject is not 1 to 128 characters without spaces; write a drone's id, a fleet, or *
    tokens.toml:5: unknown field `scope`, expected one of `sha256`, `role`, `subject`, `tenant`, `network`, `ends_at`
    tokens.toml:1: ends_at 'tomorrow' is not an instant in RFC 3339, such as 2026-12-31T00:00:00Z
    tokens.toml:6: sha256 is not 64 hexadecimal digits; write the digest of the token, never the token itself
    tokens.toml:1: unclosed array table, expected `]]`
    ");
    }

    #[test]
    fn a_token_counts_until_its_end_and_until_it_is_revoked() {
        let end = "1970-01-01T00:00:10Z";
        let new = NewToken::of(&RANDOM, "drone", "acme", (None, None), Some(end)).expect("a token");
        let text = new.stanza();
        let tokens = Tokens::parse("tokens.toml", &text).expect("tokens");
        let at = |second| Timestamp::from_second(second).expect("an instant");
        assert!(tokens.find(&new.token, at(9)).is_some());
        assert_eq!(tokens.find(&new.token, at(10)), None);
        assert_eq!(tokens.next_end(at(9)), Some(at(10)));
        assert_eq!(tokens.next_end(at(10)), None);

        let revoked = format!("{text}\n[[revoked]]\nsha256 = \"{}\"\n", new.sha256);
        let tokens = Tokens::parse("tokens.toml", &revoked).expect("tokens");
        assert_eq!(tokens.find(&new.token, at(9)), None);
    }

    #[test]
    fn a_provider_has_a_tenant_and_a_subject_of_its_own() {
        let too_long = "a".repeat(65);
        let of = |role, tenant| NewToken::of(&RANDOM, role, "desk", (tenant, None), None);
        let new = of("provider", Some("acme")).expect("a token");
        let tokens = Tokens::parse("tokens.toml", &new.stanza()).expect("tokens");
        let caller = tokens.find(&new.token, NOW).expect("a caller");
        assert_eq!((&*caller.tenant, &*caller.subject), ("acme", "acme/desk"));
        for role in ["provider", "customer"] {
            let error = of(role, None).err().expect("no tenant");
            assert!(error.contains("needs a tenant"), "{error}");
        }
        for tenant in ["", "a:b", "a/b", "a b", &too_long] {
            assert!(of("provider", Some(tenant)).is_err(), "{tenant}");
        }
        let drone = of("drone", None).expect("a token");
        let tokens = Tokens::parse("tokens.toml", &drone.stanza()).expect("tokens");
        let caller = tokens.find(&drone.token, NOW).expect("a caller");
        assert_eq!((&*caller.tenant, &*caller.subject), ("local", "desk"));
    }

    #[test]
    fn an_edge_alone_may_be_kept_to_a_network() {
        let of = |role, network| NewToken::of(&RANDOM, role, "edge-1", (None, network), None);
        let new = of("edge", Some("sydney")).expect("a token");
        let tokens = Tokens::parse("tokens.toml", &new.stanza()).expect("tokens");
        let caller = tokens.find(&new.token, NOW).expect("a caller");
        assert!(caller.is_of_network("sydney") && !caller.is_of_network("melbourne"));
        assert!(Caller::local(Role::Edge, "edge-1").is_of_network("melbourne"));
        for (role, network) in [("drone", "sydney"), ("operator", "sydney"), ("edge", "")] {
            assert!(of(role, Some(network)).is_err(), "{role} {network}");
        }
    }

    #[test]
    fn a_subject_of_any_letters_survives_the_file() {
        let text = stanza("metrics", "a\"b\\ü");
        let tokens = Tokens::parse("tokens.toml", &text).expect("tokens");
        let token = format!("sky_{}", "07".repeat(32));
        let caller = tokens.find(&token, NOW).expect("a caller");
        assert_eq!(&*caller.subject, "a\"b\\ü");
    }
}
