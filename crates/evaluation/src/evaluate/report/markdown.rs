//! What a run found as Markdown, for pages that repeat it.

use super::numbers::{printed, value as value_of};
use super::opening::VERDICTS;
use crate::evaluate::record::{Claim, Reading, Run, Sentence, Table, Verdict};

/// Lines of prose are no longer than this.
const WIDTH: usize = 100;

/// Writes the notes of a run, its claims and its sentences.
pub fn markdown(run: &Run) -> String {
    let provenance = &run.provenance;
    let networks: usize = provenance.networks.iter().map(|cell| cell.networks).sum();
    let failures: usize = provenance.networks.iter().map(|cell| cell.failures).sum();
    let day = provenance.started.split('T').next().unwrap_or_default();
    let mut page = "# What the evaluation found\n\n".to_owned();
    page += &wrapped(&format!(
        "{networks} networks, {failures} failures, {day}, commit `{}`, {}.",
        provenance.commit, provenance.machine
    ));
    for note in &run.notes {
        page += &format!("\n## {}\n\n{}", note.title, wrapped(&note.text));
        // What takes a row for each of many cells is in the report.
        if let Some(rows) = note
            .table
            .as_ref()
            .filter(|rows| rows.rows.len() <= MOST_ROWS)
        {
            page += &table(rows);
        }
    }
    for (title, rows) in [
        ("The paper's numbers", claims(&run.claims)),
        (
            "The paper's sentences, by networks that show a difference",
            sentences(&run.sentences),
        ),
    ] {
        if !rows.rows.is_empty() {
            page += &format!("\n## {title}\n{}", table(&rows));
        }
    }
    page
}

fn words(holds: Verdict) -> String {
    let found = VERDICTS.iter().find(|(verdict, ..)| *verdict == holds);
    found.map_or_else(String::new, |(.., words)| (*words).to_owned())
}

fn claims(claims: &[Claim]) -> Table {
    let row = |claim: &Claim| {
        let told = |reading: &Option<Reading>| {
            let value = reading.as_ref().map(|reading| reading.value);
            value.map_or_else(|| "–".to_owned(), |found| value_of(found, claim.unit))
        };
        vec![
            claim.text.clone(),
            printed(claim.paper, claim.unit),
            told(&claim.joint),
            told(&claim.closest),
            format!("{} of {}", claim.met, claim.readings),
            words(claim.holds),
        ]
    };
    let header = [
        "the paper",
        "",
        "ours, jointly",
        "closest alone",
        "met under",
        "verdict",
    ];
    Table {
        header: header.map(str::to_owned).to_vec(),
        rows: claims.iter().map(row).collect(),
    }
}

fn sentences(sentences: &[Sentence]) -> Table {
    let row = |sentence: &Sentence| {
        let counts = sentence.counts.iter();
        let counts = counts.map(|count| {
            let different = count.holds + count.fails;
            format!("{} {} of {different}", count.networks, count.holds)
        });
        let counts: Vec<String> = counts.collect();
        vec![
            sentence.text.clone(),
            counts.join(", "),
            words(sentence.holds),
        ]
    };
    Table {
        header: ["the paper", "holds on", "verdict"]
            .map(str::to_owned)
            .to_vec(),
        rows: sentences.iter().map(row).collect(),
    }
}

/// Longer tables are left to the report.
const MOST_ROWS: usize = 25;

fn table(rows: &Table) -> String {
    let cell = |text: &String| text.replace('|', "\\|").replace('<', "&lt;");
    let line = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(cell).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let below = vec!["---".to_owned(); rows.header.len()];
    let lines = [&rows.header, &below].into_iter().chain(&rows.rows);
    format!("\n{}", lines.map(|cells| line(cells)).collect::<String>())
}

/// A paragraph in lines.
fn wrapped(text: &str) -> String {
    let text = text.replace('<', "&lt;");
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.len() - 1;
        if !lines[last].is_empty() && lines[last].chars().count() + 1 + word.chars().count() > WIDTH
        {
            lines.push(word.to_owned());
        } else {
            if !lines[last].is_empty() {
                lines[last].push(' ');
            }
            lines[last].push_str(word);
        }
    }
    lines.join("\n") + "\n"
}
