//! The one set of conventions that meets most numbers of the paper, and what each number comes to under it.

use super::super::cells::Cells;
use super::super::record::{
    Axis as PlotAxis, Cause, Claim, Conventions, Figure, Point, Reading, Scale, Sentence, Series,
    Unit, Verdict,
};
use super::super::statistics::Resampler;
use super::super::text::{counted, number};
use super::Survey;
use super::conventions::{Axis, Choice, OPEN, choices, count};
use super::readings::reading;
use super::sentences::sentences;

/// A value this near to the paper's, as a share of it, meets it.
const NEAR: f64 = 0.1;

/// What is judged of the paper's text.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// Its numbers.
    pub claims: Vec<Claim>,
    /// The joint conventions; none where nothing was measured.
    pub conventions: Option<Conventions>,
    /// Its sentences.
    pub sentences: Vec<Sentence>,
    /// Every claim in one plot.
    pub overview: Option<Figure>,
}

/// Judges all claims of a run together. The seed is that of the intervals.
pub fn judge(surveys: &[Survey], cells: &Cells, seed: u64) -> Judged {
    let axes = OPEN.each_ref().map(|open| open.axis);
    let joint = most_met(surveys, &axes);
    let claims: Vec<Claim> = surveys
        .iter()
        .map(|survey| claim(survey, surveys, joint, cells, seed))
        .collect();
    let is_measured = |survey: &&Survey| survey.ratios.iter().any(Option::is_some);
    let measured = surveys.iter().filter(is_measured).count();
    let conventions = (measured > 0).then(|| Conventions {
        choices: OPEN
            .iter()
            .map(|open| (open.title.to_owned(), joint.words(open.axis).to_owned()))
            .collect(),
        sets: choices(&axes),
        met: surveys
            .iter()
            .filter(|survey| is_met(survey, joint))
            .count(),
        measured,
    });
    Judged {
        overview: overview(surveys, &claims, joint),
        claims,
        conventions,
        sentences: match surveys.is_empty() {
            true => Vec::new(),
            false => sentences(cells),
        },
    }
}

fn is_met(survey: &Survey, choice: Choice) -> bool {
    let value = survey.value(choice);
    value.is_some_and(|value| survey.distance(value) <= NEAR)
}

/// The choice that meets most claims; of several the one that is nearest to all.
fn most_met(surveys: &[Survey], axes: &[Axis]) -> Choice {
    // Each survey once as distances by its own numbers, so that a choice is a lookup.
    let distances: Vec<Vec<f64>> = surveys
        .iter()
        .map(|survey| {
            let numbers = 0..survey.ratios.len();
            numbers
                .map(|number| {
                    let value = survey.value(Choice::numbered(number, &survey.axes));
                    value.map_or(1.0, |value| survey.distance(value).min(1.0))
                })
                .collect()
        })
        .collect();
    let score = |choice: Choice| {
        let mut score = (0, 0.0);
        for (survey, distances) in surveys.iter().zip(&distances) {
            let distance = distances[choice.number(&survey.axes)];
            score.0 += usize::from(distance <= NEAR);
            score.1 -= distance;
        }
        score
    };
    let better = |one: (usize, f64), other: (usize, f64)| {
        one.0.cmp(&other.0).then(one.1.total_cmp(&other.1))
    };
    let mut best = (Choice::default(), score(Choice::default()));
    for number in 0..choices(axes) {
        let choice = Choice::numbered(number, axes);
        let found = score(choice);
        if better(found, best.1).is_gt() {
            best = (choice, found);
        }
    }
    best.0
}

