//! From what the file, the environment and the flags say to one configuration that knows who said what.

use super::fault::{ConfigFault, Origin};
use super::sample::toml_value;
use super::settings::{Configuration, Misfit, Setting};
use super::value::Kind;
use crate::formats::nearest;
use serde_json::{Map, Value as Json};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A flag that says what a setting is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Flag {
    /// As it is written: `--listen`, or `--set limits.body`.
    pub flag: String,
    /// The full name of the setting.
    pub name: String,
    /// What it is to be.
    pub value: String,
}

/// All that says what settings are.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sources {
    /// The file's name and its text, if there is one.
    pub file: Option<(String, String)>,
    /// The environment: names and values; what does not begin with the prefix of the daemon is passed over.
    pub environment: Vec<(String, String)>,
    /// The flags.
    pub flags: Vec<Flag>,
}

/// A configuration that knows who said what.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectiveConfig<C> {
    /// What holds.
    pub config: C,
    /// Who said so, in the order of the settings.
    origins: Vec<Origin>,
}

/// Puts together what all sources say.
///
/// # Errors
/// Everything that is wrong in any of them, also in what another overrides.
pub fn resolve<C: Configuration>(
    sources: &Sources,
) -> Result<EffectiveConfig<C>, Vec<ConfigFault>> {
    let (effective, faults) = resolve_leniently(sources);
    match faults.is_empty() {
        true => Ok(effective),
        false => Err(faults),
    }
}

/// The same with everything that is wrong beside what can be understood, for those who look for more faults.
pub fn resolve_leniently<C: Configuration>(
    sources: &Sources,
) -> (EffectiveConfig<C>, Vec<ConfigFault>) {
    let mut effective = EffectiveConfig {
        config: C::default(),
        origins: vec![Origin::Default; C::SETTINGS.len()],
    };
    let mut faults = Vec::new();
    if let Some((path, text)) = &sources.file {
        effective.read_file(path, text, &mut faults);
        // The parser's tables are in the order of the alphabet.
        faults.sort_by_key(ConfigFault::line);
    }
    for (variable, value) in &sources.environment {
        if variable.starts_with(C::ENVIRONMENT_PREFIX) {
            effective.read_variable(variable, value, &mut faults);
        }
    }
    for flag in &sources.flags {
        effective.read_flag(flag, &mut faults);
    }
    (effective, faults)
}

impl<C: Configuration> EffectiveConfig<C> {
    /// Who said what a setting is, by its full name; the default of one that there is not.
    pub fn origin(&self, name: &str) -> Origin {
        let place = C::SETTINGS.iter().position(|row| row.name() == name);
        place.map_or(Origin::Default, |place| self.origins[place].clone())
    }

    /// The configuration as TOML, with who said each line as a comment where asked for.
    pub fn to_toml(&self, with_origin: bool) -> String {
        let mut text = String::new();
        let mut section = "";
        for (setting, origin) in C::SETTINGS.iter().zip(&self.origins) {
            if setting.section != section {
                section = setting.section;
                text.push_str(&format!("\n[{section}]\n"));
            }
            let value = toml_value(setting.kind, &(setting.text)(&self.config));
            text.push_str(&format!("{} = {value}", setting.key));
            if with_origin {
                text.push_str(&format!("  # {origin}"));
            }
            text.push('\n');
        }
        text
    }

    /// The configuration as JSON, an object per section; with who said so, each value is an object of `value`
    /// and `origin`.
    pub fn to_json(&self, with_origin: bool) -> Json {
        let mut document = Map::new();
        for (setting, origin) in C::SETTINGS.iter().zip(&self.origins) {
            let value = json_value(setting.kind, (setting.text)(&self.config));
            let value = match with_origin {
                true => serde_json::json!({"value": value, "origin": origin.to_string()}),
                false => value,
            };
            if setting.section.is_empty() {
                document.insert(setting.key.to_owned(), value);
                continue;
            }
            let section = document
                .entry(setting.section)
                .or_insert_with(|| Json::Object(Map::new()));
            if let Json::Object(section) = section {
                section.insert(setting.key.to_owned(), value);
            }
        }
        Json::Object(document)
    }

    fn read_file(&mut self, path: &str, text: &str, faults: &mut Vec<ConfigFault>) {
        let file = ConfigFile { path, text };
        let (document, errors) = DeTable::parse_recoverable(text);
        if !errors.is_empty() {
            faults.extend(errors.iter().map(|error| ConfigFault::Syntax {
                origin: file.origin(error.span().map_or(0, |span| span.start)),
                message: error.message().to_owned(),
            }));
            return;
        }
        for (key, value) in document.get_ref() {
            let origin = file.origin(key.span().start);
            let name = key.get_ref().as_ref();
            let is_section = C::SECTIONS.iter().any(|(section, _)| *section == name);
            match value.get_ref() {
                DeValue::Table(table) if is_section => {
                    self.read_section(&file, name, table, faults)
                }
                other if is_section => faults.push(ConfigFault::WrongKind {
                    origin,
                    name: name.to_owned(),
                    found: kind_of(other),
                    expected: "a section of the file".to_owned(),
                }),
                DeValue::Table(_) if !is_known::<C>(name) => {
                    faults.push(unknown_section::<C>(origin, name))
                }
                _ => self.read_entry(origin, name, value, faults),
            }
        }
    }

    fn read_section(
        &mut self,
        file: &ConfigFile<'_>,
        section: &str,
        table: &DeTable<'_>,
        faults: &mut Vec<ConfigFault>,
    ) {
        for (key, value) in table {
            let origin = file.origin(key.span().start);
            self.read_entry(
                origin,
                &format!("{section}.{}", key.get_ref()),
                value,
                faults,
            );
        }
    }

