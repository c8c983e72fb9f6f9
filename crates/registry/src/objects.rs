//! What lies over a network, one object at a time: zones, weather, and whatever is lifted.

use super::Registry;
use super::ended::is_over;
use super::store::{Expectation, NetworkState, NewChange, ObjectsQuery, Version};
use super::topologies::{aside, version_of};
use super::writes::{Decision, Intent, Reply, WriteOptions};
use serde_json::Value;
use skyway_contract::{ChangeOperation, ObjectKind, PublishedClosure, PublishedObjects, Weather};
use skyway_formats::{ZoneId, zone_to_feature};
use skyway_service::intake::{Expected, Faults, PageRequest, read_weather, read_zone, token};
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;

/// An object as it is told. Ids of nodes are text, though older versions kept them as integers; the log, whose
/// digests cover what was written, goes on as it is.
fn as_told(kind: ObjectKind, body: &str) -> Result<Value, Refusal> {
    let told = match kind {
        ObjectKind::Closure => {
            serde_json::from_str::<PublishedClosure>(body).and_then(serde_json::to_value)
        }
        ObjectKind::Network | ObjectKind::Weather | ObjectKind::Zone => serde_json::from_str(body),
    };
    told.map_err(|error| Refusal::new(Code::Internal, format!("an object is no JSON: {error}")))
}

impl Registry {
    /// Puts a zone: a new one, or under an id, new or in place of the version that `If-Match` names.
    ///
    /// # Errors
    /// When it is not valid, its id is taken, or another version is current.
    pub async fn put_zone(
        self: &Arc<Self>,
        network: &str,
        id: Option<&str>,
        feature: Value,
        manner: &WriteOptions,
    ) -> Result<Reply, Refusal> {
        let intent = Intent::PutZone {
            feature,
            id: id.map(str::to_owned),
            made: made_id("zone")?,
        };
        self.write(network, intent, manner).await
    }

    /// Puts the weather, in place of the version that `If-Match` names.
    ///
    /// # Errors
    /// When it is not valid, or another version is current.
    pub async fn put_weather(
        self: &Arc<Self>,
        network: &str,
        weather: Weather,
        manner: &WriteOptions,
    ) -> Result<Reply, Refusal> {
        self.write(network, Intent::PutWeather { weather }, manner)
            .await
    }

    /// Lifts a zone or a closure, of the version that `If-Match` names.
    ///
    /// # Errors
    /// When there is none, or another version is current.
    pub async fn delete(
        self: &Arc<Self>,
        network: &str,
        kind: ObjectKind,
        id: &str,
        manner: &WriteOptions,
    ) -> Result<Reply, Refusal> {
        let id = id.to_owned();
        self.write(network, Intent::Delete { kind, id }, manner)
            .await
    }

    /// An object as JSON text, and its entity tag.
    ///
    /// # Errors
    /// When there is none.
    pub async fn object(
        &self,
        network: &str,
        kind: ObjectKind,
        id: &str,
    ) -> Result<(String, String), Refusal> {
        let found = self.store.object(network, kind, id).await?;
        let Some(change) = found else {
            self.state(network).await?;
            return Err(Refusal::not_found(kind.name(), id));
        };
        let etag = version_of(&change).etag();
        let body = change.body.unwrap_or_default();
        Ok((as_told(kind, &body)?.to_string(), etag))
    }

    /// A page of the zones or closures of a network, by id.
    ///
    /// # Errors
    /// When there is no such network, or the page is not one.
    pub async fn objects(
        &self,
        network: &str,
        kind: ObjectKind,
        page: &PageRequest,
    ) -> Result<PublishedObjects, Refusal> {
        let page = page.check()?;
        let query = ObjectsQuery {
            network: network.to_owned(),
            at: None,
            kind: Some(kind),
            after: page.after.map(|id| (kind, id)),
            limit: page.size as u64,
            bytes: self.settings.page_bytes,
        };
        let read = self.store.objects(&query).await?;
        let read = read.ok_or_else(|| Refusal::not_found("network", network))?;
        let last = read.objects.last().filter(|_| read.has_more);
        let next_page_token = last.map(|last| token(&last.id));
        let bodies = read
            .objects
            .iter()
            .filter_map(|object| object.body.as_deref());
        let objects: Result<Vec<Value>, _> = bodies.map(|body| as_told(kind, body)).collect();
        let objects = objects?;
        Ok(PublishedObjects {
            revision: read.at,
            objects,
            next_page_token,
        })
    }

    pub(super) async fn decide_zone(
        self: &Arc<Self>,
        network: &str,
        feature: &Value,
        id: Option<&str>,
        made: &str,
        manner: &WriteOptions,
    ) -> Result<Decision, Refusal> {
        let (state, composed) = self.composed(network).await?;
        let margin_m = self.settings.margin_m;
        let (owned, fixed, made) = (feature.clone(), id.map(str::to_owned), made.to_owned());
        let zone = aside(move || {
            let id = match &fixed {
                Some(id) => ZoneId::Fixed(id),
                None => ZoneId::StatedOr(&made),
            };
            read_zone(owned, id, composed.topology.frame(), margin_m)
        });
        let zone = zone.await??;
        check_zone_id(zone.id())?;
        let object = zone_to_feature(&zone);
        let put = Put {
            kind: ObjectKind::Zone,
            id: zone.id(),
            is_new: id.is_none(),
            body: object.to_string(),
            object: Some(object),
        };
        self.decide_put(&state, put, manner).await
    }

