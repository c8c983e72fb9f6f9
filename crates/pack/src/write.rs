//! Makes packs: what a plan says, laid out and signed.

use crate::key::KeyId;
use crate::layout::{
    FORMAT, FULL_BATTERY, HEADER, HOP, LEG, MAGIC, NETWORK_NAME_MAX, NO_HEIGHT, NODE, NODES_MAX,
    NONE_16, NONE_32, PLAN_ID_MAX, SHIFT_MAX, SIGNATURE, STOP, STOPS, State, UNIT, WAY, bytes_max,
    flag, header, leg, way,
};
use crate::pack::{Clock, HeightReference, Node};
use crate::way::Stop;
use alloc::collections::BTreeMap;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;
use ed25519_dalek::Signer;

/// A key to sign packs with (Ed25519, RFC 8032).
#[derive(Clone)]
pub struct SigningKey(ed25519_dalek::SigningKey);

impl SigningKey {
    /// The key of a seed: 32 random bytes that nobody else knows.
    pub fn of_seed(seed: &[u8; 32]) -> Self {
        Self(ed25519_dalek::SigningKey::from_bytes(seed))
    }

    /// The public half, which readers need.
    pub fn public(&self) -> [u8; 32] {
        self.0.verifying_key().to_bytes()
    }

    /// Its id.
    pub fn id(&self) -> KeyId {
        KeyId::of(&self.public())
    }
}

/// Nothing of it but its id is shown.
impl fmt::Debug for SigningKey {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "SigningKey({})", self.id())
    }
}

/// What a pack is to say.
#[derive(Clone, Debug, PartialEq)]
pub struct Draft {
    /// The plan.
    pub plan: String,
    /// The name of its network for people; what is beyond 32 bytes is left out.
    pub network: String,
    /// SHA-256 of the network.
    pub network_sha256: [u8; 32],
    /// What versions are ordered by: token, epoch, number.
    pub order: (u64, u64, u32),
    /// After this nobody departs by it, in milliseconds of Unix time.
    pub not_after_ms: i64,
    /// The departure, in milliseconds of Unix time.
    pub departs_ms: i64,
    /// What clock the times are of.
    pub clock: Clock,
    /// What heights are measured from.
    pub heights: HeightReference,
    /// Whether places are metres.
    pub is_planar: bool,
    /// Whether times are computed.
    pub is_timed: bool,
    /// Whether the drone comes to its first node over a first stretch.
    pub has_first_stretch: bool,
    /// The legs.
    pub legs: Vec<DraftLeg>,
}

/// A leg of it; what its fields mean stands at [`crate::Leg`].
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "the fields are those of `Leg`")]
pub struct DraftLeg {
    pub from: Node,
    pub to: Node,
    pub dips_half_m: [u8; 2],
    pub battery_e4: Option<u16>,
    pub departs_ds: Option<u32>,
    pub lands_before: bool,
    pub detour: Contingency,
    pub alternate: Contingency,
}

/// A contingency, or why there is none.
#[derive(Clone, Debug, PartialEq)]
pub enum Contingency {
    /// A way, if there is room for it.
    Way(DraftWay),
    /// None, and why: anything but [`State::Given`].
    Without(State),
}

/// A way; what its fields mean stands at [`crate::Way`].
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "the fields are those of `Way`")]
pub struct DraftWay {
    pub battery_e4: Option<u16>,
    pub rejoins: Option<u16>,
    pub is_reserve_used: bool,
    pub begins_with: Option<Stop>,
    pub hops: Vec<DraftHop>,
}

/// A segment of a way; what its fields mean stands at [`crate::Hop`].
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "the fields are those of `Hop`")]
pub struct DraftHop {
    pub to: Node,
    pub dips_half_m: [u8; 2],
    pub stop: Option<Stop>,
}

/// Why a plan cannot be packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unwritable {
    /// The id of the plan has more than 128 bytes.
    PlanId,
    /// More legs, or nodes, than can be counted.
    Size,
    /// A leg does not begin where the one before it ends.
    Legs,
}

impl fmt::Display for Unwritable {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::PlanId => "the id of the plan has more than 128 bytes",
            Self::Size => "the plan has more legs or nodes than a pack can count",
            Self::Legs => "a leg does not begin where the one before it ends",
        })
    }
}

