//! The registry over HTTP, encrypted where its address says https: what encrypts there is a proxy in front of it.

use super::client::{ClientError, RegistryClient, RegistryWrite};
use flate2::Compression;
use flate2::write::GzEncoder;
use reqwest::header::{
    AUTHORIZATION, CONTENT_ENCODING, CONTENT_TYPE, HeaderMap, HeaderValue, IF_MATCH,
};
use reqwest::{Certificate, Method, RequestBuilder, Response, Url};
use serde::de::DeserializeOwned;
use skyway_contract::{
    ChangesPage, EdgeNews, EdgeNoted, EdgeReport, NetworkStatistics, NewsTaken, ON_BEHALF_OF,
    ObjectKind, PositionBatch, PositionsTaken, Problem, RegistrySnapshot, Written,
};
use std::io;
use std::sync::Arc;
use std::time::Duration;

/// The longest wait for a connection.
const CONNECT_WITHIN: Duration = Duration::from_secs(1);
/// The longest wait for an answer to begin, beyond what it may wait for news, and for each further part of it: one that
/// stops in the middle, or promised more than was ever sent, keeps no caller longer.
const SILENCE_MAX: Duration = Duration::from_secs(10);
/// The longest wait for all of an answer, beyond what it may wait for news: one may bring a network.
const ANSWER_WITHIN: Duration = Duration::from_secs(60);
/// The largest answer: a network, twice escaped, and room.
const ANSWER_BYTES_MAX: usize = 192 << 20;
/// An answer of no more bytes is read at once; others where blocking is allowed.
const SMALL_ANSWER_BYTES: usize = 32 << 10;
/// The largest refusal.
const PROBLEM_BYTES_MAX: usize = 64 << 10;

/// Where a registry is reached, as whom, and what is followed there.
#[derive(Clone)]
pub struct HttpAddress {
    /// Its URL, such as `http://127.0.0.1:8180`.
    pub url: String,
    /// The id of the network there.
    pub network: String,
    /// What this edge is called there.
    pub edge_id: String,
    /// The token, where the registry wants one.
    pub token: Option<String>,
    /// The authorities that its certificate has to be from; without any, those of the system.
    pub authorities: Vec<Certificate>,
}

impl std::fmt::Debug for HttpAddress {
    // Without the token.
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("HttpAddress")
            .field("url", &self.url)
            .field("network", &self.network)
            .field("edge_id", &self.edge_id)
            .finish_non_exhaustive()
    }
}

/// A client of a registry.
#[derive(Debug)]
pub struct HttpClient {
    http: reqwest::Client,
    network: Url,
    edge_id: String,
}

fn transport(error: reqwest::Error) -> ClientError {
    // The causes say what the error itself does not.
    let mut text = error.to_string();
    let mut cause = std::error::Error::source(&error);
    while let Some(error) = cause {
        text = format!("{text}: {error}");
        cause = error.source();
    }
    ClientError::Transport(text)
}

impl HttpClient {
    /// A client of the registry at an address.
    ///
    /// # Errors
    /// When the address or the token is none.
    pub fn new(address: &HttpAddress) -> Result<Self, String> {
        let mut network: Url = address
            .url
            .parse()
            .map_err(|error| format!("'{}' is no URL: {error}", address.url))?;
        let mut headers = HeaderMap::new();
        if let Some(token) = &address.token {
            let mut value = HeaderValue::try_from(format!("Bearer {token}")).map_err(|_| {
                "the token of the registry has letters that no token has".to_owned()
            })?;
            value.set_sensitive(true);
            headers.insert(AUTHORIZATION, value);
        }
        match network.path_segments_mut() {
            Ok(mut path) => path
                .pop_if_empty()
                .extend(["v1", "networks", &address.network]),
            Err(()) => return Err(format!("'{}' is not the URL of a registry", address.url)),
        };
        // Without https nothing of the system is read: there may be machines without a single authority.
        let is_encrypted = network.scheme() == "https";
        let http = match is_encrypted && address.authorities.is_empty() {
            true => reqwest::Client::builder(),
            false => reqwest::Client::builder().tls_certs_only(address.authorities.clone()),
        };
        // Not HTTP/2: one dead connection would be shared by all questions until the system gives it up.
        let http = http
            .http1_only()
            .no_proxy()
            .connect_timeout(CONNECT_WITHIN)
            .redirect(reqwest::redirect::Policy::none())
            .tcp_nodelay(true)
            .default_headers(headers)
            .build()
            .map_err(|error| format!("cannot make a client of the registry: {error}"))?;
        Ok(Self {
            http,
            network,
            edge_id: address.edge_id.clone(),
        })
    }

    fn below(&self, path: &[&str]) -> Url {
        let mut url = self.network.clone();
        // It had segments when the client was made.
        if let Ok(mut segments) = url.path_segments_mut() {
            segments.extend(path);
        }
        url
    }

    /// Asks for something that may come at once, or after waiting for news.
    async fn ask<T: DeserializeOwned + Send + 'static>(
        &self,
        request: RequestBuilder,
        wait: Duration,
    ) -> Result<T, ClientError> {
        let request = request.timeout(wait + ANSWER_WITHIN);
        let answer = heard_within(wait + SILENCE_MAX, request.send()).await?;
        if !answer.status().is_success() {
            return Err(refused(answer).await);
        }
        let body = bounded(answer, ANSWER_BYTES_MAX).await?;
        if body.len() <= SMALL_ANSWER_BYTES {
            return read(&body);
        }
        aside(move || read(&body)).await
    }
}

