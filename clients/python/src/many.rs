//! Many recompositions in one call, on all cores and without the lock of the interpreter.
//!
//! Queries are answered by destination: its table is made once, on the thread that takes it, and dropped after it. So the memory
//! does not grow with the number of destinations.

use crate::answer::pass;
use crate::question::How;
use crate::refusal::{Kind, Refusal, guarded};
use crate::world::World;
use skyway_engine::airspace::Airspace;
use skyway_engine::compose::prepare_table;
use skyway_engine::network::NodeIx;
use skyway_engine::recompose::{self, Outcome, Recomposition, Scratch, recompose};
use skyway_engine::routing::TreeCache;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Outcomes by their number in a table of answers.
pub(crate) const OUTCOMES: [Outcome; 5] = [
    Outcome::Rerouted,
    Outcome::Unaffected,
    Outcome::Hold,
    Outcome::Diverted,
    Outcome::NoRoute,
];
/// A thread takes this many queries of one destination at a time.
const PORTION: usize = 4_096;
/// More threads than this are not started, however many are asked for.
const THREADS_MAX: usize = 256;
/// A table pays from this many queries of a destination on.
const TABLE_PAYS: usize = 4;
/// Bytes for the tables of one thread: room for one, whatever it takes.
const TABLE_BYTES: usize = 512 << 20;

/// One query.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Query {
    pub(crate) leg: (NodeIx, NodeIx),
    pub(crate) destination: NodeIx,
}

/// The answers, a column for each figure; those of a query are at its place.
#[derive(Debug, Default)]
pub(crate) struct Answers {
    pub(crate) outcome: Vec<u8>,
    pub(crate) remaining_length_m: Vec<f64>,
    pub(crate) recomposed_length_m: Vec<f64>,
    pub(crate) settled_nodes: Vec<u32>,
    /// Where the path of each query begins among the nodes; one more than there are queries.
    pub(crate) offsets: Vec<u64>,
    /// Numbers of the nodes of all paths, one path after the other.
    pub(crate) nodes: Vec<u32>,
}

/// What one thread has answered.
#[derive(Default)]
struct Part {
    rows: Vec<Row>,
    nodes: Vec<u32>,
}

struct Row {
    query: usize,
    outcome: u8,
    remaining_length_m: f64,
    recomposed_length_m: f64,
    settled_nodes: u32,
    path: Range<usize>,
}

impl Part {
    fn push(&mut self, query: usize, found: &Recomposition, world: &World) {
        let begin = self.nodes.len();
        let topology = &world.ground.topology;
        self.nodes
            .extend(found.path.nodes.iter().map(|&node| topology.rank(node)));
        let outcome = OUTCOMES
            .iter()
            .position(|&outcome| outcome == found.outcome)
            .unwrap_or_default();
        self.rows.push(Row {
            query,
            outcome: outcome as u8,
            remaining_length_m: found.remaining_length_m.unwrap_or(f64::NAN),
            recomposed_length_m: found.recomposed_length_m.unwrap_or(f64::NAN),
            settled_nodes: u32::try_from(found.settled_nodes).unwrap_or(u32::MAX),
            path: begin..self.nodes.len(),
        });
    }
}

/// Queries of one destination, at most a portion: places in the order by destination.
fn portions(order: &[u32], queries: &[Query]) -> Vec<Range<usize>> {
    let mut portions = Vec::new();
    let mut begin = 0;
    for group in order.chunk_by(|&one, &other| {
        queries[one as usize].destination == queries[other as usize].destination
    }) {
        let end = begin + group.len();
        portions.extend(
            (begin..end)
                .step_by(PORTION)
                .map(|from| from..(from + PORTION).min(end)),
        );
        begin = end;
    }
    portions
}

/// What all threads look at.
struct Job<'a> {
    world: &'a World,
    airspace: &'a Airspace,
    queries: &'a [Query],
    how: &'a How,
    order: Vec<u32>,
    portions: Vec<Range<usize>>,
    taken: AtomicUsize,
}

