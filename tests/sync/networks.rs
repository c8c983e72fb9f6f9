//! Networks come from the registry, too: to an edge that has none, and as patches to one that flies.

use crate::stage::{Central, NETWORK, Outpost, ladder, manner};
use serde_json::{Value, json};
use skyway::edge::{Code, FeedImport, PageRequest, Settings, ZoneWrite};
use skyway::formats::{load_network, write_network};
use skyway::network::{Coordinates, NodeDraft};
use skyway::registry::WriteOptions;
use skyway::registry::store::Compaction;
use skyway::wire::{ClosureDraft, NetworkPatch, ObjectKind};

const EARTH: &str = "earth";

/// The ladder on earth, on the equator; with a node far away its plane touches the earth elsewhere.
fn on_earth(is_wide: bool) -> String {
    let mut draft = ladder();
    for node in &mut draft.nodes {
        node.position = node.position.map(|metres| metres / 111_000.0);
    }
    draft.coordinates = Coordinates::Geographic;
    if is_wide {
        draft.nodes.push(NodeDraft {
            id: "far".to_owned(),
            position: [90.0, 45.0],
            ..NodeDraft::default()
        });
    }
    write_network(&draft)
}

/// A zone that is just wide enough to have an area: on the plane of the wider network a degree is shorter, and it has none.
fn speck() -> Value {
    let (x, y, width, height) = (1e-3, 5e-4, 9.34e-12, 1e-4);
    json!({
        "type": "Feature", "id": "speck", "properties": {"margin_m": 10},
        "geometry": {"type": "Polygon", "coordinates": [[[x, y], [x + width, y], [x, y + height], [x, y]]]},
    })
}

fn on_leg(id: &str) -> Value {
    json!({
        "type": "Feature", "id": id, "properties": {"radius_m": 5.0, "margin_m": 0},
        "geometry": {"type": "Point", "coordinates": [350.0 / 111_000.0, 0.0]},
    })
}

impl Central {
    async fn put_on_earth(&self, feature: Value) {
        let id = feature["id"].as_str().map(str::to_owned);
        let (put, manner) = (id.as_deref(), manner(None));
        let put = self.registry.put_zone(EARTH, put, feature, &manner);
        put.await.expect("a zone");
    }

    async fn lift_on_earth(&self, id: &str) {
        let (kind, manner) = (ObjectKind::Zone, manner(Some("*".to_owned())));
        let lifted = self.registry.delete(EARTH, kind, id, &manner);
        lifted.await.expect("lifted");
    }

    /// Drops the log of the network on earth, so that who is behind takes the list.
    async fn compact_earth(&self) {
        let networks = self.registry.networks().await.expect("networks").networks;
        let earth = networks.iter().find(|network| network.id == EARTH);
        let head = earth.expect("a network").head;
        let (body, _) = self.registry.network(EARTH).await.expect("a network");
        let compaction = Compaction {
            network: EARTH.to_owned(),
            oldest: head,
            base_revision: head,
            base: body.to_string(),
        };
        self.store.compact(&compaction).await.expect("compacted");
    }

    async fn widen(&self) {
        let (_, etag) = self.registry.network(EARTH).await.expect("a network");
        let (wide, manner) = (on_earth(true), manner(Some(etag)));
        let put = self.registry.put_network(EARTH, &wide, &manner);
        put.await.expect("a network");
    }
}

impl Outpost {
    /// One that follows the ladder on earth.
    async fn on_earth(central: &Central) -> Self {
        let text = on_earth(false);
        let manner: WriteOptions = manner(None);
        let put = central.registry.put_network(EARTH, &text, &manner);
        put.await.expect("a network");
        let topology = load_network(&text).expect("a network").topology;
        let north = Self::on(&central.registry, EARTH, (topology, text));
        let is_read = async || north.edge.stamp().registry_revision.is_some();
        north.until("the registry is read", is_read).await;
        north
    }

    async fn has(&self, zone: &str) {
        self.until("the zone has come", async || {
            self.edge.zone(&self.caller, zone).is_ok()
        })
        .await;
    }

    async fn is_on_the_wider(&self) {
        self.until("the network has come", async || {
            self.edge.status().nodes == 17
        })
        .await;
    }
}

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

#[tokio::test]
async fn what_is_stricter_comes_though_a_zone_of_this_edge_has_no_place_on_the_new_network() {
    let central = Central::open().await;
    let north = Outpost::on_earth(&central).await;
    north.line.cut();
    let write = ZoneWrite {
        id: Some("speck".to_owned()),
        if_match: None,
        validate_only: false,
    };
    let put = north.edge.put_zone(&north.caller, speck(), write);
    put.await.expect("a zone");
    central.widen().await;
    central.put_on_earth(on_leg("with")).await;
    north.line.lead_to(Some(&central.registry));
    north.has("with").await;
    central.put_on_earth(on_leg("after")).await;
    north.has("after").await;
    assert_eq!(north.edge.status().nodes, 16);
    let nack = north.sync().last_nack.expect("it is told");
    assert_eq!(nack.code, "network_change");
    assert!(nack.reason.contains("'speck'"), "{}", nack.reason);
    north.lift_zone("speck").await;
    north.is_on_the_wider().await;
    assert_eq!(north.ids(), ["after", "with"]);
    north.end().await;
}

#[tokio::test]
async fn what_is_lifted_before_a_network_needs_no_place_on_it() {
    let central = Central::open().await;
    let north = Outpost::on_earth(&central).await;
    central.put_on_earth(speck()).await;
    north.has("speck").await;
    north.line.cut();
    central.lift_on_earth("speck").await;
    central.widen().await;
    central.put_on_earth(on_leg("with")).await;
    north.line.lead_to(Some(&central.registry));
    north.is_on_the_wider().await;
    north.has("with").await;
    assert_eq!((north.sync().nacks, north.line.lists()), (0, 1));
    north.end().await;
}

#[tokio::test]
async fn what_is_absent_from_a_list_needs_no_place_on_its_network() {
    let central = Central::open().await;
    let north = Outpost::on_earth(&central).await;
    for feature in [speck(), on_leg("stays")] {
        central.put_on_earth(feature).await;
    }
    north.has("speck").await;
    north.has("stays").await;
    north.line.cut();
    central.lift_on_earth("speck").await;
    central.widen().await;
    central.compact_earth().await;
    north.line.lead_to(Some(&central.registry));
    north.is_on_the_wider().await;
    assert_eq!((north.sync().nacks, north.line.lists()), (0, 2));
    assert_eq!(north.ids(), ["stays"]);
    assert!(north.holds().is_empty());
    north.end().await;
}

#[tokio::test]
async fn a_proposal_without_a_place_on_the_new_network_goes() {
    let central = Central::open().await;
    let north = Outpost::on_earth(&central).await;
    let mut odd = speck();
    odd["properties"]["upper_m"] = json!("high");
    let feed = json!({"type": "FeatureCollection", "features": [odd]}).to_string();
    let import = FeedImport {
        feed: "city".to_owned(),
        ..FeedImport::default()
    };
    let imported = north.edge.import_zones(&north.caller, feed, import);
    imported.await.expect("imported");
    let proposals = || {
        let page = PageRequest::default();
        let listed = north.edge.proposals(&north.caller, &page);
        listed.expect("a list").proposals.len()
    };
    assert_eq!(proposals(), 1);
    central.widen().await;
    north.is_on_the_wider().await;
    assert_eq!((proposals(), north.sync().nacks), (0, 0));
    north.end().await;
}
