//! The plan of a delivery: legs with times, speeds and battery, recharging stops, what it costs, and its contingencies.

use super::contingency::{LegContingency, contingency};
use super::world::{DEFAULT_DEADLINE_S, DeliveryScratch, DeliveryWorld, Question};
use crate::compose::Occupation;
use crate::flight::{FlightPlan, FlightStart, Reservation};
use crate::itinerary::{
    Effort, FlightAnswer, FlightCause, FlightOpening, Objective, PlanFigures, Step, Unproved, Value,
};
use crate::network::{NodeIx, SegmentIx, Topology};

/// A delivery request: the paper's `<source, destination, start time, payload>`, the payload being that of the setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeliveryRequest {
    /// Where the drone stands.
    pub source: NodeIx,
    /// Where the delivery goes.
    pub destination: NodeIx,
    /// The pad that it stands on there, counted from 0, where that is known.
    pub pad: Option<u16>,
    /// The start time, in seconds; without a free pad at the source the drone takes off then.
    pub start_s: f64,
    /// When the plan began, in seconds: windows widen with the time since then.
    pub began_s: f64,
    /// Battery at the start, as a fraction.
    pub battery: f64,
    /// What is made least.
    pub objective: Objective,
    /// The latest landing, in seconds; [`DEFAULT_DEADLINE_S`] after the start where there is none.
    pub deadline_s: Option<f64>,
}

/// Why there is no plan.
#[derive(Clone, Debug, PartialEq)]
pub struct NoDelivery {
    /// What cuts the drone off, as far as it gets.
    pub causes: Vec<FlightCause>,
    /// The plan that there would be but for the deadline.
    pub opens: Option<FlightOpening>,
    /// The deadline that was kept, in seconds.
    pub deadline_s: f64,
    /// False where a bound of the search was reached, so that there may be a plan after all.
    pub proved: bool,
}

/// A plan that can be flown, with everything that follows from it.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightComposition {
    /// Where it leads.
    pub destination: NodeIx,
    /// What was made least.
    pub objective: Objective,
    /// When it began, in seconds: windows widen with the time since then.
    pub began_s: f64,
    /// The latest landing, in seconds; infinity for a diversion.
    pub deadline_s: f64,
    /// The least battery at every node, as a fraction.
    pub reserve: f64,
    /// Segments closed for this plan alone.
    pub closed_segments: Vec<SegmentIx>,
    /// Legs and stops.
    pub plan: FlightPlan,
    /// Lengths, speeds, energies, waits and the delivery cost.
    pub figures: PlanFigures,
    /// The delivery cost `c_ij` of each leg, in US dollars.
    pub leg_costs_usd: Vec<f64>,
    /// What to do on each leg where the drone is told nothing; empty where they are worked out later.
    pub contingencies: Vec<LegContingency>,
    /// How certain it is that no plan is better.
    pub proof: Proof,
}

/// How certain it is that no plan is better.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proof {
    /// True where no plan is better.
    pub proved: bool,
    /// The plan's value.
    pub value: Value,
    /// No plan is better than this.
    pub lower_bound: Value,
    /// Why it is not proved.
    pub reason: Option<Unproved>,
    /// The step of the search that gave it.
    pub step: Step,
    /// What the search cost.
    pub effort: Effort,
}

impl Proof {
    pub(super) fn of(answer: &FlightAnswer) -> Self {
        Self {
            proved: answer.proved,
            value: answer.value,
            lower_bound: answer.lower_bound,
            reason: answer.reason,
            step: answer.step,
            effort: answer.effort,
        }
    }
}

/// The paper's Definition 1: `<id, (loc_s, loc_e, t_s, t_e), QoS>`.
#[derive(Clone, Debug, PartialEq)]
pub struct DroneDeliveryService {
    /// Unique within the plan: its segment and the number of the leg, from 1.
    pub id: String,
    /// `loc_s`.
    pub from: NodeIx,
    /// `loc_e`.
    pub to: NodeIx,
    /// `t_s`, in seconds.
    pub starts_s: f64,
    /// `t_e`, in seconds.
    pub ends_s: f64,
    /// `QoS`.
    pub quality: QualityOfService,
}

/// The quality attributes of a drone delivery service.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QualityOfService {
    /// Metres flown.
    pub length_m: f64,
    /// Flying time, in seconds.
    pub flight_time_s: f64,
    /// Battery drawn, as a fraction.
    pub battery_fraction: f64,
    /// Payload carried, in kilograms.
    pub payload_kg: f64,
    /// Delivery cost, in US dollars.
    pub cost_usd: f64,
}

impl FlightComposition {
    /// The nodes flown by, from the start to the destination.
    pub fn nodes(&self) -> Vec<NodeIx> {
        nodes_of(&self.plan)
    }