impl core::error::Error for Unwritable {}

impl Draft {
    /// The bytes of the pack, signed. Contingencies for which there is no room are left out, the longest first.
    ///
    /// # Errors
    /// When the plan cannot be packed.
    pub fn write(&self, key: &SigningKey) -> Result<Vec<u8>, Unwritable> {
        if self.plan.len() > usize::from(PLAN_ID_MAX) {
            return Err(Unwritable::PlanId);
        }
        let follows = |pair: &[DraftLeg]| pair[0].to.index == pair[1].from.index;
        if !self.legs.windows(2).all(follows) {
            return Err(Unwritable::Legs);
        }
        let layout = Layout::of(self)?;
        let mut bytes = layout.written(key)?;
        let signature = key.0.sign(&bytes);
        bytes.extend_from_slice(&signature.to_bytes());
        Ok(bytes)
    }
}

/// Which contingency of which leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Which {
    Detour,
    Alternate,
}

/// A draft with its table of nodes, and where its ways lie that have room.
struct Layout<'a> {
    draft: &'a Draft,
    network: &'a str,
    /// By index in the network, the number in the table.
    numbers: BTreeMap<u32, u16>,
    nodes: Vec<Node>,
    ways: Vec<u8>,
    /// Where each way lies, in units.
    offsets: BTreeMap<(usize, Which), u16>,
}

impl<'a> Layout<'a> {
    fn of(draft: &'a Draft) -> Result<Self, Unwritable> {
        let cut = draft
            .network
            .floor_char_boundary(usize::from(NETWORK_NAME_MAX));
        let mut layout = Self {
            draft,
            network: &draft.network[..cut],
            numbers: BTreeMap::new(),
            nodes: Vec::new(),
            ways: Vec::new(),
            offsets: BTreeMap::new(),
        };
        for leg in &draft.legs {
            layout.number(leg.from);
            layout.number(leg.to);
        }
        if draft.legs.len() >= usize::from(u16::MAX) || layout.nodes.len() > NODES_MAX {
            return Err(Unwritable::Size);
        }
        let mut later = Vec::new();
        for (which, leg, way) in draft.by_length() {
            let has_detour = layout.offsets.contains_key(&(leg, Which::Detour));
            match which == Which::Alternate && has_detour {
                true => later.push((which, leg, way)),
                false => layout.place(which, leg, way),
            }
        }
        // What helps where another one helps already comes last.
        for (which, leg, way) in later {
            layout.place(which, leg, way);
        }
        Ok(layout)
    }

    /// Puts a way among the others, if there is room.
    fn place(&mut self, which: Which, leg: usize, way: &DraftWay) {
        let is_new = |hop: &&DraftHop| !self.numbers.contains_key(&hop.to.index);
        let mut new: Vec<u32> = way
            .hops
            .iter()
            .filter(is_new)
            .map(|hop| hop.to.index)
            .collect();
        new.sort_unstable();
        new.dedup();
        let stops = way.hops.iter().filter_map(|hop| hop.stop);
        let stops = stops.chain(way.begins_with).count();
        let bytes = WAY + way.hops.len() * HOP + stops * STOP;
        let has_room = self.length() + new.len() * NODE + bytes <= bytes_max(self.draft.legs.len())
            && self.nodes.len() + new.len() <= NODES_MAX
            && u8::try_from(way.hops.len()).is_ok();
        let offset = u16::try_from(self.ways.len() / UNIT);
        let Some(offset) = offset.ok().filter(|at| has_room && *at != NONE_16) else {
            return;
        };
        self.write_way(way);
        self.offsets.insert((leg, which), offset);
    }

    fn write_way(&mut self, way: &DraftWay) {
        let mut flags = 0;
        if way.is_reserve_used {
            flags |= way::RESERVE_USED;
        }
        if way.begins_with.is_some() {
            flags |= way::BEGINS_WITH_STOP;
        }
        self.put(&battery(way.battery_e4).to_le_bytes());
        self.put(&way.rejoins.unwrap_or(NONE_16).to_le_bytes());
        // `place` has counted them.
        self.put(&[way.hops.len() as u8, flags, 0, 0]);
        if let Some(stop) = way.begins_with {
            self.put_stop(stop);
        }
        for hop in &way.hops {
            let stops = if hop.stop.is_some() { STOPS } else { 0 };
            let number = self.number(hop.to) | stops;
            self.put(&number.to_le_bytes());
            self.put(&hop.dips_half_m);
            if let Some(stop) = hop.stop {
                self.put_stop(stop);
            }
        }
    }

