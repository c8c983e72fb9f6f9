//! Everything that a request flies in, compiled once and shared: network, drone, wind, rules, what is in the way.

use super::closed_windows::ClosedWindows;
use super::obstacles::Obstacles;
use super::occupancy::OthersOccupancy;
use super::pads::PadTimes;
use super::potentials::Potentials;
use super::request::{FlightWorld, Objective};
use crate::flight::{
    Airframe, FlightLegs, FlightRules, SharedCrossings, Situation, Vertical, WindField,
};
use crate::network::{NodeIx, Topology};
use std::sync::Arc;

/// A network with a drone, its payload, the wind and what is in the way. Cheap to clone.
#[derive(Clone, Debug)]
pub struct FlightSetting {
    topology: Arc<Topology>,
    airframe: Airframe,
    payload_kg: f64,
    wind: WindField,
    rules: FlightRules,
    vertical: Arc<Vertical>,
    crossings: SharedCrossings,
    legs: Arc<FlightLegs>,
    obstacles: Obstacles,
    pads: PadTimes,
}

impl FlightSetting {
    /// Compiles a setting: the table of legs (for each period of the wind), and what is in the way.
    pub fn new(
        topology: Arc<Topology>,
        airframe: Airframe,
        payload_kg: f64,
        wind: WindField,
        rules: FlightRules,
        situation: &Situation,
    ) -> Self {
        Self {
            vertical: Arc::new(Vertical::of(&topology, rules.unknown_climb_m)),
            crossings: SharedCrossings::default(),
            legs: Arc::new(FlightLegs::of(
                &topology, &airframe, payload_kg, &wind, &rules,
            )),
            obstacles: Obstacles::of(&topology, situation),
            pads: PadTimes::of(&topology, situation),
            topology,
            airframe,
            payload_kg,
            wind,
            rules,
        }
    }

    /// Another drone, payload or wind over the same network by the same rules: what depends on these alone is
    /// shared.
    #[must_use]
    pub fn with_drone(&self, airframe: Airframe, payload_kg: f64, wind: WindField) -> Self {
        let legs = FlightLegs::of(&self.topology, &airframe, payload_kg, &wind, &self.rules);
        Self {
            legs: Arc::new(legs),
            airframe,
            payload_kg,
            wind,
            ..self.clone()
        }
    }

    /// The same drone in the same wind with other things in the way: the table of legs is shared.
    #[must_use]
    pub fn with_situation(&self, situation: &Situation) -> Self {
        Self {
            obstacles: Obstacles::of(&self.topology, situation),
            pads: PadTimes::of(&self.topology, situation),
            ..self.clone()
        }
    }

    /// The same drone in the same wind with these closures among what other plans take, where nodes swap batteries as before:
    /// nothing is compiled.
    #[must_use]
    pub fn among(&self, closed: &Arc<ClosedWindows>, others: OthersOccupancy) -> Self {
        Self {
            obstacles: Obstacles::among(closed.clone(), others.clone()),
            pads: self.pads.among(closed.clone(), others),
            ..self.clone()
        }
    }

    /// The same without keeping apart from other plans in the air; their pads stay taken.
    #[must_use]
    pub fn unseparated(&self) -> Self {
        let rules = FlightRules {
            headway_s: 0.0,
            ..self.rules
        };
        Self {
            rules,
            ..self.clone()
        }
    }

    /// What a search reads.
    pub fn world(&self) -> FlightWorld<'_> {
        FlightWorld {
            topology: &self.topology,
            legs: &self.legs,
            obstacles: &self.obstacles,
            pads: &self.pads,
            vertical: &self.vertical,
            crossings: &self.crossings,
            rules: &self.rules,
            charging: self.airframe.charging(),
        }
    }

    /// The tables of a destination: a search of the whole network. They depend on network, airframe, payload and wind alone, so
    /// they outlive what is in the way.
    pub fn potentials(&self, destination: NodeIx, objective: Objective) -> Potentials {
        let nodes = self.topology.node_count();
        Potentials::of(&self.legs, nodes, destination, objective)
    }

    /// The network.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// The drone.
    pub fn airframe(&self) -> &Airframe {
        &self.airframe
    }

    /// Its payload, in kilograms.
    pub fn payload_kg(&self) -> f64 {
        self.payload_kg
    }

    /// The wind.
    pub fn wind(&self) -> &WindField {
        &self.wind
    }

    /// Margins and overheads.
    pub fn rules(&self) -> &FlightRules {
        &self.rules
    }

    /// Where drones change altitude.
    pub fn vertical(&self) -> &Vertical {
        &self.vertical
    }

    /// What legs take.
    pub fn legs(&self) -> &Arc<FlightLegs> {
        &self.legs
    }

    /// Which pads are free when.
    pub fn pads(&self) -> &PadTimes {
        &self.pads
    }
}
