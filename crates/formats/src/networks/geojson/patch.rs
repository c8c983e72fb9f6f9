//! A network with a patch applied: nodes and segments added, changed and removed.
//!
//! Features are those of the native format and are read by the same code. What is added must not be there, what
//! is changed or removed must be: a patch that was made for another network is refused, not guessed at. A node
//! that moves takes the ends of its segments along; lengths that were stated stay.

use super::feature::{Feature, read_feature};
use super::read::check_ends;
use crate::error::{FormatError, FormatErrors};
use crate::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};
use crate::place::{Place, in_degrees};
use crate::wire::NetworkPatch;
use rustc_hash::{FxHashMap, FxHashSet};
use serde_json::Value;

/// The network that a patch makes of a draft; what concerns the network as a whole is checked when it is built.
///
/// # Errors
/// Everything wrong with the patch, places relative to it.
pub fn patch_network(
    draft: &NetworkDraft,
    patch: &NetworkPatch,
) -> Result<NetworkDraft, Vec<FormatError>> {
    let mut patching = Patching::of(draft);
    let root = Place::ROOT;
    patching.remove_segments(patch, &root.member("removed_segments"));
    patching.remove_nodes(patch, &root.member("removed_nodes"));
    let lists = [
        ("added", &patch.added, false),
        ("changed", &patch.changed, true),
    ];
    for (name, features, exists) in lists {
        let list = root.member(name);
        for (index, value) in features.iter().enumerate() {
            patching.put(value, exists, &list.element(index));
        }
    }
    for (name, features, _) in lists {
        patching.check_lines(features, &root.member(name));
    }
    patching.finish()
}

struct Patching {
    next: NetworkDraft,
    nodes: FxHashMap<String, usize>,
    /// By stated id, and by both orders of the nodes for those without one.
    segments: FxHashMap<String, usize>,
    gone_nodes: FxHashSet<usize>,
    gone_segments: FxHashSet<usize>,
    errors: FormatErrors,
}

/// The names under which a segment is found.
fn names(segment: &SegmentDraft) -> Vec<String> {
    match &segment.id {
        Some(id) => vec![id.clone()],
        None => vec![
            format!("{}-{}", segment.from, segment.to),
            format!("{}-{}", segment.to, segment.from),
        ],
    }
}

impl Patching {
    fn of(draft: &NetworkDraft) -> Self {
        let nodes = draft.nodes.iter().enumerate();
        let segments = draft.segments.iter().enumerate();
        Self {
            nodes: nodes
                .map(|(index, node)| (node.id.clone(), index))
                .collect(),
            segments: segments
                .flat_map(|(index, segment)| {
                    names(segment).into_iter().map(move |name| (name, index))
                })
                .collect(),
            next: draft.clone(),
            gone_nodes: FxHashSet::default(),
            gone_segments: FxHashSet::default(),
            errors: FormatErrors::default(),
        }
    }

    fn remove_segments(&mut self, patch: &NetworkPatch, list: &Place<'_>) {
        for (index, id) in patch.removed_segments.iter().enumerate() {
            match self.segments.get(id).copied() {
                Some(found) => {
                    self.gone_segments.insert(found);
                    for name in names(&self.next.segments[found]) {
                        self.segments.remove(&name);
                    }
                }
                None => {
                    let place = list.element(index);
                    let message = format!("is '{id}', a segment that the network does not have");
                    self.errors.push(place.error(message));
                }
            }
        }
    }

    fn remove_nodes(&mut self, patch: &NetworkPatch, list: &Place<'_>) {
        for (index, id) in patch.removed_nodes.iter().enumerate() {
            let id = id.text();
            match self.nodes.remove(id) {
                Some(found) => {
                    self.gone_nodes.insert(found);
                }
                None => {
                    let place = list.element(index);
                    let message = format!("is '{id}', a node that the network does not have");
                    self.errors.push(place.error(message));
                }
            }
        }
    }

    fn put(&mut self, value: &Value, exists: bool, place: &Place<'_>) {
        let put = match read_feature(value, place) {
            Ok(Feature::Node { node, is_integer }) => {
                self.put_node(node, is_integer, exists, place)
            }
            Ok(Feature::Segment { segment, .. }) => self.put_segment(segment, exists, place),
            Err(error) => Err(error),
        };
        if let Err(error) = put {
            self.errors.push(error);
        }
    }

    fn put_node(
        &mut self,
        node: NodeDraft,
        is_integer: bool,
        exists: bool,
        place: &Place<'_>,
    ) -> Result<(), FormatError> {
        let label = format!("node '{}'", node.id);
        let at = |message: &str| place.member("id").error(message).of(label.clone());
        let number = node.id.parse::<i64>();
        let is_number = is_integer || number.is_ok_and(|number| number.to_string() == node.id);
        if self.next.integer_ids && !is_number {
            return Err(at("is no integer, as the ids of this network are"));
        }
        if self.next.coordinates == Coordinates::Geographic {
            let geometry = place.member("geometry");
            in_degrees(node.position, &geometry.member("coordinates"))
                .map_err(|error| error.of(label.clone()))?;
        }
        match (self.nodes.get(&node.id).copied(), exists) {
            (Some(found), true) => self.next.nodes[found] = node,
            (None, false) => {
                self.nodes.insert(node.id.clone(), self.next.nodes.len());
                self.next.nodes.push(node);
            }
            (Some(_), false) => return Err(at("is there already; put it under 'changed'")),
            (None, true) => return Err(at("is not there; put it under 'added'")),
        }
        Ok(())
    }

    fn put_segment(
        &mut self,
        segment: SegmentDraft,
        exists: bool,
        place: &Place<'_>,
    ) -> Result<(), FormatError> {
        let names = names(&segment);
        let label = format!("segment '{}'", names[0]);
        let at = |message: &str| place.error(message).of(label.clone());
        let found = names
            .iter()
            .find_map(|name| self.segments.get(name))
            .copied();
        match (found, exists) {
            (Some(found), true) => self.next.segments[found] = segment,
            (None, false) => {
                let index = self.next.segments.len();
                self.segments
                    .extend(names.into_iter().map(|name| (name, index)));
                self.next.segments.push(segment);
            }
            (Some(_), false) => return Err(at("is there already; put it under 'changed'")),
            (None, true) => return Err(at("is not there; put it under 'added'")),
        }
        Ok(())
    }

    /// Lines end at their nodes, where these are after the patch.
    fn check_lines(&mut self, features: &[Value], list: &Place<'_>) {
        let nodes = self.nodes.iter();
        let positions = nodes
            .map(|(id, &index)| (id.as_str(), self.next.nodes[index].position))
            .collect();
        for (index, value) in features.iter().enumerate() {
            let place = list.element(index);
            // What cannot be read has been told already.
            let Ok(Feature::Segment { segment, ends }) = read_feature(value, &place) else {
                continue;
            };
            let coordinates = self.next.coordinates;
            if let Err(error) = check_ends(&segment, &ends, coordinates, &positions, &place) {
                self.errors
                    .push(error.of(format!("segment '{}'", names(&segment)[0])));
            }
        }
    }

    fn finish(self) -> Result<NetworkDraft, Vec<FormatError>> {
        let mut next = self.next;
        let keep = |gone: &FxHashSet<usize>, index: &mut usize| {
            *index += 1;
            !gone.contains(&(*index - 1))
        };
        let (mut node, mut segment) = (0, 0);
        next.nodes.retain(|_| keep(&self.gone_nodes, &mut node));
        next.segments
            .retain(|_| keep(&self.gone_segments, &mut segment));
        self.errors.or(next)
    }
}
