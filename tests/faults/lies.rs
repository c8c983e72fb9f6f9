//! A registry that lies: an answer of the real one, damaged as a line damages it, or changed and sealed anew as only
//! something that knows the digests can.

use crate::rounds::Chance;
use skyway::wire::{ChangeOperation, ChangesPage, ObjectKind, RegistrySnapshot};
use std::collections::BTreeMap;
use std::fmt::Debug;

/// What is done to an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Lie {
    /// Some bits are others.
    Bent,
    /// The end is missing.
    Cut,
    /// Zeros in the midst.
    Zeroed,
    /// Two stretches have changed places.
    Swapped,
    /// Something else than JSON.
    Other,
    /// Another status than the answer had.
    Status,
    /// An answer that was given before.
    Old,
    /// The rest is of pages that are understood, and right by its digests: of another registry.
    Foreign,
    /// Of an epoch before.
    OldEpoch,
    /// Of another network.
    OtherNetwork,
    /// A change or an object is left out.
    Gap,
    /// Changes are not in their order, or an object comes twice.
    Disorder,
    /// The registry is said to be less far than the page.
    Behind,
    /// Something that is put is not valid.
    Poison,
    /// All zones and closures are left out.
    Empty,
    /// One letter of what is put is another, and nothing is sealed anew.
    Letter,
}

impl Lie {
    const ALL: [Self; 16] = [
        Self::Bent,
        Self::Cut,
        Self::Zeroed,
        Self::Swapped,
        Self::Other,
        Self::Status,
        Self::Old,
        Self::Foreign,
        Self::OldEpoch,
        Self::OtherNetwork,
        Self::Gap,
        Self::Disorder,
        Self::Behind,
        Self::Poison,
        Self::Empty,
        Self::Letter,
    ];

    /// What is bent is told as often as all else together.
    fn draw(chance: &mut Chance) -> Self {
        match chance.below(4) {
            0 => Self::Bent,
            1 => Self::Letter,
            _ => Self::ALL[usize::try_from(chance.below(16)).unwrap_or_default()],
        }
    }
}

/// What kind of answer it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Said {
    Changes,
    Snapshot,
    /// What became of a write.
    Written,
}

/// An answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Words {
    pub(crate) status: u16,
    pub(crate) body: Vec<u8>,
}

/// One who lies, and counts it.
#[derive(Debug)]
pub(crate) struct Liar {
    chance: Chance,
    /// Earlier answers to the same questions.
    earlier: BTreeMap<bool, Vec<Vec<u8>>>,
    pub(crate) told: BTreeMap<Lie, usize>,
    /// How many of a hundred answers are lies.
    pub(crate) of_a_hundred: u64,
}

/// Earlier answers that are remembered.
const EARLIER: usize = 50;

impl Liar {
    pub(crate) fn new(chance: Chance) -> Self {
        Self {
            chance,
            earlier: BTreeMap::new(),
            told: BTreeMap::new(),
            of_a_hundred: 0,
        }
    }

    /// What is told instead of an answer, or the answer itself.
    pub(crate) fn tell(&mut self, said: Said, words: Words) -> Words {
        let is_changes = said == Said::Changes;
        let told = match self.chance.below(100) < self.of_a_hundred {
            true => self.lie(said, &words),
            false => None,
        };
        if said != Said::Written {
            let earlier = self.earlier.entry(is_changes).or_default();
            if earlier.len() < EARLIER {
                earlier.push(words.body.clone());
            } else {
                let place = usize::try_from(self.chance.below(EARLIER as u64)).unwrap_or_default();
                earlier[place].clone_from(&words.body);
            }
        }
        told.unwrap_or(words)
    }

    /// A lie, where the one that was drawn is possible for this answer.
    fn lie(&mut self, said: Said, words: &Words) -> Option<Words> {
        let lie = Lie::draw(&mut self.chance);
        let mut lied = words.clone();
        match lie {
            Lie::Bent | Lie::Cut | Lie::Zeroed | Lie::Swapped => {
                damage(lie, &mut lied.body, &mut self.chance);
            }
            Lie::Other => lied.body = b"<html>502 Bad Gateway</html>".to_vec(),
            Lie::Status => {
                let drawn = usize::try_from(self.chance.below(5)).unwrap_or_default();
                lied.status = [500, 503, 410, 302, 204][drawn];
            }
            Lie::Old => {
                let earlier = self.earlier.get(&(said == Said::Changes))?;
                let count = earlier.len() as u64;
                let place = usize::try_from(self.chance.below(count)).ok()?;
                lied.body = earlier
                    .get(place)
                    .filter(|_| said != Said::Written)?
                    .clone();
            }
            sealed => {
                lied.body = match said {
                    Said::Changes => self.page(sealed, &words.body)?,
                    Said::Snapshot => self.snapshot(sealed, &words.body)?,
                    Said::Written => return None,
                }
            }
        }
        if lied == *words {
            return None;
        }
        *self.told.entry(lie).or_default() += 1;
        Some(lied)
    }

