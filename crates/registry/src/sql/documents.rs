//! What is asked of the database about documents, one function for each question, on a connection within a transaction.

use super::{Connection, Database, Row, history, messages, trouble, upkeep};
use crate::documents::{Commit, Committed, Document, DocumentKind, DocumentQuery, Seen, Unless};
use crate::sql::{ROWS_AT_ONCE, Trouble, signed, unsigned};
use sqlx::{QueryBuilder, Row as _};
use std::collections::BTreeMap;

const COLUMNS: &str = "id, tenant, party, state, version, changed_ms, body";

fn document_of(row: &Row, kind: DocumentKind) -> Result<Document, Trouble> {
    Ok(Document {
        kind,
        id: row.try_get(0).map_err(trouble)?,
        tenant: row.try_get(1).map_err(trouble)?,
        party: row.try_get(2).map_err(trouble)?,
        state: row.try_get(3).map_err(trouble)?,
        version: unsigned(
            row.try_get(4).map_err(trouble)?,
            "the version of a document",
        )?,
        changed_ms: row.try_get(5).map_err(trouble)?,
        body: row.try_get(6).map_err(trouble)?,
    })
}

/// A document; none where there is none.
pub(super) async fn document(
    connection: &mut Connection,
    kind: DocumentKind,
    id: &str,
) -> Result<Option<Document>, Trouble> {
    let statement = "SELECT id, tenant, party, state, version, changed_ms, body FROM documents \
                     WHERE kind = $1 AND id = $2";
    let asked = sqlx::query(statement).bind(kind.name()).bind(id);
    let found = asked.fetch_optional(connection).await.map_err(trouble)?;
    found.map(|row| document_of(&row, kind)).transpose()
}

/// One page of those of which `owner` names the tenant, as an index has them; of all where none is named.
fn push_page(
    statement: &mut QueryBuilder<Database>,
    query: &DocumentQuery,
    owner: Option<(&str, &str)>,
) {
    statement.push("SELECT ").push(COLUMNS);
    statement.push(" FROM documents WHERE kind = ");
    statement.push_bind(query.kind.name());
    if let Some((column, tenant)) = owner {
        statement.push(" AND ").push(column).push(" = ");
        statement.push_bind(tenant.to_owned());
    }
    if !query.states.is_empty() {
        statement.push(" AND state IN (");
        let mut states = statement.separated(", ");
        for state in &query.states {
            states.push_bind(state.clone());
        }
        statement.push(")");
    }
    let (beyond, order) = match query.is_newest_first {
        true => (" AND id < ", " ORDER BY id DESC LIMIT "),
        false => (" AND id > ", " ORDER BY id LIMIT "),
    };
    if let Some(after) = &query.after {
        statement.push(beyond).push_bind(after.clone());
    }
    statement.push(order);
    statement.push_bind(signed(query.limit));
}

/// Documents, by id. What a tenant has and what it is party to are two pages, each from an index of its own, of which
/// the first are taken.
pub(super) async fn documents(
    connection: &mut Connection,
    query: &DocumentQuery,
) -> Result<Vec<Document>, Trouble> {
    let mut statement = QueryBuilder::<Database>::new("");
    match query.of.as_deref() {
        None => push_page(&mut statement, query, None),
        Some(tenant) => {
            statement.push("SELECT ").push(COLUMNS).push(" FROM (");
            push_page(&mut statement, query, Some(("tenant", tenant)));
            statement.push(") own UNION SELECT ").push(COLUMNS);
            statement.push(" FROM (");
            push_page(&mut statement, query, Some(("party", tenant)));
            statement.push(") of_party ORDER BY id");
            statement.push(if query.is_newest_first { " DESC" } else { "" });
            statement.push(" LIMIT ");
            statement.push_bind(signed(query.limit));
        }
    }
    let asked = statement.build().fetch_all(connection);
    let rows = asked.await.map_err(trouble)?;
    rows.iter()
        .map(|row| document_of(row, query.kind))
        .collect()
}

/// How many documents of a kind a tenant has; of all tenants where none is named.
pub(super) async fn count(
    connection: &mut Connection,
    kind: DocumentKind,
    tenant: Option<&str>,
) -> Result<u64, Trouble> {
    let asked = match tenant {
        None => sqlx::query("SELECT COUNT(*) FROM documents WHERE kind = $1").bind(kind.name()),
        Some(tenant) => {
            sqlx::query("SELECT COUNT(*) FROM documents WHERE kind = $1 AND tenant = $2")
                .bind(kind.name())
                .bind(tenant)
        }
    };
    let row = asked.fetch_one(connection).await.map_err(trouble)?;
    let count = row.try_get(0).map_err(trouble)?;
    Ok(unsigned(count, "a number of documents")?)
}