/// Does what takes long where blocking is allowed.
async fn aside<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, ClientError> + Send + 'static,
) -> Result<T, ClientError> {
    let done = tokio::task::spawn_blocking(work).await;
    done.unwrap_or_else(|error| match error.try_into_panic() {
        Ok(defect) => std::panic::resume_unwind(defect),
        Err(stopped) => Err(ClientError::Transport(stopped.to_string())),
    })
}

/// Positions as JSON, compressed.
fn compressed(batch: &PositionBatch) -> io::Result<Vec<u8>> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    serde_json::to_writer(&mut encoder, batch)?;
    encoder.finish()
}

fn read<T: DeserializeOwned>(body: &[u8]) -> Result<T, ClientError> {
    serde_json::from_slice(body).map_err(|error| ClientError::Unreadable(error.to_string()))
}

/// What is said, unless there is silence for too long.
async fn heard_within<T>(
    silence: Duration,
    said: impl Future<Output = reqwest::Result<T>>,
) -> Result<T, ClientError> {
    match tokio::time::timeout(silence, said).await {
        Ok(said) => said.map_err(transport),
        Err(_) => {
            let silence_s = silence.as_secs_f64();
            let text = format!("nothing has come for {silence_s} s");
            Err(ClientError::Transport(text))
        }
    }
}

/// The body of an answer, as long as it is not too large and goes on coming.
async fn bounded(mut answer: Response, limit_bytes: usize) -> Result<Vec<u8>, ClientError> {
    let mut body = Vec::new();
    while let Some(chunk) = heard_within(SILENCE_MAX, answer.chunk()).await? {
        if body.len() + chunk.len() > limit_bytes {
            return Err(ClientError::TooLarge { limit_bytes });
        }
        body.extend_from_slice(&chunk);
    }
    Ok(body)
}

async fn refused(answer: Response) -> ClientError {
    let status = answer.status().as_u16();
    let body = bounded(answer, PROBLEM_BYTES_MAX).await.unwrap_or_default();
    // What is no problem document still has a status.
    let problem = serde_json::from_slice::<Problem>(&body).ok();
    let (code, detail, retry_after_s) = problem.map_or_else(Default::default, |problem| {
        (problem.code, problem.detail, problem.retry_after_s)
    });
    ClientError::Refused {
        status,
        code,
        detail,
        retry_after_s,
    }
}

impl RegistryClient for HttpClient {
    async fn changes(
        &self,
        epoch: u64,
        after: u64,
        wait: Duration,
    ) -> Result<ChangesPage, ClientError> {
        let mut url = self.below(&["changes"]);
        url.query_pairs_mut()
            .append_pair("after", &after.to_string())
            .append_pair("epoch", &epoch.to_string())
            .append_pair("wait", &format!("{}ms", wait.as_millis()))
            .append_pair("edge", &self.edge_id);
        let request = self.http.request(Method::GET, url);
        self.ask(request, wait).await
    }

    async fn snapshot(&self, page_token: Option<&str>) -> Result<RegistrySnapshot, ClientError> {
        let mut url = self.below(&["snapshot"]);
        if let Some(token) = page_token {
            url.query_pairs_mut().append_pair("page_token", token);
        }
        let request = self.http.request(Method::GET, url);
        self.ask(request, Duration::ZERO).await
    }

    async fn write(&self, write: &RegistryWrite) -> Result<Written, ClientError> {
        let (collection, media_type) = match write.kind {
            ObjectKind::Closure => ("closures", "application/json"),
            _ => ("zones", "application/geo+json"),
        };
        let url = self.below(&[collection, &write.id]);
        let mut request = match &write.body {
            Some(body) => self
                .http
                .request(Method::PUT, url)
                .header(CONTENT_TYPE, media_type)
                .body(body.to_string()),
            None => self.http.request(Method::DELETE, url),
        };
        request = request.header("idempotency-key", &write.idempotency_key);
        // Without what no header can say.
        if let Ok(author) = HeaderValue::from_str(&write.on_behalf_of) {
            request = request.header(ON_BEHALF_OF, author);
        }
        if let Some(tag) = &write.if_match {
            request = request.header(IF_MATCH, tag);
        }
        self.ask(request, Duration::ZERO).await
    }

    async fn report(&self, report: &EdgeReport) -> Result<EdgeNoted, ClientError> {
        let url = self.below(&["edges", &self.edge_id]);
        let request = self.http.request(Method::PUT, url).json(report);
        self.ask(request, Duration::ZERO).await
    }

    async fn statistics(&self) -> Result<NetworkStatistics, ClientError> {
        let request = self.http.request(Method::GET, self.below(&["statistics"]));
        self.ask(request, Duration::ZERO).await
    }

    async fn news(&self, news: &EdgeNews) -> Result<NewsTaken, ClientError> {
        let url = self.below(&["edges", &self.edge_id, "news"]);
        let request = self.http.request(Method::POST, url).json(news);
        self.ask(request, Duration::ZERO).await
    }

    async fn positions(&self, batch: &Arc<PositionBatch>) -> Result<(), ClientError> {
        let url = self.below(&["edges", &self.edge_id, "positions"]);
        let batch = batch.clone();
        let body = aside(move || {
            compressed(&batch).map_err(|error| ClientError::Transport(error.to_string()))
        });
        let request = self
            .http
            .request(Method::POST, url)
            .header(CONTENT_TYPE, "application/json")
            .header(CONTENT_ENCODING, "gzip")
            .body(body.await?);
        let _taken: PositionsTaken = self.ask(request, Duration::ZERO).await?;
        Ok(())
    }
}
