//! What a provider is told whose service the registry does not take.

use crate::binary::{Server, Workspace, skyway};

/// A time zone that there is not, and a tariff below zero.
const SERVICE: &str = r#"
id = "acme:parcels"
name = "Parcels over the city"
network = "sydney"
payload_max_kg = 2.0
time_zone = "Sydney"
tariff = { currency = "AUD", base = "-4.00", per_km = "1.20", minimum = "5.00" }
hours = []
quality = { on_time_fraction = 0.95, tolerance_s = 120 }
"#;

#[test]
fn a_service_that_is_refused_is_told_with_the_place_of_each_fault() {
    let desk = Workspace::new();
    let file = desk.write("parcels.toml", SERVICE);
    let registry = Server::start(&desk, &["registry", "--store", &desk.path("registry.db")]);
    let address = format!("http://{}", registry.address);
    let refused = skyway(&["service", "publish", &file, "--registry", &address]).exits(1);
    for place in ["\n  /time_zone: ", "\n  /tariff/base: "] {
        assert!(refused.stderr.contains(place), "{}", refused.stderr);
    }
    assert_eq!(registry.end(), 0);
}