fn claim(survey: &Survey, all: &[Survey], joint: Choice, cells: &Cells, seed: u64) -> Claim {
    let plan = &survey.plan;
    let quantity = plan.quantity;
    let told = |choice: Choice, is_exact: bool| -> Option<Reading> {
        // What the claim does not depend on is not to leak in.
        let choice = Choice::numbered(choice.number(&survey.axes), &survey.axes);
        let name = choice.name(&survey.axes);
        let mut resampler = Resampler::new(seed, &format!("{}: {name} {is_exact}", plan.id));
        let sample = quantity.sample(cells, plan.on_sydney, choice, is_exact)?;
        let estimate = sample.estimate(&mut resampler)?;
        Some(reading(
            name,
            estimate.map(|ratio| quantity.value(ratio, choice)),
        ))
    };
    let values: Vec<(Choice, f64)> = (0..survey.ratios.len())
        .map(|number| Choice::numbered(number, &survey.axes))
        .filter_map(|choice| Some((choice, survey.value(choice)?)))
        .collect();
    let met = values
        .iter()
        .filter(|(_, value)| survey.distance(*value) <= NEAR)
        .count();
    let nearest = values
        .iter()
        .min_by(|one, other| survey.distance(one.1).total_cmp(&survey.distance(other.1)));
    let (least, most) = values.iter().fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(least, most), &(_, value)| (least.min(value), most.max(value)),
    );
    let joint_reading = told(joint, false);
    let has_exact = quantity.approach().is_some();
    let mut claim = Claim {
        id: plan.id.to_owned(),
        section: plan.section.to_owned(),
        text: plan.text.to_owned(),
        paper: plan.paper,
        unit: quantity.unit(),
        better: quantity.better(),
        readings: values.len(),
        met,
        range: nearest.map(|_| [least, most]),
        closest: nearest.and_then(|&(choice, _)| told(choice, false)),
        exact: has_exact.then(|| told(joint, true)).flatten(),
        holds: holds(survey, joint, joint_reading.as_ref(), met, values.len()),
        joint: joint_reading,
        verdict: String::new(),
        cause: None,
    };
    let is_missed = !matches!(claim.holds, Verdict::Reproduced | Verdict::NotMeasured);
    claim.cause = is_missed.then(|| cause(survey, all, joint)).flatten();
    claim.verdict = verdict(&claim);
    claim
}

fn holds(
    survey: &Survey,
    joint: Choice,
    found: Option<&Reading>,
    met: usize,
    readings: usize,
) -> Verdict {
    if readings == 0 {
        return Verdict::NotMeasured;
    }
    if is_met(survey, joint) && met > 1 {
        return Verdict::Reproduced;
    }
    let plan = &survey.plan;
    // On the paper's side by how much: below 0 is the other side.
    let side = |neutral: f64, value: f64| (value - neutral) * (plan.paper - neutral).signum();
    let is_opposite = found
        .zip(plan.quantity.neutral())
        .is_some_and(|(found, neutral)| {
            side(neutral, found.low) < 0.0 && side(neutral, found.high) < 0.0
        });
    let has_same_side = found
        .zip(plan.quantity.neutral())
        .is_some_and(|(found, neutral)| side(neutral, found.value) > 0.0);
    match (is_opposite, met, has_same_side) {
        (true, ..) => Verdict::Contradicted,
        (false, 1.., _) => Verdict::InIsolation,
        (false, 0, true) => Verdict::DirectionOnly,
        (false, 0, false) => Verdict::NotReproduced,
    }
}

/// Of all single changes of the joint conventions the one that comes closest; a second number of the paper for
/// the same thing that is closer to ours comes first.
fn cause(survey: &Survey, all: &[Survey], joint: Choice) -> Option<Cause> {
    let plan = &survey.plan;
    let own = survey.value(joint);
    let against = all.iter().find(|other| {
        let (quantity, other) = (plan.quantity, &other.plan);
        other.quantity == quantity && other.on_sydney == plan.on_sydney && other.id != plan.id
    });
    if let (Some(other), Some(value)) = (against, own) {
        let other = &other.plan;
        if (value - other.paper).abs() < (value - plan.paper).abs() {
            return Some(Cause {
                kind: "the paper against itself".to_owned(),
                change: format!("the paper also says that {}", other.text),
                value,
                is_met: false,
            });
        }
    }
    let changes = survey.axes.iter().flat_map(|&axis| {
        (0..count(axis)).filter_map(move |option| {
            let choice = joint.with(axis, option);
            let value = survey.value(choice)?;
            (choice != joint).then_some((axis, choice, value))
        })
    });
    let best =
        changes.min_by(|one, other| survey.distance(one.2).total_cmp(&survey.distance(other.2)));
    let (axis, choice, value) = best?;
    if own.is_some_and(|own| survey.distance(own) <= survey.distance(value)) {
        return None;
    }
    let open = &OPEN[axis as usize];
    Some(Cause {
        kind: open.cause.to_owned(),
        change: format!("{}: {}", open.title, choice.words(axis)),
        value,
        is_met: survey.distance(value) <= NEAR,
    })
}

