//! The store over a database: each question in a transaction of its own, writes tried again where others got
//! in between.

use super::{Connection, SqlStore, positions, statements, upkeep};
use crate::sql::Trouble;
use crate::sql::schema::{FACTS, STEPS};
use crate::sql::transactions::{asking, reading, writing};
use crate::store::{
    Answer, Append, Appended, ChangesQuery, ChangesRead, Compaction, EdgeHeard, Identity,
    KeptReply, NetworkParts, NetworkState, NewChange, ObjectsQuery, ObjectsRead, Store, StoreError,
    Version,
};
use skyway_contract::{ChangeOperation, LoggedChange, ObjectKind};
use skyway_planted::{self as planted, Bug};
use std::pin::Pin;

impl SqlStore {
    /// Brings an opened database to the schema of this version, and gives it an id where it has none.
    pub(super) async fn migrate(&self, fresh_id: &str) -> Result<(), StoreError> {
        writing!(self, |connection| migrate(connection, fresh_id))
    }
}

async fn migrate(connection: &mut Connection, fresh_id: &str) -> Result<(), Trouble> {
    let facts = sqlx::query(FACTS).execute(&mut *connection);
    facts.await.map_err(super::trouble)?;
    let found = statements::schema(connection).await?;
    let known = STEPS.len() as u64;
    if found > known {
        return Err(Trouble::Lasting(StoreError::Newer { found, known }));
    }
    for step in STEPS
        .iter()
        .skip(usize::try_from(found).unwrap_or(usize::MAX))
    {
        for statement in *step {
            let done = sqlx::query(*statement).execute(&mut *connection);
            done.await.map_err(super::trouble)?;
        }
    }
    for statement in positions::TABLE {
        let done = sqlx::query(*statement).execute(&mut *connection);
        done.await.map_err(super::trouble)?;
    }
    statements::set_fact(connection, "schema", &known.to_string()).await?;
    statements::ensure_identity(connection, fresh_id).await
}

/// Commits a write, or says why not.
async fn append(connection: &mut Connection, append: &Append) -> Result<Appended, Trouble> {
    if let Some(key) = &append.key
        && let Some((fingerprint, reply)) =
            upkeep::reply(connection, &key.subject, &key.key).await?
    {
        return Ok(Appended::Repeated { fingerprint, reply });
    }
    let identity = statements::identity(connection).await?;
    let found = statements::network(connection, &append.network).await?;
    if found
        .as_ref()
        .is_some_and(|state| append.head.is_some_and(|head| head != state.head))
    {
        return Ok(Appended::Moved);
    }
    let before = match (found, append.creates) {
        (Some(state), None) => state,
        (None, Some(limit)) => {
            let count = statements::networks(connection).await?.len() as u64;
            if count >= limit {
                let kind = ObjectKind::Network;
                return Ok(Appended::Bounded { kind, limit });
            }
            new_network(&append.network, identity.epoch)
        }
        _ => return Ok(Appended::Moved),
    };
    if !statements::holds(connection, &append.network, &append.expects).await? {
        return Ok(Appended::Moved);
    }
    let version = Version {
        epoch: identity.epoch,
        revision: before.head + 1,
    };
    let mut after = before.clone();
    after.head = version.revision;
    for change in &append.changes {
        count(connection, &mut after, change, version).await?;
    }
    if let Some(bounded) = beyond_bounds(append, &before, &after) {
        return Ok(bounded);
    }
    for (position, change) in append.changes.iter().enumerate() {
        statements::insert_change(connection, append, change, version, position).await?;
    }
    if planted::is(Bug::HalfBatch) {
        statements::commit_what_there_is(connection).await?;
    }
    let is_moved = match append.creates {
        Some(_) => {
            statements::insert_network(connection, &after).await?;
            true
        }
        None => statements::update_network(connection, &after, before.head).await?,
    };
    if !is_moved {
        return Err(Trouble::Contended);
    }
    let reply = (append.reply)(&identity, version);
    if let Some(key) = &append.key {
        upkeep::keep_reply(connection, key, &reply).await?;
    }
    Ok(Appended::Done { version, reply })
}

