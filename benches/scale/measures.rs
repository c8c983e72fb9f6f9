//! What is measured at one size, in the order of the table.

use crate::loading;
use crate::oracle::{Peer, assert_same};
use crate::percentiles::Percentiles;
use crate::workload::{Workload, at, standing};
use skyway::airspace::{Change, Closed, Hits, RequestClosures};
use skyway::network::{Generated, Joining, NetworkDraft, Topology};
use skyway::recompose::{Scratch, World, recompose};
use skyway::routing::{Baseline, DestinationTree, Searcher};
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

pub(crate) const MAX_NEIGHBOURS: usize = 10;
/// Answers that are checked against petgraph's Dijkstra, which takes its time.
const CHECKED: usize = 25;
/// Ways around a zone with a table of their own that has the zone worked in.
const TAKEN_IN: usize = 25;
/// Bytes that the tables of an edge may take by default.
const DEFAULT_TABLE_BYTES: usize = 256 << 20;

/// The rows of the table; [`Figures::cells`] has their values in this order.
pub(crate) const ROWS: [&str; 23] = [
    "segments",
    "generating",
    "building from a draft",
    "GeoJSON, size",
    "GeoJSON, loading",
    "GeoJSON, most memory while loading",
    "CSV, size",
    "CSV, loading",
    "memory once loaded, per segment",
    "a table: building",
    "a table: bytes",
    "tables that fit into the default 256 MiB",
    "exact, table in memory, search alone, p50 / p99",
    "exact, table in memory, whole recomposition, p50 / p99",
    "exact, no table, whole recomposition, p50 / p99",
    "compact Dijkstra, p50 / p99",
    "1 % zone: finding what it closes, p50 / p99",
    "1 % zone: applying it, p50 / p99",
    "1 % zone: lifting it, p50 / p99",
    "1 % zone: taking it into a table, p50 / p99",
    "exact around the zone, table with the zone taken in, p50 / p99",
    "exact around the zone, table without it, p50 / p99",
    "exact around the zone, no table, p50 / p99",
];

/// A line of the picture: medians over sizes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Line {
    Dijkstra,
    Table,
    NoTable,
    Zone,
    Recomposition,
    Search,
}

/// What one size came to.
pub(crate) struct Figures {
    pub(crate) nodes: usize,
    /// By row, as text.
    pub(crate) cells: Vec<String>,
    /// Medians in microseconds.
    pub(crate) lines: Vec<(Line, f64)>,
}

impl Figures {
    /// Measures one size, with files in a folder.
    pub(crate) fn measure(nodes: usize, destinations: usize, folder: &Path) -> io::Result<Self> {
        let mut figures = Self {
            nodes,
            cells: Vec::new(),
            lines: Vec::new(),
        };
        figures.measure_loading(nodes, folder)?;
        let workload = Workload::new(nodes, destinations);
        check(&workload);
        figures.measure_tables(&workload);
        figures.measure_failures(&workload);
        figures.measure_changes(&workload);
        figures.measure_passages(&workload);
        Ok(figures)
    }

    fn tell(&mut self, text: String) {
        self.cells.push(text);
    }

    fn tell_times(&mut self, times: &Percentiles) {
        let [p50, p99] = [0.5, 0.99].map(|share| duration(times.at_us(share)));
        self.tell(format!("{p50} / {p99}"));
    }

    fn draw(&mut self, line: Line, times: &Percentiles) {
        self.lines.push((line, times.at_us(0.5)));
    }

    fn measure_loading(&mut self, nodes: usize, folder: &Path) -> io::Result<()> {
        let begun = Instant::now();
        let draft = draft_of(nodes);
        let generating_s = begun.elapsed().as_secs_f64();
        let segments = draft.segments.len();
        let geojson = loading::from_geojson(&draft, folder)?;
        let csv = loading::from_csv(&draft, folder)?;
        let begun = Instant::now();
        let topology = Topology::build(draft, [0; 32]).expect("a generated network is valid");
        let building_s = begun.elapsed().as_secs_f64();
        drop(topology);
        self.tell(grouped(segments));
        self.tell(duration(generating_s * 1e6));
        self.tell(duration(building_s * 1e6));
        self.tell(bytes(geojson.file_bytes as f64));
        self.tell(duration(geojson.seconds * 1e6));
        self.tell(bytes(geojson.peak_bytes));
        self.tell(bytes(csv.file_bytes as f64));
        self.tell(duration(csv.seconds * 1e6));
        let per_segment = geojson.resident_bytes / segments as f64;
        self.tell(format!("{per_segment:.0} bytes"));
        Ok(())
    }

