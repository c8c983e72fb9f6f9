//! `skyway evaluate`: the paper's experiments, repeated, in one folder with a report.
//!
//! `folder` keeps what has been computed and refuses to mix runs, `cell` computes what is missing, and
//! `provenance` tells where the figures come from.

mod cell;
mod folder;
mod provenance;

use super::network_source;
use super::output::{Align, Output, titled_table};
use super::stop::{Stop, Verdict};
use crate::evaluate::record::{Claim, Figure, Provenance, Reading, Run, Unit, Verdict as Holds};
use crate::evaluate::{
    CellPlan, Cells, Design, FigurePlan, Judged, Placing, Repetitions, Survey, agreement,
    claim_plans, figure_plans, judge, notes, report, write_summary,
};
use crate::formats::{draft_of, write_network};
use clap::Args;
use folder::Folder;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use rayon::ThreadPool;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  skyway evaluate                              everything, into evaluation/
  skyway evaluate --quick --out target/quick   a short run that shows the shape of everything
  skyway evaluate --figure time-by-size        one plot, by its name or its number in the paper
  skyway evaluate --network town.geojson --out town

A run that was interrupted is taken up again by the same command. Times are taken on one thread; leave \
the machine alone meanwhile, and build with --profile dist, which checks no assertions.";

/// A method is timed on one failure for no longer than this, in microseconds.
const BUDGET_US: f64 = 2_000.0;
const QUICK_BUDGET_US: f64 = 500.0;
const QUICK_REPETITIONS: usize = 3;
const REPETITIONS: usize = 5;

/// Arguments of `skyway evaluate`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Evaluate {
    /// Compute only this plot and the networks it needs, by its name or its number in the paper; can be given more than once
    #[arg(help_heading = "Experiments", long, value_name = "NAME|NUMBER")]
    figure: Vec<String>,
    /// Evaluate this network alone: sydney, corridor, or a file
    #[arg(help_heading = "Experiments", long, short, value_name = "NAME|FILE")]
    network: Option<String>,
    /// Fewer and smaller networks with fewer failures: shows the shape, not the figures
    #[arg(help_heading = "Experiments", long)]
    quick: bool,
    /// The seed of networks, failures and intervals
    #[arg(
        help_heading = "Experiments",
        long,
        value_name = "NUMBER",
        default_value_t = 1
    )]
    seed: u64,
    /// How many failures are drawn on each network in each of three ways [default: 4, with --quick 2; 60 times as many on a network of its own]
    #[arg(help_heading = "Experiments", long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    failures: Option<u32>,
    /// How often a method is timed on one failure at most, within 2 ms [default: 5, with --quick 3]
    #[arg(help_heading = "Experiments", long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..=1_000))]
    repetitions: Option<u32>,
    /// How many threads compute what is not timed [default: as many as there are cores]
    #[arg(help_heading = "Experiments", long, value_name = "COUNT", value_parser = clap::value_parser!(u16).range(1..=1_024))]
    jobs: Option<u16>,
    /// The folder of the run
    #[arg(
        help_heading = "Output",
        long,
        value_name = "FOLDER",
        default_value = "evaluation"
    )]
    out: PathBuf,
    /// Remove what a run left in the folder, and begin anew
    #[arg(help_heading = "Output", long)]
    fresh: bool,
}

