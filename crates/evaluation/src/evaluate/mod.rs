//! The experiments of the paper (section "Performance Evaluation"), repeated, with `exact` beside everything.
//!
//! `design` says which networks, `network` and `failures` make them and what fails on them, `method`
//! and `measure` answer and time it, `rows` keeps the raw figures. All that is told afterwards is made
//! from those rows: `figures` the plots, `claims` the paper's numbers under joint conventions and its sentences, `notes`
//! the rest; `record` is what they write into, and `report` what people read. Here is no clock, no file and no
//! thread: who calls hands in a [`Timer`] and may call what is not timed from several threads.

mod bellman_ford;
mod cells;
mod claims;
mod design;
mod failures;
mod figures;
mod measure;
mod method;
mod network;
mod notes;
mod oracle;
mod random;
pub mod record;
pub mod report;
mod rows;
mod skipped;
mod statistics;
mod text;

pub use cells::{Cell, CellRows, Cells, FailureRow};
pub use claims::{ClaimPlan, Judged, Survey, claim_plans, judge};
pub use design::{CellPlan, Design, Network};
pub use failures::{Draw, Failed, Placing, draw, fail};
pub use figures::{FigurePlan, figure_plans};
pub use measure::{Measured, NotOptimal, Repetitions, Timer, measure};
pub use method::{Approach, Inside, Method, Span};
pub use network::{Subject, SubjectError};
pub use notes::{agreement, notes};
pub use oracle::{Oracle, OracleError, Sought};
pub use rows::{
    Row, RowsError, read_failures, read_rows, write_failures, write_figure, write_rows,
    write_summary,
};
pub use statistics::{Average, Estimate, Resampler, median, quantile};
