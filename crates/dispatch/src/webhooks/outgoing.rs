//! One attempt to tell an endpoint something, over HTTP.

use super::guard::{GuardedNames, Reach};
use reqwest::header::{CONTENT_TYPE, HeaderMap, HeaderValue};
use reqwest::redirect::Policy;
use reqwest::{Client, Response, StatusCode, Url};
use std::time::Duration;

/// How long an attempt may take, all in all.
const ATTEMPT_WITHIN: Duration = Duration::from_secs(10);
/// How long a connection is kept for the next message.
const IDLE_WITHIN: Duration = Duration::from_secs(30);
/// How many connections to one endpoint are kept.
const IDLE_PER_ENDPOINT: usize = 4;
/// As much of an answer is read, and thrown away, so that its connection can be used again.
const ANSWER_BYTES_MAX: usize = 64 << 10;
const USER_AGENT: &str = concat!("skyway/", env!("CARGO_PKG_VERSION"));

/// What is sent.
#[derive(Clone, Debug)]
pub(super) struct Signed {
    /// Its id, the same at every attempt.
    pub(super) id: String,
    /// When it is sent, in seconds since 1970.
    pub(super) sent_at_s: i64,
    /// The signatures.
    pub(super) signature: String,
    /// Its JSON.
    pub(super) body: String,
}

/// What came of an attempt.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// The endpoint has taken it, with this status.
    Taken(StatusCode),
    /// The endpoint wants nothing more.
    Gone,
    /// It has not, and why.
    Failed(String),
}

impl Outcome {
    /// The same in words.
    pub(super) fn text(&self) -> String {
        match self {
            Self::Taken(status) => answered(*status),
            Self::Gone => answered(StatusCode::GONE),
            Self::Failed(why) => why.clone(),
        }
    }
}

fn answered(status: StatusCode) -> String {
    format!("answered {}", status.as_u16())
}

/// What calls endpoints.
#[derive(Debug)]
pub(super) struct Outgoing {
    reach: Reach,
    /// Reads the authorities of the system, which a machine may not have.
    encrypted: Result<Client, String>,
    plain: Result<Client, String>,
}

impl Outgoing {
    /// Calls what is in reach, by these names.
    pub(super) fn new(names: &GuardedNames) -> Self {
        let client = |builder: reqwest::ClientBuilder| {
            builder
                .dns_resolver(names.clone())
                .http1_only()
                .no_proxy()
                .redirect(Policy::none())
                .user_agent(USER_AGENT)
                .timeout(ATTEMPT_WITHIN)
                .pool_idle_timeout(IDLE_WITHIN)
                .pool_max_idle_per_host(IDLE_PER_ENDPOINT)
                .build()
                .map_err(|error| format!("no client can be made: {}", root_of(&error)))
        };
        Self {
            reach: names.reach,
            encrypted: client(Client::builder().https_only(names.reach == Reach::Public)),
            plain: client(Client::builder().tls_certs_only([])),
        }
    }

    /// Sends a message once.
    pub(super) async fn send(&self, url: &str, signed: &Signed) -> Outcome {
        match self.answer(url, signed).await {
            Err(why) => Outcome::Failed(why),
            Ok(StatusCode::GONE) => Outcome::Gone,
            Ok(status) if status.is_success() => Outcome::Taken(status),
            Ok(status) => Outcome::Failed(answered(status)),
        }
    }

    async fn answer(&self, url: &str, signed: &Signed) -> Result<StatusCode, String> {
        let url = self
            .reach
            .check_url(url)
            .map_err(|unfit| unfit.to_string())?;
        let request = self.client_for(&url)?.post(url);
        let headers = headers(signed).ok_or("a header cannot be written")?;
        let sending = request.headers(headers).body(signed.body.clone()).send();
        let answer = sending.await.map_err(|error| why(&error))?;
        let status = answer.status();
        read_and_forget(answer).await;
        Ok(status)
    }

    fn client_for(&self, url: &Url) -> Result<&Client, String> {
        let client = match url.scheme() {
            "https" => &self.encrypted,
            _ => &self.plain,
        };
        client.as_ref().map_err(Clone::clone)
    }
}

fn headers(signed: &Signed) -> Option<HeaderMap> {
    let mut headers = HeaderMap::new();
    headers.insert(CONTENT_TYPE, HeaderValue::from_static("application/json"));
    headers.insert("webhook-id", HeaderValue::try_from(&signed.id).ok()?);
    headers.insert("webhook-timestamp", HeaderValue::from(signed.sent_at_s));
    let signature = HeaderValue::try_from(&signed.signature).ok()?;
    headers.insert("webhook-signature", signature);
    Some(headers)
}

/// The status has been told; what comes after it matters to the connection alone.
async fn read_and_forget(mut answer: Response) {
    let mut read_bytes = 0;
    while let Ok(Some(chunk)) = answer.chunk().await {
        read_bytes += chunk.len();
        if read_bytes > ANSWER_BYTES_MAX {
            return;
        }
    }
}

fn why(error: &reqwest::Error) -> String {
    if error.is_timeout() {
        return format!("no answer within {} s", ATTEMPT_WITHIN.as_secs());
    }
    root_of(error)
}

/// What the system said, without the URL, which may have secrets in it.
fn root_of(error: &reqwest::Error) -> String {
    let mut root: &dyn std::error::Error = error;
    while let Some(source) = root.source() {
        root = source;
    }
    match std::ptr::addr_eq(root, error) {
        true => "the request could not be sent".to_owned(),
        false => root.to_string(),
    }
}
