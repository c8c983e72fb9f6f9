//! What is asked of the database beside the log: kept answers, compaction, and who follows.

use super::{Connection, Database, trouble};
use crate::sql::{ROWS_AT_ONCE, Trouble, signed, unsigned};
use crate::store::{Compaction, EdgeHeard, KeptReply, ReplyKey, StoreError};
use skyway_contract::LoggedChange;
use sqlx::{QueryBuilder, Row as _};
use tokio_stream::StreamExt;

/// What was answered under a key, and the fingerprint of the request.
pub(super) async fn reply(
    connection: &mut Connection,
    subject: &str,
    key: &str,
) -> Result<Option<(String, KeptReply)>, Trouble> {
    let statement = "SELECT fingerprint, created, etag, object_id, body FROM replies \
                     WHERE subject = $1 AND idempotency_key = $2";
    let row = sqlx::query(statement)
        .bind(subject)
        .bind(key)
        .fetch_optional(connection);
    let Some(row) = row.await.map_err(trouble)? else {
        return Ok(None);
    };
    let created: i64 = row.try_get(1).map_err(trouble)?;
    let kept = KeptReply {
        created: created != 0,
        etag: row.try_get(2).map_err(trouble)?,
        id: row.try_get(3).map_err(trouble)?,
        body: row.try_get(4).map_err(trouble)?,
    };
    Ok(Some((row.try_get(0).map_err(trouble)?, kept)))
}

/// Keeps an answer.
pub(super) async fn keep_reply(
    connection: &mut Connection,
    key: &ReplyKey,
    reply: &KeptReply,
) -> Result<(), Trouble> {
    let statement = "INSERT INTO replies (subject, idempotency_key, fingerprint, at_ms, bytes, created, etag, object_id, \
                     body) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9)";
    let done = sqlx::query(statement)
        .bind(&key.subject)
        .bind(&key.key)
        .bind(&key.fingerprint)
        .bind(key.at_ms)
        .bind(signed(reply.body.len() as u64))
        .bind(i64::from(reply.created))
        .bind(&reply.etag)
        .bind(&reply.id)
        .bind(&reply.body);
    done.execute(connection).await.map_err(trouble)?;
    Ok(())
}

/// Drops answers that tell of some objects.
pub(super) async fn drop_replies(
    connection: &mut Connection,
    objects: &[String],
) -> Result<(), Trouble> {
    for some in objects.chunks(ROWS_AT_ONCE) {
        let mut statement =
            QueryBuilder::<Database>::new("DELETE FROM replies WHERE object_id IN (");
        let mut ids = statement.separated(", ");
        for id in some {
            ids.push_bind(id.clone());
        }
        statement.push(")");
        let done = statement.build().persistent(false);
        done.execute(&mut *connection).await.map_err(trouble)?;
    }
    Ok(())
}

/// Drops answers from before an instant, and beyond a size in bytes the oldest of the subjects that have the most, so that
/// none drives out what a lesser one has.
pub(super) async fn forget_replies(
    connection: &mut Connection,
    before_ms: i64,
    bytes_max: u64,
) -> Result<(), Trouble> {
    let old = sqlx::query("DELETE FROM replies WHERE at_ms < $1").bind(before_ms);
    old.execute(&mut *connection).await.map_err(trouble)?;
    let statement =
        "SELECT subject, CAST(SUM(bytes) AS BIGINT) FROM replies GROUP BY subject ORDER BY 2";
    let rows = sqlx::query(statement).fetch_all(&mut *connection);
    let rows = rows.await.map_err(trouble)?;
    let (mut room, mut subjects) = (bytes_max, rows.len() as u64);
    for row in rows {
        let bytes = row.try_get(1).map_err(trouble)?;
        let bytes = unsigned(bytes, "a number of bytes")?;
        // Those with less leave more to the others.
        let share = room / subjects;
        if bytes > share {
            let subject: String = row.try_get(0).map_err(trouble)?;
            forget_oldest(connection, &subject, share).await?;
        }
        room -= bytes.min(share);
        subjects -= 1;
    }
    Ok(())
}

/// Drops the oldest answers to a subject beyond a size in bytes.
async fn forget_oldest(
    connection: &mut Connection,
    subject: &str,
    bytes_max: u64,
) -> Result<(), Trouble> {
    let mut cutoff_ms = i64::MIN;
    {
        let statement = "SELECT at_ms, bytes FROM replies WHERE subject = $1 ORDER BY at_ms DESC";
        let mut rows = sqlx::query(statement).bind(subject).fetch(&mut *connection);
        let mut bytes = 0_u64;
        while let Some(row) = rows.next().await {
            let row = row.map_err(trouble)?;
            let size = row.try_get(1).map_err(trouble)?;
            bytes = bytes.saturating_add(unsigned(size, "a number of bytes")?);
            if bytes > bytes_max {
                let at_ms: i64 = row.try_get(0).map_err(trouble)?;
                cutoff_ms = at_ms.saturating_add(1);
                break;
            }
        }
    }
    let statement = "DELETE FROM replies WHERE subject = $1 AND at_ms < $2";
    let done = sqlx::query(statement).bind(subject).bind(cutoff_ms);
    done.execute(connection).await.map_err(trouble)?;
    Ok(())
}