/// How many documents of a kind a tenant has that stand in one of these ways, after this id where one is given. The kind is
/// written out, as deliveries have an index of their own.
pub(super) async fn count_standing(
    connection: &mut Connection,
    kind: DocumentKind,
    tenant: &str,
    states: &[&'static str],
    after: Option<&str>,
) -> Result<u64, Trouble> {
    let mut statement =
        QueryBuilder::<Database>::new("SELECT COUNT(*) FROM documents WHERE kind = '");
    statement.push(kind.name()).push("' AND tenant = ");
    statement.push_bind(tenant.to_owned());
    if let Some(after) = after {
        statement.push(" AND id > ").push_bind(after.to_owned());
    }
    statement.push(" AND state IN (");
    let mut stands = statement.separated(", ");
    for state in states {
        stands.push_bind(*state);
    }
    statement.push(")");
    let asked = statement.build().fetch_one(connection);
    let count = asked.await.map_err(trouble)?;
    let count = count.try_get(0).map_err(trouble)?;
    Ok(unsigned(count, "a number of documents")?)
}

/// Whether every version that a commit was decided on is still there.
async fn holds(connection: &mut Connection, seen: &[Seen]) -> Result<bool, Trouble> {
    for some in seen.chunks(ROWS_AT_ONCE) {
        let mut statement = QueryBuilder::<Database>::new(
            "SELECT kind, id, version FROM documents WHERE (kind, id) IN (",
        );
        statement.push_values(some, |mut row, seen| {
            row.push_bind(seen.kind.name()).push_bind(seen.id.clone());
        });
        statement.push(")");
        let asked = statement.build().persistent(false);
        let rows = asked.fetch_all(&mut *connection).await.map_err(trouble)?;
        let mut versions: BTreeMap<(String, String), u64> = BTreeMap::new();
        for row in rows {
            let version = row.try_get(2).map_err(trouble)?;
            let version = unsigned(version, "the version of a document")?;
            let kind = row.try_get(0).map_err(trouble)?;
            versions.insert((kind, row.try_get(1).map_err(trouble)?), version);
        }
        let found = |seen: &Seen| {
            let key = (seen.kind.name().to_owned(), seen.id.clone());
            versions.get(&key).copied()
        };
        if some.iter().any(|seen| found(seen) != seen.version) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Whether nothing is there that a commit must not find.
async fn is_free(connection: &mut Connection, unless: &Unless) -> Result<bool, Trouble> {
    let mut query = unless.query.clone();
    loop {
        let page = documents(&mut *connection, &query).await?;
        if page.iter().any(|document| unless.meets(document)) {
            return Ok(false);
        }
        if (page.len() as u64) < query.limit {
            return Ok(true);
        }
        query.after = page.last().map(|last| last.id.clone());
    }
}

async fn put(connection: &mut Connection, documents: &[Document]) -> Result<(), Trouble> {
    // No statement may put one row twice: of what is put more than once, the last counts.
    let last: BTreeMap<(DocumentKind, &str), &Document> = documents
        .iter()
        .map(|document| ((document.kind, &*document.id), document))
        .collect();
    let last: Vec<&Document> = last.into_values().collect();
    for some in last.chunks(ROWS_AT_ONCE) {
        let mut statement = QueryBuilder::<Database>::new(
            "INSERT INTO documents (kind, id, tenant, party, state, version, changed_ms, body) ",
        );
        statement.push_values(some, |mut row, document| {
            row.push_bind(document.kind.name())
                .push_bind(document.id.clone())
                .push_bind(document.tenant.clone())
                .push_bind(document.party.clone())
                .push_bind(document.state.clone())
                .push_bind(signed(document.version))
                .push_bind(document.changed_ms)
                .push_bind(document.body.clone());
        });
        statement.push(
            " ON CONFLICT (kind, id) DO UPDATE SET tenant = excluded.tenant, party = excluded.party, \
             state = excluded.state, version = excluded.version, changed_ms = excluded.changed_ms, \
             body = excluded.body",
        );
        let done = statement.build().persistent(false);
        done.execute(&mut *connection).await.map_err(trouble)?;
    }
    Ok(())
}

async fn delete(
    connection: &mut Connection,
    documents: &[(DocumentKind, String)],
) -> Result<(), Trouble> {
    for (kind, id) in documents {
        let done = sqlx::query("DELETE FROM documents WHERE kind = $1 AND id = $2");
        let done = done.bind(kind.name()).bind(id);
        done.execute(&mut *connection).await.map_err(trouble)?;
    }
    Ok(())
}

/// Writes a commit, or says why not.
pub(super) async fn commit(
    connection: &mut Connection,
    commit: &Commit,
) -> Result<Committed, Trouble> {
    if let Some((key, _)) = &commit.reply
        && let Some((fingerprint, reply)) =
            upkeep::reply(connection, &key.subject, &key.key).await?
    {
        return Ok(Committed::Repeated { fingerprint, reply });
    }
    if !holds(connection, &commit.seen).await? {
        return Ok(Committed::Moved);
    }
    if let Some(unless) = &commit.unless
        && !is_free(connection, unless).await?
    {
        return Ok(Committed::Moved);
    }
    if let Some(mark) = &commit.news
        && !history::move_mark(connection, mark).await?
    {
        return Ok(Committed::Moved);
    }
    delete(connection, &commit.deletes).await?;
    put(connection, &commit.puts).await?;
    messages::insert(connection, &commit.messages).await?;
    history::insert_failures(connection, &commit.failures).await?;
    upkeep::drop_replies(connection, &commit.untold).await?;
    if let Some((key, reply)) = &commit.reply {
        upkeep::keep_reply(connection, key, reply).await?;
    }
    Ok(Committed::Done)
}

/// Drops quotes from before an instant.
pub(super) async fn drop_quotes(
    connection: &mut Connection,
    before_ms: i64,
) -> Result<(), Trouble> {
    let done = sqlx::query("DELETE FROM documents WHERE kind = $1 AND changed_ms < $2");
    let done = done.bind(DocumentKind::Quote.name()).bind(before_ms);
    done.execute(connection).await.map_err(trouble)?;
    Ok(())
}
