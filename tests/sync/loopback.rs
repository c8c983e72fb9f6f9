//! The same over HTTP: two edges as they are served, one registry as it is served, on loopback.

use crate::stage::{circle, ladder};
use serde_json::{Value, json};
use skyway::config::{EdgeConfig, PackKeys, RegistryConfig};
use skyway::formats::{load_network, write_network};
use skyway::process::registry::{RegistryService, RegistryStart};
use skyway::process::service::{Service, Start};
use skyway::wire::PackKeyState;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tempfile::TempDir;

const WAIT_AT_MOST: Duration = Duration::from_secs(40);

fn anywhere() -> SocketAddr {
    SocketAddr::from(([127, 0, 0, 1], 0))
}

async fn registry(folder: &TempDir) -> RegistryService {
    let config = RegistryConfig {
        listen: anywhere(),
        admin_listen: anywhere(),
        store: folder.path().join("registry.db").display().to_string(),
        ..RegistryConfig::default()
    };
    let start = RegistryStart {
        config,
        tokens: None,
        new_epoch: false,
    };
    RegistryService::start(start).await.expect("a registry")
}

async fn edge(registry: &RegistryService, name: &str) -> Service {
    let config = following(registry, name);
    Service::start(on_ladder(config)).await.expect("an edge")
}

fn following(registry: &RegistryService, name: &str) -> EdgeConfig {
    let mut config = edge_config();
    config.registry.url = Some(format!("http://{}/", registry.addresses().listen));
    config.registry.network = "ladder".to_owned();
    config.registry.edge_id = Some(name.to_owned());
    config.registry.retry_within = Duration::from_millis(200);
    config
}

fn edge_config() -> EdgeConfig {
    EdgeConfig {
        listen: anywhere(),
        admin_listen: anywhere(),
        store: None,
        ..EdgeConfig::default()
    }
}

fn on_ladder(config: EdgeConfig) -> Start {
    let text = write_network(&ladder());
    let loaded = load_network(&text).expect("a network");
    Start {
        config,
        tokens: None,
        topology: Arc::new(loaded.topology),
        geojson: text.into(),
    }
}

async fn send(client: &reqwest::Client, line: &str, url: &str, body: String) -> Value {
    send_as(client, "application/geo+json", line, url, body).await
}

async fn send_json(client: &reqwest::Client, line: &str, url: &str, body: String) -> Value {
    send_as(client, "application/json", line, url, body).await
}

async fn send_as(
    client: &reqwest::Client,
    media_type: &str,
    line: &str,
    url: &str,
    body: String,
) -> Value {
    let method: reqwest::Method = line.parse().expect("a method");
    let sent = client
        .request(method, url)
        .header("content-type", media_type)
        .body(body)
        .send()
        .await
        .expect("an answer");
    assert!(
        sent.status().is_success(),
        "{line} {url}: {}",
        sent.status()
    );
    let text = sent.text().await.expect("a body");
    serde_json::from_str(&text).expect("JSON")
}

