//! What is kept of a webhook, as a document.

use super::secret::Secret;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use skyway_contract::{Webhook, WebhookDraft, WebhookState};
use skyway_registry::documents::{Document, DocumentKind};
use skyway_service::refusal::{Code, Refusal};

/// For so long a secret that was replaced signs, too.
const FORMER_SIGNS_MS: i64 = 24 * 3_600_000;
/// The most of them that sign at once. An owner who rotates twice, as the first answer was lost, still has one that signs.
const FORMER_MAX: usize = 4;

/// The body of a webhook's document. Its id, tenant and version are the document's.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Endpoint {
    pub(super) url: String,
    pub(super) events: Vec<String>,
    pub(super) state: WebhookState,
    /// Why it is disabled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) reason: Option<String>,
    secret: Secret,
    /// Those that it has replaced, the oldest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    former: Vec<FormerSecret>,
}

/// A secret that was replaced.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct FormerSecret {
    secret: Secret,
    /// Until when it signs, in milliseconds since 1970.
    until_ms: i64,
}

impl FormerSecret {
    fn signs_at(&self, now_ms: i64) -> bool {
        now_ms < self.until_ms
    }
}

/// The name of a state in the store.
pub(super) fn state_name(state: WebhookState) -> &'static str {
    match state {
        WebhookState::Active => "active",
        WebhookState::Disabled => "disabled",
    }
}

impl Endpoint {
    /// A new one, with a secret of its own.
    pub(super) fn new(draft: &WebhookDraft) -> Result<Self, Refusal> {
        Ok(Self {
            url: draft.url.clone(),
            events: draft.events.clone(),
            state: WebhookState::Active,
            reason: None,
            secret: fresh_secret()?,
            former: Vec::new(),
        })
    }

    /// The same with what its owner has put: it is called again, with the secrets it has.
    pub(super) fn put(mut self, draft: &WebhookDraft) -> Self {
        self.url.clone_from(&draft.url);
        self.events.clone_from(&draft.events);
        self.state = WebhookState::Active;
        self.reason = None;
        self
    }

    /// The same with a new secret; the one before signs for a while, too.
    pub(super) fn rotate(mut self, now_ms: i64) -> Result<Self, Refusal> {
        self.former.retain(|former| former.signs_at(now_ms));
        if self.former.len() == FORMER_MAX {
            let detail = format!("it was rotated {FORMER_MAX} times within a day; try again later");
            return Err(Refusal::new(Code::LimitReached, detail));
        }
        let secret = std::mem::replace(&mut self.secret, fresh_secret()?);
        let until_ms = now_ms.saturating_add(FORMER_SIGNS_MS);
        self.former.push(FormerSecret { secret, until_ms });
        Ok(self)
    }

    /// The same, called no more.
    pub(super) fn disable(mut self, reason: &str) -> Self {
        self.state = WebhookState::Disabled;
        self.reason = Some(reason.to_owned());
        self
    }

    /// Whether it is called for an event.
    pub(super) fn takes(&self, event: &str) -> bool {
        self.events.is_empty() || self.events.iter().any(|wanted| wanted == event)
    }

    /// The signatures of a message that is sent now, separated by spaces, that of the newest secret first.
    pub(super) fn sign(&self, id: &str, now: Timestamp, body: &str) -> String {
        let former = self.former.iter().rev();
        let former = former.filter(|former| former.signs_at(now.as_millisecond()));
        let secrets = std::iter::once(&self.secret).chain(former.map(|former| &former.secret));
        let signatures: Vec<String> = secrets
            .filter_map(|secret| secret.sign(id, now.as_second(), body))
            .collect();
        signatures.join(" ")
    }

    /// A webhook as its owner sees it; with its secret where that is new.
    pub(super) fn view(&self, document: &Document, now_ms: i64, is_secret_told: bool) -> Webhook {
        let last = self.former.last().filter(|last| last.signs_at(now_ms));
        let until = last.and_then(|last| Timestamp::from_millisecond(last.until_ms).ok());
        Webhook {
            id: document.id.clone(),
            tenant: document.tenant.clone(),
            url: self.url.clone(),
            events: self.events.clone(),
            state: self.state,
            reason: self.reason.clone(),
            secret: is_secret_told.then(|| self.secret.told().to_owned()),
            former_secret_until: until.map(|until| until.to_string()),
        }
    }