    fn page(&mut self, lie: Lie, body: &[u8]) -> Option<Vec<u8>> {
        let mut page: ChangesPage = serde_json::from_slice(body).ok()?;
        let count = page.changes.len() as u64;
        let place = usize::try_from(self.chance.below(count)).ok()?;
        match lie {
            Lie::Foreign => page.registry_id = turned(&page.registry_id),
            Lie::OldEpoch => page.epoch -= 1,
            Lie::OtherNetwork => page.network = "circle".to_owned(),
            Lie::Behind if count > 0 => page.head = page.after,
            Lie::Gap if count > 0 => {
                page.changes.remove(place);
            }
            Lie::Disorder if count > 1 => page.changes.reverse(),
            Lie::Poison => {
                let puts = page.changes.iter_mut();
                let mut puts = puts.filter(|it| it.operation == ChangeOperation::Put);
                puts.next()?.body = Some(POISON.to_owned());
            }
            Lie::Letter => {
                let body = page.changes.get_mut(place)?.body.as_mut()?;
                turn_letter(body, &mut self.chance);
                return serde_json::to_vec(&page).ok();
            }
            _ => return None,
        }
        for change in &mut page.changes {
            change.sha256 = change.digest(&page.network);
        }
        page.checksum = page.digest();
        serde_json::to_vec(&page).ok()
    }

    fn snapshot(&mut self, lie: Lie, body: &[u8]) -> Option<Vec<u8>> {
        let mut page: RegistrySnapshot = serde_json::from_slice(body).ok()?;
        let count = page.objects.len() as u64;
        let place = usize::try_from(self.chance.below(count)).ok()?;
        match lie {
            Lie::Foreign => page.registry_id = turned(&page.registry_id),
            Lie::OldEpoch => page.epoch -= 1,
            Lie::OtherNetwork => page.network = "circle".to_owned(),
            Lie::Gap if count > 0 => {
                page.objects.remove(place);
            }
            Lie::Disorder if count > 0 => page.objects.push(page.objects[place].clone()),
            Lie::Poison => page.objects.get_mut(place)?.body = POISON.to_owned(),
            Lie::Empty => {
                page.objects.retain(|it| it.kind == ObjectKind::Network);
                page.object_count = page.objects.len() as u64;
            }
            Lie::Letter => {
                let body = &mut page.objects.get_mut(place)?.body;
                turn_letter(body, &mut self.chance);
                return serde_json::to_vec(&page).ok();
            }
            _ => return None,
        }
        for object in &mut page.objects {
            object.sha256 = object.digest(&page.network);
        }
        page.checksum = page.digest();
        serde_json::to_vec(&page).ok()
    }
}

/// A body that is valid as nothing.
const POISON: &str =
    r#"{"type": "Feature", "geometry": {"type": "Point", "coordinates": [1e999, "x"]}}"#;

/// Another id of the same form.
fn turned(id: &str) -> String {
    id.chars().rev().collect::<String>() + "0"
}

/// Makes another letter or digit of one.
fn turn_letter(text: &mut String, chance: &mut Chance) {
    let places = text
        .char_indices()
        .filter(|(_, it)| it.is_ascii_alphanumeric());
    let places: Vec<(usize, char)> = places.collect();
    let drawn = usize::try_from(chance.below(places.len() as u64)).unwrap_or_default();
    if let Some(&(place, letter)) = places.get(drawn) {
        let other = char::from(letter as u8 ^ 1);
        text.replace_range(place..=place, &other.to_string());
    }
}

fn damage(lie: Lie, body: &mut Vec<u8>, chance: &mut Chance) {
    if body.is_empty() {
        return;
    }
    let length = body.len() as u64;
    let mut place = || usize::try_from(chance.below(length)).unwrap_or_default();
    match lie {
        Lie::Cut => body.truncate(place()),
        Lie::Zeroed => {
            let (from, to) = (place(), place());
            body[from.min(to)..from.max(to)].fill(0);
        }
        Lie::Swapped => {
            let middle = place();
            body.rotate_left(middle);
        }
        _ => {
            for _ in 0..=place() % 3 {
                let (at, bit) = (place(), place() % 8);
                body[at] ^= 1 << bit;
            }
        }
    }
}

impl std::fmt::Display for Liar {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut told = self.told.iter();
        told.try_for_each(|(lie, count)| write!(formatter, " {lie:?} {count}"))
    }
}
