//! Failure reports: read leniently, as JSON is, so that a drone always gets an outcome.

use super::convert::{FromProto, IntoProto, Unreadable, instant_text, timestamp};
use super::convert_zone::{feature_of, zone_of};
use super::mirror::mirror;
use super::proto;
use crate::formats::{ParsedReport, ReadWarning};
use crate::wire;

mirror!(wire::Service => Service {
    plan_id: plain,
    leg: plain,
    from: plain,
    to: plain,
});

mirror!(wire::DroneFacts => DroneFacts {
    id: plain,
    battery_fraction: plain,
    payload_kg: plain,
    airframe: plain,
    airspeed_mps: plain,
});

mirror!(wire::Parameters => Parameters {
    cell_size_m: plain,
    val_ratio: plain,
    stage_skipping: plain,
    full_tree: plain,
});

impl IntoProto<proto::FailureReport> for wire::FailureReport {
    /// `close` stays behind: only files of requests have it.
    fn into_proto(self) -> proto::FailureReport {
        proto::FailureReport {
            id: self.id.into_proto(),
            r#type: self.failure.map_or(0, wire::FailureType::into_proto),
            service: self.service.into_proto(),
            location: self.location.into_proto(),
            cause_location: self.cause_location.into_proto(),
            timestamp: self.timestamp.as_deref().and_then(timestamp),
            zone: self.zone.as_ref().map(zone_of),
            drone: self.drone.into_proto(),
            remaining_path: self.remaining_path.unwrap_or_default().into_proto(),
            destination: self.destination.into_proto(),
            strategy: self.strategy.map_or(0, wire::Strategy::into_proto),
            scope: self.scope.map_or(0, wire::Scope::into_proto),
            parameters: self.parameters.into_proto(),
            objective: self.objective,
            optimum: self.optimum,
            deadline: self.deadline.as_deref().and_then(timestamp),
            explain: self.explain,
            dry_run: self.dry_run,
            location_unknown: self.location_unknown,
            detail: self.detail.map_or(0, wire::OperationalDetail::into_proto),
            node: self.node.into_proto(),
            pads: self.pads,
            wind_mps: self.wind_mps,
            gust_mps: self.gust_mps,
            visibility_m: self.visibility_m,
            airborne: self.airborne,
            location_age_s: self.location_age_s,
            leg: self.leg,
            fraction: self.fraction,
            altitude_m: self.altitude_m,
            altitude_reference: self.altitude_reference,
        }
    }
}

impl FromProto<proto::FailureReport> for wire::FailureReport {
    fn from_proto(message: proto::FailureReport) -> Result<Self, Unreadable> {
        Ok(parsed_report(message).report)
    }
}

/// The report of a message. What says nothing, or nothing that is known, is left out with the warning that
/// the same has in JSON.
pub(super) fn parsed_report(message: proto::FailureReport) -> ParsedReport {
    let mut reader = Reader {
        warnings: Vec::new(),
    };
    let report = reader.report(message);
    ParsedReport {
        report,
        warnings: reader.warnings,
    }
}

struct Reader {
    warnings: Vec<ReadWarning>,
}