    fn measure_tables(&mut self, workload: &Workload) {
        let mut searcher = Searcher::new(&workload.topology);
        let some = workload.destinations.len().min(10);
        let building = Percentiles::of(some, |index| {
            searcher.tree(&workload.topology, workload.destinations[index])
        });
        let first = workload.destinations[0];
        let tree = searcher.tree(&workload.topology, first);
        self.tell(duration(building.at_us(0.5)));
        self.tell(bytes(tree.bytes() as f64));
        self.tell(grouped(DEFAULT_TABLE_BYTES / tree.bytes()));
        self.draw(Line::Table, &building);
    }

    fn measure_failures(&mut self, workload: &Workload) {
        let failures = &workload.failures;
        let mut searcher = Searcher::new(&workload.topology);
        let mut scratch = Scratch::new(&workload.topology);
        let mut closures = RequestClosures::new(&workload.topology);
        let search = Percentiles::of(failures.len(), |index| {
            let destination = failures[index].request.report.destination;
            let tree = workload.trees.get(destination, standing(&workload.open))?;
            let closed = closing(workload, index, &mut closures);
            searcher.exact(&closed, &[at(failures[index].leg.0)], &tree)
        });
        let world = workload.open_world();
        let warm = Percentiles::of(failures.len(), |index| {
            recompose(&world, &failures[index].request, &mut scratch)
        });
        let cold_world = World {
            trees: None,
            ..world
        };
        let cold = Percentiles::of(failures.len(), |index| {
            recompose(&cold_world, &failures[index].request, &mut scratch)
        });
        // A hundred are enough: it takes hundreds of milliseconds at the largest size.
        let dijkstra = Percentiles::of(failures.len().min(100), |index| {
            let goal = failures[index].request.report.destination;
            let closed = closing(workload, index, &mut closures);
            let start = [at(failures[index].leg.0)];
            let dijkstra = Baseline::Dijkstra { full_tree: false };
            searcher.shortest(&closed, &start, goal, dijkstra, None)
        });
        for (line, times) in [
            (Line::Search, &search),
            (Line::Recomposition, &warm),
            (Line::NoTable, &cold),
            (Line::Dijkstra, &dijkstra),
        ] {
            self.tell_times(times);
            self.draw(line, times);
        }
    }

    fn measure_changes(&mut self, workload: &Workload) {
        let zones = &workload.zones;
        let hits = Percentiles::of(zones.len(), |index| {
            zones[index]
                .zone()
                .map(|zone| Hits::of(&workload.topology, zone))
        });
        let now = workload.open.as_of();
        let applying = Percentiles::of(zones.len(), |index| {
            let change = Change::Put(zones[index].clone());
            workload.open.apply(&[change], now)
        });
        let lifting = Percentiles::of(zones.len(), |index| {
            let change = Change::Lift(zones[index].id.clone());
            workload.airspaces[index].apply(&[change], now)
        });
        for times in [&hits, &applying, &lifting] {
            self.tell_times(times);
        }
    }

    fn measure_passages(&mut self, workload: &Workload) {
        let passages = Passages::new(workload);
        let mut searcher = Searcher::new(&workload.topology);
        let count = passages.count();
        let some = count.min(TAKEN_IN);
        if some == 0 {
            for _ in 0..4 {
                self.tell("-".to_owned());
            }
            return;
        }
        let taking = Percentiles::of(some, |index| passages.repaired(index, &mut searcher));
        let trees: Vec<DestinationTree> = (0..some)
            .map(|index| passages.repaired(index, &mut searcher))
            .collect();
        let after = Percentiles::of(some, |index| {
            passages.length_m(index, Some(&trees[index]), &mut searcher)
        });
        let first = Percentiles::of(count, |index| {
            let intact = passages.intact(index);
            passages.length_m(index, intact.as_deref(), &mut searcher)
        });
        let without = Percentiles::of(count, |index| passages.length_m(index, None, &mut searcher));
        for times in [&taking, &after, &first, &without] {
            self.tell_times(times);
        }
        self.draw(Line::Zone, &after);
    }
}

/// Ways through zones that stand.
struct Passages<'a> {
    workload: &'a Workload,
    nothing: RequestClosures,
}

impl<'a> Passages<'a> {
    fn new(workload: &'a Workload) -> Self {
        let nothing = RequestClosures::new(&workload.topology);
        Self { workload, nothing }
    }

    fn count(&self) -> usize {
        self.workload.passages.len()
    }

