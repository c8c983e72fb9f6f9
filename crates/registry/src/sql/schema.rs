//! The tables of a store, as plain as SQL gets, so that every engine that speaks like PostgreSQL serves them.
//!
//! A step, once released, is never changed: what is to be different is a further step. Whatever a step does has
//! to leave the version before able to read and write.

/// The steps from an empty database to the schema of this version; the number of steps is its number.
pub(crate) const STEPS: &[&[&str]] = &[LOG, MARKET, OPEN_ORDERS];

/// The log, and who follows it.
const LOG: &[&str] = &[
    "CREATE TABLE networks (
        network TEXT PRIMARY KEY,
        head BIGINT NOT NULL,
        oldest BIGINT NOT NULL,
        topology_epoch BIGINT NOT NULL,
        topology_revision BIGINT NOT NULL,
        zones BIGINT NOT NULL,
        closures BIGINT NOT NULL
    )",
    "CREATE TABLE changes (
        network TEXT NOT NULL,
        kind TEXT NOT NULL,
        id TEXT NOT NULL,
        revision BIGINT NOT NULL,
        position BIGINT NOT NULL,
        epoch BIGINT NOT NULL,
        made_at TEXT NOT NULL,
        subject TEXT NOT NULL,
        operation TEXT NOT NULL,
        body TEXT,
        bytes BIGINT NOT NULL,
        sha256 TEXT NOT NULL,
        PRIMARY KEY (network, kind, id, revision)
    )",
    "CREATE UNIQUE INDEX changes_in_order ON changes (network, revision, position)",
    "CREATE TABLE replies (
        subject TEXT NOT NULL,
        idempotency_key TEXT NOT NULL,
        fingerprint TEXT NOT NULL,
        at_ms BIGINT NOT NULL,
        bytes BIGINT NOT NULL,
        created BIGINT NOT NULL,
        etag TEXT,
        object_id TEXT NOT NULL,
        body TEXT NOT NULL,
        PRIMARY KEY (subject, idempotency_key)
    )",
    "CREATE INDEX replies_by_age ON replies (at_ms)",
    "CREATE TABLE edges (
        network TEXT NOT NULL,
        edge TEXT NOT NULL,
        epoch BIGINT NOT NULL,
        revision BIGINT NOT NULL,
        heard_ms BIGINT NOT NULL,
        nack TEXT,
        PRIMARY KEY (network, edge)
    )",
];

/// Documents, what is to be sent because of them, and what edges tell. Positions have tables of each engine.
const MARKET: &[&str] = &[
    "ALTER TABLE edges ADD COLUMN url TEXT",
    "CREATE TABLE documents (
        kind TEXT NOT NULL,
        id TEXT NOT NULL,
        tenant TEXT NOT NULL,
        party TEXT NOT NULL,
        state TEXT NOT NULL,
        version BIGINT NOT NULL,
        changed_ms BIGINT NOT NULL,
        body TEXT NOT NULL,
        PRIMARY KEY (kind, id)
    )",
    "CREATE INDEX documents_by_tenant ON documents (kind, tenant, id)",
    "CREATE INDEX documents_by_party ON documents (kind, party, id)",
    "CREATE INDEX documents_by_state ON documents (kind, state, id)",
    "CREATE TABLE messages (
        id TEXT PRIMARY KEY,
        webhook TEXT NOT NULL,
        subject TEXT NOT NULL,
        number BIGINT NOT NULL,
        event TEXT NOT NULL,
        body TEXT NOT NULL,
        created_ms BIGINT NOT NULL,
        due_ms BIGINT NOT NULL,
        attempts BIGINT NOT NULL,
        state TEXT NOT NULL,
        last_outcome TEXT
    )",
    "CREATE INDEX messages_of_webhook ON messages (webhook, created_ms, id)",
    "CREATE INDEX messages_due ON messages (due_ms, id) WHERE state = 'pending'",
    "CREATE INDEX messages_in_order ON messages (webhook, subject, number) WHERE state = 'pending'",
    "CREATE INDEX messages_settled ON messages (due_ms) WHERE state <> 'pending'",
    "CREATE TABLE failures (
        network TEXT NOT NULL,
        edge TEXT NOT NULL,
        lineage BIGINT NOT NULL,
        number BIGINT NOT NULL,
        at_ms BIGINT NOT NULL,
        failure_type TEXT NOT NULL,
        segment TEXT NOT NULL,
        outcome TEXT NOT NULL,
        PRIMARY KEY (network, edge, lineage, number)
    )",
    "CREATE INDEX failures_by_time ON failures (network, at_ms)",
    "CREATE TABLE news_marks (
        network TEXT NOT NULL,
        edge TEXT NOT NULL,
        lineage BIGINT NOT NULL,
        through BIGINT NOT NULL,
        PRIMARY KEY (network, edge, lineage)
    )",
];

/// How many orders of a customer are not over is asked with each order.
const OPEN_ORDERS: &[&str] =
    &["CREATE INDEX deliveries_of_tenant ON documents (tenant, state) WHERE kind = 'delivery'"];

/// Where the number of the schema and the identity stand; older than every step.
pub(crate) const FACTS: &str =
    "CREATE TABLE IF NOT EXISTS facts (name TEXT PRIMARY KEY, value TEXT NOT NULL)";
