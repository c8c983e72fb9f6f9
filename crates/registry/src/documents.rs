//! What a registry keeps beside the log: documents that change often and belong to someone, messages that wait to be
//! sent, and rows of history.
//!
//! A document is one object in its newest version. A commit states which versions it was decided on, and what must not
//! be there; where one has moved since, or that has come, nothing of it is written. What is told elsewhere because of a
//! commit is committed with it.

use super::store::{Answer, KeptReply, ReplyKey};
use serde_json::Value;
use std::fmt::Debug;

/// What a document is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DocumentKind {
    /// Who runs drones.
    Provider,
    /// A drone of a provider.
    Drone,
    /// What a provider offers.
    Service,
    /// Who orders.
    Customer,
    /// A price that holds for a while.
    Quote,
    /// An order.
    Delivery,
    /// What is kept of a recipient, apart from the delivery; under the delivery's id.
    Recipient,
    /// An endpoint that is told.
    Webhook,
    /// A key of packs that is not to be believed any more.
    RevokedKey,
}

impl DocumentKind {
    /// Every kind.
    pub const ALL: [Self; 9] = [
        Self::Provider,
        Self::Drone,
        Self::Service,
        Self::Customer,
        Self::Quote,
        Self::Delivery,
        Self::Recipient,
        Self::Webhook,
        Self::RevokedKey,
    ];

    /// The name in the store and in problems.
    pub fn name(self) -> &'static str {
        match self {
            Self::Provider => "provider",
            Self::Drone => "drone",
            Self::Service => "service",
            Self::Customer => "customer",
            Self::Quote => "quote",
            Self::Delivery => "delivery",
            Self::Recipient => "recipient",
            Self::Webhook => "webhook",
            Self::RevokedKey => "revoked_key",
        }
    }
}

/// A document, as it is to be put or as it is kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Document {
    /// What it is.
    pub kind: DocumentKind,
    /// Which one.
    pub id: String,
    /// Whose it is: a tenant.
    pub tenant: String,
    /// Who else is party to it: of a delivery the provider, once there is one; empty where there is none.
    pub party: String,
    /// How it stands, for those who look for all that stand so: the name of a status; empty where nothing is looked for.
    pub state: String,
    /// From 1, one more with each change. Of one that is to be put: what it will be.
    pub version: u64,
    /// When it was changed last, in milliseconds since 1970.
    pub changed_ms: i64,
    /// Its JSON.
    pub body: String,
}

/// On which version of a document a commit was decided; none where there was none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seen {
    /// What it is.
    pub kind: DocumentKind,
    /// Which one.
    pub id: String,
    /// Its version.
    pub version: Option<u64>,
}

/// A message that waits to be sent to a webhook.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Its id, the same at every attempt.
    pub id: String,
    /// The webhook.
    pub webhook: String,
    /// What it is about. Messages to a webhook about one thing are sent in the order of `number`, one after the other.
    pub subject: String,
    /// Rises within a subject.
    pub number: u64,
    /// What it tells, such as `delivery.delivered`.
    pub event: String,
    /// Its JSON.
    pub body: String,
    /// When it was made, in milliseconds since 1970.
    pub created_ms: i64,
    /// When it is to be sent, in milliseconds since 1970; of one that is settled, when that was.
    pub due_ms: i64,
    /// How often it was sent.
    pub attempts: u32,
    /// `pending`, `delivered` or `given_up`.
    pub state: String,
    /// What came of the last attempt.
    pub last_outcome: Option<String>,
}

/// What became of a message: how it stands from now on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settlement {
    /// The message, of which all but id, webhook, subject, number, event and body is noted.
    pub message: Message,
    /// On what it was decided: the message was still to be sent, and had been sent so often. It is noted of no other; of any
    /// where none is stated.
    pub attempts_before: Option<u32>,
}

/// What a settlement does to the messages that wait behind its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Followers {
    /// They stay as they are.
    Stay,
    /// None is due before it, so that who looks for what is due does not come upon them.
    NotBefore,
    /// All are due by then.
    By,
}

