//! Networks come from the registry, too: to an edge that has none, and as patches to one that flies.

use crate::stage::{Central, NETWORK, Outpost, ladder, manner};
use serde_json::json;
use skyway::edge::{Code, Settings};
use skyway::formats::write_network;
use skyway::wire::{ClosureDraft, NetworkPatch};

#[tokio::test]
async fn an_edge_without_a_network_is_ready_once_the_registry_has_given_it_one() {
    let central = Central::open().await;
    central.put_zone("a", 150.0, 0.0, 5.0).await;
    let north = Outpost::without_network(&central.registry, "north", Settings::default());
    north.line.cut();
    assert!(!north.edge.is_ready());
    let refusal = north.edge.network_geojson().expect_err("there is none");
    assert_eq!(refusal.code, Code::NotReady);
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    assert!(north.edge.is_ready());
    assert_eq!(north.blocked(), 1);
    let (text, _) = north.edge.network_geojson().expect("a network");
    assert_eq!(text, write_network(&ladder()).as_bytes());
    assert_eq!(north.sync().nacks, 0);
    north.end().await;
}

#[tokio::test]
async fn a_patch_of_the_network_and_what_stands_on_it_come_as_one_revision() {
    let central = Central::open().await;
    central.put_zone("wide", 750.0, 0.0, 60.0).await;
    let north = Outpost::set(&central, "north");
    north.settle(&central).await;
    assert_eq!(north.blocked(), 2, "a6-a7 and a7-b7");
    north.line.cut();
    let patch: NetworkPatch = serde_json::from_value(json!({
        "added": [
            {"type": "Feature", "id": "a8", "geometry": {"type": "Point", "coordinates": [800, 0]},
             "properties": {"kind": "node", "pads": 1}},
            {"type": "Feature", "geometry": {"type": "LineString", "coordinates": [[700, 0], [800, 0]]},
             "properties": {"kind": "segment", "from": "a7", "to": "a8"}},
        ],
        "removed_segments": ["a0-b0"],
    }))
    .expect("a patch");
    let etag = central
        .registry
        .network(NETWORK)
        .await
        .expect("a network")
        .1;
    let manner = manner(Some(etag));
    let patched = central.registry.patch_network(NETWORK, patch, &manner);
    patched.await.expect("patched");
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    let status = north.edge.status();
    assert_eq!((status.nodes, status.segments), (17, 22));
    assert_eq!(status.stamp.topology_revision, 2);
    assert_eq!(north.blocked(), 3, "and a7-a8");
    // What is told of the new network is understood there.
    let draft = ClosureDraft {
        id: Some("crane".to_owned()),
        segments: vec!["a7-a8".to_owned()],
        ..ClosureDraft::default()
    };
    let closed = north
        .edge
        .close(&north.caller, draft, skyway::edge::Idempotency::default());
    closed.await.expect("a closure");
    north.settle(&central).await;
    assert_eq!(central.closures().await.len(), 1);
    assert_eq!(north.sync().nacks, 0);
    north.end().await;
}
