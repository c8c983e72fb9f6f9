//! Edges over HTTP, encrypted where their address says https.

use super::edges::{
    CalledOff, ComposedFlight, EdgeAddress, EdgeAnswer, EdgeClient, EdgeError, FlightRequest,
};
use reqwest::{Client, ClientBuilder, Method, RequestBuilder, Response, StatusCode, Url};
use skyway_contract::{EndedAs, Plan, PlanState, Problem};
use std::sync::OnceLock;
use std::time::Duration;

/// The longest wait for a connection.
const CONNECT_WITHIN: Duration = Duration::from_secs(1);
/// The longest wait for an answer: an edge composes in milliseconds, and sheds what it cannot.
const ANSWER_WITHIN: Duration = Duration::from_secs(10);
/// The largest answer: a plan over many legs.
const ANSWER_BYTES_MAX: usize = 8 << 20;
/// The query of a cancellation that the edge refuses once the drone has departed.
const BEFORE_DEPARTURE: &str = "before_departure=true";
/// The most connections to an edge that wait for the next question.
const IDLE_MAX: usize = 16;

/// A client of edges, which know it by a token where they want one.
///
/// Where an edge is, it tells itself. So the token goes to addresses that the operator has named, and nowhere else.
#[derive(Debug)]
pub(super) struct HttpEdges {
    token: Option<String>,
    named: Vec<Url>,
    /// For edges without encryption: it reads nothing of the system, which may have no single authority.
    plain: Result<Client, String>,
    /// For edges with encryption, made at the first of them.
    encrypted: OnceLock<Result<Client, String>>,
}

impl HttpEdges {
    /// A client that shows a token, to edges at these addresses.
    pub(super) fn new(token: Option<String>, origins: &[String]) -> Self {
        Self {
            token,
            named: origins.iter().flat_map(|it| it.parse()).collect(),
            plain: built(Client::builder().tls_certs_only([])),
            encrypted: OnceLock::new(),
        }
    }

    fn is_named(&self, url: &Url) -> bool {
        self.named.iter().any(|it| it.origin() == url.origin())
    }

    fn request(
        &self,
        edge: &EdgeAddress,
        method: Method,
        path: &[&str],
        query: Option<&str>,
    ) -> Result<RequestBuilder, EdgeError> {
        let mut url = below(edge, path)?;
        url.set_query(query);
        let client = match url.scheme() {
            "https" => self.encrypted.get_or_init(|| built(Client::builder())),
            _ => &self.plain,
        };
        let client = client.as_ref().map_err(|error| EdgeError::NotAnswered {
            detail: format!("cannot make a client of edges: {error}"),
        })?;
        let is_named = self.is_named(&url);
        let request = client.request(method, url);
        match &self.token {
            Some(token) if is_named => Ok(request.bearer_auth(token)),
            None => Ok(request),
            Some(_) => Err(EdgeError::NotAnswered {
                detail: format!(
                    "the edge '{}' is reached at an address that deliveries.edge_origins does not name",
                    edge.id
                ),
            }),
        }
    }

    async fn composed(
        &self,
        edge: &EdgeAddress,
        request: &FlightRequest,
    ) -> Result<ComposedFlight, EdgeError> {
        let asked = self.request(edge, Method::POST, &["plans"], None)?;
        let asked = asked.json(&request.body());
        let plan = match (ask(edge, asked).await, &request.plan_id) {
            (Err(EdgeError::Refused { code, .. }), Some(id)) if code == "already_exists" => {
                let plan = self.plan(edge, id).await?;
                let is_other = plan.drone_id.as_deref() != request.drone_id.as_deref();
                if is_other {
                    let detail = format!("the plan '{id}' is that of another drone");
                    return Err(EdgeError::Refused { code, detail });
                }
                plan
            }
            (answer, _) => answer?,
        };
        ComposedFlight::read(request, &plan)
    }

    async fn plan(&self, edge: &EdgeAddress, id: &str) -> Result<Plan<'static>, EdgeError> {
        let asked = self.request(edge, Method::GET, &["plans", id], None)?;
        ask(edge, asked).await
    }

    /// The edge decides whether its drone has departed: between a look and a cancellation it could.
    async fn called_off(&self, edge: &EdgeAddress, id: &str) -> Result<CalledOff, EdgeError> {
        let asked = self.request(edge, Method::DELETE, &["plans", id], Some(BEFORE_DEPARTURE))?;
        match ask(edge, asked).await {
            Ok(_) => return Ok(CalledOff::Cancelled),
            // One whose request is on its way is refused when it comes.
            Err(EdgeError::Refused { code, .. }) if code == "not_found" => {
                return Ok(CalledOff::Unknown);
            }
            Err(EdgeError::Refused { code, .. }) if code == "plan_state_conflict" => {}
            Err(other) => return Err(other),
        }
        let plan = self.plan(edge, id).await?;
        Ok(match (plan.state, plan.ended_as) {
            (PlanState::Ended, Some(EndedAs::Cancelled)) => CalledOff::Cancelled,
            (PlanState::Ended, _) => CalledOff::Over,
            _ => CalledOff::Departed,
        })
    }
}

