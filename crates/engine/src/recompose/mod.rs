//! Recomposition: a failure report in, a new remaining path out.
//!
//! [`recompose`] is the one entry. `exact` is the default and always the optimum; the paper's three
//! local strategies and the baselines answer by the same conventions, so that they can be compared.
//! One file per strategy; what they share is where the path starts (`starts`), what the old plan
//! was (`plan`) and how several closed legs are repaired (`repair`).

mod answer;
mod causes;
mod cell_density;
mod certificate;
mod connectivity;
mod diversion;
mod explanation;
mod extent;
mod holding;
mod local;
mod no_route;
mod plan;
mod polygons;
mod radius;
mod recomposition;
mod reentry_points;
mod repair;
mod request;
mod safety;
mod severance;
mod starts;
mod two_phased;

pub use answer::{Fallback, Outcome, Recomposition, Repair, Severance, Warning};
pub use certificate::{Certificate, certify};
pub use explanation::{AreaShape, Stage, StageRecord};
pub use recomposition::{Scratch, World, recompose};
pub use reentry_points::{ReentryPoints, reentry_points};
pub use request::{AreaTest, BroughtZone, CellArea, Parameters, Request, Scope, Strategy};
pub use safety::{Flag, Near, UnsafeCode, UnsafeWay, WhyNot};
pub(crate) use severance::causes_of_leg;
pub use starts::OFF_LEG_TOLERANCE_M;
pub(crate) use starts::is_past_end;
