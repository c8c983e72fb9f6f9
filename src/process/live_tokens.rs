//! Tokens as their file has them now: it is read again when it changes, so that a token is given out or revoked
//! without a restart.

use crate::api::server::{Authentication, FindCaller, KnownTokens};
use crate::clock::machine_now;
use crate::config::Tokens;
use arc_swap::ArcSwap;
use jiff::Timestamp;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Weak};
use std::time::Duration;
use tokio::sync::watch;
use tokio::time::sleep;

/// How often the file is looked at.
const LOOK_EVERY: Duration = Duration::from_secs(2);

/// The tokens of a file, while somebody asks for them.
struct LiveTokens {
    path: PathBuf,
    tokens: ArcSwap<Tokens>,
    changed: watch::Sender<u64>,
}

/// How callers say who they are; the tokens were read from the file when the daemon was admitted.
pub(super) fn authentication(tokens: Option<Tokens>, path: Option<&Path>) -> Authentication {
    let (Some(tokens), Some(path)) = (tokens, path) else {
        return Authentication::Loopback;
    };
    let (changed, changes) = watch::channel(0);
    let live = Arc::new(LiveTokens {
        path: path.to_owned(),
        tokens: ArcSwap::from_pointee(tokens),
        changed,
    });
    tokio::spawn(follow(Arc::downgrade(&live)));
    let find: FindCaller = Arc::new(move |token| live.tokens.load().find(token, machine_now()));
    Authentication::Tokens(KnownTokens {
        find,
        changed: changes,
    })
}

async fn follow(tokens: Weak<LiveTokens>) {
    let mut seen = None;
    loop {
        let began = machine_now();
        sleep(LOOK_EVERY).await;
        let Some(live) = tokens.upgrade() else {
            return;
        };
        // What blocks is done where it may; the file is small.
        let looked = tokio::task::spawn_blocking(move || {
            let stamp = live.look(seen);
            live.tell_ended(began);
            stamp
        });
        if let Ok(stamp) = looked.await {
            seen = stamp;
        }
    }
}

/// When a file was written, and how long it was then.
type Stamp = (Timestamp, u64);

impl LiveTokens {
    /// Reads the file where it is not as it was; what cannot be read leaves the tokens as they are.
    fn look(&self, seen: Option<Stamp>) -> Option<Stamp> {
        let path = self.path.display();
        let stamp = match Tokens::stamp(&self.path) {
            Ok(stamp) => stamp,
            Err(error) => {
                if seen.is_some() {
                    tracing::error!(%path, %error, "the file of tokens is gone; those that were in it still count");
                }
                return None;
            }
        };
        if seen == Some(stamp) {
            return seen;
        }
        match Tokens::load(&self.path) {
            Ok(tokens) if tokens != **self.tokens.load() => {
                tracing::info!(%path, count = tokens.count(), "other tokens count now");
                self.tokens.store(Arc::new(tokens));
                self.changed.send_modify(|times| *times += 1);
            }
            Ok(_) => {}
            Err(error) => {
                tracing::error!(%path, %error, "the file of tokens cannot be read; those that were in it still count");
            }
        }
        Some(stamp)
    }

    /// Tells that a token has ended since an instant.
    fn tell_ended(&self, since: Timestamp) {
        let next = self.tokens.load().next_end(since);
        if next.is_some_and(|ends_at| ends_at <= machine_now()) {
            self.changed.send_modify(|times| *times += 1);
        }
    }
}

#[cfg(all(test, unix))]
#[expect(clippy::disallowed_methods, reason = "writes the file that it follows")]
mod tests {
    use super::*;
    use crate::config::NewToken;
    use std::fs::{self, Permissions};
    use std::os::unix::fs::PermissionsExt;

    const NOW: Timestamp = Timestamp::UNIX_EPOCH;

    fn permit(path: &Path, mode: u32) {
        fs::set_permissions(path, Permissions::from_mode(mode)).expect("may be changed");
    }

    #[test]
    fn a_token_that_is_taken_out_counts_no_more() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("tokens.toml");
        let known = NewToken::of(&[7; 32], "operator", "desk", (None, None), None);
        let known = known.expect("a token");
        fs::write(&path, known.stanza()).expect("is written");
        permit(&path, 0o600);
        let live = LiveTokens {
            path: path.clone(),
            tokens: ArcSwap::from_pointee(Tokens::default()),
            changed: watch::channel(0).0,
        };
        let counts = || live.tokens.load().find(&known.token, NOW).is_some();
        let seen = live.look(None);
        assert!(counts());

        // The last one is taken out, and others may read the file until it is noticed.
        fs::write(&path, "").expect("is written");
        permit(&path, 0o644);
        let seen = live.look(seen);
        assert!(counts(), "what others could have written says nothing");
        permit(&path, 0o600);
        let seen = live.look(seen);
        assert!(!counts());

        fs::write(&path, known.stanza()).expect("is written");
        live.look(seen);
        assert!(counts());
    }
}
