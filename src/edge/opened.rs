//! The word that something has opened: from the writer to who looks for better plans.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

/// Where it is told that something has opened.
#[derive(Clone, Debug)]
pub(super) struct Opened(SyncSender<()>);

/// The other end.
#[derive(Debug)]
pub(super) struct Listener(Receiver<()>);

/// One word is enough, however much has opened.
pub(super) fn channel() -> (Opened, Listener) {
    let (opened, listener) = sync_channel(1);
    (Opened(opened), Listener(listener))
}

impl Opened {
    pub(super) fn tell(&self) {
        // Where one waits already, it will find this too.
        let _ = self.0.try_send(());
    }
}

impl Listener {
    /// Whether the word has come.
    pub(super) fn has_heard(&self) -> bool {
        self.0.try_recv().is_ok()
    }

    /// Waits for the word; false where none will come.
    pub(super) fn hear(&self) -> bool {
        self.0.recv().is_ok()
    }
}