impl Settlement {
    /// What it does to those that wait behind: they are put off with the message, and until it is settled or sent anew.
    pub fn followers(&self) -> Followers {
        let Some(attempts_before) = self.attempts_before else {
            return Followers::By;
        };
        let attempts = self.message.attempts;
        match self.message.state.as_str() {
            "pending" if attempts_before < attempts => Followers::Stay,
            "pending" => Followers::NotBefore,
            // Taken at the first attempt, it was never put off.
            "delivered" if attempts <= 1 => Followers::Stay,
            _ => Followers::By,
        }
    }
}

/// A failure that an edge has told of.
#[derive(Clone, Debug, PartialEq)]
pub struct FailureRow {
    /// The network.
    pub network: String,
    /// The edge.
    pub edge: String,
    /// Which life of its store.
    pub lineage: u64,
    /// Its number there.
    pub number: u64,
    /// When, in milliseconds since 1970.
    pub at_ms: i64,
    /// What failed, by its name on the wire.
    pub failure_type: String,
    /// The segment; empty where none is known.
    pub segment: String,
    /// What the drone was told to do.
    pub outcome: String,
}

/// How far the news of an edge were taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewsMark {
    /// The network.
    pub network: String,
    /// The edge.
    pub edge: String,
    /// Which life of its store.
    pub lineage: u64,
    /// How far they were taken before; 0 where none were. Another mark: nothing is written.
    pub before: u64,
    /// How far they are taken with this commit.
    pub through: u64,
}

/// What a commit must not find: of the documents that a query finds, on any of its pages, one whose body has this member.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unless {
    /// Which documents are looked at; `limit` is how many at once.
    pub query: DocumentQuery,
    /// The name of the member, and its text.
    pub member: (&'static str, String),
}

impl Unless {
    /// Whether a document is one of these; one that cannot be read may be.
    pub fn meets(&self, document: &Document) -> bool {
        let (name, text) = &self.member;
        let body: Result<Value, _> = serde_json::from_str(&document.body);
        body.map_or(true, |body| body[name] == **text)
    }
}

/// A commit: all of it is written, or nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Commit {
    /// On what it was decided.
    pub seen: Vec<Seen>,
    /// What it must not find, which may have come without any change of what was seen.
    pub unless: Option<Unless>,
    /// What is put.
    pub puts: Vec<Document>,
    /// What is deleted.
    pub deletes: Vec<(DocumentKind, String)>,
    /// What is to be sent because of it.
    pub messages: Vec<Message>,
    /// What has failed.
    pub failures: Vec<FailureRow>,
    /// How far it takes the news of an edge.
    pub news: Option<NewsMark>,
    /// Under which key its answer is kept, and the answer.
    pub reply: Option<(ReplyKey, KeptReply)>,
    /// Ids of what no kept answer is to tell any more.
    pub untold: Vec<String>,
}

/// What became of a commit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Committed {
    /// It is written.
    Done,
    /// Something it was decided on has changed: decide again.
    Moved,
    /// Its key was used before, by a request with this fingerprint.
    Repeated {
        /// SHA-256 of that request in hexadecimal.
        fingerprint: String,
        /// What was answered.
        reply: KeptReply,
    },
}

/// Which documents are asked for, by id; every condition that is stated has to hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DocumentQuery {
    /// Of which kind.
    pub kind: DocumentKind,
    /// Of this tenant, or with it as a party.
    pub of: Option<String>,
    /// That stand in one of these ways; all where none is named.
    pub states: Vec<String>,
    /// After this id, in the order in which they are told.
    pub after: Option<String>,
    /// The most of them.
    pub limit: u64,
    /// Whether they are told from the last id on, down to the first.
    pub is_newest_first: bool,
}

/// A position that is kept.
#[derive(Clone, Debug, PartialEq)]
pub struct PositionRow {
    /// The drone.
    pub drone: String,
    /// When, in milliseconds since 1970.
    pub at_ms: i64,
    /// Longitude in degrees.
    pub lon: f64,
    /// Latitude in degrees.
    pub lat: f64,
    /// Height in metres.
    pub altitude_m: Option<f64>,
    /// What was in its battery, from 0 to 1.
    pub battery_fraction: Option<f64>,
    /// Speed over ground in metres per second.
    pub speed_mps: Option<f64>,
}

