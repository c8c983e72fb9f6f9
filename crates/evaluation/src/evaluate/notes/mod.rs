//! What is told beside plots and claims: what matters most first, and why claims are missed.

mod agreement;
mod speed;

use super::cells::{Cells, by_network};
use super::claims::Judged;
use super::failures::Placing;
use super::method::Method;
use super::record::{Claim, Note, Sentence, Table, Verdict};
use super::skipped::cases;
use super::text::{counted, number};

pub use agreement::agreement;

/// All notes of a run. The seed is that of the intervals.
pub fn notes(cells: &Cells, judged: &Judged, seed: u64) -> Vec<Note> {
    let mut notes = vec![speed::headline(cells)];
    if !judged.claims.is_empty() {
        notes.extend([
            claims(judged),
            causes(&judged.claims),
            sentences(&judged.sentences),
        ]);
    }
    notes.extend([
        optimality(cells),
        speed::exact(cells, seed),
        speed::tables_that_pay(cells),
    ]);
    notes.extend(agreement(cells, seed));
    notes.extend([without_detour(cells), skipping(cells)]);
    notes
}

fn table(header: &[&str], rows: Vec<Vec<String>>) -> Option<Table> {
    (!rows.is_empty()).then(|| Table {
        header: header.iter().map(|&title| title.to_owned()).collect(),
        rows,
    })
}

fn claims(judged: &Judged) -> Note {
    let of = |verdict: Verdict| {
        judged
            .claims
            .iter()
            .filter(|claim| claim.holds == verdict)
            .count()
    };
    let (sets, met, measured) = judged
        .conventions
        .as_ref()
        .map_or((0, 0, 0), |joint| (joint.sets, joint.met, joint.measured));
    let choices = judged.conventions.iter().flat_map(|joint| &joint.choices);
    Note {
        title: "One set of conventions for the whole paper".to_owned(),
        text: format!(
            "The best of {sets} sets of conventions meets {met} of the paper's {measured} numbers. Under it {} are reproduced and {} contradicted; {} are met in isolation only, {} point the same way, {} do neither, and {} were not measured.",
            of(Verdict::Reproduced),
            of(Verdict::Contradicted),
            of(Verdict::InIsolation),
            of(Verdict::DirectionOnly),
            of(Verdict::NotReproduced),
            of(Verdict::NotMeasured),
        ),
        table: table(
            &["left open", "taken for it"],
            choices
                .map(|(title, choice)| vec![title.clone(), choice.clone()])
                .collect(),
        ),
    }
}

fn causes(claims: &[Claim]) -> Note {
    let missed = claims
        .iter()
        .filter_map(|claim| Some((claim, claim.cause.as_ref()?)));
    let mut kinds: Vec<(&str, usize)> = Vec::new();
    for (_, cause) in missed.clone() {
        match kinds.iter_mut().find(|(kind, _)| *kind == cause.kind) {
            Some((_, count)) => *count += 1,
            None => kinds.push((&cause.kind, 1)),
        }
    }
    kinds.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
    let told: Vec<String> = kinds
        .iter()
        .map(|(kind, count)| format!("{kind} {count}"))
        .collect();
    let rows = missed.map(|(claim, cause)| {
        let joint = claim.joint.as_ref();
        vec![
            claim.id.clone(),
            number(claim.paper),
            joint.map_or_else(|| "-".to_owned(), |joint| number(joint.value)),
            cause.kind.clone(),
            cause.change.clone(),
            number(cause.value),
            (if cause.is_met { "met" } else { "closer" }).to_owned(),
        ]
    });
    Note {
        title: "Why claims are missed".to_owned(),
        text: format!(
            "What decides the claims that are missed: {}. For each it is the one change of the joint conventions that comes closest to the paper, or another number of the paper for the same thing.",
            match told.is_empty() {
                true => "nothing was measured".to_owned(),
                false => told.join(", "),
            }
        ),
        table: table(
            &[
                "claim", "paper", "jointly", "cause", "with", "value", "then",
            ],
            rows.collect(),
        ),
    }
}

