//! A made-up run that has everything a page can show, with names that would break one that does not escape.

use crate::evaluate::record::{
    Axis, Better, Cause, Claim, Conventions, Count, Figure, NetworkFacts, Note, PaperMark, Point,
    Provenance, Reading, Reference, Run, Scale, Sentence, Series, Table, Unit, Verdict,
};

/// A name as no author should give one.
pub(super) const HOSTILE: &str = "<script>alert('x')</script> & \"co\"\u{1}";

const SIZES: [f64; 6] = [100.0, 250.0, 500.0, 1_000.0, 2_500.0, 5_000.0];
const METHODS: [&str; 8] = [
    "exact, warm",
    "exact, cold",
    "two-phased",
    "two-phased, polygons",
    "cell density",
    "A*",
    "Dijkstra, full tree",
    "Bellman-Ford",
];

pub(super) fn run() -> Run {
    Run {
        provenance: provenance(),
        figures: vec![
            over_size("time-by-size", Some("Fig. 9"), &Scale::Log),
            over_size("distance-by-size", Some("Fig. 10"), &Scale::Linear),
            skipping(),
            by_method(),
            by_network(),
        ],
        claims: claims(),
        conventions: Some(Conventions {
            choices: vec![("networks".to_owned(), HOSTILE.to_owned())],
            sets: 1_000,
            met: 1,
            measured: 3,
        }),
        sentences: vec![Sentence {
            id: "skipping-pays".to_owned(),
            text: HOSTILE.to_owned(),
            test: "it takes less time".to_owned(),
            holds: Verdict::Contradicted,
            counts: vec![Count {
                networks: "random".to_owned(),
                holds: 3,
                fails: 9,
                of: 20,
            }],
        }],
        notes: notes(),
    }
}

fn axis(label: &str, scale: Scale) -> Axis {
    Axis {
        label: label.to_owned(),
        scale,
    }
}

fn point(x: f64, y: f64, spread: f64) -> Point {
    Point {
        x,
        y,
        low: y * (1.0 - spread),
        high: y * (1.0 + spread),
        spread: [y * (1.0 - 2.0 * spread), y * (1.0 + 2.0 * spread)],
        cases: 994,
    }
}

fn said(series: &str, x: Option<f64>, y: f64) -> PaperMark {
    PaperMark {
        series: series.to_owned(),
        x,
        y,
    }
}

fn over_size(slug: &str, paper: Option<&str>, scale: &Scale) -> Figure {
    let is_log = *scale == Scale::Log;
    let value = |method: usize, size: f64| match (is_log, method) {
        (true, 0) => 0.08 / size.powf(0.4),
        (true, method) => 0.05 * method as f64 * (size / 100.0).powf(0.12 * (method as f64 - 3.0)),
        (false, 2..=4) => 3.0 * method as f64 + 40.0 / size,
        (false, _) => 0.0,
    };
    let series = METHODS.iter().enumerate().map(|(method, name)| Series {
        name: (*name).to_owned(),
        points: SIZES
            .iter()
            .map(|&size| point(size, value(method, size), 0.07))
            .collect(),
    });
    Figure {
        slug: slug.to_owned(),
        paper: paper.map(str::to_owned),
        title: "Time over network size".to_owned(),
        caption: "Median of the failures' time over that of Dijkstra, full tree, whole route. 5964 failures with a \
                  detour, of 6000 drawn, on 6 networks."
            .to_owned(),
        x: axis("nodes", Scale::Log),
        y: axis("time / time of Dijkstra to the destination", scale.clone()),
        series: series.collect(),
        reference: Some(Reference {
            y: if is_log { 1.0 } else { 0.0 },
            label: "baseline (Dijkstra, whole route)".to_owned(),
        }),
        marks: vec![said("two-phased", None, 7.0)],
    }
}

fn skipping() -> Figure {
    let names = ["nodes, last area", "segments, last area", "searches"];
    let points = [
        point(0.0, 2.13, 0.1),
        point(1.0, 2.6, 0.2),
        point(2.0, 0.8, 0.02),
    ];
    Figure {
        slug: "skipping-ineffective".to_owned(),
        paper: Some("Fig. 15".to_owned()),
        title: "Ineffective skipping of stages".to_owned(),
        caption: "With skipping over without.".to_owned(),
        x: axis(
            "what is counted",
            Scale::Categories(names.map(str::to_owned).to_vec()),
        ),
        y: axis("with skipping / without", Scale::Linear),
        series: vec![
            Series {
                name: "exact, warm".to_owned(),
                points: vec![point(1.0, 0.2, 0.1)],
            },
            Series {
                name: "two-phased".to_owned(),
                points: points.to_vec(),
            },
        ],
        reference: Some(Reference {
            y: 1.0,
            label: "without skipping".to_owned(),
        }),
        marks: vec![said("two-phased", Some(0.0), 2.13)],
    }
}

