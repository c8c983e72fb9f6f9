//! Closures: what operators close by their word, and what drones reported to their edges.

use super::Registry;
use super::objects::{Put, made_id};
use super::topologies::aside;
use super::writes::{Decision, Intent, Reply, WriteOptions};
use skyway_contract::{ClosureDraft, ObjectKind, PublishedCause, PublishedClosure};
use skyway_service::intake::{ClosureIds, Faults, read_closure};
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;

/// The longest id of a drone, in bytes.
const DRONE_ID_BYTES_MAX: usize = 256;

impl Registry {
    /// Puts a closure: a new one, or under an id, new or in place of the version that `If-Match` names.
    ///
    /// # Errors
    /// When it is not valid, its id is taken, or another version is current.
    pub async fn put_closure(
        self: &Arc<Self>,
        network: &str,
        id: Option<&str>,
        closure: PublishedClosure,
        manner: &WriteOptions,
    ) -> Result<Reply, Refusal> {
        let intent = Intent::PutClosure {
            closure: Box::new(closure),
            id: id.map(str::to_owned),
            made: made_id("closure")?,
        };
        self.write(network, intent, manner).await
    }

    pub(super) async fn decide_closure(
        self: &Arc<Self>,
        network: &str,
        closure: &PublishedClosure,
        id: Option<&str>,
        made: &str,
        manner: &WriteOptions,
    ) -> Result<Decision, Refusal> {
        let (state, composed) = self.composed(network).await?;
        let mut kept = closure.clone();
        kept.id = Some(named(closure, id, made)?);
        check_words(&kept)?;
        let now = self.clock.now();
        let draft = draft_of(&kept);
        let ids = match kept.cause {
            PublishedCause::Operator => ClosureIds::OfOperators,
            PublishedCause::Report => ClosureIds::OfReports,
        };
        let read = aside(move || {
            let read = read_closure(&draft, &composed.topology, now, ids)?;
            // However the writer named a segment, it has one id.
            let own = |id: &String| {
                let found = composed.topology.find_segment(id);
                found.map(|segment| composed.topology.segment_id(segment).into_owned())
            };
            let segments: Vec<String> = draft.segments.iter().filter_map(own).collect();
            Ok::<_, Refusal>((read, segments))
        });
        let (read, segments) = read.await??;
        kept.segments = segments;
        kept.from = Some(read.from.to_string());
        kept.until = read.until.map(|until| until.to_string());
        kept.confirmed |= kept.cause == PublishedCause::Operator;
        let object = serde_json::to_value(&kept).map_err(|error| {
            Refusal::new(
                Code::Internal,
                format!("the closure has no JSON form: {error}"),
            )
        })?;
        let put = Put {
            kind: ObjectKind::Closure,
            id: kept.id.as_deref().unwrap_or_default(),
            is_new: id.is_none(),
            body: object.to_string(),
            object: Some(object),
        };
        self.decide_put(&state, put, manner).await
    }
}

/// The id of a closure: the path's, its own, or the one made for it.
fn named(closure: &PublishedClosure, id: Option<&str>, made: &str) -> Result<String, Refusal> {
    match (id, closure.id.as_deref()) {
        (Some(id), Some(stated)) if id != stated => {
            let mut faults = Faults::default();
            let message = format!("the id is '{stated}', and the path has '{id}'");
            let hint = "leave 'id' out of the body".to_owned();
            faults.add("id_mismatch", "/id", message, Some(hint));
            Err(faults.refusal(Code::ClosureInvalid, "closure"))
        }
        (Some(id), _) | (None, Some(id)) => Ok(id.to_owned()),
        (None, None) => Ok(made.to_owned()),
    }
}

fn check_words(closure: &PublishedClosure) -> Result<(), Refusal> {
    let mut faults = Faults::default();
    let drone = closure.reported_by.as_deref();
    faults.text("/reported_by", drone, DRONE_ID_BYTES_MAX);
    if drone.is_some() && closure.cause == PublishedCause::Operator {
        let message = "an operator's closure is reported by no drone".to_owned();
        faults.add("cause_mismatch", "/reported_by", message, None);
    }
    if closure.cause == PublishedCause::Report && closure.until.is_none() {
        let message = "a closure from a report ends by itself".to_owned();
        let hint = "state 'until'".to_owned();
        faults.add("missing_field", "/until", message, Some(hint));
    }
    faults.check(Code::ClosureInvalid, "closure")
}

fn draft_of(closure: &PublishedClosure) -> ClosureDraft {
    ClosureDraft {
        id: closure.id.clone(),
        reason: closure.reason.clone(),
        segments: closure.segments.clone(),
        nodes: closure.nodes.clone(),
        pads: closure.pads.clone(),
        from: closure.from.clone(),
        until: closure.until.clone(),
    }
}
