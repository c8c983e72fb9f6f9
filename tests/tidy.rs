//! The house rules of CONTRIBUTING.md, executable: sizes, names, promises, purity, the direction of
//! the arrows between layers, links of the documents, safety of the scripts.
//!
//! It reads the source as text and knows nothing of the engine. A rule is a function from files to
//! findings; the last test shows each rule a file that breaks it.
#![expect(
    clippy::disallowed_methods,
    reason = "the rules read the repository's own files"
)]

#[path = "tidy/circles.rs"]
mod circles;
#[path = "tidy/layers.rs"]
mod layers;
#[path = "tidy/markdown.rs"]
mod markdown;
#[path = "tidy/repository.rs"]
mod repository;
#[path = "tidy/rust.rs"]
mod rust;
#[path = "tidy/wire_only.rs"]
mod wire_only;

use circles::large_circles;
use layers::{impurities, wrong_arrows, wrong_dependencies};
use markdown::{added_lines, anchors, links};
use repository::{File, repository};
use rust::{functions, macros_called};
use wire_only::beyond_the_wire;

const MAX_FILE_LINES: usize = 500;
const MAX_FUNCTION_LINES: usize = 70;
/// A test tells a story from top to bottom, which takes more lines.
const MAX_TEST_FUNCTION_LINES: usize = 100;

/// Words of a name that say nothing about what a thing is.
const EMPTY_NAMES: &[&str] = &[
    "util", "utils", "helper", "helpers", "common", "misc", "manager", "shared",
];

/// In pieces, so that this file keeps its own rule.
const PROMISES: &[&str] = &[
    concat!("TO", "DO"),
    concat!("FIX", "ME"),
    concat!("XX", "X"),
    concat!("HA", "CK"),
];
const PROMISING_MACROS: &[&str] = &["dbg", "todo", "unimplemented"];

#[test]
fn names_say_what_a_thing_is() {
    accept(repository().iter().flat_map(empty_names));
}

#[test]
fn files_and_functions_are_short() {
    accept(repository().iter().flat_map(long_files_and_functions));
}

#[test]
fn files_say_what_they_are_for() {
    accept(repository().iter().flat_map(missing_introductions));
}

#[test]
fn no_promises_are_left() {
    accept(repository().iter().flat_map(promises));
}

#[test]
fn the_pure_half_is_pure() {
    accept(repository().iter().flat_map(impurities));
}

#[test]
fn arrows_go_down() {
    let files = repository();
    accept(files.iter().flat_map(wrong_arrows));
    accept(files.iter().flat_map(wrong_dependencies));
}

#[test]
fn files_do_not_go_round_in_circles() {
    accept(large_circles(&repository()).into_iter());
}

#[test]
fn recipes_stand_in_the_code() {
    let files = repository();
    accept(files.iter().flat_map(|file| stale_recipes(file, &files)));
}

#[test]
fn the_load_test_knows_only_the_wire() {
    accept(repository().iter().flat_map(beyond_the_wire));
}

#[test]
fn links_resolve() {
    let files = repository();
    accept(files.iter().flat_map(|file| broken_links(file, &files)));
}

#[test]
fn scripts_are_safe_to_run() {
    accept(repository().iter().flat_map(unsafe_scripts));
}

#[track_caller]
fn accept(findings: impl Iterator<Item = String>) {
    let findings: Vec<String> = findings.collect();
    assert!(
        findings.is_empty(),
        "house rules (CONTRIBUTING.md):\n{}",
        findings.join("\n")
    );
}

// === the rules ===

fn empty_names(file: &File) -> Vec<String> {
    if !file.is_rust() && !file.is_script() {
        return Vec::new();
    }
    let tokens = file.tokens();
    let declared = tokens
        .windows(2)
        .filter(|pair| pair[0].is("mod"))
        .map(|pair| &pair[1].text);
    file.path
        .split('/')
        .chain(declared.map(String::as_str))
        .filter(|name| {
            name.split(['_', '-', '.'])
                .any(|word| EMPTY_NAMES.contains(&word))
        })
        .map(|name| {
            format!(
                "{}: {name} says nothing; name it after what it is about",
                file.path
            )
        })
        .collect()
}

