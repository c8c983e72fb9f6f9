//! What webhooks are told of deliveries: each change of status, without prices and without personal data.

use super::Dispatch;
use super::records::{Order, text};
use super::webhooks::Telling;
use serde_json::json;
use skyway_registry::documents::Message;
use skyway_service::refusal::Refusal;

impl Dispatch {
    /// The messages that tell how an order stands since its last change; to be committed with that.
    ///
    /// # Errors
    /// When the store does not answer.
    pub(super) async fn status_messages(&self, order: &Order) -> Result<Vec<Message>, Refusal> {
        let delivery = &order.delivery;
        let event = format!("delivery.{}", delivery.status.name());
        let mut data = json!({"delivery_id": delivery.id, "status": delivery.status});
        if let Some(expected_at) = &delivery.expected_at {
            data["expected_at"] = json!(expected_at);
        }
        let at = delivery.history.last().map(|change| change.at.as_str());
        let body = json!({"type": event, "timestamp": at, "data": data});
        let provider = delivery.provider.as_deref();
        let tenants: Vec<&str> = [Some(delivery.customer.as_str()), provider]
            .into_iter()
            .flatten()
            .collect();
        self.messages_about(&Telling {
            tenants: &tenants,
            event: &event,
            subject: &delivery.id,
            number: order.dispatch.changes,
            body: &text(&body),
        })
        .await
    }
}
