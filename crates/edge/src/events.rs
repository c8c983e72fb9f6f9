//! What happened, kept for a while and told to its subscribers.
//!
//! Events are numbered without gaps within an epoch. A listener reads on from the last number it has seen;
//! one that is too slow, or comes back too late, is told so and starts again from a list.

use crate::background::give_way;
use crate::locks::lock;
use jiff::Timestamp;
use serde_json::Value;
use skyway_contract::{self as wire, ClockKind, EventKind};
use skyway_service::refusal::{Code, Refusal};
use std::borrow::Cow;
use std::collections::VecDeque;
use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll};
use tokio::sync::watch;
use tokio_stream::Stream;
use tokio_stream::wrappers::WatchStream;

/// An event before it has a number.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Happening {
    pub(super) kind: EventKind,
    pub(super) data: Value,
    /// Who has made it happen; none where it happened by itself.
    pub(super) by: Option<Arc<wire::Author>>,
    /// Why, where they have said.
    pub(super) reason: Option<Arc<str>>,
}

impl Happening {
    pub(super) fn new(kind: EventKind, data: Value) -> Self {
        Self {
            kind,
            data,
            by: None,
            reason: None,
        }
    }
}

/// Who makes happen what happens by itself.
const ITSELF: &str = "edge";

/// An event as it is told.
#[derive(Clone, Debug, PartialEq)]
pub struct EventRecord {
    /// `epoch-sequence`.
    pub id: String,
    /// What kind.
    pub kind: EventKind,
    /// The event.
    pub event: wire::Event<'static>,
    /// The event as JSON on one line.
    pub json: Arc<str>,
}

impl EventRecord {
    /// About how many bytes it takes: its text, and the same as values.
    fn bytes(&self) -> usize {
        size_of::<Self>() + VALUES_TO_TEXT * self.json.len()
    }
}

/// Bytes in memory, about, for each byte of an event's text.
const VALUES_TO_TEXT: usize = 5;

/// An event as it is told, all but its id.
#[derive(Debug)]
struct Unnumbered {
    event: wire::Event<'static>,
    json: String,
}

/// How the JSON of an event without an id begins.
const WITHOUT_ID: &str = r#"{"id":"""#;

impl Unnumbered {
    fn of(happening: Happening, (at, clock): (Timestamp, ClockKind), revision: &str) -> Self {
        let event = wire::Event {
            id: Cow::Borrowed(""),
            kind: happening.kind,
            at: Cow::Owned(at.to_string()),
            clock,
            revision: Cow::Owned(revision.to_owned()),
            by: match happening.by {
                Some(author) => (*author).clone(),
                None => wire::Author::new(ITSELF, ITSELF),
            },
            reason: happening
                .reason
                .map(|reason| Cow::Owned(reason.to_string())),
            data: happening.data,
        };
        // A map with text keys and plain values always has a JSON form.
        let json = serde_json::to_string(&event).unwrap_or_default();
        Self { event, json }
    }

    /// With its id: digits and a hyphen, which stand in JSON as they are.
    fn numbered(self, id: String) -> EventRecord {
        let rest = self.json.strip_prefix(WITHOUT_ID).unwrap_or_default();
        let json = format!(r#"{{"id":"{id}"{rest}"#);
        let event = wire::Event {
            id: Cow::Owned(id.clone()),
            ..self.event
        };
        EventRecord {
            id,
            kind: event.kind,
            event,
            json: Arc::from(json),
        }
    }
}

/// The events of this start.
#[derive(Debug)]
pub(super) struct Events {
    epoch: u64,
    /// What clock the times of events are of.
    clock: ClockKind,
    capacity: usize,
    capacity_bytes: usize,
    streams_max: usize,
    kept: Mutex<EventBuffer>,
    /// The number of the latest event, to wake listeners.
    latest: watch::Sender<u64>,
    /// The same, to wake who is no listener.
    news: watch::Sender<u64>,
}

#[derive(Debug)]
struct EventBuffer {
    /// Number of the next event; the first is 1.
    next: u64,
    events: VecDeque<Arc<EventRecord>>,
    bytes: usize,
}

impl Events {
    pub(super) fn new(
        (epoch, clock): (u64, ClockKind),
        (capacity, capacity_bytes): (usize, usize),
        streams_max: usize,
    ) -> Self {
        Self {
            epoch,
            clock,
            capacity,
            capacity_bytes,
            streams_max,
            kept: Mutex::new(EventBuffer {
                next: 1,
                bytes: 0,
                events: VecDeque::new(),
            }),
            latest: watch::Sender::new(0),
            news: watch::Sender::new(0),
        }
    }

    /// Adds events in their order.
    pub(super) fn add(&self, happenings: Vec<Happening>, at: Timestamp, revision: &str) {
        if happenings.is_empty() {
            return;
        }
        // Written before they have their numbers: a subscriber does not wait for that.
        let written = happenings.into_iter().map(|happening| {
            give_way();
            Unnumbered::of(happening, (at, self.clock), revision)
        });
        let written: Vec<Unnumbered> = written.collect();
        let mut kept = lock(&self.kept);
        for event in written {
            let record = event.numbered(format!("{}-{}", self.epoch, kept.next));
            kept.bytes += record.bytes();
            kept.events.push_back(Arc::new(record));
            kept.next += 1;
            // The latest is told whatever it takes.
            while kept.events.len() > self.capacity
                || (kept.bytes > self.capacity_bytes && kept.events.len() > 1)
            {
                let oldest = kept.events.pop_front();
                kept.bytes -= oldest.map_or(0, |oldest| oldest.bytes());
            }
        }
        let latest = kept.next - 1;
        drop(kept);
        self.latest.send_replace(latest);
        self.news.send_replace(latest);
    }

