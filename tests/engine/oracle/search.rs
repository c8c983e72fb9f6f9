//! The oracle's only search: Bellman-Ford until nothing changes.

use std::collections::BTreeSet;

use super::network::World;

/// The shortest path and its length in metres, over what is open and, where given, inside an area.
///
/// `from` may be left over its own open segments to open nodes even when it is closed; a closed
/// `to` is never entered. From a node to itself the way has no length.
pub(crate) fn shortest(
    world: &World,
    from: usize,
    to: usize,
    restricted_to: Option<&BTreeSet<usize>>,
) -> Option<(f64, Vec<usize>)> {
    let node_count = world.network.nodes.len();
    let inside = |node: usize| restricted_to.is_none_or(|area| area.contains(&node));
    let mut distance_m = vec![f64::INFINITY; node_count];
    let mut previous = vec![usize::MAX; node_count];
    distance_m[from] = 0.0;

    let mut changed = true;
    while changed {
        changed = false;
        for (index, segment) in world.network.segments.iter().enumerate() {
            if !world.segment_is_open(index, from) || !inside(segment.a) || !inside(segment.b) {
                continue;
            }
            for (near, far) in [(segment.a, segment.b), (segment.b, segment.a)] {
                let candidate_m = distance_m[near] + segment.length_m;
                if candidate_m < distance_m[far] {
                    distance_m[far] = candidate_m;
                    previous[far] = near;
                    changed = true;
                }
            }
        }
    }

    if distance_m[to].is_infinite() {
        return None;
    }
    let mut path = vec![to];
    let mut node = to;
    while node != from {
        node = previous[node];
        path.push(node);
    }
    path.reverse();
    Some((distance_m[to], path))
}
