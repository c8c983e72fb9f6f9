//! Import circles: files of a crate that use each other, directly or through others.
//!
//! An import of what a module only passes on (`pub use`) counts for the file that defines it, so that
//! a module's face is no circle by itself.

use crate::repository::File;
use crate::rust::{Token, paths};
use std::collections::{BTreeMap, BTreeSet};

/// Files of one crate that may use each other.
const MAX_CIRCLE: usize = 3;
/// Longer chains of `pub use` are not followed.
const MAX_PASSES: usize = 6;

type ModulePath = Vec<String>;

/// A file as a module of its crate.
struct Module {
    path: String,
    tokens: Vec<Token>,
}

/// The modules of a crate.
struct Modules(BTreeMap<ModulePath, Module>);

impl Modules {
    /// Where a path leads from a module: the module that it ends in, and what it names there.
    fn walk<'p>(
        &self,
        from: &ModulePath,
        segments: &'p [String],
    ) -> Option<(ModulePath, &'p [String])> {
        let mut at = from.clone();
        let mut rest = segments;
        match rest.first()?.as_str() {
            "crate" | "skyway" => {
                at.clear();
                rest = &rest[1..];
            }
            "self" => rest = &rest[1..],
            "super" => {
                while rest.first().is_some_and(|segment| segment == "super") {
                    at.pop()?;
                    rest = &rest[1..];
                }
            }
            // A word by itself is a name, and no path.
            _ if rest.len() == 1 => return None,
            first => {
                let child = [at.as_slice(), &[first.to_owned()]].concat();
                self.0.get(&child)?;
            }
        }
        while let Some(next) = rest.first() {
            let child = [at.as_slice(), std::slice::from_ref(next)].concat();
            if !self.0.contains_key(&child) {
                break;
            }
            at = child;
            rest = &rest[1..];
        }
        Some((at, rest))
    }

    /// The module that defines what a path names.
    fn definer(&self, from: &ModulePath, segments: &[String], passes: usize) -> Option<ModulePath> {
        let (module, rest) = self.walk(from, segments)?;
        let Some(name) = rest.first().filter(|_| passes > 0) else {
            return Some(module);
        };
        let there = &self.0.get(&module)?.tokens;
        if defines(there, name) {
            return Some(module);
        }
        let passed_on = paths(there).into_iter().find_map(|(_, other)| {
            let names_it = other.len() > 1 && other.last() == Some(name);
            let found = names_it.then(|| self.definer(&module, &other, passes - 1))??;
            (found != module).then_some(found)
        });
        Some(passed_on.unwrap_or(module))
    }

    /// What each file uses of its crate, by places in the list of files.
    fn arrows(&self) -> Vec<BTreeSet<usize>> {
        let places: BTreeMap<&ModulePath, usize> = self.0.keys().zip(0..).collect();
        let of_one = |(from, module): (&ModulePath, &Module)| {
            let used = paths(&without_faces(&module.tokens)).into_iter();
            let used = used.filter_map(|(_, segments)| self.definer(from, &segments, MAX_PASSES));
            let used = used.filter(|used| used != from);
            used.filter_map(|used| places.get(&used).copied()).collect()
        };
        self.0.iter().map(of_one).collect()
    }
}

fn defines(tokens: &[Token], name: &str) -> bool {
    const KEYWORDS: [&str; 8] = [
        "struct",
        "enum",
        "trait",
        "fn",
        "type",
        "const",
        "static",
        "macro_rules",
    ];
    tokens.windows(2).any(|pair| {
        let is_keyword = KEYWORDS.iter().any(|keyword| pair[0].is(keyword));
        is_keyword && pair[1].is(name)
    })
}

