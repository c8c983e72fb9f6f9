//! Algorithm 3, two-phased: triangle, rhombus and rectangle along A-B, then growth by nearest
//! neighbours.

use std::collections::BTreeSet;

use super::local::{LocalAnswer, Trial};
use super::network::{E_M, World};

/// Searches the three shapes, then the rectangle grown round by round, then everything.
///
/// `A` and `B` in the same place are not for this strategy.
pub(crate) fn two_phased(
    world: &World,
    a: usize,
    b: usize,
    val_ratio: f64,
    stage_skipping: bool,
) -> LocalAnswer {
    let mut trial = Trial::new(world, a, b);
    let shapes = shapes(world, &trial, a, b, val_ratio);

    let triangle_skipped = stage_skipping && 4 * shapes.triangle.len() < shapes.rectangle.len();
    if triangle_skipped {
        trial.skip("triangle", shapes.triangle);
    } else if trial.search("triangle", shapes.triangle) {
        return trial.finish();
    }
    let rhombus_skipped = stage_skipping && 2 * shapes.rhombus.len() < shapes.rectangle.len();
    if rhombus_skipped {
        trial.skip("rhombus", shapes.rhombus);
    } else if trial.search("rhombus", shapes.rhombus) {
        return trial.finish();
    }
    if trial.search("rectangle", shapes.rectangle.clone()) {
        return trial.finish();
    }

    let counted = world.counted_nodes(a, b).len();
    let mut area = shapes.rectangle;
    loop {
        let grown = grow(world, &area, a);
        let nothing_added = grown.len() == area.len();
        area = grown;
        if nothing_added || 2 * area.len() >= counted {
            trial.search_all("global");
            return trial.finish();
        }
        if trial.search("grown", area.clone()) {
            return trial.finish();
        }
    }
}

struct Shapes {
    triangle: BTreeSet<usize>,
    rhombus: BTreeSet<usize>,
    rectangle: BTreeSet<usize>,
}

fn shapes(world: &World, trial: &Trial, a: usize, b: usize, val_ratio: f64) -> Shapes {
    let nodes = &world.network.nodes;
    let length_m = world.network.straight_m(a, b);
    assert!(
        length_m > 0.0,
        "A and B in the same place span no rectangle"
    );
    let val = val_ratio * length_m;
    let (vx, vy) = (nodes[b].x - nodes[a].x, nodes[b].y - nodes[a].y);
    let along_and_across = |node: usize| {
        let (dx, dy) = (nodes[node].x - nodes[a].x, nodes[node].y - nodes[a].y);
        (
            (dx * vx + dy * vy) / length_m,
            (vx * dy - vy * dx) / length_m,
        )
    };
    let in_rectangle = |node: usize| {
        let (s, t) = along_and_across(node);
        -E_M <= s && s <= length_m + E_M && t.abs() <= val + E_M
    };
    let on_left = |node: usize| along_and_across(node).1 >= -E_M;
    let on_right = |node: usize| along_and_across(node).1 <= E_M;
    let in_rhombus = |node: usize| {
        let (s, t) = along_and_across(node);
        let tolerance = E_M * (val * val + length_m * length_m / 4.0).sqrt();
        (s - length_m / 2.0).abs() * val + t.abs() * length_m / 2.0
            <= val * length_m / 2.0 + tolerance
    };

    let left = trial.area(|node| in_rectangle(node) && on_left(node));
    let right = trial.area(|node| in_rectangle(node) && on_right(node));
    let rhombus = trial.area(in_rhombus);
    let taken_half = if right.len() > left.len() {
        right
    } else {
        left
    };
    let triangle = rhombus.intersection(&taken_half).copied().collect();
    Shapes {
        triangle,
        rhombus,
        rectangle: trial.area(in_rectangle),
    }
}

/// One round of growth: for every node of the area as it stands, its nearest neighbour outside, by
/// length and then by node order, over open segments.
fn grow(world: &World, area: &BTreeSet<usize>, a: usize) -> BTreeSet<usize> {
    let network = world.network;
    let mut grown = area.clone();
    for &node in area {
        let outside = network
            .neighbours(node)
            .into_iter()
            .filter(|&(other, segment)| {
                !area.contains(&other) && world.segment_is_open(segment, a)
            });
        let nearest = outside.min_by(|&(one, by_one), &(other, by_other)| {
            let one_m = network.segments[by_one].length_m;
            let other_m = network.segments[by_other].length_m;
            one_m
                .total_cmp(&other_m)
                .then(network.rank[one].cmp(&network.rank[other]))
        });
        grown.extend(nearest.map(|(other, _)| other));
    }
    grown
}
