//! Tokens: which bearer is who. The file has digests only, so that who reads it cannot call the edge.
//!
//! A token is 256 random bits, so its plain SHA-256 digest cannot be guessed back, and to look a digest up
//! tells a listener nothing of the tokens by its timing.

use crate::access::{Caller, Role};
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
const TOKEN_PREFIX: &str = "sky_";
const TOKEN_BYTES: usize = 32;
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
        if tokens.is_empty() {
            return Err(TokensError::Empty {
                path: path.to_owned(),
            });
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

    /// When the file of tokens was last written, and how long it is: other tokens may be in it where that changes.
    ///
    /// # Errors
    /// When it cannot be looked at.
    #[expect(clippy::disallowed_methods, reason = "the door to the file of tokens")]
    pub fn stamp(path: &Path) -> io::Result<(Timestamp, u64)> {
        let found = std::fs::metadata(path)?;
        let written = Timestamp::try_from(found.modified()?).map_err(io::Error::other)?;
        Ok((written, found.len()))
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
        caller: caller(role, &entry.subject)?,
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

fn read_end(text: &str) -> Result<Timestamp, String> {
    let ends_at = text.parse();
    ends_at.map_err(|_| {
        format!("ends_at '{text}' is not an instant in RFC 3339, such as 2026-12-31T00:00:00Z")
    })
}

fn role_named(name: &str) -> Result<Role, String> {
    let role = Role::OF_TOKENS.into_iter().find(|role| role.name() == name);
    role.ok_or_else(|| format!("'{name}' is no role: write drone, operator, edge or metrics"))
}

fn caller(role: Role, subject: &str) -> Result<Caller, String> {
    let is_plain = !subject.chars().any(|c| c.is_control() || c.is_whitespace());
    if subject.is_empty() || subject.len() > MAX_SUBJECT_BYTES || !is_plain {
        return Err(format!(
            "the subject is not 1 to {MAX_SUBJECT_BYTES} characters without spaces; write a drone's id, a fleet, or *"
        ));
    }
    Ok(Caller {
        role,
        subject: Arc::from(subject),
    })
}

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
    /// Until when, where it has an end.
    pub ends_at: Option<Timestamp>,
}

impl NewToken {
    /// A token of so much randomness for a role, by its name, and a subject.
    ///
    /// # Errors
    /// When there is no such role, the subject is none, or the end no instant; what to write instead.
    pub fn of(
        random: &[u8; TOKEN_BYTES],
        role: &str,
        subject: &str,
        ends_at: Option<&str>,
    ) -> Result<Self, String> {
        let Caller { role, subject } = caller(role_named(role)?, subject)?;
        let token = format!("{TOKEN_PREFIX}{}", hex(random));
        Ok(Self {
            sha256: hex(&digest_of(&token)),
            token,
            role,
            subject,
            ends_at: ends_at.map(read_end).transpose()?,
        })
    }

    /// What to add to the file of tokens.
    pub fn stanza(&self) -> String {
        let subject = toml::Value::String(self.subject.to_string());
        let end = self
            .ends_at
            .map(|ends_at| format!("ends_at = \"{ends_at}\"\n"));
        format!(
            "[[token]]\nsha256 = \"{}\"\nrole = \"{}\"\nsubject = {subject}\n{}",
            self.sha256,
            self.role.name(),
            end.unwrap_or_default()
        )
    }
}

fn digest_of(token: &str) -> DigestBytes {
    Sha256::digest(token.as_bytes()).into()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn digest_from_hex(text: &str) -> Option<DigestBytes> {
    let digits: Option<Vec<u8>> = text
        .chars()
        .map(|c| c.to_digit(16).and_then(|digit| u8::try_from(digit).ok()))
        .collect();
    let digits = digits.filter(|digits| digits.len() == 2 * DIGEST_BYTES)?;
    let mut digest = [0; DIGEST_BYTES];
    for (byte, pair) in digest.iter_mut().zip(digits.chunks_exact(2)) {
        *byte = pair[0] << 4 | pair[1];
    }
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

    const RANDOM: [u8; TOKEN_BYTES] = [7; TOKEN_BYTES];
    const NOW: Timestamp = Timestamp::UNIX_EPOCH;

    fn stanza(role: &str, subject: &str) -> String {
        NewToken::of(&RANDOM, role, subject, None)
            .expect("a token")
            .stanza()
    }

    #[test]
    fn a_new_token_is_found_by_its_bearer_and_no_other() {
        let new = NewToken::of(&RANDOM, "drone", "acme", None).expect("a token");
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
            "", &leaked, &twice, &nobody, &blank, &extra, &endless, &no_digest, "[[token",
        ];
        let messages = messages.map(error);
        insta::assert_snapshot!(messages.join("\n"), @r"
    tokens.toml has no token; `skyway token` makes one
    tokens.toml:1: sha256 is not 64 hexadecimal digits; write the digest of the token, never the token itself
    tokens.toml:6: this token is in the file twice
    tokens.toml:1: 'anyone' is no role: write drone, operator, edge or metrics
    tokens.toml:1: the subject is not 1 to 128 characters without spaces; write a drone's id, a fleet, or *
    tokens.toml:5: unknown field `scope`, expected one of `sha256`, `role`, `subject`, `ends_at`
    tokens.toml:1: ends_at 'tomorrow' is not an instant in RFC 3339, such as 2026-12-31T00:00:00Z
    tokens.toml:6: sha256 is not 64 hexadecimal digits; write the digest of the token, never the token itself
    tokens.toml:1: unclosed array table, expected `]]`
    ");
    }

    #[test]
    fn a_token_counts_until_its_end_and_until_it_is_revoked() {
        let end = "1970-01-01T00:00:10Z";
        let new = NewToken::of(&RANDOM, "drone", "acme", Some(end)).expect("a token");
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
    fn a_subject_of_any_letters_survives_the_file() {
        let text = stanza("metrics", "a\"b\\ü");
        let tokens = Tokens::parse("tokens.toml", &text).expect("tokens");
        let token = format!("sky_{}", "07".repeat(32));
        let caller = tokens.find(&token, NOW).expect("a caller");
        assert_eq!(&*caller.subject, "a\"b\\ü");
    }
}