    fn put_stop(&mut self, stop: Stop) {
        self.put(&stop.battery_e4.min(FULL_BATTERY).to_le_bytes());
        self.put(&[0, 0]);
        self.put(&stop.not_before_ds.unwrap_or(NONE_32).to_le_bytes());
    }

    fn put(&mut self, bytes: &[u8]) {
        self.ways.extend_from_slice(bytes);
    }

    /// The number of a node in the table, where it is put if it is not there. Beyond what a pack can count they are not used.
    fn number(&mut self, node: Node) -> u16 {
        let next = u16::try_from(self.nodes.len()).unwrap_or(u16::MAX);
        *self.numbers.entry(node.index).or_insert_with(|| {
            self.nodes.push(node);
            next
        })
    }

    fn texts(&self) -> usize {
        self.draft.plan.len() + self.network.len()
    }

    /// How many bytes it takes as it is.
    fn length(&self) -> usize {
        let legs = self.draft.legs.len() * LEG;
        let tables = self.nodes.len() * NODE + legs + self.ways.len();
        (HEADER + self.texts()).next_multiple_of(4) + tables + SIGNATURE
    }

    fn written(&self, key: &SigningKey) -> Result<Vec<u8>, Unwritable> {
        let (origin, shift) = self.grid().ok_or(Unwritable::Size)?;
        let draft = self.draft;
        let mut bytes = alloc::vec![0; HEADER];
        let mut put = |at: usize, field: &[u8]| bytes[at..at + field.len()].copy_from_slice(field);
        let small = |number: usize| u16::try_from(number).map_err(|_| Unwritable::Size);
        let length = u32::try_from(self.length()).map_err(|_| Unwritable::Size)?;
        put(0, &MAGIC);
        put(header::FORMAT, &[FORMAT, self.flags()]);
        // Both were bounded above.
        put(header::PLAN_LENGTH, &[draft.plan.len() as u8]);
        put(header::NETWORK_LENGTH, &[self.network.len() as u8]);
        put(header::LENGTH, &length.to_le_bytes());
        put(header::LEGS, &small(draft.legs.len())?.to_le_bytes());
        put(header::NODES, &small(self.nodes.len())?.to_le_bytes());
        put(header::UNITS, &small(self.ways.len() / UNIT)?.to_le_bytes());
        put(header::SHIFT, &[shift]);
        put(header::VERSION, &draft.order.2.to_le_bytes());
        put(header::TOKEN, &draft.order.0.to_le_bytes());
        put(header::EPOCH, &draft.order.1.to_le_bytes());
        put(header::NOT_AFTER, &draft.not_after_ms.to_le_bytes());
        put(header::DEPARTS_AT, &draft.departs_ms.to_le_bytes());
        put(header::ORIGIN, &origin[0].to_le_bytes());
        put(header::ORIGIN + 4, &origin[1].to_le_bytes());
        put(header::NETWORK_HASH, &draft.network_sha256);
        put(header::KEY_ID, &key.id().0);
        bytes.extend_from_slice(draft.plan.as_bytes());
        bytes.extend_from_slice(self.network.as_bytes());
        bytes.resize((HEADER + self.texts()).next_multiple_of(4), 0);
        for node in &self.nodes {
            bytes.extend_from_slice(&node.index.to_le_bytes());
            for (place, origin) in node.place.into_iter().zip(origin) {
                let offset = (i64::from(place) - i64::from(origin)) >> shift;
                // `grid` has seen to it that three bytes suffice.
                bytes.extend_from_slice(&offset.to_le_bytes()[..3]);
            }
            bytes.extend_from_slice(&node.height_dm.unwrap_or(NO_HEIGHT).to_le_bytes());
        }
        for (number, leg) in draft.legs.iter().enumerate() {
            self.write_leg(number, leg, &mut bytes);
        }
        bytes.extend_from_slice(&self.ways);
        Ok(bytes)
    }

