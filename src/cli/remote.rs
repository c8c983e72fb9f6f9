//! An edge or a registry that is asked over REST.

use super::files;
use super::stop::Stop;
use crate::wire::Problem;
use reqwest::header::{CONTENT_TYPE, ETAG, IF_MATCH};
use reqwest::{RequestBuilder, Response, StatusCode};
use std::path::Path;
use std::time::Duration;

/// What to do where no edge answers.
pub(super) const START_OR_NAME: &str =
    "start an edge with skyway edge, name another one with --edge";
/// The media type of most bodies.
pub(super) const JSON: &str = "application/json";
/// That of server-sent events.
const EVENTS: &str = "text/event-stream";
/// How long the edge may take for an answer.
const PATIENCE: Duration = Duration::from_secs(30);
/// The largest answer that is read, in bytes: a network of a million segments fits.
const ANSWER_BYTES_MAX: usize = 1 << 30;

/// What to do where no registry answers.
pub(super) const START_OR_NAME_REGISTRY: &str =
    "start a registry with skyway registry, name another one with --registry";
/// The longest silence of a stream of events; servers say something more often.
const SILENCE_MAX: Duration = Duration::from_mins(1);
/// The largest event, in bytes.
const EVENT_BYTES_MAX: usize = 1 << 20;
/// A stream may last so long.
const STREAM_WITHIN: Duration = Duration::from_hours(7 * 24);

/// An edge or a registry, and what is shown to it.
pub(super) struct Remote {
    base: String,
    client: reqwest::Client,
    token: Option<String>,
    /// What to do where it cannot be reached.
    remedy: String,
}

impl Remote {
    /// The one at an address, with the token of a file.
    pub(super) fn of(edge: &str, token_file: Option<&Path>, remedy: String) -> Result<Self, Stop> {
        let base = edge.trim_end_matches('/');
        let client = reqwest::Client::builder().timeout(PATIENCE);
        // Without https nothing of the system is read: there may be machines without a single
        // authority.
        let client = match base.starts_with("https://") {
            true => client,
            false => client.tls_certs_only([]),
        };
        let token = token_file.map(files::read_text).transpose()?;
        Ok(Self {
            base: base.to_owned(),
            client: client.build().map_err(Stop::failed)?,
            token: token.map(|token| token.trim().to_owned()),
            remedy,
        })
    }

    /// What is at a path.
    pub(super) async fn get(&self, path: &str) -> Result<Vec<u8>, Stop> {
        let url = format!("{}{path}", self.base);
        self.answer(&url, self.client.get(&url)).await
    }

    /// What is at a path, as text of a media type.
    pub(super) async fn get_as(&self, path: &str, media_type: &str) -> Result<String, Stop> {
        let url = format!("{}{path}", self.base);
        let request = self.client.get(&url).header("accept", media_type);
        let body = self.answer(&url, request).await?;
        String::from_utf8(body).map_err(Stop::failed)
    }

    /// The answer to a body.
    pub(super) async fn post(
        &self,
        path: &str,
        query: &[(&str, &str)],
        (media_type, body): (&str, String),
    ) -> Result<Vec<u8>, Stop> {
        let mut url = reqwest::Url::parse(&format!("{}{path}", self.base)).map_err(Stop::failed)?;
        if !query.is_empty() {
            url.query_pairs_mut().extend_pairs(query);
        }
        let request = self.client.post(url.clone()).body(body);
        let request = request.header("content-type", media_type);
        self.answer(url.as_str(), request).await
    }

    /// The answer to a body of JSON under a key: sent again, it is not done again.
    pub(super) async fn post_once(
        &self,
        path: &str,
        key: &str,
        body: String,
    ) -> Result<Vec<u8>, Stop> {
        let url = format!("{}{path}", self.base);
        let request = self.client.post(&url).body(body);
        let request = request
            .header("content-type", JSON)
            .header("idempotency-key", key);
        self.answer(&url, request).await
    }

    /// The version of what is at a path, as an entity tag; none where there is nothing.
    pub(super) async fn version(&self, path: &str) -> Result<Option<String>, Stop> {
        let url = format!("{}{path}", self.base);
        let response = self.send(&url, self.client.get(&url)).await?;
        if response.status() == StatusCode::NOT_FOUND {
            return Ok(None);
        }
        let tag = response.headers().get(ETAG).cloned();
        self.body(&url, response).await?;
        let tag = tag.as_ref().and_then(|tag| tag.to_str().ok());
        Ok(tag.map(str::to_owned))
    }

