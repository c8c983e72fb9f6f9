//! The line between an edge and its registry: a client of a registry in this process, which a test cuts, leads
//! elsewhere, and on which it bends what is said.

use serde_json::Value;
use skyway::api::problem;
use skyway::edge::Refusal;
use skyway::edge::sync::{ClientError, RegistryClient, RegistryWrite};
use skyway::registry::{Follow, Registry, SnapshotRequest, WriteOptions};
use skyway::wire::{
    ChangesPage, EdgeNews, EdgeNoted, EdgeReport, NetworkStatistics, NewsEntry, NewsTaken,
    ObjectKind, PositionBatch, Problem, PublishedClosure, RegistrySnapshot, Written,
};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;
use tokio::sync::watch;

/// Bends a page of the log on its way; an error for one that does not arrive as JSON.
pub(crate) type Bend = Box<dyn FnMut(ChangesPage) -> Result<ChangesPage, ClientError> + Send>;
/// Bends a page of a list.
pub(crate) type BendList =
    Box<dyn FnMut(RegistrySnapshot) -> Result<RegistrySnapshot, ClientError> + Send>;

/// Bends the answer to a write.
pub(crate) type BendWritten = Box<dyn FnMut(Written) -> Written + Send>;

/// Longer than any test.
const FOR_EVER: Duration = Duration::from_secs(3_600);

#[derive(Default)]
struct Doing {
    registry: Option<Arc<Registry>>,
    bend: Option<Bend>,
    bend_list: Option<BendList>,
    bend_written: Option<BendWritten>,
    takes_no_writes: bool,
    refuses_next: bool,
    /// Writes of this id are refused so.
    refuses: Option<(String, u16)>,
    loses_answers: bool,
    delays_answers: bool,
    waits_for_ever: bool,
    lists: u64,
    writes: Vec<RegistryWrite>,
    writes_under_way: u64,
    reports: Vec<EdgeReport>,
    /// The news that were sent, as often as they were.
    news_sent: Vec<EdgeNews>,
    /// What the far end has taken of them: each number once.
    news: Vec<NewsEntry>,
    refuses_news: Option<u64>,
    takes_no_positions: bool,
    /// A batch of this many positions is too long a body.
    too_many_positions: Option<usize>,
    positions: Vec<PositionBatch>,
}

/// The line, and what is done to it.
#[derive(Clone)]
pub(crate) struct Line {
    doing: Arc<Mutex<Doing>>,
    moved: Arc<watch::Sender<u64>>,
    edge_id: Arc<str>,
    network: Arc<str>,
}

impl Line {
    pub(crate) fn to(registry: &Arc<Registry>, edge_id: &str, network: &str) -> Self {
        let line = Self::to_nothing(edge_id, network);
        line.lead_to(Some(registry));
        line
    }

    /// The line of an edge that begins cut off.
    pub(crate) fn to_nothing(edge_id: &str, network: &str) -> Self {
        Self {
            edge_id: Arc::from(edge_id),
            network: Arc::from(network),
            ..Self::nowhere()
        }
    }

