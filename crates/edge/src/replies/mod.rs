//! Answers to requests that are sent twice.
//!
//! A drone's report is answered again by what was answered before, while that still holds; one whose first
//! sending is still being answered joins it. An operator's write with an idempotency key is done once: the
//! same body gets the same answer, another body is refused.

mod aging;

pub(super) use aging::Bounds;

use crate::failed;
use crate::failures::records::weight;
use crate::failures::stored_answer::{RestoredAnswer, StoredAnswer};
use crate::locks::lock;
use crate::store::{Entry, Reply, ReportReply, Store, WriteReply};
use aging::Aging;
use jiff::Timestamp;
use serde::Serialize;
use serde::de::DeserializeOwned;
use skyway_contract::{self as wire, text_bytes};
use skyway_engine::airspace::Airspace;
use skyway_service::refusal::{Code, Refusal};
use std::any::Any;
use std::borrow::Cow;
use std::future::Future;
use std::sync::{Arc, Mutex, Weak};
use tokio::sync::{OnceCell, Semaphore};

/// About what a reply takes beside what was sent and what was answered.
const REPLY_BYTES: usize = 1_000;

/// The sending of a report under an id, answered or about to be.
#[derive(Debug)]
pub(super) struct Sending {
    pub(super) report: wire::FailureReport,
    pub(super) answer: OnceCell<StoredAnswer>,
}

/// What reports with ids were answered, by subject and id.
#[derive(Debug)]
pub(super) struct ReportReplies {
    sendings: Mutex<Aging<String, Arc<Sending>>>,
    /// That of the answer weighed last.
    last_world: Mutex<Weak<Airspace>>,
}

impl ReportReplies {
    pub(super) fn new(bounds: Bounds) -> Self {
        Self {
            sendings: Mutex::new(Aging::new(bounds)),
            last_world: Mutex::default(),
        }
    }

    /// Counts an answer with the report, and the world that it was computed on where the one before had another.
    pub(super) fn weigh(
        &self,
        subject: &Arc<str>,
        id: &str,
        (sending, report_bytes): (&Arc<Sending>, usize),
        now: Timestamp,
    ) {
        let mut bytes = REPLY_BYTES + report_bytes;
        if let Some(StoredAnswer::Before(earlier)) = sending.answer.get() {
            bytes += earlier.bytes();
        }
        if let Some(StoredAnswer::Now(record)) = sending.answer.get() {
            let world = Arc::downgrade(&record.airspace);
            let before = std::mem::replace(&mut *lock(&self.last_world), world.clone());
            let is_shared = before.ptr_eq(&world);
            bytes += record.bytes()
                + if is_shared {
                    0
                } else {
                    weight(&record.airspace)
                };
        }
        let key = (subject.clone(), id.to_owned());
        lock(&self.sendings).weigh(&key, bytes, now, |held| Arc::ptr_eq(held, sending));
    }

    /// The sending under this id: the one there is, or this one as the first.
    pub(super) fn join(
        &self,
        subject: &Arc<str>,
        id: &str,
        report: &wire::FailureReport,
        now: Timestamp,
    ) -> Arc<Sending> {
        let key = (subject.clone(), id.to_owned());
        let mut sendings = lock(&self.sendings);
        if let Some(sending) = sendings.get(&key, now) {
            return sending;
        }
        let sending = Arc::new(Sending {
            report: report.clone(),
            answer: OnceCell::new(),
        });
        sendings.put(key, (sending.clone(), REPLY_BYTES + report.bytes()), now);
        sending
    }

    /// Keeps a newer answer to the same report in place of one that no longer holds.
    pub(super) fn renew(
        &self,
        subject: &Arc<str>,
        id: &str,
        report: &wire::FailureReport,
        given: StoredAnswer,
        now: Timestamp,
    ) {
        let sending = Arc::new(Sending {
            report: report.clone(),
            answer: OnceCell::new_with(Some(given)),
        });
        let (key, bytes) = ((subject.clone(), id.to_owned()), report.bytes());
        lock(&self.sendings).put(key, (sending.clone(), REPLY_BYTES + bytes), now);
        self.weigh(subject, id, (&sending, bytes), now);
    }

