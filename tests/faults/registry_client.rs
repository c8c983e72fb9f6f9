//! What is asked of a registry: zones with tags, its log, and everything that holds.

use crate::daemon::Address;
use crate::history::{Act, Holding, Logged, Outcome, Seen, Version};
use serde_json::{Value, json};
use skyway::formats::write_network;
use skyway::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};
use skyway::wire::{ChangesPage, LoggedChange, ObjectKind, RegistrySnapshot, Written};
use std::time::Duration;

pub(crate) const NETWORK: &str = "square";
/// Longer than a request may take, and shorter than a test.
const TIMEOUT: Duration = Duration::from_secs(10);

/// Four nodes in a square of 100 m, its sides, and a node in the middle.
pub(crate) fn square() -> String {
    let places = [
        ("a", 0.0, 0.0),
        ("b", 100.0, 0.0),
        ("c", 100.0, 100.0),
        ("d", 0.0, 100.0),
        ("m", 50.0, 50.0),
    ];
    let nodes = places.map(|(id, x, y)| NodeDraft {
        id: id.to_owned(),
        position: [x, y],
        pads: 1,
        ..NodeDraft::default()
    });
    let ways = [
        ("a", "b"),
        ("b", "c"),
        ("c", "d"),
        ("d", "a"),
        ("a", "m"),
        ("m", "c"),
    ];
    let segments = ways.map(|(from, to)| SegmentDraft {
        from: from.to_owned(),
        to: to.to_owned(),
        ..SegmentDraft::default()
    });
    write_network(&NetworkDraft {
        name: "Square".to_owned(),
        coordinates: Coordinates::Planar,
        nodes: nodes.to_vec(),
        segments: segments.to_vec(),
        ..NetworkDraft::default()
    })
}

/// A circle whose reason is its tag.
pub(crate) fn circle(id: &str, tag: &str, center: [f64; 2], radius_m: f64) -> Value {
    json!({
        "type": "Feature",
        "id": id,
        "geometry": {"type": "Point", "coordinates": center},
        "properties": {"radius_m": radius_m, "reason": tag},
    })
}

/// The tag of a zone by its text.
pub(crate) fn tag_of(body: &str) -> String {
    let feature: Value = serde_json::from_str(body).unwrap_or_default();
    let tag = feature["properties"]["reason"].as_str();
    tag.unwrap_or_default().to_owned()
}

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
    /// The path of its zones.
    zones: String,
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
            zones: format!("/v1/networks/{NETWORK}/zones"),
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
            // Nobody is there: whoever asks again at once would only keep the machine busy.
            tokio::time::sleep(Duration::from_millis(1)).await;
            return Answer::Nothing { is_sent: false };
        };
        let method = method.parse().expect("a method");
        let mut request = self.http.request(method, format!("http://{address}{path}"));
        if let Some(behind) = self.behind.as_ref().and_then(Address::get) {
            request = request.header("host", behind.to_string());
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
        let asked = tokio::time::timeout(crate::daemon::PATIENCE, asking).await;
        asked.unwrap_or_else(|_| panic!("{line} is not answered {wanted}, but {last}"))
    }

    /// Puts the network.
    pub(crate) async fn put_network(&self) {
        let network: Value = serde_json::from_str(&square()).expect("JSON");
        self.until(&format!("PUT /v1/networks/{NETWORK}"), &network, 201)
            .await;
    }

    /// Does what is to be done with a zone, and tells how it ended and which version it has now.
    pub(crate) async fn act(
        &self,
        act: &Act,
        etag: Option<&str>,
        key: Option<&str>,
    ) -> (Outcome, Option<String>) {
        let zones = &self.zones;
        let mut headers = Vec::new();
        headers.extend(etag.map(|etag| ("if-match", etag)));
        headers.extend(key.map(|key| ("idempotency-key", key)));
        let (line, body) = match act {
            Act::Put { id, tag } => {
                let zone = circle(id, tag, [50.0, 50.0], 10.0);
                match etag {
                    None => (format!("POST {zones}"), zone),
                    Some(_) => (format!("PUT {zones}/{id}"), zone),
                }
            }
            Act::Delete { id } => (format!("DELETE {zones}/{id}"), Value::Null),
            Act::Read { id } => (format!("GET {zones}/{id}"), Value::Null),
        };
        outcome(act, self.ask(&line, &headers, &body).await)
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

    /// The zones that hold, by the snapshot.
    pub(crate) async fn read_holding(&self) -> Result<Holding, String> {
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
            let zones = page.objects.iter().filter(|it| it.kind == ObjectKind::Zone);
            holding.extend(zones.map(|zone| (zone.id.clone(), tag_of(&zone.body))));
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

fn outcome(act: &Act, came: Answer) -> (Outcome, Option<String>) {
    let (status, etag, body) = match came {
        Answer::Came { status, etag, body } => (status, etag, body),
        Answer::Nothing { is_sent: true } => return (Outcome::Unknown, None),
        Answer::Nothing { is_sent: false } => return (Outcome::Refused(0), None),
    };
    let outcome = match (status, act) {
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

/// The version that a registry says a write has made; edges count by themselves.
fn version_of(body: &str) -> Option<Version> {
    let written: Written = serde_json::from_str(body).ok()?;
    Some(Version {
        epoch: written.epoch,
        revision: written.revision,
    })
}
