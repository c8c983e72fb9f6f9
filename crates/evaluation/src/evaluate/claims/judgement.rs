//! Whether a claim holds, decided by its readings alone.

use super::super::record::{Reading, Unit, Verdict};
use super::super::text::{counted, number};

/// A value this near to the paper's, as a share of it, counts as reproduced.
const NEAR: f64 = 0.1;
/// The interval of fewer cases is so wide that it covers almost anything: it does not count.
const FEWEST_CASES: usize = 30;

/// What the readings of a claim come to.
pub(super) struct Judgement {
    pub(super) closest: Option<usize>,
    pub(super) holds: Verdict,
    pub(super) verdict: String,
}

/// Judges a number of the paper; `neutral` is the value at which nothing would differ.
pub(super) fn judge(paper: f64, unit: Unit, neutral: f64, readings: &[Reading]) -> Judgement {
    let distance = |reading: &Reading| (reading.value - paper).abs();
    let closest = (0..readings.len())
        .min_by(|&one, &other| distance(&readings[one]).total_cmp(&distance(&readings[other])));
    let Some(nearest) = closest.map(|place| &readings[place]) else {
        return Judgement {
            closest: None,
            holds: Verdict::NotMeasured,
            verdict: "Not measured: this run has no failure that the claim is about.".to_owned(),
        };
    };
    let covers = |reading: &Reading| {
        reading.cases >= FEWEST_CASES && (reading.low..=reading.high).contains(&paper)
    };
    let is_near = |reading: &&Reading| distance(reading) <= NEAR * paper.abs() || covers(reading);
    let same_side = |reading: &&Reading| (reading.value - neutral) * (paper - neutral) > 0.0;
    let near = readings.iter().filter(is_near).count();
    let same_direction = readings.iter().filter(same_side).count();
    let holds = match (near, same_direction) {
        (1.., _) => Verdict::Reproduced,
        (0, 1..) => Verdict::DirectionOnly,
        (0, 0) => Verdict::NotReproduced,
    };
    let all = counted(readings.len(), "reading", "readings");
    let value = |value: f64| told(value, unit);
    let found = match holds {
        Verdict::Reproduced => format!(
            "Reproduced under {near} of {all}, that is within a tenth of the paper's {} or with an interval over at least {FEWEST_CASES} cases that covers it",
            value(paper)
        ),
        Verdict::DirectionOnly => format!(
            "Not reproduced under any of {all}; {same_direction} of them point in the same direction as the paper's {}",
            value(paper)
        ),
        _ => format!(
            "Not reproduced: none of {all} points in the direction of the paper's {}",
            value(paper)
        ),
    };
    let (least, most) = readings.iter().fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(least, most), reading| (least.min(reading.value), most.max(reading.value)),
    );
    let verdict = format!(
        "{found}. The closest gives {} ({} to {}): {}. All readings lie between {} and {}.",
        value(nearest.value),
        value(nearest.low),
        value(nearest.high),
        nearest.name,
        value(least),
        value(most),
    );
    Judgement {
        closest,
        holds,
        verdict,
    }
}

/// A value with its unit.
fn told(value: f64, unit: Unit) -> String {
    let value = number(value);
    match unit {
        Unit::Percent => format!("{value} %"),
        Unit::Times => format!("{value} times"),
        Unit::Count => value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(value: f64, low: f64, high: f64) -> Reading {
        Reading {
            name: format!("reading of {value}"),
            value,
            low,
            high,
            cases: FEWEST_CASES,
        }
    }

    #[test]
    fn a_claim_holds_when_a_reading_is_near_or_its_interval_covers_it() {
        let judge = |readings: &[Reading]| judge(60.0, Unit::Percent, 0.0, readings);
        assert_eq!(judge(&[]).holds, Verdict::NotMeasured);
        let near = judge(&[reading(-5.0, -6.0, -4.0), reading(55.0, 54.0, 56.0)]);
        assert_eq!((near.holds, near.closest), (Verdict::Reproduced, Some(1)));
        let covered = judge(&[reading(40.0, 10.0, 61.0)]);
        assert_eq!(covered.holds, Verdict::Reproduced);
        let of_few = Reading {
            cases: FEWEST_CASES - 1,
            ..reading(40.0, 10.0, 61.0)
        };
        assert_eq!(judge(&[of_few]).holds, Verdict::DirectionOnly);
        let directed = judge(&[reading(40.0, 39.0, 41.0), reading(-1.0, -2.0, 0.5)]);
        assert_eq!(directed.holds, Verdict::DirectionOnly);
        let opposed = judge(&[reading(-40.0, -50.0, -30.0)]);
        assert_eq!(opposed.holds, Verdict::NotReproduced);
        assert!(opposed.verdict.contains("-40.0 %"), "{}", opposed.verdict);
    }
}
