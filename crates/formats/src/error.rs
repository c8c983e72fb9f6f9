//! What is wrong with a file, and where: the error that every format's reader reports.

use std::fmt;
use thiserror::Error;

/// At most this many errors are collected from one file; a file with more has one cause, not a
/// thousand.
pub const MAX_FORMAT_ERRORS: usize = 100;

/// One thing wrong with a file.
///
/// Reads as `features/12/properties/pads (node 'a'): is text, not a number; write 4, not "4"`.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub struct FormatError {
    /// JSON Pointer (RFC 6901) of the place; empty for the document as a whole.
    pub pointer: String,
    /// The feature that the place belongs to, such as `node 'a'`; `None` outside any feature.
    pub feature: Option<String>,
    /// What is wrong, in lower case and without a full stop.
    pub message: String,
    /// What would set it right, where that is known.
    pub hint: Option<String>,
}

impl FormatError {
    /// An error at a place, with neither feature nor hint yet.
    pub fn new(pointer: impl Into<String>, message: impl Into<String>) -> Self {
        Self {
            pointer: pointer.into(),
            feature: None,
            message: message.into(),
            hint: None,
        }
    }

    /// The same error with the way to set it right.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// The same error with the feature it belongs to, unless it already names one.
    #[must_use]
    pub fn of(mut self, feature: impl Into<String>) -> Self {
        self.feature.get_or_insert_with(|| feature.into());
        self
    }
}

impl fmt::Display for FormatError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = self.pointer.strip_prefix('/').unwrap_or(&self.pointer);
        match place {
            "" => write!(formatter, "document")?,
            place => write!(formatter, "{place}")?,
        }
        if let Some(feature) = &self.feature {
            write!(formatter, " ({feature})")?;
        }
        write!(formatter, ": {}", self.message)?;
        match &self.hint {
            Some(hint) => write!(formatter, "; {hint}"),
            None => Ok(()),
        }
    }
}

/// Errors as they are found, no more than [`MAX_FORMAT_ERRORS`].
#[derive(Debug, Default)]
pub(super) struct FormatErrors(Vec<FormatError>);

impl FormatErrors {
    /// Keeps the error unless enough have been kept.
    pub(super) fn push(&mut self, error: FormatError) {
        if !self.is_full() {
            self.0.push(error);
        }
    }

    /// True when nothing more will be kept.
    pub(super) fn is_full(&self) -> bool {
        self.0.len() >= MAX_FORMAT_ERRORS
    }

    /// True when nothing has been found wrong so far.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The value, unless there were errors.
    pub(super) fn or<T>(self, value: T) -> Result<T, Vec<FormatError>> {
        if self.0.is_empty() {
            Ok(value)
        } else {
            Err(self.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_reads_place_feature_message_hint() {
        let error = FormatError::new("/features/12", "is odd")
            .of("node 'a'")
            .hint("make it even");
        assert_eq!(
            error.to_string(),
            "features/12 (node 'a'): is odd; make it even"
        );
        assert_eq!(
            FormatError::new("", "is empty").to_string(),
            "document: is empty"
        );
    }
}