async fn until(what: &str, is_so: impl AsyncFn() -> bool) {
    let waited = tokio::time::timeout(WAIT_AT_MOST, async {
        while !is_so().await {
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
    });
    waited
        .await
        .unwrap_or_else(|_| panic!("it never was so: {what}"));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_posted_at_one_edge_closes_at_the_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let central = registry(&folder).await;
    let client = reqwest::Client::builder()
        .no_proxy()
        .build()
        .expect("a client");
    let at_registry = format!("http://{}/v1/networks/ladder", central.addresses().listen);
    send(&client, "PUT", &at_registry, write_network(&ladder())).await;
    let (north, south) = (edge(&central, "north").await, edge(&central, "south").await);
    let url = |service: &Service| format!("http://{}/v1/zones", service.addresses().listen);
    for service in [&north, &south] {
        until("it follows", async || {
            service.edge().stamp().registry_revision.is_some()
        })
        .await;
    }
    let feature = circle("fire brigade/7 ü", 150.0, 0.0, 5.0).to_string();
    let ack = send(&client, "POST", &url(&north), feature).await;
    assert_eq!(ack["enforced"], true);
    until("it has come", async || {
        south.edge().status().blocked_segments == 1
    })
    .await;
    until("the outbox is empty", async || {
        let status = north.edge().status().registry;
        status.is_some_and(|sync| sync.outbox == 0)
    })
    .await;
    let failure =
        r#"{"service": {"from": "a1", "to": "a2"}, "destination": "a4", "dry_run": true}"#;
    let failures = format!("http://{}/v1/failures", south.addresses().listen);
    let answer = client
        .post(&failures)
        .header("content-type", "application/json")
        .body(failure)
        .send()
        .await
        .expect("an answer");
    let answer: Value = serde_json::from_str(&answer.text().await.expect("a body")).expect("JSON");
    assert_eq!(answer["freshness"], "fresh", "{answer}");
    assert_eq!(answer["registry_revision"], "1-2", "{answer}");
    let metrics = format!("http://{}/metrics", south.addresses().admin);
    let metrics = client.get(&metrics).send().await.expect("an answer");
    let metrics = metrics.text().await.expect("text");
    for line in [
        "skyway_registry_revision 2",
        "skyway_outbox_entries 0",
        "skyway_registry_nacks_total 0",
    ] {
        assert!(
            metrics.lines().any(|told| told.starts_with(line)),
            "{line}: {metrics}"
        );
    }
    // The registry ends: answers go on.
    central.stop().await.expect("it ends");
    let more = circle("alone", 350.0, 0.0, 5.0).to_string();
    send(&client, "POST", &url(&south), more).await;
    assert_eq!(south.edge().status().blocked_segments, 2);
    assert!(south.edge().is_ready());
    north.stop().await.expect("it ends");
    south.stop().await.expect("it ends");
}

/// What drones report at one edge is counted at the registry, and another edge tells it, though the registry has ended.
#[tokio::test(flavor = "multi_thread")]
async fn failure_rates_are_pulled_and_told_while_the_registry_is_away() {
    let folder = tempfile::tempdir().expect("a folder");
    let central = registry(&folder).await;
    let client = reqwest::Client::builder().no_proxy().build();
    let client = client.expect("a client");
    let at_registry = format!("http://{}/v1/networks/ladder", central.addresses().listen);
    send(&client, "PUT", &at_registry, write_network(&ladder())).await;
    let get = async |url: &str| -> Value {
        let told = client.get(url).send().await.expect("an answer");
        serde_json::from_str(&told.text().await.expect("a body")).expect("JSON")
    };
    let north = edge(&central, "north").await;
    let failures = format!("http://{}/v1/failures", north.addresses().listen);
    let failure = json!({
        "type": "environmental", "service": {"from": "a1", "to": "a2"}, "destination": "a4",
        "location": {"node": "a1"},
    });
    send_json(&client, "POST", &failures, failure.to_string()).await;
    let statistics = format!("{at_registry}/statistics");
    until("it is counted", async || {
        get(&statistics).await["failures"] != json!([])
    })
    .await;
    let counted = get(&statistics).await["failures"].clone();

    let south = edge(&central, "south").await;
    let rates = format!("http://{}/v1/failure-rates", south.addresses().listen);
    until("it is pulled", async || {
        get(&rates).await["until"].is_string()
    })
    .await;
    central.stop().await.expect("it ends");
    let told = get(&rates).await;
    for member in ["segment", "hour", "failure_type", "failures"] {
        assert_eq!(told["failures"][0][member], counted[0][member], "{told}");
    }
    let segment = counted[0]["segment"].as_str().expect("a segment");
    let of = |segment: &str| format!("{rates}?segment={segment}");
    assert_eq!(get(&of(segment)).await["failures"], told["failures"]);
    assert_eq!(get(&of("b1-b2")).await["failures"], json!([]));
    assert_eq!(get(&of("nowhere")).await["code"], "parameter_invalid");
    north.stop().await.expect("it ends");
    south.stop().await.expect("it ends");
}

/// The key that signs is revoked at the registry: its edge makes another one, and neither forgets it.
#[tokio::test(flavor = "multi_thread")]
async fn a_key_that_is_revoked_at_the_registry_signs_no_more() {
    let folder = tempfile::tempdir().expect("a folder");
    let central = registry(&folder).await;
    let client = reqwest::Client::builder()
        .no_proxy()
        .build()
        .expect("a client");
    let at_registry = format!("http://{}/v1", central.addresses().listen);
    let network = format!("{at_registry}/networks/ladder");
    send(&client, "PUT", &network, write_network(&ladder())).await;
    let store = folder.path().join("edge.db");
    let start = || async {
        let mut config = following(&central, "north");
        config.store = Some(store.clone());
        Service::start(on_ladder(config)).await.expect("an edge")
    };
    let states = |edge: &Service| -> Vec<(String, PackKeyState)> {
        let keys = edge.edge().list_pack_keys().keys;
        keys.iter()
            .map(|key| (key.id.to_string(), key.state))
            .collect()
    };
    let north = start().await;
    let first = states(&north)[0].0.clone();
    let revoked = format!("{at_registry}/revoked-keys/{first}");
    let reason = json!({"reason": "stolen"}).to_string();
    let told = send_json(&client, "PUT", &revoked, reason).await;
    assert_eq!(
        (&told["id"], &told["reason"]),
        (&json!(first), &json!("stolen"))
    );
    let again = send_json(&client, "PUT", &revoked, "{}".to_owned()).await;
    assert_eq!(again, told, "it stays as it was revoked first");
    until("its edge signs with another", async || {
        let now = states(&north);
        now.len() == 2 && now[0] == (first.clone(), PackKeyState::Revoked)
    })
    .await;
    assert_eq!(states(&north)[1].1, PackKeyState::Active);
    let file = folder.path().join("edge.db.keys");
    until("it stands in the file", async || {
        let keys = PackKeys::load(&file).expect("a file").expect("keys");
        keys.keys()[0].revoked_at.is_some()
    })
    .await;
    let before = states(&north);
    north.stop().await.expect("it ends");
    let north = start().await;
    assert_eq!(states(&north), before);
    let refused = client
        .put(format!("{at_registry}/revoked-keys/no-key"))
        .header("content-type", "application/json")
        .body("{}")
        .send();
    assert_eq!(refused.await.expect("an answer").status(), 400);
    north.stop().await.expect("it ends");
    central.stop().await.expect("it ends");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_edge_on_one_store_does_not_start() {
    let folder = tempfile::tempdir().expect("a folder");
    let start = || {
        on_ladder(EdgeConfig {
            store: Some(folder.path().join("edge.db")),
            ..edge_config()
        })
    };
    let first = Service::start(start()).await.expect("an edge");
    let refused = Service::start(start()).await.expect_err("it is taken");
    assert_eq!(
        refused.to_string(),
        "another edge writes to this store; give each edge a file of its own"
    );
    first.stop().await.expect("it ends");
    let next = Service::start(start()).await.expect("it is free again");
    next.stop().await.expect("it ends");
}
