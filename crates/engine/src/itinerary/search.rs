//! The search over position, time and battery, in three steps from cheap to certain.

use super::expander::Expander;
use super::joined::tables_of_open_legs;
use super::label::How;
use super::memory::ItineraryScratch;
use super::potentials::Potentials;
use super::request::{
    Effort, FlightAnswer, FlightRequest, FlightWorld, Step, Unproved, Value, close, reopen,
};
use super::rounds::{Most, is_last_of_few};
use super::run::{Goal, Mode, Run, RunEnd};
use super::trace::plan;
use super::walk::{Along, From, append_steps, walk};

/// Of labels and checks, each of the first two steps may take one part in so many.
const STEP_SHARE: usize = 4;
/// Labels of a first try of the second step: around one closure the way is found with a few, and often nothing was dropped
/// that could be better.
const PROBE_LABELS: usize = 64;
/// It takes at most one check in so many.
const PROBE_SHARE: usize = 8;
/// Tables on the legs that closures leave open take as long as some labels for each node: first a part of them is tried, one
/// for so many nodes.
const NODES_PER_LABEL: usize = 8;

/// Finds the best plan of a request.
///
/// The potentials are those of the request's destination and objective, on the same table of legs. Never fails: where there is no
/// plan the answer has none, and says whether that is certain.
pub fn find(
    world: &FlightWorld<'_>,
    request: &FlightRequest<'_>,
    potentials: &Potentials,
    scratch: &mut ItineraryScratch,
) -> FlightAnswer {
    debug_assert!(
        potentials.destination() == request.destination
            && potentials.objective() == request.objective
    );
    scratch.begin(world.topology);
    scratch.active.forget_met();
    close(&mut scratch.closed, request.closed_segments);
    let on_open_legs;
    let mut search = Search::new(Expander::new(world, request, potentials), scratch);
    let mut tried = search.first_tries();
    if tried == Tried::Unsettled {
        tried = search.hovers_briefly();
    }
    if tried == Tried::Unsettled {
        let tables = tables_of_open_legs(&search.terms, &search.scratch.closed);
        if let Some(tables) = tables {
            on_open_legs = tables;
            search.terms = Expander::new(world, request, &on_open_legs);
            tried = Tried::Nothing;
        }
    }
    let answer = search.rounds(tried);
    reopen(&mut scratch.closed, request.closed_segments);
    answer
}

/// Plain label-setting with exact dominance: no potentials but reachability, no walks, no steps before. The
/// baseline to measure against.
pub fn find_plainly(
    world: &FlightWorld<'_>,
    request: &FlightRequest<'_>,
    potentials: &Potentials,
    scratch: &mut ItineraryScratch,
) -> FlightAnswer {
    scratch.begin(world.topology);
    close(&mut scratch.closed, request.closed_segments);
    let blind = potentials.blind();
    let mut search = Search::new(Expander::new(world, request, &blind), scratch);
    search.step = Step::Exact;
    search.scratch.active.widen();
    search.scratch.best.clear();
    if !search.is_there() {
        search.exact(false);
    }
    let answer = search.answer();
    scratch.active.clear();
    reopen(&mut scratch.closed, request.closed_segments);
    answer
}

struct Search<'a, 's> {
    terms: Expander<'a>,
    scratch: &'s mut ItineraryScratch,
    effort: Effort,
    /// The value of the plan in the scratch's `best`.
    best: Value,
    /// No plan is better.
    bound: Value,
    /// Nor than this, by what was found where fewer others counted.
    least: Value,
    step: Step,
    reason: Option<Unproved>,
    most: Most,
}

/// What of a round's cheap steps has been done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tried {
    Nothing,
    /// They have not found what is certainly the best.
    Unsettled,
    /// Nor has the relaxation, to its end.
    Hovered,
    Settled,
}

/// How the relaxation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Hovering {
    Settles,
    /// With a bound.
    Ends,
    /// At its limit.
    IsStopped,
}

