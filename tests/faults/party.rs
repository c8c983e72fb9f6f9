//! Those who write at a registry and at its edges, and those who look at the edges and ask them for ways.

use crate::edge::{Edge, holding_of};
use crate::history::edges::{self, Circle, Route};
use crate::history::{Act, Operation, Recorder, objects};
use crate::lives::{self, Shown, Statement};
use crate::outcome::Came;
use crate::registry_client::RADIUS_M;
use crate::rounds::{Chance, seed};
use crate::square::middle_of;
use crate::stage::Stage;
use crate::writers::{Crowd, Habit};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

/// Between two looks at edges.
const LOOK: Duration = Duration::from_millis(5);
/// Those who write at the registry have names that begin so.
const CENTRAL: &str = "central";

/// What was seen while faults happened.
#[derive(Debug, Default)]
struct Seen {
    shown: Mutex<Vec<Shown>>,
    routes: Mutex<Vec<(Statement, Route)>>,
}

/// Everyone who takes part besides the daemons.
pub(crate) struct Party {
    pub(crate) recorder: Recorder,
    central: Crowd,
    crowds: Vec<Crowd>,
    seen: Arc<Seen>,
    stop: CancellationToken,
    watching: Vec<JoinHandle<()>>,
}

impl Party {
    /// A writer at the registry and a number at each edge, and who looks at it.
    pub(crate) fn gather(stage: &Stage, writers_each: u64) -> Self {
        let (recorder, stop) = (Recorder::default(), CancellationToken::new());
        let seen = Arc::new(Seen::default());
        let central = (seed(), 1);
        let central = Crowd::of(&stage.client, CENTRAL, Habit::MODERATE, central, &recorder);
        let many = u32::try_from(stage.edges.len()).unwrap_or(1);
        let habit = Habit {
            rest: Habit::AT_EDGE.rest * many,
            ..Habit::AT_EDGE
        };
        let (mut crowds, mut watching) = (Vec::new(), Vec::new());
        for (number, edge) in (1_u64..).zip(&stage.edges) {
            let (client, writers) = (&edge.client, (seed() ^ number, writers_each));
            crowds.push(Crowd::of(client, &edge.name, habit, writers, &recorder));
            let watcher = Watcher {
                edge: edge.clone(),
                recorder: recorder.clone(),
                seen: seen.clone(),
                rest: LOOK * many,
                chance: Chance::of(seed(), 8_000 + number),
            };
            watching.push(tokio::spawn(watcher.work(stop.clone())));
        }
        Self {
            recorder,
            central,
            crowds,
            seen,
            stop,
            watching,
        }
    }

    /// Ends it, waits until all is well, and judges. `early_additions` where pages were bad.
    pub(crate) async fn judge(self, stage: &mut Stage, early_additions: bool) -> Came {
        let left = self.central.end().await;
        let mut came = Came::default();
        for crowd in self.crowds {
            came.violations.extend(crowd.end().await.violations);
        }
        self.stop.cancel();
        for watcher in self.watching {
            watcher.await.expect("who looks ends well");
        }
        came.violations.extend(stage.heal().await);
        // What an edge has in memory only is gone now.
        for place in 0..stage.edges.len() {
            stage.kill_edge(place);
            stage.start_edge(place).await;
        }
        came.violations.extend(stage.heal().await);
        let operations = self.recorder.operations();
        let run = lives::Run {
            shown: take(&self.seen.shown),
            routes: take(&self.seen.routes),
            shapes: operations.iter().filter_map(shape).collect(),
            operations,
            statements: Vec::new(),
            early_additions,
        };
        came.judge_edges(stage, run).await;
        let operations = self.recorder.operations();
        // The log has zones, and what edges show of their own may not be in it yet.
        let of_log = operations.into_iter().filter(|it| {
            let is_read_at_edge =
                matches!(it.act, Act::Read { .. }) && !it.who.starts_with(CENTRAL);
            it.act.id().starts_with("zone-") && !is_read_at_edge
        });
        came.judge(&stage.client, of_log.collect(), left).await;
        came
    }
}

impl Came {
    async fn judge_edges(&mut self, stage: &Stage, mut run: lives::Run) {
        let shown = run.shown.iter().map(|it| it.statement.clone());
        let answered = run.routes.iter().map(|(statement, _)| statement.clone());
        run.statements = shown.chain(answered).collect();
        self.violations.extend(run.violations());
        let log = match stage.client.read_log().await {
            Ok(all) => all.log(),
            Err(wrong) => return self.violations.push(wrong),
        };
        let mut of_log = edges::Run {
            log,
            early_additions: run.early_additions,
            shapes: run.shapes.clone(),
            ..edges::Run::default()
        };
        for edge in &stage.edges {
            let own = run.own_zones(&edge.name);
            let shown = run.shown.iter().filter(|it| it.statement.edge == edge.name);
            of_log.sights.extend(shown.map(|it| it.sight(&own)));
            let routes = run.routes.iter().filter(|(it, _)| it.edge == edge.name);
            of_log.routes.extend(routes.map(|(_, route)| Route {
                lifted: own.clone(),
                ..route.clone()
            }));
            let Some(holding) = holding_of(&edge.client).await else {
                self.violations
                    .push(format!("{} shows nothing in the end", edge.name));
                continue;
            };
            let by_it = run
                .operations
                .iter()
                .filter(|it| it.who.starts_with(&edge.name));
            let by_it: Vec<Operation> = by_it.cloned().collect();
            self.adds(&edge.name, objects::violations(&by_it, &holding));
        }
        self.violations.extend(of_log.violations());
        println!(
            "  {} looks at edges, {} ways answered, {} acknowledged at edges",
            run.shown.len(),
            run.routes.len(),
            run.operations
                .iter()
                .filter(|it| it.is_done() && !it.who.starts_with(CENTRAL))
                .count()
        );
    }
}

fn take<T>(list: &Mutex<Vec<T>>) -> Vec<T> {
    std::mem::take(&mut *list.lock().unwrap_or_else(PoisonError::into_inner))
}

fn shape(operation: &Operation) -> Option<(String, Circle)> {
    let Act::Put { tag, .. } = &operation.act else {
        return None;
    };
    let circle = Circle {
        center_m: middle_of(tag),
        radius_m: RADIUS_M,
    };
    Some((tag.clone(), circle))
}

/// One who looks at an edge and asks it for ways.
struct Watcher {
    edge: Arc<Edge>,
    recorder: Recorder,
    seen: Arc<Seen>,
    rest: Duration,
    chance: Chance,
}

impl Watcher {
    async fn work(mut self, stop: CancellationToken) {
        while !stop.is_cancelled() {
            let shown = self.edge.shown(&self.recorder).await;
            let (from, to) = self.draw();
            let route = self.edge.route(&self.recorder, (from, &to)).await;
            let all_shown = self.seen.shown.lock();
            all_shown
                .unwrap_or_else(PoisonError::into_inner)
                .extend(shown);
            let all_routes = self.seen.routes.lock();
            all_routes
                .unwrap_or_else(PoisonError::into_inner)
                .extend(route);
            tokio::time::sleep(self.rest).await;
        }
    }

    /// The node ahead of the drone, and where it goes.
    fn draw(&mut self) -> (&'static str, String) {
        const AHEAD: [&str; 4] = ["n12", "n32", "n21", "n23"];
        let ahead = usize::try_from(self.chance.below(4)).unwrap_or_default();
        let to = format!("n{}{}", self.chance.below(6), self.chance.below(6));
        (AHEAD[ahead], to)
    }
}
