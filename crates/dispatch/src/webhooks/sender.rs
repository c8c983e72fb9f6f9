//! What sends messages: those that are due, several at once, one after the other for each subject of a webhook.
//!
//! Before an attempt a message is put off, so that another process does not send it at the same time, and so that it is
//! sent again where this one ends in the middle. Who finds that another process has put it off does not send it, and what
//! became of it is noted by who put it off last. Nothing else keeps two processes apart: an endpoint may get a message twice,
//! by the same id.

use super::endpoint::Endpoint;
use super::notes::Notes;
use super::outgoing::{Outcome, Outgoing, Signed};
use super::pace::{ATTEMPTS_MAX, wait_after};
use super::queue::{DELIVERED, GIVEN_UP};
use jiff::Timestamp;
use skyway_contract::WebhookState;
use skyway_registry::documents::{
    Commit, Committed, DocumentKind, Documents, Message, Seen, Settlement,
};
use skyway_service::clock::Clock;
use skyway_service::refusal::Refusal;
use std::collections::{BTreeMap, BTreeSet};
use std::mem;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Notify;
use tokio::task::JoinSet;
use tokio::time::Instant;

/// Messages that are sent at once.
const IN_FLIGHT_MAX: usize = 256;
/// Of these, to one webhook.
const IN_FLIGHT_PER_WEBHOOK: usize = 32;
/// The same while it does not take what it is sent: endpoints that hang must not take the place of all others.
const IN_FLIGHT_WHILE_FAILING: usize = 4;
/// A webhook gets a quarter of the places that are free: however many endpoints hang, another finds some.
const FREE_DIVISOR: usize = 4;
/// How many due messages are looked at.
const PAGE: u64 = 256;
/// For so long a message that is being sent is put off; an attempt takes less.
const LEASE_MS: i64 = 20_000;
/// Messages that were found due are started for so long before it is looked anew: each look reads a page.
const LOOK_AGAIN_AFTER: Duration = Duration::from_millis(50);
/// The longest wait before it is looked for messages of other processes.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// For so long nothing was taken: the webhook is disabled.
const DISABLED_AFTER_MS: i64 = 24 * 3_600_000;
/// How many messages are looked through for one that was taken.
const LOOKED_THROUGH_MAX: u64 = 20_000;
/// How often a webhook is disabled anew because others got in between.
const DECISIONS: u32 = 16;

/// What sends.
#[derive(Debug)]
pub(super) struct Sender {
    pub(super) documents: Arc<dyn Documents>,
    pub(super) notes: Notes,
    pub(super) clock: Clock,
    pub(super) outgoing: Outgoing,
}

/// What is being sent or about to be, and how webhooks have taken what was.
#[derive(Debug, Default)]
struct Underway {
    /// Messages that were due when it was last looked, and had no room yet.
    due: Vec<Message>,
    looked_at: Option<Instant>,
    /// Webhook and subject of each message.
    subjects: BTreeSet<(String, String)>,
    /// Webhooks that have not taken what they were sent last.
    failing: BTreeSet<String>,
}

impl Underway {
    fn has_room(&self, webhook: &str) -> bool {
        let first = (webhook.to_owned(), String::new());
        let from_here = self.subjects.range(first..);
        let under_way = from_here.take_while(|(other, _)| other == webhook).count();
        self.subjects.len() < IN_FLIGHT_MAX && under_way < self.most(webhook)
    }

    fn most(&self, webhook: &str) -> usize {
        let share = IN_FLIGHT_MAX.saturating_sub(self.subjects.len()) / FREE_DIVISOR;
        let most = match self.failing.contains(webhook) {
            true => IN_FLIGHT_WHILE_FAILING,
            false => IN_FLIGHT_PER_WEBHOOK,
        };
        most.min(share.max(1))
    }

    /// Webhooks to which as much is being sent as may be.
    fn full(&self) -> Vec<String> {
        let mut under_way = BTreeMap::<&str, usize>::new();
        for (webhook, _) in &self.subjects {
            *under_way.entry(webhook).or_default() += 1;
        }
        let full = under_way
            .iter()
            .filter(|(webhook, count)| **count >= self.most(webhook));
        full.map(|(webhook, _)| (*webhook).to_owned()).collect()
    }

    fn ended(&mut self, attempted: Attempted) {
        let Attempted {
            webhook,
            subject,
            end,
        } = attempted;
        self.subjects.remove(&(webhook.clone(), subject));
        match end {
            End::Failed => {
                self.failing.insert(webhook);
            }
            End::Taken | End::NoEndpoint => {
                self.failing.remove(&webhook);
            }
            End::Unsent => {}
        }
    }
}

/// How an attempt has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    /// The webhook has taken the message.
    Taken,
    /// It was called, and has not.
    Failed,
    /// There is no one to call.
    NoEndpoint,
    /// It was not called: another process sends the message, or the store does not answer.
    Unsent,
}

