//! Documents: none. Simulations are about the log that edges follow.

use super::MemoryStore;
use skyway::registry::documents::{
    Commit, Committed, Document, DocumentKind, DocumentQuery, Documents, FailureCount, Message,
    PositionRow, Settlement,
};
use skyway::registry::store::{Answer, KeptReply, StoreError};

fn none_kept<'a, T: Send + 'a>() -> Answer<'a, T> {
    let message = "a simulation keeps no documents".to_owned();
    Box::pin(async move { Err(StoreError::Unavailable { message }) })
}

impl Documents for MemoryStore {
    fn document<'a>(&'a self, _: DocumentKind, _: &'a str) -> Answer<'a, Option<Document>> {
        none_kept()
    }

    fn documents<'a>(&'a self, _: &'a DocumentQuery) -> Answer<'a, Vec<Document>> {
        none_kept()
    }

    fn count_documents<'a>(&'a self, _: DocumentKind, _: Option<&'a str>) -> Answer<'a, u64> {
        none_kept()
    }

    fn count_standing<'a>(
        &'a self,
        _: DocumentKind,
        _: &'a str,
        _: &'a [&'static str],
        _: Option<&'a str>,
    ) -> Answer<'a, u64> {
        none_kept()
    }

    fn commit<'a>(&'a self, _: &'a Commit) -> Answer<'a, Committed> {
        none_kept()
    }

    fn kept_reply<'a>(&'a self, _: &'a str, _: &'a str) -> Answer<'a, Option<(String, KeptReply)>> {
        none_kept()
    }

    fn news_through<'a>(&'a self, _: &'a str, _: &'a str, _: u64) -> Answer<'a, u64> {
        none_kept()
    }

    fn due_messages<'a>(&'a self, _: i64, _: u64, _: &'a [String]) -> Answer<'a, Vec<Message>> {
        none_kept()
    }

    fn next_due(&self) -> Answer<'_, Option<i64>> {
        none_kept()
    }

    fn settle_messages<'a>(&'a self, _: &'a [Settlement]) -> Answer<'a, Vec<bool>> {
        none_kept()
    }

    fn messages<'a>(
        &'a self,
        _: &'a str,
        _: Option<(i64, String)>,
        _: u64,
    ) -> Answer<'a, Vec<Message>> {
        none_kept()
    }

    fn message<'a>(&'a self, _: &'a str) -> Answer<'a, Option<Message>> {
        none_kept()
    }

    fn keep_positions<'a>(&'a self, _: &'a [PositionRow]) -> Answer<'a, u64> {
        none_kept()
    }

    fn positions<'a>(&'a self, _: &'a str, _: i64, _: i64, _: u64) -> Answer<'a, Vec<PositionRow>> {
        none_kept()
    }

    fn last_positions<'a>(&'a self, _: &'a [String], _: i64) -> Answer<'a, Vec<PositionRow>> {
        none_kept()
    }

    fn count_failures<'a>(
        &'a self,
        _: &'a str,
        _: i64,
        _: i64,
        _: u64,
    ) -> Answer<'a, Vec<FailureCount>> {
        none_kept()
    }

    fn drop_before(&self, _: i64, _: i64) -> Answer<'_, ()> {
        none_kept()
    }
}