/// Drops what is older than a revision and superseded by then.
pub(super) async fn compact(
    connection: &mut Connection,
    compaction: &Compaction,
    base: &LoggedChange,
) -> Result<(), Trouble> {
    let network = &compaction.network;
    let oldest = signed(compaction.oldest);
    let base_revision = signed(compaction.base_revision);
    let superseded = "DELETE FROM changes WHERE network = $1 AND revision <= $2 AND kind <> 'network' AND EXISTS \
                      (SELECT 1 FROM changes n WHERE n.network = changes.network AND n.kind = changes.kind \
                      AND n.id = changes.id AND n.revision > changes.revision AND n.revision <= $2)";
    let tombstones =
        "DELETE FROM changes WHERE network = $1 AND revision <= $2 AND operation = 'delete'";
    for statement in [superseded, tombstones] {
        let done = sqlx::query(statement).bind(network).bind(oldest);
        done.execute(&mut *connection).await.map_err(trouble)?;
    }
    let whole = "UPDATE changes SET operation = 'put', body = $3, bytes = $4, sha256 = $5 \
                 WHERE network = $1 AND kind = 'network' AND revision = $2";
    let done = sqlx::query(whole)
        .bind(network)
        .bind(base_revision)
        .bind(&compaction.base)
        .bind(signed(compaction.base.len() as u64))
        .bind(&base.sha256);
    done.execute(&mut *connection).await.map_err(trouble)?;
    let before = "DELETE FROM changes WHERE network = $1 AND kind = 'network' AND revision < $2";
    let done = sqlx::query(before).bind(network).bind(base_revision);
    done.execute(&mut *connection).await.map_err(trouble)?;
    let moved = "UPDATE networks SET oldest = $2 WHERE network = $1 AND oldest < $2";
    let done = sqlx::query(moved).bind(network).bind(oldest);
    done.execute(connection).await.map_err(trouble)?;
    Ok(())
}

/// Keeps when edges were heard.
pub(super) async fn keep_edges(
    connection: &mut Connection,
    heard: &[EdgeHeard],
    before_ms: i64,
) -> Result<(), Trouble> {
    let silent = sqlx::query("DELETE FROM edges WHERE heard_ms < $1").bind(before_ms);
    silent.execute(&mut *connection).await.map_err(trouble)?;
    let statement = "INSERT INTO edges (network, edge, epoch, revision, heard_ms, nack, url) \
                     VALUES ($1, $2, $3, $4, $5, $6, $7) \
                     ON CONFLICT (network, edge) DO UPDATE SET epoch = excluded.epoch, revision = excluded.revision, \
                     heard_ms = excluded.heard_ms, nack = excluded.nack, url = COALESCE(excluded.url, edges.url)";
    for edge in heard {
        // A refusal is text and numbers, and always has a JSON form.
        let nack = edge.nack.as_ref();
        let nack = nack.map(|nack| serde_json::to_string(nack).unwrap_or_default());
        let done = sqlx::query(statement)
            .bind(&edge.network)
            .bind(&edge.edge)
            .bind(signed(edge.epoch))
            .bind(signed(edge.revision))
            .bind(edge.heard_ms)
            .bind(nack)
            .bind(&edge.url);
        done.execute(&mut *connection).await.map_err(trouble)?;
    }
    Ok(())
}

/// When edges were heard, by network and id.
pub(super) async fn edges(connection: &mut Connection) -> Result<Vec<EdgeHeard>, Trouble> {
    let statement = "SELECT network, edge, epoch, revision, heard_ms, nack, url FROM edges ORDER BY network, edge";
    let rows = sqlx::query(statement)
        .fetch_all(connection)
        .await
        .map_err(trouble)?;
    let mut edges = Vec::with_capacity(rows.len());
    for row in rows {
        let nack: Option<String> = row.try_get(5).map_err(trouble)?;
        let nack = nack.map(|text| serde_json::from_str(&text)).transpose();
        let nack = nack.map_err(|error| StoreError::Damaged {
            message: format!("a refusal of an edge: {error}"),
        })?;
        edges.push(EdgeHeard {
            network: row.try_get(0).map_err(trouble)?,
            edge: row.try_get(1).map_err(trouble)?,
            epoch: unsigned(row.try_get(2).map_err(trouble)?, "an epoch")?,
            revision: unsigned(row.try_get(3).map_err(trouble)?, "a revision")?,
            heard_ms: row.try_get(4).map_err(trouble)?,
            nack,
            url: row.try_get(6).map_err(trouble)?,
        });
    }
    Ok(edges)
}
