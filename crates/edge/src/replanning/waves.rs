//! Waves: plans that are looked at on one published state by threads beside the writer, which commits what they find.
//!
//! What comes of a wave does not depend on how many threads work on it: all look at the same state, and the writer commits in
//! the order of the wave. A finding that what came between has overtaken is not committed; its plan is in a later wave.

use super::Task;
use crate::background::{Background, begin_turn, cores, give_way};
use crate::drones::{Drones, progress};
use crate::planner::{Planner, Version};
use crate::plans::entry::PlanEntry;
use crate::plans::fleet::{self, Detour, DetourMeans};
use crate::snapshot::Snapshot;
use jiff::Timestamp;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

/// At most this many plans are in a wave, so that what closes next does not wait long for its plans.
pub(crate) const WAVE_SIZE: usize = 32;
/// And of those whose contingencies are worked out, which takes longer, so that a plan that is met never waits for many.
pub(crate) const CONTINGENCIES_AT_ONCE: usize = 2;
/// More threads than this find nothing to do in a wave.
const THREADS_MAX: usize = 8;

/// What is to be found out about a plan.
#[derive(Clone, Debug)]
pub(crate) enum Job {
    /// What its drone is to fly instead, if anything.
    Replan(Task),
    /// What its drone does on legs that close.
    Contingencies(Arc<str>),
}

/// What was found.
#[derive(Debug)]
pub(crate) enum Finding {
    /// There was nothing to work out.
    Nothing,
    Detour(Box<Detour>),
    /// The versions that lacked contingencies, with them.
    Contingencies(Vec<Version>),
}

/// What plans are looked at with.
#[derive(Clone, Debug)]
pub(crate) struct Means {
    pub(crate) planner: Arc<dyn Planner>,
    pub(crate) drones: Arc<Drones>,
}

/// Plans that are looked at on one state.
#[derive(Debug)]
pub(crate) struct Wave {
    pub(crate) snapshot: Arc<Snapshot>,
    now: Timestamp,
    jobs: Vec<Job>,
    findings: Vec<Mutex<Option<Finding>>>,
    next: AtomicUsize,
    left: AtomicUsize,
}

impl Wave {
    pub(crate) fn new(snapshot: Arc<Snapshot>, now: Timestamp, jobs: Vec<Job>) -> Self {
        Self {
            snapshot,
            now,
            findings: jobs.iter().map(|_| Mutex::new(None)).collect(),
            next: AtomicUsize::new(0),
            left: AtomicUsize::new(jobs.len()),
            jobs,
        }
    }

    pub(crate) fn jobs(&self) -> &[Job] {
        &self.jobs
    }

    /// Whether it is about what drones are to fly, and not about contingencies.
    pub(crate) fn replans(&self) -> bool {
        matches!(self.jobs.first(), Some(Job::Replan(_)))
    }

    /// What was found for a job, once; none where the look at its plan has failed.
    pub(crate) fn take(&self, number: usize) -> Option<Finding> {
        let finding = self.findings.get(number)?;
        finding
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take()
    }

    /// Works on jobs until none is left; true for the thread that ends the last one.
    pub(crate) fn work(&self, means: &Means) -> bool {
        let mut was_last = false;
        loop {
            let number = self.next.fetch_add(1, Ordering::Relaxed);
            let Some(job) = self.jobs.get(number) else {
                return was_last;
            };
            // A plan that cannot be looked at must not keep the others waiting.
            let found = catch_unwind(AssertUnwindSafe(|| self.find(job, means)));
            if let (Ok(found), Some(place)) = (found, self.findings.get(number)) {
                *place.lock().unwrap_or_else(PoisonError::into_inner) = Some(found);
            }
            was_last = self.left.fetch_sub(1, Ordering::AcqRel) == 1;
            give_way();
        }
    }

    fn find(&self, job: &Job, means: &Means) -> Finding {
        let found = match job {
            Job::Replan(task) => self.detour(task, means).map(Finding::Detour),
            Job::Contingencies(plan) => self.contingencies(plan, means),
        };
        found.unwrap_or(Finding::Nothing)
    }

    fn plan(&self, id: &str) -> Option<&Arc<PlanEntry>> {
        self.snapshot.plans.get(id).filter(|plan| plan.is_active())
    }

    /// What the drone of a plan is to fly instead; `None` where nothing is in its way, or it has been told already.
    fn detour(&self, task: &Task, means: &Means) -> Option<Box<Detour>> {
        let plan = self.plan(&task.place.plan).filter(|_| task.may_be_cut())?;
        let airspace = &self.snapshot.airspace;
        let topology = airspace.topology();
        let progress = progress::progress_or_wait(topology, plan, &means.drones, self.now)?;
        let means = DetourMeans {
            scene: self.snapshot.scene(self.now),
            planner: &*means.planner,
            drones: &means.drones,
        };
        let obstructed = fleet::obstructed(plan, &progress, &means);
        let is_wanted_met = obstructed.wanted_by.is_some();
        let is_told = plan.wanted.is_some() && !is_wanted_met;
        if is_told || !(obstructed.is_reported || is_wanted_met) {
            return None;
        }
        Some(Box::new(fleet::detour(plan, &progress, &means)))
    }

    fn contingencies(&self, plan: &str, means: &Means) -> Option<Finding> {
        let plan = self.plan(plan)?;
        let scene = self.snapshot.scene(self.now);
        let versions = [Some(&plan.reported), plan.wanted.as_ref()];
        let lacking = versions.into_iter().flatten();
        let lacking = lacking.filter(|version| version.composition.lacks_contingencies());
        let found = lacking.map(|version| {
            let version = (**version).clone();
            means.planner.with_contingencies(scene, plan, version)
        });
        Some(Finding::Contingencies(found.collect()))
    }
}

/// Threads that work on waves. They end with their owner.
#[derive(Debug)]
pub(crate) struct Workers(Vec<SyncSender<Arc<Wave>>>);

impl Workers {
    /// Starts a thread for each core. The one that ends a wave says so.
    pub(crate) fn start<D>(means: &Means, done: D) -> std::io::Result<Self>
    where
        D: Fn() + Clone + Send + 'static,
    {
        let threads = (0..cores().min(THREADS_MAX)).map(|number| {
            let (waves, inbox) = sync_channel(1);
            let (means, done) = (means.clone(), done.clone());
            let name = format!("skyway-plans-{number}");
            let builder = std::thread::Builder::new().name(name);
            builder.spawn(move || work(&inbox, &means, &done))?;
            Ok(waves)
        });
        threads.collect::<std::io::Result<_>>().map(Self)
    }

    /// Hands a wave to all threads.
    pub(crate) fn begin(&self, wave: &Arc<Wave>) {
        for thread in &self.0 {
            // A thread that has not come to the wave before is left out; the one that ended it is free.
            let _ = thread.try_send(wave.clone());
        }
    }
}

fn work(inbox: &Receiver<Arc<Wave>>, means: &Means, done: &impl Fn()) {
    Background::Replanning.step_back();
    while let Ok(wave) = inbox.recv() {
        begin_turn();
        if wave.work(means) {
            done();
        }
    }
}
