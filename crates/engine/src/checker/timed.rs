//! What is closed when, sorted so that the closures of a segment or a node are found at once.

use crate::airspace::{Airspace, Cause, Window};
use crate::flight::TimedClosure;
use crate::network::{NodeIx, SegmentIx};
use jiff::Timestamp;

/// From when until when something is closed, in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ClosedTime {
    pub(super) from_s: f64,
    pub(super) until_s: f64,
    /// Whether both ends are widened by the margins.
    pub(super) widened: bool,
}

/// The closures of an airspace with their times, those included that have not begun.
#[derive(Clone, Debug)]
pub struct ClosedTimes {
    zero: Timestamp,
    segments: Vec<(u32, ClosedTime)>,
    nodes: Vec<(u32, ClosedTime)>,
    pads: Vec<(u32, ClosedTime)>,
}

impl ClosedTimes {
    /// The closures of an airspace, in seconds from an instant.
    pub fn of(airspace: &Airspace, zero: Timestamp) -> Self {
        let mut times = Self::none(zero);
        for (closure, _) in airspace.closures() {
            let is_report = matches!(closure.cause, Cause::Report { .. });
            let is_zone = matches!(closure.cause, Cause::Zone(_));
            let windows = if is_report { &[][..] } else { &closure.windows };
            for time in times.of_windows(windows, is_zone) {
                let hits = &closure.hits;
                times.close(time, &hits.segments, &hits.nodes, &closure.pads);
            }
        }
        times.sorted()
    }

    /// Closures whose times are known already, in seconds from an instant.
    pub fn of_timed<'a>(
        closures: impl IntoIterator<Item = &'a TimedClosure>,
        zero: Timestamp,
    ) -> Self {
        let mut times = Self::none(zero);
        for closure in closures {
            let time = ClosedTime {
                from_s: closure.from_s,
                until_s: closure.until_s,
                widened: closure.widened,
            };
            times.close(time, &closure.segments, &closure.nodes, &closure.pads);
        }
        times.sorted()
    }

    fn none(zero: Timestamp) -> Self {
        Self {
            zero,
            segments: Vec::new(),
            nodes: Vec::new(),
            pads: Vec::new(),
        }
    }

    fn close(
        &mut self,
        time: ClosedTime,
        segments: &[SegmentIx],
        nodes: &[NodeIx],
        pads: &[NodeIx],
    ) {
        let segments = segments.iter().map(|segment| (segment.0, time));
        self.segments.extend(segments);
        self.nodes.extend(nodes.iter().map(|node| (node.0, time)));
        self.pads.extend(pads.iter().map(|node| (node.0, time)));
    }

    fn sorted(mut self) -> Self {
        for list in [&mut self.segments, &mut self.nodes, &mut self.pads] {
            list.sort_by_key(|(index, _)| *index);
        }
        self
    }

    /// Windows in seconds; one without ends where there are none.
    pub(super) fn of_windows(&self, windows: &[Window], widened: bool) -> Vec<ClosedTime> {
        let seconds = |instant: Timestamp| instant.duration_since(self.zero).as_secs_f64();
        let time = |from: Option<Timestamp>, until: Option<Timestamp>| ClosedTime {
            from_s: from.map_or(f64::NEG_INFINITY, seconds),
            until_s: until.map_or(f64::INFINITY, seconds),
            widened,
        };
        if windows.is_empty() {
            return vec![time(None, None)];
        }
        let windows = windows.iter();
        windows
            .map(|window| time(window.from(), window.until()))
            .collect()
    }

    pub(super) fn of_segment(&self, segment: SegmentIx) -> impl Iterator<Item = &ClosedTime> {
        of_index(&self.segments, segment.0)
    }

    pub(super) fn of_node(&self, node: NodeIx) -> impl Iterator<Item = &ClosedTime> {
        of_index(&self.nodes, node.0)
    }

    pub(super) fn of_pads(&self, node: NodeIx) -> impl Iterator<Item = &ClosedTime> {
        of_index(&self.pads, node.0)
    }
}

fn of_index(list: &[(u32, ClosedTime)], index: u32) -> impl Iterator<Item = &ClosedTime> {
    let first = list.partition_point(|(other, _)| *other < index);
    let there = list[first..]
        .iter()
        .take_while(move |(other, _)| *other == index);
    there.map(|(_, time)| time)
}
