//! A registry that stops in the middle of what it says, over HTTP, in time that passes when nothing else can happen.

use skyway::edge::sync::{ClientError, HttpAddress, HttpClient, RegistryClient};
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{Instant, sleep};

/// A list that promises more than there is.
const LIST: &str = "HTTP/1.1 200 OK\r\ncontent-type: application/json\r\ncontent-length: 8\r\n\r\n";

/// A client of a registry that says its list letter by letter, so far apart, and then nothing more.
async fn client_of(letters: &'static str, apart: Duration) -> HttpClient {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let address = listener.local_addr().expect("an address");
    tokio::spawn(async move {
        let (mut line, _) = listener.accept().await.expect("someone asks");
        let mut question = [0_u8; 4_096];
        let count = line.read(&mut question).await.expect("a question");
        assert!(count > 0, "a question");
        say(&mut line, letters, apart).await;
        // It says no more, and does not hang up either.
        std::future::pending::<()>().await;
    });
    HttpClient::new(&HttpAddress {
        url: format!("http://{address}"),
        network: "town".to_owned(),
        edge_id: "east".to_owned(),
        token: None,
        authorities: Vec::new(),
    })
    .expect("a client")
}

async fn say(line: &mut TcpStream, letters: &str, apart: Duration) {
    line.write_all(LIST.as_bytes())
        .await
        .expect("someone listens");
    for letter in letters.bytes() {
        sleep(apart).await;
        // The edge that has given it up listens no more.
        if line.write_all(&[letter]).await.is_err() {
            return;
        }
    }
}

/// How the list is read, and how many seconds that takes.
async fn listed(letters: &'static str, apart_s: u64) -> (ClientError, u64) {
    let client = client_of(letters, Duration::from_secs(apart_s)).await;
    let begun = Instant::now();
    let error = client.snapshot(None).await.expect_err("it is no list");
    (error, begun.elapsed().as_secs())
}

#[tokio::test(start_paused = true)]
async fn who_falls_silent_in_the_middle_is_not_waited_for() {
    let (error, took_s) = listed("abc", 2).await;
    let text = error.to_string();
    assert!(text.contains("nothing has come for 10 s"), "{text}");
    assert_eq!(took_s, 16, "three letters, and then ten seconds of nothing");
}

#[tokio::test(start_paused = true)]
async fn who_is_slow_is_heard_out() {
    let (error, took_s) = listed("abcdefgh", 7).await;
    assert!(matches!(error, ClientError::Unreadable(_)), "{error}");
    assert_eq!(took_s, 56, "eight letters");
}

#[tokio::test(start_paused = true)]
async fn who_takes_more_than_a_minute_is_given_up() {
    let (error, took_s) = listed("abcdefgh", 9).await;
    assert!(matches!(error, ClientError::Transport(_)), "{error}");
    assert_eq!(took_s, 60, "six letters of eight");
}
