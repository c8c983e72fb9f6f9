//! What is closed when, in lists by segment and node.

use crate::airspace::{Airspace, Cause, Closure, Lists, Window};
use crate::flight::TimedClosure;
use crate::network::{NodeIx, SegmentIx, Topology};
use jiff::Timestamp;
use std::sync::Arc;

/// From when until when something is closed, in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ClosedTime {
    pub(super) from_s: f64,
    pub(super) until_s: f64,
    /// Whether both ends are widened by the margins.
    pub(super) widened: bool,
}

/// A time of a closure.
#[derive(Clone, Debug)]
struct TimeOf {
    /// The id of the closure; none where it was not handed in.
    closure: Option<Arc<str>>,
    time: ClosedTime,
}

/// The closures of an airspace with their times, those included that have not begun.
#[derive(Clone, Debug)]
pub struct ClosedTimes {
    zero: Timestamp,
    segments: Lists<TimeOf>,
    nodes: Lists<TimeOf>,
    pads: Lists<TimeOf>,
}

impl ClosedTimes {
    /// The closures of an airspace, in seconds from an instant.
    pub fn of(airspace: &Airspace, zero: Timestamp) -> Self {
        let mut times = Self::none(airspace.topology(), zero);
        let closures = airspace.closures();
        times.close_for_their_windows(closures.map(|(closure, _)| closure));
        times
    }

    /// Those of another airspace on the same network, from those of this one: costs what has come and gone between the two.
    #[must_use]
    pub fn after(&self, before: &Airspace, airspace: &Airspace) -> Self {
        let mut times = self.clone();
        let changes = airspace.changes_since(before);
        let (went, came): (Vec<_>, Vec<_>) = changes.unzip();
        for closure in went.into_iter().flatten() {
            times.open(closure);
        }
        times.close_for_their_windows(came.into_iter().flatten());
        times
    }

    /// Closures whose times are known already, in seconds from an instant.
    pub fn of_timed<'a>(
        topology: &Topology,
        closures: impl IntoIterator<Item = &'a TimedClosure>,
        zero: Timestamp,
    ) -> Self {
        let mut times = Self::none(topology, zero);
        let closures = closures.into_iter().map(|closure| {
            let time = ClosedTime {
                from_s: closure.from_s,
                until_s: closure.until_s,
                widened: closure.widened,
            };
            let hits = [&closure.nodes, &closure.pads].map(|nodes| &**nodes);
            (
                TimeOf {
                    closure: None,
                    time,
                },
                &*closure.segments,
                hits,
            )
        });
        times.close(closures);
        times
    }

    fn none(topology: &Topology, zero: Timestamp) -> Self {
        Self {
            zero,
            segments: Lists::empty(topology.segment_count()),
            nodes: Lists::empty(topology.node_count()),
            pads: Lists::empty(topology.node_count()),
        }
    }

    fn close_for_their_windows<'a>(&mut self, closures: impl Iterator<Item = &'a Arc<Closure>>) {
        let mut all = Vec::new();
        for closure in closures {
            let id: Arc<str> = Arc::from(closure.id.as_str());
            let is_report = matches!(closure.cause, Cause::Report { .. });
            let is_zone = matches!(closure.cause, Cause::Zone(_));
            let windows = if is_report { &[][..] } else { &closure.windows };
            let hits = [&closure.hits.nodes, &closure.pads].map(|nodes| &**nodes);
            all.extend(self.of_windows(windows, is_zone).into_iter().map(|time| {
                let closure_id = Some(id.clone());
                let time = TimeOf {
                    closure: closure_id,
                    time,
                };
                (time, &*closure.hits.segments, hits)
            }));
        }
        self.close(all.into_iter());
    }

    fn close<'a>(
        &mut self,
        times: impl Iterator<Item = (TimeOf, &'a [SegmentIx], [&'a [NodeIx]; 2])>,
    ) {
        let (mut segments, mut nodes, mut pads) = (Vec::new(), Vec::new(), Vec::new());
        for (time, its_segments, [its_nodes, its_pads]) in times {
            segments.extend(its_segments.iter().map(|segment| (segment.0, time.clone())));
            nodes.extend(its_nodes.iter().map(|node| (node.0, time.clone())));
            pads.extend(its_pads.iter().map(|node| (node.0, time.clone())));
        }
        self.segments.add(segments);
        self.nodes.add(nodes);
        self.pads.add(pads);
    }

    fn open(&mut self, closure: &Closure) {
        let is_meant = |time: &TimeOf| time.closure.as_deref() == Some(&*closure.id);
        for segment in &closure.hits.segments {
            self.segments.remove(segment.0, is_meant);
        }
        for node in &closure.hits.nodes {
            self.nodes.remove(node.0, is_meant);
        }
        for node in &closure.pads {
            self.pads.remove(node.0, is_meant);
        }
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
        times(self.segments.of_index(segment.0))
    }

    pub(super) fn of_node(&self, node: NodeIx) -> impl Iterator<Item = &ClosedTime> {
        times(self.nodes.of_index(node.0))
    }

    pub(super) fn of_pads(&self, node: NodeIx) -> impl Iterator<Item = &ClosedTime> {
        times(self.pads.of_index(node.0))
    }
}

fn times(list: &[TimeOf]) -> impl Iterator<Item = &ClosedTime> {
    list.iter().map(|of_closure| &of_closure.time)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::airspace::Change;
    use crate::network::{Seeded, sketch};
    use jiff::SignedDuration;

    /// All times, in no order.
    fn told(times: &ClosedTimes) -> Vec<String> {
        let mut told = Vec::new();
        for (what, lists) in [&times.segments, &times.nodes, &times.pads]
            .into_iter()
            .enumerate()
        {
            for index in lists.indices().iter() {
                let there = lists.of_index(index).iter();
                told.extend(there.map(|time| format!("{what} {index} {time:?}")));
            }
        }
        told.sort();
        told
    }

    fn change(seeded: &mut Seeded, zero: Timestamp) -> Change {
        let id = format!("closure-{}", seeded.below(6));
        if seeded.below(3) == 0 {
            return Change::Lift(id);
        }
        let mut draw = |count| u32::from(seeded.below(count));
        let (node, segment) = (NodeIx(draw(3)), SegmentIx(draw(2)));
        let until = zero + SignedDuration::from_mins(i64::from(draw(60)) + 1);
        let mut closure = Closure::of_operator(id, String::new(), vec![node], vec![segment]);
        closure.pads = vec![NodeIx(draw(3))];
        closure.windows = vec![Window::new(None, Some(until)).expect("a window")];
        closure.windows.truncate(draw(2) as usize);
        Change::Put(Arc::new(closure))
    }

    #[test]
    fn times_that_follow_those_of_an_earlier_airspace_are_those_made_anew() {
        let topology = Arc::new(sketch("a.b.c", &[("a", "b"), ("b", "c")]));
        let zero = Timestamp::UNIX_EPOCH;
        let mut seeded = Seeded::new(1);
        let mut airspace = Airspace::open(topology, 1, zero, SignedDuration::ZERO);
        let mut times = ClosedTimes::of(&airspace, zero);
        for step in 0..500 {
            let changes = [0; 2].map(|_| change(&mut seeded, zero));
            let next = airspace.apply(&changes, zero + SignedDuration::from_secs(step));
            times = times.after(&airspace, &next);
            assert_eq!(told(&times), told(&ClosedTimes::of(&next, zero)), "{step}");
            airspace = next;
        }
    }
}
