//! For whom quotes are.

use super::ordering::{accepting, quoted};
use super::world::{World, customer, of};
use skyway::access::Role;
use skyway::refusal::Code;
use skyway::registry::WriteOptions;
use skyway::wire::{DeliveryOrder, QuoteRequest};

/// Who may everything states the customer in both; a customer has its own quotes alone.
#[tokio::test]
async fn a_quote_is_for_the_customer_that_is_named() {
    let world = World::with_drones(&["depot"]).await;
    let named = |customer: &str| QuoteRequest {
        customer: Some(customer.to_owned()),
        ..quoted()
    };
    let anyone = of(Role::Anyone, "local");
    let quote = world.dispatch.create_quote(&anyone, named("shop"));
    let quote = quote.await.expect("a quote");
    assert_eq!(quote.customer, "shop");
    let order = |customer: &str| DeliveryOrder {
        customer: Some(customer.to_owned()),
        ..accepting(&quote)
    };
    let options = WriteOptions::default();
    let (other, own) = (order("other"), order("shop"));
    let refused = world.dispatch.create_delivery(&anyone, &other, &options);
    assert_eq!(refused.await.unwrap_err().code, Code::NotFound);
    let placed = world.dispatch.create_delivery(&anyone, &own, &options);
    let placed = placed.await.expect("an order");
    assert_eq!(world.delivery(&placed.id).await.customer, "shop");
    for (caller, name, code) in [
        (customer("shop"), "other", Code::Forbidden),
        (anyone, "a b", Code::PlanInvalid),
    ] {
        let refused = world.dispatch.create_quote(&caller, named(name));
        assert_eq!(refused.await.unwrap_err().code, code, "{name}");
    }
}
