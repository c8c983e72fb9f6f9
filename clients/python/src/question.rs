//! The arguments of a call as a request to the engine.

use crate::ground::Ground;
use crate::refusal::{Kind, Refusal};
use pyo3::prelude::*;
use pyo3::types::{PyIterator, PyString};
use skyway_engine::airspace::{Airspace, Hits};
use skyway_engine::flight::{FailureReport, FailureType, Location};
use skyway_engine::network::NodeIx;
use skyway_engine::recompose::{BroughtZone, Parameters, Request, Scope, Strategy};
use skyway_formats::{ZoneId, zone_from_feature};
use std::sync::Arc;

/// What says that the place of a drone is unknown.
const UNKNOWN: &str = "unknown";
const SCOPES: [(Scope, &str); 2] = [(Scope::Local, "local"), (Scope::Global, "global")];

/// A value by its name, or which names there are.
pub(crate) fn named<T: Copy>(
    place: &str,
    given: &str,
    all: impl Iterator<Item = (T, &'static str)> + Clone,
) -> Result<T, Refusal> {
    let mut each = all.clone();
    if let Some((value, _)) = each.find(|(_, name)| *name == given) {
        return Ok(value);
    }
    let names: Vec<&str> = all.map(|(_, name)| name).collect();
    let refusal = Refusal::new(
        Kind::Request,
        "unknown_value",
        place,
        format!("'{given}' is not known"),
    );
    Err(refusal.hint(format!("give one of {}", names.join(", "))))
}

/// How an answer is to be found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct How {
    pub(crate) failure: FailureType,
    pub(crate) strategy: Strategy,
    pub(crate) scope: Scope,
    pub(crate) parameters: Parameters,
}

impl How {
    pub(crate) fn of(
        failure: &str,
        strategy: &str,
        scope: &str,
        parameters: Parameters,
    ) -> Result<Self, Refusal> {
        let failures = FailureType::ALL.into_iter().map(|one| (one, one.name()));
        let strategies = Strategy::ALL.into_iter().map(|one| (one, one.name()));
        Ok(Self {
            failure: named("failure", failure, failures)?,
            strategy: named("strategy", strategy, strategies)?,
            scope: named("scope", scope, SCOPES.into_iter())?,
            parameters,
        })
    }

    /// A request about a leg of which the start is where the drone is.
    pub(crate) fn request(&self, leg: (NodeIx, NodeIx), destination: NodeIx) -> Request {
        Request {
            strategy: self.strategy,
            scope: self.scope,
            parameters: self.parameters,
            ..Request::exact(FailureReport {
                failure: self.failure,
                leg,
                location: Location::LegStart,
                cause_location: None,
                destination,
                remaining_path: None,
            })
        }
    }
}

/// The numbers that the paper leaves open, refused where no strategy can work with them.
pub(crate) fn parameters(
    cell_size_m: Option<f64>,
    val_ratio: Option<f64>,
    stage_skipping: bool,
    full_tree: bool,
) -> Result<Parameters, Refusal> {
    let defaults = Parameters::default();
    let is_positive = |number: f64| number.is_finite() && number > 0.0;
    let wrong = |place: &str, number: f64, hint: &str| {
        Refusal::new(
            Kind::Request,
            "out_of_range",
            place,
            format!("it is {number}"),
        )
        .hint(hint)
    };
    if let Some(size_m) = cell_size_m.filter(|&size_m| !is_positive(size_m)) {
        return Err(wrong("cell_size_m", size_m, "give metres above 0"));
    }
    let val_ratio = val_ratio.unwrap_or(defaults.val_ratio);
    if !is_positive(val_ratio) {
        return Err(wrong("val_ratio", val_ratio, "give a number above 0"));
    }
    Ok(Parameters {
        cell_size_m,
        val_ratio,
        stage_skipping,
        full_tree,
        ..defaults
    })
}

