//! The word that something has opened: from the writer to who looks for better plans.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

/// Where it is told that something has opened.
#[derive(Clone, Debug)]
pub(crate) struct Opened {
    word: SyncSender<()>,
    is_broken_off: Arc<AtomicBool>,
}

/// The other end.
#[derive(Debug)]
pub(crate) struct Listener {
    word: Receiver<()>,
    is_broken_off: Arc<AtomicBool>,
}

/// One word is enough, however much has opened.
pub(crate) fn channel() -> (Opened, Listener) {
    let (teller, word) = sync_channel(1);
    let is_broken_off = Arc::new(AtomicBool::new(false));
    let opened = Opened {
        word: teller,
        is_broken_off: is_broken_off.clone(),
    };
    let listener = Listener {
        word,
        is_broken_off,
    };
    (opened, listener)
}

impl Opened {
    pub(crate) fn tell(&self) {
        // Where one waits already, it will find this too.
        let _ = self.word.try_send(());
    }

    /// Whether a look for better plans was broken off since this was last asked.
    pub(crate) fn takes_up(&self) -> bool {
        self.is_broken_off.swap(false, Ordering::SeqCst)
    }
}

impl Listener {
    /// Whether the word has come.
    pub(crate) fn has_heard(&self) -> bool {
        self.word.try_recv().is_ok()
    }

    /// Waits for the word; false where none will come.
    pub(crate) fn hear(&self) -> bool {
        self.word.recv().is_ok()
    }

    /// Leaves the cores to others until the word comes again.
    pub(crate) fn break_off(&self) {
        self.is_broken_off.store(true, Ordering::SeqCst);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_look_that_was_broken_off_is_taken_up_once() {
        let (opened, listener) = channel();
        assert!(!opened.takes_up());
        opened.tell();
        opened.tell();
        assert!(listener.has_heard() && !listener.has_heard());
        listener.break_off();
        assert!(opened.takes_up() && !opened.takes_up());
    }
}
