//! The sample file: every setting with its meaning and default, commented out.

use super::settings::{EdgeConfig, SECTIONS, SETTINGS, Setting};
use super::value::Kind;

const INTRODUCTION: &str = "\
# The configuration of a Skyway edge: every setting, with its default commented out.
#
# A flag wins over the environment, the environment over this file. The variable of limits.body is
# SKYWAY_EDGE_LIMITS_BODY, its flag --set limits.body=1MiB. Paths are relative to the working directory.
# `skyway config check --config FILE` finds every fault; `skyway config show --origin` tells who said what.
# `skyway config sample` writes this file.
";

/// The sample file, in TOML.
pub fn sample() -> String {
    let defaults = EdgeConfig::default();
    let mut text = INTRODUCTION.to_owned();
    let top: (&str, &[&str]) = ("", &[]);
    for (section, doc) in std::iter::once(&top).chain(SECTIONS) {
        if !section.is_empty() {
            text.push('\n');
            push_doc(&mut text, doc);
            text.push_str(&format!("[{section}]\n"));
        }
        for setting in SETTINGS.iter().filter(|row| row.section == *section) {
            text.push('\n');
            push_doc(&mut text, setting.doc);
            if let Some((least, most)) = (setting.bounds)() {
                text.push_str(&format!("# From {least} to {most}.\n"));
            }
            let value = toml_value(setting, &(setting.text)(&defaults));
            text.push_str(&format!("#{} = {value}\n", setting.key));
        }
    }
    text
}

fn push_doc(text: &mut String, doc: &[&str]) {
    for line in doc {
        text.push_str(&format!("#{line}\n"));
    }
}

/// The text of a value as TOML writes it.
pub(super) fn toml_value(setting: &Setting, text: &str) -> String {
    match setting.kind {
        Kind::Text => toml::Value::String(text.to_owned()).to_string(),
        Kind::Integer | Kind::Number | Kind::Boolean => text.to_owned(),
    }
}
