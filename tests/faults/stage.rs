//! A registry and edges that follow it, each over a line of its own.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests of faults tell how long things took"
)]

use crate::daemon::{Address, Daemon, Plan};
use crate::edge::{Edge, Way, holding_of};
use crate::history::Holding;
use crate::proxy::{End, Line};
use crate::registry_client::Client;
use crate::tokens::Tokens;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// How long nothing may come closer once all faults are over, until all are the same. On a machine that is busy with
/// other things everything takes its time, and a question that the line has swallowed is given up after ten seconds or more.
const NO_PROGRESS: Duration = Duration::from_secs(40);
/// How often that is looked at.
const LOOK: Duration = Duration::from_millis(20);

/// Everyone of a story, and where they keep what they know.
pub(crate) struct Stage {
    pub(crate) registry: Plan,
    pub(crate) central: Option<Daemon>,
    /// An operator at the registry.
    pub(crate) client: Client,
    pub(crate) edges: Vec<Arc<Edge>>,
    pub(crate) up: Vec<Option<Daemon>>,
    /// The file with the tokens of the registry, and that of an operator.
    pub(crate) tokens_file: String,
    pub(crate) operator: String,
    pub(crate) folder: TempDir,
}

impl Stage {
    /// A registry with a network, and edges that have read it. The bug is one of the edges.
    pub(crate) async fn set(names: &[&str], bug: Option<&'static str>, settings: &[&str]) -> Self {
        Self::behind(names, bug, settings, async |registry| registry.clone()).await
    }

    /// The same where the edges do not reach the registry, but what is at another address.
    pub(crate) async fn behind(
        names: &[&str],
        bug: Option<&'static str>,
        settings: &[&str],
        what: impl AsyncFnOnce(&Address) -> Address,
    ) -> Self {
        let folder = TempDir::new().expect("a folder");
        let tokens = Tokens::make(folder.path(), names);
        let store = folder.path().join("registry.db").display().to_string();
        // So that the whole log is there in the end.
        let more = [
            "--tokens-file",
            &tokens.file,
            "--set",
            "changes.keep=100000000",
        ];
        let registry = Plan::registry(folder.path(), &store, &more);
        let central = registry.start().await;
        let client = Client::new(&registry.address).with_token(&tokens.operator);
        client.put_network().await;
        let reached = what(&registry.address).await;
        let (mut edges, mut up) = (Vec::new(), Vec::new());
        for (name, token) in names.iter().zip(&tokens.edges) {
            let end = End::Daemon(reached.clone());
            let way = Way {
                end,
                token,
                settings,
            };
            let mut edge = Edge::of(name, folder.path(), way).await;
            edge.plan = edge.plan.with_bug(bug);
            up.push(Some(edge.plan.start().await));
            edges.push(Arc::new(edge));
        }
        Self {
            registry,
            central: Some(central),
            client,
            edges,
            up,
            tokens_file: tokens.file,
            operator: tokens.operator,
            folder,
        }
    }

    /// Ends the registry on the spot.
    pub(crate) fn kill_registry(&mut self) {
        self.central.take().into_iter().for_each(Daemon::kill);
    }

    pub(crate) async fn start_registry(&mut self) {
        self.central = Some(self.registry.start().await);
    }

    /// Ends an edge on the spot.
    pub(crate) fn kill_edge(&mut self, place: usize) {
        self.up[place].take().into_iter().for_each(Daemon::kill);
    }

    /// Starts an edge, and tells how long it took to be ready.
    pub(crate) async fn start_edge(&mut self, place: usize) -> Duration {
        let daemon = self.edges[place].plan.start().await;
        let took = daemon.ready_after;
        self.up[place] = Some(daemon);
        took
    }

    /// Waits until every edge has told all that it has to, and has what the registry has; gives what differs in the end
    /// where that takes too long. An operator lets go what waits for one.
    pub(crate) async fn heal(&self) -> Vec<String> {
        self.edges
            .iter()
            .for_each(|edge| edge.line.becomes(Line::Good));
        let (mut moved, mut wrong) = (Instant::now(), Vec::new());
        let mut fewest = usize::MAX;
        loop {
            let Apart { count, told } = self.apart().await;
            if count < fewest {
                (fewest, moved) = (count, Instant::now());
            }
            if told.is_empty() || moved.elapsed() > NO_PROGRESS {
                wrong.extend(told);
                return wrong;
            }
            for edge in &self.edges {
                // No party changes what is another's.
                let contested = edge.release_holds().await.into_iter();
                wrong.extend(contested.map(|hold| format!("{} has a conflict: {hold}", edge.name)));
            }
            tokio::time::sleep(LOOK).await;
        }
    }

    async fn apart(&self) -> Apart {
        let mut apart = Apart::default();
        let zones = self.client.read_holding().await;
        let (mut all, closures) = match (zones, self.client.read_closures().await) {
            (Ok(zones), Ok(closures)) => (zones, closures),
            (Err(wrong), _) | (_, Err(wrong)) => {
                apart.adds(usize::MAX >> 1, wrong);
                return apart;
            }
        };
        all.extend(closures);
        for edge in &self.edges {
            let (name, status) = (&edge.name, edge.status().await.unwrap_or_default());
            let (outbox, holds) = (&status["registry"]["outbox"], &status["holds"]);
            if *outbox != 0 || *holds != 0 {
                let count = outbox
                    .as_u64()
                    .and_then(|count| usize::try_from(count).ok());
                let told = format!("{name} has {outbox} to tell, and {holds} to decide");
                apart.adds(count.unwrap_or_default(), told);
            }
            let Some(mut holding) = holding_of(&edge.client).await else {
                apart.adds(all.len(), format!("{name} does not answer in the end"));
                continue;
            };
            // Plans are the party's own.
            holding.retain(|id, _| !id.starts_with(crate::registry_client::PLAN));
            if holding != all {
                let (without, with) = (missing(&all, &holding), missing(&holding, &all));
                apart.adds(
                    without.len() + with.len(),
                    format!("{name} is not like the registry in the end: without {without:?}, and with {with:?}"),
                );
            }
        }
        apart
    }
}

/// How far everyone is from having the same.
#[derive(Debug, Default)]
struct Apart {
    count: usize,
    told: Vec<String>,
}

impl Apart {
    fn adds(&mut self, count: usize, told: String) {
        self.count = self.count.saturating_add(count);
        self.told.push(told);
    }
}

/// What one has and the other has not, or not so.
fn missing<'a>(of: &'a Holding, in_other: &Holding) -> Vec<(&'a String, &'a String)> {
    let missing = of
        .iter()
        .filter(|(id, tag)| in_other.get(*id) != Some(*tag));
    missing.collect()
}
