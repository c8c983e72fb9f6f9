//! Versions: which one a write expects to find, and whether it does.

use crate::refusal::{Code, Refusal};

/// Which version a write expects to find.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Expected {
    /// None: it makes a new one.
    Absent,
    /// Any, or none.
    Anything,
    /// One of these entity tags, or any version for `*`.
    Tags(String),
    /// Nothing was said, which is enough only where nothing is there.
    Unstated,
}

impl Expected {
    /// What a write with this `If-Match` expects.
    pub fn of(if_match: Option<String>) -> Self {
        if_match.map_or(Self::Unstated, Self::Tags)
    }

    /// Checks it against the entity tag of the version there is.
    ///
    /// # Errors
    /// 409, 428 or 412, with the version that is current.
    pub fn check(&self, current: Option<&str>, what: &str, id: &str) -> Result<(), Refusal> {
        match (self, current) {
            (Self::Anything, _) | (Self::Absent | Self::Unstated, None) => Ok(()),
            (Self::Absent, Some(tag)) => {
                let detail =
                    format!("there is a {what} '{id}' already; change it with PUT and If-Match");
                Err(Refusal::new(Code::AlreadyExists, detail).with_etag(tag))
            }
            (Self::Unstated, Some(tag)) => {
                let detail = format!(
                    "{what} '{id}' exists: say with If-Match which version this write replaces"
                );
                Err(Refusal::new(Code::PreconditionRequired, detail).with_etag(tag))
            }
            (Self::Tags(_), None) => {
                let detail = format!("there is no {what} '{id}' that If-Match could match");
                Err(Refusal::new(Code::PreconditionFailed, detail))
            }
            (Self::Tags(tags), Some(tag)) => {
                let matches = tags
                    .split(',')
                    .map(str::trim)
                    .any(|one| one == "*" || one == tag);
                match matches {
                    true => Ok(()),
                    false => {
                        let detail =
                            format!("{what} '{id}' has changed meanwhile: it is at version {tag}");
                        Err(Refusal::new(Code::PreconditionFailed, detail).with_etag(tag))
                    }
                }
            }
        }
    }
}
