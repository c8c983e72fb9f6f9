//! The layers of `crates/` and `src/`: which may use which, and what only the upper ones may touch.

use crate::repository::File;
use crate::rust::{macros_called, paths};

/// Each module of the engine, of the maps, of the service and of `src/`, and every crate that is one layer, from the ground up, with those it may use.
///
/// The arrows go down only: what a row names stands in a row above it. `verify` and `checker` check the
/// answers of `routing`, `itinerary` and `recompose`, and share no code with them, so that they cannot
/// share a mistake.
const LAYERS: &[(&str, &str)] = &[
    ("wire", ""),
    ("planted", ""),
    ("pack", ""),
    ("pack_c", "pack"),
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
    ("buildings", "geo network"),
    ("draw", "geo network airspace flight routing recompose"),
    (
        "formats",
        "wire geo network airspace flight routing itinerary recompose compose delivery verify buildings",
    ),
    (
        "evaluate",
        "geo network airspace flight routing recompose compose formats draw",
    ),
    ("market", "wire geo"),
    ("refusal", "wire formats"),
    ("intake", "wire geo network airspace formats refusal"),
    ("clock", "wire"),
    ("config", "wire pack access flight itinerary formats clock"),
    ("demo", "wire geo clock"),
    (
        "edge",
        "wire planted pack access geo network airspace flight routing itinerary recompose compose delivery checker checked formats refusal intake clock config",
    ),
    (
        "registry",
        "wire planted access network formats refusal intake clock config",
    ),
    (
        "dispatch",
        "wire access geo network routing market refusal intake clock registry",
    ),
    (
        "api",
        "wire access geo network airspace flight routing itinerary recompose compose delivery formats draw refusal intake clock config \
         edge registry dispatch",
    ),
    (
        "process",
        "planted network flight itinerary clock config edge registry dispatch api",
    ),
    (
        "cli",
        "wire pack access geo network airspace flight routing itinerary recompose compose delivery verify checker checked buildings formats draw evaluate clock config demo edge registry api process",
    ),
    ("main", "cli"),
];

/// Each crate of `crates/`: its folder, and the layers it has; where there is one, all its files are of that layer.
const CRATES: &[(&str, &str)] = &[
    ("contract", "wire"),
    ("planted", "planted"),
    ("pack", "pack"),
    ("pack-c", "pack_c"),
    (
        "engine",
        "geo network airspace flight routing itinerary recompose compose delivery verify checker checked",
    ),
    ("maps", "buildings draw"),
    ("formats", "formats"),
    ("evaluation", "evaluate"),
    ("market", "market"),
    ("service", "access refusal intake clock config"),
    ("edge", "edge"),
    ("registry", "registry"),
    ("dispatch", "dispatch"),
];

/// The modules above the pure line; every other one is free of what `IMPURE` and `PRINTING` name.
const IMPURE_LAYERS: &[&str] = &[
    "clock", "config", "demo", "edge", "registry", "dispatch", "api", "process", "cli", "main",
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

/// A crate depends on those alone whose layers its own may use.
pub(crate) fn wrong_dependencies(file: &File) -> Vec<String> {
    let named = file.path.strip_prefix("crates/");
    let Some(name) = named.and_then(|rest| rest.strip_suffix("/Cargo.toml")) else {
        return Vec::new();
    };
    let Some(own) = layers_of(name) else {
        return vec![format!(
            "{}: {name} has no row in CRATES of tests/tidy/layers.rs",
            file.path
        )];
    };
    let rows = LAYERS.iter().filter(|(layer, _)| own.contains(layer));
    let may_use: Vec<&str> = rows.flat_map(|(_, used)| used.split(' ')).collect();
    let mut findings = Vec::new();
    for (number, line) in (1..).zip(file.text.lines()) {
        let dependency = line.strip_prefix("skyway-").unwrap_or_default();
        let Some((used, _)) = dependency.split_once(['.', ' ', '=']) else {
            continue;
        };
        let layers = layers_of(used).unwrap_or_default();
        if !layers.iter().any(|layer| may_use.contains(layer)) {
            findings.push(format!(
                "{}:{number}: {name} must not depend on {used}",
                file.path
            ));
        }
    }
    findings
}

fn layers_of(name: &str) -> Option<Vec<&'static str>> {
    let (_, layers) = CRATES.iter().find(|(folder, _)| *folder == name)?;
    Some(layers.split(' ').collect())
}

/// The layer that a file belongs to; none outside `crates/` and `src/`, and none for what ties layers together, `lib.rs`.
fn layer_of(file: &File) -> Option<&str> {
    let (folder, inside) = file.place()?;
    if let Some([layer]) = folder.and_then(layers_of).as_deref() {
        return Some(layer);
    }
    let first = inside.split('/').next()?;
    let module = first.strip_suffix(".rs").unwrap_or(first);
    (module != "lib").then_some(module)
}

pub(crate) fn impurities(file: &File) -> Vec<String> {
    let is_pure = |layer| !IMPURE_LAYERS.contains(&layer);
    if !layer_of(file).is_some_and(is_pure) {
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
    let Some(layer) = layer_of(file) else {
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
        let Some(used) = layer_named(file, &segments) else {
            continue;
        };
        if used != layer && !may_use.split(' ').any(|name| name == used) {
            findings.push(format!("{}:{line}: {layer} must not use {used}", file.path));
        }
    }
    findings
}

/// The layer that a path names, if it starts at the root of the crate or in another crate.
///
/// Below the root of a crate that is one layer there are modules of its own, too.
fn layer_named<'a>(file: &File, segments: &'a [String]) -> Option<&'a str> {
    let is_layer = |name: &str| LAYERS.iter().any(|(layer, _)| *layer == name);
    let folder = file.place().and_then(|(folder, _)| folder);
    if let Some(name) = segments[0].strip_prefix("skyway_") {
        return match layers_of(name)?.as_slice() {
            [layer] => Some(layer),
            _ => segments.get(1).map(String::as_str),
        };
    }
    let is_one_layer = folder
        .and_then(layers_of)
        .is_some_and(|layers| layers.len() == 1);
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
            .map(String::as_str)
            .filter(|named| !is_one_layer || is_layer(named));
    }
    let named = segments.get(supers)?.as_str();
    (supers >= file.depth() && !is_one_layer && is_layer(named)).then_some(named)
}
