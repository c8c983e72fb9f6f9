//! The table of statuses, row by row, and news in any order.

use super::{Standing, Terms, fold};
use crate::seeded::Draws;
use skyway_contract::{DeliveryStatus, EndedAs, FleetDroneState, FlightNews, PlanState};

const TERMS: Terms<'static> = Terms {
    status: DeliveryStatus::Assigned,
    pickup: "shop",
    drop: "door",
    home: "depot",
    is_called_off: false,
    may_retry: true,
};

fn news(state: PlanState, stops_served: u32) -> FlightNews {
    FlightNews {
        plan_id: "delivery-1-1".to_owned(),
        delivery_id: "1".to_owned(),
        drone_id: Some("p:1".to_owned()),
        state,
        ended_as: None,
        version: 1,
        outcome: "composed".to_owned(),
        stops_served,
        stops: 2,
        holds: false,
        expected_at: "2026-11-25T08:00:00Z".to_owned(),
        causes: Vec::new(),
        place: None,
        landed_on: None,
    }
}

fn end(ended_as: EndedAs, stops_served: u32, landed_on: Option<&str>) -> FlightNews {
    FlightNews {
        ended_as: Some(ended_as),
        landed_on: landed_on.map(str::to_owned),
        ..news(PlanState::Ended, stops_served)
    }
}

fn from(status: DeliveryStatus) -> Terms<'static> {
    Terms { status, ..TERMS }
}

/// The table of the module, row by row.
#[test]
fn a_flight_as_it_goes() {
    let mut terms = TERMS;
    let flight = [
        (news(PlanState::Accepted, 0), DeliveryStatus::Assigned, None),
        (
            news(PlanState::Activated, 0),
            DeliveryStatus::PickingUp,
            Some(FleetDroneState::InFlight),
        ),
        (
            news(PlanState::Activated, 1),
            DeliveryStatus::InFlight,
            Some(FleetDroneState::InFlight),
        ),
        (
            news(PlanState::Nonconforming, 1),
            DeliveryStatus::InFlight,
            Some(FleetDroneState::InFlight),
        ),
        (
            news(PlanState::Activated, 2),
            DeliveryStatus::Delivered,
            Some(FleetDroneState::InFlight),
        ),
        (
            end(EndedAs::Delivered, 2, Some("depot")),
            DeliveryStatus::Delivered,
            Some(FleetDroneState::Available),
        ),
    ];
    for (news, status, drone) in flight {
        let standing = fold(&terms, &news);
        assert_eq!((standing.status, standing.drone), (status, drone));
        terms.status = standing.status;
    }
}

#[test]
fn a_flight_that_begins_at_the_pickup_has_the_parcel_at_once() {
    let terms = Terms {
        pickup: "depot",
        ..TERMS
    };
    let departed = fold(&terms, &news(PlanState::Activated, 0));
    assert_eq!(departed.status, DeliveryStatus::InFlight);
    let dropped = fold(&terms, &news(PlanState::Activated, 1));
    assert_eq!(dropped.status, DeliveryStatus::Delivered);
    let on_the_ground = fold(&terms, &end(EndedAs::Cancelled, 0, None));
    assert_eq!(on_the_ground.status, DeliveryStatus::Created);
    assert_eq!(on_the_ground.drone, Some(FleetDroneState::Available));
}

#[test]
fn a_flight_that_ends_at_the_drop_delivers_with_its_end() {
    let terms = Terms {
        drop: "depot",
        ..from(DeliveryStatus::InFlight)
    };
    let on_the_way = fold(&terms, &news(PlanState::Activated, 1));
    assert_eq!(on_the_way.status, DeliveryStatus::InFlight);
    let landed = fold(&terms, &end(EndedAs::Delivered, 1, Some("depot")));
    assert_eq!(landed.status, DeliveryStatus::Delivered);
    assert_eq!(landed.drone, Some(FleetDroneState::Available));
}

#[test]
fn a_drone_that_waits_is_told_as_holding() {
    let waits = FlightNews {
        holds: true,
        ..news(PlanState::Activated, 1)
    };
    let standing = fold(&from(DeliveryStatus::InFlight), &waits);
    assert_eq!(standing.status, DeliveryStatus::Holding);
    assert!(standing.reason.is_some());
}

#[test]
fn ends_with_the_parcel_on_board() {
    use DeliveryStatus::{Diverted, Failed, InFlight, Returned};
    let ends = [
        (
            end(EndedAs::Diverted, 1, Some("depot")),
            Returned,
            FleetDroneState::Available,
        ),
        (
            end(EndedAs::Diverted, 1, Some("shop")),
            Returned,
            FleetDroneState::OutOfService,
        ),
        (
            end(EndedAs::Diverted, 1, Some("roof")),
            Diverted,
            FleetDroneState::OutOfService,
        ),
        (
            end(EndedAs::Diverted, 1, None),
            Diverted,
            FleetDroneState::OutOfService,
        ),
        (
            end(EndedAs::Cancelled, 1, None),
            Failed,
            FleetDroneState::OutOfService,
        ),
        (
            end(EndedAs::Lost, 1, None),
            Failed,
            FleetDroneState::OutOfService,
        ),
    ];
    for (news, status, drone) in ends {
        let standing = fold(&from(InFlight), &news);
        assert_eq!(
            (standing.status, standing.drone),
            (status, Some(drone)),
            "{news:?}"
        );
        assert!(standing.is_over && standing.reason.is_some());
    }
}

