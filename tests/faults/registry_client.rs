//! What is asked of a daemon: things with tags, and of a registry its log and everything that holds.

use crate::daemon::Address;
use crate::history::{Act, Holding, Logged, Outcome, Seen, Version};
use crate::square::{circle, middle_of, network, tag_of};
use serde_json::{Value, json};
use skyway::wire::{ChangesPage, LoggedChange, ObjectKind, Problem, RegistrySnapshot, Written};
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpListener;

pub(crate) const NETWORK: &str = "square";
/// How large zones are.
pub(crate) const RADIUS_M: f64 = 10.0;
/// Longer than a request may take, and shorter than a test.
const TIMEOUT: Duration = Duration::from_secs(10);
/// How often a request is asked for again whose first sending is still being answered: a second apart, longer than a
/// registry takes for it.
const ASKED_AGAIN_MAX: u32 = 40;

/// What came back: a status and a text; or nothing, and whether the request was ever sent.
pub(crate) enum Answer {
    Came {
        status: u16,
        etag: Option<String>,
        body: String,
    },
    Nothing {
        is_sent: bool,
    },
}

/// A client of the daemon that has an address.
#[derive(Clone, Debug)]
pub(crate) struct Client {
    http: reqwest::Client,
    address: Address,
    /// What is behind a proxy, and answers under its own name only.
    behind: Option<Address>,
    token: Option<String>,
    is_of_edge: bool,
}

impl Client {
    pub(crate) fn new(address: &Address) -> Self {
        Self::patient(address, TIMEOUT)
    }

    /// One that waits for an answer as long as this.
    pub(crate) fn patient(address: &Address, timeout: Duration) -> Self {
        let http = reqwest::Client::builder().no_proxy().timeout(timeout);
        Self {
            http: http.build().expect("a client"),
            address: address.clone(),
            behind: None,
            token: None,
            is_of_edge: false,
        }
    }

    /// With a token.
    pub(crate) fn with_token(mut self, token: &str) -> Self {
        self.token = Some(token.to_owned());
        self
    }

    /// One of an edge.
    pub(crate) fn of_edge(address: &Address) -> Self {
        Self {
            is_of_edge: true,
            ..Self::new(address)
        }
    }

    /// One that goes through a proxy.
    pub(crate) fn through(proxy: &Address, behind: &Address) -> Self {
        Self {
            behind: Some(behind.clone()),
            ..Self::new(proxy)
        }
    }

    /// Asks; `line` is a method and a path.
    pub(crate) async fn ask(&self, line: &str, headers: &[(&str, &str)], body: &Value) -> Answer {
        let (method, path) = line.split_once(' ').expect("a method and a path");
        let Some(address) = self.address.get() else {
            // No registry is there: asking again at once would only keep the machine busy.
            tokio::time::sleep(Duration::from_millis(1)).await;
            return Answer::Nothing { is_sent: false };
        };
        let method = method.parse().expect("a method");
        let mut request = self.http.request(method, format!("http://{address}{path}"));
        if let Some(behind) = self.behind.as_ref().and_then(Address::get) {
            request = request.header("host", behind.to_string());
        }
        if let Some(token) = &self.token {
            request = request.bearer_auth(token);
        }
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        if !body.is_null() {
            request = request.json(body);
        }
        let answer = match request.send().await {
            Ok(answer) => answer,
            Err(error) => {
                let is_sent = !error.is_connect();
                return Answer::Nothing { is_sent };
            }
        };
        let status = answer.status().as_u16();
        let etag = answer.headers().get("etag");
        let etag = etag.and_then(|etag| etag.to_str().ok()).map(str::to_owned);
        match answer.text().await {
            Ok(body) => Answer::Came { status, etag, body },
            Err(_) => Answer::Nothing { is_sent: true },
        }
    }

