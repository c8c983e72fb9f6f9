//! As much of Markdown as the rule about links needs: links, anchors of headings, code to leave out.

use std::collections::BTreeSet;

/// The relative links of a document, outside code, with their lines.
pub(crate) fn links(text: &str) -> Vec<(usize, String)> {
    let mut links = Vec::new();
    for (number, line) in prose(text) {
        let outside_code: String = line.split('`').step_by(2).collect::<Vec<_>>().join("``");
        let mut targets: Vec<&str> = outside_code.split("](").skip(1).collect();
        if line.starts_with('[') {
            targets.extend(line.split_once("]: ").map(|(_, target)| target));
        }
        for target in targets {
            let target = target.split([')', ' ']).next().unwrap_or_default();
            if !target.contains("://") && !target.starts_with("mailto:") {
                links.push((number, target.to_owned()));
            }
        }
    }
    links
}

/// The anchors that a forge makes of the headings.
pub(crate) fn anchors(text: &str) -> BTreeSet<String> {
    let headings = prose(text)
        .into_iter()
        .filter(|(_, line)| line.starts_with('#'));
    let slug = |line: &str| {
        let heading = line
            .trim_start_matches('#')
            .trim()
            .to_lowercase()
            .replace(' ', "-");
        heading
            .chars()
            .filter(|c| c.is_alphanumeric() || ['-', '_'].contains(c))
            .collect()
    };
    headings.map(|(_, line)| slug(line)).collect()
}

/// The lines outside fenced code, numbered.
fn prose(text: &str) -> Vec<(usize, &str)> {
    let mut fenced = false;
    let mut lines = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
        } else if !fenced {
            lines.push((number, line));
        }
    }
    lines
}

/// The place a relative link leads to; none if it leaves the repository.
pub(crate) fn join(from: &str, link: &str) -> Option<String> {
    let mut parts: Vec<&str> = from.split('/').collect();
    parts.pop();
    for part in link.trim_end_matches('/').split('/') {
        match part {
            "." => {}
            ".." => drop(parts.pop()?),
            name => parts.push(name),
        }
    }
    Some(parts.join("/"))
}

/// The lines that the diffs of a document add, each with the file that it names before them.
pub(crate) fn added_lines(text: &str) -> Vec<(usize, &str, &str)> {
    let mut added = Vec::new();
    let (mut is_diff, mut path) = (false, "");
    for (number, line) in (1..).zip(text.lines()) {
        if line.starts_with("```") {
            is_diff = line == "```diff";
        } else if let Some(named) = line.strip_prefix("+++ ").filter(|_| is_diff) {
            path = named;
        } else if let Some(code) = line.strip_prefix('+').filter(|_| is_diff) {
            added.push((number, path, code));
        }
    }
    added
}
