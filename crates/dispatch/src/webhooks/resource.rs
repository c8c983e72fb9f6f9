//! Webhooks as their owners put, read, rotate and delete them.
//!
//! An id begins with the tenant, `TENANT:NAME`, as those of drones do, so that no tenant learns which names others have.

use super::endpoint::Endpoint;
use super::guard::{GuardedNames, UnfitUrl};
use crate::Dispatch;
use crate::directory::{etag, tenant_before_colon};
use skyway_contract::{DeliveryStatus, Fault, Webhook, WebhookDraft, Webhooks};
use skyway_registry::documents::{Commit, Committed, Document, DocumentKind, Seen};
use skyway_registry::store::StoreError;
use skyway_service::access::{Caller, Owners};
use skyway_service::intake::{Expected, PageRequest};
use skyway_service::refusal::{Code, Refusal};

/// The most webhooks of a tenant.
const WEBHOOKS_MAX: u64 = 32;
/// The most events that a webhook names.
const EVENTS_MAX: usize = 32;
/// How often a write is decided anew because others got in between.
const DECISIONS: u32 = 16;
const WHAT: &str = "webhook";

/// A webhook, and its version as an entity tag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaggedWebhook {
    /// The webhook.
    pub webhook: Webhook,
    /// Its version.
    pub etag: String,
    /// Whether it is new.
    pub created: bool,
}

impl Dispatch {
    /// The webhooks that a caller sees, by id.
    ///
    /// # Errors
    /// When the page is none, or the store does not answer.
    pub async fn webhooks(&self, caller: &Caller, page: &PageRequest) -> Result<Webhooks, Refusal> {
        let is_own = caller.role.is_of_tenant();
        let (kind, tenant) = (DocumentKind::Webhook, is_own.then_some(&*caller.tenant));
        let (documents, next_page_token) = self.page_of(kind, tenant, page).await?;
        let now_ms = self.clock.now().as_millisecond();
        let views = documents.iter().map(|document| {
            let endpoint = Endpoint::of(document)?;
            Ok(endpoint.view(document, now_ms, false))
        });
        Ok(Webhooks {
            webhooks: views.collect::<Result<_, Refusal>>()?,
            next_page_token,
        })
    }

    /// A webhook.
    ///
    /// # Errors
    /// When the caller sees none of this id, or the store does not answer.
    pub async fn webhook(&self, caller: &Caller, id: &str) -> Result<TaggedWebhook, Refusal> {
        let document = self.webhook_document(caller, id).await?;
        self.tagged(&document, false)
    }

    /// Puts a webhook under an id, new or in place of the version that is named. The answer to a new one has its secret.
    ///
    /// # Errors
    /// When its URL, its events or its id cannot be, it has another version, there are too many, or the store does not
    /// answer.
    pub async fn put_webhook(
        &self,
        caller: &Caller,
        id: &str,
        draft: &WebhookDraft,
        if_match: Option<String>,
    ) -> Result<TaggedWebhook, Refusal> {
        let tenant = tenant_before_colon(caller, DocumentKind::Webhook, id)?;
        self.check_draft(draft).await?;
        let expected = Expected::of(if_match);
        for _ in 0..DECISIONS {
            let before = self.documents.document(DocumentKind::Webhook, id).await?;
            let tag = before.as_ref().map(etag);
            expected.check(tag.as_deref(), WHAT, id)?;
            let endpoint = match &before {
                Some(document) => Endpoint::of(document)?.put(draft),
                None => {
                    self.check_room(&tenant).await?;
                    Endpoint::new(draft)?
                }
            };
            let after = self.next(&endpoint, id, &tenant, before.as_ref())?;
            if self.replace(before.as_ref(), &after).await? {
                return self.tagged(&after, before.is_none());
            }
        }
        Err(StoreError::Contended.into())
    }

    /// Gives a webhook a new secret, which the answer has; the one before signs for another day, too.
    ///
    /// # Errors
    /// When the caller sees none of this id, it was rotated too often, or the store does not answer.
    pub async fn rotate_webhook(
        &self,
        caller: &Caller,
        id: &str,
    ) -> Result<TaggedWebhook, Refusal> {
        for _ in 0..DECISIONS {
            let before = self.webhook_document(caller, id).await?;
            let now_ms = self.clock.now().as_millisecond();
            let endpoint = Endpoint::of(&before)?.rotate(now_ms)?;
            let after = self.next(&endpoint, id, &before.tenant, Some(&before))?;
            if self.replace(Some(&before), &after).await? {
                return self.tagged(&after, true);
            }
        }
        Err(StoreError::Contended.into())
    }

