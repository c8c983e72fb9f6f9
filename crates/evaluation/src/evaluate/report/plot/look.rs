//! How a series looks: by its name, the same in all plots of a run.
//!
//! `exact` has the strong blue of the new path in our pictures. Colours are those of
//! Okabe and Ito, and of Tol, where theirs are too pale for thin lines on white; marks and dashes differ as well, for
//! readers who see colours otherwise.

use super::length::px;
use crate::evaluate::record::Series;

/// The shape of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    Circle,
    Square,
    Diamond,
    Up,
    Down,
}

/// How a series looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    /// The class by which a page can give it another colour.
    pub(super) class: &'static str,
    pub(super) colour: &'static str,
    pub(super) mark: Mark,
    /// Only the outline of the mark is drawn.
    pub(super) is_hollow: bool,
    pub(super) dash: &'static str,
    pub(super) line_px: f64,
}

const SOLID: &str = "none";
const DASHES: &str = "6 3";

const fn look(class: &'static str, colour: &'static str, mark: Mark, dash: &'static str) -> Look {
    Look {
        class,
        colour,
        mark,
        is_hollow: false,
        dash,
        line_px: 1.8,
    }
}

/// What series are called, the longer of two names that begin alike first.
const KNOWN: [(&str, Look); 10] = [
    (
        "exact, cold",
        Look {
            is_hollow: true,
            ..look("plot-exact", "#0072b2", Mark::Circle, "9 3")
        },
    ),
    ("exact", look("plot-exact", "#0072b2", Mark::Circle, SOLID)),
    (
        "two-phased, polygons",
        look("plot-polygons", "#8f2d00", Mark::Up, DASHES),
    ),
    (
        "two-phased, no skipping",
        look("plot-stages", "#c98500", Mark::Down, "2 2"),
    ),
    (
        "two-phased",
        look("plot-two-phased", "#d55e00", Mark::Up, SOLID),
    ),
    (
        "cell density",
        look("plot-cells", "#009e73", Mark::Square, SOLID),
    ),
    (
        "radius",
        look("plot-radius", "#aa4499", Mark::Diamond, SOLID),
    ),
    (
        "dijkstra",
        look("plot-dijkstra", "#5f6368", Mark::Down, "5 2"),
    ),
    (
        "a*",
        look("plot-astar", "#7d7a00", Mark::Diamond, "7 2 2 2"),
    ),
    (
        "bellman-ford",
        look("plot-bellman", "#222222", Mark::Square, "2 2"),
    ),
];

/// For series that are no methods, in this order.
const OTHERS: [Look; 4] = [
    look("plot-other-1", "#332288", Mark::Circle, SOLID),
    look("plot-other-2", "#b86a00", Mark::Square, DASHES),
    look("plot-other-3", "#117733", Mark::Diamond, "2 2"),
    look("plot-other-4", "#882255", Mark::Up, "7 2 2 2"),
];

/// The looks of a figure's series, no two alike while there are enough.
pub(super) fn looks(series: &[Series]) -> Vec<Look> {
    let mut looks: Vec<Look> = Vec::with_capacity(series.len());
    let mut others = 0;
    for one in series {
        let name = one.name.to_lowercase();
        let known = KNOWN.iter().find(|(begin, _)| name.starts_with(begin));
        let mut look = match known {
            Some((_, look)) => *look,
            None => {
                others += 1;
                OTHERS[(others - 1) % OTHERS.len()]
            }
        };
        let is_taken = |look: &Look, looks: &[Look]| {
            let alike = |other: &&Look| other.class == look.class;
            looks
                .iter()
                .filter(alike)
                .any(|other| (other.mark, other.is_hollow) == (look.mark, look.is_hollow))
        };
        // Two readings of one method: the same colour, told apart by their marks.
        if is_taken(&look, &looks) {
            look.is_hollow = !look.is_hollow;
            look.dash = if look.dash == SOLID { DASHES } else { SOLID };
        }
        if is_taken(&look, &looks) {
            (look.mark, look.dash) = (Mark::Down, "2 2");
        }
        looks.push(look);
    }
    looks
}

impl Look {
    /// The outline of the mark at a place, as the `d` of a path.
    pub(super) fn outline(&self, x: f64, y: f64) -> String {
        let r = 4.0;
        let through = |corners: &[(f64, f64)]| {
            let corners: Vec<String> = corners
                .iter()
                .map(|(right, down)| format!("{} {}", px(x + right * r), px(y + down * r)))
                .collect();
            format!("M{}z", corners.join("L"))
        };
        match self.mark {
            Mark::Circle => format!(
                "M{} {}a{r} {r} 0 1 0 {d} 0a{r} {r} 0 1 0 -{d} 0z",
                px(x - r),
                px(y),
                r = px(r),
                d = px(2.0 * r),
            ),
            Mark::Square => through(&[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)]),
            Mark::Diamond => through(&[(0.0, -1.3), (1.3, 0.0), (0.0, 1.3), (-1.3, 0.0)]),
            Mark::Up => through(&[(0.0, -1.2), (1.15, 0.9), (-1.15, 0.9)]),
            Mark::Down => through(&[(0.0, 1.2), (1.15, -0.9), (-1.15, -0.9)]),
        }
    }
}

/// Every class and its colour on white.
#[cfg(test)]
pub(in crate::evaluate::report) fn classes() -> Vec<&'static str> {
    let known = KNOWN.iter().map(|(_, look)| look.class);
    known.chain(OTHERS.iter().map(|look| look.class)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_looks_the_same_everywhere_and_two_names_differ() {
        let named = |names: &[&str]| {
            let series = names.iter().map(|name| Series {
                name: (*name).to_owned(),
                points: Vec::new(),
            });
            looks(&series.collect::<Vec<_>>())
        };
        let all: Vec<&str> = KNOWN.iter().map(|(name, _)| *name).collect();
        let looks = named(&all);
        for (index, look) in looks.iter().enumerate() {
            assert_eq!(named(&[all[index]]), [*look], "{}", all[index]);
            let same = |other: &&Look| *other == look;
            assert_eq!(looks.iter().filter(same).count(), 1, "{}", all[index]);
        }
        let twice = named(&[
            "Dijkstra, A to B",
            "Dijkstra, whole route",
            "Dijkstra, full tree",
        ]);
        assert!(twice.iter().all(|look| look.class == "plot-dijkstra"));
        assert!(twice[0] != twice[1] && twice[1] != twice[2] && twice[0] != twice[2]);
    }
}
