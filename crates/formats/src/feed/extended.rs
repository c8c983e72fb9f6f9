//! What ED-318 has no word for and its extended properties keep: the margin, and identifiers of more than seven letters, in
//! whose place digits of their SHA-256 stand.

use crate::airspace::Zone;
use rustc_hash::{FxHashMap, FxHashSet};
use sha2::{Digest, Sha256};

/// Where it stands.
pub(super) const EXTENDED: &str = "extendedProperties";
/// What the margin, in metres, is called there.
pub(super) const MARGIN: &str = "margin_m";
/// The longest identifier.
pub(super) const IDENTIFIER_MAX: usize = 7;

/// What a zone of a collection is called.
pub(super) struct Identifier<'z> {
    /// That of its source; its id here where another zone of the collection is called so as well.
    pub(super) full: &'z str,
    /// What the standard has room for, and no other zone of the collection is called.
    pub(super) short: String,
}

/// What the zones of a collection are called, in their order.
pub(super) fn identifiers<'z>(zones: &[&'z Zone]) -> Vec<Identifier<'z>> {
    let mut uses: FxHashMap<&str, usize> = FxHashMap::default();
    for zone in zones {
        let of_source = of_source(zone);
        *uses.entry(of_source).or_default() += 1;
        if zone.id() != of_source {
            *uses.entry(zone.id()).or_default() += 1;
        }
    }
    let full = |zone: &&'z Zone| match uses[of_source(zone)] {
        1 => of_source(zone),
        _ => zone.id(),
    };
    let full: Vec<&str> = zones.iter().map(full).collect();
    let fitting = full.iter().copied().filter(|full| fits(full));
    let mut taken: FxHashSet<String> = fitting.map(str::to_owned).collect();
    let named = full.into_iter().map(|full| {
        let short = match fits(full) {
            true => full.to_owned(),
            false => free_digits(full, &taken),
        };
        taken.insert(short.clone());
        Identifier { full, short }
    });
    named.collect()
}

/// Whether a text can be read as an identifier without a change: blanks around it are left out, and control characters refused.
pub(super) fn is_plain(text: &str) -> bool {
    !text.chars().any(char::is_control) && text.trim() == text
}

/// Whether an identifier is digits that stand in the place of a longer one.
pub(super) fn stands_for(short: &str, full: &str) -> bool {
    digits(&sha256(full)).any(|digits| digits == short)
}

fn of_source(zone: &Zone) -> &str {
    let source = zone.terms().source.as_ref();
    source.map_or(zone.id(), |source| &source.id)
}

fn fits(full: &str) -> bool {
    is_plain(full) && full.chars().count() <= IDENTIFIER_MAX
}

/// The first digits that are not taken; collections are far too small to take them all.
fn free_digits(full: &str, taken: &FxHashSet<String>) -> String {
    let sha256 = sha256(full);
    let free = digits(&sha256).find(|digits| !taken.contains(*digits));
    free.unwrap_or(&sha256[..IDENTIFIER_MAX]).to_owned()
}

fn sha256(full: &str) -> String {
    hex::encode(Sha256::digest(full.as_bytes()))
}

/// Every seven digits that follow each other.
fn digits(sha256: &str) -> impl Iterator<Item = &str> {
    (IDENTIFIER_MAX..=sha256.len()).map(|end| &sha256[end - IDENTIFIER_MAX..end])
}