impl Job<'_> {
    /// Takes portions until none is left.
    fn work(&self) -> Part {
        let mut part = Part::default();
        let mut scratch = Scratch::new(&self.world.ground.topology);
        let mut tables = (None, TreeCache::new(0));
        while let Some(portion) = self
            .portions
            .get(self.taken.fetch_add(1, Ordering::Relaxed))
        {
            self.answer(portion.clone(), &mut tables, &mut scratch, &mut part);
        }
        part
    }

    fn answer(
        &self,
        portion: Range<usize>,
        (held, tables): &mut (Option<NodeIx>, TreeCache),
        scratch: &mut Scratch,
        part: &mut Part,
    ) {
        let places = &self.order[portion];
        let destination = self.queries[places[0] as usize].destination;
        if *held != Some(destination) && places.len() >= TABLE_PAYS {
            *tables = TreeCache::new(TABLE_BYTES);
            *held = Some(destination);
            let world = recompose::World {
                airspace: self.airspace,
                trees: Some(tables),
            };
            prepare_table(&world, destination, scratch.searcher());
        }
        let world = recompose::World {
            airspace: self.airspace,
            trees: Some(tables),
        };
        for &place in places {
            let query = self.queries[place as usize];
            let request = self.how.request(query.leg, query.destination);
            let found = recompose(&world, &request, scratch);
            let passed = pass(self.airspace, &request, found, scratch);
            part.push(place as usize, &passed.recomposition, self.world);
        }
    }
}

/// Answers every query, on as many threads as are asked for, or fewer where there is not enough to do.
#[expect(
    clippy::disallowed_methods,
    reason = "this module is the door to all cores; the engine runs on the thread that calls it"
)]
pub(crate) fn answer_all(
    world: &World,
    airspace: &Airspace,
    queries: &[Query],
    how: &How,
    threads: usize,
) -> Result<Answers, Refusal> {
    let count = u32::try_from(queries.len()).map_err(|_| {
        let message = format!("{} queries are more than {}", queries.len(), u32::MAX);
        Refusal::new(Kind::Request, "too_many_queries", "service", message)
            .hint("ask in several calls")
    })?;
    let mut order: Vec<u32> = (0..count).collect();
    order.sort_unstable_by_key(|&place| (queries[place as usize].destination.0, place));
    let job = Job {
        world,
        airspace,
        queries,
        how,
        portions: portions(&order, queries),
        order,
        taken: AtomicUsize::new(0),
    };
    let threads = threads.clamp(1, job.portions.len().clamp(1, THREADS_MAX));
    let parts: Vec<Result<Part, Refusal>> = std::thread::scope(|scope| {
        let work = || guarded(|| job.work());
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        let own = work();
        let others = others.into_iter().filter_map(|other| other.join().ok());
        std::iter::once(own).chain(others).collect()
    });
    let parts = parts.into_iter().collect::<Result<_, _>>()?;
    Ok(joined(parts, queries.len()))
}

/// The rows of all threads, each at the place of its query.
fn joined(parts: Vec<Part>, count: usize) -> Answers {
    let mut answers = Answers {
        outcome: vec![0; count],
        remaining_length_m: vec![f64::NAN; count],
        recomposed_length_m: vec![f64::NAN; count],
        settled_nodes: vec![0; count],
        offsets: vec![0; count + 1],
        nodes: Vec::new(),
    };
    for row in parts.iter().flat_map(|part| &part.rows) {
        answers.offsets[row.query + 1] = row.path.len() as u64;
    }
    for place in 0..count {
        answers.offsets[place + 1] += answers.offsets[place];
    }
    answers.nodes = vec![0; answers.offsets[count] as usize];
    for part in &parts {
        for row in &part.rows {
            answers.outcome[row.query] = row.outcome;
            answers.remaining_length_m[row.query] = row.remaining_length_m;
            answers.recomposed_length_m[row.query] = row.recomposed_length_m;
            answers.settled_nodes[row.query] = row.settled_nodes;
            let begin = answers.offsets[row.query] as usize;
            answers.nodes[begin..begin + row.path.len()]
                .copy_from_slice(&part.nodes[row.path.clone()]);
        }
    }
    answers
}
