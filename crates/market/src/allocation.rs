//! Which drone for which order: as many orders as possible, and of all such assignments the one of least cost.

use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

/// The largest cost that is told from others, in metres: beyond it nothing flies.
pub const COST_MAX_M: f64 = 1e9;

/// Assigns drones (columns) to orders (rows) by costs in metres; none where a drone cannot fly an order. By order the drone
/// that it is assigned, if any.
///
/// First the number of orders assigned is made most, then the sum of their costs least, to the centimetre (Kuhn 1955,
/// Munkres 1957, in whole numbers). A cost that is no number, negative or above [`COST_MAX_M`] counts as none. Rows may have
/// different lengths.
pub fn assign(costs: &[Vec<Option<f64>>]) -> Vec<Option<usize>> {
    let orders = costs.len();
    let drones = costs.iter().map(Vec::len).max().unwrap_or(0);
    if drones == 0 {
        return vec![None; orders];
    }
    let cost_cm = |order: usize, drone: usize| {
        let cost_m = costs[order].get(drone).copied().flatten()?;
        (0.0..=COST_MAX_M)
            .contains(&cost_m)
            .then(|| (cost_m * 100.0).round() as i64)
    };
    // Staying without a drone costs more than all orders together do with one. An impossible pair costs more than that,
    // and there is a way to stay without a drone for each order, so that no impossible pair is ever better.
    let dearest = (0..orders)
        .filter_map(|order| (0..drones).filter_map(|drone| cost_cm(order, drone)).max())
        .sum::<i64>();
    let without = dearest + 1;
    let impossible = without + 1;
    let weights = Matrix::from_fn(orders, drones + orders, |(order, column)| {
        if column >= drones {
            return without;
        }
        cost_cm(order, column).unwrap_or(impossible)
    });
    let (_, columns) = kuhn_munkres_min(&weights);
    let assigned = columns.into_iter().enumerate();
    assigned
        .map(|(order, column)| {
            let is_possible = column < drones && cost_cm(order, column).is_some();
            is_possible.then_some(column)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{COST_MAX_M, assign};
    use crate::seeded::Draws;

    /// How many are assigned, and what they cost in centimetres.
    fn value(costs: &[Vec<Option<f64>>], assigned: &[Option<usize>]) -> (usize, i64) {
        let pairs = assigned.iter().enumerate();
        let pairs = pairs.filter_map(|(order, drone)| costs[order][(*drone)?]);
        let costs: Vec<i64> = pairs
            .map(|cost_m| (cost_m * 100.0).round() as i64)
            .collect();
        (costs.len(), costs.iter().sum())
    }

    /// The best there is, by trying everything: the most assigned, then the least cost.
    fn by_brute_force(costs: &[Vec<Option<f64>>], taken: &mut Vec<usize>) -> (usize, i64) {
        let Some((first, rest)) = costs.split_first() else {
            return (0, 0);
        };
        let mut best = by_brute_force(rest, taken);
        for (drone, cost_m) in first.iter().enumerate() {
            let Some(cost_m) = cost_m.filter(|_| !taken.contains(&drone)) else {
                continue;
            };
            taken.push(drone);
            let (count, cost_cm) = by_brute_force(rest, taken);
            taken.pop();
            let with = (count + 1, cost_cm + (cost_m * 100.0).round() as i64);
            if with.0 > best.0 || (with.0 == best.0 && with.1 < best.1) {
                best = with;
            }
        }
        best
    }

    #[test]
    fn it_equals_brute_force() {
        for seed in 0..2_000 {
            let mut draws = Draws::new(seed);
            let orders = draws.below(6) as usize;
            let drones = draws.below(6) as usize;
            let possible = draws.below(101);
            let mut cost = || {
                // Few different costs, so that many assignments are equally good.
                let is_possible = draws.below(100) < possible;
                let cost_m = draws.below(40) as f64 * 12.34;
                is_possible.then_some(cost_m)
            };
            let costs: Vec<Vec<Option<f64>>> = (0..orders)
                .map(|_| (0..drones).map(|_| cost()).collect())
                .collect();
            let assigned = assign(&costs);
            let mut drones: Vec<usize> = assigned.iter().flatten().copied().collect();
            drones.sort_unstable();
            drones.dedup();
            assert_eq!(
                drones.len(),
                assigned.iter().flatten().count(),
                "seed {seed}: a drone twice"
            );
            let best = by_brute_force(&costs, &mut Vec::new());
            assert_eq!(value(&costs, &assigned), best, "seed {seed}: {costs:?}");
        }
    }

    #[test]
    fn more_orders_go_before_less_cost() {
        // The first order alone would take the near drone; then the second would have none.
        let costs = [vec![Some(1.0), Some(1_000.0)], vec![Some(1.0), None]];
        assert_eq!(assign(&costs), [Some(1), Some(0)]);
    }

    #[test]
    fn impossible_costs_are_none() {
        let odd = [f64::NAN, f64::INFINITY, -1.0, COST_MAX_M * 2.0];
        for cost_m in odd {
            assert_eq!(assign(&[vec![Some(cost_m)]]), [None]);
        }
        assert_eq!(assign(&[vec![], vec![Some(3.0)]]), [None, Some(0)]);
        assert!(assign(&[]).is_empty());
    }
}
