//! Weather over gRPC is refused where REST refuses it.

use super::services::{code, passed, services};
use crate::api::grpc::proto;
use crate::api::problem::of_grpc_status;
use crate::edge::Code;
use proto::airspace_client::AirspaceClient;

#[tokio::test]
async fn a_message_that_was_left_empty_takes_no_weather_away() {
    let (routes, _) = services().await;
    let mut client = AirspaceClient::new(routes);
    let empty = proto::PutWeatherRequest::default();
    let refused = client.put_weather(passed(empty)).await;
    let refused = refused.expect_err("states nothing");
    assert_eq!(code(&refused), Code::BodyInvalid);
    let refusal = of_grpc_status(&refused).expect("a refusal");
    assert_eq!(refusal.faults[0].pointer, "/wind");
    let clear = proto::PutWeatherRequest {
        clear: true,
        ..Default::default()
    };
    let put = client.put_weather(passed(clear)).await;
    put.expect("nothing is known of the wind any more");
}
