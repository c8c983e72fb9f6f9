//! What the demo asks of an edge and of the registry, over REST.

use crate::wire;
use reqwest::{Method, RequestBuilder, Response, StatusCode};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::time::Duration;
use thiserror::Error;

/// The longest wait for an answer; one edge on the same machine takes a thousandth of it.
const ANSWER_WITHIN: Duration = Duration::from_secs(5);
/// A stream of mail on which nothing came for so long is dead: twice as long as an edge is silent on one.
const SILENCE_MAX: Duration = Duration::from_secs(30);

/// Why something asked of a daemon did not come about.
#[derive(Debug, Error)]
pub enum ClientError {
    /// No answer, or one that cannot be read.
    #[error("the daemon cannot be asked: {0}")]
    Transport(#[from] reqwest::Error),
    /// It refuses.
    #[error("it refuses {asked}: {status}, {code}: {detail}")]
    Refused {
        /// Method and path.
        asked: String,
        /// The status of the answer.
        status: StatusCode,
        /// The stable code of the problem.
        code: String,
        /// What is wrong, for people.
        detail: String,
    },
    /// There is no port for what is to be told.
    #[error("nothing can be listened on: {0}")]
    NoPort(#[from] std::io::Error),
    /// Its network has too little to fly between.
    #[error("the network '{network}' has no two connected nodes to fly between")]
    NothingToFly {
        /// Name of the network.
        network: String,
    },
}

impl ClientError {
    /// True when what was asked does not go with the state of the edge.
    pub(super) fn is_conflict(&self) -> bool {
        matches!(self, Self::Refused { status, .. } if *status == StatusCode::CONFLICT)
    }

    /// True when there is no plan that can be flown.
    pub(super) fn is_no_plan(&self) -> bool {
        matches!(self, Self::Refused { code, .. } if code == "no_route")
    }

    /// True when what was asked for is not there, any more or at all.
    pub(super) fn is_missing(&self) -> bool {
        matches!(self, Self::Refused { status, .. } if *status == StatusCode::NOT_FOUND)
    }
}

/// A client of one edge, or of the registry.
#[derive(Debug)]
pub(super) struct Client {
    http: reqwest::Client,
    base_url: String,
}

impl Client {
    pub(super) fn new(base_url: &str) -> Result<Self, ClientError> {
        // The edge is on this machine: no proxy has to do with it, and no authority.
        let http = reqwest::Client::builder()
            .no_proxy()
            .tls_certs_only([])
            .read_timeout(SILENCE_MAX)
            .build()?;
        Ok(Self {
            http,
            base_url: base_url.trim_end_matches('/').to_owned(),
        })
    }

    pub(super) async fn network(&self) -> Result<wire::CompactNetwork<'static>, ClientError> {
        self.read("/v1/network?format=compact").await
    }

    pub(super) async fn compose(
        &self,
        request: &wire::DeliveryRequest,
    ) -> Result<wire::Plan<'static>, ClientError> {
        self.send(Method::POST, "/v1/plans", request).await
    }

