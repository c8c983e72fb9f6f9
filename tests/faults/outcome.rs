//! How a run of a registry is judged at its end.

use crate::history::{Operation, Outcome, Version, log};
use crate::registry_client::{All, Answer, Client, NETWORK};
use crate::rounds::seed;
use crate::square::circle;
use crate::writers::Left;

/// What a run came to.
#[derive(Debug, Default)]
pub(crate) struct Came {
    pub(crate) violations: Vec<String>,
    pub(crate) acknowledged: usize,
    pub(crate) unknown: usize,
    pub(crate) revisions: u64,
}

impl Came {
    pub(crate) fn adds(&mut self, when: &str, violations: impl IntoIterator<Item = String>) {
        let told = violations.into_iter().map(|it| format!("{when}: {it}"));
        self.violations.extend(told);
    }

    /// Reads what is there, and holds everything that was done against it.
    pub(crate) async fn judge(&mut self, client: &Client, operations: Vec<Operation>, left: Left) {
        self.judge_restored(client, operations, left, None, Vec::new())
            .await;
    }

    /// The same where backups were restored: with the versions they ended with, and the log out of the file, as no edge
    /// is told what was before the last one.
    pub(crate) async fn judge_restored(
        &mut self,
        client: &Client,
        operations: Vec<Operation>,
        left: Left,
        log: Option<All>,
        restored: Vec<Version>,
    ) {
        let done = operations.iter().filter(|it| it.is_done());
        self.acknowledged = done.count();
        let unknown = operations
            .iter()
            .filter(|it| it.outcome == Outcome::Unknown);
        self.unknown = unknown.count();
        self.violations.extend(left.violations);
        let read = match log {
            Some(all) => Ok(all),
            None => client.read_log().await,
        };
        let holding = match client.read_holding().await {
            Ok(holding) => holding,
            Err(wrong) => {
                self.violations.push(wrong);
                return;
            }
        };
        match read {
            Err(wrong) => self.violations.push(wrong),
            Ok(all) => {
                self.revisions = all.head;
                let run = log::Run {
                    operations,
                    log: all.log(),
                    revisions: all.revisions(),
                    holding,
                    restored,
                };
                self.violations.extend(run.violations());
                if !all.changes.starts_with(&left.followed) {
                    let text = "what was followed is not what the log says in the end";
                    self.violations.push(text.to_owned());
                }
            }
        }
        self.violations.extend(takes_no_writes(client).await);
    }

    /// Fails where something was violated, or where nothing happened that could have been.
    #[track_caller]
    pub(crate) fn is_right(&self, what: &str, least: usize) {
        let (seed, Self { violations, .. }) = (seed(), self);
        let Self {
            acknowledged,
            unknown,
            revisions,
            ..
        } = self;
        println!(
            "{what}: {acknowledged} acknowledged, {unknown} without an answer, {revisions} revisions (seed {seed})"
        );
        assert!(violations.is_empty(), "seed {seed}: {violations:#?}");
        assert!(*acknowledged >= least, "too little happened: {self:?}");
    }

    /// Fails where a planted bug was not found.
    #[cfg(feature = "planted")]
    #[track_caller]
    pub(crate) fn finds(&self, bug: &str) {
        let first = self.violations.first();
        let count = self.violations.len();
        println!("{bug} is found: {count} violations, the first: {first:?}");
        assert!(first.is_some(), "seed {}: {bug} is not found", seed());
    }
}

/// Whether the registry is of no use in the end.
async fn takes_no_writes(client: &Client) -> Option<String> {
    let zone = circle("last", "last", [50.0, 50.0], 1.0);
    let line = format!("POST /v1/networks/{NETWORK}/zones");
    match client.ask(&line, &[], &zone).await {
        Answer::Came { status: 201, .. } => None,
        Answer::Came { status, body, .. } => {
            Some(format!("it takes no writes any more: {status} {body}"))
        }
        Answer::Nothing { .. } => Some("it does not answer".to_owned()),
    }
}
