//! The store of documents over a database: as the store of the log, each question by itself.

use super::{Connection, SqlStore, documents, history, messages, positions, upkeep};
use crate::documents::{
    Commit, Committed, Document, DocumentKind, DocumentQuery, Documents, FailureCount, Message,
    PositionRow, Settlement,
};
use crate::sql::transactions::{asking, reading, writing};
use crate::store::{Answer, KeptReply};

impl Documents for SqlStore {
    fn document<'a>(&'a self, kind: DocumentKind, id: &'a str) -> Answer<'a, Option<Document>> {
        Box::pin(async move {
            // PostgreSQL takes no text with one, and so has none.
            if id.contains('\0') {
                return Ok(None);
            }
            asking!(self, |connection| documents::document(connection, kind, id))
        })
    }

    fn documents<'a>(&'a self, query: &'a DocumentQuery) -> Answer<'a, Vec<Document>> {
        Box::pin(async move { asking!(self, |connection| documents::documents(connection, query)) })
    }

    fn count_documents<'a>(
        &'a self,
        kind: DocumentKind,
        tenant: Option<&'a str>,
    ) -> Answer<'a, u64> {
        Box::pin(async move {
            asking!(self, |connection| documents::count(
                connection, kind, tenant
            ))
        })
    }

    fn count_standing<'a>(
        &'a self,
        kind: DocumentKind,
        tenant: &'a str,
        states: &'a [&'static str],
        after: Option<&'a str>,
    ) -> Answer<'a, u64> {
        Box::pin(async move {
            asking!(self, |connection| documents::count_standing(
                connection, kind, tenant, states, after
            ))
        })
    }

    fn commit<'a>(&'a self, commit: &'a Commit) -> Answer<'a, Committed> {
        Box::pin(async move { writing!(self, |connection| documents::commit(connection, commit)) })
    }

    fn kept_reply<'a>(
        &'a self,
        subject: &'a str,
        key: &'a str,
    ) -> Answer<'a, Option<(String, KeptReply)>> {
        Box::pin(async move { asking!(self, |connection| upkeep::reply(connection, subject, key)) })
    }

    fn news_through<'a>(
        &'a self,
        network: &'a str,
        edge: &'a str,
        lineage: u64,
    ) -> Answer<'a, u64> {
        Box::pin(async move {
            asking!(self, |connection| history::news_through(
                connection, network, edge, lineage
            ))
        })
    }

    fn due_messages<'a>(
        &'a self,
        now_ms: i64,
        limit: u64,
        without: &'a [String],
    ) -> Answer<'a, Vec<Message>> {
        Box::pin(async move {
            asking!(self, |connection| messages::due(
                connection, now_ms, limit, without
            ))
        })
    }

    fn next_due(&self) -> Answer<'_, Option<i64>> {
        Box::pin(async move { asking!(self, |connection| messages::next_due(connection)) })
    }

    fn settle_messages<'a>(&'a self, settled: &'a [Settlement]) -> Answer<'a, Vec<bool>> {
        Box::pin(async move { writing!(self, |connection| messages::settle(connection, settled)) })
    }

    fn messages<'a>(
        &'a self,
        webhook: &'a str,
        before: Option<(i64, String)>,
        limit: u64,
    ) -> Answer<'a, Vec<Message>> {
        Box::pin(async move {
            asking!(self, |connection| messages::of_webhook(
                connection,
                webhook,
                before.as_ref(),
                limit
            ))
        })
    }

    fn message<'a>(&'a self, id: &'a str) -> Answer<'a, Option<Message>> {
        Box::pin(async move { asking!(self, |connection| messages::message(connection, id)) })
    }

    fn keep_positions<'a>(&'a self, positions: &'a [PositionRow]) -> Answer<'a, u64> {
        Box::pin(positions::keep(self, positions))
    }

    fn positions<'a>(
        &'a self,
        drone: &'a str,
        from_ms: i64,
        until_ms: i64,
        limit: u64,
    ) -> Answer<'a, Vec<PositionRow>> {
        Box::pin(async move {
            asking!(self, |connection| history::positions(
                connection, drone, from_ms, until_ms, limit
            ))
        })
    }

    fn last_positions<'a>(
        &'a self,
        drones: &'a [String],
        from_ms: i64,
    ) -> Answer<'a, Vec<PositionRow>> {
        Box::pin(async move {
            reading!(self, |connection| history::last_positions(
                connection, drones, from_ms
            ))
        })
    }

    fn count_failures<'a>(
        &'a self,
        network: &'a str,
        from_ms: i64,
        until_ms: i64,
        limit: u64,
    ) -> Answer<'a, Vec<FailureCount>> {
        Box::pin(async move {
            asking!(self, |connection| history::count_failures(
                connection, network, from_ms, until_ms, limit
            ))
        })
    }

    fn drop_before(&self, before_ms: i64, failures_before_ms: i64) -> Answer<'_, ()> {
        Box::pin(async move {
            writing!(self, |connection| history::drop_failures(
                connection,
                failures_before_ms
            ))?;
            writing!(self, |connection| documents::drop_quotes(
                connection, before_ms
            ))?;
            writing!(self, |connection| messages::drop_settled(
                connection, before_ms
            ))?;
            positions::drop_before(self, before_ms).await
        })
    }
}