/// Each series stands in the one row that bears its name.
fn by_method() -> Figure {
    let mut names: Vec<String> = METHODS.map(str::to_owned).to_vec();
    names.push(HOSTILE.to_owned());
    let series = names.iter().enumerate().map(|(place, name)| Series {
        name: name.clone(),
        points: vec![point(place as f64, 0.004 * 3f64.powi(place as i32), 0.3)],
    });
    Figure {
        slug: "sydney-time".to_owned(),
        paper: Some("Fig. 17".to_owned()),
        title: "Sydney CBD: time".to_owned(),
        caption: format!("Captions are escaped too: {HOSTILE}"),
        series: series.collect(),
        x: axis("method", Scale::Categories(names)),
        y: axis("time / time of Dijkstra to the destination", Scale::Log),
        reference: Some(Reference {
            y: 1.0,
            label: "baseline".to_owned(),
        }),
        marks: vec![said(HOSTILE, Some(3.0), 0.5)],
    }
}

fn by_network() -> Figure {
    let names: Vec<String> = SIZES
        .iter()
        .map(|size| format!("n{size}-k10-map10000-reach0.30"))
        .collect();
    let series = METHODS.iter().enumerate().map(|(method, name)| Series {
        name: (*name).to_owned(),
        points: SIZES
            .iter()
            .enumerate()
            .map(|(place, size)| point(place as f64, 0.3 + size * method as f64 / 40.0, 0.1))
            .collect(),
    });
    Figure {
        slug: "median-times".to_owned(),
        paper: None,
        title: "Time to a whole new route, network by network, and a title that is long enough to need two lines of it"
            .to_owned(),
        caption: "Median times.".to_owned(),
        x: axis("network", Scale::Categories(names)),
        y: axis("median time (µs)", Scale::Log),
        series: series.collect(),
        reference: None,
        marks: Vec::new(),
    }
}

fn reading(name: &str, value: f64) -> Reading {
    Reading {
        name: name.to_owned(),
        value,
        low: value - 1.25,
        high: value + 1.5,
        cases: 12_345,
    }
}

fn cause() -> Cause {
    Cause {
        kind: "generator".to_owned(),
        change: HOSTILE.to_owned(),
        value: 61.234,
        is_met: false,
    }
}

fn claims() -> Vec<Claim> {
    let claim = |id: &str, section: &str, text: &str, paper, unit, holds| Claim {
        id: id.to_owned(),
        section: section.to_owned(),
        text: text.to_owned(),
        paper,
        unit,
        better: Better::Higher,
        readings: 36,
        met: 2,
        range: Some([-3.5, 61.234]),
        joint: Some(reading("early exit, A → B, median of ratios", -3.5)),
        closest: Some(reading(
            "full tree, A → destination, ratio of means",
            61.234,
        )),
        holds,
        verdict: "The closest reading has 61.2 %, the farthest -3.50 %.".to_owned(),
        exact: Some(reading("exact, warm, against the same", 99.4)),
        cause: Some(cause()),
    };
    vec![
        claim(
            "radius-time",
            "Radius-based",
            "radius-based is 9 % faster than the baseline",
            9.0,
            Unit::Percent,
            Verdict::DirectionOnly,
        ),
        Claim {
            better: Better::Lower,
            ..claim(
                "radius-distance",
                "Radius-based",
                "radius-based flies 14 % more",
                14.0,
                Unit::Percent,
                Verdict::NotReproduced,
            )
        },
        claim(
            "bellman-ford-time",
            "Two-phased",
            "Bellman-Ford takes nearly five times the baseline's time",
            5.0,
            Unit::Times,
            Verdict::Reproduced,
        ),
        Claim {
            readings: 0,
            range: None,
            joint: None,
            closest: None,
            exact: None,
            cause: None,
            verdict: HOSTILE.to_owned(),
            ..claim(
                "sydney-time",
                "Sydney CBD",
                "cell density-based takes 56 % less time",
                56.0,
                Unit::Percent,
                Verdict::NotMeasured,
            )
        },
    ]
}

fn notes() -> Vec<Note> {
    let rows = (0..15).map(|row| vec![HOSTILE.to_owned(), format!("{row}.5 µs"), "A*".to_owned()]);
    vec![
        Note {
            title: "Where a heuristic wins".to_owned(),
            text: "In 15 of 96 comparisons a strategy has a lower median time than exact. More is below.".to_owned(),
            table: Some(Table {
                header: ["network", "its median", "inside"].map(str::to_owned).to_vec(),
                rows: rows.collect(),
            }),
        },
        Note {
            title: "Failures without a detour".to_owned(),
            text: "36 of 6000.".to_owned(),
            table: None,
        },
    ]
}

fn provenance() -> Provenance {
    let network = |name: &str, nodes| NetworkFacts {
        name: name.to_owned(),
        networks: 10,
        nodes,
        segments: nodes * 5,
        component_nodes: nodes - 1,
        failures: 1_000,
        without_detour: 6,
        distances_checked: 9_940,
    };
    Provenance {
        version: "0.1.0".to_owned(),
        commit: "0123456789ab".to_owned(),
        compiler: "rustc 1.95.0".to_owned(),
        profile: "release".to_owned(),
        checks_assertions: true,
        machine: "a processor, 2 cores".to_owned(),
        started: "2026-11-21T17:00:00Z".to_owned(),
        seed: 1,
        quick: true,
        command: format!("skyway evaluate --network '{HOSTILE}'"),
        parameters: vec![("failures".to_owned(), "1000".to_owned())],
        networks: vec![
            network("n1000-k10-map10000-reach0.30", 1_000),
            network("n5000-k10-map10000-reach0.30", 5_000),
        ],
    }
}
