//! What a recomposition tells of itself: its spans for those who trace, one log line for those who debug; nothing, and at
//! no cost, where tracing is off.

use super::records::AnswerRecord;
use tracing::Span;
use tracing::field::{Empty, display};

/// The target of all spans; log lines have those of their modules.
pub const TRACES_TARGET: &str = "skyway::traces";

/// From a report that was read to its answer.
pub(crate) fn of_answer() -> Span {
    tracing::trace_span!(
        target: TRACES_TARGET,
        "recompose",
        recomposition_id = Empty,
        revision = Empty,
        outcome = Empty,
        strategy = Empty,
        strategy_used = Empty,
        stage = Empty,
        searches = Empty,
        settled_nodes = Empty,
        area_nodes = Empty,
        dry_run = Empty,
        publication = Empty,
    )
}

/// Finding out what the report means: where the drone is, what has failed, where it is going.
pub(crate) fn of_settling() -> Span {
    tracing::trace_span!(target: TRACES_TARGET, "settle")
}

/// The search, and what it changes of a plan.
pub(crate) fn of_search() -> Span {
    tracing::trace_span!(target: TRACES_TARGET, "search")
}

/// Handing on what the report closes for everyone.
pub(crate) fn of_publication() -> Span {
    tracing::trace_span!(target: TRACES_TARGET, "publish")
}

/// Writes into its span, and into the log, what an answer came to.
pub(crate) fn tell(span: &Span, record: &AnswerRecord) {
    let answer = record.answer.told();
    tracing::debug!(
        recomposition_id = record.id(),
        outcome = answer.outcome.name(),
        stage = answer.stage.name(),
        revision = &*record.revision,
        dry_run = record.dry_run,
        "answered"
    );
    if span.is_disabled() {
        return;
    }
    span.record("recomposition_id", record.id());
    span.record("revision", display(&record.revision));
    span.record("outcome", answer.outcome.name());
    span.record("strategy", answer.strategy.name());
    span.record("strategy_used", answer.strategy_used.name());
    span.record("stage", answer.stage.name());
    span.record("searches", answer.searches);
    span.record("settled_nodes", answer.settled_nodes);
    span.record("area_nodes", answer.area_nodes);
    span.record("dry_run", record.dry_run);
    span.record("publication", record.published.state.name());
}