impl Evaluate {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let plans = self.figure_plans()?;
        let design = self.design(output)?;
        self.check_that_plots_have_networks(&plans, &design)?;
        let provenance = provenance::told(self)?;
        let folder = Folder::open(&self.out, &self.identity(&design, &provenance), self.fresh)?;
        let pool = self.pool()?;
        if provenance.checks_assertions {
            output.warn("this build checks its assertions, which costs time; for figures build with --profile dist");
        }
        let cells = self.cells(&design, &plans, &folder, &pool, output)?;
        let run = pool.install(|| self.analyse(&cells, &plans, provenance));
        self.write(&folder, &cells, &run, &pool)?;
        if !run.claims.is_empty() {
            print(&run.claims, output)?;
        }
        if let Some(note) = agreement(&cells, self.seed) {
            output.note(&note.text);
        }
        output.note(&format!("report: {}", folder.path("report.html").display()));
        Ok(Verdict::Done)
    }

    /// The plots asked for, or all.
    fn figure_plans(&self) -> Result<Vec<FigurePlan>, Stop> {
        let all = figure_plans();
        if self.figure.is_empty() {
            return Ok(all);
        }
        let is_meant = |plan: &FigurePlan, asked: &String| {
            plan.slug() == asked
                || plan
                    .paper()
                    .is_some_and(|number| number.to_string() == *asked)
        };
        for asked in &self.figure {
            if !all.iter().any(|plan| is_meant(plan, asked)) {
                let slugs: Vec<&str> = all.iter().map(FigurePlan::slug).collect();
                let problem = format!("--figure {asked} is none of {}", slugs.join(", "));
                return Err(Stop::Usage(problem));
            }
        }
        let mut chosen = all;
        chosen.retain(|plan| self.figure.iter().any(|asked| is_meant(plan, asked)));
        Ok(chosen)
    }

    /// A plot that is asked for needs a network to show.
    fn check_that_plots_have_networks(
        &self,
        plans: &[FigurePlan],
        design: &Design,
    ) -> Result<(), Stop> {
        let has_network = |plan: &FigurePlan| design.cells.iter().any(|cell| plan.needs(cell));
        let empty = plans.iter().find(|plan| !has_network(plan));
        let Some(empty) = empty.filter(|_| !self.figure.is_empty()) else {
            return Ok(());
        };
        let all = figure_plans();
        let possible = all.iter().filter(|plan| has_network(plan));
        let slugs: Vec<&str> = possible.map(FigurePlan::slug).collect();
        Err(Stop::Usage(format!(
            "--figure {} shows generated networks, and none of --network; of that there are {}",
            empty.slug(),
            slugs.join(", ")
        )))
    }

    fn design(&self, output: &Output) -> Result<Design, Stop> {
        let failures = self.failures.map(|count| count as usize);
        let Some(network) = &self.network else {
            return Ok(Design::of_paper(self.seed, self.quick, failures));
        };
        let loaded = network_source::load(network, None, output)?;
        // Written again with every length stated, so that engine and oracle read the same text.
        let text = write_network(&draft_of(&loaded.topology));
        let stem = Path::new(network).file_stem().unwrap_or_default();
        let name = stem.to_string_lossy().replace(char::is_whitespace, "-");
        let design = Design::of_network(format!("network-{name}"), text, self.quick, failures);
        Ok(design)
    }

    fn repetitions(&self) -> Repetitions {
        let (usual, budget_us) = match self.quick {
            true => (QUICK_REPETITIONS, QUICK_BUDGET_US),
            false => (REPETITIONS, BUDGET_US),
        };
        Repetitions {
            most: self.repetitions.map_or(usual, |count| count as usize),
            budget_us,
        }
    }

    fn pool(&self) -> Result<ThreadPool, Stop> {
        // Without a number rayon takes as many threads as there are cores.
        let threads = usize::from(self.jobs.unwrap_or(0));
        let built = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        built.map_err(Stop::failed)
    }

    /// The cells that the plots need: read where they have been computed before, else computed.
    fn cells(
        &self,
        design: &Design,
        plans: &[FigurePlan],
        folder: &Folder,
        pool: &ThreadPool,
        output: &Output,
    ) -> Result<Cells, Stop> {
        let is_needed = |cell: &&CellPlan| plans.iter().any(|plan| plan.needs(cell));
        let needed: Vec<_> = design.cells.iter().filter(is_needed).collect();
        let bar = progress_bar(output);
        let drawn =
            |plan: &CellPlan| (plan.networks.len() * plan.failures * Placing::ALL.len()) as u64;
        bar.set_length(needed.iter().map(|plan| drawn(plan)).sum());
        let mut cells = Cells::default();
        let mut found = 0;
        for plan in needed {
            let before = bar.position();
            bar.set_message(plan.name.clone());
            let figures = match folder.cell(&plan.name)? {
                Some(figures) => {
                    found += 1;
                    figures
                }
                None => {
                    let progress = |done: usize| bar.set_position(before + done as u64);
                    let computed =
                        cell::compute(plan, self.seed, self.repetitions(), pool, progress)?;
                    folder.keep(&plan.name, computed)?
                }
            };
            bar.set_position(before + drawn(plan));
            cells.0.push(crate::evaluate::Cell {
                plan: plan.clone(),
                figures,
            });
        }
        bar.finish_and_clear();
        if found > 0 {
            let all = cells.0.len();
            output.note(&format!("{found} of {all} cells had been measured before"));
        }
        Ok(cells)
    }

    /// Makes everything that is told from the rows; with some plots alone, no claims.
    fn analyse(&self, cells: &Cells, plans: &[FigurePlan], mut provenance: Provenance) -> Run {
        let seed = self.seed;
        let figures: Vec<Option<Figure>> = plans
            .par_iter()
            .map(|plan| plan.figure(cells, seed))
            .collect();
        let surveys: Vec<Survey> = match self.figure.is_empty() {
            true => claim_plans()
                .par_iter()
                .map(|plan| plan.survey(cells))
                .collect(),
            false => Vec::new(),
        };
        let judged = judge(&surveys, cells, seed);
        let facts = cells.0.iter().map(|cell| cell.figures.facts.clone());
        provenance.networks = facts.collect();
        let notes = notes(cells, &judged, seed);
        let Judged {
            claims,
            conventions,
            sentences,
            overview,
        } = judged;
        Run {
            provenance,
            figures: overview
                .into_iter()
                .chain(figures.into_iter().flatten())
                .collect(),
            notes,
            claims,
            conventions,
            sentences,
        }
    }

    fn write(
        &self,
        folder: &Folder,
        cells: &Cells,
        run: &Run,
        pool: &ThreadPool,
    ) -> Result<(), Stop> {
        let plots: Result<Vec<(String, String)>, Stop> = pool.install(|| {
            let figures = run.figures.par_iter();
            figures
                .map(|figure| {
                    let svg = report::plot(figure).map_err(Stop::failed)?;
                    Ok((figure.slug.clone(), svg))
                })
                .collect()
        });
        let plots = plots?;
        folder.write_figures(&run.figures, &plots)?;
        let summary = write_summary(cells, self.seed).map_err(Stop::failed)?;
        folder.write("summary.csv", &summary)?;
        let json = serde_json::to_string_pretty(run).map_err(Stop::failed)?;
        folder.write("run.json", &(json + "\n"))?;
        folder.write("findings.md", &report::markdown(run))?;
        folder.write("report.html", &report::html(run, &plots))
    }

    /// What two runs must have in common to share a folder.
    fn identity(&self, design: &Design, provenance: &Provenance) -> Vec<(String, String)> {
        let repetitions = self.repetitions();
        let failures = design.cells.first().map_or(0, |cell| cell.failures);
        let named = |name: &str, value: String| (name.to_owned(), value);
        let network = self.network.as_ref().map(|_| folder::fingerprint(design));
        vec![
            named("version", env!("CARGO_PKG_VERSION").to_owned()),
            named("commit", provenance.commit.clone()),
            named("profile", env!("SKYWAY_PROFILE").to_owned()),
            // Times of two machines are not those of one run.
            named("machine", provenance.machine.clone()),
            named("seed", self.seed.to_string()),
            named("quick", self.quick.to_string()),
            named("failures", failures.to_string()),
            named("repetitions", repetitions.most.to_string()),
            named(
                "network",
                network.unwrap_or_else(|| "those of the paper".to_owned()),
            ),
        ]
    }
}

