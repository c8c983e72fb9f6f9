//! The Enter key of the person who runs the demo.

use super::super::stop::Stop;
use tokio::sync::mpsc::{Receiver, channel};

/// Tells of every line that is entered, until there are no more.
#[expect(
    clippy::disallowed_methods,
    reason = "the door to the keyboard; reading blocks, so it has a thread, which ends with the process"
)]
pub(super) fn lines() -> Result<Receiver<()>, Stop> {
    let (told, lines) = channel(1);
    let reader = move || {
        for line in std::io::stdin().lines() {
            if line.is_err() || told.blocking_send(()).is_err() {
                return;
            }
        }
    };
    let thread = std::thread::Builder::new().name("skyway-keys".to_owned());
    thread.spawn(reader).map_err(Stop::failed)?;
    Ok(lines)
}
