//! What documents of the market hold: read from the store, changed, and written back.

use super::pace::pause_ms;
use jiff::{SignedDuration, Timestamp};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use skyway_contract::{Delivery, DeliveryChange, DeliveryStatus, FleetDrone, FleetDroneState};
use skyway_registry::documents::{Document, DocumentKind, Seen};
use skyway_service::refusal::{Code, Refusal};

/// The most changes of status that are kept of a delivery; of more, the oldest after the first go.
const HISTORY_MAX: usize = 200;
/// The most drones that are passed over for a delivery at once; of more, the oldest go.
const PASSED_OVER_MAX: usize = 32;
/// For how long a drone is passed over after an edge has refused its flight, or its flight has ended early.
const PASSED_OVER_FOR: SignedDuration = SignedDuration::from_mins(2);
/// How long an order without a latest arrival waits for a drone after it may be picked up: as long as an edge lets a flight
/// last that has no deadline.
const WAITS_FOR: SignedDuration = SignedDuration::from_mins(150);

/// State of the document of an order whose flight an edge is being asked for.
pub(super) const RESERVING: &str = "reserving";
/// State of the document of an order whose flight an edge is being asked to call off.
pub(super) const CALLING_OFF: &str = "calling_off";
/// State of the document of an order whose edge was given up, and is asked to call its flight off.
pub(super) const GIVEN_UP: &str = "given_up";

/// How documents of deliveries stand that are not over.
pub(super) fn open_states() -> impl Iterator<Item = &'static str> {
    let open = DeliveryStatus::ALL.into_iter();
    let open = open.filter(|status| !status.is_final());
    let asked = [RESERVING, CALLING_OFF, GIVEN_UP];
    open.map(DeliveryStatus::name).chain(asked)
}

/// A document and what it holds.
#[derive(Clone, Debug)]
pub(super) struct Kept<T> {
    pub(super) document: Document,
    pub(super) value: T,
}

impl<T: DeserializeOwned> Kept<T> {
    /// Reads a document.
    ///
    /// # Errors
    /// When it holds something else: damage, or the work of a later version.
    pub(super) fn read(document: Document) -> Result<Self, Refusal> {
        let value = serde_json::from_str(&document.body).map_err(|error| {
            let (kind, id) = (document.kind.name(), &document.id);
            let detail = format!("the {kind} '{id}' in the store cannot be read: {error}");
            Refusal::new(Code::Internal, detail)
        })?;
        Ok(Self { document, value })
    }
}

impl<T> Kept<T> {
    /// The version that a commit was decided on.
    pub(super) fn seen(&self) -> Seen {
        seen(&self.document)
    }
}

impl<T: Serialize> Kept<T> {
    fn put(&self, state: &str, party: &str, now: Timestamp) -> Document {
        Document {
            state: state.to_owned(),
            party: party.to_owned(),
            version: self.document.version + 1,
            changed_ms: now.as_millisecond(),
            body: text(&self.value),
            ..self.document.clone()
        }
    }
}

/// Something of the market as JSON: text and numbers always have a form.
pub(super) fn text(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

/// A delivery as it is kept: as it is told, and how its drone is being found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Order {
    #[serde(flatten)]
    pub(super) delivery: Delivery,
    #[serde(default)]
    pub(super) dispatch: Progress,
}

/// What is being asked of an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Asking {
    /// Nothing.
    #[default]
    Nothing,
    /// To take its flight on.
    Reserving,
    /// To call its flight off.
    CallingOff,
}