fn long_files_and_functions(file: &File) -> Vec<String> {
    if !file.is_rust() {
        return Vec::new();
    }
    let mut findings = Vec::new();
    let lines = file.text.lines().count();
    if lines > MAX_FILE_LINES {
        let path = &file.path;
        findings.push(format!(
            "{path}: {lines} lines, {MAX_FILE_LINES} at most; split it"
        ));
    }
    let limit = match file.path.starts_with("tests/") {
        true => MAX_TEST_FUNCTION_LINES,
        false => MAX_FUNCTION_LINES,
    };
    for (name, first, last) in functions(&file.tokens()) {
        let length = last - first + 1;
        if length > limit {
            let path = &file.path;
            findings.push(format!(
                "{path}:{first}: {name} has {length} lines, {limit} at most"
            ));
        }
    }
    findings
}

fn missing_introductions(file: &File) -> Option<String> {
    (file.is_rust() && !file.text.starts_with("//! "))
        .then(|| format!("{}:1: begin with `//!` and what the file is for", file.path))
}

fn promises(file: &File) -> Vec<String> {
    let mut findings = Vec::new();
    for (number, line) in (1..).zip(file.text.lines()) {
        let mut words = line.split(|c: char| !c.is_alphanumeric() && c != '_');
        if let Some(word) = words.find(|word| PROMISES.contains(word)) {
            findings.push(format!(
                "{}:{number}: {word}: do it or delete it",
                file.path
            ));
        }
    }
    if file.is_rust() {
        for (line, name) in macros_called(&file.tokens(), PROMISING_MACROS) {
            findings.push(format!("{}:{line}: {name}!: do it or delete it", file.path));
        }
    }
    findings
}

fn broken_links(file: &File, files: &[File]) -> Vec<String> {
    if !file.path.ends_with(".md") {
        return Vec::new();
    }
    let mut findings = Vec::new();
    for (line, target) in links(&file.text) {
        let (path, anchor) = target.split_once('#').unwrap_or((&target, ""));
        let resolved = if path.is_empty() {
            Some(file.path.clone())
        } else {
            markdown::join(&file.path, path)
        };
        let found = files
            .iter()
            .find(|other| Some(&other.path) == resolved.as_ref());
        let anchored = found.is_some_and(|other| {
            anchor.is_empty()
                || !other.path.ends_with(".md")
                || anchors(&other.text).contains(anchor)
        });
        if !anchored {
            findings.push(format!("{}:{line}: {target} leads nowhere", file.path));
        }
    }
    findings
}

/// What a diff of a document adds has to stand in the file that it names, as it is written there.
fn stale_recipes(file: &File, files: &[File]) -> Vec<String> {
    if !file.path.ends_with(".md") {
        return Vec::new();
    }
    let added = added_lines(&file.text).into_iter();
    let stale = added.filter(|(_, path, code)| {
        let named = files.iter().find(|other| other.path == *path);
        !named.is_some_and(|named| named.text.lines().any(|line| line.starts_with(code)))
    });
    stale
        .map(|(number, path, _)| format!("{}:{number}: {path} has no such line", file.path))
        .collect()
}

fn unsafe_scripts(file: &File) -> Vec<String> {
    let mut findings = Vec::new();
    if file.is_script() && !file.text.is_empty() {
        let first = file.text.lines().next().unwrap_or_default();
        let is_bash = first.ends_with("bash");
        if !first.starts_with("#!") || !(is_bash || first.ends_with("python3")) {
            findings.push(format!("{}:1: begin with `#!/usr/bin/env bash`", file.path));
        }
        if !file.executable {
            findings.push(format!("{}: not executable; chmod +x", file.path));
        }
        if is_bash && !file.text.lines().any(|line| line == "set -euo pipefail") {
            findings.push(format!("{}: no `set -euo pipefail`", file.path));
        }
    }
    findings
}

// === the rules are alive ===

fn file(path: &str, text: &str) -> File {
    File {
        path: path.to_owned(),
        executable: false,
        text: text.to_owned(),
    }
}

const POINT: &str = "crates/engine/src/geo/point.rs";
const VERIFY: &str = "crates/engine/src/verify/mod.rs";
const DRAW: &str = "crates/maps/src/draw/svg.rs";
const ENGINE: &str = "crates/engine/Cargo.toml";