    /// A line that leads nowhere.
    pub(crate) fn nowhere() -> Self {
        Self {
            doing: Arc::default(),
            moved: Arc::new(watch::Sender::new(0)),
            edge_id: Arc::from(""),
            network: Arc::from(""),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Doing> {
        self.doing
            .lock()
            .expect("no test fails while it holds this")
    }

    /// Leads to another registry, or nowhere; an edge that waits for news hears nothing more.
    pub(crate) fn lead_to(&self, registry: Option<&Arc<Registry>>) {
        self.lock().registry = registry.cloned();
        self.moved.send_modify(|moves| *moves += 1);
    }

    pub(crate) fn cut(&self) {
        self.lead_to(None);
    }

    /// Whether answers to writes are lost on their way back.
    pub(crate) fn lose_answers(&self, loses: bool) {
        self.lock().loses_answers = loses;
    }

    /// Whether answers to writes stay on their way back.
    pub(crate) fn delay_answers(&self, delays: bool) {
        self.lock().delays_answers = delays;
        self.moved.send_modify(|moves| *moves += 1);
    }

    /// An edge that waits for news waits without end, as on a registry where nothing happens.
    pub(crate) fn wait_for_ever(&self) {
        self.lock().waits_for_ever = true;
    }

    pub(crate) fn bend(
        &self,
        bend: impl FnMut(ChangesPage) -> Result<ChangesPage, ClientError> + Send + 'static,
    ) {
        self.lock().bend = Some(Box::new(bend));
        self.moved.send_modify(|moves| *moves += 1);
    }

    pub(crate) fn bend_list(
        &self,
        bend: impl FnMut(RegistrySnapshot) -> Result<RegistrySnapshot, ClientError> + Send + 'static,
    ) {
        self.lock().bend_list = Some(Box::new(bend));
    }

    /// Whether writes get nowhere, while reading goes on.
    pub(crate) fn take_no_writes(&self, takes_none: bool) {
        self.lock().takes_no_writes = takes_none;
    }

    /// The next write is refused for ever, as one that is not valid.
    pub(crate) fn refuse_next_write(&self) {
        self.lock().refuses_next = true;
    }

    /// Writes of this id are refused with a status, by something on the way that says no more.
    pub(crate) fn refuse_writes_of(&self, id: &str, status: u16) {
        self.lock().refuses = Some((id.to_owned(), status));
    }

    pub(crate) fn bend_written(&self, bend: impl FnMut(Written) -> Written + Send + 'static) {
        self.lock().bend_written = Some(Box::new(bend));
    }

    pub(crate) fn straighten(&self) {
        let mut doing = self.lock();
        doing.bend = None;
        doing.bend_list = None;
        drop(doing);
        self.moved.send_modify(|moves| *moves += 1);
    }

    /// How often everything was asked for.
    pub(crate) fn lists(&self) -> u64 {
        self.lock().lists
    }

    pub(crate) fn writes(&self) -> Vec<RegistryWrite> {
        self.lock().writes.clone()
    }

    /// Whether a write has been heard and not been answered, or its answer not been lost, yet.
    pub(crate) fn is_writing(&self) -> bool {
        self.lock().writes_under_way > 0
    }

    /// The news that were sent, as often as they were.
    pub(crate) fn news_sent(&self) -> Vec<EdgeNews> {
        self.lock().news_sent.clone()
    }

    /// What the far end has of them.
    pub(crate) fn news_taken(&self) -> Vec<NewsEntry> {
        self.lock().news.clone()
    }

    /// Batches with this entry are refused for ever, as one that is not valid.
    pub(crate) fn refuse_news(&self, number: u64) {
        self.lock().refuses_news = Some(number);
    }

    /// Whether positions get nowhere, while all else goes on.
    pub(crate) fn take_no_positions(&self, takes_none: bool) {
        self.lock().takes_no_positions = takes_none;
    }

    /// A batch of so many positions is refused.
    pub(crate) fn refuse_positions_from(&self, count: usize) {
        self.lock().too_many_positions = Some(count);
    }

    pub(crate) fn positions_taken(&self) -> Vec<PositionBatch> {
        self.lock().positions.clone()
    }

    pub(crate) fn reports(&self) -> Vec<EdgeReport> {
        self.lock().reports.clone()
    }

    /// Carries a write to the registry, and its answer back.
    async fn carry(
        &self,
        registry: &Arc<Registry>,
        write: &RegistryWrite,
    ) -> Result<Written, ClientError> {
        if std::mem::take(&mut self.lock().refuses_next) {
            return Err(ClientError::Refused {
                status: 422,
                code: "zone_invalid".to_owned(),
                detail: "the registry takes no such zone".to_owned(),
                retry_after_s: None,
            });
        }
        let refuses = self.lock().refuses.clone();
        if let Some((_, status)) = refuses.filter(|(id, _)| **id == *write.id) {
            return Err(ClientError::Refused {
                status,
                code: String::new(),
                detail: String::new(),
                retry_after_s: None,
            });
        }
        let manner = WriteOptions {
            subject: self.edge_id.to_string(),
            key: Some(write.idempotency_key.clone()),
            fingerprint: format!("{:?} {} {:?}", write.kind, write.id, write.body),
            if_match: write.if_match.clone(),
            validate_only: false,
            on_behalf_of: Some(write.on_behalf_of.to_string()),
        };
        let (network, id) = (&*self.network, Some(&*write.id));
        let reply = match (write.kind, &write.body) {
            (kind, None) => registry.delete(network, kind, &write.id, &manner).await,
            (ObjectKind::Closure, Some(body)) => {
                let closure: PublishedClosure = serde_json::from_str(body).expect("a closure");
                registry.put_closure(network, id, closure, &manner).await
            }
            (_, Some(body)) => {
                let feature: Value = serde_json::from_str(body).expect("a feature");
                registry.put_zone(network, id, feature, &manner).await
            }
        };
        let reply = reply.map_err(|refusal| told(&refusal))?;
        let mut moved = self.moved.subscribe();
        while self.lock().delays_answers {
            // The end that closes it says so.
            let _ = moved.changed().await;
        }
        let mut doing = self.lock();
        if doing.loses_answers {
            return Err(cut());
        }
        let written = serde_json::from_str(&reply.body).expect("an answer");
        Ok(match &mut doing.bend_written {
            Some(bend) => bend(written),
            None => written,
        })
    }

    fn registry(&self) -> Result<Arc<Registry>, ClientError> {
        let registry = self.lock().registry.clone();
        registry.ok_or_else(cut)
    }
}

pub(crate) fn cut() -> ClientError {
    ClientError::Transport("the line is cut".to_owned())
}

fn told(refusal: &Refusal) -> ClientError {
    let Problem {
        status,
        code,
        detail,
        retry_after_s,
        ..
    } = problem::document(refusal, None);
    ClientError::Refused {
        status,
        code,
        detail,
        retry_after_s,
    }
}

impl RegistryClient for Line {
    async fn changes(
        &self,
        epoch: u64,
        after: u64,
        wait: Duration,
    ) -> Result<ChangesPage, ClientError> {
        let mut moved = self.moved.subscribe();
        let registry = self.registry()?;
        let waits_for_ever = self.lock().waits_for_ever && !wait.is_zero();
        let follow = Follow {
            after,
            epoch: Some(epoch),
            limit: None,
            wait: if waits_for_ever { FOR_EVER } else { wait },
            edge: Some(self.edge_id.to_string()),
        };
        let asked = registry.changes(&self.network, &follow, std::future::pending());
        let page = tokio::select! {
            page = asked => page.map_err(|refusal| told(&refusal))?,
            _ = moved.changed() => return Err(cut()),
        };
        let mut doing = self.lock();
        match &mut doing.bend {
            Some(bend) => bend(page),
            None => Ok(page),
        }
    }

    async fn snapshot(&self, page_token: Option<&str>) -> Result<RegistrySnapshot, ClientError> {
        self.lock().lists += u64::from(page_token.is_none());
        let request = SnapshotRequest {
            size: Some(3),
            token: page_token.map(str::to_owned),
        };
        let registry = self.registry()?;
        let page = registry.snapshot(&self.network, &request).await;
        let page = page.map_err(|refusal| told(&refusal))?;
        let mut doing = self.lock();
        match &mut doing.bend_list {
            Some(bend) => bend(page),
            None => Ok(page),
        }
    }

    async fn write(&self, write: &RegistryWrite) -> Result<Written, ClientError> {
        let registry = self.registry()?;
        {
            let mut doing = self.lock();
            if doing.takes_no_writes {
                return Err(cut());
            }
            doing.writes.push(write.clone());
            doing.writes_under_way += 1;
        }
        let written = self.carry(&registry, write).await;
        self.lock().writes_under_way -= 1;
        written
    }

    async fn report(&self, report: &EdgeReport) -> Result<EdgeNoted, ClientError> {
        let registry = self.registry()?;
        self.lock().reports.push(report.clone());
        let noted = registry.report_edge(&self.network, &self.edge_id, report.clone());
        let noted = noted.await.map_err(|refusal| told(&refusal));
        noted.map(|()| EdgeNoted::default())
    }

    async fn news(&self, news: &EdgeNews) -> Result<NewsTaken, ClientError> {
        self.registry()?;
        let mut doing = self.lock();
        doing.news_sent.push(news.clone());
        let is_refused = |entry: &NewsEntry| Some(entry.number) == doing.refuses_news;
        if news.news.iter().any(is_refused) {
            return Err(ClientError::Refused {
                status: 422,
                code: "body_invalid".to_owned(),
                detail: "the registry takes no such news".to_owned(),
                retry_after_s: None,
            });
        }
        let mut through = doing.news.last().map_or(0, |last| last.number);
        for entry in news.news.iter().filter(|entry| entry.number > through) {
            doing.news.push(entry.clone());
        }
        through = doing.news.last().map_or(0, |last| last.number);
        match doing.loses_answers {
            true => Err(cut()),
            false => Ok(NewsTaken { through }),
        }
    }

    async fn statistics(&self) -> Result<NetworkStatistics, ClientError> {
        Err(ClientError::Transport(
            "nothing is worked out here".to_owned(),
        ))
    }

    async fn positions(&self, batch: &Arc<PositionBatch>) -> Result<(), ClientError> {
        self.registry()?;
        let mut doing = self.lock();
        if doing.takes_no_positions {
            return Err(cut());
        }
        let too_many = doing.too_many_positions;
        if too_many.is_some_and(|count| batch.positions.len() >= count) {
            return Err(ClientError::Refused {
                status: 413,
                code: "body_too_large".to_owned(),
                detail: String::new(),
                retry_after_s: None,
            });
        }
        doing.positions.push((**batch).clone());
        Ok(())
    }
}
