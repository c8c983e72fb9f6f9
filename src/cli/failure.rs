//! The failure report on the command line: what failed, and where the drone was.

use super::names;
use super::stop::Stop;
use crate::flight::{FailureReport, FailureType, Location, check_place};
use crate::network::Topology;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};

/// The word for a drone whose place is unknown.
const UNKNOWN: &str = "unknown";

/// What failed.
#[derive(Debug, Args)]
#[command(next_help_heading = "Failure")]
pub(super) struct FailureArguments {
    /// The failed leg: the node behind the drone and the node ahead of it
    #[arg(long, value_name = "A,B")]
    service: Option<String>,
    /// Where the delivery goes [default: B]
    #[arg(long, value_name = "NODE", requires = "service")]
    destination: Option<String>,
    /// What kind of failure it is
    #[arg(long = "type", value_name = "TYPE", default_value = "navigational", value_parser = failure_type(), requires = "service")]
    failure: FailureType,
    /// Where the drone is: LON,LAT in degrees (X,Y in metres on a planar network), a node, or unknown [default: at A]
    #[arg(
        long,
        value_name = "PLACE",
        allow_hyphen_values = true,
        requires = "service"
    )]
    location: Option<String>,
    /// Where the cause is, if the drone could tell: LON,LAT (X,Y) or a node
    #[arg(
        long,
        value_name = "PLACE",
        allow_hyphen_values = true,
        requires = "service"
    )]
    cause_location: Option<String>,
}

impl FailureArguments {
    /// True when a failure is named at all.
    pub(super) fn is_given(&self) -> bool {
        self.service.is_some()
    }

    /// The report, its names found in the network.
    pub(super) fn report(&self, topology: &Topology) -> Result<FailureReport, Stop> {
        let Some(service) = &self.service else {
            return Err(Stop::Usage(
                "name the failed leg with --service A,B".to_owned(),
            ));
        };
        let leg = names::leg(topology, service)?;
        let destination = match &self.destination {
            Some(id) => names::node(topology, id)?,
            None => leg.1,
        };
        let cause = self.cause_location.as_deref();
        let cause_location = cause
            .map(|place| names::place(topology, place))
            .transpose()?;
        let location = match self.location.as_deref() {
            None => Location::LegStart,
            Some(UNKNOWN) => Location::Unknown,
            Some(place) if topology.node(place) == Some(leg.0) => Location::LegStart,
            Some(place) => {
                let place = names::place(topology, place)?;
                check_place(topology, place, None, Some(leg)).map_err(|why| {
                    Stop::Usage(format!(
                        "--location {why}; say {UNKNOWN} where it is not known"
                    ))
                })?;
                Location::At(place)
            }
        };
        Ok(FailureReport {
            failure: self.failure,
            leg,
            location,
            cause_location,
            destination,
            remaining_path: None,
        })
    }
}

fn failure_type() -> impl TypedValueParser<Value = FailureType> {
    one_of(&FailureType::ALL, FailureType::name)
}

/// A value by its name on the wire.
pub(super) fn one_of<T: Copy + Send + Sync + 'static>(
    all: &'static [T],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    let names = all.iter().map(|&value| name(value));
    PossibleValuesParser::new(names).try_map(move |word| {
        let found = all.iter().copied().find(|&value| name(value) == word);
        found.ok_or_else(|| format!("{word} is not known"))
    })
}
