//! What every store does with the positions of drones: cases of the suite that runs on each engine.

use crate::contract::Open;
use crate::documents::DAY_MS;
use skyway::registry::documents::PositionRow;

pub(crate) fn position(drone: &str, at_ms: i64) -> PositionRow {
    PositionRow {
        drone: drone.to_owned(),
        at_ms,
        lon: 151.2 + at_ms as f64 * 1e-9,
        lat: -33.8,
        altitude_m: None,
        battery_fraction: Some(0.5),
        speed_mps: None,
    }
}

pub(crate) async fn are_kept_once(open: Open) {
    let store = open().await;
    // Over midnight.
    let all: Vec<PositionRow> = (0..1000)
        .map(|number| position("acme:1", DAY_MS - 500 + number))
        .collect();
    assert_eq!(store.keep_positions(&[]).await, Ok(0));
    assert_eq!(store.keep_positions(&all[..600]).await, Ok(600));
    let mut more = all.clone();
    more[0].lat = 0.0;
    more.push(position("acme:2", DAY_MS));
    assert_eq!(store.keep_positions(&more).await, Ok(401));
    let twice = [position("acme:3", 1), position("acme:3", 1)];
    assert_eq!(store.keep_positions(&twice).await, Ok(1));
    // Two processes at once, on a day that none has seen.
    let stores = [store.clone(), open().await];
    let writers = [0, 1].map(|writer| {
        let store = stores[writer].clone();
        tokio::spawn(async move {
            let rows: Vec<PositionRow> = (0..300)
                .map(|number| position("acme:4", 5 * DAY_MS + number))
                .collect();
            store.keep_positions(&rows).await.expect("kept")
        })
    });
    let mut stored = 0;
    for writer in writers {
        stored += writer.await.expect("a writer");
    }
    assert_eq!(stored, 300);
    let found = store.positions("acme:1", DAY_MS - 500, DAY_MS + 100, 10_000);
    assert_eq!(found.await, Ok(all[..600].to_vec()));
    let found = store.positions("acme:1", DAY_MS, i64::MAX, 2).await;
    assert_eq!(found, Ok(all[500..502].to_vec()));
    let drones = ["acme:1", "nobody", "acme:2"].map(str::to_owned);
    let last = store.last_positions(&drones, DAY_MS + 1).await;
    assert_eq!(last, Ok(vec![all[999].clone()]));
    let last = store.last_positions(&drones, 0).await;
    assert_eq!(last, Ok(vec![all[999].clone(), position("acme:2", DAY_MS)]));
    for store in stores {
        store.close().await;
    }
}
