//! From a draft to a topology: every check a network must pass, then numbering, arrays and trees.

use super::density::DensityGrid;
use super::draft::{Coordinates, NetworkDraft, SegmentDraft};
use super::error::{Feature, MAX_ERRORS, NetworkError, NetworkFault};
use super::identity::{NodeIds, NodeIx, SegmentIds, SegmentIx};
use super::index::{node_tree, segment_tree};
use super::topology::{Arc, NodeFacts, Segment, Topology};
use crate::geo::{AltitudeBand, Bounds, Frame, LocalPlane, Point};
use rustc_hash::{FxHashMap, FxHashSet};
use std::hash::{DefaultHasher, Hasher};

/// Indices are 32 bits wide and arcs are two to a segment.
const MAX_FEATURES: usize = (u32::MAX / 2) as usize;
/// Beyond this a planar coordinate in doubles is coarser than the engine's tolerance.
const MAX_PLANAR_M: f64 = 1e9;
/// Order of the Hilbert curve: cells of the bounding box / 65,536.
const CURVE_ORDER: u8 = 16;

impl Topology {
    /// Checks a draft and builds the topology of it.
    ///
    /// `fingerprint` is the SHA-256 of the text that the draft was read from.
    ///
    /// # Errors
    /// Up to [`MAX_ERRORS`] errors, each naming its feature: ids empty or borne twice, positions that are
    /// not finite or not on Earth, unknown nodes, self-loops, lengths that are not above 0, parallel segments.
    pub fn build(draft: NetworkDraft, fingerprint: [u8; 32]) -> Result<Self, Vec<NetworkError>> {
        let by_id = check_nodes(&draft)?;
        let frame = frame_of(&draft);
        let positions: Vec<Point> = draft
            .nodes
            .iter()
            .map(|node| frame.to_plane(node.position))
            .collect();
        let stated = check_segments(&draft.segments, &by_id, &positions)?;
        drop(by_id);
        Ok(assemble(draft, fingerprint, frame, &positions, stated))
    }

    /// The topology of a network that is not known yet: without nodes and segments.
    pub fn nothing() -> Self {
        let draft = NetworkDraft::default();
        assemble(draft, [0; 32], Frame::Planar, &[], Vec::new())
    }
}

/// A segment whose ends are places in the draft.
struct CheckedSegment {
    from: u32,
    to: u32,
    length_m: f64,
}

fn check_nodes(draft: &NetworkDraft) -> Result<FxHashMap<&str, u32>, Vec<NetworkError>> {
    let network_fault = |fault| {
        vec![NetworkError {
            feature: Feature::Network,
            fault,
        }]
    };
    if draft.nodes.is_empty() {
        return Err(network_fault(NetworkFault::Empty));
    }
    for count in [draft.nodes.len(), draft.segments.len()] {
        if count > MAX_FEATURES {
            let limit = MAX_FEATURES;
            return Err(network_fault(NetworkFault::TooLarge { count, limit }));
        }
    }
    let mut errors = Vec::new();
    let mut by_id = FxHashMap::default();
    by_id.reserve(draft.nodes.len());
    for (index, node) in draft.nodes.iter().enumerate() {
        let duplicate = by_id.insert(node.id.as_str(), index as u32).is_some();
        let fault = if node.id.is_empty() {
            Some(NetworkFault::EmptyId)
        } else if duplicate {
            Some(NetworkFault::DuplicateId {
                id: node.id.clone(),
            })
        } else {
            position_fault(node.position, draft.coordinates)
        };
        if let Some(fault) = fault {
            let id = node.id.clone();
            let feature = Feature::Node { index, id };
            errors.push(NetworkError { feature, fault });
        }
        if errors.len() == MAX_ERRORS {
            break;
        }
    }
    match errors.is_empty() {
        true => Ok(by_id),
        false => Err(errors),
    }
}

fn position_fault(position: [f64; 2], coordinates: Coordinates) -> Option<NetworkFault> {
    if !position.iter().all(|coordinate| coordinate.is_finite()) {
        return Some(NetworkFault::NotFinite { position });
    }
    let [first, second] = position.map(f64::abs);
    match coordinates {
        Coordinates::Planar if first > MAX_PLANAR_M || second > MAX_PLANAR_M => {
            let limit_m = MAX_PLANAR_M;
            Some(NetworkFault::TooFar { position, limit_m })
        }
        Coordinates::Geographic if first > 180.0 || second > 90.0 => {
            Some(NetworkFault::Impossible { position })
        }
        _ => None,
    }
}

fn frame_of(draft: &NetworkDraft) -> Frame {
    let stated = draft
        .nodes
        .iter()
        .map(|node| Point::new(node.position[0], node.position[1]));
    match (draft.coordinates, Bounds::around(stated)) {
        (Coordinates::Geographic, Some(degrees)) => {
            let centre = degrees.centre();
            Frame::Geographic(LocalPlane::about(centre.x, centre.y))
        }
        _ => Frame::Planar,
    }
}

