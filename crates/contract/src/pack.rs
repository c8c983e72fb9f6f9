//! The keys that packs are signed with.

use super::status::Stamp;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Whether what a key has signed is to be believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PackKeyState {
    /// It signs.
    Active,
    /// Another one signs; what it has signed holds on.
    Retired,
    /// Nothing that it has signed is to be believed.
    Revoked,
}

/// A key that packs are, or were, signed with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct PackKey<'a> {
    /// Its id, as a pack names it: the first eight bytes of its public half, in hexadecimal digits.
    pub id: Cow<'a, str>,
    /// `ed25519` (RFC 8032).
    pub algorithm: Cow<'a, str>,
    /// Its public half, 32 bytes in base64.
    pub public_key: Cow<'a, str>,
    /// From when it signs, RFC 3339.
    pub valid_from: Cow<'a, str>,
    /// Until when it signed, RFC 3339; absent of the one that signs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid_until: Option<Cow<'a, str>>,
    /// Whether what it has signed is to be believed.
    pub state: PackKeyState,
}

/// The keys that packs are, or were, signed with, the oldest first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct PackKeys<'a> {
    /// The keys.
    pub keys: Vec<PackKey<'a>>,
    /// The world of this answer.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}
