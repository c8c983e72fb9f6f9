//! Node order: the one order that breaks ties, that of the ids in the file.
//!
//! Numeric when all ids are integers, else by UTF-8 bytes; never the order of internal indices,
//! which depends on the space-filling curve.

use std::cmp::Ordering;

/// Compares ids of one network; see [`NodeOrder::of`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeOrder {
    /// Every id is an integer.
    Numeric,
    /// At least one is not.
    Bytes,
}

impl NodeOrder {
    /// The order that a set of ids asks for.
    pub fn of<'a>(mut ids: impl Iterator<Item = &'a str>) -> Self {
        match ids.all(|id| id.parse::<i128>().is_ok()) {
            true => Self::Numeric,
            false => Self::Bytes,
        }
    }

    /// Compares two ids; ids of equal value (`1` and `01`) fall back to their bytes.
    pub fn compare(self, left: &str, right: &str) -> Ordering {
        match self {
            Self::Bytes => left.cmp(right),
            Self::Numeric => {
                let value = |id: &str| id.parse::<i128>().unwrap_or(i128::MAX);
                value(left).cmp(&value(right)).then_with(|| left.cmp(right))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_compare_by_value_and_words_by_bytes() {
        let numeric = NodeOrder::of(["10", "9", "-3"].into_iter());
        assert_eq!(numeric, NodeOrder::Numeric);
        assert_eq!(numeric.compare("10", "9"), Ordering::Greater);
        assert_eq!(numeric.compare("-3", "9"), Ordering::Less);

        let bytes = NodeOrder::of(["10", "9", "a"].into_iter());
        assert_eq!(bytes, NodeOrder::Bytes);
        assert_eq!(bytes.compare("10", "9"), Ordering::Less);
    }
}
