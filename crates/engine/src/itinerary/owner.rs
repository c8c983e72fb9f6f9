//! Whose a leg is.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Deref;
use std::sync::Arc;

/// The id of a plan that takes something, told apart from most others without a look at its text.
#[derive(Clone, Debug)]
pub struct Owner {
    id: Arc<str>,
    hash: u64,
}

impl Owner {
    /// Owners of different hashes are not the same.
    #[inline]
    pub(super) fn hash(&self) -> u64 {
        self.hash
    }

    /// The id of the plan.
    pub fn id(&self) -> &Arc<str> {
        &self.id
    }
}

impl From<Arc<str>> for Owner {
    fn from(id: Arc<str>) -> Self {
        let mut hasher = DefaultHasher::new();
        id.hash(&mut hasher);
        Self {
            hash: hasher.finish(),
            id,
        }
    }
}

impl Deref for Owner {
    type Target = str;

    fn deref(&self) -> &str {
        &self.id
    }
}

impl PartialEq for Owner {
    fn eq(&self, other: &Self) -> bool {
        self.hash == other.hash && self.id == other.id
    }
}
