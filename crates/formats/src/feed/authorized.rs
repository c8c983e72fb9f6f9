//! An operator's rules for a feed: which of its zones drones are authorized for.

use super::{FeedNote, MAX_NOTES, ZoneFeed};
use crate::airspace::ZoneKind;

impl ZoneFeed {
    /// Authorizes the drones of the network for zones of the feed: for all of a kind, by its name, or for one, by its
    /// identifier. Rules without effect are noted.
    pub fn authorize(&mut self, rules: &[String]) {
        for rule in rules {
            let Some(why) = self.follow(rule) else {
                continue;
            };
            self.further_notes += usize::from(self.notes.len() >= MAX_NOTES);
            self.notes.truncate(MAX_NOTES - 1);
            let note = FeedNote {
                identifier: None,
                pointer: String::new(),
                message: format!("authorized '{rule}': {why}"),
            };
            self.notes.insert(0, note);
        }
    }

    /// Follows a rule; why it has no effect on a zone, where it has none.
    fn follow(&mut self, rule: &str) -> Option<String> {
        let kind = ZoneKind::ALL.into_iter().find(|kind| kind.name() == rule);
        let (mut is_met, mut refused) = (false, None);
        for zone in &mut self.zones {
            let is_named = zone.identifier.as_deref() == Some(rule);
            for volume in zone.outcome.iter_mut().flatten() {
                let found = volume.terms().kind;
                if kind.map_or(is_named, |kind| found == kind) {
                    match volume.authorize() {
                        true => is_met = true,
                        false => refused = Some(found),
                    }
                }
            }
        }
        match (refused, kind) {
            (Some(refused), _) => Some(format!(
                "drones cannot be authorized for zones of the kind '{}'",
                refused.name()
            )),
            (None, _) if is_met => None,
            (None, Some(_)) => Some("no zone that is imported has this kind".to_owned()),
            (None, None) => Some("no zone that is imported has this identifier".to_owned()),
        }
    }
}