/// How many failures of a kind there were.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FailureCount {
    /// The segment; empty where none is known.
    pub segment: String,
    /// The hour of the day, UTC.
    pub hour: u8,
    /// What failed.
    pub failure_type: String,
    /// How many.
    pub count: u64,
}

/// A store of documents. Everything it has acknowledged survives the end of the process and of the machine's power;
/// of positions what was acknowledged in the last second may be lost with the machine's power.
pub trait Documents: Debug + Send + Sync {
    /// A document; none where there is none.
    fn document<'a>(&'a self, kind: DocumentKind, id: &'a str) -> Answer<'a, Option<Document>>;

    /// Documents, by id.
    fn documents<'a>(&'a self, query: &'a DocumentQuery) -> Answer<'a, Vec<Document>>;

    /// How many documents of a kind a tenant has; of all tenants where none is named.
    fn count_documents<'a>(
        &'a self,
        kind: DocumentKind,
        tenant: Option<&'a str>,
    ) -> Answer<'a, u64>;

    /// How many documents of a kind a tenant has that stand in one of these ways, after this id where one is given.
    fn count_standing<'a>(
        &'a self,
        kind: DocumentKind,
        tenant: &'a str,
        states: &'a [&'static str],
        after: Option<&'a str>,
    ) -> Answer<'a, u64>;

    /// Writes a commit.
    fn commit<'a>(&'a self, commit: &'a Commit) -> Answer<'a, Committed>;

    /// What was answered under a key, and the fingerprint of the request.
    fn kept_reply<'a>(
        &'a self,
        subject: &'a str,
        key: &'a str,
    ) -> Answer<'a, Option<(String, KeptReply)>>;

    /// How far the news of an edge were taken; 0 where none were.
    fn news_through<'a>(&'a self, network: &'a str, edge: &'a str, lineage: u64)
    -> Answer<'a, u64>;

    /// Messages that are due and first of their webhook and subject, the longest due first; without those of some webhooks.
    fn due_messages<'a>(
        &'a self,
        now_ms: i64,
        limit: u64,
        without: &'a [String],
    ) -> Answer<'a, Vec<Message>>;

    /// When the next message is due, in milliseconds since 1970; none where none waits.
    fn next_due(&self) -> Answer<'_, Option<i64>>;

    /// Notes what became of messages, in one write, and moves those that wait behind them. Tells of each whether it was noted:
    /// not where the message has moved since.
    fn settle_messages<'a>(&'a self, settled: &'a [Settlement]) -> Answer<'a, Vec<bool>>;

    /// Messages of a webhook, the newest first, before this instant and id.
    fn messages<'a>(
        &'a self,
        webhook: &'a str,
        before: Option<(i64, String)>,
        limit: u64,
    ) -> Answer<'a, Vec<Message>>;

    /// A message; none where there is none.
    fn message<'a>(&'a self, id: &'a str) -> Answer<'a, Option<Message>>;

    /// Keeps positions; those that are there already are passed over. Tells how many were not.
    fn keep_positions<'a>(&'a self, positions: &'a [PositionRow]) -> Answer<'a, u64>;

    /// Positions of a drone from one instant until before another, oldest first.
    fn positions<'a>(
        &'a self,
        drone: &'a str,
        from_ms: i64,
        until_ms: i64,
        limit: u64,
    ) -> Answer<'a, Vec<PositionRow>>;

    /// The last position of each of some drones, not before an instant; of those that have one.
    fn last_positions<'a>(
        &'a self,
        drones: &'a [String],
        from_ms: i64,
    ) -> Answer<'a, Vec<PositionRow>>;

    /// Failures over a network from one instant until before another, counted; the most frequent first.
    fn count_failures<'a>(
        &'a self,
        network: &'a str,
        from_ms: i64,
        until_ms: i64,
        limit: u64,
    ) -> Answer<'a, Vec<FailureCount>>;

    /// Drops positions, settled messages and expired quotes from before an instant. An engine that keeps positions by the day
    /// drops whole days. Failures are dropped from before an instant of their own.
    fn drop_before(&self, before_ms: i64, failures_before_ms: i64) -> Answer<'_, ()>;
}
