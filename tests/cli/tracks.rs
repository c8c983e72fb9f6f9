//! What is told of a delivery that is followed.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a registry that tells what a test says"
)]

use crate::binary::skyway;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::thread;

const EVENTS: &str = "text/event-stream";

/// Answers one connection after the other with a body of a content type; gives its address.
fn telling<const COUNT: usize>(
    answers: [(&'static str, String); COUNT],
) -> (String, thread::JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let registry = format!("http://{}", listener.local_addr().expect("an address"));
    let telling = thread::spawn(move || {
        for (content_type, body) in answers {
            let (mut stream, _) = listener.accept().expect("a connection");
            let request = BufReader::new(stream.try_clone().expect("the same")).lines();
            let is_header = |line: &String| !line.is_empty();
            request
                .map_while(Result::ok)
                .take_while(is_header)
                .for_each(drop);
            let head =
                format!("HTTP/1.1 200 OK\r\ncontent-type: {content_type}\r\nconnection: close");
            write!(stream, "{head}\r\n\r\n{body}").expect("it listens");
        }
    });
    (registry, telling)
}

/// A drone that stands on a pad tells its place each second, and a stream that is cut off begins with what was told last.
#[test]
fn a_track_is_told_where_it_changes() {
    let event = |second: u32, status: &str, lon: f64| {
        let place = format!(r#"{{"at":"2026-11-27T18:00:0{second}Z","lon":{lon},"lat":2.0}}"#);
        format!(
            "event: track\ndata: {{\"id\":\"d\",\"status\":\"{status}\",\"place\":{place}}}\n\n"
        )
    };
    let streams = [
        event(1, "in_flight", 1.0) + &event(2, "in_flight", 1.0) + &event(3, "in_flight", 1.5),
        event(3, "in_flight", 1.5) + &event(4, "delivered", 1.5),
    ];
    let (registry, telling) = telling(streams.map(|events| (EVENTS, events)));
    let followed = skyway(&["delivery", "track", "d", "--registry", &registry]).exits(0);
    telling.join().expect("no panic");
    let told = [
        "in_flight, at 1.00000,2.00000",
        "in_flight, at 1.50000,2.00000",
        "delivered, at 1.50000,2.00000\n",
    ];
    assert_eq!(followed.stdout, told.join("\n"));
}

/// What is no registry is not asked for ever, and says why.
#[test]
fn what_tells_no_events_is_called_so() {
    let page = "<html></html>".to_owned();
    let (registry, telling) = telling([(EVENTS, String::new()), ("text/html", page)]);
    let followed = skyway(&["delivery", "track", "d", "--registry", &registry]).exits(1);
    telling.join().expect("no panic");
    let said = ["ended without an event", "answers with text/html"];
    for words in said {
        assert!(followed.stderr.contains(words), "{followed:?}");
    }
}
