//! How late services are, by more deliveries than are looked at.

use super::world::{NETWORK, SERVICE, World, of};
use serde_json::json;
use skyway::access::Role;
use skyway::registry::documents::{Commit, Committed, Document, DocumentKind};

/// How many are looked at.
const LOOKED_AT: u64 = 50_000;
const NEWEST: u64 = 200;

/// A delivery that arrived; the newest in time.
fn delivered(number: u64, ordered_ms: i64) -> Document {
    let id = format!("d{ordered_ms:012x}{number:016x}");
    let arrived_at = match number < LOOKED_AT {
        true => "2026-11-27T17:45:00Z",
        false => "2026-11-27T17:30:00Z",
    };
    let body = json!({
        "id": id, "customer": "shop", "provider": "swift", "service_id": SERVICE, "network": NETWORK,
        "source": "shop", "destination": "door", "payload_kg": 1.0, "status": "delivered",
        "created_at": "2026-11-27T17:00:00Z", "start_time": "2026-11-27T17:00:00Z",
        "promised_at": "2026-11-27T17:30:00Z", "proof": {"at": arrived_at},
        "history": [], "recompositions": [],
    });
    Document {
        kind: DocumentKind::Delivery,
        id,
        tenant: "shop".to_owned(),
        party: "swift".to_owned(),
        state: "delivered".to_owned(),
        version: 1,
        changed_ms: ordered_ms,
        body: body.to_string(),
    }
}

#[tokio::test]
async fn of_too_many_deliveries_the_newest_count() {
    let world = World::with_drones(&[]).await;
    let ordered_ms = world.now().as_millisecond() - 3_600_000;
    let all: Vec<Document> = (0..LOOKED_AT + NEWEST)
        .map(|number| delivered(number, ordered_ms))
        .collect();
    for some in all.chunks(10_000) {
        let commit = Commit {
            puts: some.to_vec(),
            ..Commit::default()
        };
        let committed = world.documents.commit(&commit).await;
        assert_eq!(committed, Ok(Committed::Done));
    }
    let operator = of(Role::Operator, "airspace");
    let told = world.dispatch.statistics(&operator, NETWORK, None, None);
    let told = told.await.expect("statistics");
    let on_time = &told.lateness[0].on_time;
    assert_eq!((on_time.count, on_time.of), (NEWEST, LOOKED_AT));
}