    /// Puts a body of JSON in place of a version.
    pub(super) async fn put(
        &self,
        path: &str,
        version: Option<&str>,
        body: String,
    ) -> Result<Vec<u8>, Stop> {
        let url = format!("{}{path}", self.base);
        let request = self.client.put(&url).body(body);
        let mut request = request.header("content-type", JSON);
        if let Some(version) = version {
            request = request.header(IF_MATCH, version);
        }
        self.answer(&url, request).await
    }

    /// A stream of server-sent events, from its beginning.
    pub(super) async fn events(&self, path: &str) -> Result<EventStream, Stop> {
        let url = format!("{}{path}", self.base);
        let request = self.client.get(&url).timeout(STREAM_WITHIN);
        let request = request.header("accept", EVENTS);
        let response = self.send(&url, request).await?;
        if !response.status().is_success() {
            self.body(&url, response).await?;
            return Err(Stop::failed(format!("{url} answers without events")));
        }
        let content_type = response.headers().get(CONTENT_TYPE);
        let content_type = content_type.and_then(|stated| stated.to_str().ok());
        let content_type = content_type.unwrap_or("no content type");
        if !content_type.starts_with(EVENTS) {
            return Err(Stop::failed(format!(
                "{url} answers with {content_type}, not with {EVENTS}"
            )));
        }
        Ok(EventStream {
            response,
            text: Vec::new(),
        })
    }

    async fn answer(&self, url: &str, request: RequestBuilder) -> Result<Vec<u8>, Stop> {
        let response = self.send(url, request).await?;
        self.body(url, response).await
    }

    async fn send(&self, url: &str, request: RequestBuilder) -> Result<Response, Stop> {
        let request = match &self.token {
            Some(token) => request.bearer_auth(token),
            None => request,
        };
        let sent = request.send().await;
        sent.map_err(|error| self.unreachable(url, &error))
    }

    async fn body(&self, url: &str, mut response: Response) -> Result<Vec<u8>, Stop> {
        let status = response.status();
        let mut body = Vec::new();
        let unreachable = |error| self.unreachable(url, &error);
        while let Some(chunk) = response.chunk().await.map_err(unreachable)? {
            body.extend_from_slice(&chunk);
            if body.len() > ANSWER_BYTES_MAX {
                return Err(Stop::failed(format!(
                    "the answer of {url} is larger than {ANSWER_BYTES_MAX} bytes"
                )));
            }
        }
        if status.is_success() {
            return Ok(body);
        }
        let problem = serde_json::from_slice::<Problem>(&body);
        let told = problem.map_or_else(|_| String::new(), |problem| told(&problem));
        Err(Stop::failed(format!("{url} answers {status}{told}")))
    }

    fn unreachable(&self, url: &str, error: &reqwest::Error) -> Stop {
        let root = root_of(error);
        Stop::Unreachable(format!("cannot reach {url}: {root}; {}", self.remedy))
    }
}

/// Events that come one by one.
pub(super) struct EventStream {
    response: Response,
    /// What has come and was not told yet.
    text: Vec<u8>,
}

impl EventStream {
    /// The data of the next event; none where the stream has ended, was broken or fell silent.
    pub(super) async fn next(&mut self) -> Option<String> {
        loop {
            while let Some(end) = self.text.iter().position(|&byte| byte == b'\n') {
                let line: Vec<u8> = self.text.drain(..=end).collect();
                // All data of this server is one line of JSON.
                if let Some(data) = line.strip_prefix(b"data:") {
                    return Some(String::from_utf8_lossy(data).trim().to_owned());
                }
            }
            let chunk = tokio::time::timeout(SILENCE_MAX, self.response.chunk()).await;
            self.text.extend_from_slice(&chunk.ok()?.ok()??);
            if self.text.len() > EVENT_BYTES_MAX {
                return None;
            }
        }
    }
}

/// An id as one segment of a path (RFC 3986, 2.3): everything but unreserved characters is escaped.
pub(super) fn segment(id: &str) -> String {
    let escaped = id.bytes().map(|byte| match byte {
        b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' => {
            char::from(byte).to_string()
        }
        other => format!("%{other:02X}"),
    });
    escaped.collect()
}

/// What the system said: the library around it repeats the address.
fn root_of(error: &reqwest::Error) -> String {
    let mut root: &dyn std::error::Error = error;
    while let Some(source) = root.source() {
        root = source;
    }
    root.to_string()
}

/// What a problem says, with a line for each fault: its place in what was sent, and what would set it right.
fn told(problem: &Problem) -> String {
    let mut told = format!(": {}", problem.detail);
    for fault in &problem.errors {
        let place = match fault.pointer.as_str() {
            "" => "the whole",
            pointer => pointer,
        };
        told += &format!("\n  {place}: {}", fault.message);
        if let Some(hint) = &fault.hint {
            told += &format!("; {hint}");
        }
    }
    told
}
