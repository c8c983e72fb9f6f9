//! What is seen of a run while it goes on: a line of progress each second, how busy the server is, and what else the
//! machine does.

use crate::cores;
use crate::elsewhere::Elsewhere;
use crate::measures::Recorder;
use std::cell::RefCell;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

const EVERY: Duration = Duration::from_secs(1);

/// Watches one run.
pub(crate) struct Watch {
    label: String,
    told: Instant,
    /// The server, where it is a child of ours.
    server: Option<u32>,
    measured_from: Option<(Instant, Duration)>,
    /// Which part of the time the server worked; known once the run has ended.
    pub(crate) server_share: Option<f64>,
    begun: Instant,
    /// What processes of others had worked when it began.
    elsewhere: Elsewhere,
    /// How much the machine's other processes worked meanwhile, as a part of one core; known once the run has ended.
    pub(crate) elsewhere_share: Option<f64>,
}

impl Watch {
    pub(crate) fn new(label: String, server: Option<u32>) -> Self {
        Self {
            label,
            told: Instant::now(),
            server,
            measured_from: None,
            server_share: None,
            // Not while the load runs: all processes are looked at.
            elsewhere: Elsewhere::now(),
            begun: Instant::now(),
            elsewhere_share: None,
        }
    }

    /// Looks at what there is up to a moment.
    pub(crate) fn look(&mut self, due: Instant, recorder: &RefCell<Recorder>) {
        if self.measured_from.is_none() && due >= recorder.borrow().measured_from {
            let worked = self.worked().unwrap_or_default();
            self.measured_from = Some((Instant::now(), worked));
        }
        if due.saturating_duration_since(self.told) >= EVERY {
            self.told = due;
            self.tell(due, &recorder.borrow());
        }
    }

    /// Nothing more is measured.
    pub(crate) fn measured(&mut self) {
        let Some((begun, worked_before)) = self.measured_from else {
            return;
        };
        let worked = self
            .worked()
            .map(|worked| worked.saturating_sub(worked_before));
        let took_s = begun.elapsed().as_secs_f64();
        self.server_share = worked.map(|worked| worked.as_secs_f64() / took_s);
        if std::io::stderr().is_terminal() {
            write_line("\r\x1b[2K");
        }
    }

    /// Nothing is waited for any more.
    pub(crate) fn ended(&mut self) {
        let took_s = self.begun.elapsed().as_secs_f64();
        // A server that is no child of ours is one of the others.
        let worked = self
            .server
            .and_then(|_| Elsewhere::now().worked_since(&self.elsewhere));
        self.elsewhere_share = worked.map(|worked| worked.as_secs_f64() / took_s);
    }

    fn worked(&self) -> Option<Duration> {
        cores::processor_time(&self.server?.to_string()).ok()
    }

    fn tell(&self, due: Instant, recorder: &Recorder) {
        let Some(since) = due.checked_duration_since(recorder.measured_from) else {
            return self.write("warms up");
        };
        let all = recorder.all();
        let since_s = since.as_secs_f64().max(1e-3);
        self.write(&format!(
            "{since_s:.0} s: {:.0}/s answered, p50 {:.2} ms, p99 {:.2} ms; {} shed, {} failed, {} unsent",
            all.answered as f64 / since_s,
            all.from_intended.at_ms(0.5),
            all.from_intended.at_ms(0.99),
            all.shed,
            all.failed() - all.unsent,
            all.unsent
        ));
    }

    fn write(&self, what: &str) {
        // One line that changes where somebody looks on, lines where it is kept.
        match std::io::stderr().is_terminal() {
            true => write_line(&format!("\r\x1b[2K{}: {what}", self.label)),
            false => write_line(&format!("{}: {what}\n", self.label)),
        }
    }
}

/// No one has to read it: a reader that is gone is no reason to stop measuring.
fn write_line(text: &str) {
    let mut stderr = std::io::stderr().lock();
    let _ = stderr.write_all(text.as_bytes());
    let _ = stderr.flush();
}