    fn write_leg(&self, number: usize, drafted: &DraftLeg, bytes: &mut Vec<u8>) {
        let node = |node: Node| self.numbers.get(&node.index).copied().unwrap_or_default();
        let lands = if drafted.lands_before { leg::LANDS } else { 0 };
        let placed = |which| self.offsets.get(&(number, which)).copied();
        let ways = [
            (placed(Which::Detour), &drafted.detour),
            (placed(Which::Alternate), &drafted.alternate),
        ];
        let state = |(offset, contingency): (Option<u16>, &Contingency)| match (offset, contingency)
        {
            (Some(_), _) => State::Given,
            (None, Contingency::Way(_) | Contingency::Without(State::Given)) => State::LeftOut,
            (None, Contingency::Without(state)) => *state,
        };
        let [detour, alternate] = ways.map(state).map(|state| state as u8);
        bytes.extend_from_slice(&node(drafted.from).to_le_bytes());
        bytes.extend_from_slice(&node(drafted.to).to_le_bytes());
        bytes.extend_from_slice(&drafted.dips_half_m);
        bytes.extend_from_slice(&battery(drafted.battery_e4).to_le_bytes());
        bytes.extend_from_slice(&drafted.departs_ds.unwrap_or(NONE_32).to_le_bytes());
        bytes.extend_from_slice(&[lands, detour, alternate, 0]);
        for (offset, _) in ways {
            bytes.extend_from_slice(&offset.unwrap_or(NONE_16).to_le_bytes());
        }
    }

    fn flags(&self) -> u8 {
        let draft = self.draft;
        let clock = match draft.clock {
            Clock::Real => 0,
            Clock::Simulated => 1,
            Clock::External => 2,
        };
        let reference = match draft.heights {
            HeightReference::Unknown => 0,
            HeightReference::Agl => 1,
            HeightReference::Amsl => 2,
            HeightReference::Wgs84 => 3,
        };
        let bits = [
            (draft.is_planar, flag::PLANAR),
            (draft.is_timed, flag::TIMED),
            (draft.has_first_stretch, flag::FIRST_STRETCH),
        ];
        let bits = bits.into_iter().filter(|(is_set, _)| *is_set);
        let bits = bits.fold(0, |all, (_, bit)| all | bit);
        bits | clock << flag::CLOCK_AT | reference << flag::REFERENCE_AT
    }

    /// The middle of all nodes, and by how many bits offsets from it are shortened so that three bytes suffice.
    fn grid(&self) -> Option<([i32; 2], u8)> {
        let mut origin = [0; 2];
        let mut widest = 0;
        for (axis, middle) in origin.iter_mut().enumerate() {
            let places = || self.nodes.iter().map(|node| i64::from(node.place[axis]));
            let least = places().min().unwrap_or_default();
            let most = places().max().unwrap_or_default();
            *middle = i32::try_from((least + most).div_euclid(2)).ok()?;
            widest = widest.max(most - least);
        }
        let half = widest / 2 + 1;
        let shift = (0..=SHIFT_MAX).find(|shift| half >> shift < 1 << 23)?;
        Some((origin, shift))
    }
}

impl Draft {
    /// All ways: detours before alternates, the shortest first, so that as many legs as can be are covered.
    fn by_length(&self) -> Vec<(Which, usize, &DraftWay)> {
        let mut ways = Vec::new();
        for (number, leg) in self.legs.iter().enumerate() {
            let detour = leg.detour.way().map(|way| (Which::Detour, number, way));
            let alternate = leg
                .alternate
                .way()
                .map(|way| (Which::Alternate, number, way));
            ways.extend([detour, alternate].into_iter().flatten());
        }
        ways.sort_by_key(|(which, leg, way)| (*which, way.hops.len(), *leg));
        ways
    }
}

impl Contingency {
    fn way(&self) -> Option<&DraftWay> {
        match self {
            Self::Way(way) => Some(way),
            Self::Without(_) => None,
        }
    }
}

fn battery(known: Option<u16>) -> u16 {
    known.map_or(NONE_16, |battery| battery.min(FULL_BATTERY))
}