impl Reader {
    fn report(&mut self, message: proto::FailureReport) -> wire::FailureReport {
        let has_location = message.location.is_some();
        let location = message
            .location
            .and_then(|place| self.place("location", place));
        let is_location_lost = has_location && location.is_none();
        let path = message.remaining_path;
        wire::FailureReport {
            id: message.id.map(wire::Id::new),
            failure: self.failure_type(message.r#type),
            detail: self.choice("detail", message.detail),
            node: message.node.map(wire::Id::new),
            pads: message.pads,
            wind_mps: self.number("wind_mps", message.wind_mps),
            gust_mps: self.number("gust_mps", message.gust_mps),
            visibility_m: self.number("visibility_m", message.visibility_m),
            airborne: message.airborne,
            location_age_s: self.number("location_age_s", message.location_age_s),
            leg: message.leg,
            fraction: self.number("fraction", message.fraction),
            altitude_m: self.number("altitude_m", message.altitude_m),
            altitude_reference: message.altitude_reference,
            service: message.service.map(|service| wire::Service {
                plan_id: service.plan_id,
                leg: service.leg,
                from: service.from.map(wire::Id::new),
                to: service.to.map(wire::Id::new),
            }),
            location,
            location_unknown: match is_location_lost {
                true => Some(true),
                false => message.location_unknown,
            },
            cause_location: message
                .cause_location
                .and_then(|place| self.place("cause_location", place)),
            timestamp: message.timestamp.as_ref().map(instant_text),
            zone: message.zone.as_ref().map(feature_of),
            drone: message.drone.map(|drone| self.drone(drone)),
            remaining_path: (!path.is_empty())
                .then(|| path.into_iter().map(wire::Id::new).collect()),
            destination: message.destination.map(wire::Id::new),
            strategy: self.choice("strategy", message.strategy),
            scope: self.choice("scope", message.scope),
            parameters: message
                .parameters
                .map(|parameters| self.parameters(parameters)),
            objective: message.objective,
            optimum: message.optimum,
            deadline: message.deadline.as_ref().map(instant_text),
            explain: message.explain,
            dry_run: message.dry_run,
            close: None,
        }
    }

    fn drone(&mut self, drone: proto::DroneFacts) -> wire::DroneFacts {
        wire::DroneFacts {
            id: drone.id,
            battery_fraction: self.number("drone.battery_fraction", drone.battery_fraction),
            payload_kg: self.number("drone.payload_kg", drone.payload_kg),
            airframe: drone.airframe,
            airspeed_mps: self.number("drone.airspeed_mps", drone.airspeed_mps),
        }
    }

    fn parameters(&mut self, parameters: proto::Parameters) -> wire::Parameters {
        wire::Parameters {
            cell_size_m: self.number("parameters.cell_size_m", parameters.cell_size_m),
            val_ratio: self.number("parameters.val_ratio", parameters.val_ratio),
            stage_skipping: parameters.stage_skipping,
            full_tree: parameters.full_tree,
        }
    }

    fn failure_type(&mut self, number: i32) -> Option<wire::FailureType> {
        self.known(number, "unknown_failure_type", || {
            format!("the failure type {number} is not known")
        })
    }

    fn choice<T: FromProto<i32>>(&mut self, name: &str, number: i32) -> Option<T> {
        self.known(number, "unknown_value", || {
            format!("'{name}' does not know {number}; the default is taken")
        })
    }

    /// A value of an enumeration. 0 says nothing, as a field that is absent from JSON.
    fn known<T: FromProto<i32>>(
        &mut self,
        number: i32,
        code: &'static str,
        message: impl FnOnce() -> String,
    ) -> Option<T> {
        if number == 0 {
            return None;
        }
        let value = T::from_proto(number).ok();
        if value.is_none() {
            self.warn(code, message());
        }
        value
    }

    fn place(&mut self, name: &str, place: proto::Place) -> Option<wire::Place> {
        let read = wire::Place::from_proto(place).ok();
        let place = read.filter(|place| match place {
            wire::Place::Pair([x, y]) | wire::Place::Planar { x, y } => {
                x.is_finite() && y.is_finite()
            }
            wire::Place::Node(_) => true,
        });
        if place.is_none() {
            let message = format!(
                "'{name}' is no place and is ignored; a place is 'lon_lat', 'planar' on a planar network, or 'node'"
            );
            self.warn("location_ignored", message);
        }
        place
    }

    fn number(&mut self, name: &str, number: Option<f64>) -> Option<f64> {
        let finite = number.filter(|number| number.is_finite());
        if finite != number {
            let message = format!("'{name}' is not finite and is ignored");
            self.warn("wrong_type", message);
        }
        finite
    }

    fn warn(&mut self, code: &'static str, message: String) {
        self.warnings.push(ReadWarning { code, message });
    }
}
