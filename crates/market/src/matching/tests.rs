//! Each reason why a service fits or does not.

use super::{Fit, Misfit, Sought, Supply, fit, way_s};
use jiff::Timestamp;
use skyway_contract::{Money, OpeningHours, PublishedService, ServiceQuality, ServiceTariff};

fn service() -> PublishedService {
    PublishedService {
        id: Some("s".to_owned()),
        provider: Some("p".to_owned()),
        name: "Parcels".to_owned(),
        network: "n".to_owned(),
        area: None,
        airframe: None,
        payload_max_kg: 3.0,
        time_zone: "UTC".to_owned(),
        hours: Vec::new(),
        tariff: ServiceTariff {
            currency: "AUD".to_owned(),
            base: "5".parse().unwrap(),
            per_km: "1".parse().unwrap(),
            per_kg_km: "0".parse().unwrap(),
            per_minute: "0".parse().unwrap(),
            minimum: "0".parse().unwrap(),
        },
        quality: Some(ServiceQuality {
            on_time_fraction: 0.95,
            tolerance_s: 60.0,
        }),
        valid_from: None,
        valid_until: None,
    }
}

fn at(text: &str) -> Timestamp {
    text.parse().unwrap()
}

fn sought() -> Sought<'static> {
    Sought {
        payload_kg: 1.0,
        now: at("2026-11-25T08:00:00Z"),
        ready_at: at("2026-11-25T08:00:00Z"),
        arrive_by: None,
        price_max: None,
        on_time_min_fraction: None,
    }
}

const SUPPLY: Supply<'static> = Supply {
    is_suspended: false,
    outside: None,
    length_m: Some(1_600.0),
    drones: 2,
    fetch_m: 160.0,
};

fn code(found: Result<Fit, Misfit>) -> &'static str {
    found.map_or_else(|misfit| misfit.code(), |_| "fits")
}

fn aud(amount: &str) -> Money {
    Money {
        amount: amount.parse().unwrap(),
        currency: "AUD".to_owned(),
    }
}

#[test]
fn what_fits_has_a_price_and_times() {
    let found = fit(&service(), &sought(), &SUPPLY).unwrap();
    assert_eq!(found.price, aud("6.60"));
    assert_eq!(found.pickup_at, at("2026-11-25T08:00:10Z"));
    assert_eq!(found.arrives_at, at("2026-11-25T08:01:50Z"));
    let reasons = [
        "it serves all of the network",
        "it carries up to 3 kg",
        "2 drones are free",
    ];
    assert_eq!(found.reasons, reasons);
}

#[test]
fn a_drone_is_fetched_while_the_parcel_is_made_ready() {
    for (ready_at, pickup_at) in [
        ("2026-11-25T09:00:00Z", "2026-11-25T09:00:00Z"),
        ("2026-11-25T08:00:04Z", "2026-11-25T08:00:10Z"),
    ] {
        let ahead = Sought {
            ready_at: at(ready_at),
            ..sought()
        };
        let found = fit(&service(), &ahead, &SUPPLY).unwrap();
        assert_eq!(found.pickup_at, at(pickup_at), "{ready_at}");
    }
}

#[test]
fn each_lack_has_its_code() {
    let supplies = [
        (
            "suspended",
            Supply {
                is_suspended: true,
                ..SUPPLY
            },
        ),
        (
            "area",
            Supply {
                outside: Some("7"),
                ..SUPPLY
            },
        ),
        (
            "no_way",
            Supply {
                length_m: None,
                ..SUPPLY
            },
        ),
        (
            "no_drone",
            Supply {
                drones: 0,
                ..SUPPLY
            },
        ),
    ];
    for (expected, supply) in supplies {
        assert_eq!(code(fit(&service(), &sought(), &supply)), expected);
    }
}

#[test]
fn each_wish_has_its_code() {
    let (dear, euros) = (
        aud("6.59"),
        Money {
            currency: "EUR".to_owned(),
            ..aud("9")
        },
    );
    let asked = [
        (
            "payload",
            Sought {
                payload_kg: 3.1,
                ..sought()
            },
        ),
        (
            "quality",
            Sought {
                on_time_min_fraction: Some(0.96),
                ..sought()
            },
        ),
        (
            "price",
            Sought {
                price_max: Some(&dear),
                ..sought()
            },
        ),
        (
            "currency",
            Sought {
                price_max: Some(&euros),
                ..sought()
            },
        ),
        (
            "arrival",
            Sought {
                arrive_by: Some(at("2026-11-25T08:01:49Z")),
                ..sought()
            },
        ),
        (
            "fits",
            Sought {
                arrive_by: Some(at("2026-11-25T08:01:50Z")),
                ..sought()
            },
        ),
    ];
    for (expected, asked) in asked {
        assert_eq!(code(fit(&service(), &asked, &SUPPLY)), expected);
    }
}

#[test]
fn hours_delay_the_pickup_or_rule_it_out() {
    let opens_at_nine = PublishedService {
        hours: vec![OpeningHours {
            days: Vec::new(),
            from: "09:00".to_owned(),
            until: "17:00".to_owned(),
        }],
        ..service()
    };
    let found = fit(&opens_at_nine, &sought(), &SUPPLY).unwrap();
    assert_eq!(found.pickup_at, at("2026-11-25T09:00:00Z"));
    let early = Sought {
        arrive_by: Some(at("2026-11-25T09:00:00Z")),
        ..sought()
    };
    assert_eq!(code(fit(&opens_at_nine, &early, &SUPPLY)), "hours");
}

#[test]
fn validity_is_that_of_the_pickup() {
    let valid = |from: &str, until: &str| PublishedService {
        valid_from: Some(from.to_owned()),
        valid_until: Some(until.to_owned()),
        ..service()
    };
    let day = ("2026-11-25T00:00:00Z", "2026-11-26T00:00:00Z");
    assert_eq!(code(fit(&valid(day.0, day.1), &sought(), &SUPPLY)), "fits");
    let wrong = [
        ("2026-11-25T08:00:11Z", day.1),
        (day.0, "2026-11-25T08:00:10Z"),
        ("soon", day.1),
    ];
    for (from, until) in wrong {
        assert_eq!(
            code(fit(&valid(from, until), &sought(), &SUPPLY)),
            "validity"
        );
    }
}

#[test]
fn a_way_beyond_a_battery_takes_as_long_as_drones_took() {
    // Fetches of 11,000 deliveries, in metres, and their median time from take-off to pickup, in seconds.
    for (length_m, took_s) in [
        (5_787.0, 417.0),
        (9_946.0, 702.0),
        (15_971.0, 1_798.0),
        (25_803.0, 3_616.0),
    ] {
        let told_s = way_s(length_m);
        assert!(
            (0.85..1.05).contains(&(told_s / took_s)),
            "{length_m} m: {told_s} s"
        );
    }
}
