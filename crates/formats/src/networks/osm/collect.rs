//! What the buildings of an extract consist of, gathered in passes over its blocks.
//!
//! A file has nodes before ways before relations, and what a building consists of is known from its end only: each
//! pass keeps what the next one asks for, so that memory goes by the buildings and not by the map.

use super::DegreeBox;
use super::blocks::{Block, each_block};
use super::tags::{BuildingTags, building_tags};
use crate::error::FormatError;
use rustc_hash::{FxHashMap, FxHashSet};

/// Corners of buildings that are held; a city has some million.
const MAX_CORNERS: usize = 50_000_000;

/// A way that is a building.
pub(super) struct BuildingWay {
    pub(super) id: i64,
    pub(super) tags: BuildingTags,
    pub(super) nodes: Vec<i64>,
}

/// A multipolygon that is a building.
pub(super) struct BuildingRelation {
    pub(super) id: i64,
    pub(super) tags: BuildingTags,
    /// The ways of its outer rings.
    pub(super) outer: Vec<i64>,
    /// The ways of its holes.
    pub(super) inner: Vec<i64>,
}

/// Where the nodes of buildings are.
pub(super) type Positions = FxHashMap<i64, [f64; 2]>;
/// The nodes of the ways in relations.
pub(super) type Members = FxHashMap<i64, Vec<i64>>;

/// What all buildings consist of.
pub(super) struct Collected {
    pub(super) ways: Vec<BuildingWay>,
    pub(super) relations: Vec<BuildingRelation>,
    pub(super) members: Members,
    pub(super) positions: Positions,
}

/// Gathers the buildings of an extract, or those with a corner in a box.
pub(super) fn collect(
    extract: &[u8],
    within: Option<&DegreeBox>,
) -> Result<Collected, FormatError> {
    let inside = within.map(|within| nodes_in(extract, within)).transpose()?;
    let is_near = |nodes: &[i64]| {
        let inside = inside.as_ref();
        inside.is_none_or(|inside| nodes.iter().any(|node| inside.contains(node)))
    };
    let mut relations = building_relations(extract)?;
    let (ways, members) = building_ways(extract, &relations, &is_near)?;
    relations.retain(|relation| {
        let mut rings = relation.outer.iter().filter_map(|way| members.get(way));
        inside.is_none() || rings.any(|nodes| is_near(nodes))
    });
    let of_ways = ways.iter().flat_map(|way| &way.nodes);
    let needed: FxHashSet<i64> = of_ways.chain(members.values().flatten()).copied().collect();
    let mut positions = Positions::default();
    each_block(extract, |block| {
        positions.extend(block.nodes().filter(|(id, _)| needed.contains(id)));
        Ok(())
    })?;
    Ok(Collected {
        ways,
        relations,
        members,
        positions,
    })
}

fn nodes_in(extract: &[u8], within: &DegreeBox) -> Result<FxHashSet<i64>, FormatError> {
    let mut inside = FxHashSet::default();
    each_block(extract, |block| {
        let nodes = block
            .nodes()
            .filter(|(_, position)| within.holds(*position));
        inside.extend(nodes.map(|(id, _)| id));
        check_count(inside.len())
    })?;
    Ok(inside)
}

fn building_relations(extract: &[u8]) -> Result<Vec<BuildingRelation>, FormatError> {
    let mut relations = Vec::new();
    let mut count = 0;
    each_block(extract, |block| {
        for relation in block.groups.iter().flat_map(|group| &group.relations) {
            let tags = || block.tags(&relation.keys, &relation.values);
            let is_multipolygon = tags().any(|tag| tag == ("type", "multipolygon"));
            let Some(read) = building_tags(tags()).filter(|_| is_multipolygon) else {
                continue;
            };
            let is_hole = |role: u32| block.text(role) == "inner";
            let (inner, outer): (Vec<_>, Vec<_>) =
                relation.ways().partition(|(_, role)| is_hole(*role));
            let ids = |ways: Vec<(i64, u32)>| ways.into_iter().map(|(id, _)| id).collect();
            count += inner.len() + outer.len();
            relations.push(BuildingRelation {
                id: relation.id,
                tags: read,
                outer: ids(outer),
                inner: ids(inner),
            });
        }
        check_count(count)
    })?;
    Ok(relations)
}

/// The ways that are buildings, and the nodes of those that relations name.
fn building_ways(
    extract: &[u8],
    relations: &[BuildingRelation],
    is_near: &dyn Fn(&[i64]) -> bool,
) -> Result<(Vec<BuildingWay>, Members), FormatError> {
    let rings = relations
        .iter()
        .flat_map(|relation| relation.outer.iter().chain(&relation.inner));
    let named: FxHashSet<i64> = rings.copied().collect();
    let (mut ways, mut members) = (Vec::new(), Members::default());
    let mut count = 0;
    each_block(extract, |block: &Block| {
        for way in block.groups.iter().flat_map(|group| &group.ways) {
            let tags = building_tags(block.tags(&way.keys, &way.values));
            let is_named = named.contains(&way.id);
            if tags.is_none() && !is_named {
                continue;
            }
            let nodes: Vec<i64> = way.nodes().collect();
            if is_named {
                count += nodes.len();
                members.insert(way.id, nodes.clone());
            }
            if let Some(tags) = tags.filter(|_| is_near(&nodes)) {
                count += nodes.len();
                let id = way.id;
                ways.push(BuildingWay { id, tags, nodes });
            }
        }
        check_count(count)
    })?;
    Ok((ways, members))
}

fn check_count(corners: usize) -> Result<(), FormatError> {
    if corners <= MAX_CORNERS {
        return Ok(());
    }
    let message = format!("has more than {MAX_CORNERS} corners of buildings");
    Err(FormatError::new("", message).hint("take a smaller box, or a smaller extract"))
}
