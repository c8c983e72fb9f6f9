//! Feeds of zones that are imported while the network changes.

use crate::stage::{Stage, circle, loaded};
use crate::topology::renumbered;
use serde_json::json;
use skyway::edge::{Decision, FeedImport, PageRequest};

#[tokio::test]
async fn a_feed_that_is_read_on_the_old_network_closes_the_same_places_of_the_new() {
    // Some of them are read before the change and carried out after it.
    for _ in 0..30 {
        let stage = Stage::set();
        let mut odd = circle("odd", 250.0, 100.0, 5.0);
        odd["properties"]["upper_m"] = json!("high");
        let feed = json!({"type": "FeatureCollection", "features": [circle("crane", 450.0, 100.0, 5.0), odd]});
        let import = FeedImport {
            feed: "city".to_owned(),
            ..FeedImport::default()
        };
        let change = stage.edge.replace_network(loaded(&renumbered()));
        let import = stage
            .edge
            .import_zones(&stage.caller, feed.to_string(), import);
        let (change, imported) = tokio::join!(change, import);
        change.expect("put into service");
        imported.expect("imported");
        stage.settle().await;
        let page = PageRequest::default();
        let proposals = stage.edge.proposals(&stage.caller, &page);
        let proposal = proposals.expect("proposals").proposals[0].id.to_string();
        let accepted = stage
            .edge
            .decide_proposal(&stage.caller, &proposal, Decision::Accept);
        accepted.await.expect("accepted");
        for (zone, segment) in [("crane", "b4-b5"), ("odd", "b2-b3")] {
            let closure = stage.edge.closure(&stage.caller, zone);
            assert_eq!(closure.expect("in force").segments, [segment]);
        }
    }
}
