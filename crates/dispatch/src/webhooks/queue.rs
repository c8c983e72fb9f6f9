//! Messages to webhooks: made with what they tell of, listed for their owners, sent again where they ask for it.

use super::endpoint::{Endpoint, state_name};
use crate::Dispatch;
use jiff::Timestamp;
use skyway_contract::{Fault, WebhookMessage, WebhookMessageState, WebhookMessages, WebhookState};
use skyway_registry::documents::{DocumentKind, DocumentQuery, Message, Settlement};
use skyway_service::access::Caller;
use skyway_service::intake::{PageRequest, token};
use skyway_service::refusal::{Code, Refusal};
use std::slice;

/// More than a tenant may have.
const WEBHOOKS_LIMIT: u64 = 100;

/// What is told, to whom.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Telling<'a> {
    /// The tenants whose webhooks are called.
    pub(crate) tenants: &'a [&'a str],
    /// What it tells, such as `delivery.delivered`.
    pub(crate) event: &'a str,
    /// What it is about; messages about one thing are sent in the order of their numbers.
    pub(crate) subject: &'a str,
    /// Rises within a subject.
    pub(crate) number: u64,
    /// Its JSON.
    pub(crate) body: &'a str,
}

impl Dispatch {
    /// The messages that tell something, one for each webhook that is called for it. They are to be committed with what
    /// they tell of, and [`Dispatch::messages`] to be notified afterwards.
    pub(crate) async fn messages_about(
        &self,
        telling: &Telling<'_>,
    ) -> Result<Vec<Message>, Refusal> {
        let now_ms = self.clock.now().as_millisecond();
        let mut messages = Vec::new();
        for (place, &tenant) in telling.tenants.iter().enumerate() {
            if telling.tenants[..place].contains(&tenant) {
                continue;
            }
            let query = DocumentQuery {
                kind: DocumentKind::Webhook,
                of: Some(tenant.to_owned()),
                states: vec![state_name(WebhookState::Active).to_owned()],
                after: None,
                limit: WEBHOOKS_LIMIT,
                is_newest_first: false,
            };
            for document in self.documents.documents(&query).await? {
                if Endpoint::of(&document)?.takes(telling.event) {
                    messages.push(message(&document.id, telling, now_ms)?);
                }
            }
        }
        Ok(messages)
    }

    /// The messages of a webhook, the newest first.
    ///
    /// # Errors
    /// When the caller sees no webhook of this id, the page is none, or the store does not answer.
    pub async fn webhook_messages(
        &self,
        caller: &Caller,
        id: &str,
        page: &PageRequest,
    ) -> Result<WebhookMessages, Refusal> {
        let page = page.check()?;
        self.webhook_document(caller, id).await?;
        let before = page.after.as_deref().map(read_place).transpose()?;
        let limit = page.size as u64 + 1;
        let mut messages = self.documents.messages(id, before, limit).await?;
        let has_more = messages.len() > page.size;
        messages.truncate(page.size);
        let last = messages.last().filter(|_| has_more);
        Ok(WebhookMessages {
            next_page_token: last.map(|last| token(&format!("{}:{}", last.created_ms, last.id))),
            messages: messages.iter().map(view).collect(),
        })
    }

    /// Sends a message again, as one that was never sent.
    ///
    /// # Errors
    /// When the caller sees no such webhook or message, or the store does not answer.
    pub async fn resend_message(
        &self,
        caller: &Caller,
        id: &str,
        message_id: &str,
    ) -> Result<WebhookMessage, Refusal> {
        self.webhook_document(caller, id).await?;
        let found = match message_id.chars().any(char::is_control) {
            true => None,
            false => self.documents.message(message_id).await?,
        };
        let found = found.filter(|message| message.webhook == id);
        let mut message = found.ok_or_else(|| Refusal::not_found("message", message_id))?;
        message.state = PENDING.to_owned();
        message.attempts = 0;
        message.due_ms = self.clock.now().as_millisecond();
        let settlement = Settlement {
            message,
            attempts_before: None,
        };
        let noted = self
            .documents
            .settle_messages(slice::from_ref(&settlement))
            .await?;
        if noted != [true] {
            return Err(Refusal::not_found("message", message_id));
        }
        self.messages.notify_one();
        Ok(view(&settlement.message))
    }
}

/// How messages stand in the store.
pub(super) const PENDING: &str = "pending";
/// See [`PENDING`].
pub(super) const DELIVERED: &str = "delivered";
/// See [`PENDING`].
pub(super) const GIVEN_UP: &str = "given_up";

fn message(webhook: &str, telling: &Telling<'_>, now_ms: i64) -> Result<Message, Refusal> {
    let random = getrandom::u64().and_then(|high| Ok((high, getrandom::u64()?)));
    let (high, low) = random.map_err(|error| {
        let detail = format!("the system has no random bits: {error}");
        Refusal::new(Code::Internal, detail)
    })?;
    Ok(Message {
        id: format!("msg_{high:016x}{low:016x}"),
        webhook: webhook.to_owned(),
        subject: telling.subject.to_owned(),
        number: telling.number,
        event: telling.event.to_owned(),
        body: telling.body.to_owned(),
        created_ms: now_ms,
        due_ms: now_ms,
        attempts: 0,
        state: PENDING.to_owned(),
        last_outcome: None,
    })
}

fn view(message: &Message) -> WebhookMessage {
    let at = |ms| {
        Timestamp::from_millisecond(ms)
            .unwrap_or_default()
            .to_string()
    };
    let state = match message.state.as_str() {
        DELIVERED => WebhookMessageState::Delivered,
        GIVEN_UP => WebhookMessageState::GivenUp,
        _ => WebhookMessageState::Pending,
    };
    let is_pending = state == WebhookMessageState::Pending;
    WebhookMessage {
        id: message.id.clone(),
        event: message.event.clone(),
        created_at: at(message.created_ms),
        state,
        attempts: message.attempts,
        next_attempt_at: is_pending.then(|| at(message.due_ms)),
        last_outcome: message.last_outcome.clone(),
    }
}

/// The message after which a page begins.
fn read_place(key: &str) -> Result<(i64, String), Refusal> {
    let place = key.split_once(':').and_then(|(created_ms, id)| {
        let created_ms = created_ms.parse().ok()?;
        Some((created_ms, id.to_owned()))
    });
    place.ok_or_else(|| {
        let fault = Fault {
            code: "page_invalid".to_owned(),
            pointer: "?page_token".to_owned(),
            message: "it is not a token that a page gave".to_owned(),
            hint: None,
        };
        Refusal::at(Code::ParameterInvalid, fault)
    })
}
