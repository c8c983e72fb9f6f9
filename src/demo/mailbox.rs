//! The mailbox of a drone: what its edge tells it by itself, as server-sent events.

use super::client::{Client, ClientError};
use crate::wire::DroneMessage;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio_util::task::AbortOnDropHandle;

/// The first wait before a stream that broke is opened again, in the machine's time; each further one is twice as long.
const AGAIN_AFTER: Duration = Duration::from_millis(200);
const AGAIN_AFTER_MAX: Duration = Duration::from_secs(5);

/// A drone that listens, over as many streams as it takes.
#[derive(Debug)]
pub(super) struct Mailbox {
    told: Receiver<DroneMessage<'static>>,
    _listening: AbortOnDropHandle<()>,
}

impl Mailbox {
    /// Listens from now on, until this is dropped.
    pub(super) fn open(client: Arc<Client>, drone_id: String) -> Self {
        // One that waits is enough: the edge keeps the others.
        let (tells, told) = channel(1);
        let listening = tokio::spawn(listen(client, drone_id, tells));
        Self {
            told,
            _listening: AbortOnDropHandle::new(listening),
        }
    }

    /// The next message, once it has come.
    pub(super) async fn next(&mut self) -> Option<DroneMessage<'static>> {
        self.told.recv().await
    }
}

async fn listen(client: Arc<Client>, drone_id: String, tells: Sender<DroneMessage<'static>>) {
    let mut last = None;
    let mut again_after = AGAIN_AFTER;
    loop {
        let told_before = last.clone();
        let ended = hear(&client, &drone_id, &mut last, &tells).await;
        if tells.is_closed() {
            return;
        }
        tracing::info!(drone = drone_id, ?ended, "a stream of mail has ended");
        if last != told_before {
            again_after = AGAIN_AFTER;
        }
        tokio::time::sleep(again_after).await;
        again_after = (again_after * 2).min(AGAIN_AFTER_MAX);
    }
}

/// Passes on what one stream tells after a message, and notes which was the last, until it ends.
async fn hear(
    client: &Client,
    drone_id: &str,
    last: &mut Option<String>,
    tells: &Sender<DroneMessage<'static>>,
) -> Result<(), ClientError> {
    let mut stream = client.mail(drone_id, last.as_deref()).await?;
    let mut lines = Lines::default();
    while let Some(part) = stream.chunk().await? {
        lines.unread.extend_from_slice(&part);
        while let Some(message) = lines.message() {
            let id = message.id.to_string();
            if tells.send(message).await.is_err() {
                return Ok(());
            }
            *last = Some(id);
        }
    }
    Ok(())
}

/// What came of a stream and was not read yet.
#[derive(Debug, Default)]
struct Lines {
    unread: Vec<u8>,
}

impl Lines {
    /// The next message that is there as a whole. An edge writes it on one line; what else it writes tells nothing.
    fn message(&mut self) -> Option<DroneMessage<'static>> {
        while let Some(end) = self.unread.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = self.unread.drain(..=end).collect();
            let Some(data) = line.strip_prefix(b"data:") else {
                continue;
            };
            match serde_json::from_slice(data) {
                Ok(message) => return Some(message),
                Err(error) => tracing::error!(%error, "a message to a drone cannot be read"),
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_read_however_their_stream_is_cut() {
        let message = |number: u32| {
            format!(
                "id: 7-{number}\nevent: relieved\ndata: {{\"id\":\"7-{number}\",\"drone_id\":\"drone-1\",\
                 \"kind\":\"relieved\",\"at\":\"2026-11-27T18:00:00Z\",\"plan_id\":\"p\",\"revision\":\"7-1\",\
                 \"topology_revision\":1,\"freshness\":\"fresh\",\"clock\":\"real\"}}\n\n"
            )
        };
        let stream = format!(
            ": skyway\nretry: 2000\n\n{}: still here\n\n{}",
            message(1),
            message(2)
        );
        for size in [1, 7, stream.len()] {
            let mut lines = Lines::default();
            let mut ids = Vec::new();
            for part in stream.as_bytes().chunks(size) {
                lines.unread.extend_from_slice(part);
                while let Some(message) = lines.message() {
                    ids.push(message.id.to_string());
                }
            }
            assert_eq!(ids, ["7-1", "7-2"], "in parts of {size} bytes");
        }
    }
}
