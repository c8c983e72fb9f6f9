//! Algorithm 1, radius-based: circles about the middle of A-B, then everything.

use super::local::{LocalAnswer, Trial};
use super::network::{E_M, World};

/// Searches growing circles and, once the radius exceeds half the network size, everything.
///
/// A network without size is not for this strategy.
pub(crate) fn radius(world: &World, a: usize, b: usize) -> LocalAnswer {
    let network = world.network;
    let size_m = network.size_m();
    assert!(
        size_m > 0.0,
        "a network without size has no circles to grow"
    );
    let centre_x = (network.nodes[a].x + network.nodes[b].x) / 2.0;
    let centre_y = (network.nodes[a].y + network.nodes[b].y) / 2.0;

    let mut trial = Trial::new(world, a, b);
    let mut radius_m = network.straight_m(a, b);
    loop {
        let circle = trial.area(|node| {
            let dx = network.nodes[node].x - centre_x;
            let dy = network.nodes[node].y - centre_y;
            (dx * dx + dy * dy).sqrt() <= radius_m + E_M
        });
        if trial.search("circle", circle) {
            break;
        }
        radius_m += 0.2 * size_m;
        if radius_m > 0.5 * size_m {
            trial.search_all("global");
            break;
        }
    }
    trial.finish()
}
