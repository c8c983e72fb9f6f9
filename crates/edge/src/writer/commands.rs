//! What the writer is asked to do, and what it answers.

use crate::entries::{
    AlarmDraft, AlarmEntry, ClosureEntry, PendingReview, ProposalEntry, ZoneEntry,
};
use crate::failures::reporter::author;
use crate::network::replacement::NewNetwork;
use crate::planner::Version;
use crate::plans::entry::PlanEntry;
use crate::plans::fleet::Detour;
use crate::state::import::{FeedChanges, FeedUpdate};
use crate::sync::followed::RegistryDelta;
use crate::upstream::Upstream;
use jiff::Timestamp;
use skyway_contract::{Author, EndedAs, FailureNews};
use skyway_engine::airspace::Closure;
use skyway_engine::geo::Point;
use skyway_engine::network::Topology;
use skyway_service::access::Caller;
use skyway_service::intake::Expected;
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;

/// What an operator decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Put it into force; of a hold, let it go.
    Accept,
    /// Drop it.
    Reject,
}

/// When a plan is cancelled, and what is known then of its drone's place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CancelledWhen {
    /// Only before its drone departs.
    BeforeDeparture,
    /// Whether in flight or not; it was said where its drone is.
    Placed,
    /// Whether in flight or not; nobody said where.
    Unplaced,
}

/// Something that a drone's report closes for everyone, quotas permitting.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Publication {
    pub(crate) entry: ClosureEntry,
    /// What is made of it where the writer finds that a quota has been used up meanwhile.
    pub(crate) otherwise: ProposalEntry,
}

/// A command to the writer.
#[derive(Debug)]
pub(crate) enum Command {
    /// Puts a zone, as the closure it causes.
    PutZone {
        closure: Arc<Closure>,
        expected: Expected,
    },
    DeleteZone {
        id: String,
        expected: Expected,
    },
    /// Takes over what a feed of zones has now.
    ImportZones(Box<FeedUpdate>),
    /// Puts an operator's closure.
    PutClosure(ClosureEntry),
    ChangeClosure {
        id: String,
        confirmed: Option<bool>,
        until: Option<Timestamp>,
        expected: Expected,
    },
    LiftClosure {
        id: String,
        expected: Expected,
    },
    Publish(Box<Publication>),
    Propose(Box<ProposalEntry>),
    DecideProposal {
        number: u64,
        decision: Decision,
    },
    /// What the registry has changed; many removals at once wait for an operator.
    Follow(Box<RegistryDelta>),
    /// The registry has taken a change from the outbox: it is this version there, or gone.
    Forwarded {
        number: u64,
        upstream: Option<Upstream>,
        /// The epoch that was followed when it was told.
        epoch: u64,
    },
    /// The registry will never take a change from the outbox.
    NotForwarded {
        number: u64,
        code: String,
        detail: String,
    },
    /// Changes what the registry is to be told of flights and failures.
    News(NewsOrder),
    DecideHold {
        number: u64,
        decision: Decision,
    },
    /// States the weather, as a whole.
    PutWeather {
        text: Arc<str>,
        expected: Expected,
    },
    AddPlan(Box<PlanEntry>),
    CancelPlan {
        id: String,
        when: CancelledWhen,
    },
    AcknowledgePlan {
        id: String,
        version: u32,
    },
    DeclinePlan {
        id: String,
        version: u32,
        reason: DeclineReason,
    },
    /// A drone has landed.
    CompletePlan {
        id: String,
        landed: EndedAs,
        /// On the plane of the network; at its end where none is told.
        place: Option<Point>,
    },
    /// An operator says what became of a plan.
    ReleasePlan {
        id: String,
        ended_as: EndedAs,
    },
    /// What telemetry shows of a plan's drone.
    SeePlan {
        id: Arc<str>,
        seen: Seen,
    },
    /// A version that a failure report led to.
    ProposeVersion {
        plan: Arc<str>,
        version: Box<Version>,
    },
    /// A version that is better than one which is flown, since something has opened.
    OfferVersion {
        plan: Arc<str>,
        /// The number of the version that it is better than.
        instead_of: u32,
        version: Box<Version>,
    },
    /// A drone has received its messages up to this one.
    ReceiveMail {
        drone: Arc<str>,
        through: u64,
    },
    RaiseAlarm(Box<AlarmDraft>),
    AcknowledgeAlarm {
        number: u64,
        by: Arc<str>,
    },
    /// Puts another network in the place of the one in service.
    ReplaceNetwork(Box<NewNetwork>),
    /// A command whose nodes and segments are those of this network. A command made from a snapshot says so, as
    /// the network may be another one when the writer comes to it.
    MadeOn {
        topology: Arc<Topology>,
        command: Box<Command>,
    },
    /// A command that somebody has given, who stands on what it changes.
    By {
        author: Arc<Author>,
        /// Why, where they have said.
        reason: Option<Arc<str>>,
        command: Box<Command>,
    },
    /// A client moves the clock: to this instant, or to an earlier one at which something happens by itself.
    AdvanceTo(Timestamp),
    /// Nothing but the time has changed.
    Tick,
    /// The same; it is answered when the drones of all plans have been told what to fly.
    Settle,
}

