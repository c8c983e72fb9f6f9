//! What tests write: a small network, and writes to a store without a registry before it.

use skyway::formats::write_network;
use skyway::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};
use skyway::registry::store::{
    Append, Appended, Expectation, KeptReply, NewChange, ReplyKey, Store, StoreError, Version,
};
use skyway::wire::{ChangeOperation, ObjectKind};

pub(crate) const NETWORK: &str = "square";

/// What a store has read of a network that it has.
pub(crate) fn found<T>(read: Result<Option<T>, StoreError>) -> T {
    read.expect("answers").expect("a network")
}

/// Four nodes in a square of 100 m, and its four sides.
pub(crate) fn square() -> String {
    let corners = [
        ("a", 0.0, 0.0),
        ("b", 100.0, 0.0),
        ("c", 100.0, 100.0),
        ("d", 0.0, 100.0),
    ];
    let nodes = corners.map(|(id, x, y)| NodeDraft {
        id: id.to_owned(),
        position: [x, y],
        pads: 1,
        ..NodeDraft::default()
    });
    let sides = [("a", "b"), ("b", "c"), ("c", "d"), ("d", "a")];
    let segments = sides.map(|(from, to)| SegmentDraft {
        from: from.to_owned(),
        to: to.to_owned(),
        ..SegmentDraft::default()
    });
    write_network(&NetworkDraft {
        name: "Square".to_owned(),
        coordinates: Coordinates::Planar,
        nodes: nodes.to_vec(),
        segments: segments.to_vec(),
        ..NetworkDraft::default()
    })
}

pub(crate) fn put(kind: ObjectKind, id: &str, body: &str) -> NewChange {
    NewChange {
        kind,
        id: id.to_owned(),
        operation: ChangeOperation::Put,
        body: Some(body.to_owned()),
    }
}

pub(crate) fn zone(id: &str, body: &str) -> NewChange {
    put(ObjectKind::Zone, id, body)
}

pub(crate) fn gone(id: &str) -> NewChange {
    NewChange {
        kind: ObjectKind::Zone,
        id: id.to_owned(),
        operation: ChangeOperation::Delete,
        body: None,
    }
}

/// A write without expectations.
pub(crate) fn write(network: &str, changes: Vec<NewChange>) -> Append {
    Append {
        network: network.to_owned(),
        creates: None,
        subject: "test".to_owned(),
        at: "2026-11-27T18:00:00Z".to_owned(),
        head: None,
        expects: Vec::new(),
        changes,
        zones_max: 1_000,
        closures_max: 1_000,
        key: None,
        reply: Box::new(|identity, version| KeptReply {
            created: true,
            etag: Some(version.etag()),
            id: "it".to_owned(),
            body: format!("{} made {}", identity.registry_id, version.revision),
        }),
    }
}

/// The write that makes a network.
pub(crate) fn creation(network: &str) -> Append {
    Append {
        creates: Some(100),
        ..write(network, vec![put(ObjectKind::Network, "", &square())])
    }
}

pub(crate) fn expecting(mut append: Append, id: &str, version: Option<Version>) -> Append {
    append.expects.push(Expectation {
        kind: ObjectKind::Zone,
        id: id.to_owned(),
        version,
    });
    append
}

pub(crate) fn keyed(mut append: Append, key: &str, at_ms: i64) -> Append {
    append.key = Some(ReplyKey {
        subject: "test".to_owned(),
        key: key.to_owned(),
        fingerprint: "f".to_owned(),
        at_ms,
    });
    append
}

/// Commits a write that has to succeed.
pub(crate) async fn commit(store: &dyn Store, append: Append) -> Version {
    match store.append(&append).await.expect("the store takes it") {
        Appended::Done { version, .. } => version,
        other => panic!("not committed: {other:?}"),
    }
}
