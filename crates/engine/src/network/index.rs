//! The R-trees over a network: what is near, inside, crossed.
//!
//! Boxes are kept in single precision, rounded outwards, which halves the trees; what they find is a
//! candidate, and exact geometry in double precision decides.

use super::identity::{NodeIx, SegmentIx};
use crate::geo::{Bounds, Point};
use rstar::{AABB, PointDistance, RTree, RTreeObject};

/// A node in the R-tree.
#[derive(Clone, Copy, Debug)]
pub struct NodeBox {
    min: [f32; 2],
    max: [f32; 2],
    /// The node's index.
    pub node: NodeIx,
}

/// A segment in the R-tree.
#[derive(Clone, Copy, Debug)]
pub struct SegmentBox {
    min: [f32; 2],
    max: [f32; 2],
    /// The segment's index.
    pub segment: SegmentIx,
}

impl RTreeObject for NodeBox {
    type Envelope = AABB<[f32; 2]>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_corners(self.min, self.max)
    }
}

impl PointDistance for NodeBox {
    /// In single precision: good for an order of candidates, which exact distances then settle.
    fn distance_2(&self, point: &[f32; 2]) -> f32 {
        self.envelope().distance_2(point)
    }
}

impl RTreeObject for SegmentBox {
    type Envelope = AABB<[f32; 2]>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_corners(self.min, self.max)
    }
}

impl PointDistance for SegmentBox {
    /// To the box, not to the segment: never more than the distance to the segment, but for rounding.
    fn distance_2(&self, point: &[f32; 2]) -> f32 {
        self.envelope().distance_2(point)
    }
}

/// A box in single precision that holds the box given.
pub fn outer_box(bounds: Bounds) -> AABB<[f32; 2]> {
    AABB::from_corners(
        [round_down(bounds.min.x), round_down(bounds.min.y)],
        [round_up(bounds.max.x), round_up(bounds.max.y)],
    )
}

fn round_down(value: f64) -> f32 {
    let rounded = value as f32;
    match f64::from(rounded) > value {
        true => rounded.next_down(),
        false => rounded,
    }
}

fn round_up(value: f64) -> f32 {
    let rounded = value as f32;
    match f64::from(rounded) < value {
        true => rounded.next_up(),
        false => rounded,
    }
}

pub(super) fn node_tree(positions: &[Point]) -> RTree<NodeBox> {
    let boxes = positions.iter().enumerate().map(|(index, &position)| {
        let around = outer_box(Bounds {
            min: position,
            max: position,
        });
        NodeBox {
            min: around.lower(),
            max: around.upper(),
            node: NodeIx(index as u32),
        }
    });
    RTree::bulk_load(boxes.collect())
}

pub(super) fn segment_tree(ends: impl Iterator<Item = (Point, Point)>) -> RTree<SegmentBox> {
    let boxes = ends.enumerate().map(|(index, (from, to))| {
        let around = outer_box(Bounds {
            min: Point::new(from.x.min(to.x), from.y.min(to.y)),
            max: Point::new(from.x.max(to.x), from.y.max(to.y)),
        });
        SegmentBox {
            min: around.lower(),
            max: around.upper(),
            segment: SegmentIx(index as u32),
        }
    });
    RTree::bulk_load(boxes.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_in_single_precision_never_loses_the_point_it_holds() {
        for value in [0.1, -0.1, 1e7 + 0.3, -33.87654321, 16_777_217.0] {
            assert!(f64::from(round_down(value)) <= value);
            assert!(f64::from(round_up(value)) >= value);
        }
    }
}
