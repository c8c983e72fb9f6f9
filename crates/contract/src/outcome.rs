//! What comes of a search, in the words of every answer: what to do, the path, and what to know beside it.

use super::id::Id;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// What the drone is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Fly the new remaining path.
    Rerouted,
    /// Fly on: nothing ahead is touched.
    Unaffected,
    /// Wait on a pad at the first node until the way opens, then fly the path.
    Hold,
    /// The destination cannot be reached: fly to the alternate at the end of the path.
    Diverted,
    /// Nothing can be reached.
    NoRoute,
}

/// A path: nodes in order, and the segments between them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Path<'a> {
    /// Ids of the nodes, the first one that the drone comes to first.
    pub nodes: Vec<Id<'a>>,
    /// Ids of the segments between them.
    pub segments: Vec<Cow<'a, str>>,
}

/// Something the receiver should know beside the path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Warning<'a> {
    /// Stable code.
    pub code: Cow<'a, str>,
    /// For people.
    pub message: Cow<'a, str>,
}