    /// What a document keeps.
    pub(super) fn of(document: &Document) -> Result<Self, Refusal> {
        serde_json::from_str(&document.body).map_err(|error| {
            let detail = format!("webhook '{}' cannot be read: {error}", document.id);
            Refusal::new(Code::Internal, detail)
        })
    }

    /// The document that keeps it, in its next version.
    pub(super) fn document(
        &self,
        id: &str,
        tenant: &str,
        version: u64,
        now_ms: i64,
    ) -> Result<Document, Refusal> {
        let body = serde_json::to_string(self).map_err(|error| {
            Refusal::new(
                Code::Internal,
                format!("a webhook has no JSON form: {error}"),
            )
        })?;
        Ok(Document {
            kind: DocumentKind::Webhook,
            id: id.to_owned(),
            tenant: tenant.to_owned(),
            party: String::new(),
            state: state_name(self.state).to_owned(),
            version,
            changed_ms: now_ms,
            body,
        })
    }
}

fn fresh_secret() -> Result<Secret, Refusal> {
    Secret::fresh().map_err(|error| {
        Refusal::new(
            Code::Internal,
            format!("the system has no random bits: {error}"),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draft() -> WebhookDraft {
        WebhookDraft {
            url: "https://shop.example/hooks".to_owned(),
            events: vec!["delivery.delivered".to_owned()],
        }
    }

    #[test]
    fn rotated_secrets_sign_beside_the_new_one_for_a_day() {
        let first = Endpoint::new(&draft()).expect("random bits");
        let second = first.clone().rotate(1_000).expect("random bits");
        let third = second.clone().rotate(2_000).expect("random bits");
        let signs = |at_ms, signing: &[&Endpoint]| {
            let now = Timestamp::from_millisecond(at_ms).expect("an instant");
            let signed = signing
                .iter()
                .map(|endpoint| endpoint.secret.sign("m", now.as_second(), "{}"));
            let signed: Vec<String> = signed.map(|signature| signature.expect("a key")).collect();
            assert_eq!(third.sign("m", now, "{}"), signed.join(" "), "{at_ms}");
        };
        signs(999 + FORMER_SIGNS_MS, &[&third, &second, &first]);
        signs(1_000 + FORMER_SIGNS_MS, &[&third, &second]);
        signs(2_000 + FORMER_SIGNS_MS, &[&third]);
    }

    #[test]
    fn so_many_secrets_sign_at_once_and_no_more() {
        let mut endpoint = Endpoint::new(&draft()).expect("random bits");
        for now_ms in 0..4 {
            endpoint = endpoint.rotate(now_ms).expect("there is room");
        }
        let refused = endpoint.clone().rotate(5).expect_err("there is none");
        assert_eq!(refused.code, Code::LimitReached);
        assert!(endpoint.rotate(FORMER_SIGNS_MS).is_ok());
    }

    #[test]
    fn a_document_gives_back_what_it_keeps_and_a_view_tells_the_secret_only_when_asked() {
        let endpoint = Endpoint::new(&draft())
            .expect("random bits")
            .disable("gone");
        let document = endpoint
            .document("shop:a", "shop", 3, 7)
            .expect("has a JSON form");
        assert_eq!((document.state.as_str(), document.version), ("disabled", 3));
        assert_eq!(Endpoint::of(&document), Ok(endpoint.clone()));
        let view = endpoint.view(&document, 0, false);
        assert_eq!((view.secret, view.reason.as_deref()), (None, Some("gone")));
        let told = endpoint.view(&document, 0, true).secret.expect("is told");
        assert!(told.starts_with("whsec_"));
        let again = endpoint.put(&draft());
        assert_eq!((again.state, again.reason), (WebhookState::Active, None));
    }
}
