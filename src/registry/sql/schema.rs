//! The tables of a store, as plain as SQL gets, so that every engine that speaks like PostgreSQL serves them.
//!
//! A step, once released, is never changed: what is to be different is a further step. Whatever a step does has
//! to leave the version before able to read and write.

/// The steps from an empty database to the schema of this version; the number of steps is its number.
pub(in crate::registry) const STEPS: &[&[&str]] = &[&[
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
]];

/// Where the number of the schema and the identity stand; older than every step.
pub(in crate::registry) const FACTS: &str =
    "CREATE TABLE IF NOT EXISTS facts (name TEXT PRIMARY KEY, value TEXT NOT NULL)";
