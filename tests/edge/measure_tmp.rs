//! temporary
use crate::stage::{loaded};
use serde_json::json;
use skyway::clock::Clock;
use skyway::edge::*;
use skyway::network::*;
use std::time::Instant;

#[tokio::test]
#[ignore]
async fn measure() {
    for (nodes, zones, plans, reach) in [(5_000, 1_000, 1_000, 0.1), (5_000, 10_000, 1_000, 0.1), (200_000, 10_000, 200, 0.02)] {
        let draft = Generated { nodes, max_neighbours: 6, map_size_m: 20_000.0, reach_fraction: reach, seed: 1 }.network().expect("ok");
        let t = Instant::now();
        let first = loaded(&draft);
        eprintln!("nodes {nodes}: write+load {:?}", t.elapsed());
        let edge = Edge::start(first.topology, first.geojson, 1, Settings::default(), Clock::real()).expect("e");
        let caller = Caller::anyone();
        for z in 0..zones {
            let (x, y) = ((z * 7919 % 20_000) as f64, (z * 104_729 % 20_000) as f64);
            let zone = json!({"type":"Feature","id":format!("z{z}"),"geometry":{"type":"Point","coordinates":[x,y]},"properties":{"radius_m":15.0,"margin_m":0}});
            edge.create_zone(&caller, zone, ZoneWrite::default(), Idempotency::default()).await.expect("zone");
        }
        let mut made = 0;
        for p in 0..plans {
            let r = json!({"id": format!("p{p}"), "source": (p * 31 % nodes).to_string().parse::<u64>().unwrap(), "destination": (p % 20) * 17 + 3});
            if edge.compose_plan(&caller, serde_json::from_value(r).unwrap(), Idempotency::default()).await.is_ok() { made += 1; }
        }
        let mut next = draft.clone();
        let gone: Vec<String> = next.nodes.iter().skip(100).step_by(nodes / 20).map(|n| n.id.clone()).collect();
        next.nodes.retain(|n| !gone.contains(&n.id));
        next.segments.retain(|s| !gone.contains(&s.from) && !gone.contains(&s.to));
        let next = loaded(&next);
        let t = Instant::now();
        let next = next.prepared_for(&edge.snapshot()).expect("p");
        let prepared = t.elapsed();
        let ticker = { let edge = edge.clone(); tokio::spawn(async move {
            let mut worst = std::time::Duration::ZERO;
            for _ in 0..2000 { let t = Instant::now(); edge.tick().await.unwrap(); worst = worst.max(t.elapsed()); tokio::time::sleep(std::time::Duration::from_micros(500)).await; }
            worst }) };
        tokio::time::sleep(std::time::Duration::from_millis(50)).await;
        let t = Instant::now();
        edge.replace_network(next).await.expect("r");
        let swapped = t.elapsed();
        let s = edge.status();
        eprintln!("nodes {nodes} zones {zones} plans {made}: prepare {prepared:?}, replace {swapped:?}, affected {} active {}, worst tick {:?}", s.affected_plans, s.active_plans, ticker.await.unwrap());
    }
}