    /// Asks until there is an answer with this status; panics when none comes.
    pub(crate) async fn until(&self, line: &str, body: &Value, wanted: u16) -> String {
        let mut last = "nothing".to_owned();
        let asking = async {
            loop {
                if let Answer::Came { status, body, .. } = self.ask(line, &[], body).await {
                    if status == wanted {
                        return body;
                    }
                    last = format!("{status} {body}");
                }
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        let asked = tokio::time::timeout(crate::daemon::WAIT_AT_MOST, asking).await;
        asked.unwrap_or_else(|_| panic!("{line} is not answered {wanted}, but {last}"))
    }

    /// Puts the network.
    pub(crate) async fn put_network(&self) {
        let network: Value = serde_json::from_str(&network()).expect("JSON");
        self.until(&format!("PUT /v1/networks/{NETWORK}"), &network, 201)
            .await;
    }

    /// Does what is to be done with a thing, and tells how it ended, which version it has now, and in which life the edge
    /// has answered.
    pub(crate) async fn act(
        &self,
        act: &Act,
        etag: Option<&str>,
        key: Option<&str>,
    ) -> (Outcome, Option<String>, Option<u64>) {
        let mut headers = Vec::new();
        headers.extend(etag.map(|etag| ("if-match", etag)));
        headers.extend(key.map(|key| ("idempotency-key", key)));
        let all = self.collection(act.id());
        let (line, body) = match act {
            Act::Put { id, tag } => match etag {
                None => (format!("POST {all}"), draft(id, tag)),
                Some(_) => (format!("PUT {all}/{id}"), draft(id, tag)),
            },
            Act::Delete { id } => (format!("DELETE {all}/{id}"), Value::Null),
            Act::Read { id } => (format!("GET {all}/{id}"), Value::Null),
        };
        let mut came = self.ask(&line, &headers, &body).await;
        for _ in 0..ASKED_AGAIN_MAX {
            let Some(wait) = in_progress(&came) else {
                break;
            };
            tokio::time::sleep(wait).await;
            came = self.ask(&line, &headers, &body).await;
        }
        let life = life_of(&came);
        let (outcome, etag) = outcome(act, came);
        match self.is_of_edge {
            true => (without_version(outcome), etag, life),
            false => (outcome, etag, None),
        }
    }

    /// Where things of this kind are.
    fn collection(&self, id: &str) -> String {
        let name = match kind_of(id) {
            ObjectKind::Closure => "closures",
            _ if id.starts_with(PLAN) => "plans",
            _ => "zones",
        };
        match self.is_of_edge {
            true => format!("/v1/{name}"),
            false => format!("/v1/networks/{NETWORK}/{name}"),
        }
    }

    /// The page of the log after a revision; none where no whole page came.
    pub(crate) async fn page(&self, after: u64, wait: &str) -> Option<Result<ChangesPage, u16>> {
        let path = format!("/v1/networks/{NETWORK}/changes?after={after}&limit=1000&wait={wait}");
        match self.ask(&format!("GET {path}"), &[], &Value::Null).await {
            Answer::Came {
                status: 200, body, ..
            } => serde_json::from_str(&body).ok().map(Ok),
            Answer::Came { status, .. } => Some(Err(status)),
            Answer::Nothing { .. } => None,
        }
    }

    /// The whole log. What is wrong with its pages is told.
    pub(crate) async fn read_log(&self) -> Result<All, String> {
        let mut all = All::default();
        let mut after = 0;
        loop {
            let page = match self.page(after, "0s").await {
                Some(Ok(page)) => page,
                Some(Err(status)) => return Err(format!("the log after {after} is {status}")),
                None => return Err(format!("the log after {after} is not told")),
            };
            check_page(&page, after)?;
            after = page.revision;
            let is_last = page.changes.is_empty() || after >= page.head;
            all.changes.extend(page.changes.iter().cloned());
            all.head = page.head;
            if is_last {
                return Ok(all);
            }
        }
    }

    /// All zones that hold.
    pub(crate) async fn read_holding(&self) -> Result<Holding, String> {
        self.read_all(ObjectKind::Zone).await
    }

    /// All closures that hold.
    pub(crate) async fn read_closures(&self) -> Result<Holding, String> {
        self.read_all(ObjectKind::Closure).await
    }

    async fn read_all(&self, kind: ObjectKind) -> Result<Holding, String> {
        let mut holding = Holding::new();
        let mut token = String::new();
        loop {
            let path = format!("/v1/networks/{NETWORK}/snapshot?page_token={token}");
            let text = match self.ask(&format!("GET {path}"), &[], &Value::Null).await {
                Answer::Came {
                    status: 200, body, ..
                } => body,
                Answer::Came { status, body, .. } => {
                    return Err(format!("the snapshot is {status}: {body}"));
                }
                Answer::Nothing { .. } => return Err("the snapshot is not told".to_owned()),
            };
            let page: RegistrySnapshot =
                serde_json::from_str(&text).map_err(|error| error.to_string())?;
            if page.checksum != page.digest() {
                return Err("the snapshot has another checksum".to_owned());
            }
            let things = page.objects.iter().filter(|it| it.kind == kind);
            holding.extend(things.map(|it| (it.id.clone(), tag_of(&it.body))));
            match page.next_page_token {
                Some(next) => token = next,
                None => return Ok(holding),
            }
        }
    }
}

/// All that a registry tells of a network.
#[derive(Clone, Debug, Default)]
pub(crate) struct All {
    pub(crate) changes: Vec<LoggedChange>,
    pub(crate) head: u64,
}

impl All {
    /// The changes of zones.
    pub(crate) fn log(&self) -> Vec<Logged> {
        let zones = self.changes.iter();
        let zones = zones.filter(|change| change.kind == ObjectKind::Zone);
        zones.map(logged).collect()
    }

    pub(crate) fn revisions(&self) -> Vec<u64> {
        let mut revisions: Vec<u64> = self.changes.iter().map(|it| it.revision).collect();
        revisions.dedup();
        revisions
    }
}

fn logged(change: &LoggedChange) -> Logged {
    Logged {
        version: Version {
            epoch: change.epoch,
            revision: change.revision,
        },
        id: change.id.clone(),
        tag: change.body.as_deref().map(tag_of),
    }
}

/// What is wrong with a page that should follow a revision.
pub(crate) fn check_page(page: &ChangesPage, after: u64) -> Result<(), String> {
    if page.after != after || page.checksum != page.digest() {
        return Err(format!("the page after {after} has another checksum"));
    }
    let mut last = after;
    for change in &page.changes {
        if change.sha256 != change.digest(NETWORK) {
            return Err(format!("revision {} has another digest", change.revision));
        }
        if change.revision != last && change.revision != last + 1 {
            return Err(format!("revision {} follows {last}", change.revision));
        }
        last = change.revision;
    }
    if last != page.revision || page.revision > page.head {
        let (revision, head) = (page.revision, page.head);
        return Err(format!(
            "the page after {after} ends with {last}, says {revision}, and the head is {head}"
        ));
    }
    Ok(())
}

/// The ids of closures and plans begin so.
pub(crate) const CLOSURE: &str = "closure-";
pub(crate) const PLAN: &str = "plan-";

fn kind_of(id: &str) -> ObjectKind {
    match id.starts_with(CLOSURE) {
        true => ObjectKind::Closure,
        false => ObjectKind::Zone,
    }
}

/// Later than any test ends, and soon enough for a plan.
#[expect(
    clippy::disallowed_methods,
    reason = "an edge goes by the clock of the machine"
)]
fn tomorrow() -> String {
    let tomorrow = jiff::Timestamp::now() + jiff::SignedDuration::from_hours(24);
    tomorrow.to_string()
}