fn check_segments(
    segments: &[SegmentDraft],
    by_id: &FxHashMap<&str, u32>,
    positions: &[Point],
) -> Result<Vec<CheckedSegment>, Vec<NetworkError>> {
    let mut errors = Vec::new();
    let mut checked = Vec::with_capacity(segments.len());
    let mut first_between: FxHashMap<(u32, u32), u32> = FxHashMap::default();
    first_between.reserve(segments.len());
    let mut segment_ids = FxHashSet::default();
    for (index, segment) in segments.iter().enumerate() {
        let outcome = check_segment(segment, by_id, positions).and_then(|found| {
            let ends = (found.from.min(found.to), found.from.max(found.to));
            let earlier = *first_between.entry(ends).or_insert(index as u32) as usize;
            match &segment.id {
                _ if earlier != index => Err(NetworkFault::Parallel { earlier }),
                Some(id) if !segment_ids.insert(id.as_str()) => {
                    Err(NetworkFault::DuplicateId { id: id.clone() })
                }
                _ => Ok(found),
            }
        });
        match outcome {
            Ok(found) => checked.push(found),
            Err(fault) => {
                let (from, to) = (segment.from.clone(), segment.to.clone());
                let feature = Feature::Segment { index, from, to };
                errors.push(NetworkError { feature, fault });
            }
        }
        if errors.len() == MAX_ERRORS {
            break;
        }
    }
    match errors.is_empty() {
        true => Ok(checked),
        false => Err(errors),
    }
}

fn check_segment(
    segment: &SegmentDraft,
    by_id: &FxHashMap<&str, u32>,
    positions: &[Point],
) -> Result<CheckedSegment, NetworkFault> {
    let place = |id: &str| {
        let known = by_id.get(id).copied();
        known.ok_or_else(|| NetworkFault::UnknownNode { id: id.to_owned() })
    };
    let from = place(&segment.from)?;
    let to = place(&segment.to)?;
    if from == to {
        return Err(NetworkFault::SelfLoop);
    }
    let straight_m = positions[from as usize].distance_m(positions[to as usize]);
    let length_m = segment.length_m.unwrap_or(straight_m);
    if !(length_m.is_finite() && length_m > 0.0) {
        let stated = segment.length_m.is_some();
        return Err(NetworkFault::Length { length_m, stated });
    }
    Ok(CheckedSegment { from, to, length_m })
}

/// Places in the draft, in the order of the Hilbert curve through their positions.
fn along_curve(positions: &[Point], bounds: Bounds) -> Vec<u32> {
    let cells = f64::from(1_u32 << CURVE_ORDER) - 1.0;
    let size_m = bounds.longer_side_m();
    let scale = if size_m > 0.0 { cells / size_m } else { 0.0 };
    let key = |position: Point| {
        let x = ((position.x - bounds.min.x) * scale) as u32;
        let y = ((position.y - bounds.min.y) * scale) as u32;
        fast_hilbert::xy2h(x, y, CURVE_ORDER)
    };
    let mut places: Vec<(u64, u32)> = positions
        .iter()
        .enumerate()
        .map(|(place, &position)| (key(position), place as u32))
        .collect();
    places.sort_unstable();
    places.into_iter().map(|(_, place)| place).collect()
}

fn assemble(
    mut draft: NetworkDraft,
    fingerprint: [u8; 32],
    frame: Frame,
    stated_positions: &[Point],
    stated: Vec<CheckedSegment>,
) -> Topology {
    let origin = Point::new(0.0, 0.0);
    let bounds = Bounds::around(stated_positions.iter().copied()).unwrap_or(Bounds {
        min: origin,
        max: origin,
    });
    let curve = along_curve(stated_positions, bounds);
    let positions: Vec<Point> = curve
        .iter()
        .map(|&place| stated_positions[place as usize])
        .collect();
    let (node_ids, facts) = identify(&mut draft, &curve);
    let (order, segments) = number_segments(&stated, &curve);
    let (first_arc, arcs) = adjacency(positions.len(), &segments);
    let segment_ids = segment_ids(&mut draft.segments, (&order, &segments), &node_ids);
    let ends = |segment: &Segment| (positions[segment.from.at()], positions[segment.to.at()]);
    Topology {
        node_ids,
        segment_ids,
        bands: bands(&draft.segments, &order),
        speed_limits: speed_limits(&draft.segments, &order),
        straight_line_scale: straight_line_scale(&positions, &segments),
        density: DensityGrid::by_default(&positions, bounds),
        layout: layout(&positions),
        nodes_nearby: node_tree(&positions),
        segments_nearby: segment_tree(segments.iter().map(ends)),
        name: draft.name,
        attribution: draft.attribution,
        frame,
        positions,
        facts,
        first_arc,
        arcs,
        segments,
        bounds,
        fingerprint,
        fingerprint_text: fingerprint
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect(),
    }
}

/// A digest of positions, the same on every machine.
fn layout(positions: &[Point]) -> u64 {
    let mut hasher = DefaultHasher::new();
    for point in positions {
        hasher.write_u64(point.x.to_bits());
        hasher.write_u64(point.y.to_bits());
    }
    hasher.finish()
}

