//! Webhooks: where customers and providers are told, by the Standard Webhooks specification.
//!
//! A message is committed with what it tells of and sent until its endpoint has taken it: at least once, and in order for
//! one subject. `resource` has what owners do, `queue` the messages, `sender` the loop that sends them, `outgoing` one
//! attempt, `guard` where endpoints may be.

mod endpoint;
mod guard;
mod notes;
mod outgoing;
mod pace;
mod queue;
mod resource;
mod secret;
mod sender;
#[cfg(test)]
mod tests;

pub use resource::TaggedWebhook;

pub(super) use queue::Telling;

use super::Dispatch;
use guard::GuardedNames;
use notes::Notes;
use outgoing::Outgoing;
use sender::Sender;
use std::sync::Arc;

impl Dispatch {
    /// Sends what is due, for ever.
    pub(super) async fn send_messages(self: &Arc<Self>) {
        let names = GuardedNames::of_system(self.settings.webhooks_anywhere);
        let sender = Sender {
            documents: self.documents.clone(),
            notes: Notes::new(self.documents.clone()),
            clock: self.clock.clone(),
            outgoing: Outgoing::new(&names),
        };
        Arc::new(sender).run(&self.messages).await;
    }
}
