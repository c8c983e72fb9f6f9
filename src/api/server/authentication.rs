//! Who calls: by a bearer token, or anyone where there are none. Of what lasts, also whether the token still counts.

use super::hosts::Hosts;
use super::request::bearer;
use crate::access::Caller;
use crate::api::operations::{Access, Operation};
use crate::edge::{Code, Refusal};
use http::header;
use http::request::Parts;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use tokio::sync::watch;
use tokio_stream::Stream;
use tokio_stream::wrappers::WatchStream;

/// Finds the caller of a bearer token.
pub type FindCaller = Arc<dyn Fn(&str) -> Option<Caller> + Send + Sync>;

/// Tokens as they count now.
#[derive(Clone)]
pub struct KnownTokens {
    /// Finds the caller of one that counts.
    pub find: FindCaller,
    /// Changes when one that counted may count no more.
    pub changed: watch::Receiver<u64>,
}

/// How callers say who they are.
#[derive(Clone)]
pub enum Authentication {
    /// They need not, but must name this listener as their host: for loopback without tokens.
    Loopback,
    /// By a bearer token.
    Tokens(KnownTokens),
}

impl Authentication {
    /// Who calls; for an answer without an end also how long its token counts.
    pub(super) fn caller(
        &self,
        head: &Parts,
        operation: Operation,
        hosts: &Hosts,
    ) -> Result<(Caller, Option<Lease>), Refusal> {
        let tokens = match self {
            Self::Tokens(tokens) => tokens,
            Self::Loopback => {
                return match hosts.stranger(head) {
                    None => Ok((Caller::anyone(), None)),
                    Some(what) => Err(Refusal::new(Code::HostRefused, what)),
                };
            }
        };
        if operation.row().access == Access::Open {
            return Ok((Caller::anyone(), None));
        }
        let unauthenticated = |detail: &str| Refusal::new(Code::Unauthenticated, detail);
        // A proxy in front may have checked the other one.
        if head.headers.get_all(header::AUTHORIZATION).iter().count() > 1 {
            return Err(unauthenticated(
                "there is more than one Authorization header, and it is unclear which one counts; send one",
            ));
        }
        let Some(token) = bearer(head) else {
            return Err(unauthenticated(
                "there is no bearer token in the Authorization header",
            ));
        };
        let Some(caller) = (tokens.find)(token) else {
            return Err(unauthenticated("the bearer token is not known here"));
        };
        if !operation.allows(caller.role) {
            let detail = format!(
                "the role '{}' may not {}",
                caller.role.name(),
                operation.row().name
            );
            return Err(Refusal::new(Code::Forbidden, detail));
        }
        let lasts = operation.row().class.is_stream();
        let lease = lasts.then(|| Lease {
            token: Box::from(token),
            caller: caller.clone(),
            find: tokens.find.clone(),
            changes: WatchStream::from_changes(tokens.changed.clone()),
        });
        Ok((caller, lease))
    }
}

/// That the token of an answer without an end still counts.
pub(crate) struct Lease {
    token: Box<str>,
    caller: Caller,
    find: FindCaller,
    changes: WatchStream<u64>,
}

impl Lease {
    /// Ready once the token counts no more, or is another caller's.
    pub(super) fn poll_ended(&mut self, context: &mut Context<'_>) -> Poll<()> {
        loop {
            match Pin::new(&mut self.changes).poll_next(context) {
                Poll::Ready(Some(_)) => {
                    if (self.find)(&self.token).as_ref() != Some(&self.caller) {
                        return Poll::Ready(());
                    }
                }
                // Nobody reads the tokens any more: the process ends.
                Poll::Ready(None) | Poll::Pending => return Poll::Pending,
            }
        }
    }
}