/// That an attempt has ended.
#[derive(Debug)]
struct Attempted {
    webhook: String,
    subject: String,
    end: End,
}

impl Sender {
    /// Sends what is due, for ever; `news` says that there may be more.
    pub(super) async fn run(self: Arc<Self>, news: &Notify) {
        let mut underway = Underway::default();
        let mut attempts = JoinSet::new();
        loop {
            let wait = match self.start_due(&mut underway, &mut attempts).await {
                Ok(wait) => wait,
                Err(refusal) => {
                    tracing::warn!(%refusal, "cannot look for messages to webhooks");
                    LOOK_EVERY
                }
            };
            tokio::select! {
                Some(ended) = attempts.join_next() => note(ended, &mut underway),
                () = news.notified() => {}
                () = tokio::time::sleep(wait) => {}
            }
            while let Some(ended) = attempts.try_join_next() {
                note(ended, &mut underway);
            }
        }
    }

    /// Starts what is due and has room; tells after which time to look again, if nothing ends before.
    async fn start_due(
        self: &Arc<Self>,
        underway: &mut Underway,
        attempts: &mut JoinSet<Attempted>,
    ) -> Result<Duration, Refusal> {
        if underway.subjects.len() >= IN_FLIGHT_MAX {
            // Until one of them ends nothing can be started.
            return Ok(LOOK_EVERY);
        }
        self.look(underway).await?;
        for message in mem::take(&mut underway.due) {
            let entry = (message.webhook.clone(), message.subject.clone());
            if underway.subjects.contains(&entry) {
                continue;
            }
            if underway.has_room(&message.webhook) {
                underway.subjects.insert(entry);
                attempts.spawn(self.clone().attempt(message));
            } else {
                underway.due.push(message);
            }
        }
        if !underway.due.is_empty() {
            // What has come since the last look does not wait for a webhook that is slow.
            return Ok(LOOK_AGAIN_AFTER);
        }
        let next = self.documents.next_due().await?;
        let next = next.and_then(|due_ms| Timestamp::from_millisecond(due_ms).ok());
        let wait = next.and_then(|next| self.clock.real_duration_until(next));
        // What is being sent is due until it is put off.
        let shortest = match underway.subjects.is_empty() {
            true => Duration::ZERO,
            false => LOOK_EVERY,
        };
        Ok(wait.unwrap_or(LOOK_EVERY).clamp(shortest, LOOK_EVERY))
    }

    /// Looks what is due and has room, unless what was found a moment ago is not all sent.
    async fn look(&self, underway: &mut Underway) -> Result<(), Refusal> {
        let is_old = |at: Instant| at.elapsed() >= LOOK_AGAIN_AFTER;
        if !underway.due.is_empty() && !underway.looked_at.is_none_or(is_old) {
            return Ok(());
        }
        underway.looked_at = Some(Instant::now());
        // What waits for one that is slow must not fill the page, before what others would take.
        let full = underway.full();
        let due = self.documents.due_messages(self.now_ms(), PAGE, &full);
        underway.due = due.await?;
        Ok(())
    }

    async fn attempt(self: Arc<Self>, message: Message) -> Attempted {
        let (webhook, subject) = (message.webhook.clone(), message.subject.clone());
        let sent = self.send(message).await;
        if let Err(refusal) = &sent {
            tracing::warn!(webhook, %refusal, "cannot note what became of a message to a webhook");
            // It may still be due, and would be tried again at once.
            tokio::time::sleep(LOOK_EVERY).await;
        }
        Attempted {
            webhook,
            subject,
            end: sent.unwrap_or(End::Unsent),
        }
    }

    /// Sends a message once, unless another process does, and notes what came of it.
    async fn send(&self, mut message: Message) -> Result<End, Refusal> {
        let kind = DocumentKind::Webhook;
        let Some(document) = self.documents.document(kind, &message.webhook).await? else {
            self.give_up(message, "the webhook was deleted").await?;
            return Ok(End::NoEndpoint);
        };
        let endpoint = Endpoint::of(&document)?;
        if endpoint.state == WebhookState::Disabled {
            self.give_up(message, "the webhook is disabled").await?;
            return Ok(End::NoEndpoint);
        }
        let attempts_before = Some(message.attempts);
        message.attempts = message.attempts.saturating_add(1);
        message.due_ms = self.now_ms().saturating_add(LEASE_MS);
        let lease = Settlement {
            message: message.clone(),
            attempts_before,
        };
        if !self.notes.note(lease).await? {
            return Ok(End::Unsent);
        }
        let now = self.clock.now();
        let signed = Signed {
            id: message.id.clone(),
            sent_at_s: now.as_second(),
            signature: endpoint.sign(&message.id, now, &message.body),
            body: message.body.clone(),
        };
        let outcome = self.outgoing.send(&endpoint.url, &signed).await;
        tracing::debug!(
            webhook = message.webhook,
            message = message.id,
            outcome = outcome.text(),
            "a webhook was called"
        );
        self.settle(message, &outcome).await?;
        Ok(match outcome {
            Outcome::Taken(_) => End::Taken,
            _ => End::Failed,
        })
    }

