//! One subscriber of `/v1/events`: every event with the moment at which it was received.

use crate::Result;
use crate::transport::stream;
use bytes::{Bytes, BytesMut};
use http::StatusCode;
use http_body_util::BodyExt;
use hyper::body::Incoming;
use serde::Deserialize;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::rc::Rc;
use std::time::{Duration, Instant};
use tokio::task::{AbortHandle, spawn_local};
use tokio::time::sleep;

const EVENTS: &str = "/v1/events";
const LOOK_AGAIN: Duration = Duration::from_millis(2);
const DATA: &[u8] = b"data:";
const KIND: &[u8] = b"event:";
const ID: &[u8] = b"id:";
/// The events after the one that was named are not kept any more, or were of an edge that has ended.
const GONE: StatusCode = StatusCode::GONE;

/// An event as it came.
#[derive(Clone, Debug)]
pub(crate) struct Heard {
    pub(crate) at: Instant,
    pub(crate) kind: String,
    /// Its JSON.
    pub(crate) data: Bytes,
}

/// What the drone of a plan is told, as far as it is counted.
#[derive(Debug, Deserialize)]
pub(crate) struct Outcome {
    pub(crate) plan: PlanOf,
    pub(crate) causes: Vec<String>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct PlanOf {
    pub(crate) id: String,
    pub(crate) wanted: Option<VersionOf>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct VersionOf {
    pub(crate) version: u32,
}

/// All plans that a closure meets are told.
#[derive(Debug, Deserialize)]
pub(crate) struct Replanned {
    pub(crate) closure_id: String,
    pub(crate) plan_count: usize,
    outcomes: BTreeMap<String, usize>,
}

impl Replanned {
    /// Plans of which there was something to tell: what met them was not over or behind them when
    /// their turn came.
    pub(crate) fn to_tell(&self) -> usize {
        let silent = ["unaffected", "ended"].map(|outcome| self.outcomes.get(outcome));
        let silent: usize = silent.into_iter().flatten().sum();
        self.plan_count.saturating_sub(silent)
    }
}

#[derive(Deserialize)]
struct Event<T> {
    data: T,
}

impl Heard {
    /// What a plan's drone is told by this event.
    pub(crate) fn outcome(&self) -> Option<Outcome> {
        match self.kind.as_str() {
            "plan_affected" | "plan_relieved" => self.data(),
            _ => None,
        }
    }

    pub(crate) fn replanned(&self) -> Option<Replanned> {
        match self.kind.as_str() {
            "replanned" => self.data(),
            _ => None,
        }
    }

    fn data<T: for<'a> Deserialize<'a>>(&self) -> Option<T> {
        let event: Event<T> = serde_json::from_slice(&self.data).ok()?;
        Some(event.data)
    }
}

/// Listens until it is dropped.
pub(crate) struct Listener {
    heard: Rc<RefCell<Vec<Heard>>>,
    /// The id of the latest event, from after which it would listen again.
    latest: Rc<RefCell<Option<String>>>,
    has_ended: Rc<Cell<bool>>,
    task: AbortHandle,
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Listener {
    /// From now on.
    pub(crate) async fn of(address: SocketAddr) -> Result<Self> {
        let told = stream(address, EVENTS, None).await?;
        match told.status().is_success() {
            true => Ok(Self::over(told.into_body())),
            false => Err(format!("{EVENTS} was answered with {}", told.status()).into()),
        }
    }

    /// From after the latest event of another listener; nothing where the events after it are gone,
    /// so that the lists are to be read again.
    pub(crate) async fn resumed(address: SocketAddr, latest: &str) -> Result<Option<Self>> {
        let told = stream(address, EVENTS, Some(latest)).await?;
        match told.status() {
            GONE => Ok(None),
            status if status.is_success() => Ok(Some(Self::over(told.into_body()))),
            status => Err(format!("events after {latest} were answered with {status}").into()),
        }
    }

    fn over(body: Incoming) -> Self {
        let heard = Rc::new(RefCell::default());
        let latest = Rc::new(RefCell::default());
        let has_ended = Rc::new(Cell::new(false));
        let ears = Ears {
            heard: Rc::clone(&heard),
            latest: Rc::clone(&latest),
            has_ended: Rc::clone(&has_ended),
        };
        Self {
            heard,
            latest,
            has_ended,
            task: spawn_local(listen(body, ears)).abort_handle(),
        }
    }

    /// The id of the latest event that was heard.
    pub(crate) fn latest(&self) -> Option<String> {
        self.latest.borrow().clone()
    }

    /// Waits until all is heard that an edge told before it ended.
    pub(crate) async fn heard_out(&self, patience: Duration) -> Result<()> {
        let begun = Instant::now();
        while !self.has_ended.get() {
            if begun.elapsed() > patience {
                return Err("the stream of events of an edge that has ended goes on".into());
            }
            sleep(LOOK_AGAIN).await;
        }
        Ok(())
    }

    /// When something was last heard, of what was not taken yet.
    pub(crate) fn last(&self) -> Option<Instant> {
        self.heard.borrow().last().map(|heard| heard.at)
    }

    /// What was heard since this was last asked.
    pub(crate) fn take(&self) -> Vec<Heard> {
        self.heard.take()
    }

    /// Waits for an event; false where it has not come in time.
    pub(crate) async fn has_come(
        &self,
        patience: Duration,
        is_it: impl Fn(&Heard) -> bool,
    ) -> Result<bool> {
        let begun = Instant::now();
        let mut looked_at = 0;
        loop {
            let is_there = {
                let heard = self.heard.borrow();
                let new = heard.get(looked_at..).unwrap_or_default();
                looked_at = heard.len();
                new.iter().any(&is_it)
            };
            if is_there {
                return Ok(true);
            }
            self.still_listens()?;
            if begun.elapsed() > patience {
                return Ok(false);
            }
            sleep(LOOK_AGAIN).await;
        }
    }

    fn still_listens(&self) -> Result<()> {
        match self.has_ended.get() {
            true => Err(
                "the stream of events has ended: its subscriber was too slow, or the edge is gone"
                    .into(),
            ),
            false => Ok(()),
        }
    }
}

/// Where a listener's task puts what it hears.
struct Ears {
    heard: Rc<RefCell<Vec<Heard>>>,
    latest: Rc<RefCell<Option<String>>>,
    has_ended: Rc<Cell<bool>>,
}

async fn listen(mut body: Incoming, ears: Ears) {
    let mut text = BytesMut::new();
    while let Some(Ok(frame)) = body.frame().await {
        let at = Instant::now();
        let Ok(data) = frame.into_data() else {
            continue;
        };
        let looked_at = text.len().saturating_sub(1);
        text.extend_from_slice(&data);
        let mut from = looked_at;
        while let Some(end) = end_of_event(&text, from) {
            let event = text.split_to(end).freeze();
            ears.heard.borrow_mut().extend(event_of(&event, at));
            if let Some(id) = id_of(&event) {
                ears.latest.replace(Some(id));
            }
            from = 0;
        }
    }
    ears.has_ended.set(true);
}

/// Where the first event ends, which an empty line does.
fn end_of_event(text: &[u8], from: usize) -> Option<usize> {
    let place = text[from..].windows(2).position(|pair| pair == b"\n\n")?;
    Some(from + place + 2)
}

/// The id of an event, which the first frame of a stream has, too, where nothing has happened yet.
fn id_of(text: &[u8]) -> Option<String> {
    let mut lines = text.split(|byte| *byte == b'\n');
    let id = lines.find_map(|line| line.strip_prefix(ID))?;
    Some(String::from_utf8_lossy(id.trim_ascii()).into_owned())
}

/// Nothing for a comment, which keeps the connection alive.
fn event_of(text: &Bytes, at: Instant) -> Option<Heard> {
    let mut kind = None;
    let mut data = None;
    for line in text.split(|byte| *byte == b'\n') {
        if let Some(rest) = line.strip_prefix(KIND) {
            kind = Some(String::from_utf8_lossy(rest.trim_ascii()).into_owned());
        } else if let Some(rest) = line.strip_prefix(DATA) {
            data = Some(text.slice_ref(rest.trim_ascii()));
        }
    }
    Some(Heard {
        at,
        kind: kind?,
        data: data?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_has_its_kind_and_its_text() {
        let text = b"id: 1-2\nevent: plan_affected\n\
            data: {\"data\":{\"plan\":{\"id\":\"p\"},\"causes\":[\"z\"]}}\n\n";
        let text = Bytes::from_static(text);
        assert_eq!(end_of_event(&text, 0), Some(text.len()));
        let heard = event_of(&text, Instant::now()).expect("an event");
        let outcome = heard.outcome().expect("an outcome");
        assert_eq!(
            (outcome.plan.id.as_str(), outcome.causes),
            ("p", vec!["z".to_owned()])
        );
        assert_eq!(id_of(&text).as_deref(), Some("1-2"));
        assert!(event_of(&Bytes::from_static(b": alive\n\n"), Instant::now()).is_none());
    }
}
