//! How far a store had come, remembered beside it: a store that is behind was restored from a backup.
//!
//! Followers trust that a revision of an epoch never changes its meaning. A restored store would give the
//! revisions that it lost to other changes; so it begins a new epoch, which sends every follower to the snapshot.
//! The file is written after every commit and before anyone is told of it, neither who wrote nor who follows, and
//! without waiting for the disk: what ends the process does not lose it, and a backup is not restored while the power
//! is off. Written before the commit it would call every commit that a kill prevents a loss, and send all followers to
//! the snapshot.

use super::store::{Identity, NetworkState, Version};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// How far a store had come.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Mark {
    pub(super) registry_id: String,
    pub(super) epoch: u64,
    /// The last revision of each network.
    pub(super) heads: BTreeMap<String, u64>,
}

impl Mark {
    fn of(identity: &Identity, networks: &[NetworkState]) -> Self {
        let heads = networks.iter().map(|state| (state.id.clone(), state.head));
        Self {
            registry_id: identity.registry_id.clone(),
            epoch: identity.epoch,
            heads: heads.collect(),
        }
    }

    /// Whether a store has lost something since.
    pub(super) fn is_ahead_of(&self, identity: &Identity, networks: &[NetworkState]) -> bool {
        if self.epoch != identity.epoch {
            return self.epoch > identity.epoch;
        }
        self.heads.iter().any(|(id, head)| {
            let found = networks.iter().find(|state| state.id == *id);
            found.is_none_or(|state| state.head < *head)
        })
    }
}

/// The file.
#[derive(Debug)]
pub struct HighWater {
    path: PathBuf,
    mark: Mutex<Mark>,
}

impl HighWater {
    /// The file of this name; it need not be there yet.
    pub fn at(path: PathBuf) -> Self {
        Self {
            path,
            mark: Mutex::new(Mark::default()),
        }
    }

    /// Where it is, for messages.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// What it remembers; none where there is no file.
    pub(super) fn read(&self) -> io::Result<Option<Mark>> {
        let text = match read_file(&self.path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error),
        };
        let mark = serde_json::from_str(&text).map_err(io::Error::from)?;
        Ok(Some(mark))
    }

    /// Begins to remember this store.
    pub(super) fn begin(&self, identity: &Identity, networks: &[NetworkState]) -> io::Result<()> {
        let mut mark = self.mark.lock().unwrap_or_else(PoisonError::into_inner);
        *mark = Mark::of(identity, networks);
        self.write(&mark)
    }

    /// Whether a revision is remembered.
    pub(super) fn has(&self, network: &str, version: Version) -> bool {
        let mark = self.mark.lock().unwrap_or_else(PoisonError::into_inner);
        let head = mark.heads.get(network);
        mark.epoch == version.epoch && head.is_some_and(|head| *head >= version.revision)
    }

    /// Remembers a commit.
    pub(super) fn note(&self, network: &str, version: Version) -> io::Result<()> {
        let mut mark = self.mark.lock().unwrap_or_else(PoisonError::into_inner);
        if version.epoch < mark.epoch {
            return Ok(());
        }
        mark.epoch = version.epoch;
        let head = mark.heads.entry(network.to_owned()).or_default();
        // Of two commits the later may come here first.
        *head = (*head).max(version.revision);
        self.write(&mark)
    }

    fn write(&self, mark: &Mark) -> io::Result<()> {
        let text = serde_json::to_string(mark).map_err(io::Error::from)?;
        let mut name = self.path.clone().into_os_string();
        name.push(".new");
        replace_file(&PathBuf::from(name), &self.path, &text)
    }
}

#[expect(clippy::disallowed_methods, reason = "the door to the high-water file")]
fn read_file(path: &Path) -> io::Result<String> {
    std::fs::read_to_string(path)
}

#[expect(clippy::disallowed_methods, reason = "the door to the high-water file")]
fn replace_file(new: &Path, path: &Path, text: &str) -> io::Result<()> {
    std::fs::write(new, text)?;
    std::fs::rename(new, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(id: &str, head: u64) -> NetworkState {
        let topology = Version {
            epoch: 1,
            revision: 1,
        };
        NetworkState {
            id: id.to_owned(),
            head,
            oldest: 0,
            topology,
            zones: 0,
            closures: 0,
        }
    }

    fn identity(epoch: u64) -> Identity {
        Identity {
            registry_id: "r".to_owned(),
            epoch,
        }
    }

    #[test]
    fn a_store_that_is_behind_its_mark_has_lost_something() {
        let mark = Mark::of(&identity(2), &[state("a", 7), state("b", 3)]);
        let ahead = |epoch, states: &[NetworkState]| mark.is_ahead_of(&identity(epoch), states);
        assert!(!ahead(2, &[state("a", 7), state("b", 3)]));
        assert!(!ahead(2, &[state("a", 8), state("b", 3), state("c", 1)]));
        assert!(ahead(2, &[state("a", 6), state("b", 9)]), "fewer revisions");
        assert!(ahead(2, &[state("a", 7)]), "no such network");
        assert!(ahead(1, &[state("a", 70), state("b", 30)]), "an older life");
        assert!(!ahead(3, &[state("a", 1)]), "a later life says so itself");
    }

    #[test]
    fn what_is_noted_is_read_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = HighWater::at(folder.path().join("mark"));
        assert_eq!(file.read().expect("no file"), None);
        file.begin(&identity(1), &[state("a", 7)]).expect("written");
        let version = |revision| Version { epoch: 1, revision };
        file.note("a", version(9)).expect("written");
        file.note("a", version(8)).expect("written");
        file.note("b", version(1)).expect("written");
        let mark = file.read().expect("a file").expect("a mark");
        let heads = BTreeMap::from([("a".to_owned(), 9), ("b".to_owned(), 1)]);
        assert_eq!((mark.epoch, mark.heads), (1, heads));
    }
}