    /// Takes up what was answered in an earlier start. One that cannot be read any more is answered anew.
    pub(super) fn restore(&self, reply: ReportReply, at: Timestamp) {
        if let Some(earlier) = RestoredAnswer::of(&reply) {
            let given = StoredAnswer::Before(Arc::new(earlier));
            let subject = Arc::from(reply.subject);
            self.renew(&subject, &reply.id, &reply.report, given, at);
        }
    }
}

/// An idempotency key, and what the body was.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Idempotency {
    /// The key; without one every request is done.
    pub key: Option<String>,
    /// SHA-256 of the body.
    pub fingerprint: [u8; 32],
}

#[derive(Clone)]
enum Write {
    Running,
    Done(Arc<dyn Any + Send + Sync>),
    /// In an earlier start: the JSON of the answer.
    Before(Arc<str>),
    /// In force and not stored. Done again, it would be in force twice.
    NotStored(Refusal),
}

/// Bytes in memory, about, for each byte of an answer's text.
const ANSWER_TO_TEXT: usize = 4;

/// Writes with keys that may be under way at once, those included whose clients have gone.
const RUNNING_MAX: usize = 1_024;

/// Operation and key.
type Asked = (Cow<'static, str>, String);
type WriteKey = (Arc<str>, Asked);
type Writes = Aging<Asked, ([u8; 32], Write)>;

/// What operators' writes with idempotency keys were answered, by subject, operation and key.
#[derive(Clone)]
pub(super) struct WriteReplies {
    writes: Arc<Mutex<Writes>>,
    places: Arc<Semaphore>,
    store: Store,
}

impl WriteReplies {
    pub(super) fn new(bounds: Bounds, store: Store) -> Self {
        Self {
            store,
            places: Arc::new(Semaphore::new(RUNNING_MAX)),
            writes: Arc::new(Mutex::new(Aging::new(bounds))),
        }
    }

    /// Does a write once. A refusal is not kept, as the same key may be tried again, unless the write is in force.
    pub(super) async fn once<T, W>(
        &self,
        subject: &Arc<str>,
        operation: impl Into<Cow<'static, str>>,
        idempotency: Idempotency,
        now: Timestamp,
        write: W,
    ) -> Result<T, Refusal>
    where
        T: Clone + Serialize + DeserializeOwned + Send + Sync + 'static,
        W: Future<Output = Result<T, Refusal>> + Send + 'static,
    {
        let Some(key) = idempotency.key else {
            return write.await;
        };
        if key.is_empty() || key.len() > 256 {
            let detail = "the idempotency key has to have 1 to 256 bytes";
            return Err(Refusal::new(Code::ParameterInvalid, detail));
        }
        let key = (subject.clone(), (operation.into(), key));
        let fingerprint = idempotency.fingerprint;
        let Ok(place) = self.places.clone().try_acquire_owned() else {
            let detail = format!("{RUNNING_MAX} writes with idempotency keys are under way");
            return Err(Refusal::new(Code::Overloaded, detail).retry_after_s(1));
        };
        let serial = match self.begin(&key, fingerprint, now)? {
            Begun::Done(answer) => return Ok(answer),
            Begun::First(serial) => serial,
        };
        let replies = self.clone();
        // A client that goes away does not stop what the writer carries out already: it would not know its key afterwards.
        let done = tokio::spawn(async move {
            let _place = place;
            // However the write ends, also by a panic, the key is free, unless what became of it has taken the key.
            let _running = Running {
                writes: replies.writes.clone(),
                key: key.clone(),
                serial,
            };
            let answer = write.await;
            replies.keep(key, fingerprint, &answer, now);
            answer
        });
        done.await.unwrap_or_else(|error| Err(failed(&error)))
    }

    /// Keeps what a write was answered.
    fn keep<T>(
        &self,
        key: WriteKey,
        fingerprint: [u8; 32],
        answer: &Result<T, Refusal>,
        now: Timestamp,
    ) where
        T: Clone + Serialize + Send + Sync + 'static,
    {
        let (write, bytes) = match answer {
            Ok(answer) => {
                self.note(&key, fingerprint, answer, now);
                let bytes = ANSWER_TO_TEXT * text_bytes(answer);
                (Write::Done(Arc::new(answer.clone())), bytes)
            }
            Err(refusal) if refusal.enforced => (Write::NotStored(refusal.clone()), 0),
            Err(_) => return,
        };
        lock(&self.writes).put(key, ((fingerprint, write), REPLY_BYTES + bytes), now);
    }

    /// Notes an answer for a later start.
    fn note<T: Serialize>(&self, key: &WriteKey, fingerprint: [u8; 32], answer: &T, at: Timestamp) {
        if !self.store.is_kept() {
            return;
        }
        let (subject, (operation, key)) = key;
        let reply = Reply::Write(WriteReply {
            subject: subject.to_string(),
            operation: operation.to_string(),
            key: key.clone(),
            fingerprint,
            // A map with text keys and finite numbers always has a JSON form.
            answer: serde_json::to_string(answer).unwrap_or_default(),
        });
        self.store.note(Entry::Write { reply, at });
    }

    /// Takes up what was answered in an earlier start.
    pub(super) fn restore(&self, reply: WriteReply, at: Timestamp) {
        let asked = (Cow::Owned(reply.operation), reply.key);
        let key = (Arc::from(reply.subject), asked);
        let bytes = REPLY_BYTES + reply.answer.len();
        let before = Write::Before(Arc::from(reply.answer));
        lock(&self.writes).put(key, ((reply.fingerprint, before), bytes), at);
    }

    fn begin<T: Clone + DeserializeOwned + Send + Sync + 'static>(
        &self,
        key: &WriteKey,
        fingerprint: [u8; 32],
        now: Timestamp,
    ) -> Result<Begun<T>, Refusal> {
        let mut writes = lock(&self.writes);
        match writes.get(key, now) {
            None => Ok(Begun::First(writes.put(
                key.clone(),
                ((fingerprint, Write::Running), REPLY_BYTES),
                now,
            ))),
            Some((before, _)) if before != fingerprint => {
                let detail = "this idempotency key was used with another body; take a new key";
                Err(Refusal::new(Code::IdempotencyMismatch, detail))
            }
            Some((_, Write::Running)) => {
                let detail = "the first request with this idempotency key is still being answered";
                Err(Refusal::new(Code::IdempotencyInProgress, detail).retry_after_s(1))
            }
            Some((_, Write::NotStored(refusal))) => Err(refusal),
            Some((_, Write::Before(answer))) => match serde_json::from_str(&answer) {
                Ok(answer) => Ok(Begun::Done(answer)),
                Err(error) => {
                    let detail = format!("the answer kept under this key cannot be read: {error}");
                    Err(Refusal::new(Code::Internal, detail))
                }
            },
            Some((_, Write::Done(answer))) => match answer.downcast_ref::<T>() {
                Some(answer) => Ok(Begun::Done(answer.clone())),
                None => Err(Refusal::new(
                    Code::Internal,
                    "an answer of another kind is kept under this key",
                )),
            },
        }
    }
}

enum Begun<T> {
    First(u64),
    Done(T),
}

struct Running {
    writes: Arc<Mutex<Writes>>,
    key: WriteKey,
    serial: u64,
}

impl Drop for Running {
    fn drop(&mut self) {
        lock(&self.writes).remove(&self.key, self.serial);
    }
}