    /// Notes what came of an attempt.
    async fn settle(&self, mut message: Message, outcome: &Outcome) -> Result<(), Refusal> {
        message.last_outcome = Some(outcome.text());
        if let Outcome::Taken(_) = outcome {
            message.state = DELIVERED.to_owned();
            message.due_ms = self.now_ms();
            self.note_of(message).await?;
            return Ok(());
        }
        let is_gone = *outcome == Outcome::Gone;
        if !is_gone && message.attempts < ATTEMPTS_MAX {
            message.due_ms = self.now_ms().saturating_add(spread_ms(message.attempts));
            self.note_of(message).await?;
            return Ok(());
        }
        let webhook = message.webhook.clone();
        if !self.give_up(message, &outcome.text()).await? {
            // Another process, or the owner, was faster.
            return Ok(());
        }
        if is_gone {
            let why = "it answered that it wants nothing more (410)";
            self.disable(&webhook, why).await?;
        } else if !self.has_taken_lately(&webhook).await? {
            self.disable(&webhook, "it took nothing for a day").await?;
        }
        Ok(())
    }

    async fn give_up(&self, mut message: Message, why: &str) -> Result<bool, Refusal> {
        message.state = GIVEN_UP.to_owned();
        message.last_outcome = Some(why.to_owned());
        message.due_ms = self.now_ms();
        self.note_of(message).await
    }

    /// Notes what became of a message, unless it was sent again meanwhile, or is to be.
    async fn note_of(&self, message: Message) -> Result<bool, Refusal> {
        let attempts_before = Some(message.attempts);
        let settlement = Settlement {
            message,
            attempts_before,
        };
        self.notes.note(settlement).await
    }

    /// Whether a webhook has taken anything for a day, as its messages say; those before two days were settled longer ago.
    async fn has_taken_lately(&self, webhook: &str) -> Result<bool, Refusal> {
        let since_ms = self.now_ms().saturating_sub(DISABLED_AFTER_MS);
        let mut before = None;
        for _ in 0..LOOKED_THROUGH_MAX / PAGE {
            let messages = self.documents.messages(webhook, before, PAGE).await?;
            let is_lately =
                |message: &Message| message.state == DELIVERED && message.due_ms >= since_ms;
            if messages.iter().any(is_lately) {
                return Ok(true);
            }
            let Some(last) = messages.last() else {
                return Ok(false);
            };
            if last.created_ms < since_ms.saturating_sub(DISABLED_AFTER_MS) {
                return Ok(false);
            }
            before = Some((last.created_ms, last.id.clone()));
        }
        Ok(false)
    }

    async fn disable(&self, webhook: &str, reason: &str) -> Result<(), Refusal> {
        let kind = DocumentKind::Webhook;
        for _ in 0..DECISIONS {
            let Some(before) = self.documents.document(kind, webhook).await? else {
                return Ok(());
            };
            let endpoint = Endpoint::of(&before)?;
            if endpoint.state == WebhookState::Disabled {
                return Ok(());
            }
            let version = before.version + 1;
            let endpoint = endpoint.disable(reason);
            let after = endpoint.document(webhook, &before.tenant, version, self.now_ms())?;
            let commit = Commit {
                seen: vec![Seen {
                    kind,
                    id: webhook.to_owned(),
                    version: Some(before.version),
                }],
                puts: vec![after],
                ..Commit::default()
            };
            if self.documents.commit(&commit).await? != Committed::Moved {
                let tenant = before.tenant;
                tracing::warn!(
                    webhook,
                    tenant,
                    reason,
                    "a webhook is disabled until its owner puts it again"
                );
                return Ok(());
            }
        }
        Ok(())
    }

    fn now_ms(&self) -> i64 {
        self.clock.now().as_millisecond()
    }
}

fn note(ended: Result<Attempted, tokio::task::JoinError>, underway: &mut Underway) {
    match ended {
        Ok(attempted) => underway.ended(attempted),
        // Only who drops all attempts stops one without a defect.
        Err(error) => {
            if let Ok(defect) = error.try_into_panic() {
                std::panic::resume_unwind(defect);
            }
        }
    }
}

/// How long to wait after a number of failures, somewhere in the spread.
fn spread_ms(failures: u32) -> i64 {
    // Without random bits they are sent together: slower, and nothing worse.
    let share = getrandom::u32().map_or(0.5, |random| f64::from(random) / f64::from(u32::MAX));
    let wait = wait_after(failures, share);
    i64::try_from(wait.as_millis()).unwrap_or(i64::MAX)
}
