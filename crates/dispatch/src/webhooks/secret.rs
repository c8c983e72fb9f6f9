//! Secrets of webhooks and the signatures that they make, by the Standard Webhooks specification.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use hmac::{Hmac, KeyInit, Mac};
use serde::{Deserialize, Serialize};
use sha2::Sha256;

/// What a secret begins with.
const PREFIX: &str = "whsec_";
/// How many random bytes a secret has; the specification wants 24 to 64.
const RANDOM_BYTES: usize = 32;
/// How signatures of this kind begin.
const VERSION: &str = "v1";

/// A secret: `whsec_` and the key in base64.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct Secret(String);

impl std::fmt::Debug for Secret {
    // Without the secret.
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("Secret")
    }
}

impl Secret {
    /// A new one.
    ///
    /// # Errors
    /// When the system has no random bits.
    pub(super) fn fresh() -> Result<Self, getrandom::Error> {
        let mut key = [0_u8; RANDOM_BYTES];
        getrandom::fill(&mut key)?;
        Ok(Self(format!("{PREFIX}{}", STANDARD.encode(key))))
    }

    /// The secret as its owner is told it.
    pub(super) fn told(&self) -> &str {
        &self.0
    }

    /// The signature of a message that is sent at this second; none where the secret is no key.
    pub(super) fn sign(&self, id: &str, sent_at_s: i64, body: &str) -> Option<String> {
        let encoded = self.0.strip_prefix(PREFIX)?;
        let key = STANDARD.decode(encoded).ok()?;
        let mut code = Hmac::<Sha256>::new_from_slice(&key).ok()?;
        code.update(format!("{id}.{sent_at_s}.{body}").as_bytes());
        let signature = STANDARD.encode(code.finalize().into_bytes());
        Some(format!("{VERSION},{signature}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The vector of the reference libraries (standard-webhooks, `libraries/rust/src/lib.rs`).
    #[test]
    fn the_signature_is_that_of_the_reference() {
        let secret = Secret("whsec_C2FVsBQIhrscChlQIMV+b5sSYspob7oD".to_owned());
        let body = r#"{"email":"test@example.com","username":"test_user"}"#;
        let signature = secret.sign("msg_27UH4WbU6Z5A5EzD8u03UvzRbpk", 1_649_367_553, body);
        let expected = "v1,tZ1I4/hDygAJgO5TYxiSd6Sd0kDW6hPenDe+bTa3Kkw=";
        assert_eq!(signature.as_deref(), Some(expected));
    }

    #[test]
    fn secrets_are_long_enough_differ_and_are_not_printed() {
        let (one, other) = (Secret::fresh(), Secret::fresh());
        let (one, other) = (one.expect("random bits"), other.expect("random bits"));
        assert_ne!(one, other);
        let encoded = one.told().strip_prefix(PREFIX).expect("has the prefix");
        let key = STANDARD.decode(encoded).expect("is base64");
        assert!((24..=64).contains(&key.len()));
        assert!(!format!("{one:?}").contains(encoded));
    }

    #[test]
    fn what_is_no_key_signs_nothing() {
        for text in ["", "C2FVsBQI", "whsec_*"] {
            assert_eq!(Secret(text.to_owned()).sign("m", 1, "{}"), None, "{text}");
        }
    }
}