impl EdgeClient for HttpEdges {
    fn may_ask(&self, edge: &EdgeAddress) -> bool {
        let url: Option<Url> = edge.url.parse().ok();
        self.token.is_none() || url.is_some_and(|url| self.is_named(&url))
    }

    fn compose<'a>(
        &'a self,
        edge: &'a EdgeAddress,
        request: &'a FlightRequest,
    ) -> EdgeAnswer<'a, ComposedFlight> {
        Box::pin(self.composed(edge, request))
    }

    fn call_off<'a>(
        &'a self,
        edge: &'a EdgeAddress,
        plan_id: &'a str,
    ) -> EdgeAnswer<'a, CalledOff> {
        Box::pin(self.called_off(edge, plan_id))
    }
}

fn built(builder: ClientBuilder) -> Result<Client, String> {
    let client = builder
        .http1_only()
        .no_proxy()
        .connect_timeout(CONNECT_WITHIN)
        .timeout(ANSWER_WITHIN)
        .redirect(reqwest::redirect::Policy::none())
        .pool_max_idle_per_host(IDLE_MAX)
        .tcp_nodelay(true)
        .build();
    client.map_err(|error| error.to_string())
}

fn below(edge: &EdgeAddress, path: &[&str]) -> Result<Url, EdgeError> {
    let unreachable = || EdgeError::NotAnswered {
        detail: format!("the edge '{}' is reached under no URL", edge.id),
    };
    let mut url: Url = edge.url.parse().map_err(|_| unreachable())?;
    url.path_segments_mut()
        .map_err(|()| unreachable())?
        .pop_if_empty()
        .push("v1")
        .extend(path);
    Ok(url)
}

async fn ask(edge: &EdgeAddress, request: RequestBuilder) -> Result<Plan<'static>, EdgeError> {
    let silent = |error: reqwest::Error| EdgeError::NotAnswered {
        detail: format!(
            "the edge '{}' does not answer: {}",
            edge.id,
            error.without_url()
        ),
    };
    let mut answer = request.send().await.map_err(silent)?;
    let mut body = Vec::new();
    while let Some(chunk) = answer.chunk().await.map_err(silent)? {
        if body.len() + chunk.len() > ANSWER_BYTES_MAX {
            let detail = format!("the answer of the edge '{}' is too large", edge.id);
            return Err(EdgeError::NotAnswered { detail });
        }
        body.extend_from_slice(&chunk);
    }
    if !answer.status().is_success() {
        return Err(refused(edge, &answer, &body));
    }
    serde_json::from_slice(&body).map_err(|error| EdgeError::NotAnswered {
        detail: format!("the answer of the edge '{}' is no plan: {error}", edge.id),
    })
}

/// A refusal, where the edge has looked at the request; one that is about the line, the token or the load says nothing of it.
fn refused(edge: &EdgeAddress, answer: &Response, body: &[u8]) -> EdgeError {
    let status = answer.status();
    let problem = serde_json::from_slice::<Problem>(body).ok();
    let is_of_now = status.is_server_error()
        || status.is_redirection()
        || [
            StatusCode::UNAUTHORIZED,
            StatusCode::FORBIDDEN,
            StatusCode::REQUEST_TIMEOUT,
            StatusCode::MISDIRECTED_REQUEST,
            StatusCode::TOO_MANY_REQUESTS,
        ]
        .contains(&status);
    match problem {
        Some(problem) if !is_of_now => EdgeError::Refused {
            code: problem.code,
            detail: problem.detail,
        },
        Some(problem) => EdgeError::NotAnswered {
            detail: format!("the edge '{}' says: {}", edge.id, problem.detail),
        },
        None => EdgeError::NotAnswered {
            detail: format!("the edge '{}' answers with status {status}", edge.id),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_token_goes_to_addresses_that_are_named_and_nowhere_else() {
        let origins = ["http://127.0.0.1:8080", "http://edge-1.example:8443"].map(str::to_owned);
        let token = Some("sky_1".to_owned());
        let edges = HttpEdges::new(token, &origins);
        let open = HttpEdges::new(None, &[]);
        let at = |url: &str| EdgeAddress {
            id: "edge-1".to_owned(),
            url: url.to_owned(),
        };
        let shows = |edges: &HttpEdges, url: &str| {
            let asked = edges.request(&at(url), Method::GET, &["plans"], None)?;
            let asked = asked.build().expect("a request");
            Ok::<bool, EdgeError>(asked.headers().contains_key("authorization"))
        };
        for named in ["http://127.0.0.1:8080", "http://edge-1.example:8443/below/"] {
            assert_eq!(shows(&edges, named).ok(), Some(true), "{named}");
            assert_eq!(shows(&open, named).ok(), Some(false), "{named}");
            assert!(edges.may_ask(&at(named)) && open.may_ask(&at(named)));
        }
        for other in [
            "http://127.0.0.1:8081",
            "http://localhost:8080",
            "http://127.0.0.1:8080@elsewhere.example/",
            "http://edge-1.example",
        ] {
            let refused = shows(&edges, other).expect_err(other);
            assert!(matches!(refused, EdgeError::NotAnswered { .. }), "{other}");
            assert!(!edges.may_ask(&at(other)) && open.may_ask(&at(other)));
        }
    }
}
