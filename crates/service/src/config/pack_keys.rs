//! The keys that packs are signed with: the one that signs, and the public halves of those that did.
//!
//! They lie in a file of their own, which only its owner may read. `skyway pack rotate` and `skyway pack revoke` write it, and
//! a running edge reads it again.

use crate::pack::KeyId;
use crate::pack::write::SigningKey;
use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Nothing larger is read: some thousand keys.
const MAX_FILE_BYTES: u64 = 1 << 20;
/// What stands at the head of a file.
const HEAD: &str =
    "# The keys that an edge signs packs with. Whoever reads this file can sign in its name.\n";

/// Why keys are of no use.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PackKeysError {
    /// The file cannot be read or written.
    #[error("cannot use {path}: {message}")]
    Unusable {
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
    /// It is not what a file of keys should be.
    #[error("{path}: {message}")]
    Malformed {
        /// The file.
        path: String,
        /// What is wrong.
        message: String,
    },
    /// There is no key of this id.
    #[error("there is no key {0}")]
    Unknown(String),
    /// The key that signs cannot be revoked.
    #[error("{0} is the key that signs; rotate first")]
    Signs(String),
}

/// A key that was, or is, signed with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PackKey {
    /// Its public half.
    pub public: [u8; 32],
    /// From when it signs.
    pub made_at: Timestamp,
    /// Since when another one signs.
    pub retired_at: Option<Timestamp>,
    /// Since when nothing that it has signed is to be believed.
    pub revoked_at: Option<Timestamp>,
}

impl PackKey {
    /// Its id.
    pub fn id(&self) -> KeyId {
        KeyId::of(&self.public)
    }

    /// Its public half as text.
    pub fn public_text(&self) -> String {
        BASE64.encode(self.public)
    }
}

