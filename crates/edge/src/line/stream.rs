//! The mail of drones, as it comes.

use super::{Line, Next};
use crate::Edge;
use skyway_contract as wire;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use tokio_stream::Stream;

/// What is told on a line.
#[derive(Debug)]
pub enum Mail {
    /// A message for a drone.
    Message(Box<wire::DroneMessage<'static>>),
    /// A drone is on another session now.
    Ended(wire::EndedSession<'static>),
}

/// The mail of the drones on a line, as it comes; it never ends by itself.
#[derive(Debug)]
pub struct MailStream {
    edge: Arc<Edge>,
    line: Arc<Line>,
    /// Whether the line ends with it; that of a session ends with the session.
    is_whole: bool,
}

impl MailStream {
    pub(crate) fn of_session(edge: &Arc<Edge>, line: &Arc<Line>) -> Self {
        Self {
            edge: edge.clone(),
            line: line.clone(),
            is_whole: false,
        }
    }

    /// A line for one drone alone.
    pub(crate) fn of_drone(edge: &Arc<Edge>, drone: &Arc<str>, received: u64) -> Self {
        let line = Arc::default();
        edge.lines.join(&line, drone, received);
        Self {
            edge: edge.clone(),
            line,
            is_whole: true,
        }
    }
}

impl Stream for MailStream {
    type Item = Mail;

    fn poll_next(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Mail>> {
        loop {
            let Poll::Ready(next) = self.edge.lines.next(&self.line, context.waker()) else {
                return Poll::Pending;
            };
            match next {
                Next::Ended(ended) => return Poll::Ready(Some(Mail::Ended(ended))),
                Next::Message(snapshot, entry) => {
                    let stamp = self.edge.stamp_of(&snapshot);
                    if let Some(message) = snapshot.told_message(&entry, stamp) {
                        return Poll::Ready(Some(Mail::Message(Box::new(message))));
                    }
                }
            }
        }
    }
}

impl Drop for MailStream {
    fn drop(&mut self) {
        if self.is_whole {
            self.edge.lines.close(&self.line);
        }
    }
}
