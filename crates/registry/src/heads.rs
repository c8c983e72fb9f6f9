//! Who waits for news of a network, and what wakes them.

use super::store::NetworkState;
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::watch;

/// The last revision of each network that anyone has waited for.
#[derive(Debug, Default)]
pub(super) struct Heads(Mutex<BTreeMap<String, watch::Sender<u64>>>);

impl Heads {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, watch::Sender<u64>>> {
        // The map is whole after every call, so a panic elsewhere cannot spoil it.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Hears of a network, which there has to be: its last known revision, and every one from now on.
    pub(super) fn listen(&self, network: &str, head: u64) -> watch::Receiver<u64> {
        let mut heads = self.lock();
        match heads.get(network) {
            Some(sender) => sender.subscribe(),
            None => {
                let (sender, receiver) = watch::channel(head);
                heads.insert(network.to_owned(), sender);
                receiver
            }
        }
    }

    /// Tells that a network has come to a revision.
    pub(super) fn tell(&self, network: &str, head: u64) {
        if let Some(sender) = self.lock().get(network) {
            sender.send_if_modified(|known| std::mem::replace(known, head) != head);
        }
    }

    /// Tells how all networks stand.
    pub(super) fn tell_all(&self, networks: &[NetworkState]) {
        for state in networks {
            self.tell(&state.id, state.head);
        }
    }

    /// How many wait.
    pub(super) fn waiting(&self) -> usize {
        self.lock()
            .values()
            .map(watch::Sender::receiver_count)
            .sum()
    }
}
