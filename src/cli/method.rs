//! How a failure is answered: the strategy and the numbers that the paper leaves open.

use super::failure::one_of;
use super::stop::Stop;
use crate::flight::FailureReport;
use crate::recompose::{Parameters, Request, Scope, Strategy};
use clap::Args;
use clap::builder::TypedValueParser;

const SCOPES: [Scope; 2] = [Scope::Local, Scope::Global];

/// The strategy.
#[derive(Debug, Args)]
#[command(next_help_heading = "Strategy")]
pub(super) struct StrategyArguments {
    /// How the new path is found
    #[arg(long, value_name = "STRATEGY", default_value = "exact", value_parser = strategy())]
    strategy: Strategy,
    /// For dijkstra, astar and bellman_ford: from A to B and on as planned, or all the way to the destination
    #[arg(long, value_name = "SCOPE", default_value = "global", value_parser = scope())]
    scope: Scope,
}

/// The numbers that the paper leaves open.
#[derive(Debug, Args)]
#[command(next_help_heading = "Strategy")]
pub(super) struct ParameterArguments {
    /// Side of the cells of cell_density, in metres [default: network size / 16]
    #[arg(long, value_name = "METRES")]
    cell_size: Option<f64>,
    /// Half the height of two_phased's rectangle, as a share of |AB|
    #[arg(long, value_name = "RATIO", default_value_t = Parameters::default().val_ratio)]
    val_ratio: f64,
    /// Search every stage of two_phased, those with few nodes too
    #[arg(long)]
    no_stage_skipping: bool,
    /// Let dijkstra settle every node it can reach, instead of stopping at the goal
    #[arg(long)]
    full_tree: bool,
}

impl StrategyArguments {
    /// The request of a report.
    pub(super) fn request(
        &self,
        report: FailureReport,
        parameters: &ParameterArguments,
    ) -> Result<Request, Stop> {
        Ok(Request {
            strategy: self.strategy,
            scope: self.scope,
            parameters: parameters.checked()?,
            ..Request::exact(report)
        })
    }
}

impl ParameterArguments {
    /// The parameters, refused where no strategy can work with them.
    pub(super) fn checked(&self) -> Result<Parameters, Stop> {
        let is_positive = |number: f64| number.is_finite() && number > 0.0;
        if let Some(cell_size_m) = self.cell_size.filter(|&size_m| !is_positive(size_m)) {
            let problem = format!("--cell-size is {cell_size_m}; give metres above 0");
            return Err(Stop::Usage(problem));
        }
        if !is_positive(self.val_ratio) {
            let problem = format!("--val-ratio is {}; give a number above 0", self.val_ratio);
            return Err(Stop::Usage(problem));
        }
        Ok(Parameters {
            cell_size_m: self.cell_size,
            val_ratio: self.val_ratio,
            stage_skipping: !self.no_stage_skipping,
            full_tree: self.full_tree,
            ..Parameters::default()
        })
    }
}

/// The name of a scope, as on the wire.
pub(super) fn scope_name(scope: Scope) -> &'static str {
    match scope {
        Scope::Local => "local",
        Scope::Global => "global",
    }
}

fn strategy() -> impl TypedValueParser<Value = Strategy> {
    one_of(&Strategy::ALL, Strategy::name)
}

fn scope() -> impl TypedValueParser<Value = Scope> {
    one_of(&SCOPES, scope_name)
}