/// What a report says beside its leg and its destination.
pub(crate) struct Circumstances<'a, 'py> {
    pub(crate) location: Option<&'a Bound<'py, PyAny>>,
    pub(crate) cause_location: Option<&'a Bound<'py, PyAny>>,
    pub(crate) remaining_path: Option<&'a Bound<'py, PyAny>>,
    pub(crate) zone: Option<&'a Bound<'py, PyAny>>,
}

impl Circumstances<'_, '_> {
    /// Fills them into a request.
    pub(crate) fn fill(
        &self,
        request: &mut Request,
        ground: &Ground,
        airspace: &Airspace,
    ) -> PyResult<()> {
        let report = &mut request.report;
        if let Some(given) = self.location {
            report.location = location(ground, given, report.leg.0)?;
        }
        if let Some(given) = self.cause_location {
            report.cause_location = Some(ground.place(given, "cause_location")?);
        }
        if let Some(given) = self.remaining_path {
            report.remaining_path = Some(remaining_path(ground, given, report.leg)?);
        }
        if let Some(given) = self.zone {
            request.zone = Some(brought(given, airspace)?);
        }
        Ok(())
    }
}

fn location(ground: &Ground, given: &Bound<'_, PyAny>, start: NodeIx) -> PyResult<Location> {
    if let Ok(text) = given.cast::<PyString>()
        && text.to_cow()? == UNKNOWN
    {
        return Ok(Location::Unknown);
    }
    let place = ground.place(given, "location")?;
    Ok(match place == ground.topology.position(start) {
        true => Location::LegStart,
        false => Location::At(place),
    })
}

/// The entries of what holds several.
pub(crate) fn each<'py>(
    given: &Bound<'py, PyAny>,
    place: &str,
) -> PyResult<Bound<'py, PyIterator>> {
    given.try_iter().map_err(|error| {
        let refusal = Refusal::new(Kind::Request, "not_a_list", place, error.to_string());
        refusal.hint("give a list").into()
    })
}

fn remaining_path(
    ground: &Ground,
    given: &Bound<'_, PyAny>,
    leg: (NodeIx, NodeIx),
) -> PyResult<Vec<NodeIx>> {
    let mut nodes = Vec::new();
    for (number, node) in each(given, "remaining_path")?.enumerate() {
        nodes.push(ground.node(&node?, &format!("remaining_path[{number}]"))?);
    }
    if nodes.len() >= 2 && (nodes[0], nodes[1]) == leg {
        return Ok(nodes);
    }
    let message = "the remaining path does not begin with the failed leg";
    let refusal = Refusal::new(
        Kind::Request,
        "not_the_remaining_path",
        "remaining_path",
        message,
    );
    Err(refusal
        .hint("give the nodes ahead, the node behind the drone first")
        .into())
}

/// A zone that the report brings: a GeoJSON feature, as a mapping or as text.
fn brought(given: &Bound<'_, PyAny>, airspace: &Airspace) -> PyResult<BroughtZone> {
    let text: String = match given.cast::<PyString>() {
        Ok(text) => text.to_cow()?.into_owned(),
        Err(_) => given
            .py()
            .import("json")?
            .call_method1("dumps", (given,))?
            .extract()?,
    };
    let feature = serde_json::from_str(&text).map_err(|error| {
        Refusal::new(Kind::Airspace, "zone_unreadable", "zone", error.to_string())
            .hint("give a GeoJSON feature")
    })?;
    let topology = airspace.topology();
    let zone = zone_from_feature(&feature, ZoneId::StatedOr("brought"), topology.frame())
        .map_err(|problems| Refusal::of_zones(&problems))?;
    if !zone.counts_at(airspace.as_of(), airspace.horizon()) {
        let message = "no window of the zone meets the time of this network";
        let refusal = Refusal::new(Kind::Airspace, "zone_not_active", "zone", message);
        return Err(refusal
            .hint("state the time with network.with_closures(at=...)")
            .into());
    }
    let hits = Hits::of(topology, &zone);
    Ok(BroughtZone {
        zone: Arc::new(zone),
        hits,
    })
}
