//! What is asked of the database about messages that wait to be sent, and those that were.

use super::{Connection, Database, Row, trouble};
use crate::documents::{Followers, Message, Settlement};
use crate::sql::{ROWS_AT_ONCE, Trouble, signed, unsigned};
use sqlx::{QueryBuilder, Row as _};

/// The columns of a message, in the order that `message_of` reads them.
macro_rules! message_columns {
    () => {
        "m.id, m.webhook, m.subject, m.number, m.event, m.body, m.created_ms, m.due_ms, m.attempts, m.state, \
         m.last_outcome"
    };
}

/// That a message is to be sent, and none before it to the same webhook about the same subject.
///
/// As a subquery, which looks in the index of one subject. As `NOT EXISTS` it is a join, for which PostgreSQL goes through all
/// that are to be sent, for each of them, while it has no statistics.
macro_rules! is_first {
    () => {
        "m.state = 'pending' AND m.id = (SELECT e.id FROM messages e WHERE e.state = 'pending' \
         AND e.webhook = m.webhook AND e.subject = m.subject ORDER BY e.number, e.id LIMIT 1)"
    };
}

fn message_of(row: &Row) -> Result<Message, Trouble> {
    let attempts = unsigned(row.try_get(8).map_err(trouble)?, "a number of attempts")?;
    Ok(Message {
        id: row.try_get(0).map_err(trouble)?,
        webhook: row.try_get(1).map_err(trouble)?,
        subject: row.try_get(2).map_err(trouble)?,
        number: unsigned(row.try_get(3).map_err(trouble)?, "the number of a message")?,
        event: row.try_get(4).map_err(trouble)?,
        body: row.try_get(5).map_err(trouble)?,
        created_ms: row.try_get(6).map_err(trouble)?,
        due_ms: row.try_get(7).map_err(trouble)?,
        attempts: u32::try_from(attempts).unwrap_or(u32::MAX),
        state: row.try_get(9).map_err(trouble)?,
        last_outcome: row.try_get(10).map_err(trouble)?,
    })
}

/// Puts messages; those that are there already stay as they are.
pub(super) async fn insert(
    connection: &mut Connection,
    messages: &[Message],
) -> Result<(), Trouble> {
    for some in messages.chunks(ROWS_AT_ONCE) {
        let mut statement = QueryBuilder::<Database>::new(
            "INSERT INTO messages (id, webhook, subject, number, event, body, created_ms, due_ms, attempts, state, \
             last_outcome) ",
        );
        statement.push_values(some, |mut row, message| {
            row.push_bind(message.id.clone())
                .push_bind(message.webhook.clone())
                .push_bind(message.subject.clone())
                .push_bind(signed(message.number))
                .push_bind(message.event.clone())
                .push_bind(message.body.clone())
                .push_bind(message.created_ms)
                .push_bind(message.due_ms)
                .push_bind(i64::from(message.attempts))
                .push_bind(message.state.clone())
                .push_bind(message.last_outcome.clone());
        });
        statement.push(" ON CONFLICT (id) DO NOTHING");
        let done = statement.build().persistent(false);
        done.execute(&mut *connection).await.map_err(trouble)?;
    }
    Ok(())
}

/// Messages that are due and first of their webhook and subject, the longest due first; without those of some webhooks.
pub(super) async fn due(
    connection: &mut Connection,
    now_ms: i64,
    limit: u64,
    without: &[String],
) -> Result<Vec<Message>, Trouble> {
    let asked = concat!(
        "SELECT ",
        message_columns!(),
        " FROM messages m WHERE ",
        is_first!(),
        " AND m.due_ms <= "
    );
    let mut statement = QueryBuilder::<Database>::new(asked);
    statement.push_bind(now_ms);
    if !without.is_empty() {
        statement.push(" AND m.webhook NOT IN (");
        let mut listed = statement.separated(", ");
        for webhook in without {
            listed.push_bind(webhook);
        }
        statement.push(")");
    }
    statement.push(" ORDER BY m.due_ms, m.id LIMIT ");
    statement.push_bind(signed(limit));
    let rows = statement.build().fetch_all(connection);
    let rows = rows.await.map_err(trouble)?;
    rows.iter().map(message_of).collect()
}