/// A bound that a write would exceed; what makes a number no greater is within every bound.
fn beyond_bounds(append: &Append, before: &NetworkState, after: &NetworkState) -> Option<Appended> {
    let (zones, closures) = (append.zones_max, append.closures_max);
    let bounds = [
        (ObjectKind::Zone, before.zones, after.zones, zones),
        (
            ObjectKind::Closure,
            before.closures,
            after.closures,
            closures,
        ),
    ];
    let mut exceeded = bounds
        .into_iter()
        .filter(|(_, were, are, limit)| are > were && are > limit);
    let (kind, _, _, limit) = exceeded.next()?;
    Some(Appended::Bounded { kind, limit })
}

fn new_network(id: &str, epoch: u64) -> NetworkState {
    NetworkState {
        id: id.to_owned(),
        head: 0,
        oldest: 0,
        topology: Version { epoch, revision: 0 },
        zones: 0,
        closures: 0,
    }
}

/// What a change makes of how its network stands.
async fn count(
    connection: &mut Connection,
    after: &mut NetworkState,
    change: &NewChange,
    version: Version,
) -> Result<(), Trouble> {
    let number = match change.kind {
        ObjectKind::Network => {
            after.topology = version;
            return Ok(());
        }
        ObjectKind::Weather => return Ok(()),
        ObjectKind::Zone => &mut after.zones,
        ObjectKind::Closure => &mut after.closures,
    };
    let was = statements::is_there(connection, &after.id, change).await?;
    match (was, change.operation != ChangeOperation::Delete) {
        (false, true) => *number += 1,
        (true, false) => *number = number.saturating_sub(1),
        _ => {}
    }
    Ok(())
}

async fn compact(connection: &mut Connection, compaction: &Compaction) -> Result<(), Trouble> {
    let network = &compaction.network;
    let parts = statements::network_parts(connection, network, compaction.oldest).await?;
    let Some(mut base) = parts.into_iter().next_back() else {
        return Ok(());
    };
    if base.revision != compaction.base_revision {
        // The network was compacted by another process meanwhile.
        return Ok(());
    }
    base.operation = ChangeOperation::Put;
    base.body = Some(compaction.base.clone());
    base.sha256 = base.digest(network);
    upkeep::compact(connection, compaction, &base).await
}

async fn objects(
    connection: &mut Connection,
    query: &ObjectsQuery,
) -> Result<Option<ObjectsRead>, Trouble> {
    let Some(state) = statements::network(connection, &query.network).await? else {
        return Ok(None);
    };
    let at = query.at.unwrap_or(state.head);
    let is_kept = (state.oldest..=state.head).contains(&at);
    let (count, restrictions) = match is_kept {
        true => statements::count_objects(connection, query, at).await?,
        false => (0, 0),
    };
    let (objects, has_more) = match is_kept {
        true => statements::objects(connection, query, at).await?,
        false => (Vec::new(), false),
    };
    Ok(Some(ObjectsRead {
        identity: statements::identity(connection).await?,
        state,
        at,
        count,
        restrictions,
        objects,
        has_more,
    }))
}

async fn changes(
    connection: &mut Connection,
    query: &ChangesQuery,
) -> Result<Option<ChangesRead>, Trouble> {
    let Some(state) = statements::network(connection, &query.network).await? else {
        return Ok(None);
    };
    let changes = match (state.oldest..state.head).contains(&query.after) {
        true => statements::changes(connection, query).await?,
        false => Vec::new(),
    };
    Ok(Some(ChangesRead {
        identity: statements::identity(connection).await?,
        state,
        changes,
    }))
}

async fn network_parts(
    connection: &mut Connection,
    id: &str,
    at: Option<u64>,
) -> Result<Option<NetworkParts>, Trouble> {
    let Some(state) = statements::network(connection, id).await? else {
        return Ok(None);
    };
    let parts = statements::network_parts(connection, id, at.unwrap_or(state.head)).await?;
    Ok(Some(NetworkParts { state, parts }))
}