/// The code without what it only passes on (`pub use …;`), and without the modules that visibilities name.
fn without_faces(tokens: &[Token]) -> Vec<Token> {
    let mut kept = Vec::with_capacity(tokens.len());
    let mut at = 0;
    while at < tokens.len() {
        if tokens[at].is("pub") {
            let mut next = at + 1;
            if tokens.get(next).is_some_and(|token| token.is("(")) {
                let end = tokens[next..].iter().position(|token| token.is(")"));
                next += end.map_or(0, |end| end + 1);
            }
            if tokens.get(next).is_some_and(|token| token.is("use")) {
                let end = tokens[next..].iter().position(|token| token.is(";"));
                next += end.map_or(tokens.len(), |end| end + 1);
            }
            at = next;
            continue;
        }
        kept.push(tokens[at].clone());
        at += 1;
    }
    kept
}

/// The code before its unit tests, whose `super` is the file itself.
fn without_tests(mut tokens: Vec<Token>) -> Vec<Token> {
    let tests = tokens
        .windows(3)
        .position(|three| three[0].is("mod") && three[1].is("tests") && three[2].is("{"));
    tokens.truncate(tests.unwrap_or(tokens.len()));
    tokens
}

/// The modules of every crate, by its folder.
fn crates(files: &[File]) -> BTreeMap<Option<&str>, Modules> {
    let mut crates: BTreeMap<Option<&str>, Modules> = BTreeMap::new();
    for file in files.iter().filter(|file| file.is_rust()) {
        let Some((folder, inside)) = file.place() else {
            continue;
        };
        let stem = inside.strip_suffix(".rs").unwrap_or(inside);
        let stem = stem.strip_suffix("/mod").unwrap_or(stem);
        let path = match stem {
            "lib" => Vec::new(),
            _ => stem.split('/').map(str::to_owned).collect(),
        };
        let module = Module {
            path: file.path.clone(),
            tokens: without_tests(file.tokens()),
        };
        let modules = crates
            .entry(folder)
            .or_insert_with(|| Modules(BTreeMap::new()));
        modules.0.insert(path, module);
    }
    crates
}

/// Whatever can be reached from a place and leads back to it, the place included.
fn circle_of(place: usize, arrows: &[BTreeSet<usize>], back: &[BTreeSet<usize>]) -> Vec<usize> {
    let reached = |arrows: &[BTreeSet<usize>]| {
        let mut seen = BTreeSet::from([place]);
        let mut open = vec![place];
        while let Some(at) = open.pop() {
            open.extend(arrows[at].iter().filter(|&&next| seen.insert(next)));
        }
        seen
    };
    let ahead = reached(arrows);
    ahead.intersection(&reached(back)).copied().collect()
}

/// Every circle of more than one file, the largest first, each in the order of its files.
pub(crate) fn circles(files: &[File]) -> Vec<Vec<String>> {
    let mut circles = Vec::new();
    for modules in crates(files).values() {
        let arrows = modules.arrows();
        let mut back = vec![BTreeSet::new(); arrows.len()];
        for (place, used) in arrows.iter().enumerate() {
            for &used in used {
                back[used].insert(place);
            }
        }
        let paths: Vec<&String> = modules.0.values().map(|module| &module.path).collect();
        let mut seen = BTreeSet::new();
        for place in 0..arrows.len() {
            if !seen.insert(place) {
                continue;
            }
            let circle = circle_of(place, &arrows, &back);
            seen.extend(&circle);
            if circle.len() > 1 {
                let names = circle.iter().map(|&place| paths[place].clone());
                let mut names: Vec<String> = names.collect();
                names.sort();
                circles.push(names);
            }
        }
    }
    circles.sort_by_key(|circle| std::cmp::Reverse(circle.len()));
    circles
}

/// Circles that are larger than they may be.
#[expect(clippy::print_stdout, reason = "scripts/house reads the figure")]
pub(crate) fn large_circles(files: &[File]) -> Vec<String> {
    let mut findings = Vec::new();
    let circles = circles(files);
    let largest = circles.first().map_or(1, Vec::len);
    println!("the largest import circle has {largest} files");
    for circle in &circles {
        if circle.len() > MAX_CIRCLE {
            findings.push(format!(
                "{} files use each other, at most {MAX_CIRCLE} may: {}",
                circle.len(),
                circle.join(" ")
            ));
        }
    }
    findings
}