/// How the drone of an order is being found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Progress {
    pub(super) asking: Asking,
    /// Where its flight begins and ends: the home of its drone.
    pub(super) home: String,
    /// The airframe that the edge is asked for.
    pub(super) airframe: Option<String>,
    /// From home to the pickup, in metres.
    pub(super) fetch_m: f64,
    /// From when on its drone may not come to the pickup, as its service closes, in milliseconds since 1970.
    pub(super) closes_ms: Option<i64>,
    /// Drones reserved for it so far; each has a plan of its own.
    pub(super) reserved: u32,
    /// Flights of it that were taken on.
    pub(super) flights: u32,
    /// Answers that did not take it on, since the last that did.
    pub(super) failures: u32,
    /// Since when the edge is being asked, in milliseconds since 1970.
    pub(super) asked_since_ms: i64,
    /// Before when it is not looked at again, in milliseconds since 1970.
    pub(super) next_look_ms: i64,
    /// Since when it waits for a drone that is busy though another one is free, in milliseconds since 1970.
    pub(super) holds_since_ms: Option<i64>,
    /// Whether it was called off on the ground.
    pub(super) is_called_off: bool,
    /// Whether its edge did not answer in time: its flight is called off before another drone is looked for.
    pub(super) is_given_up: bool,
    /// The last version of its flight's plan that was noted as a recomposition; 0 where none was. A next flight counts anew.
    pub(super) noted_version: u32,
    /// Whether its customer's data were deleted: its proof takes nothing any more that may name a person.
    pub(super) is_stripped: bool,
    /// Changes of its status so far.
    pub(super) changes: u64,
    pub(super) passed_over: Vec<PassedOverDrone>,
}

/// A drone that is not asked for again for a while.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PassedOverDrone {
    drone: String,
    until_ms: i64,
}

impl Progress {
    /// Passes a drone over for a while.
    pub(super) fn pass_over(&mut self, drone: &str, now: Timestamp) {
        let until = now.saturating_add(PASSED_OVER_FOR).unwrap_or(now);
        self.passed_over.retain(|passed| passed.drone != drone);
        if self.passed_over.len() >= PASSED_OVER_MAX {
            self.passed_over.remove(0);
        }
        self.passed_over.push(PassedOverDrone {
            drone: drone.to_owned(),
            until_ms: until.as_millisecond(),
        });
    }

    /// Whether a drone is passed over now.
    pub(super) fn passes_over(&self, drone: &str, now: Timestamp) -> bool {
        let now_ms = now.as_millisecond();
        let mut passed = self.passed_over.iter();
        passed.any(|passed| passed.drone == drone && now_ms < passed.until_ms)
    }
}

impl Order {
    /// Sets how it stands and why. Tells whether that is another status than before.
    pub(super) fn set_status(
        &mut self,
        status: DeliveryStatus,
        reason: Option<String>,
        at: Timestamp,
        plan_version: Option<u32>,
    ) -> bool {
        let is_change = self.delivery.status != status || self.delivery.history.is_empty();
        self.delivery.reason.clone_from(&reason);
        if !is_change {
            return false;
        }
        self.delivery.status = status;
        if status.is_final() {
            self.delivery.expected_at = None;
        }
        self.dispatch.changes += 1;
        // An edge's news are dated by it, and one may have been told before the change that came first.
        let last = self.delivery.history.last();
        let last: Option<Timestamp> = last.and_then(|last| last.at.parse().ok());
        let at = last.map_or(at, |last| at.max(last));
        if self.delivery.history.len() >= HISTORY_MAX {
            self.delivery.history.remove(1);
        }
        self.delivery.history.push(DeliveryChange {
            status,
            at: at.to_string(),
            reason,
            plan_version,
        });
        true
    }

    /// Until when a drone is looked for.
    pub(super) fn waits_until(&self) -> Timestamp {
        let stated = self.delivery.arrive_by.as_deref();
        if let Some(latest) = stated.and_then(|latest| latest.parse().ok()) {
            return latest;
        }
        let start = self.start_time();
        start.saturating_add(WAITS_FOR).unwrap_or(start)
    }

    /// From when it may be picked up.
    pub(super) fn start_time(&self) -> Timestamp {
        self.delivery.start_time.parse().unwrap_or_default()
    }

    /// From now on its edge is asked to call its flight off.
    pub(super) fn ask_to_call_off(&mut self, now: Timestamp) {
        self.dispatch.asking = Asking::CallingOff;
        self.dispatch.failures = 0;
        self.dispatch.asked_since_ms = now.as_millisecond();
        self.dispatch.next_look_ms = now.as_millisecond();
    }