#[test]
fn ends_before_the_pickup_are_tried_again_or_fail() {
    for ended_as in [EndedAs::Cancelled, EndedAs::Lost, EndedAs::Diverted] {
        let over = end(ended_as, 0, None);
        let terms = from(DeliveryStatus::PickingUp);
        assert_eq!(fold(&terms, &over).status, DeliveryStatus::Created);
        let last = Terms {
            may_retry: false,
            ..terms
        };
        assert_eq!(fold(&last, &over).status, DeliveryStatus::Failed);
    }
    let called_off = Terms {
        is_called_off: true,
        ..TERMS
    };
    let over = end(EndedAs::Cancelled, 0, None);
    assert_eq!(fold(&called_off, &over).status, DeliveryStatus::Cancelled);
}

/// A plan ends as delivered where its drone lands at home, though it turned back before.
#[test]
fn a_drone_that_turned_back_has_delivered_nothing() {
    use DeliveryStatus::{Assigned, Created, Delivered, Failed, InFlight, PickingUp, Returned};
    let home = |served| end(EndedAs::Delivered, served, Some("depot"));
    let at_home = |status| Terms {
        pickup: "depot",
        ..from(status)
    };
    let to_home = |status| Terms {
        drop: "depot",
        ..from(status)
    };
    let last = Terms {
        may_retry: false,
        ..from(PickingUp)
    };
    let ends = [
        (from(PickingUp), home(0), Created),
        (last, home(0), Failed),
        (from(InFlight), home(1), Returned),
        (from(InFlight), home(2), Delivered),
        (at_home(Assigned), home(0), Created),
        (at_home(InFlight), home(0), Returned),
        (at_home(InFlight), home(1), Delivered),
        (to_home(PickingUp), home(0), Created),
        (to_home(Assigned), home(1), Delivered),
        // An operator has said so.
        (from(InFlight), end(EndedAs::Delivered, 1, None), Delivered),
    ];
    for (terms, news, status) in ends {
        let standing = fold(&terms, &news);
        let drone = Some(FleetDroneState::Available);
        let expected = (status, drone, status != Delivered);
        let found = (standing.status, standing.drone, standing.reason.is_some());
        assert_eq!(found, expected, "{terms:?}: {news:?}");
    }
}

#[test]
fn late_news_of_acceptance_take_nothing_back() {
    let standing = fold(
        &from(DeliveryStatus::InFlight),
        &news(PlanState::Accepted, 0),
    );
    assert_eq!(
        (standing.status, standing.drone),
        (DeliveryStatus::InFlight, None)
    );
}

fn drawn_news(draws: &mut Draws) -> FlightNews {
    use PlanState::{Accepted, Activated, Contingent, Ended, Nonconforming};
    let state = draws.pick(&[Accepted, Activated, Nonconforming, Contingent, Ended]);
    let ends = [
        EndedAs::Delivered,
        EndedAs::Diverted,
        EndedAs::Cancelled,
        EndedAs::Lost,
    ];
    FlightNews {
        ended_as: (state == Ended && draws.below(8) > 0).then(|| draws.pick(&ends)),
        holds: draws.below(4) == 0,
        outcome: draws.pick(&["composed", "diverted", "no_route"]).to_owned(),
        landed_on: draws
            .pick(&[None, Some("depot"), Some("shop"), Some("roof")])
            .map(str::to_owned),
        ..news(state, draws.below(4) as u32)
    }
}

/// A final status stays; the same news again change nothing; whatever is told, a status comes of it.
#[test]
fn final_statuses_stay_and_replays_change_nothing() {
    for seed in 0..500 {
        let mut draws = Draws::new(seed);
        let mut terms = Terms {
            is_called_off: draws.below(2) == 0,
            may_retry: draws.below(2) == 0,
            pickup: draws.pick(&["shop", "depot"]),
            drop: draws.pick(&["door", "shop", "depot"]),
            ..from(draws.pick(&DeliveryStatus::ALL))
        };
        for _ in 0..20 {
            let news = drawn_news(&mut draws);
            let first: Standing = fold(&terms, &news);
            if terms.status.is_final() {
                assert_eq!(first.status, terms.status, "seed {seed}");
            }
            terms.status = first.status;
            let again = fold(&terms, &news);
            assert_eq!(again.status, first.status, "seed {seed}: {news:?} again");
        }
    }
}
