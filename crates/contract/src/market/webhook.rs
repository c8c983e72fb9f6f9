//! Where customers and providers are told, by the Standard Webhooks specification.

use serde::{Deserialize, Serialize};

/// Whether a webhook is called.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WebhookState {
    /// It is.
    #[default]
    Active,
    /// It took nothing for a day, or wants nothing more (status 410), and is called no more until it is put again.
    Disabled,
}

/// An endpoint: the body of `PUT /v1/webhooks/{id}`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct WebhookDraft {
    /// Where it is called: https, at no private address, unless the registry is configured otherwise.
    #[schema(max_length = 2000)]
    pub url: String,
    /// The events it is called for: names such as `delivery.delivered`; all where none is named.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(max_items = 32)]
    pub events: Vec<String>,
}

/// An endpoint as it is kept.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Webhook {
    /// Its id.
    pub id: String,
    /// Whose it is.
    pub tenant: String,
    /// Where it is called.
    pub url: String,
    /// The events it is called for; all where none is named.
    pub events: Vec<String>,
    /// Whether it is called.
    pub state: WebhookState,
    /// Why it is disabled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The secret that signs its messages, `whsec_...`. Told once: when the webhook is made and when its secret is rotated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub secret: Option<String>,
    /// Until when messages are signed with the secret before, too, RFC 3339.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub former_secret_until: Option<String>,
}

/// A page of webhooks, by id.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Webhooks {
    /// The webhooks.
    pub webhooks: Vec<Webhook>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
}

/// How a message stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WebhookMessageState {
    /// To be sent, or sent again.
    Pending,
    /// The endpoint has taken it.
    Delivered,
    /// The endpoint did not take it for a day, or is called no more.
    GivenUp,
}

/// A message to an endpoint.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct WebhookMessage {
    /// Its id, the `webhook-id` of every attempt.
    pub id: String,
    /// What it tells, such as `delivery.delivered`.
    pub event: String,
    /// When it was made, RFC 3339.
    #[schema(format = DateTime)]
    pub created_at: String,
    /// How it stands.
    pub state: WebhookMessageState,
    /// How often it was sent, since it was made or its owner had it sent again.
    pub attempts: u32,
    /// When it is sent next, RFC 3339.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub next_attempt_at: Option<String>,
    /// What came of the last attempt: a status, or why there was none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_outcome: Option<String>,
}

/// A page of messages, the newest first.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct WebhookMessages {
    /// The messages.
    pub messages: Vec<WebhookMessage>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
}
