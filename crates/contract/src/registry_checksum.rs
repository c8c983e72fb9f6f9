//! Digests of what a registry says, which its reader can compute again.
//!
//! What is digested is a sequence of netstrings: every field as its length in bytes, a colon, its bytes and a
//! comma, numbers in decimal. That is one text for one meaning, whatever wrote the JSON around it.

use super::registry::{ChangesPage, LoggedChange, RegistrySnapshot, SnapshotObject};
use sha2::{Digest, Sha256};

/// A digest under construction.
struct Fields(Sha256);

impl Fields {
    /// Begins with what is digested, so that no page can pass for another thing.
    fn of(what: &str) -> Self {
        Self(Sha256::new()).text(what)
    }

    fn text(mut self, text: &str) -> Self {
        self.0.update(text.len().to_string());
        self.0.update(b":");
        self.0.update(text);
        self.0.update(b",");
        self
    }

    fn number(self, number: u64) -> Self {
        self.text(&number.to_string())
    }

    fn hexadecimal(self) -> String {
        hex::encode(self.0.finalize())
    }
}

impl LoggedChange {
    /// The digest that `sha256` has to be, in the log of a network.
    pub fn digest(&self, network: &str) -> String {
        let fields = Fields::of("skyway-change-1")
            .text(network)
            .number(self.epoch)
            .number(self.revision)
            .text(&self.at)
            .text(&self.subject)
            .text(self.kind.name())
            .text(&self.id)
            .text(self.operation.name());
        match &self.body {
            Some(body) => fields.text("body").text(body),
            None => fields.text("none"),
        }
        .hexadecimal()
    }
}

impl SnapshotObject {
    /// The digest that `sha256` has to be, in the snapshot of a network.
    pub fn digest(&self, network: &str) -> String {
        Fields::of("skyway-object-1")
            .text(network)
            .number(self.epoch)
            .number(self.revision)
            .text(self.kind.name())
            .text(&self.id)
            .text(&self.body)
            .hexadecimal()
    }
}

impl ChangesPage {
    /// The digest that `checksum` has to be; it covers the bodies by the digests of the changes.
    pub fn digest(&self) -> String {
        let head = Fields::of("skyway-changes-1")
            .text(&self.registry_id)
            .number(self.epoch)
            .text(&self.network)
            .number(self.after)
            .number(self.revision)
            .number(self.head)
            .number(self.oldest)
            .number(self.changes.len() as u64);
        let all = self.changes.iter();
        all.fold(head, |fields, change| fields.text(&change.sha256))
            .hexadecimal()
    }

    /// Whether every digest in it is right.
    pub fn is_intact(&self) -> bool {
        let mut changes = self.changes.iter();
        changes.all(|change| change.sha256 == change.digest(&self.network))
            && self.checksum == self.digest()
    }
}

impl RegistrySnapshot {
    /// The digest that `checksum` has to be; it covers the bodies by the digests of the objects.
    pub fn digest(&self) -> String {
        let head = Fields::of("skyway-snapshot-1")
            .text(&self.registry_id)
            .number(self.epoch)
            .text(&self.network)
            .number(self.revision)
            .number(self.object_count)
            .text(match self.authoritative_empty {
                true => "empty",
                false => "not empty",
            })
            .text(self.next_page_token.as_deref().unwrap_or_default())
            .number(self.objects.len() as u64);
        let all = self.objects.iter();
        all.fold(head, |fields, object| fields.text(&object.sha256))
            .hexadecimal()
    }

    /// Whether every digest in it is right.
    pub fn is_intact(&self) -> bool {
        let mut objects = self.objects.iter();
        objects.all(|object| object.sha256 == object.digest(&self.network))
            && self.checksum == self.digest()
    }
}
