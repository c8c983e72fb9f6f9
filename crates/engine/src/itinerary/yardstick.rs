//! A piece of work that always is the same: what a search can do in a second is how many checks of
//! it a core does.

use super::memory::ItineraryScratch;
use super::potentials::Potentials;
use super::request::{FlightRequest, Limits, Objective};
use super::search::find;
use super::setting::FlightSetting;
use crate::flight::{
    Airframe, FlightRules, FlightStart, Reservation, Situation, TrafficLeg, WindField,
};
use crate::network::{
    NetworkDraft, NetworkError, NodeDraft, NodeIx, SegmentDraft, SegmentIx, Topology,
};

/// The network is a square of so many nodes each way.
const SIDE: usize = 8;
const APART_M: f64 = 400.0;
/// Others enter each segment so often, in seconds.
const EVERY_S: f64 = 180.0;
const UNTIL_S: f64 = 3_600.0;

/// Requests among the plans of others on a small network.
#[derive(Debug)]
pub struct Yardstick {
    setting: FlightSetting,
    tables: Vec<Potentials>,
}

impl Yardstick {
    /// Makes it ready; that is no part of the work.
    ///
    /// # Errors
    /// None: the network is valid.
    pub fn new() -> Result<Self, Vec<NetworkError>> {
        let topology = Topology::build(square(), [0; 32])?;
        let situation = others(&topology);
        let setting = FlightSetting::new(
            topology.into(),
            Airframe::phantom3(),
            0.0,
            WindField::default(),
            FlightRules::default(),
            &situation,
        );
        let last = NodeIx((SIDE * SIDE - 1) as u32);
        let tables = [Objective::Distance, Objective::Time];
        Ok(Self {
            tables: tables
                .map(|objective| setting.potentials(last, objective))
                .into(),
            setting,
        })
    }

    /// Does the work once, which takes about a millisecond. Gives the checks that it took: always
    /// as many.
    pub fn run(&self) -> usize {
        let mut checks = 0;
        // What one search keeps for the next would count as speed, which those have not that are the first to look at a place.
        let mut scratch = ItineraryScratch::new(self.setting.topology());
        for table in &self.tables {
            for number in 0..SIDE {
                let start = FlightStart {
                    node: NodeIx(number as u32),
                    at_s: 60.0 * number as f64,
                    battery: 0.6,
                    on_ground: true,
                    pad: None,
                    flown_m: 0.0,
                    drawn: 0.0,
                    stretch: None,
                };
                let request = FlightRequest {
                    starts: &[start],
                    destination: table.destination(),
                    objective: table.objective(),
                    began_s: start.at_s,
                    deadline_s: 2.0 * UNTIL_S,
                    reserve: self.setting.rules().reserve,
                    closed_segments: &[],
                    limits: Limits::within(0.005, Limits::CHECKS_PER_S),
                };
                let answer = find(&self.setting.world(), &request, table, &mut scratch);
                checks += answer.effort.checks;
            }
        }
        checks
    }
}

/// Nodes of a square, each joined to its neighbours; every other one has a pad.
fn square() -> NetworkDraft {
    let id = |row: usize, column: usize| format!("{row}-{column}");
    let mut draft = NetworkDraft {
        name: "yardstick".to_owned(),
        ..NetworkDraft::default()
    };
    for (row, column) in (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| (row, column))) {
        // No two ways are equally long.
        let shift_m = ((row * 7 + column * 13) % 11) as f64;
        draft.nodes.push(NodeDraft {
            id: id(row, column),
            position: [
                APART_M * column as f64 + shift_m,
                APART_M * row as f64 - shift_m,
            ],
            pads: ((row + column) % 2) as u16,
            ..NodeDraft::default()
        });
        let next = [(row + 1, column), (row, column + 1)];
        for (row_to, column_to) in next.into_iter().filter(|to| to.0 < SIDE && to.1 < SIDE) {
            draft.segments.push(SegmentDraft {
                from: id(row, column),
                to: id(row_to, column_to),
                ..SegmentDraft::default()
            });
        }
    }
    draft
}

/// Others on every segment in turn, and on every pad.
fn others(topology: &Topology) -> Situation {
    let mut situation = Situation::default();
    let times = |offset: usize| {
        let first_s = EVERY_S * (offset % 5) as f64 / 5.0;
        let count = (UNTIL_S / EVERY_S) as usize;
        (0..count).map(move |number| first_s + EVERY_S * number as f64)
    };
    for segment in 0..topology.segment_count() {
        let ends = topology.segment(SegmentIx(segment as u32));
        situation
            .traffic
            .extend(times(segment).map(|enters_s| TrafficLeg {
                segment: SegmentIx(segment as u32),
                from: if segment % 2 == 0 { ends.from } else { ends.to },
                enters_s,
                leaves_s: enters_s + 40.0,
            }));
    }
    for node in topology.nodes().filter(|&node| topology.pads(node) > 0) {
        situation
            .reservations
            .extend(times(node.at()).map(|from_s| Reservation {
                node,
                pad: 0,
                from_s,
                until_s: from_s + 0.4 * EVERY_S,
            }));
    }
    situation
}

#[cfg(test)]
mod tests {
    use super::Yardstick;

    #[test]
    fn it_always_takes_as_many_checks() {
        let yardstick = Yardstick::new().expect("a valid network");
        let checks = yardstick.run();
        assert!(checks > 20_000, "{checks}");
        assert_eq!(yardstick.run(), checks);
    }
}
