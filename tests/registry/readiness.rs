//! Whether to send requests to a registry.

use crate::harness::{Place, Served};
use skyway::registry::Settings;

#[tokio::test]
async fn a_registry_whose_store_is_gone_is_not_ready_from_the_next_question_on() {
    let place = Place::new();
    let mut served = Served::with_network(&place, Settings::default()).await;
    served.ask("GET /readyz", &[], "").await.is(200);
    served.lose_store().await;
    let told = served.ask("GET /readyz", &[], "").await;
    told.refuses(503, "store_unavailable");
    served.ask("GET /livez", &[], "").await.is(200);
}

#[tokio::test]
async fn many_probes_at_once_are_all_answered() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    let probes: Vec<_> = (0..50).map(|_| served.probe_later()).collect();
    for probe in probes {
        probe.await.expect("an answer").is(200);
    }
    served.end().await;
}
