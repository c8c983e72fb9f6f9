//! The sample file: every setting with its meaning and default, commented out.

use super::settings::Configuration;
use super::value::Kind;

/// The sample file, in TOML.
pub fn sample<C: Configuration>() -> String {
    let defaults = C::default();
    let mut text = C::INTRODUCTION.to_owned();
    let top: (&str, &[&str]) = ("", &[]);
    for (section, doc) in std::iter::once(&top).chain(C::SECTIONS) {
        if !section.is_empty() {
            text.push('\n');
            push_doc(&mut text, doc);
            text.push_str(&format!("[{section}]\n"));
        }
        for setting in C::SETTINGS.iter().filter(|row| row.section == *section) {
            text.push('\n');
            push_doc(&mut text, setting.doc);
            if let Some((least, most)) = (setting.bounds)() {
                text.push_str(&format!("# From {least} to {most}.\n"));
            }
            let value = toml_value(setting.kind, &(setting.text)(&defaults));
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
pub(super) fn toml_value(kind: Kind, text: &str) -> String {
    match kind {
        Kind::Text => toml::Value::String(text.to_owned()).to_string(),
        Kind::Integer | Kind::Number | Kind::Boolean => text.to_owned(),
    }
}