/// When the next message is due that is first of its webhook and subject; none where none waits.
pub(super) async fn next_due(connection: &mut Connection) -> Result<Option<i64>, Trouble> {
    let statement = concat!(
        "SELECT m.due_ms FROM messages m WHERE ",
        is_first!(),
        " ORDER BY m.due_ms, m.id LIMIT 1"
    );
    let found = sqlx::query(statement).fetch_optional(connection);
    let found = found.await.map_err(trouble)?;
    found.map(|row| row.try_get(0).map_err(trouble)).transpose()
}

/// Notes what became of messages. Tells of each whether it was noted.
pub(super) async fn settle(
    connection: &mut Connection,
    settled: &[Settlement],
) -> Result<Vec<bool>, Trouble> {
    let mut noted = Vec::with_capacity(settled.len());
    for settlement in settled {
        let is_noted = note(connection, settlement).await?;
        if is_noted {
            move_followers(connection, settlement).await?;
        }
        noted.push(is_noted);
    }
    Ok(noted)
}

async fn note(connection: &mut Connection, settlement: &Settlement) -> Result<bool, Trouble> {
    let statement = "UPDATE messages SET due_ms = $2, attempts = $3, state = $4, last_outcome = $5 WHERE id = $1 \
                     AND ($6 IS NULL OR (state = 'pending' AND attempts = $6))";
    let message = &settlement.message;
    let done = sqlx::query(statement)
        .bind(&message.id)
        .bind(message.due_ms)
        .bind(i64::from(message.attempts))
        .bind(&message.state)
        .bind(&message.last_outcome)
        .bind(settlement.attempts_before.map(i64::from));
    let done = done.execute(connection).await.map_err(trouble)?;
    Ok(done.rows_affected() == 1)
}

/// Moves the messages that wait behind one that was settled.
async fn move_followers(
    connection: &mut Connection,
    settlement: &Settlement,
) -> Result<(), Trouble> {
    let statement = match settlement.followers() {
        Followers::Stay => return Ok(()),
        Followers::NotBefore => {
            "UPDATE messages SET due_ms = $1 WHERE state = 'pending' AND webhook = $2 AND subject = $3 \
             AND number > $4 AND due_ms < $1"
        }
        Followers::By => {
            "UPDATE messages SET due_ms = $1 WHERE state = 'pending' AND webhook = $2 AND subject = $3 \
             AND number > $4 AND due_ms > $1"
        }
    };
    let message = &settlement.message;
    let done = sqlx::query(statement)
        .bind(message.due_ms)
        .bind(&message.webhook)
        .bind(&message.subject)
        .bind(signed(message.number));
    done.execute(connection).await.map_err(trouble)?;
    Ok(())
}

/// Messages of a webhook, the newest first, before an instant and id.
pub(super) async fn of_webhook(
    connection: &mut Connection,
    webhook: &str,
    before: Option<&(i64, String)>,
    limit: u64,
) -> Result<Vec<Message>, Trouble> {
    let statement = concat!(
        "SELECT ",
        message_columns!(),
        " FROM messages m WHERE m.webhook = $1 AND (m.created_ms < $2 OR (m.created_ms = $2 AND m.id < $3)) \
         ORDER BY m.created_ms DESC, m.id DESC LIMIT $4"
    );
    let (before_ms, before_id) = match before {
        Some((at_ms, id)) => (*at_ms, id.as_str()),
        None => (i64::MAX, ""),
    };
    let asked = sqlx::query(statement)
        .bind(webhook)
        .bind(before_ms)
        .bind(before_id)
        .bind(signed(limit));
    let rows = asked.fetch_all(connection).await.map_err(trouble)?;
    rows.iter().map(message_of).collect()
}

/// A message; none where there is none.
pub(super) async fn message(
    connection: &mut Connection,
    id: &str,
) -> Result<Option<Message>, Trouble> {
    let statement = concat!(
        "SELECT ",
        message_columns!(),
        " FROM messages m WHERE m.id = $1"
    );
    let found = sqlx::query(statement).bind(id).fetch_optional(connection);
    let found = found.await.map_err(trouble)?;
    found.map(|row| message_of(&row)).transpose()
}

/// Drops settled messages from before an instant.
pub(super) async fn drop_settled(
    connection: &mut Connection,
    before_ms: i64,
) -> Result<(), Trouble> {
    let statement = "DELETE FROM messages WHERE state <> 'pending' AND due_ms < $1";
    let done = sqlx::query(statement).bind(before_ms);
    done.execute(connection).await.map_err(trouble)?;
    Ok(())
}
