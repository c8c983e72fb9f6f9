//! Pages of lists: `page_size` and an opaque `page_token`.

use crate::refusal::{Code, Refusal};
use crate::wire::Fault;
use imbl::OrdMap;
use std::ops::Bound;

/// A page where none is asked for.
const DEFAULT_SIZE: u32 = 100;
/// The largest page.
const MAX_SIZE: u32 = 1_000;

/// Which page is asked for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PageRequest {
    /// At most how many; 100 where none is given, at most 1,000.
    pub size: Option<u32>,
    /// Where the page begins: the `next_page_token` of the page before.
    pub token: Option<String>,
}

/// A page request that has been checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Page {
    /// How many entries it has at most.
    pub size: usize,
    /// The key of the last entry of the page before.
    pub after: Option<String>,
}

impl PageRequest {
    /// Checks what is asked for.
    pub fn check(&self) -> Result<Page, Refusal> {
        let size = self.size.unwrap_or(DEFAULT_SIZE);
        if size == 0 || size > MAX_SIZE {
            return Err(invalid(
                "?page_size",
                format!("{size} is not between 1 and {MAX_SIZE}"),
            ));
        }
        let after = match self.token.as_deref() {
            None | Some("") => None,
            Some(token) => Some(read_token(token).ok_or_else(|| {
                invalid(
                    "?page_token",
                    "it is not a token that a page gave".to_owned(),
                )
            })?),
        };
        Ok(Page {
            size: size as usize,
            after,
        })
    }
}

impl Page {
    /// Where the page before ended, as its list reads that.
    ///
    /// # Errors
    /// When the token is that of another list, or of one that was begun anew since.
    pub fn after_as<T>(&self, read: impl FnOnce(&str) -> Option<T>) -> Result<Option<T>, Refusal> {
        let after = self.after.as_deref();
        let unknown = || {
            invalid(
                "?page_token",
                "it is of another list, or of one that has begun anew: ask for the first page"
                    .to_owned(),
            )
        };
        after.map(|key| read(key).ok_or_else(unknown)).transpose()
    }
}

/// The entries of an ordered map that pass a test, at most a page of them after a key; and the key of the last one where more come
/// after it.
pub fn filtered<K: Ord + Clone, V: Clone>(
    map: &OrdMap<K, V>,
    after: Option<K>,
    size: usize,
    passes: impl Fn(&V) -> bool,
) -> (Vec<V>, Option<K>) {
    let from = after.map_or(Bound::Unbounded, Bound::Excluded);
    let mut entries = map
        .range((from, Bound::Unbounded))
        .filter(|(_, value)| passes(value));
    let (mut told, mut last) = (Vec::new(), None);
    for (key, value) in entries.by_ref().take(size) {
        told.push(value.clone());
        last = Some(key.clone());
    }
    let has_more = entries.next().is_some();
    (told, last.filter(|_| has_more))
}

fn invalid(pointer: &str, message: String) -> Refusal {
    let fault = Fault {
        code: "page_invalid".to_owned(),
        pointer: pointer.to_owned(),
        message,
        hint: None,
    };
    Refusal::at(Code::ParameterInvalid, fault)
}

/// No token of a page is longer.
const TOKEN_BYTES_MAX: usize = 2_000;

/// The token of the page after the entry of this key: opaque, so that no client builds on its form.
pub fn token(key: &str) -> String {
    hex::encode(key)
}

/// The key of a token; none for what is no token.
pub fn read_token(token: &str) -> Option<String> {
    let bytes = (token.len() <= TOKEN_BYTES_MAX).then(|| hex::decode(token));
    let key = String::from_utf8(bytes?.ok()?).ok()?;
    // Not every store can be asked for one.
    (!key.contains('\0')).then_some(key)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_gives_its_key_back_and_nothing_else_is_one() {
        for key in ["a", "zone/7 ü", ""] {
            assert_eq!(read_token(&token(key)).as_deref(), Some(key));
        }
        for wrong in ["x", "zz", "ff", "é0", "00"] {
            assert_eq!(read_token(wrong), None, "{wrong}");
        }
    }
}