impl Command {
    /// This command, given by a caller.
    pub(crate) fn by(self, caller: &Caller) -> Self {
        self.because(caller, None)
    }

    /// This command, given by a caller for a reason.
    pub(crate) fn because(self, caller: &Caller, reason: Option<Arc<str>>) -> Self {
        Self::By {
            author: author(caller),
            reason,
            command: Box::new(self),
        }
    }

    /// What a command that somebody has given does to which thing, for the log.
    pub(crate) fn told(&self) -> Option<Told> {
        let Self::By {
            author,
            reason,
            command,
        } = self
        else {
            return None;
        };
        let command = match &**command {
            Self::MadeOn { command, .. } => command,
            _ => command,
        };
        let (what, id) = match &**command {
            Self::PutZone { closure, .. } => ("zone_put", closure.id.clone()),
            Self::DeleteZone { id, .. } => ("zone_deleted", id.clone()),
            Self::ImportZones(update) => ("zones_imported", update.feed.to_string()),
            Self::PutClosure(entry) => ("closure_put", entry.closure.id.clone()),
            Self::ChangeClosure { id, .. } => ("closure_changed", id.clone()),
            Self::LiftClosure { id, .. } => ("closure_lifted", id.clone()),
            Self::DecideProposal { number, decision } => match decision {
                Decision::Accept => ("proposal_accepted", number.to_string()),
                Decision::Reject => ("proposal_rejected", number.to_string()),
            },
            Self::DecideHold { number, decision } => match decision {
                Decision::Accept => ("hold_released", number.to_string()),
                Decision::Reject => ("hold_rejected", number.to_string()),
            },
            Self::PutWeather { .. } => ("weather_put", String::new()),
            Self::CancelPlan { id, .. } => ("plan_cancelled", id.clone()),
            Self::ReleasePlan { id, .. } => ("plan_released", id.clone()),
            Self::AcknowledgeAlarm { number, .. } => ("alarm_acknowledged", number.to_string()),
            _ => return None,
        };
        Some(Told {
            author: author.clone(),
            reason: reason.clone(),
            what,
            id,
        })
    }

    /// This command, made on a network.
    pub(crate) fn made_on(self, topology: &Arc<Topology>) -> Self {
        Self::MadeOn {
            topology: topology.clone(),
            command: Box::new(self),
        }
    }

    /// Whether the network may be another one afterwards. Such a command begins a batch, so that all that a batch
    /// tells is on one network.
    pub(crate) fn replaces_network(&self) -> bool {
        match self {
            Self::ReplaceNetwork(_) => true,
            Self::Follow(followed) => followed.network.is_some(),
            Self::By { command, .. } => command.replaces_network(),
            _ => false,
        }
    }