async fn object(
    connection: &mut Connection,
    network: &str,
    kind: ObjectKind,
    id: &str,
) -> Result<Option<LoggedChange>, Trouble> {
    let last = statements::last_change(connection, network, kind, id).await?;
    Ok(last.filter(|change| change.operation != ChangeOperation::Delete))
}

impl Store for SqlStore {
    fn identity(&self) -> Answer<'_, Identity> {
        Box::pin(async move { reading!(self, |connection| statements::identity(connection)) })
    }

    fn ping(&self) -> Answer<'_, ()> {
        Box::pin(self.answer())
    }

    fn begin_epoch(&self, after: u64) -> Answer<'_, Identity> {
        Box::pin(async move {
            writing!(self, |connection| statements::begin_epoch(
                connection, after
            ))
        })
    }

    fn networks(&self) -> Answer<'_, Vec<NetworkState>> {
        Box::pin(async move { asking!(self, |connection| statements::networks(connection)) })
    }

    fn network<'a>(&'a self, id: &'a str) -> Answer<'a, Option<NetworkState>> {
        Box::pin(async move { asking!(self, |connection| statements::network(connection, id)) })
    }

    fn network_parts<'a>(
        &'a self,
        id: &'a str,
        at: Option<u64>,
    ) -> Answer<'a, Option<NetworkParts>> {
        Box::pin(async move { reading!(self, |connection| network_parts(connection, id, at)) })
    }

    fn object<'a>(
        &'a self,
        network: &'a str,
        kind: ObjectKind,
        id: &'a str,
    ) -> Answer<'a, Option<LoggedChange>> {
        Box::pin(async move { reading!(self, |connection| object(connection, network, kind, id)) })
    }

    fn objects<'a>(&'a self, query: &'a ObjectsQuery) -> Answer<'a, Option<ObjectsRead>> {
        Box::pin(async move { reading!(self, |connection| objects(connection, query)) })
    }

    fn changes<'a>(&'a self, query: &'a ChangesQuery) -> Answer<'a, Option<ChangesRead>> {
        Box::pin(async move { reading!(self, |connection| changes(connection, query)) })
    }

    fn append<'a>(&'a self, order: &'a Append) -> Answer<'a, Appended> {
        Box::pin(async move {
            let appended = writing!(self, |connection| append(connection, order))?;
            if matches!(appended, Appended::Done { .. }) {
                self.tell_others(&order.network).await;
            }
            Ok(appended)
        })
    }

    fn reply<'a>(
        &'a self,
        subject: &'a str,
        key: &'a str,
    ) -> Answer<'a, Option<(String, KeptReply)>> {
        Box::pin(async move { asking!(self, |connection| upkeep::reply(connection, subject, key)) })
    }

    fn forget_replies(&self, before_ms: i64, bytes_max: u64) -> Answer<'_, ()> {
        Box::pin(async move {
            writing!(self, |connection| upkeep::forget_replies(
                connection, before_ms, bytes_max
            ))
        })
    }

    fn compact<'a>(&'a self, compaction: &'a Compaction) -> Answer<'a, ()> {
        Box::pin(async move { writing!(self, |connection| compact(connection, compaction)) })
    }

    fn keep_edges<'a>(&'a self, heard: &'a [EdgeHeard], before_ms: i64) -> Answer<'a, ()> {
        Box::pin(async move {
            writing!(self, |connection| upkeep::keep_edges(
                connection, heard, before_ms
            ))
        })
    }

    fn edges(&self) -> Answer<'_, Vec<EdgeHeard>> {
        Box::pin(async move { asking!(self, |connection| upkeep::edges(connection)) })
    }

    fn hint(&self) -> Pin<Box<dyn Future<Output = ()> + Send + '_>> {
        Box::pin(self.hear_others())
    }

    fn close(&self) -> Pin<Box<dyn Future<Output = ()> + Send + '_>> {
        Box::pin(self.close_all())
    }
}