    fn closed(&self, index: usize) -> Closed<'_> {
        let airspace = &self.workload.airspaces[self.workload.passages[index].zone];
        Closed::new(&self.workload.topology, airspace.closed(), &self.nothing)
    }

    fn intact(&self, index: usize) -> Option<Arc<DestinationTree>> {
        let destination = self.workload.passages[index].destination;
        let world = standing(&self.workload.open);
        self.workload.trees.get(destination, world)
    }

    fn repaired(&self, index: usize, searcher: &mut Searcher) -> DestinationTree {
        let intact = self.intact(index).expect("every destination has its table");
        let airspace = &self.workload.airspaces[self.workload.passages[index].zone];
        let blocked = airspace.closed().blocked_segments();
        searcher.tree_taking_in(&intact, &self.closed(index), blocked)
    }

    /// By the table, else by A*.
    fn length_m(
        &self,
        index: usize,
        tree: Option<&DestinationTree>,
        searcher: &mut Searcher,
    ) -> Option<f64> {
        let passage = &self.workload.passages[index];
        let (closed, start) = (self.closed(index), [at(passage.source)]);
        let arrival = match tree {
            Some(tree) => searcher.exact(&closed, &start, tree),
            None => {
                let goal = passage.destination;
                searcher.shortest(&closed, &start, goal, Baseline::AStar, None)
            }
        };
        arrival.map(|arrival| arrival.length_m)
    }
}

fn closing<'a>(
    workload: &'a Workload,
    index: usize,
    closures: &'a mut RequestClosures,
) -> Closed<'a> {
    let (from, to) = workload.failures[index].leg;
    closures.reset();
    if let Some(segment) = workload.topology.segment_between(from, to) {
        closures.close_segment(segment, workload.open.closed());
    }
    Closed::new(&workload.topology, workload.open.closed(), closures)
}

/// Warm and cold, around a failure and around a zone: as long as petgraph's Dijkstra finds it.
fn check(workload: &Workload) {
    let peer = Peer::new(&workload.topology);
    let mut scratch = Scratch::new(&workload.topology);
    let mut closures = RequestClosures::new(&workload.topology);
    let warm = workload.open_world();
    let cold = World {
        trees: None,
        ..warm
    };
    for (index, failure) in workload.failures.iter().take(CHECKED).enumerate() {
        let closed = closing(workload, index, &mut closures);
        let destination = failure.request.report.destination;
        let oracle_m = peer.dijkstra_m(&closed, failure.leg.0, destination);
        for (what, world) in [("with a table", &warm), ("without one", &cold)] {
            let answer = recompose(world, &failure.request, &mut scratch);
            assert_same(what, answer.remaining_length_m, oracle_m);
        }
    }
    let passages = Passages::new(workload);
    let mut searcher = Searcher::new(&workload.topology);
    for (index, passage) in workload.passages.iter().take(CHECKED).enumerate() {
        let closed = passages.closed(index);
        let oracle_m = peer.dijkstra_m(&closed, passage.source, passage.destination);
        let repaired = passages.repaired(index, &mut searcher);
        let intact = passages.intact(index);
        for tree in [Some(&repaired), intact.as_deref(), None] {
            let ours_m = passages.length_m(index, tree, &mut searcher);
            assert_same("around a zone", ours_m, oracle_m);
        }
    }
}

fn draft_of(nodes: usize) -> NetworkDraft {
    let generated = Generated {
        nodes,
        max_neighbours: MAX_NEIGHBOURS,
        map_size_m: 10_000.0,
        reach_fraction: 0.3,
        joining: Joining::Nearest,
        seed: 1,
    };
    generated.network().expect("the parameters are Table 1's")
}

/// A time as a person would write it.
pub(crate) fn duration(us: f64) -> String {
    match us {
        us if us < 1e3 => format!("{} µs", three_digits(us)),
        us if us < 1e6 => format!("{} ms", three_digits(us / 1e3)),
        us => format!("{} s", three_digits(us / 1e6)),
    }
}

fn bytes(count: f64) -> String {
    match count {
        count if count < 1e6 => format!("{} kB", three_digits(count / 1e3)),
        count if count < 1e9 => format!("{} MB", three_digits(count / 1e6)),
        count => format!("{} GB", three_digits(count / 1e9)),
    }
}

fn three_digits(number: f64) -> String {
    match number {
        number if number < 10.0 => format!("{number:.2}"),
        number if number < 100.0 => format!("{number:.1}"),
        number => format!("{number:.0}"),
    }
}

/// A count with a comma after every three digits.
pub(crate) fn grouped(count: usize) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
