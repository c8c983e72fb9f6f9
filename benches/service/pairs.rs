//! Edge and echo in turns, and how many requests each answers: the ratio is taken within each pair, so that what
//! the machine does meanwhile is in both.

use crate::load::{self, Dialect, Run};
use crate::ranks;
use crate::rest_load;
use crate::servers::Server;
use crate::workload::Workload;
use crate::{Extent, Result};
use skyway::wire::Outcome;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How long the tables of destinations may take that the first answers asked for.
const TABLES_WITHIN: Duration = Duration::from_millis(500);
/// The queue of tables is bounded: what was dropped is asked for again.
const PASSES: usize = 4;

/// What the edge answers to every report, once it has its tables.
pub(crate) struct Recorded {
    /// Lines of JSON.
    pub(crate) file: PathBuf,
    /// Which part of them leads on to the destination.
    pub(crate) rerouted_share: f64,
    /// How long they are on average.
    pub(crate) mean_bytes: f64,
}

/// Asks the edge everything, and writes its last answers to a file.
pub(crate) fn record(edge: &Server, workload: &Workload, folder: &Path) -> Result<Recorded> {
    let mut lines = Vec::new();
    for _ in 0..PASSES {
        lines = answers(edge.address, workload)?;
        std::thread::sleep(TABLES_WITHIN);
    }
    let file = folder.join("answers.jsonl");
    let text = lines.concat();
    std::fs::write(&file, &text)?;
    let count = lines.len() as f64;
    let outcomes = lines.iter().map(|line| rest_load::outcome(line));
    let rerouted = outcomes.filter(|outcome| *outcome == Some(Outcome::Rerouted));
    Ok(Recorded {
        file,
        rerouted_share: rerouted.count() as f64 / count,
        mean_bytes: text.len() as f64 / count,
    })
}

fn answers(address: SocketAddr, workload: &Workload) -> Result<Vec<Vec<u8>>> {
    let mut stream = TcpStream::connect(address)?;
    stream.set_nodelay(true)?;
    let mut lines = Vec::with_capacity(workload.reports.len());
    for request in rest_load::requests(address, &workload.reports) {
        let (head, received) = ask(&mut stream, &request)?;
        let body = &received[head.body_from..head.body_until];
        if !head.is_ok {
            return Err(format!("refused: {}", String::from_utf8_lossy(body)).into());
        }
        let mut line = body.to_vec();
        line.push(b'\n');
        lines.push(line);
    }
    Ok(lines)
}

/// Sends a request and waits for its answer.
pub(crate) fn ask(stream: &mut TcpStream, request: &[u8]) -> Result<(rest_load::Head, Vec<u8>)> {
    stream.write_all(request)?;
    let mut received = Vec::with_capacity(8 * 1024);
    let mut part = [0; 8 * 1024];
    loop {
        let count = stream.read(&mut part)?;
        if count == 0 {
            return Err("the server closed before it answered".into());
        }
        received.extend(&part[..count]);
        if let Some(head) = rest_load::whole(&received)? {
            return Ok((head, received));
        }
    }
}

/// Measures pairs and prints what they come to.
pub(crate) fn measure(
    dialect: Dialect,
    edge: &Server,
    echo: &Server,
    workload: &Workload,
    extent: Extent,
) -> Result<()> {
    let mut pairs = Vec::with_capacity(extent.pairs);
    for number in 1..=extent.pairs {
        let run = |server| load::run(dialect, server, workload, extent);
        // Now the one first, now the other: a machine that grows slower is no advantage to either.
        pairs.push(match number % 2 {
            0 => (run(edge)?, run(echo)?),
            _ => {
                let of_echo = run(echo)?;
                (run(edge)?, of_echo)
            }
        });
    }
    print_table(dialect, &pairs);
    Ok(())
}

type Pair = (Run, Run);

/// A title, the figure, and how many digits this has after the point.
type Column = (&'static str, fn(&Pair) -> f64, usize);

/// The columns of the table.
const COLUMNS: [Column; 8] = [
    ("edge, requests/s", |(edge, _)| edge.requests_per_s, 0),
    ("echo, requests/s", |(_, echo)| echo.requests_per_s, 0),
    ("ratio", ratio, 3),
    ("edge, CPU µs", |(edge, _)| edge.server_us, 2),
    ("echo, CPU µs", |(_, echo)| echo.server_us, 2),
    ("ratio", |(edge, echo)| edge.server_us / echo.server_us, 3),
    ("edge busy, %", |(edge, _)| 100.0 * edge.server_share, 0),
    ("echo busy, %", |(_, echo)| 100.0 * echo.server_share, 0),
];

fn ratio((edge, echo): &Pair) -> f64 {
    edge.requests_per_s / echo.requests_per_s
}

/// What a figure is over all pairs, in order.
fn sorted(pairs: &[Pair], figure: fn(&Pair) -> f64) -> Vec<f64> {
    let mut figures: Vec<f64> = pairs.iter().map(figure).collect();
    figures.sort_by(f64::total_cmp);
    figures
}

fn print_table(dialect: Dialect, pairs: &[Pair]) {
    let titles: Vec<&str> = COLUMNS.iter().map(|(title, ..)| *title).collect();
    println!("\n| {} | {} |", dialect.title(), titles.join(" | "));
    println!("|---|{}", "---:|".repeat(COLUMNS.len()));
    let last = pairs.len() - 1;
    let (low, high) = ranks::of_median(pairs.len());
    let rows = [
        ("lowest", 0),
        ("a quarter is lower", last / 4),
        ("**median**", last / 2),
        ("a quarter is higher", last - last / 4),
        ("highest", last),
    ];
    for (name, rank) in rows {
        let cells = COLUMNS.iter().map(|(_, figure, digits)| {
            let value = sorted(pairs, *figure)[rank];
            format!("{value:.digits$}", digits = *digits)
        });
        println!("| {name} | {} |", cells.collect::<Vec<_>>().join(" | "));
    }
    let ratios = sorted(pairs, ratio);
    println!(
        "\nThe edge answers {:.1} % of the requests that the echo answers (median of {} pairs, 95 % interval {:.1} to {:.1} %), \
         with {:.2} times its processor time; {:.1} % of the answers that were read are `rerouted`, and {} requests in {} of the \
         pairs were refused.",
        100.0 * ratios[last / 2],
        pairs.len(),
        100.0 * ratios[low],
        100.0 * ratios[high],
        sorted(pairs, |(edge, echo)| edge.server_us / echo.server_us)[last / 2],
        100.0 * sorted(pairs, |(edge, _)| edge.rerouted_share)[last / 2],
        pairs.iter().map(|(edge, _)| edge.refused).sum::<u64>(),
        pairs.iter().filter(|(edge, _)| edge.refused > 0).count(),
    );
}
