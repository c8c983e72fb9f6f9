//! What stands before a registry and passes on its answers, true or not.

use crate::daemon::Address;
use crate::lies::{Liar, Said, Words};
use crate::rounds::Chance;
use http_body_util::{BodyExt, Full};
use hyper::body::{Bytes, Incoming};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, header};
use hyper_util::rt::TokioIo;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::net::TcpListener;
use tokio::task::JoinHandle;

/// Headers that are passed on.
const HEADERS: [header::HeaderName; 3] = [
    header::AUTHORIZATION,
    header::CONTENT_TYPE,
    header::IF_MATCH,
];

/// It ends when it is dropped.
#[derive(Debug)]
pub(crate) struct FalseRegistry {
    pub(crate) address: Address,
    shared: Arc<Shared>,
    accepting: JoinHandle<()>,
}

#[derive(Debug)]
struct Shared {
    real: Address,
    http: reqwest::Client,
    liar: Mutex<Liar>,
}

impl FalseRegistry {
    pub(crate) async fn before(real: &Address, chance: Chance) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let here = listener.local_addr().expect("an address");
        let redirects = reqwest::redirect::Policy::none();
        let http = reqwest::Client::builder().no_proxy().redirect(redirects);
        let shared = Arc::new(Shared {
            real: real.clone(),
            http: http.build().expect("a client"),
            liar: Mutex::new(Liar::new(chance)),
        });
        Self {
            address: Address::at(here),
            accepting: tokio::spawn(accept(listener, shared.clone())),
            shared,
        }
    }

    /// The one who lies.
    pub(crate) fn liar(&self) -> MutexGuard<'_, Liar> {
        self.shared
            .liar
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    /// How many lies were told.
    pub(crate) fn count(&self) -> usize {
        self.liar().told.values().sum()
    }
}

impl Drop for FalseRegistry {
    fn drop(&mut self) {
        self.accepting.abort();
    }
}

async fn accept(listener: TcpListener, shared: Arc<Shared>) {
    while let Ok((near, _)) = listener.accept().await {
        let shared = shared.clone();
        tokio::spawn(async move {
            let service = service_fn(|request| answer(request, &shared));
            // Who asks may go before the answer.
            let _ = http1::Builder::new()
                .serve_connection(TokioIo::new(near), service)
                .await;
        });
    }
}

/// What was asked, by its method and path; none of what is only told to the registry.
fn said(method: &Method, path: &str) -> Option<Said> {
    match *method {
        Method::GET if path.contains("/changes") => Some(Said::Changes),
        Method::GET if path.contains("/snapshot") => Some(Said::Snapshot),
        Method::PUT | Method::DELETE if !path.contains("/edges/") => Some(Said::Written),
        _ => None,
    }
}

async fn answer(
    request: Request<Incoming>,
    shared: &Shared,
) -> Result<Response<Full<Bytes>>, Box<dyn std::error::Error + Send + Sync>> {
    let Some(real) = shared.real.get() else {
        return Err("no server is there".into());
    };
    let (head, body) = request.into_parts();
    let path = head.uri.path_and_query().map_or("/", |path| path.as_str());
    let kind = said(&head.method, path);
    let mut asked = shared
        .http
        .request(head.method.clone(), format!("http://{real}{path}"));
    let key = header::HeaderName::from_static("idempotency-key");
    for name in HEADERS.iter().chain([&key]) {
        if let Some(value) = head.headers.get(name) {
            asked = asked.header(name, value);
        }
    }
    let came = asked.body(body.collect().await?.to_bytes()).send().await?;
    let mut words = Words {
        status: came.status().as_u16(),
        body: came.bytes().await?.to_vec(),
    };
    if let Some(kind) = kind.filter(|_| words.status < 300) {
        let mut liar = shared.liar.lock().unwrap_or_else(PoisonError::into_inner);
        words = liar.tell(kind, words);
    }
    let response = Response::builder().status(words.status);
    let response = response.header(header::CONTENT_TYPE, "application/json");
    Ok(response.body(Full::new(Bytes::from(words.body)))?)
}