/// What is put.
fn draft(id: &str, tag: &str) -> Value {
    if id.starts_with(PLAN) {
        return json!({
            "id": id, "source": "n00", "destination": "n55", "drone_id": tag, "start_time": tomorrow(),
        });
    }
    match kind_of(id) {
        ObjectKind::Closure => json!({"id": id, "reason": tag, "nodes": ["n50"]}),
        _ => circle(id, tag, middle_of(tag), RADIUS_M),
    }
}

/// Edges count versions by themselves.
fn without_version(outcome: Outcome) -> Outcome {
    match outcome {
        Outcome::Done(_) => Outcome::Done(None),
        Outcome::Seen(Some(seen)) => Outcome::Seen(Some(Seen {
            version: None,
            ..seen
        })),
        other => other,
    }
}

fn outcome(act: &Act, came: Answer) -> (Outcome, Option<String>) {
    let (status, etag, body) = match came {
        Answer::Came { status, etag, body } => (status, etag, body),
        Answer::Nothing { is_sent: true } => return (Outcome::Unknown, None),
        Answer::Nothing { is_sent: false } => return (Outcome::Refused(0), None),
    };
    let outcome = match (status, act) {
        (200, Act::Read { .. }) if is_cancelled(&body) => Outcome::Seen(None),
        (200, Act::Read { .. }) => Outcome::Seen(Some(Seen {
            version: etag.as_deref().and_then(Version::read),
            tag: tag_of(&body),
        })),
        (404, Act::Read { .. }) => Outcome::Seen(None),
        (200..300, _) => Outcome::Done(version_of(&body)),
        (400..500, _) => Outcome::Refused(status),
        _ => Outcome::Unknown,
    };
    (outcome, etag)
}

