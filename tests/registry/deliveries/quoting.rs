//! For whom quotes are, and how many a customer has at once.

use super::ordering::{accepting, quoted};
use super::world::{OPEN_MAX, World, customer, of};
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

#[tokio::test]
async fn a_customer_has_so_many_quotes_at_once_and_no_more() {
    let world = World::with_drones(&["depot"]).await;
    let shop = customer("shop");
    let ask = || world.dispatch.create_quote(&shop, quoted());
    let first = ask().await.expect("a quote");
    for _ in 1..OPEN_MAX {
        ask().await.expect("a quote");
    }
    let one_more = ask().await.unwrap_err();
    assert_eq!(one_more.code, Code::LimitReached);
    assert_eq!(
        one_more.detail,
        "'shop' has 320 quotes that can be accepted; accept some, or wait until they have expired"
    );
    let other = customer("other");
    let of_another = world.dispatch.create_quote(&other, quoted());
    of_another.await.expect("room for others");
    let accepted = world.try_order(&accepting(&first)).await;
    accepted.expect("an order");
    ask().await.expect("room again");
    assert_eq!(ask().await.unwrap_err().code, Code::LimitReached);
    world.pass(300);
    ask().await.expect("the others have expired");
}