    /// Its edge is asked the same again, after a pause.
    pub(super) fn ask_again(&mut self, now: Timestamp) {
        self.dispatch.failures += 1;
        let pause = pause_ms(self.dispatch.failures);
        self.dispatch.next_look_ms = now.as_millisecond().saturating_add(pause);
    }

    /// The drone and the plan of its flight, where it has one.
    pub(super) fn drone_id(&self) -> Option<&str> {
        let allocation = self.delivery.allocation.as_ref();
        allocation.map(|allocation| allocation.drone_id.as_str())
    }

    /// Lets go of its drone: it waits for another one.
    pub(super) fn release(&mut self) {
        self.delivery.allocation = None;
        self.delivery.expected_at = None;
        self.dispatch.asking = Asking::Nothing;
        self.dispatch.home.clear();
        self.dispatch.noted_version = 0;
        self.dispatch.holds_since_ms = None;
        self.dispatch.next_look_ms = 0;
    }
}

impl Kept<Order> {
    /// The document to be put.
    pub(super) fn next(&self, now: Timestamp) -> Document {
        let state = match self.value.dispatch.asking {
            Asking::Nothing => self.value.delivery.status.name(),
            Asking::Reserving => RESERVING,
            Asking::CallingOff if self.value.dispatch.is_given_up => GIVEN_UP,
            Asking::CallingOff => CALLING_OFF,
        };
        let party = self.value.delivery.provider.as_deref().unwrap_or_default();
        self.put(state, party, now)
    }
}

/// The name of a drone's state, in documents as on the wire.
pub(super) fn drone_state(state: FleetDroneState) -> &'static str {
    match state {
        FleetDroneState::Available => "available",
        FleetDroneState::Assigned => "assigned",
        FleetDroneState::InFlight => "in_flight",
        FleetDroneState::Charging => "charging",
        FleetDroneState::OutOfService => "out_of_service",
    }
}

impl Kept<FleetDrone> {
    /// Sets how it stands, and for which delivery.
    pub(super) fn set(&mut self, state: FleetDroneState, delivery: Option<&str>) {
        self.value.state = state;
        self.value.delivery_id = delivery.map(str::to_owned);
        if delivery.is_none() {
            self.value.free_at = None;
        }
    }

    /// The document to be put.
    pub(super) fn next(&self, now: Timestamp) -> Document {
        self.put(drone_state(self.value.state), &self.document.party, now)
    }
}

/// A document that is new.
pub(super) fn fresh(
    kind: DocumentKind,
    id: &str,
    (tenant, party): (&str, &str),
    (state, body): (&str, String),
    now: Timestamp,
) -> Document {
    Document {
        kind,
        id: id.to_owned(),
        tenant: tenant.to_owned(),
        party: party.to_owned(),
        state: state.to_owned(),
        version: 1,
        changed_ms: now.as_millisecond(),
        body,
    }
}

/// The version of a document that a commit was decided on.
pub(super) fn seen(document: &Document) -> Seen {
    Seen {
        kind: document.kind,
        id: document.id.clone(),
        version: Some(document.version),
    }
}

/// On which absence a commit was decided.
pub(super) fn absent(kind: DocumentKind, id: &str) -> Seen {
    Seen {
        kind,
        id: id.to_owned(),
        version: None,
    }
}

/// An id that sorts by when it was made, and that cannot be guessed.
///
/// # Errors
/// When the system has no random bits.
pub(super) fn timed_id(prefix: &str, now: Timestamp) -> Result<String, Refusal> {
    let random = getrandom::u64().map_err(|error| {
        let detail = format!("the system has no random bits: {error}");
        Refusal::new(Code::Internal, detail)
    })?;
    let begins = id_from(prefix, now.as_millisecond());
    Ok(format!("{begins}{random:016x}"))
}

/// What the ids made in a millisecond begin with: before all of them, and after all made earlier.
fn id_from(prefix: &str, millisecond: i64) -> String {
    format!("{prefix}{:012x}", millisecond.max(0))
}

/// After every id that was made by the millisecond of an instant.
pub(super) fn id_until(prefix: &str, instant: Timestamp) -> String {
    id_from(prefix, instant.as_millisecond().saturating_add(1))
}