/// A bar on standard error, where that is a terminal and someone wants to see it.
fn progress_bar(output: &Output) -> ProgressBar {
    let target = match output.is_quiet() {
        true => ProgressDrawTarget::hidden(),
        false => ProgressDrawTarget::stderr(),
    };
    let bar = ProgressBar::with_draw_target(None, target);
    match ProgressStyle::with_template("{bar:40} {pos}/{len} failures, {eta} left, {msg}") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// The claims as a table: what the paper says, ours under the joint conventions, and the closest reading.
fn print(claims: &[Claim], output: &Output) -> Result<(), Stop> {
    let columns = [
        ("claim", Align::Left),
        ("paper", Align::Right),
        ("jointly", Align::Right),
        ("closest", Align::Right),
        ("exact", Align::Right),
        ("holds", Align::Left),
    ];
    let mut table = titled_table(&columns);
    for claim in claims {
        let told = |value: f64| match claim.unit {
            Unit::Percent => format!("{value:.1} %"),
            Unit::Times => format!("{value:.2} times"),
            Unit::Count => format!("{value:.0}"),
        };
        let or_dash = |reading: &Option<Reading>| {
            let value = reading.as_ref().map(|reading| reading.value);
            value.map_or_else(|| "-".to_owned(), told)
        };
        let holds = match claim.holds {
            Holds::Reproduced => "reproduced",
            Holds::InIsolation => "in isolation",
            Holds::DirectionOnly => "direction only",
            Holds::Depends => "depends",
            Holds::Contradicted => "contradicted",
            Holds::NotReproduced => "not reproduced",
            Holds::NotMeasured => "not measured",
        };
        table.add_row([
            claim.id.clone(),
            told(claim.paper),
            or_dash(&claim.joint),
            or_dash(&claim.closest),
            or_dash(&claim.exact),
            holds.to_owned(),
        ]);
    }
    output.table(&table)
}
