//! What the paper leaves open: one table of axes, each with what can be taken for it.
//!
//! A set of conventions chooses one option of every axis for the whole paper. A claim depends on some axes, and
//! its readings are the choices on those.

use super::super::design::Pool;
use crate::network::Joining;

/// Something that the paper leaves open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axis {
    Networks,
    Placing,
    Areas,
    Baseline,
    Inside,
    Average,
    Length,
    Cells,
    Val,
    Extent,
    Faster,
    Clock,
    Library,
}

/// What an axis is called, what a miss that it decides is put down to, and its options.
pub(super) struct Open {
    pub(super) axis: Axis,
    pub(super) title: &'static str,
    pub(super) cause: &'static str,
    pub(super) options: &'static [&'static str],
}

const fn open(
    axis: Axis,
    title: &'static str,
    cause: &'static str,
    options: &'static [&'static str],
) -> Open {
    Open {
        axis,
        title,
        cause,
        options,
    }
}

const WORDING: &str = "wording";
const AXES: usize = 13;

/// All axes, in the order of [`Axis`].
pub(super) const OPEN: [Open; AXES] = [
    open(
        Axis::Networks,
        "networks",
        "generator",
        &[
            "nearest neighbours joined",
            "joined at random within reach",
            "joined at random, reach up to 0.1 of the map",
            "joined at random, density growing with size",
            "Delaunay thinned to K",
            "Sydney CBD",
        ],
    ),
    open(
        Axis::Placing,
        "failed segment",
        "failures",
        &[
            "uniform on the path",
            "by length on the path",
            "uniform in the network",
        ],
    ),
    open(
        Axis::Areas,
        "areas",
        WORDING,
        &["areas A → B", "areas A → destination"],
    ),
    open(
        Axis::Baseline,
        "baseline",
        WORDING,
        &[
            "Dijkstra A → B, early exit",
            "Dijkstra A → B, full tree",
            "Dijkstra A → destination, early exit",
            "Dijkstra A → destination, full tree",
        ],
    ),
    open(
        Axis::Inside,
        "inside areas",
        WORDING,
        &["Dijkstra inside", "A* inside"],
    ),
    open(
        Axis::Average,
        "average",
        WORDING,
        &["ratio of means", "mean of ratios", "median of ratios"],
    ),
    open(
        Axis::Length,
        "distance",
        WORDING,
        &[
            "rest of the route over the shortest",
            "new part over the shortest",
            "rest of the route over the baseline's",
            "whole route, flown part included, over the shortest",
        ],
    ),
    open(
        Axis::Cells,
        "cells",
        WORDING,
        &[
            "cells of 1/16 of the map, squares about nodes",
            "cells of 1/8, squares",
            "cells of 1/32, squares",
            "cells of 1/16, slices of the array",
        ],
    ),
    open(
        Axis::Val,
        "val",
        WORDING,
        &[
            "val = 1/2 of the leg",
            "val = 1/4 of the leg",
            "val = the leg",
        ],
    ),
    open(
        Axis::Extent,
        "search space",
        WORDING,
        &[
            "nodes of the last area",
            "segments of the last area",
            "nodes of all areas",
            "segments of all areas",
        ],
    ),
    open(
        Axis::Faster,
        "“79 % faster”",
        WORDING,
        &["as 79 % less time", "as 1.79 times as fast"],
    ),
    open(
        Axis::Clock,
        "time",
        "language",
        &["our time", "nodes settled, as an interpreter pays for each"],
    ),
    open(
        Axis::Library,
        "Bellman-Ford",
        "library",
        &[
            "in rounds over all segments",
            "with a queue, as NetworkX has it",
        ],
    ),
];

/// The networks of each option of [`Axis::Networks`].
pub(super) const POOLS: [Pool; 6] = [
    Pool::Joined(Joining::Nearest),
    Pool::Joined(Joining::Random),
    Pool::ShortReach,
    Pool::Together,
    Pool::Joined(Joining::Delaunay),
    Pool::Real,
];

/// One option of every axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Choice([u8; AXES]);

impl Choice {
    /// The option of an axis.
    pub(super) fn of(&self, axis: Axis) -> usize {
        usize::from(self.0[axis as usize])
    }

    /// The same with another option of an axis.
    pub(super) fn with(mut self, axis: Axis, option: usize) -> Self {
        self.0[axis as usize] = option as u8;
        self
    }

    /// The words for an option.
    pub(super) fn words(&self, axis: Axis) -> &'static str {
        OPEN[axis as usize].options[self.of(axis)]
    }

    /// The number of the choice among all of some axes.
    pub(super) fn number(&self, axes: &[Axis]) -> usize {
        axes.iter()
            .fold(0, |number, &axis| number * count(axis) + self.of(axis))
    }

    /// The choice of a number; other axes have their first option.
    pub(super) fn numbered(mut number: usize, axes: &[Axis]) -> Self {
        let mut choice = Self::default();
        for &axis in axes.iter().rev() {
            choice = choice.with(axis, number % count(axis));
            number /= count(axis);
        }
        choice
    }

    /// What a claim that depends on some axes is taken to mean.
    pub(super) fn name(&self, axes: &[Axis]) -> String {
        let words: Vec<&str> = axes.iter().map(|&axis| self.words(axis)).collect();
        words.join("; ")
    }
}

/// How many options an axis has.
pub(super) fn count(axis: Axis) -> usize {
    OPEN[axis as usize].options.len()
}

/// How many choices there are on some axes.
pub(super) fn choices(axes: &[Axis]) -> usize {
    axes.iter().map(|&axis| count(axis)).product()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_choice_is_found_by_its_number() {
        for (place, open) in OPEN.iter().enumerate() {
            assert_eq!(open.axis as usize, place);
        }
        let axes = [Axis::Networks, Axis::Length, Axis::Library];
        assert_eq!(choices(&axes), 48);
        for number in 0..choices(&axes) {
            assert_eq!(Choice::numbered(number, &axes).number(&axes), number);
        }
        assert_eq!(count(Axis::Networks), POOLS.len());
    }
}
