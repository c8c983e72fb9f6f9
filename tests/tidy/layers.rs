//! The layers of `src/`: which may use which, and what only the upper ones may touch.

use crate::repository::File;
use crate::rust::{macros_called, paths};

/// Each module of `src/`, from the ground up, and the modules it may use.
///
/// The arrows go down only: what a row names stands in a row above it. `verify` and `checker` check the
/// answers of `routing`, `itinerary` and `recompose`, and share no code with them, so that they cannot
/// share a mistake.
const LAYERS: &[(&str, &str)] = &[
    ("wire", ""),
    ("planted", ""),
    ("access", ""),
    ("geo", ""),
    ("network", "geo"),
    ("airspace", "geo network"),
    ("flight", "geo network"),
    ("routing", "geo network airspace flight"),
    ("itinerary", "planted geo network airspace flight"),
    ("recompose", "planted geo network airspace flight routing"),
    ("compose", "geo network airspace flight routing recompose"),
    (
        "delivery",
        "geo network airspace flight routing itinerary recompose compose",
    ),
    ("verify", "geo network airspace flight"),
    ("checker", "geo network airspace flight"),
    (
        "checked",
        "geo network airspace flight routing itinerary recompose compose delivery checker",
    ),
    (
        "formats",
        "wire geo network airspace flight routing itinerary recompose compose delivery",
    ),
    ("draw", "geo network airspace flight routing recompose"),
    (
        "evaluate",
        "geo network airspace flight routing recompose compose formats draw",
    ),
    ("refusal", "wire formats"),
    ("intake", "wire geo network airspace formats refusal"),
    ("clock", "wire"),
    ("config", "wire access flight itinerary formats clock"),
    ("demo", "wire geo clock"),
    (
        "edge",
        "wire planted access geo network airspace flight routing itinerary recompose compose delivery checker checked formats refusal intake clock config",
    ),
    (
        "registry",
        "wire planted access network formats refusal intake clock",
    ),
    (
        "api",
        "wire access geo network airspace flight routing itinerary recompose compose delivery formats draw refusal intake clock config \
         edge registry",
    ),
    (
        "process",
        "planted network flight clock config edge registry api",
    ),
    (
        "cli",
        "wire access geo network airspace flight routing itinerary recompose compose delivery verify checker checked formats draw evaluate clock config demo edge registry api process",
    ),
    ("main", "cli"),
];

/// The modules above the pure line; every other one is free of what `IMPURE` and `PRINTING` name.
const IMPURE_LAYERS: &[&str] = &[
    "clock", "config", "demo", "edge", "registry", "api", "process", "cli", "main",
];

const IMPURE: &[&str] = &[
    "std::env",
    "std::fs",
    "std::net",
    "std::os",
    "std::process",
    "std::thread",
    "std::time::Instant",
    "std::time::SystemTime",
    "std::io::stdin",
    "std::io::stdout",
    "std::io::stderr",
    "tokio",
];

const PRINTING: &[&str] = &["print", "println", "eprint", "eprintln"];

/// The table itself obeys its rule.
#[test]
fn the_table_goes_down() {
    for (place, (layer, may_use)) in LAYERS.iter().enumerate() {
        let below: Vec<&str> = LAYERS[..place].iter().map(|(name, _)| *name).collect();
        for used in may_use.split_whitespace() {
            assert!(
                below.contains(&used),
                "LAYERS: {used} does not stand above {layer}"
            );
        }
    }
}

pub(crate) fn impurities(file: &File) -> Vec<String> {
    let is_pure = |layer| !IMPURE_LAYERS.contains(&layer);
    if !file.layer().is_some_and(is_pure) {
        return Vec::new();
    }
    let tokens = file.tokens();
    let mut findings = Vec::new();
    for (line, name) in macros_called(&tokens, PRINTING) {
        findings.push(format!("{}:{line}: {name}! belongs to `cli`", file.path));
    }
    for (line, segments) in paths(&tokens) {
        let path = segments.join("::");
        let within = |banned: &&&str| path == **banned || path.starts_with(&format!("{banned}::"));
        if let Some(banned) = IMPURE.iter().find(within) {
            findings.push(format!("{}:{line}: {banned} belongs to `cli`", file.path));
        }
    }
    findings
}

pub(crate) fn wrong_arrows(file: &File) -> Vec<String> {
    let Some(layer) = file.layer() else {
        return Vec::new();
    };
    let Some((_, may_use)) = LAYERS.iter().find(|(name, _)| *name == layer) else {
        return vec![format!(
            "{}: {layer} has no row in LAYERS of tests/tidy/layers.rs",
            file.path
        )];
    };
    let mut findings = Vec::new();
    for (line, segments) in paths(&file.tokens()) {
        let Some(used) = module_below_root(file, &segments) else {
            continue;
        };
        if used != layer && !may_use.split(' ').any(|name| name == used) {
            findings.push(format!("{}:{line}: {layer} must not use {used}", file.path));
        }
    }
    findings
}

/// What a path names directly below the root of the crate, if it starts there.
fn module_below_root<'a>(file: &File, segments: &'a [String]) -> Option<&'a str> {
    let root = if file.path == "src/main.rs" {
        "skyway"
    } else {
        "crate"
    };
    let supers = segments
        .iter()
        .take_while(|segment| *segment == "super")
        .count();
    if supers == 0 {
        return (segments[0] == root)
            .then(|| segments.get(1))
            .flatten()
            .map(String::as_str);
    }
    let named = segments.get(supers)?.as_str();
    let is_layer = LAYERS.iter().any(|(name, _)| *name == named);
    (supers >= file.depth() && is_layer).then_some(named)
}