/// After which time to ask again for what the first sending of the same request is answered.
fn in_progress(came: &Answer) -> Option<Duration> {
    let Answer::Came {
        status: 409, body, ..
    } = came
    else {
        return None;
    };
    let problem: Problem = serde_json::from_str(body).ok()?;
    let wait_s = problem.retry_after_s.unwrap_or(1);
    (problem.code == "idempotency_in_progress").then_some(Duration::from_secs(wait_s.into()))
}

/// The epoch of the edge that an answer states.
fn life_of(came: &Answer) -> Option<u64> {
    let Answer::Came { body, .. } = came else {
        return None;
    };
    let answer: Value = serde_json::from_str(body).ok()?;
    Version::read(answer["revision"].as_str()?).map(|own| own.epoch)
}

/// A plan that was cancelled can still be read.
fn is_cancelled(body: &str) -> bool {
    let plan: Value = serde_json::from_str(body).unwrap_or_default();
    plan["ended_as"] == "cancelled"
}

/// The version that a registry says a write has made.
fn version_of(body: &str) -> Option<Version> {
    let written: Written = serde_json::from_str(body).ok()?;
    Some(Version {
        epoch: written.epoch,
        revision: written.revision,
    })
}

#[tokio::test]
async fn a_request_whose_first_sending_is_still_being_answered_is_asked_again() {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
    let address = Address::at(listener.local_addr().expect("an address"));
    let telling = tokio::spawn(async move {
        let problem = json!({
            "type": "", "title": "", "status": 409, "code": "idempotency_in_progress", "detail": "",
            "retry_after_s": 0,
        });
        let problem = problem.to_string();
        for (status, body) in [("409 Conflict", &*problem), ("201 Created", "{}")] {
            let (mut stream, _) = listener.accept().await.expect("a connection");
            // All of the request, so that nothing of it is left where the stream is closed.
            let mut asked = Vec::new();
            while !asked.ends_with(b"}") {
                stream.read_buf(&mut asked).await.expect("a request");
            }
            let length = body.len();
            let head =
                format!("HTTP/1.1 {status}\r\nconnection: close\r\ncontent-length: {length}");
            let answer = format!("{head}\r\n\r\n{body}");
            stream.write_all(answer.as_bytes()).await.expect("it waits");
        }
    });
    let (id, tag) = ("zone-1".to_owned(), "w0-1".to_owned());
    let put = Act::Put { id, tag };
    let (outcome, ..) = Client::new(&address).act(&put, None, Some("key")).await;
    assert_eq!(outcome, Outcome::Done(None));
    telling.await.expect("no panic");
}
