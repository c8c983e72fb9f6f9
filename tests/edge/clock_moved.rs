//! A clock that a client moves: advancing it blocks no reader, and other commands have their turn.

use crate::stage::{DAWN, EPOCH, WAIT_AT_MOST, network};
use skyway::clock::Clock;
use skyway::edge::{Caller, Edge, Opening, Settings, WriterStep};
use skyway::wire::ClockAdvance;
use std::sync::{Arc, Mutex, mpsc};
use tokio::time::timeout;

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn advancing_the_clock_blocks_no_reader() {
    let (topology, geojson) = network();
    let clock = Clock::external(DAWN.parse().expect("an instant"));
    let (arrivals, arrived) = mpsc::channel();
    let (gate, closed) = mpsc::channel::<()>();
    let closed = Mutex::new(closed);
    let opening = Opening::new(topology, geojson, EPOCH, Settings::default(), clock);
    let opening = opening.watched_by(move |step| {
        if step == WriterStep::Enforced {
            // The test may have seen enough; then the gate is open.
            let _seen = arrivals.send(());
            let _opened = closed.lock().expect("a channel").recv();
        }
    });
    let edge = opening.without_store().expect("threads");
    let reads = async |edge: &Arc<Edge>| {
        let edge = edge.clone();
        // On the one worker that there is.
        let read = tokio::spawn(async move { edge.clock_reading(&Caller::anyone()).time });
        timeout(WAIT_AT_MOST, read)
            .await
            .expect("it is read")
            .expect("a time")
    };
    let mover = edge.clone();
    let moving = tokio::spawn(async move {
        let to = "2026-11-21T07:00:00Z".to_owned();
        mover
            .advance_clock(&Caller::anyone(), &ClockAdvance { to })
            .await
    });
    arrived
        .recv_timeout(WAIT_AT_MOST)
        .expect("the clock is being moved");
    reads(&edge).await;
    let other = edge.clone();
    let ordering = tokio::spawn(async move { other.tick().await });
    reads(&edge).await;
    drop(gate);
    let moved = moving.await.expect("no panic").expect("it is moved");
    assert_eq!(moved.time, "2026-11-21T07:00:00Z");
    ordering
        .await
        .expect("no panic")
        .expect("it is carried out");
    assert_eq!(reads(&edge).await, moved.time);
}
