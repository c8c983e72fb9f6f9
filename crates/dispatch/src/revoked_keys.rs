//! Keys of packs that were revoked: told to edges with every report of theirs, and to all who read packs.

use super::Dispatch;
use super::records::{Kept, absent, fresh, text};
use skyway_contract::{KeyRevocation, RevokedKey, RevokedKeys};
use skyway_registry::documents::{Commit, Committed, DocumentKind, DocumentQuery};
use skyway_registry::store::StoreError;
use skyway_service::access::Caller;
use skyway_service::intake::Faults;
use skyway_service::refusal::{Code, Refusal};

/// The most of them: a list that every edge can be told at once.
const REVOKED_MAX: u64 = 1_000;
/// The longest reason, in bytes.
const REASON_BYTES_MAX: usize = 500;
/// The digits of the id of a key.
const ID_DIGITS: usize = 16;

impl Dispatch {
    /// Revokes a key for good; one that is revoked stays as it was revoked first.
    ///
    /// # Errors
    /// When the id is none of a key, the reason is too long, there are too many, or the store does not answer.
    pub async fn revoke_key(
        &self,
        caller: &Caller,
        id: &str,
        revocation: KeyRevocation,
    ) -> Result<RevokedKey, Refusal> {
        check_id(id)?;
        let mut faults = Faults::default();
        faults.text("/reason", revocation.reason.as_deref(), REASON_BYTES_MAX);
        faults.check(Code::BodyInvalid, "revocation")?;
        let kind = DocumentKind::RevokedKey;
        if let Some(before) = self.documents.document(kind, id).await? {
            return Ok(Kept::read(before)?.value);
        }
        if self.documents.count_documents(kind, None).await? >= REVOKED_MAX {
            let detail = format!("{REVOKED_MAX} keys are revoked already");
            return Err(Refusal::new(Code::LimitReached, detail));
        }
        let now = self.clock.now();
        let key = RevokedKey {
            id: id.to_owned(),
            revoked_at: now.to_string(),
            revoked_by: caller.subject.to_string(),
            reason: revocation.reason,
        };
        let commit = Commit {
            seen: vec![absent(kind, id)],
            puts: vec![fresh(kind, id, ("", ""), ("", text(&key)), now)],
            ..Commit::default()
        };
        if self.documents.commit(&commit).await? != Committed::Moved {
            tracing::warn!(key = id, by = %key.revoked_by, "a key of packs was revoked");
            return Ok(key);
        }
        // Another has revoked it meanwhile.
        let kept = self.documents.document(kind, id).await?;
        Ok(Kept::read(kept.ok_or(StoreError::Contended)?)?.value)
    }

    /// The keys that were revoked, by id.
    ///
    /// # Errors
    /// When the store does not answer.
    pub async fn revoked_keys(&self) -> Result<RevokedKeys, Refusal> {
        let query = DocumentQuery {
            kind: DocumentKind::RevokedKey,
            of: None,
            states: Vec::new(),
            after: None,
            limit: REVOKED_MAX,
            is_newest_first: false,
        };
        let documents = self.documents.documents(&query).await?;
        let keys = documents.into_iter().map(Kept::read);
        let keys = keys.map(|kept| kept.map(|kept| kept.value));
        Ok(RevokedKeys {
            keys: keys.collect::<Result<_, _>>()?,
        })
    }
}

fn check_id(id: &str) -> Result<(), Refusal> {
    let is_digit = |byte: &u8| matches!(byte, b'0'..=b'9' | b'a'..=b'f');
    if id.len() == ID_DIGITS && id.as_bytes().iter().all(is_digit) {
        return Ok(());
    }
    let mut faults = Faults::default();
    let message = format!("'{id}' is no id of a key");
    let hint =
        format!("write its {ID_DIGITS} hexadecimal digits, as GET /v1/keys of an edge lists them");
    faults.add("invalid", "{id}", message, Some(hint));
    faults.check(Code::ParameterInvalid, "id")
}
