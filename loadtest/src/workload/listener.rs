//! One subscriber of `/v1/events`: every event with the moment at which it was received.

use crate::Result;
use crate::transport::stream;
use bytes::{Bytes, BytesMut};
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

const LOOK_AGAIN: Duration = Duration::from_millis(2);
const DATA: &[u8] = b"data:";
const KIND: &[u8] = b"event:";

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
    has_ended: Rc<Cell<bool>>,
    task: AbortHandle,
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Listener {
    pub(crate) async fn of(address: SocketAddr) -> Result<Self> {
        let body = stream(address, "/v1/events").await?;
        let heard = Rc::new(RefCell::default());
        let has_ended = Rc::new(Cell::new(false));
        let task = spawn_local(listen(body, Rc::clone(&heard), Rc::clone(&has_ended)));
        Ok(Self {
            heard,
            has_ended,
            task: task.abort_handle(),
        })
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

async fn listen(mut body: Incoming, heard: Rc<RefCell<Vec<Heard>>>, has_ended: Rc<Cell<bool>>) {
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
            heard.borrow_mut().extend(event_of(&event, at));
            from = 0;
        }
    }
    has_ended.set(true);
}

/// Where the first event ends, which an empty line does.
fn end_of_event(text: &[u8], from: usize) -> Option<usize> {
    let place = text[from..].windows(2).position(|pair| pair == b"\n\n")?;
    Some(from + place + 2)
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
        assert!(event_of(&Bytes::from_static(b": alive\n\n"), Instant::now()).is_none());
    }
}
