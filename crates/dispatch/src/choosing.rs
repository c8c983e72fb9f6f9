//! Which drone flies which of the orders that wait at the same time.

use super::batch::Waiting;
use super::fleet::Candidate;
use jiff::Timestamp;
use skyway_market::allocation::assign;
use skyway_service::refusal::{Code, Refusal};

/// What it would cost to fly an order, by drone.
pub(super) struct Row {
    pub(super) costs: Vec<Option<f64>>,
    /// How many free drones can fly it.
    pub(super) fitting: usize,
}

impl Row {
    pub(super) fn of(order: &Waiting, free: &[Candidate<'_>], now: Timestamp) -> Self {
        let costs = order.costs(free, now);
        Self {
            fitting: costs.iter().flatten().count(),
            costs,
        }
    }
}

/// By order the drone that is best for all together.
pub(super) async fn best(rows: &[Row], drones: usize) -> Result<Vec<Option<usize>>, Refusal> {
    let costs: Vec<&[Option<f64>]> = rows.iter().map(|row| &*row.costs).collect();
    let (kept, costs) = nearest(&costs, drones);
    let assigned = tokio::task::spawn_blocking(move || assign(&costs)).await;
    let assigned = assigned
        .map_err(|error| Refusal::new(Code::Internal, format!("a computation failed: {error}")))?;
    let chosen = assigned.into_iter();
    Ok(chosen.map(|column| Some(kept[column?])).collect())
}

/// The drones that may be assigned, and their costs: of each order as many of the cheapest as there are orders. Some best
/// assignment needs no others, as one of these is always left.
fn nearest(costs: &[&[Option<f64>]], drones: usize) -> (Vec<usize>, Vec<Vec<Option<f64>>>) {
    let mut is_kept = vec![false; drones];
    for row in costs {
        let possible = row.iter().enumerate();
        let mut possible: Vec<(usize, f64)> = possible
            .filter_map(|(drone, cost_m)| Some((drone, (*cost_m)?)))
            .collect();
        possible.sort_by(|one, other| one.1.total_cmp(&other.1));
        for (drone, _) in possible.into_iter().take(costs.len()) {
            is_kept[drone] = true;
        }
    }
    let kept: Vec<usize> = (0..drones).filter(|&drone| is_kept[drone]).collect();
    let rows = costs.iter();
    let rows = rows.map(|row| kept.iter().map(|&drone| row[drone]).collect());
    let rows = rows.collect();
    (kept, rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use skyway_engine::network::Seeded;

    /// How many orders have a drone, and what their flights cost.
    fn told(costs: &[Vec<Option<f64>>]) -> (usize, f64) {
        let assigned = assign(costs).into_iter().zip(costs);
        let chosen: Vec<f64> = assigned.filter_map(|(column, row)| row[column?]).collect();
        (chosen.len(), chosen.iter().sum())
    }

    #[test]
    fn the_nearest_drones_are_as_good_as_all() {
        for seed in 0..500 {
            let mut seeded = Seeded::new(seed);
            let orders = 1 + usize::from(seeded.below(6));
            let drones = 1 + usize::from(seeded.below(20));
            let costs: Vec<Vec<Option<f64>>> = (0..orders)
                .map(|_| {
                    let mut cost = || {
                        let cost_m = seeded.between(0.0, 5_000.0).round();
                        (seeded.below(4) > 0).then_some(cost_m)
                    };
                    (0..drones).map(|_| cost()).collect()
                })
                .collect();
            let rows: Vec<&[Option<f64>]> = costs.iter().map(|row| &**row).collect();
            let (_, kept) = nearest(&rows, drones);
            assert_eq!(told(&kept), told(&costs), "seed {seed}");
        }
    }
}
