//! The plans whose drones are to be answered, in the order in which that is done; in this folder the waves that answer
//! them, and the look for better plans once something has opened.

pub(crate) mod offers;
pub(crate) mod opened;
pub(crate) mod waves;

use jiff::Timestamp;
use skyway_engine::airspace::Closure;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Whose turn comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Turn {
    /// Its drone is in the air.
    InTheAir,
    /// Its drone has not departed.
    OnTheGround,
    /// Nothing new meets it, but it may be free again.
    MayBeFree,
}

/// A plan's place in the queue: by turn, then by the time left until its drone reaches what closed, then by
/// priority, then the plan that departs first, then by id.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place {
    pub(crate) turn: Turn,
    /// In whole seconds, so that of those that reach it at about the same time the priority decides.
    pub(crate) left_s: i64,
    /// The highest first.
    pub(crate) priority: Reverse<u8>,
    pub(crate) departs_at: Timestamp,
    pub(crate) plan: Arc<str>,
}

/// Ids of closures, each once. A thousand of them may meet one plan, so that nothing goes through them one by one.
pub(crate) type Causes = Arc<BTreeSet<Arc<str>>>;

/// What is to be found out about a plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Task {
    pub(crate) place: Place,
    /// The new closures that meet it.
    pub(crate) causes: Causes,
    /// How often what was found for it had been overtaken.
    pub(crate) lost: u8,
}

impl Task {
    /// Whether something may be in its way, rather than out of it.
    pub(crate) fn may_be_cut(&self) -> bool {
        self.place.turn != Turn::MayBeFree
    }
}

/// Plans in their order, each once.
#[derive(Debug, Default)]
pub(crate) struct Queue {
    order: BTreeSet<Place>,
    tasks: BTreeMap<Arc<str>, Task>,
}

impl Queue {
    pub(crate) fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    pub(crate) fn len(&self) -> usize {
        self.order.len()
    }

    /// Queues a plan; one that waits already keeps the earlier place, and has the causes of both. Gives the causes
    /// that are new to it, in their order.
    pub(crate) fn add(&mut self, task: Task) -> Vec<Arc<str>> {
        let Some(waiting) = self.tasks.get_mut(&task.place.plan) else {
            let causes = task.causes.iter().cloned().collect();
            self.order.insert(task.place.clone());
            self.tasks.insert(task.place.plan.clone(), task);
            return causes;
        };
        if task.place < waiting.place {
            self.order.remove(&waiting.place);
            self.order.insert(task.place.clone());
            waiting.place = task.place;
        }
        let new: Vec<Arc<str>> = task.causes.difference(&waiting.causes).cloned().collect();
        if !new.is_empty() {
            Arc::make_mut(&mut waiting.causes).extend(new.iter().cloned());
        }
        waiting.lost = waiting.lost.max(task.lost);
        new
    }

    /// What waits to be found out about a plan.
    pub(crate) fn task(&self, plan: &str) -> Option<&Task> {
        self.tasks.get(plan)
    }

    /// Takes the first.
    pub(crate) fn pop(&mut self) -> Option<Task> {
        let place = self.order.pop_first()?;
        self.tasks.remove(&place.plan)
    }
}

/// How a closure's plans have been answered so far.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    pub(crate) plan_count: usize,
    pub(crate) left: usize,
    pub(crate) outcomes: BTreeMap<&'static str, usize>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn task(turn: Turn, left_s: i64, plan: &str, causes: &[&str]) -> Task {
        let priority = if plan.ends_with("urgent") { 90 } else { 50 };
        Task {
            place: Place {
                turn,
                left_s,
                priority: Reverse(priority),
                departs_at: Timestamp::UNIX_EPOCH,
                plan: Arc::from(plan),
            },
            causes: Arc::new(causes.iter().map(|cause| Arc::from(*cause)).collect()),
            lost: 0,
        }
    }

    #[test]
    fn those_in_the_air_come_first_then_those_who_reach_it_first_then_the_urgent() {
        let mut queue = Queue::default();
        for (turn, left_s, plan) in [
            (Turn::MayBeFree, 0, "f"),
            (Turn::OnTheGround, 5, "d"),
            (Turn::InTheAir, 90, "c"),
            (Turn::OnTheGround, 9, "e"),
            (Turn::InTheAir, 7, "b"),
            (Turn::InTheAir, 7, "a"),
            (Turn::InTheAir, 7, "z urgent"),
        ] {
            queue.add(task(turn, left_s, plan, &[]));
        }
        let order: Vec<String> = std::iter::from_fn(|| queue.pop())
            .map(|task| task.place.plan.to_string())
            .collect();
        assert_eq!(order, ["z urgent", "a", "b", "c", "d", "e", "f"]);
    }

    #[test]
    fn a_plan_waits_once_at_its_earliest_place_for_all_its_causes() {
        let mut queue = Queue::default();
        let add = |queue: &mut Queue, task| queue.add(task).join(" ");
        assert_eq!(add(&mut queue, task(Turn::InTheAir, 9, "a", &["z1"])), "z1");
        let twice = task(Turn::InTheAir, 3, "a", &["z1", "z2"]);
        assert_eq!(add(&mut queue, twice), "z2");
        assert!(queue.add(task(Turn::MayBeFree, 0, "a", &[])).is_empty());
        let popped = queue.pop().expect("one");
        assert_eq!((popped.place.left_s, popped.causes.len()), (3, 2));
        assert!(popped.may_be_cut() && queue.is_empty() && queue.pop().is_none());
    }
}

/// What a change has made, for which plans have to be looked at.
#[derive(Debug, Default)]
pub(crate) struct Look {
    /// The closures that count now and did not before, or do so in another form.
    pub(crate) in_force: Vec<Arc<Closure>>,
    /// Those that were put and do not count yet.
    pub(crate) announced: Vec<Arc<Closure>>,
    /// Whether anything has opened.
    pub(crate) has_opened: bool,
    /// Whether what was only announced may have been lifted.
    pub(crate) announcements: bool,
    /// Whether the wind has changed, which may leave plans short.
    pub(crate) has_turned_wind: bool,
}