fn sentences(sentences: &[Sentence]) -> Note {
    let of = |verdict: Verdict| {
        sentences
            .iter()
            .filter(|sentence| sentence.holds == verdict)
            .count()
    };
    Note {
        title: "The paper's sentences".to_owned(),
        text: format!(
            "Of {} sentences without a number {} hold on most networks, {} on some, {} are contradicted on most, and {} were not measured.",
            sentences.len(),
            of(Verdict::Reproduced),
            of(Verdict::Depends),
            of(Verdict::Contradicted),
            of(Verdict::NotMeasured),
        ),
        table: None,
    }
}

fn optimality(cells: &Cells) -> Note {
    let all: Vec<_> = cells.0.iter().collect();
    let lengths = by_network(&all, [true, false].map(Method::exact), |failure, rows| {
        Some(rows.map(|row| row.remaining_m > failure.optimum_m))
    });
    let longer: Vec<bool> = lengths.concat().concat();
    let checked: usize = all
        .iter()
        .map(|cell| cell.figures.facts.distances_checked)
        .sum();
    Note {
        title: "Exact is exact".to_owned(),
        text: format!(
            "Of {} answers of exact, with and without its table, {} are longer than the shortest route. {checked} distances of exact, Dijkstra, A* and both kinds of Bellman-Ford were compared with those of petgraph's Dijkstra, on a graph read from the network's text independently of the engine, and all are equal; a run in which one is not stops with an error.",
            longer.len(),
            longer.iter().filter(|&&is_longer| is_longer).count(),
        ),
        table: None,
    }
}

fn without_detour(cells: &Cells) -> Note {
    let facts = || cells.0.iter().map(|cell| &cell.figures.facts);
    let rows = facts()
        .filter(|facts| facts.without_detour > 0)
        .map(|facts| {
            vec![
                facts.name.clone(),
                facts.failures.to_string(),
                facts.without_detour.to_string(),
            ]
        });
    let drawn: usize = facts().map(|facts| facts.failures).sum();
    let lost: usize = facts().map(|facts| facts.without_detour).sum();
    Note {
        title: "Failures without a detour".to_owned(),
        text: format!(
            "Of {} drawn, {lost} leave no way to the destination. They are counted here, take no part in any other figure, and no others are drawn in their place.",
            counted(drawn, "failure", "failures")
        ),
        table: table(
            &["networks", "failures drawn", "without a detour"],
            rows.collect(),
        ),
    }
}

fn skipping(cells: &Cells) -> Note {
    let mut rows = Vec::new();
    let (mut all, mut all_effective, mut with_us, mut without_us) = (0, 0, 0.0, 0.0);
    for cell in &cells.0 {
        let cases = cases(&[cell], Placing::Path, 0).concat();
        if cases.is_empty() {
            continue;
        }
        let effective = cases.iter().filter(|case| case.is_effective).count();
        all += cases.len();
        all_effective += effective;
        with_us += cases
            .iter()
            .map(|case| case.with_skipping.time_us)
            .sum::<f64>();
        without_us += cases.iter().map(|case| case.without.time_us).sum::<f64>();
        rows.push(vec![
            cell.plan.name.clone(),
            cases.len().to_string(),
            effective.to_string(),
            (cases.len() - effective).to_string(),
        ]);
    }
    let times = match all {
        0 => String::new(),
        _ => format!(
            " Together they took {} % of the time of searching every stage.",
            number(1e2 * with_us / without_us)
        ),
    };
    Note {
        title: "Skipped stages".to_owned(),
        text: format!(
            "A stage was skipped in {}; in {all_effective} of them no skipped stage holds a path.{times}",
            counted(all, "failure", "failures"),
        ),
        table: table(
            &[
                "networks",
                "with a skipped stage",
                "effective",
                "ineffective",
            ],
            rows,
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_nothing_is_skipped_no_share_is_told() {
        let note = skipping(&Cells::default());
        assert!(note.text.contains("in 0 failures"), "{}", note.text);
        assert!(!note.text.contains("NaN"), "{}", note.text);
    }
}