    /// Wakes with every event; what it shows is the number of the latest.
    pub(super) fn news(&self) -> watch::Receiver<u64> {
        self.news.subscribe()
    }

    /// The id of the latest event; `epoch-0` before the first.
    pub(super) fn latest_id(&self) -> String {
        format!("{}-{}", self.epoch, lock(&self.kept).next - 1)
    }

    /// Listens: from after `after`, or from now on.
    pub(super) fn listen(self: &Arc<Self>, after: Option<&str>) -> Result<EventStream, Refusal> {
        if self.latest.receiver_count() >= self.streams_max {
            let detail = format!("{} event streams are open already", self.streams_max);
            return Err(Refusal::new(Code::LimitReached, detail).retry_after_s(5));
        }
        let kept = lock(&self.kept);
        let next = match after {
            None => kept.next,
            Some(id) => self.resume(id, &kept)?,
        };
        drop(kept);
        Ok(EventStream {
            wakes: WatchStream::new(self.latest.subscribe()),
            events: self.clone(),
            next,
            has_ended: false,
        })
    }

    fn resume(&self, id: &str, kept: &EventBuffer) -> Result<u64, Refusal> {
        let number = |text: &str| text.parse::<u64>().ok();
        let parsed = id
            .split_once('-')
            .and_then(|(epoch, sequence)| number(epoch).zip(number(sequence)));
        let Some((epoch, sequence)) = parsed else {
            let detail = format!(
                "'{id}' is not the id of an event; they look like {}",
                self.example()
            );
            return Err(Refusal::new(Code::ParameterInvalid, detail));
        };
        if epoch != self.epoch || sequence >= kept.next {
            let detail = format!(
                "event {id} is not of this start of the edge; read the lists again and listen from {}",
                self.example()
            );
            return Err(Refusal::new(Code::EventsGone, detail));
        }
        let oldest = kept.next - kept.events.len() as u64;
        if sequence + 1 < oldest {
            let detail = format!(
                "events after {id} are gone, the oldest kept is {}-{oldest}; read the lists again",
                self.epoch
            );
            return Err(Refusal::new(Code::EventsGone, detail));
        }
        Ok(sequence + 1)
    }

    fn example(&self) -> String {
        format!("{}-1", self.epoch)
    }

    /// The event of a number: `Ok(None)` when it has not happened yet.
    fn get(&self, number: u64) -> Result<Option<Arc<EventRecord>>, Refusal> {
        let kept = lock(&self.kept);
        let oldest = kept.next - kept.events.len() as u64;
        if number < oldest {
            let detail = "this listener is too slow and has missed events; read the lists again";
            return Err(Refusal::new(Code::EventsGone, detail));
        }
        Ok(kept.events.get((number - oldest) as usize).cloned())
    }
}

/// Events as they happen; ends with a refusal when some were missed.
#[derive(Debug)]
pub struct EventStream {
    events: Arc<Events>,
    wakes: WatchStream<u64>,
    next: u64,
    has_ended: bool,
}

impl Stream for EventStream {
    type Item = Result<Arc<EventRecord>, Refusal>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        if self.has_ended {
            return Poll::Ready(None);
        }
        loop {
            match self.events.get(self.next) {
                Ok(Some(event)) => {
                    self.next += 1;
                    return Poll::Ready(Some(Ok(event)));
                }
                Ok(None) => {}
                Err(refusal) => {
                    self.has_ended = true;
                    return Poll::Ready(Some(Err(refusal)));
                }
            }
            match Pin::new(&mut self.wakes).poll_next(context) {
                Poll::Ready(Some(_)) => {}
                Poll::Ready(None) => return Poll::Ready(None),
                Poll::Pending => return Poll::Pending,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[expect(
        clippy::disallowed_methods,
        reason = "the writer and the task that follows a registry are two threads"
    )]
    fn events_of_two_at_once_have_numbers_without_gaps() {
        let events = Events::new((7, ClockKind::Real), (4_000, usize::MAX), 1);
        let add = || {
            for _ in 0..200 {
                let happening = Happening::new(EventKind::WeatherPut, Value::Null);
                events.add(vec![happening; 5], Timestamp::UNIX_EPOCH, "1-1");
            }
        };
        std::thread::scope(|scope| {
            scope.spawn(add);
            scope.spawn(add);
        });
        let kept = lock(&events.kept);
        let ids: Vec<&str> = kept.events.iter().map(|record| &*record.id).collect();
        let expected: Vec<String> = (1..=2_000).map(|number| format!("7-{number}")).collect();
        assert_eq!(ids, expected);
        for record in &kept.events {
            let written = serde_json::to_string(&record.event).expect("JSON");
            assert_eq!(*record.json, *written);
        }
    }
}