    /// Whether someone has asked for a change, and is to know that it survives a restart.
    pub(crate) fn changes_by_request(&self) -> bool {
        !matches!(
            self,
            Self::AdvanceTo(_)
                | Self::Tick
                | Self::Settle
                | Self::Follow(_)
                | Self::Forwarded { .. }
                | Self::NotForwarded { .. }
                | Self::News(_)
                | Self::ReplaceNetwork(_)
                | Self::RaiseAlarm(_)
                // One that is forgotten is told once more.
                | Self::ReceiveMail { .. }
        )
    }
}

/// What somebody has changed.
#[derive(Debug)]
pub(crate) struct Told {
    pub(crate) author: Arc<Author>,
    pub(crate) reason: Option<Arc<str>>,
    pub(crate) what: &'static str,
    pub(crate) id: String,
}

impl Told {
    /// One line in the log.
    pub(crate) fn log(&self) {
        let Author {
            tenant,
            subject,
            role,
        } = &*self.author;
        tracing::info!(
            tenant,
            subject,
            role,
            change = self.what,
            id = self.id,
            reason = self.reason.as_deref(),
            "changed"
        );
    }
}

/// What the writer did.
#[derive(Clone, Debug)]
pub(crate) enum Done {
    Zone {
        entry: Arc<ZoneEntry>,
        created: bool,
    },
    ZoneDeleted(Arc<ZoneEntry>),
    ZonesImported(FeedChanges),
    Closure(Arc<ClosureEntry>),
    ClosureLifted(Arc<ClosureEntry>),
    Proposal(Arc<ProposalEntry>),
    Hold(Arc<PendingReview>),
    Plan(Arc<PlanEntry>),
    Alarm(Arc<AlarmEntry>),
    /// How many timers came due in the batch, and whether the clock shows the instant asked for, with nothing left to do.
    Advanced {
        to: Timestamp,
        fired: u64,
        is_there: bool,
    },
    /// What was ordered was worked out on a network that is not there any more, and has to be worked out anew.
    Outdated,
    Nothing,
}

/// The answer to a command: what was done, whether it is stored, and the plans that the whole batch affected.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    pub(crate) done: Done,
    /// The plans that wait for their answer because of what was put.
    pub(crate) pending: usize,
    pub(crate) durable: bool,
    pub(crate) detours: Arc<Vec<Detour>>,
}

/// What comes back for each command.
pub(crate) type Reply = Result<Outcome, Refusal>;

/// The writer answers every command in kind; anything else is a defect.
pub(crate) fn unexpected() -> Refusal {
    Refusal::new(Code::Internal, "the writer gave an answer of another kind")
}

/// What is done to the news for the registry.
#[derive(Debug)]
pub(crate) enum NewsOrder {
    /// A failure was reported and answered.
    Failed(Box<FailureNews>),
    /// The registry has all up to this number.
    Taken { through: u64 },
    /// The registry will never take this one.
    Refused { number: u64 },
}

/// What telemetry shows of a plan's drone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Seen {
    /// It is in the air.
    Departed,
    /// It is elsewhere than anything that it was told has it.
    Deviates,
    /// It is where it is to be again.
    Conforms,
    /// It is heard of again.
    Heard,
    /// How many stops of its delivery were served by now, as it flies this version.
    Served { version: u32, stops: u32 },
    /// It rests at the end of this version.
    Landed(u32),
    /// It has left the pad that it has landed on with this plan, which has ended.
    LeftItsPad,
}

/// Why a drone does not take a version over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DeclineReason {
    /// It has not what it takes to fly so far: it is to land.
    Unfit,
    /// Something is in the way that the version begins with.
    Obstructed,
    /// The version begins where the drone is not any more.
    Passed,
}