    /// The paper's tuples, one for each leg.
    pub fn services(&self, topology: &Topology, payload_kg: f64) -> Vec<DroneDeliveryService> {
        let figures = self.figures.legs.iter().zip(&self.leg_costs_usd);
        let legs = (1..).zip(self.plan.legs.iter().zip(figures));
        legs.map(
            |(number, (flown, (figures, &cost_usd)))| DroneDeliveryService {
                id: format!("{}#{number}", topology.segment_id(flown.segment)),
                from: flown.from,
                to: flown.to,
                starts_s: flown.enters_s,
                ends_s: flown.leaves_s,
                quality: QualityOfService {
                    length_m: figures.length_m,
                    flight_time_s: figures.time_s,
                    battery_fraction: flown.battery_before - flown.battery_after,
                    payload_kg,
                    cost_usd,
                },
            },
        )
        .collect()
    }

    /// When each leg is flown, for conflicts with other plans and as what they have to avoid.
    pub fn occupations(&self) -> Vec<Occupation> {
        let legs = self.plan.legs.iter().enumerate();
        legs.map(|(leg, flown)| Occupation {
            segment: flown.segment,
            from: flown.from,
            leg,
            enters_s: flown.enters_s,
            leaves_s: flown.leaves_s,
        })
        .collect()
    }

    /// The pads that it takes on its way, for other plans to keep off.
    pub fn reservations(&self) -> Vec<Reservation> {
        let stops = self.plan.stops.iter();
        stops
            .map(|stop| Reservation {
                node: stop.node,
                pad: stop.pad,
                from_s: stop.lands_s,
                until_s: stop.takes_off_s,
            })
            .collect()
    }
}

/// The nodes of a plan, from its start on.
pub(super) fn nodes_of(plan: &FlightPlan) -> Vec<NodeIx> {
    let ends = plan.legs.iter().map(|leg| leg.to);
    std::iter::once(plan.start.node).chain(ends).collect()
}

impl DeliveryRequest {
    /// Where its drone stands.
    pub(super) fn start(&self) -> FlightStart {
        FlightStart {
            node: self.source,
            at_s: self.start_s,
            battery: self.battery,
            on_ground: true,
            pad: self.pad,
            flown_m: 0.0,
            drawn: 0.0,
            stretch: None,
        }
    }

    /// What is asked for a drone that has not left, by its one start.
    pub(super) fn question<'a>(
        &self,
        world: &DeliveryWorld<'_>,
        starts: &'a [FlightStart],
    ) -> Question<'a> {
        let latest_s = self.start_s + DEFAULT_DEADLINE_S;
        Question {
            starts,
            destination: self.destination,
            objective: self.objective,
            began_s: self.began_s,
            deadline_s: self.deadline_s.unwrap_or(latest_s),
            reserve: world.setting.rules().reserve,
            closed_segments: &[],
            in_flight: false,
            explain: true,
        }
    }
}

/// Composes a delivery.
///
/// # Errors
/// [`NoDelivery`] where there is no plan, with what cuts the drone off.
pub fn compose(
    world: &DeliveryWorld<'_>,
    request: &DeliveryRequest,
    scratch: &mut DeliveryScratch,
) -> Result<FlightComposition, NoDelivery> {
    let starts = [request.start()];
    let question = request.question(world, &starts);
    let decision = world.decide(&question, scratch);
    let proof = Proof::of(&decision.answer);
    match decision.answer.plan {
        Some(plan) => Ok(with_contingencies(world, &question, plan, proof, scratch)),
        None => Err(NoDelivery {
            causes: decision.causes,
            opens: decision.opens,
            deadline_s: question.deadline_s,
            proved: proof.proved,
        }),
    }
}

/// A plan that answers a question, with all that follows from it.
pub(super) fn with_contingencies(
    world: &DeliveryWorld<'_>,
    question: &Question<'_>,
    plan: FlightPlan,
    proof: Proof,
    scratch: &mut DeliveryScratch,
) -> FlightComposition {
    let setting = world.setting;
    let payload_kg = setting.payload_kg();
    let figures = setting.figures(&plan, question.began_s, question.reserve, world.tariff);
    let legs = match world.with_contingencies {
        true => 0..plan.legs.len(),
        false => 0..0,
    };
    let contingencies = legs
        .map(|leg| contingency(world, question, &plan, leg, scratch))
        .collect();
    let lengths_m = figures.legs.iter().map(|leg| leg.length_m);
    FlightComposition {
        destination: question.destination,
        objective: question.objective,
        began_s: question.began_s,
        deadline_s: question.deadline_s,
        reserve: question.reserve,
        closed_segments: question.closed_segments.to_vec(),
        leg_costs_usd: lengths_m
            .map(|length_m| world.tariff.cost_usd(payload_kg, length_m))
            .collect(),
        contingencies,
        figures,
        plan,
        proof,
    }
}
