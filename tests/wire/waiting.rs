//! Where requests wait for a worker, because handlers compute more than one can: whom the server refuses, and whom not.

use crate::harness::{
    COMPUTES, Options, Server, WAIT_AT_MOST, ask, call, code, grpc_refusal, h2, rest,
};
use http::Method;
use skyway::api::metrics::Dialect;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};
use std::time::Duration;
use tokio::task::JoinSet;
use tokio::time::timeout;

/// Enough readers of each dialect that everyone waits longer than may be, and so few reporters that
/// by themselves they would not.
const READERS: u32 = 20;
const REPORTERS: u32 = 3;
const QUEUE_WAIT: Duration = Duration::from_millis(100);

/// Enough to show that the flood stays in check; a bound for a server that never sheds.
const SHED_ENOUGH: usize = 100;
const ASKED_MAX: usize = 4_000;

const READ: (Method, &str) = (Method::GET, "/v1/zones");
const READ_RPC: &str = "/skyway.v1.Plans/ListPlans";
const REPORT: (Method, &str) = (Method::POST, "/v1/failures");

#[derive(Default)]
struct Tally {
    answered: AtomicUsize,
    shed: AtomicUsize,
}

impl Tally {
    fn count(&self, is_shed: bool) {
        let place = if is_shed { &self.shed } else { &self.answered };
        place.fetch_add(1, SeqCst);
    }

    fn told(&self) -> (usize, usize) {
        (self.answered.load(SeqCst), self.shed.load(SeqCst))
    }
}

struct Flood {
    server: Arc<Server>,
    clients: [reqwest::Client; 2],
    reads: Tally,
    reports: Tally,
}

impl Flood {
    fn is_over(&self) -> bool {
        let (answered, shed) = self.reads.told();
        shed >= SHED_ENOUGH || answered + shed >= ASKED_MAX
    }

    async fn read_on(self: Arc<Self>, dialect: Dialect) {
        while !self.is_over() {
            let is_shed = match dialect {
                Dialect::Rest => self.is_shed(&READ).await,
                Dialect::Grpc => self.is_call_shed().await,
            };
            self.reads.count(is_shed);
        }
    }

    async fn report_on(self: Arc<Self>) {
        while !self.is_over() {
            let is_shed = self.is_shed(&REPORT).await;
            self.reports.count(is_shed);
        }
    }

    async fn is_shed(&self, (method, path): &(Method, &str)) -> bool {
        let asked = ask(
            &self.clients[0],
            method.clone(),
            self.server.url(path),
            "compute",
        );
        let answer = asked.send().await.expect("an answer");
        if answer.status() == 200 {
            return false;
        }
        assert_eq!(answer.status(), 503);
        assert_eq!(answer.headers()["retry-after"], "1");
        assert_eq!(code(answer).await, "overloaded");
        true
    }

    async fn is_call_shed(&self) -> bool {
        let called = call(&self.clients[1], &self.server, READ_RPC, "compute");
        let answer = called.send().await.expect("an answer");
        if !answer.headers().contains_key("grpc-status") {
            return false;
        }
        assert_eq!(grpc_refusal(&answer), (8, "overloaded".to_owned()));
        assert_eq!(answer.headers()["grpc-retry-pushback-ms"], "1000");
        true
    }
}

/// Readers and reporters ask more than one worker can.
async fn flood(server: &Arc<Server>) -> Arc<Flood> {
    let flood = Arc::new(Flood {
        server: Arc::clone(server),
        clients: [rest(), h2()],
        reads: Tally::default(),
        reports: Tally::default(),
    });
    let mut asking = JoinSet::new();
    for _ in 0..READERS {
        asking.spawn(Arc::clone(&flood).read_on(Dialect::Rest));
        asking.spawn(Arc::clone(&flood).read_on(Dialect::Grpc));
    }
    for _ in 0..REPORTERS {
        asking.spawn(Arc::clone(&flood).report_on());
    }
    asking.join_all().await;
    flood
}

async fn start(queue_wait: Duration) -> Arc<Server> {
    let options = Options {
        queue_wait,
        ..Options::default()
    };
    Arc::new(options.start().await)
}

#[tokio::test]
async fn where_requests_wait_reads_are_shed_and_reports_are_not() {
    let alone = COMPUTES * REPORTERS;
    assert!(alone < QUEUE_WAIT / 2, "reports alone would wait too long");
    let server = start(QUEUE_WAIT).await;
    let flood = flood(&server).await;
    let ((read, reads_shed), (reported, reports_shed)) = (flood.reads.told(), flood.reports.told());
    assert!(reads_shed >= SHED_ENOUGH, "{reads_shed} reads were shed");
    assert!(read > 0, "some reads are answered");
    assert!(reported > 0);
    assert_eq!(reports_shed, 0, "of {reported} reports");
    let counted = server.metric("shed_total{class=\"read\",reason=\"wait\"}");
    assert_eq!(counted, Some(reads_shed as f64));

    // When the flood is over, so is the shedding.
    let client = rest();
    let served = async {
        let mut in_a_row = 0;
        while in_a_row < 100 {
            let asked = ask(&client, READ.0, server.url(READ.1), "");
            let answer = asked.send().await.expect("an answer");
            in_a_row = if answer.status() == 200 {
                in_a_row + 1
            } else {
                0
            };
        }
    };
    timeout(WAIT_AT_MOST, served)
        .await
        .expect("reads are served again");
}

#[tokio::test]
async fn where_it_is_switched_off_all_wait() {
    let server = start(Duration::ZERO).await;
    let client = rest();
    let mut asking = JoinSet::new();
    for _ in 0..READERS {
        let asked = ask(&client, READ.0, server.url(READ.1), "compute");
        asking.spawn(async move { asked.send().await.expect("an answer").status() });
    }
    let told = asking.join_all().await;
    assert!(told.iter().all(|status| *status == 200), "{told:?}");
}