    fn read_entry(
        &mut self,
        origin: Origin,
        name: &str,
        value: &Spanned<DeValue<'_>>,
        faults: &mut Vec<ConfigFault>,
    ) {
        let Some(setting) = C::SETTINGS.iter().find(|row| row.name() == name) else {
            faults.push(unknown::<C>(origin, name));
            return;
        };
        let value = value.get_ref();
        let text = match (setting.kind, value) {
            (Kind::Text, DeValue::String(text)) => text.to_string(),
            (Kind::Integer | Kind::Number, DeValue::Integer(number)) => decimal(number),
            (Kind::Number, DeValue::Float(number)) => number.as_str().to_owned(),
            (Kind::Boolean, DeValue::Boolean(truth)) => truth.to_string(),
            _ => {
                faults.push(ConfigFault::WrongKind {
                    origin,
                    name: name.to_owned(),
                    found: kind_of(value),
                    expected: match setting.kind {
                        Kind::Text => format!("{}: {}", setting.kind.name(), setting.expected),
                        kind => kind.name().to_owned(),
                    },
                });
                return;
            }
        };
        self.assign(name, origin, &text, faults);
    }

    fn read_variable(&mut self, variable: &str, value: &str, faults: &mut Vec<ConfigFault>) {
        let origin = Origin::Environment {
            variable: variable.to_owned(),
        };
        let Some(setting) = C::SETTINGS.iter().find(|row| row.variable() == variable) else {
            let variables: Vec<String> = C::SETTINGS.iter().map(Setting::<C>::variable).collect();
            let nearest = nearest_of(variable, &variables);
            faults.push(ConfigFault::Unknown {
                origin,
                name: variable.to_owned(),
                nearest,
            });
            return;
        };
        self.assign(&setting.name(), origin, value, faults);
    }

    fn read_flag(&mut self, flag: &Flag, faults: &mut Vec<ConfigFault>) {
        let origin = Origin::Flag {
            flag: flag.flag.clone(),
        };
        if matches!(self.origin(&flag.name), Origin::Flag { .. }) {
            let name = flag.name.clone();
            faults.push(ConfigFault::Twice { origin, name });
            return;
        }
        self.assign(&flag.name, origin, &flag.value, faults);
    }

    fn assign(&mut self, name: &str, origin: Origin, text: &str, faults: &mut Vec<ConfigFault>) {
        let Some(place) = C::SETTINGS.iter().position(|row| row.name() == name) else {
            faults.push(unknown::<C>(origin, name));
            return;
        };
        let setting = &C::SETTINGS[place];
        let bounds = (setting.bounds)().unwrap_or_default();
        let (name, text) = (name.to_owned(), text.to_owned());
        match (setting.assign)(&mut self.config, &text) {
            Ok(()) => self.origins[place] = origin,
            Err(Misfit::Unreadable) => faults.push(ConfigFault::Unreadable {
                origin,
                name,
                text,
                expected: setting.expected,
            }),
            Err(Misfit::OutOfBounds) => faults.push(ConfigFault::OutOfBounds {
                origin,
                name,
                text,
                least: bounds.0,
                most: bounds.1,
            }),
        }
    }
}

struct ConfigFile<'a> {
    path: &'a str,
    text: &'a str,
}

impl ConfigFile<'_> {
    fn origin(&self, offset: usize) -> Origin {
        let before = self.text.as_bytes().iter().take(offset);
        Origin::File {
            path: self.path.to_owned(),
            line: before.filter(|byte| **byte == b'\n').count() + 1,
        }
    }
}

fn is_known<C: Configuration>(name: &str) -> bool {
    C::SETTINGS.iter().any(|row| row.name() == name)
}

fn unknown_section<C: Configuration>(origin: Origin, name: &str) -> ConfigFault {
    let sections: Vec<String> = C::SECTIONS
        .iter()
        .map(|(section, _)| (*section).to_owned())
        .collect();
    ConfigFault::Unknown {
        origin,
        name: name.to_owned(),
        nearest: nearest_of(name, &sections),
    }
}

/// A setting that there is not, with the one that was probably meant: of the same key elsewhere, or nearly
/// of this name.
fn unknown<C: Configuration>(origin: Origin, name: &str) -> ConfigFault {
    let names: Vec<String> = C::SETTINGS.iter().map(Setting::<C>::name).collect();
    let key = name.rsplit('.').next().unwrap_or(name);
    let elsewhere = C::SETTINGS.iter().find(|row| row.key == key);
    let nearest = elsewhere
        .map(Setting::<C>::name)
        .or_else(|| nearest_of(name, &names));
    ConfigFault::Unknown {
        origin,
        name: name.to_owned(),
        nearest,
    }
}

fn nearest_of(word: &str, candidates: &[String]) -> Option<String> {
    let near = nearest(word, candidates.iter().map(String::as_str), 1);
    near.first().map(|candidate| (*candidate).to_owned())
}

/// A whole number in decimal; one that is too large stays as it is written.
fn decimal(number: &toml::de::DeInteger<'_>) -> String {
    i128::from_str_radix(number.as_str(), number.radix())
        .map_or_else(|_| number.to_string(), |value| value.to_string())
}

fn kind_of(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "text",
        DeValue::Integer(_) | DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a section",
    }
}

/// The text of a value as JSON writes it.
fn json_value(kind: Kind, text: String) -> Json {
    match kind {
        Kind::Text => Json::String(text),
        // Our own numbers and truths are JSON already.
        Kind::Integer | Kind::Number | Kind::Boolean => {
            serde_json::from_str(&text).unwrap_or(Json::String(text))
        }
    }
}