fn verdict(claim: &Claim) -> String {
    let value = |value: f64| match claim.unit {
        Unit::Percent => format!("{} %", number(value)),
        Unit::Times => format!("{} times", number(value)),
        Unit::Count => number(value),
    };
    let Some([least, most]) = claim.range else {
        return "Not measured: this run has no failure that the claim is about.".to_owned();
    };
    let readings = counted(claim.readings, "reading", "readings");
    let joint = claim.joint.as_ref().map_or_else(
        || "The joint conventions give it no value".to_owned(),
        |joint| {
            let [found, low, high] = [joint.value, joint.low, joint.high].map(value);
            format!("Under the joint conventions {found} ({low} to {high})")
        },
    );
    let cause = match &claim.cause {
        None => String::new(),
        Some(cause) => {
            let met = if cause.is_met { ", which meets it" } else { "" };
            format!(
                " Cause: {}; {} gives {}{met}.",
                cause.kind,
                cause.change,
                value(cause.value)
            )
        }
    };
    let closest = claim.closest.as_ref().map_or_else(String::new, |closest| {
        format!(" The closest, {}: {}.", value(closest.value), closest.name)
    });
    format!(
        "{joint}. Of {readings} of its own {} come within a tenth; all lie between {} and {}.{closest}{cause}",
        claim.met,
        value(least),
        value(most),
    )
}

/// Every claim as a ratio: the paper's, ours under the joint conventions, our best, and the range of all.
fn overview(surveys: &[Survey], claims: &[Claim], joint: Choice) -> Option<Figure> {
    let mut series = [
        "the paper",
        "joint conventions",
        "closest reading, over the range of all",
    ]
    .map(|name| Series {
        name: name.to_owned(),
        points: Vec::new(),
    });
    for (place, survey) in surveys.iter().enumerate() {
        let all = || {
            survey
                .ratios
                .iter()
                .flatten()
                .copied()
                .filter(|ratio| *ratio > 0.0)
        };
        let paper = survey.plan.quantity.ratio(survey.plan.paper);
        let joint = survey.ratios[joint.number(&survey.axes)];
        let by_distance = |one: &f64, other: &f64| {
            let distance = |ratio: f64| (ratio / paper).ln().abs();
            distance(*one).total_cmp(&distance(*other))
        };
        let spread = [
            all().fold(f64::INFINITY, f64::min),
            all().fold(0.0, f64::max),
        ];
        let ratios = [
            Some(paper),
            joint.filter(|ratio| *ratio > 0.0),
            all().min_by(by_distance),
        ];
        for (number, (series, ratio)) in series.iter_mut().zip(ratios).enumerate() {
            series.points.extend(ratio.map(|ratio| Point {
                x: place as f64,
                y: ratio,
                low: ratio,
                high: ratio,
                spread: if number == 2 { spread } else { [ratio; 2] },
                cases: if number == 0 { 1 } else { survey.ratios.len() },
            }));
        }
    }
    series[2].points.first()?;
    Some(Figure {
        slug: "overview".to_owned(),
        paper: None,
        title: "Every number of the paper, and ours".to_owned(),
        caption: "Each number as a ratio: of time to the baseline's, of length to the shortest, of the searched to the \
                  whole; 9 % faster is 0.91. The thin line reaches over all readings of the sentence."
            .to_owned(),
        x: PlotAxis {
            label: "claim".to_owned(),
            scale: Scale::Categories(claims.iter().map(|claim| claim.id.clone()).collect()),
        },
        y: PlotAxis {
            label: "ratio".to_owned(),
            scale: Scale::Log,
        },
        series: series.to_vec(),
        reference: None,
        marks: Vec::new(),
    })
}