impl<'a, 's> Search<'a, 's> {
    fn new(terms: Expander<'a>, scratch: &'s mut ItineraryScratch) -> Self {
        Self {
            scratch,
            effort: Effort::default(),
            best: Value::NONE,
            bound: Value::LEAST,
            least: Value::LEAST,
            step: Step::Walk,
            reason: None,
            most: Most::of(terms.request.limits),
            terms,
        }
    }

    /// The cheap steps of the first round: where they settle nothing, it is certain that some way is open at some time.
    fn first_tries(&mut self) -> Tried {
        match self.tries() {
            Tried::Unsettled if !self.is_joined() => self.settled(Step::Hovering),
            tried => tried,
        }
    }

    /// The relaxation as far as new tables are not cheaper.
    fn hovers_briefly(&mut self) -> Tried {
        let nodes = self.terms.world.topology.node_count();
        match self.hovering(PROBE_LABELS.max(nodes / NODES_PER_LABEL)) {
            Hovering::Settles => self.settled(Step::Hovering),
            Hovering::Ends => Tried::Hovered,
            Hovering::IsStopped => Tried::Unsettled,
        }
    }

    /// Searches among those others only that a plan has met, until one meets no more.
    ///
    /// The best plan of all is one of each round: so it is no better than what a round finds, and what meets
    /// no others is the best.
    fn rounds(&mut self, mut tried: Tried) -> FlightAnswer {
        let world = self.terms.world;
        let limits = self.terms.request.limits;
        let mut round = 1;
        loop {
            if tried == Tried::Nothing {
                tried = self.tries();
            }
            match tried {
                Tried::Unsettled => self.searches(),
                Tried::Hovered => self.searches_after_hovering(),
                Tried::Nothing | Tried::Settled => {}
            }
            let answer = self.answer();
            let active = &mut self.scratch.active;
            if !answer
                .plan
                .as_ref()
                .is_some_and(|plan| world.activate_met(active, plan))
            {
                active.clear();
                return answer;
            }
            self.least = answer.lower_bound;
            if is_last_of_few(round, self.effort, limits) {
                active.widen();
            }
            round += 1;
            tried = Tried::Nothing;
        }
    }

    fn begin_round(&mut self) {
        let is_last = self.scratch.active.is_everywhere() || !self.terms.world.keeps_apart();
        self.most = Most::in_round(self.terms.request.limits, is_last, self.effort);
        self.best = Value::NONE;
        self.bound = Value::LEAST;
        self.step = Step::Walk;
        self.reason = None;
        self.scratch.best.clear();
    }

    /// Begins a round with what is cheap and most often settles it.
    fn tries(&mut self) -> Tried {
        self.begin_round();
        if self.is_there() || self.walk_from_starts() {
            return self.settled(Step::Walk);
        }
        // Which others count makes no difference.
        let is_first = self.least == Value::LEAST;
        if is_first && !self.has_open_legs() {
            return self.settled(Step::Hovering);
        }
        if self.earlier(PROBE_LABELS, PROBE_SHARE) {
            return self.settled(Step::Earlier);
        }
        Tried::Unsettled
    }

    /// What has been found is the best, or there certainly is no plan.
    fn settled(&mut self, step: Step) -> Tried {
        self.step = step;
        self.bound = self.best;
        Tried::Settled
    }

    /// What the cheap steps have not settled.
    fn searches(&mut self) {
        self.step = Step::Hovering;
        match self.hovering(self.terms.request.limits.labels / STEP_SHARE) {
            Hovering::Settles => self.bound = self.best,
            Hovering::Ends | Hovering::IsStopped => self.searches_after_hovering(),
        }
    }

    fn searches_after_hovering(&mut self) {
        self.step = Step::Earlier;
        if self.earlier(self.terms.request.limits.labels / STEP_SHARE, STEP_SHARE) {
            self.bound = self.best;
            return;
        }
        self.step = Step::Exact;
        self.exact(true);
    }