    pub(super) async fn plan(&self, id: &str) -> Result<wire::Plan<'static>, ClientError> {
        self.read(&format!("/v1/plans/{id}")).await
    }

    /// Tells where the drone of a plan has landed.
    pub(super) async fn complete_plan(
        &self,
        id: &str,
        coordinates: [f64; 2],
    ) -> Result<(), ClientError> {
        let completion = wire::Completion {
            location: Some(wire::Place::Pair(coordinates)),
            ..wire::Completion::default()
        };
        self.say(&format!("/v1/plans/{id}/complete"), &completion)
            .await
    }

    pub(super) async fn acknowledge(&self, id: &str, ack: &wire::Ack) -> Result<(), ClientError> {
        self.say(&format!("/v1/plans/{id}/ack"), ack).await
    }

    pub(super) async fn decline(
        &self,
        id: &str,
        decline: &wire::Decline,
    ) -> Result<(), ClientError> {
        self.say(&format!("/v1/plans/{id}/decline"), decline).await
    }

    /// Tells where a drone is. What it has to know is told by its mailbox.
    pub(super) async fn telemetry(&self, entry: &wire::TelemetryEntry) -> Result<(), ClientError> {
        self.say("/v1/telemetry", &json!({"positions": [entry]}))
            .await
    }

    /// The stream of a drone's mail, from after a message on.
    pub(super) async fn mail(
        &self,
        drone_id: &str,
        after: Option<&str>,
    ) -> Result<Response, ClientError> {
        let path = format!("/v1/drones/{drone_id}/events");
        let after_it = |request: RequestBuilder| match after {
            Some(id) => request.header("last-event-id", id),
            None => request,
        };
        self.begin(Method::GET, &path, after_it).await
    }

    /// A drone has carried out its messages up to one.
    pub(super) async fn receive(&self, drone_id: &str, through: &str) -> Result<(), ClientError> {
        let received = wire::Received {
            through: through.to_owned(),
        };
        self.say(&format!("/v1/drones/{drone_id}/received"), &received)
            .await
    }

    pub(super) async fn report(
        &self,
        report: &wire::FailureReport,
    ) -> Result<wire::Recomposition<'static>, ClientError> {
        self.send(Method::POST, "/v1/failures", report).await
    }

    pub(super) async fn preview_zone(
        &self,
        feature: &Value,
    ) -> Result<wire::ZoneAck<'static>, ClientError> {
        self.send(Method::POST, "/v1/zones:preview", feature).await
    }

    pub(super) async fn post_zone(
        &self,
        feature: &Value,
    ) -> Result<wire::ZoneAck<'static>, ClientError> {
        self.send(Method::POST, "/v1/zones", feature).await
    }

    /// Deletes a zone as it is now.
    pub(super) async fn delete_zone(&self, id: &str) -> Result<(), ClientError> {
        let path = format!("/v1/zones/{id}");
        self.ask_of_current(Method::DELETE, &path, |request| request)
            .await
    }

    /// States the weather over a network at a registry in place of that of now.
    pub(super) async fn put_weather(
        &self,
        network: &str,
        weather: &wire::Weather,
    ) -> Result<(), ClientError> {
        self.put(&format!("/v1/networks/{network}/weather"), weather)
            .await
    }

    /// Puts something in place of what is there now, if there is anything.
    pub(super) async fn put(&self, path: &str, body: &impl Serialize) -> Result<(), ClientError> {
        let with_body = |request: RequestBuilder| request.json(body);
        self.ask_of_current(Method::PUT, path, with_body).await
    }

    /// Posts something, and gives the answer.
    pub(super) async fn post<T: DeserializeOwned>(
        &self,
        path: &str,
        body: &impl Serialize,
    ) -> Result<T, ClientError> {
        self.send(Method::POST, path, body).await
    }

    /// Asks for something of the version that there is now, if there is one.
    async fn ask_of_current(
        &self,
        method: Method,
        path: &str,
        complete: impl FnOnce(RequestBuilder) -> RequestBuilder,
    ) -> Result<(), ClientError> {
        let etag = match self.ask(Method::GET, path, |request| request).await {
            Ok(current) => current.headers().get(reqwest::header::ETAG).cloned(),
            Err(error) if error.is_missing() => None,
            Err(error) => return Err(error),
        };
        let with_version = |request: RequestBuilder| match etag {
            Some(etag) => complete(request.header(reqwest::header::IF_MATCH, etag)),
            None => complete(request),
        };
        self.ask(method, path, with_version).await?;
        Ok(())
    }

    async fn read<T: DeserializeOwned>(&self, path: &str) -> Result<T, ClientError> {
        let answer = self.ask(Method::GET, path, |request| request).await?;
        Ok(answer.json().await?)
    }

    async fn say(&self, path: &str, body: &impl Serialize) -> Result<(), ClientError> {
        let with_body = |request: RequestBuilder| request.json(body);
        self.ask(Method::POST, path, with_body).await.map(drop)
    }

    async fn send<T: DeserializeOwned>(
        &self,
        method: Method,
        path: &str,
        body: &impl Serialize,
    ) -> Result<T, ClientError> {
        let answer = self.ask(method, path, |request| request.json(body)).await?;
        Ok(answer.json().await?)
    }

    async fn ask(
        &self,
        method: Method,
        path: &str,
        complete: impl FnOnce(RequestBuilder) -> RequestBuilder,
    ) -> Result<Response, ClientError> {
        let in_time = |request: RequestBuilder| complete(request).timeout(ANSWER_WITHIN);
        self.begin(method, path, in_time).await
    }

    /// The same, where the answer has no end.
    async fn begin(
        &self,
        method: Method,
        path: &str,
        complete: impl FnOnce(RequestBuilder) -> RequestBuilder,
    ) -> Result<Response, ClientError> {
        let url = format!("{}{path}", self.base_url);
        let request = complete(self.http.request(method.clone(), url));
        let answer = request.send().await?;
        let status = answer.status();
        if status.is_success() {
            return Ok(answer);
        }
        // What is no problem document still has a status.
        let problem: Value = answer.json().await.unwrap_or_default();
        let text = |name: &str| problem[name].as_str().unwrap_or_default().to_owned();
        Err(ClientError::Refused {
            asked: format!("{method} {path}"),
            status,
            code: text("code"),
            detail: text("detail"),
        })
    }
}