/// Ids and facts of the nodes, in the order of the curve.
fn identify(draft: &mut NetworkDraft, curve: &[u32]) -> (NodeIds, Vec<NodeFacts>) {
    let mut ids = Vec::with_capacity(curve.len());
    let mut facts = Vec::with_capacity(curve.len());
    for &place in curve {
        let node = &mut draft.nodes[place as usize];
        ids.push(std::mem::take(&mut node.id).into_boxed_str());
        facts.push(NodeFacts {
            altitude: node.altitude,
            pads: node.pads,
            role: node.role,
            name: node.name.take().map(String::into_boxed_str),
        });
    }
    let mut node_ids = NodeIds::new(ids, draft.integer_ids);
    for (alias, kept) in draft.aliases.drain(..) {
        if let Some(node) = node_ids.find(&kept) {
            node_ids.alias(alias, node);
        }
    }
    (node_ids, facts)
}

/// Segments by their nodes along the curve: the places in the draft in that order, and the segments.
fn number_segments(stated: &[CheckedSegment], curve: &[u32]) -> (Vec<u32>, Vec<Segment>) {
    let mut index_of = vec![0_u32; curve.len()];
    for (index, &place) in curve.iter().enumerate() {
        index_of[place as usize] = index as u32;
    }
    let ends = |place: u32| {
        let segment = &stated[place as usize];
        (
            index_of[segment.from as usize],
            index_of[segment.to as usize],
        )
    };
    let mut order: Vec<u32> = (0..stated.len() as u32).collect();
    order.sort_unstable_by_key(|&place| {
        let (from, to) = ends(place);
        (from.min(to), from.max(to))
    });
    let numbered = order.iter().map(|&place| {
        let (from, to) = ends(place);
        Segment {
            length_m: stated[place as usize].length_m,
            from: NodeIx(from),
            to: NodeIx(to),
        }
    });
    let segments = numbered.collect();
    (order, segments)
}

/// The arcs of all nodes in one array, each node's in segment order, and where each node's begin.
fn adjacency(node_count: usize, segments: &[Segment]) -> (Vec<u32>, Vec<Arc>) {
    let mut first_arc = vec![0_u32; node_count + 1];
    for segment in segments {
        first_arc[segment.from.at() + 1] += 1;
        first_arc[segment.to.at() + 1] += 1;
    }
    for node in 0..node_count {
        first_arc[node + 1] += first_arc[node];
    }
    let mut next_free = first_arc.clone();
    let nowhere = Arc {
        length_m: 0.0,
        to: NodeIx(0),
        segment: SegmentIx(0),
    };
    let mut arcs = vec![nowhere; segments.len() * 2];
    for (index, segment) in segments.iter().enumerate() {
        for (node, to) in [(segment.from, segment.to), (segment.to, segment.from)] {
            let slot = &mut next_free[node.at()];
            arcs[*slot as usize] = Arc {
                length_m: segment.length_m,
                to,
                segment: SegmentIx(index as u32),
            };
            *slot += 1;
        }
    }
    (first_arc, arcs)
}

/// The ids of the segments, which stand in this order.
fn segment_ids(
    drafts: &mut [SegmentDraft],
    (order, segments): (&[u32], &[Segment]),
    node_ids: &NodeIds,
) -> SegmentIds {
    if drafts.iter().all(|segment| segment.id.is_none()) {
        return SegmentIds::Derived;
    }
    let id = |(&place, ends): (&u32, &Segment)| {
        let stated = drafts[place as usize].id.take();
        let id = stated.unwrap_or_else(|| node_ids.pair(ends.from, ends.to));
        id.into_boxed_str()
    };
    SegmentIds::stated(order.iter().zip(segments).map(id).collect())
}

fn bands(drafts: &[SegmentDraft], order: &[u32]) -> Vec<AltitudeBand> {
    let first = drafts
        .first()
        .map_or(AltitudeBand::UNLIMITED, |segment| segment.band);
    if drafts.iter().all(|segment| segment.band == first) {
        return vec![first];
    }
    order
        .iter()
        .map(|&place| drafts[place as usize].band)
        .collect()
}

fn speed_limits(drafts: &[SegmentDraft], order: &[u32]) -> Vec<(SegmentIx, f64)> {
    order
        .iter()
        .enumerate()
        .filter_map(|(index, &place)| {
            let limit_mps = drafts[place as usize].speed_limit_mps?;
            Some((SegmentIx(index as u32), limit_mps))
        })
        .collect()
}

fn straight_line_scale(positions: &[Point], segments: &[Segment]) -> f64 {
    let ratio = |segment: &Segment| {
        let straight_m = positions[segment.from.at()].distance_m(positions[segment.to.at()]);
        (straight_m > 0.0).then(|| segment.length_m / straight_m)
    };
    segments
        .iter()
        .filter_map(ratio)
        .reduce(f64::min)
        .unwrap_or(0.0)
}