    fn is_met(&self) -> bool {
        !self.bound.beats(self.best)
    }

    /// A drone that stands at its destination has arrived; true where that is certainly the best.
    fn is_there(&mut self) -> bool {
        let request = self.terms.request;
        for (number, start) in request.starts.iter().take(super::MAX_STARTS).enumerate() {
            let stands_there = start.on_ground && start.node == request.destination;
            if !stands_there || start.at_s > request.deadline_s {
                continue;
            }
            let value = Value {
                weight: self.terms.start_weight(start),
                arrives_s: start.at_s,
            };
            if value.beats(self.best) {
                self.best = value;
                self.scratch.best.clear();
                self.scratch.best.push(How::Start(number as u8));
            }
        }
        // Where it could also fly a while and come back, it would be later and no lighter.
        request.starts.len() == 1 && self.best != Value::NONE
    }

    /// Walks down the tree from every start; true where that is certainly the best.
    fn walk_from_starts(&mut self) -> bool {
        let mut left = Value::LEAST;
        let mut is_certain = true;
        let starts = self.terms.request.starts;
        for (number, start) in starts.iter().take(super::MAX_STARTS).enumerate() {
            let how = How::Start(number as u8);
            let (family, swapped) = self.terms.start(start);
            let key = self.terms.key(&family, start.node);
            is_certain &= swapped.is_none();
            if !key.weight.is_finite() {
                continue;
            }
            self.effort.walks += 1;
            let from = From {
                family: &family,
                node: start.node,
                how,
            };
            let checks = &mut self.effort.checks;
            let end = walk(
                &self.terms,
                from,
                Along::Tree,
                self.best,
                self.scratch,
                checks,
            );
            let is_only_way = self.terms.potentials.is_only_way(start.node);
            let is_settled = end.is_some_and(|end| {
                let is_lightest = is_only_way && end.is_complete && end.value.weight == key.weight;
                is_lightest || !key.beats(end.value)
            });
            if let Some(end) = end.filter(|end| end.value.beats(self.best)) {
                self.best = end.value;
                self.scratch.best.clear();
                self.scratch.best.push(how);
                append_steps(&self.scratch.walked, end.last, &mut self.scratch.best);
            }
            // A start that the walk has not settled must not be able to do better.
            if !is_settled && (left == Value::LEAST || key.beats(left)) {
                left = key;
            }
        }
        is_certain && self.best != Value::NONE && (left == Value::LEAST || !left.beats(self.best))
    }

    /// False where a start or the destination is enclosed by closures, so that there certainly is no plan.
    fn has_open_legs(&mut self) -> bool {
        let ItineraryScratch {
            both_ends, closed, ..
        } = &mut *self.scratch;
        self.best != Value::NONE || both_ends.have_open_legs(&self.terms, closed)
    }

    /// False where it is certain that no way leads to the destination.
    fn is_joined(&mut self) -> bool {
        if self.best != Value::NONE {
            return true;
        }
        let ItineraryScratch {
            both_ends, closed, ..
        } = &mut *self.scratch;
        both_ends.meet(&self.terms, closed, &mut self.effort.checks)
    }

    /// The relaxation with so many labels, and its plan held against the windows.
    fn hovering(&mut self, labels: usize) -> Hovering {
        let labels = (self.effort.labels + labels).min(self.most.labels);
        let mut run = self.run(Mode::Hovering, labels, STEP_SHARE, true);
        let end = run.search();
        let (relaxed, improved, may_tie) = (run.best, run.improved, run.may_tie);
        // Stopped early, the run may have been looking at later plans of the weight it has found.
        self.bound = match end.stopped_by {
            Some(_) if end.bound.beats(relaxed) => end.bound,
            _ => relaxed,
        };
        let is_stopped = end.stopped_by.is_some();
        let unless_stopped = |is_settled: bool| match is_settled {
            _ if is_stopped => Hovering::IsStopped,
            true => Hovering::Settles,
            false => Hovering::Ends,
        };
        if !improved {
            return unless_stopped(true);
        }
        let end_of_walk = self.walk_relaxed();
        let is_only_way = !may_tie && self.terms.is_weighed();
        let is_settled = is_only_way && end_of_walk == Some((relaxed.weight, true));
        unless_stopped(is_settled || self.is_met())
    }