    /// Deletes the version of a webhook that is named. What was to be sent to it is given up.
    ///
    /// # Errors
    /// When the caller sees none of this id, it has another version, or the store does not answer.
    pub async fn delete_webhook(
        &self,
        caller: &Caller,
        id: &str,
        if_match: Option<String>,
    ) -> Result<(), Refusal> {
        let expected = Expected::of(if_match);
        for _ in 0..DECISIONS {
            let before = self.webhook_document(caller, id).await?;
            expected.check(Some(&etag(&before)), WHAT, id)?;
            let commit = Commit {
                seen: vec![seen(id, Some(&before))],
                deletes: vec![(DocumentKind::Webhook, id.to_owned())],
                ..Commit::default()
            };
            if self.documents.commit(&commit).await? != Committed::Moved {
                return Ok(());
            }
        }
        Err(StoreError::Contended.into())
    }

    /// The document of a webhook that the caller sees.
    pub(super) async fn webhook_document(
        &self,
        caller: &Caller,
        id: &str,
    ) -> Result<Document, Refusal> {
        let document = self.documents.document(DocumentKind::Webhook, id).await?;
        let seen = document.filter(|document| {
            caller.sees(&Owners {
                tenant: &document.tenant,
                party: &document.party,
            })
        });
        seen.ok_or_else(|| Refusal::not_found(WHAT, id))
    }

    async fn check_draft(&self, draft: &WebhookDraft) -> Result<(), Refusal> {
        let names = GuardedNames::of_system(self.settings.webhooks_anywhere);
        if let Err(unfit) = names.check(&draft.url).await {
            return Err(Refusal::at(Code::BodyInvalid, url_fault(&unfit)));
        }
        if draft.events.len() > EVENTS_MAX {
            let message = format!("there are more than {EVENTS_MAX} events");
            return Err(invalid("/events", "events_too_many", message, None));
        }
        for (place, event) in draft.events.iter().enumerate() {
            if !is_event(event) {
                let names = DeliveryStatus::ALL.map(event_of).join(", ");
                let message = format!("there is no event '{event}'");
                let hint = Some(format!("events are {names}"));
                let pointer = format!("/events/{place}");
                return Err(invalid(&pointer, "event_unknown", message, hint));
            }
        }
        Ok(())
    }

    async fn check_room(&self, tenant: &str) -> Result<(), Refusal> {
        let kind = DocumentKind::Webhook;
        let count = self.documents.count_documents(kind, Some(tenant)).await?;
        if count < WEBHOOKS_MAX {
            return Ok(());
        }
        let detail = format!("'{tenant}' has {WEBHOOKS_MAX} webhooks already");
        Err(Refusal::new(Code::LimitReached, detail))
    }

    fn next(
        &self,
        endpoint: &Endpoint,
        id: &str,
        tenant: &str,
        before: Option<&Document>,
    ) -> Result<Document, Refusal> {
        let version = before.map_or(1, |before| before.version + 1);
        let now_ms = self.clock.now().as_millisecond();
        endpoint.document(id, tenant, version, now_ms)
    }

    /// Puts a document in place of what was seen; tells whether that still held.
    async fn replace(&self, before: Option<&Document>, after: &Document) -> Result<bool, Refusal> {
        let commit = Commit {
            seen: vec![seen(&after.id, before)],
            puts: vec![after.clone()],
            ..Commit::default()
        };
        Ok(self.documents.commit(&commit).await? != Committed::Moved)
    }

    fn tagged(&self, document: &Document, is_secret_told: bool) -> Result<TaggedWebhook, Refusal> {
        let now_ms = self.clock.now().as_millisecond();
        let webhook = Endpoint::of(document)?.view(document, now_ms, is_secret_told);
        Ok(TaggedWebhook {
            webhook,
            etag: etag(document),
            created: document.version == 1,
        })
    }
}

fn url_fault(unfit: &UnfitUrl) -> Fault {
    let code = match unfit {
        UnfitUrl::Unreadable(_) | UnfitUrl::TooLong => "url_invalid",
        UnfitUrl::Scheme(_) => "url_not_https",
        UnfitUrl::Credentials => "url_with_credentials",
        UnfitUrl::NotPublic(_) => "url_not_public",
    };
    Fault {
        code: code.to_owned(),
        pointer: "/url".to_owned(),
        message: unfit.to_string(),
        hint: None,
    }
}

fn invalid(pointer: &str, code: &str, message: String, hint: Option<String>) -> Refusal {
    let fault = Fault {
        code: code.to_owned(),
        pointer: pointer.to_owned(),
        message,
        hint,
    };
    Refusal::at(Code::BodyInvalid, fault)
}

/// The event of a delivery that comes to stand so.
fn event_of(status: DeliveryStatus) -> String {
    format!("delivery.{}", status.name())
}

fn is_event(name: &str) -> bool {
    DeliveryStatus::ALL
        .iter()
        .any(|&status| event_of(status) == name)
}

fn seen(id: &str, before: Option<&Document>) -> Seen {
    Seen {
        kind: DocumentKind::Webhook,
        id: id.to_owned(),
        version: before.map(|before| before.version),
    }
}