/// A rule that finds nothing anywhere would pass for a clean house.
#[test]
fn each_rule_can_go_red() {
    let promise = format!("//! x\n// {}: later\n", PROMISES[0]);
    let long_file = "\n".repeat(MAX_FILE_LINES + 1);
    let long_function = format!("fn f() {{{}}}\n", "\n".repeat(MAX_FUNCTION_LINES));
    let story = format!("fn f() {{{}}}\n", "\n".repeat(MAX_TEST_FUNCTION_LINES));
    type Rule = fn(&File) -> Vec<String>;
    let links: Rule = |file| broken_links(file, &[self::file("docs/a.md", "# One: two")]);
    let recipes: Rule = |file| stale_recipes(file, &[self::file("b.rs", "let y;")]);
    let introductions: Rule = |file| missing_introductions(file).into_iter().collect();
    let red: &[(Rule, &str, &str)] = &[
        (empty_names, "crates/engine/src/geo/point_utils.rs", ""),
        (empty_names, "tests/common/mod.rs", ""),
        (empty_names, POINT, "mod helpers {}"),
        (long_files_and_functions, POINT, &long_file),
        (long_files_and_functions, POINT, &long_function),
        (long_files_and_functions, "tests/engine/story.rs", &story),
        (introductions, POINT, "use crate::geo::Point;"),
        (promises, POINT, &promise),
        (promises, "docs/a.md", &promise),
        (promises, POINT, "fn f() { todo!() }"),
        (impurities, POINT, "use std::{fmt, fs::File};"),
        (impurities, POINT, "fn f() { std::env::var(\"A\"); }"),
        (impurities, POINT, "fn f() { println!(\"a\"); }"),
        (impurities, POINT, "use tokio::sync::watch;"),
        (wrong_arrows, VERIFY, "use crate::{geo, routing::search};"),
        (wrong_arrows, VERIFY, "use super::recompose;"),
        (
            wrong_arrows,
            POINT,
            "fn f() { super::super::network::load(); }",
        ),
        (wrong_arrows, POINT, "fn f(x: &crate::cli::Door) {}"),
        (wrong_arrows, DRAW, "use skyway_formats::read;"),
        (wrong_arrows, "src/nowhere.rs", ""),
        (wrong_dependencies, ENGINE, "skyway-maps = 1"),
        (wrong_dependencies, "crates/nowhere/Cargo.toml", ""),
        (wrong_arrows, "src/main.rs", "use skyway::routing;"),
        (recipes, "a.md", "```diff\n+++ b.rs\n+let x;\n```\n"),
        (links, "README.md", "See [this](docs/b.md)."),
        (links, "docs/c.md", "See [this](a.md#three)."),
        (links, "docs/c.md", "[this]: ../a.md"),
        (
            unsafe_scripts,
            "scripts/x",
            "#!/usr/bin/env bash\nset -euo pipefail\n",
        ),
        (unsafe_scripts, ".ci/run", "set -euo pipefail\n"),
    ];
    for (rule, path, text) in red {
        assert!(
            !rule(&file(path, text)).is_empty(),
            "no finding in {path}: {text}"
        );
    }
    let unsettled = File {
        executable: true,
        ..file("scripts/x", "#!/bin/bash\nset -e\n")
    };
    assert!(
        !unsafe_scripts(&unsettled).is_empty(),
        "a script may lack `set -euo pipefail`"
    );
}

/// What looks like a breach and is none: prose, strings, code of a test, links elsewhere.
#[test]
fn rules_are_quiet_where_nothing_is_wrong() {
    let quiet = "//! Not `std::fs`, not `crate::cli`.\nuse super::point::Point;\n\
        /* println!() /* todo!() */ */\nfn f<'a>(x: &'a str) -> char { \"std::fs \\\" {\"; r#\"{\"#; '{' }\n";
    let source = file("crates/engine/src/geo/plane.rs", quiet);
    let rules = [
        empty_names,
        long_files_and_functions,
        promises,
        impurities,
        wrong_arrows,
    ];
    for rule in rules {
        assert_eq!(rule(&source), Vec::<String>::new());
    }
    assert_eq!(functions(&source.tokens()), [("f".to_owned(), 4, 4)]);
    let text = "[a](https://a.b) [c](#one-two) `[d](e)`\n# One: two\n```\n[f](g)\n```\n";
    let document = file("docs/a.md", text);
    assert_eq!(
        broken_links(&document, &[file("docs/a.md", text)]),
        Vec::<String>::new()
    );
}
