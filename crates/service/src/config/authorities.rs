//! The authorities that the certificate of a registry has to be from, in a PEM file.

use reqwest::Certificate;
use std::path::Path;
use thiserror::Error;

/// Why a file of authorities is of no use.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum AuthoritiesError {
    /// The file cannot be read.
    #[error("cannot read {path}: {message}")]
    Unreadable {
        /// The file.
        path: String,
        /// What the system says.
        message: String,
    },
    /// The file has no certificate, or one that cannot be read.
    #[error(
        "{path}: {message}; it should have certificates that begin with -----BEGIN CERTIFICATE-----"
    )]
    Malformed {
        /// The file.
        path: String,
        /// What is wrong.
        message: String,
    },
}

/// Reads the certificates of authorities from a PEM file.
///
/// # Errors
/// When the file cannot be read, or has none.
pub fn read_authorities(path: &Path) -> Result<Vec<Certificate>, AuthoritiesError> {
    let name = path.display().to_string();
    let pem = read(path).map_err(|error| AuthoritiesError::Unreadable {
        path: name.clone(),
        message: error.to_string(),
    })?;
    let malformed = |message: String| AuthoritiesError::Malformed {
        path: name.clone(),
        message,
    };
    let authorities =
        Certificate::from_pem_bundle(&pem).map_err(|error| malformed(error.to_string()))?;
    match authorities.is_empty() {
        true => Err(malformed("it has no certificate".to_owned())),
        false => Ok(authorities),
    }
}

#[expect(
    clippy::disallowed_methods,
    reason = "the door to the file of authorities"
)]
fn read(path: &Path) -> std::io::Result<Vec<u8>> {
    std::fs::read(path)
}
