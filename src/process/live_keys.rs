//! The keys of packs and their file: made at the first start, and read again when the file changes, so that a key is rotated or
//! revoked without a restart. What the registry has revoked is written to the file.

use crate::clock::machine_now;
use crate::config::{EdgeConfig, PackKeys, PackKeysError, Tokens};
use crate::edge::Edge;
use jiff::Timestamp;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Weak};
use std::time::Duration;
use tokio::time::sleep;

/// How often the file is looked at.
const LOOK_EVERY: Duration = Duration::from_secs(2);

/// The file of keys, and those that are in it at the start; nothing without a store, where no file is named.
pub(super) struct LiveKeys(Option<(PathBuf, PackKeys)>);

impl LiveKeys {
    /// Reads the file that a configuration means, or makes it with a new key.
    ///
    /// # Errors
    /// When the file cannot be read or written, or the system has no random bits.
    pub(super) fn open(config: &EdgeConfig) -> Result<Self, PackKeysError> {
        let beside_store = config.store.as_ref().map(|store| {
            let mut name = store.as_os_str().to_owned();
            name.push(".keys");
            PathBuf::from(name)
        });
        let path = config.pack_keys_file.clone().or(beside_store);
        let opened = path.map(|path| open_keys(&path).map(|keys| (path, keys)));
        opened.transpose().map(Self)
    }

    /// The keys that an edge begins with.
    pub(super) fn first(&self) -> Option<PackKeys> {
        self.0.as_ref().map(|(_, keys)| keys.clone())
    }

    /// Has an edge sign with what the file has, as long as it is there.
    pub(super) fn follow(self, edge: &Arc<Edge>) {
        if let Some((path, keys)) = self.0 {
            tokio::spawn(follow_keys(Arc::downgrade(edge), path, keys));
        }
    }
}

fn open_keys(path: &Path) -> Result<PackKeys, PackKeysError> {
    if let Some(keys) = PackKeys::load(path)? {
        return Ok(keys);
    }
    let mut seed = [0; 32];
    getrandom::fill(&mut seed).map_err(|error| PackKeysError::Unusable {
        path: path.display().to_string(),
        message: error.to_string(),
    })?;
    let keys = PackKeys::of_seed(seed, machine_now());
    keys.save(path)?;
    tracing::info!(path = %path.display(), key = %keys.signing().id(), "a key to sign packs with was made");
    Ok(keys)
}

/// Reads the file again as long as the edge is there; what cannot be read leaves the keys as they are.
async fn follow_keys(edge: Weak<Edge>, path: PathBuf, first: PackKeys) {
    let mut seen = look(&path);
    let mut kept = Arc::new(first);
    loop {
        sleep(LOOK_EVERY).await;
        let Some(edge) = edge.upgrade() else {
            return;
        };
        let (of_file, before) = (path.clone(), kept.clone());
        // What blocks is done where it may; the file is small.
        let looked = tokio::task::spawn_blocking(move || match read_again(&edge, &of_file, seen) {
            unchanged if unchanged == seen => write_back(&edge, &of_file, seen, before),
            read => (read, edge.pack_keys()),
        });
        if let Ok(looked) = looked.await {
            (seen, kept) = looked;
        }
    }
}

/// When a file was written, and how long it was then.
type Stamp = Option<(Timestamp, u64)>;

fn look(path: &Path) -> Stamp {
    Tokens::stamp(path).ok()
}

fn read_again(edge: &Arc<Edge>, path: &Path, seen: Stamp) -> Stamp {
    let stamp = look(path);
    if stamp == seen || stamp.is_none() {
        return seen;
    }
    let shown = path.display();
    match PackKeys::load(path) {
        Ok(Some(keys)) => {
            tracing::info!(path = %shown, key = %keys.signing().id(), "packs are signed with this key now");
            edge.use_pack_keys(keys);
        }
        Ok(None) => return seen,
        Err(error) => {
            tracing::error!(path = %shown, %error, "the file of keys cannot be read; those that were in it still count");
        }
    }
    stamp
}

/// Writes the keys of the edge to the file where it has changed them; what cannot be written is tried again.
fn write_back(
    edge: &Arc<Edge>,
    path: &Path,
    seen: Stamp,
    before: Arc<PackKeys>,
) -> (Stamp, Arc<PackKeys>) {
    let keys = edge.pack_keys();
    if keys.keys() == before.keys() {
        return (seen, keys);
    }
    match keys.save(path) {
        Ok(()) => (look(path), keys),
        Err(error) => {
            tracing::error!(path = %path.display(), %error, "the keys of packs have changed and cannot be kept");
            (seen, before)
        }
    }
}
