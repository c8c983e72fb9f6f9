//! Tokens of a registry that edges reach over a line: there it has another name, under which it answers only who has one.

use crate::daemon::{program, run, write as write_file};
use serde_json::Value;
use std::path::Path;

/// The tokens of a run, and the files that have them.
#[derive(Debug)]
pub(crate) struct Tokens {
    /// What the registry is started with.
    pub(crate) file: String,
    /// That of an operator.
    pub(crate) operator: String,
    /// The files of edges, in the order of their names.
    pub(crate) edges: Vec<String>,
}

impl Tokens {
    /// One for an operator, and one for each edge.
    pub(crate) fn make(folder: &Path, edges: &[&str]) -> Self {
        let mut stanzas = String::new();
        let mut make = |role: &str, subject: &str| {
            let words = ["token", "--role", role, "--subject", subject, "--json"];
            let made: Value = serde_json::from_str(&run(&program(), &words)).expect("JSON");
            let text = |name: &str| made[name].as_str().expect("a text").to_owned();
            stanzas.push_str(&text("stanza"));
            text("token")
        };
        let operator = make("operator", "*");
        let write = |name: &str, text: &str| {
            let path = folder.join(name).display().to_string();
            write_file(&path, text);
            run("chmod", &["600", &path]);
            path
        };
        let edges = edges.iter().map(|name| {
            let token = make("edge", name);
            write(&format!("{name}.token"), &token)
        });
        let edges = edges.collect();
        Self {
            file: write("tokens.toml", &stanzas),
            operator,
            edges,
        }
    }
}