    pub(super) async fn decide_weather(
        self: &Arc<Self>,
        network: &str,
        weather: &Weather,
        manner: &WriteOptions,
    ) -> Result<Decision, Refusal> {
        let (state, composed) = self.composed(network).await?;
        let owned = weather.clone();
        aside(move || read_weather(&owned, composed.topology.frame())).await??;
        let object = serde_json::to_value(weather).map_err(|error| {
            Refusal::new(
                Code::Internal,
                format!("the weather has no JSON form: {error}"),
            )
        })?;
        let put = Put {
            kind: ObjectKind::Weather,
            id: "",
            is_new: false,
            body: object.to_string(),
            object: Some(object),
        };
        self.decide_put(&state, put, manner).await
    }

    /// Decides to put something that is valid on the network as it stands.
    pub(super) async fn decide_put(
        &self,
        state: &NetworkState,
        put: Put<'_>,
        manner: &WriteOptions,
    ) -> Result<Decision, Refusal> {
        let Put { kind, id, .. } = put;
        let found = self.store.object(&state.id, kind, id).await?;
        let version = found.as_ref().map(version_of);
        let expected = match put.is_new {
            true => Expected::Absent,
            false => Expected::of(manner.if_match.clone()),
        };
        let now = self.clock.now();
        // Everyone has ended it by now, and who closes the same again knows of no version of it.
        let has_ended = found.is_some_and(|object| is_over(&object, now));
        let in_the_way = version.filter(|_| !has_ended || matches!(expected, Expected::Tags(_)));
        let etag = in_the_way.map(Version::etag);
        expected.check(etag.as_deref(), kind.name(), id)?;
        let mut expects = vec![
            expectation(ObjectKind::Network, "", Some(state.topology)),
            expectation(kind, id, version),
        ];
        let mut lifts = None;
        // Edges keep zones and closures under one roof of ids.
        if let Some(other) = namesake(kind) {
            let found = self.store.object(&state.id, other, id).await?;
            if found.as_ref().is_some_and(|object| !is_over(object, now)) {
                let detail = format!("there is a {} '{id}'; take another id", other.name());
                return Err(Refusal::new(Code::AlreadyExists, detail));
            }
            expects.push(expectation(other, id, found.as_ref().map(version_of)));
            // One that has ended makes way.
            lifts = found.map(|_| lifting(other, id));
        }
        Ok(Decision {
            creates: false,
            created: in_the_way.is_none(),
            head: None,
            expects,
            change: NewChange {
                kind,
                id: id.to_owned(),
                operation: ChangeOperation::Put,
                body: Some(put.body),
            },
            lifts,
            object: put.object,
            network: None,
        })
    }

    pub(super) async fn decide_delete(
        &self,
        network: &str,
        kind: ObjectKind,
        id: &str,
        manner: &WriteOptions,
    ) -> Result<Decision, Refusal> {
        let Some(version) = self.version(network, kind, id).await? else {
            self.state(network).await?;
            return Err(Refusal::not_found(kind.name(), id));
        };
        let etag = version.etag();
        Expected::of(manner.if_match.clone()).check(Some(&etag), kind.name(), id)?;
        Ok(Decision {
            creates: false,
            created: false,
            head: None,
            expects: vec![expectation(kind, id, Some(version))],
            change: lifting(kind, id),
            lifts: None,
            object: None,
            network: None,
        })
    }

    async fn version(
        &self,
        network: &str,
        kind: ObjectKind,
        id: &str,
    ) -> Result<Option<Version>, Refusal> {
        let found = self.store.object(network, kind, id).await?;
        Ok(found.as_ref().map(version_of))
    }
}

/// Something valid that is to be put.
#[derive(Debug)]
pub(super) struct Put<'a> {
    pub(super) kind: ObjectKind,
    pub(super) id: &'a str,
    /// Whether it must not be there yet, whatever `If-Match` says.
    pub(super) is_new: bool,
    pub(super) body: String,
    pub(super) object: Option<Value>,
}

/// An id that cannot stand in a path cannot be looked up by anyone, nor kept by every store.
fn check_zone_id(id: &str) -> Result<(), Refusal> {
    let mut faults = Faults::default();
    if id.chars().any(char::is_control) {
        let message = "the id has a control character in it".to_owned();
        faults.add("zone_id_invalid", "/id", message, None);
    }
    faults.check(Code::ZoneInvalid, "zone")
}

fn lifting(kind: ObjectKind, id: &str) -> NewChange {
    NewChange {
        kind,
        id: id.to_owned(),
        operation: ChangeOperation::Delete,
        body: None,
    }
}

fn expectation(kind: ObjectKind, id: &str, version: Option<Version>) -> Expectation {
    Expectation {
        kind,
        id: id.to_owned(),
        version,
    }
}

/// The kind whose ids must be others.
fn namesake(kind: ObjectKind) -> Option<ObjectKind> {
    match kind {
        ObjectKind::Zone => Some(ObjectKind::Closure),
        ObjectKind::Closure => Some(ObjectKind::Zone),
        ObjectKind::Network | ObjectKind::Weather => None,
    }
}

/// An id for something that has none: random, as any of several processes may make it.
pub(super) fn made_id(what: &str) -> Result<String, Refusal> {
    let random = super::random_hex().map_err(|error| {
        Refusal::new(
            Code::Internal,
            format!("the system has no random bits: {error}"),
        )
    })?;
    Ok(format!("{what}-{random}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_closure_that_an_older_version_kept_is_told_with_ids_as_text() {
        let kept = r#"{"id":"c","cause":"operator","confirmed":true,"nodes":[406],"pads":["a",7]}"#;
        let told = as_told(ObjectKind::Closure, kept).expect("a closure");
        let expected = json!({
            "id": "c", "cause": "operator", "confirmed": true, "nodes": ["406"], "pads": ["a", "7"],
        });
        assert_eq!(told, expected);
    }
}