    /// Walks the relaxation's way with all windows; the weight of the best plan on it, and whether none was left out.
    fn walk_relaxed(&mut self) -> Option<(f64, bool)> {
        let relaxed = std::mem::take(&mut self.scratch.relaxed);
        let mut route = std::mem::take(&mut self.scratch.route);
        route.clear();
        route.extend(relaxed.iter().filter_map(|how| match how {
            How::Leg { leg, .. } => Some(*leg),
            How::Start(_) | How::Stop { .. } => None,
        }));
        let mut found = None;
        if let Some(&How::Start(number)) = relaxed.first() {
            let start = &self.terms.request.starts[usize::from(number)];
            let (family, swapped) = self.terms.start(start);
            let from = From {
                family: &family,
                node: start.node,
                how: How::Start(number),
            };
            let checks = &mut self.effort.checks;
            let along = Along::Legs(&route);
            let end = walk(&self.terms, from, along, self.best, self.scratch, checks);
            if let Some(end) = end {
                if end.value.beats(self.best) {
                    self.best = end.value;
                    self.scratch.best.clear();
                    self.scratch.best.push(How::Start(number));
                    append_steps(&self.scratch.walked, end.last, &mut self.scratch.best);
                }
                found = Some((end.value.weight, end.is_complete && swapped.is_none()));
            }
        }
        self.scratch.relaxed = relaxed;
        self.scratch.route = route;
        found
    }

    /// The search for which earlier is better; true where its plan is certainly the best.
    fn earlier(&mut self, labels: usize, share: usize) -> bool {
        let labels = (self.effort.labels + labels).min(self.most.labels);
        let mut run = self.run(Mode::Earlier, labels, share, true);
        let end = run.search();
        let (best, doubt) = (run.best, run.doubt);
        self.best = best;
        let is_certain = end.stopped_by.is_none() && !doubt.beats(best);
        is_certain || self.is_met()
    }

    fn exact(&mut self, walks: bool) {
        let mut run = self.run(Mode::Exact, self.most.labels, 1, walks);
        let RunEnd { bound, stopped_by } = run.search();
        self.best = run.best;
        self.reason = stopped_by;
        self.bound = match stopped_by {
            None => self.best,
            Some(_) if self.bound.beats(bound) => bound,
            Some(_) => self.bound,
        };
        if self.is_met() {
            self.reason = None;
        }
    }

    /// A run that may go on to a number of labels in all, and for one part in so many of the checks.
    fn run(&mut self, mode: Mode, most_labels: usize, share: usize, walks: bool) -> Run<'_, '_> {
        let checks = self.terms.request.limits.checks;
        let most_checks = (self.effort.checks + checks / share).min(self.most.checks);
        Run {
            terms: self.terms,
            mode,
            goal: Goal::Destination,
            scratch: self.scratch,
            effort: &mut self.effort,
            best: self.best,
            improved: false,
            doubt: Value::NONE,
            may_tie: false,
            target: match mode {
                Mode::Hovering => Value::LEAST,
                Mode::Earlier | Mode::Exact => self.bound,
            },
            most_labels,
            most_checks,
            walks,
        }
    }

    fn answer(&mut self) -> FlightAnswer {
        let found = self.best != Value::NONE;
        FlightAnswer {
            plan: found.then(|| plan(&self.terms, &self.scratch.best, self.best)),
            value: self.best,
            proved: self.reason.is_none(),
            lower_bound: match self.reason {
                None => self.best,
                Some(_) if self.bound.beats(self.least) => self.least,
                Some(_) => self.bound,
            },
            reason: self.reason,
            step: self.step,
            effort: self.effort,
        }
    }
}
