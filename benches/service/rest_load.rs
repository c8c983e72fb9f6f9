//! The load in HTTP/1.1: requests written beforehand, answers read as far as their head tells.

use crate::load::Tally;
use skyway::wire::{FailureReport, Outcome, Recomposition};
use std::convert::Infallible;
use std::io;
use std::net::SocketAddr;
use std::rc::Rc;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

/// Connections at once, each with one request under way.
pub(crate) const CONNECTIONS: usize = 32;
/// Where the status stands in `HTTP/1.1 200 OK`.
const STATUS: std::ops::Range<usize> = 9..12;
const END_OF_HEAD: &[u8] = b"\r\n\r\n";

/// What a head says.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Head {
    pub(crate) is_ok: bool,
    /// Where the body begins.
    pub(crate) body_from: usize,
    /// Where it ends.
    pub(crate) body_until: usize,
}

/// The reports as requests to an address, head and body.
pub(crate) fn requests(address: SocketAddr, reports: &[FailureReport]) -> Vec<Vec<u8>> {
    let request = |report| {
        // Plain values with text keys always have a JSON form.
        let body = serde_json::to_string(report).unwrap_or_default();
        let length = body.len();
        let text = format!(
            "POST /v1/failures HTTP/1.1\r\nhost: {address}\r\nuser-agent: skyway-bench\r\naccept: application/json\r\n\
             content-type: application/json\r\ncontent-length: {length}\r\n\r\n{body}"
        );
        text.into_bytes()
    };
    reports.iter().map(request).collect()
}

/// Sends one request after the other, each when the one before is answered.
pub(crate) async fn drive(
    address: SocketAddr,
    requests: Rc<Vec<Vec<u8>>>,
    first: usize,
    tally: Rc<Tally>,
) -> io::Result<Infallible> {
    let mut stream = TcpStream::connect(address).await?;
    stream.set_nodelay(true)?;
    let mut received = Vec::with_capacity(16 * 1024);
    let mut next = first;
    loop {
        stream.write_all(&requests[next % requests.len()]).await?;
        next += 1;
        received.clear();
        let head = loop {
            if stream.read_buf(&mut received).await? == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            if let Some(head) = whole(&received)? {
                break head;
            }
        };
        match head.is_ok {
            true => tally.answer(|| outcome(&received[head.body_from..head.body_until])),
            false => tally.refuse(),
        }
    }
}

/// The head of an answer, once all of the answer is there.
pub(crate) fn whole(received: &[u8]) -> io::Result<Option<Head>> {
    let end = received
        .windows(END_OF_HEAD.len())
        .position(|window| window == END_OF_HEAD);
    let Some(end) = end else {
        return Ok(None);
    };
    let body_from = end + END_OF_HEAD.len();
    let length = body_length(&received[..end]).ok_or(io::ErrorKind::InvalidData)?;
    let head = Head {
        is_ok: received.get(STATUS) == Some(b"200"),
        body_from,
        body_until: body_from + length,
    };
    Ok((received.len() >= head.body_until).then_some(head))
}

fn body_length(head: &[u8]) -> Option<usize> {
    const NAME: &[u8] = b"content-length: ";
    let mut lines = head.split(|byte| *byte == b'\n');
    let line = lines.find_map(|line| line.strip_prefix(NAME))?;
    std::str::from_utf8(line.trim_ascii_end())
        .ok()?
        .parse()
        .ok()
}

/// What a body tells a drone to do.
pub(crate) fn outcome(body: &[u8]) -> Option<Outcome> {
    let answer: Recomposition<'_> = serde_json::from_slice(body).ok()?;
    Some(answer.answer.outcome)
}