/// The keys of an edge.
#[derive(Clone, Debug)]
pub struct PackKeys {
    signing: SigningKey,
    seed: [u8; 32],
    /// In the order in which they were made; the last one signs.
    keys: Vec<PackKey>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct KeysFile {
    key: Vec<KeyEntry>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct KeyEntry {
    public: String,
    made_at: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    retired_at: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    revoked_at: Option<String>,
    /// Of the one that signs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    seed: Option<String>,
}

impl PackKeys {
    /// One key, made of 32 random bytes.
    pub fn of_seed(seed: [u8; 32], now: Timestamp) -> Self {
        let signing = SigningKey::of_seed(&seed);
        let key = PackKey {
            public: signing.public(),
            made_at: now,
            retired_at: None,
            revoked_at: None,
        };
        Self {
            signing,
            seed,
            keys: vec![key],
        }
    }

    /// The key that signs.
    pub fn signing(&self) -> &SigningKey {
        &self.signing
    }

    /// All of them, in the order in which they were made.
    pub fn keys(&self) -> &[PackKey] {
        &self.keys
    }

    /// A new key signs; the one before is retired.
    #[must_use]
    pub fn rotated(mut self, seed: [u8; 32], now: Timestamp) -> Self {
        if let Some(last) = self.keys.last_mut() {
            last.retired_at = Some(now);
        }
        let new = Self::of_seed(seed, now);
        self.keys.extend(new.keys);
        Self {
            keys: self.keys,
            ..new
        }
    }

    /// Nothing that a key has signed is to be believed any more.
    ///
    /// # Errors
    /// When there is no such key, or it is the one that signs.
    pub fn revoked(self, id: &str, now: Timestamp) -> Result<Self, PackKeysError> {
        if self.signing.id().to_string() == id {
            return Err(PackKeysError::Signs(id.to_owned()));
        }
        let key = self.keys.iter().find(|key| key.id().to_string() == id);
        let key = key.ok_or_else(|| PackKeysError::Unknown(id.to_owned()))?;
        let id = key.id();
        Ok(self.with_revoked(id, now))
    }

    /// The same with a key revoked, if it is one of them that does not sign.
    #[must_use]
    pub fn with_revoked(mut self, id: KeyId, now: Timestamp) -> Self {
        let signing = self.signing.id();
        let mut keys = self.keys.iter_mut();
        if let Some(key) = keys.find(|key| key.id() == id && id != signing) {
            key.revoked_at = key.revoked_at.or(Some(now));
        }
        self
    }

    /// The text of a file with these keys.
    pub fn text(&self) -> String {
        let entry = |key: &PackKey| KeyEntry {
            public: key.public_text(),
            made_at: key.made_at.to_string(),
            retired_at: key.retired_at.map(|at| at.to_string()),
            revoked_at: key.revoked_at.map(|at| at.to_string()),
            seed: (key.public == self.signing.public()).then(|| BASE64.encode(self.seed)),
        };
        let file = KeysFile {
            key: self.keys.iter().map(entry).collect(),
        };
        // Text and instants always have a form in TOML.
        HEAD.to_owned() + &toml::to_string(&file).unwrap_or_default()
    }

    /// Reads the text of a file of keys; `path` is for errors, which repeat nothing of the text.
    ///
    /// # Errors
    /// When it is not what it should be.
    pub fn parse(path: &str, text: &str) -> Result<Self, PackKeysError> {
        let malformed = |message: &str| PackKeysError::Malformed {
            path: path.to_owned(),
            message: message.to_owned(),
        };
        let file: KeysFile = toml::from_str(text).map_err(|error| malformed(error.message()))?;
        let Some((last, _)) = file.key.split_last() else {
            return Err(malformed("it has no key; `skyway pack rotate` makes one"));
        };
        let seed = last.seed.as_deref().and_then(bytes);
        let seed = seed.ok_or_else(|| malformed("the last key has no seed of 32 bytes"))?;
        let signing = SigningKey::of_seed(&seed);
        let instant = |text: &String| {
            text.parse::<Timestamp>()
                .map_err(|_| malformed("an instant is not in RFC 3339"))
        };
        let mut keys = Vec::with_capacity(file.key.len());
        for entry in &file.key {
            keys.push(PackKey {
                public: bytes(&entry.public)
                    .ok_or_else(|| malformed("a public key is not 32 bytes in base64"))?,
                made_at: instant(&entry.made_at)?,
                retired_at: entry.retired_at.as_ref().map(instant).transpose()?,
                revoked_at: entry.revoked_at.as_ref().map(instant).transpose()?,
            });
        }
        let is_whole = keys.last().is_some_and(|last| {
            let is_over = last.retired_at.or(last.revoked_at).is_some();
            last.public == signing.public() && !is_over
        });
        match is_whole {
            true => Ok(Self {
                signing,
                seed,
                keys,
            }),
            false => Err(malformed(
                "the seed of the last key is not that of its public half, or it is retired",
            )),
        }
    }

    /// Reads a file of keys; `None` where there is none.
    ///
    /// # Errors
    /// When it cannot be read, is open to others, or is not what it should be.
    #[expect(clippy::disallowed_types, reason = "the door to the file of keys")]
    pub fn load(path: &Path) -> Result<Option<Self>, PackKeysError> {
        let file = match std::fs::File::open(path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(unusable(path, &error)),
        };
        let metadata = file.metadata().map_err(|error| unusable(path, &error))?;
        if let Some(mode) = super::tokens::permissions(&metadata).filter(|mode| mode & 0o077 != 0) {
            return Err(PackKeysError::Exposed {
                path: path.display().to_string(),
                mode,
            });
        }
        let mut text = String::new();
        file.take(MAX_FILE_BYTES)
            .read_to_string(&mut text)
            .map_err(|error| unusable(path, &error))?;
        Self::parse(&path.display().to_string(), &text).map(Some)
    }

    /// Writes a file of these keys, which takes the place of the one before as a whole.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), PackKeysError> {
        write_whole(path, &self.text()).map_err(|error| unusable(path, &error))
    }
}

fn unusable(path: &Path, error: &io::Error) -> PackKeysError {
    PackKeysError::Unusable {
        path: path.display().to_string(),
        message: error.to_string(),
    }
}

fn bytes(text: &str) -> Option<[u8; 32]> {
    BASE64.decode(text).ok()?.try_into().ok()
}

/// Beside the file first, readable by its owner alone, and on the disk before it takes its name.
#[expect(
    clippy::disallowed_types,
    clippy::disallowed_methods,
    reason = "the door to the file of keys"
)]
fn write_whole(path: &Path, text: &str) -> io::Result<()> {
    let mut name = path.as_os_str().to_owned();
    name.push(".new");
    let beside = PathBuf::from(name);
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create(true).truncate(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        options.mode(0o600);
    }
    let mut file = options.open(&beside)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()?;
    std::fs::rename(&beside, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: Timestamp = Timestamp::UNIX_EPOCH;

    fn later(hours: i64) -> Timestamp {
        NOW + jiff::SignedDuration::from_hours(hours)
    }

    #[test]
    fn what_is_written_is_read() {
        let keys = PackKeys::of_seed([1; 32], NOW).rotated([2; 32], later(1));
        let first = keys.keys()[0].id().to_string();
        let keys = keys.revoked(&first, later(2)).expect("revoked");
        let read = PackKeys::parse("keys", &keys.text()).expect("readable");
        assert_eq!(read.keys(), keys.keys());
        assert_eq!(
            read.signing().public(),
            SigningKey::of_seed(&[2; 32]).public()
        );
        assert_eq!(read.keys()[0].retired_at, Some(later(1)));
        assert_eq!(read.keys()[0].revoked_at, Some(later(2)));
        assert_eq!(keys.text().matches("seed = ").count(), 1, "{}", keys.text());
    }

    #[test]
    fn what_cannot_sign_is_refused_without_its_seed() {
        let keys = PackKeys::of_seed([1; 32], NOW);
        let other = PackKeys::of_seed([2; 32], NOW).keys()[0].public_text();
        let bent = [
            String::new(),
            "key = []".to_owned(),
            keys.text().replace(&keys.keys()[0].public_text(), &other),
            keys.text().replace("seed", "sead"),
            keys.text() + "retired_at = \"2026-11-27T10:00:00Z\"\n",
        ];
        for text in bent {
            let error = PackKeys::parse("keys", &text)
                .expect_err("refused")
                .to_string();
            assert!(!error.contains(&BASE64.encode([1; 32])), "{error}");
        }
    }

    #[test]
    fn the_key_that_signs_and_unknown_ones_are_not_revoked() {
        let keys = PackKeys::of_seed([1; 32], NOW);
        let own = keys.signing().id().to_string();
        let refused = keys.clone().revoked(&own, NOW).err();
        assert_eq!(refused, Some(PackKeysError::Signs(own)));
        let refused = keys.revoked("00", NOW).err();
        assert_eq!(refused, Some(PackKeysError::Unknown("00".to_owned())));
    }

    #[test]
    fn a_file_takes_the_place_of_the_one_before() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("edge.db.keys");
        assert!(matches!(PackKeys::load(&path), Ok(None)));
        let keys = PackKeys::of_seed([1; 32], NOW);
        keys.save(&path).expect("written");
        keys.rotated([2; 32], later(1))
            .save(&path)
            .expect("written");
        let read = PackKeys::load(&path).expect("readable").expect("there");
        assert_eq!(read.keys().len(), 2);
    }
}
