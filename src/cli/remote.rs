//! An edge that is asked over REST.

use super::files;
use super::stop::Stop;
use serde_json::Value;
use std::path::Path;
use std::time::Duration;

/// What to do where no edge answers.
pub(super) const START_OR_NAME: &str =
    "start an edge with skyway edge, name another one with --edge";
/// How long the edge may take for an answer.
const PATIENCE: Duration = Duration::from_secs(30);
/// The largest answer that is read, in bytes: a network of a million segments fits.
const ANSWER_BYTES_MAX: usize = 1 << 30;

/// An edge, and what is shown to it.
pub(super) struct Remote {
    base: String,
    client: reqwest::Client,
    token: Option<String>,
    /// What to do where it cannot be reached.
    remedy: String,
}

impl Remote {
    /// The edge at an address, with the token of a file.
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

    /// The answer to a body of JSON.
    pub(super) async fn post(
        &self,
        path: &str,
        query: &[(&str, &str)],
        body: String,
    ) -> Result<Vec<u8>, Stop> {
        let mut url = reqwest::Url::parse(&format!("{}{path}", self.base)).map_err(Stop::failed)?;
        url.query_pairs_mut().extend_pairs(query);
        let request = self.client.post(url.clone()).body(body);
        let request = request.header("content-type", "application/json");
        self.answer(url.as_str(), request).await
    }

    async fn answer(&self, url: &str, request: reqwest::RequestBuilder) -> Result<Vec<u8>, Stop> {
        let unreachable = |error: reqwest::Error| {
            let root = root_of(&error);
            Stop::Unreachable(format!("cannot reach {url}: {root}; {}", self.remedy))
        };
        let request = match &self.token {
            Some(token) => request.bearer_auth(token),
            None => request,
        };
        let mut response = request.send().await.map_err(unreachable)?;
        let status = response.status();
        let mut body = Vec::new();
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
        let problem: Value = serde_json::from_slice(&body).unwrap_or_default();
        let detail = problem["detail"].as_str().unwrap_or_default();
        Err(Stop::failed(format!("{url} answers {status}: {detail}")))
    }
}

/// What the system said: the library around it repeats the address.
fn root_of(error: &reqwest::Error) -> String {
    let mut root: &dyn std::error::Error = error;
    while let Some(source) = root.source() {
        root = source;
    }
    root.to_string()
}
