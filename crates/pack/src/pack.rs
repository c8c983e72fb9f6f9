//! A pack that was checked, and what it says.

use crate::check::check;
use crate::fault::Fault;
use crate::key::KeyId;
use crate::layout::{
    HEADER, LEG, NO_HEIGHT, NODE, NONE_16, NONE_32, Numbers, SIGNATURE, State, flag, header, leg,
};
use crate::way::Way;
use ed25519_dalek::{Signature, VerifyingKey};

/// A pack: bytes of which every one was checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pack<'a> {
    pub(crate) bytes: &'a [u8],
}

/// What clock the times are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// The time of day.
    Real,
    /// One that an edge simulates.
    Simulated,
    /// One that a simulator moves.
    External,
}

/// What heights are measured from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeightReference {
    /// Nothing that is known: there are no heights.
    Unknown,
    /// The ground.
    Agl,
    /// Mean sea level.
    Amsl,
    /// The ellipsoid of WGS 84.
    Wgs84,
}

/// A node of the network that the pack speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node {
    /// Its index in the network, as `GET /v1/network?format=compact` counts from 0.
    pub index: u32,
    /// Where it is: longitude and latitude in 1e-7 degrees; on a planar network metres east and north in hundredths.
    pub place: [i32; 2],
    /// The height at which it is passed, in decimetres above the reference.
    pub height_dm: Option<i16>,
}

/// A leg of the plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leg {
    /// The node it starts from.
    pub from: Node,
    /// The node it ends at.
    pub to: Node,
    /// How far below the heights of both nodes it is flown at its beginning and its end, in half metres.
    pub dips_half_m: [u8; 2],
    /// The battery that it takes at its first node to go on as planned, in hundredths of a percent; `None` where that is
    /// unknown.
    pub battery_e4: Option<u16>,
    /// When it leaves its first node, in tenths of a second after the departure; `None` where no times are computed.
    pub departs_ds: Option<u32>,
    /// Whether the drone lands at its first node and charges there until it has that battery.
    pub lands_before: bool,
    /// What is known of the detour to take if it closes.
    pub detour: State,
    /// What is known of its alternate.
    pub alternate: State,
}

impl<'a> Pack<'a> {
    /// Reads a pack that a key has signed.
    ///
    /// # Errors
    /// When the bytes are no pack, or not as this key has signed them.
    pub fn read(bytes: &'a [u8], key: &[u8; 32]) -> Result<Self, Fault> {
        let pack = Self::read_unverified(bytes)?;
        pack.verify(key)?;
        Ok(pack)
    }

    /// Reads a pack whose signature nobody has looked at: to show it, never to fly by it.
    ///
    /// # Errors
    /// When the bytes are no pack.
    pub fn read_unverified(bytes: &'a [u8]) -> Result<Self, Fault> {
        let pack = Self { bytes };
        check(&pack)?;
        Ok(pack)
    }

    /// Whether a key has signed it as it is.
    ///
    /// # Errors
    /// When it names another key, or the signature does not hold.
    pub fn verify(&self, key: &[u8; 32]) -> Result<(), Fault> {
        if KeyId::of(key) != self.key_id() {
            return Err(Fault::Key);
        }
        let (signed, signature) = self.bytes.split_at(self.bytes.len() - SIGNATURE);
        let signature = Signature::from_slice(signature).map_err(|_| Fault::Signature)?;
        let key = VerifyingKey::from_bytes(key).map_err(|_| Fault::Key)?;
        key.verify_strict(signed, &signature)
            .map_err(|_| Fault::Signature)
    }

    /// The bytes that it was read from.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// The key that it says it was signed with.
    pub fn key_id(&self) -> KeyId {
        KeyId(self.bytes.array(header::KEY_ID))
    }

    /// The plan.
    pub fn plan(&self) -> &'a str {
        self.text(HEADER, header::PLAN_LENGTH)
    }

    /// The name of its network for people, as far as there is room for it.
    pub fn network(&self) -> &'a str {
        let plan = usize::from(self.bytes.u8(header::PLAN_LENGTH));
        self.text(HEADER + plan, header::NETWORK_LENGTH)
    }

    /// SHA-256 of the network, as answers carry it.
    pub fn network_sha256(&self) -> [u8; 32] {
        self.bytes.array(header::NETWORK_HASH)
    }

    /// What a drone orders versions by: it takes only a higher one.
    pub fn order(&self) -> (u64, u64, u32) {
        let bytes = self.bytes;
        (
            bytes.u64(header::TOKEN),
            bytes.u64(header::EPOCH),
            bytes.u32(header::VERSION),
        )
    }

    /// After this nobody departs by it, in milliseconds of Unix time. A drone in flight goes by it however late it is.
    pub fn not_after_ms(&self) -> i64 {
        self.bytes.i64(header::NOT_AFTER)
    }

    /// Whether a drone that stands may depart by it.
    pub fn may_depart(&self, now_ms: i64) -> bool {
        now_ms <= self.not_after_ms()
    }

    /// The departure of the version, in milliseconds of Unix time.
    pub fn departs_ms(&self) -> i64 {
        self.bytes.i64(header::DEPARTS_AT)
    }

    /// What clock its times are of.
    pub fn clock(&self) -> Clock {
        match (self.flags() >> flag::CLOCK_AT) & 3 {
            1 => Clock::Simulated,
            2 => Clock::External,
            _ => Clock::Real,
        }
    }

    /// What heights are measured from.
    pub fn height_reference(&self) -> HeightReference {
        match (self.flags() >> flag::REFERENCE_AT) & 3 {
            1 => HeightReference::Agl,
            2 => HeightReference::Amsl,
            3 => HeightReference::Wgs84,
            _ => HeightReference::Unknown,
        }
    }

    /// Whether places are metres on a plane, and no longitudes and latitudes.
    pub fn is_planar(&self) -> bool {
        self.flags() & flag::PLANAR != 0
    }

    /// Whether it has times: those of an edge that plans by distance have none.
    pub fn is_timed(&self) -> bool {
        self.flags() & flag::TIMED != 0
    }

    /// Whether the drone comes to its first node over a first stretch, which the pack does not tell.
    pub fn has_first_stretch(&self) -> bool {
        self.flags() & flag::FIRST_STRETCH != 0
    }

    /// How many legs it has.
    pub fn leg_count(&self) -> u16 {
        self.bytes.u16(header::LEGS)
    }

    /// A leg, counted from 0; `None` beyond the last.
    pub fn leg(&self, number: u16) -> Option<Leg> {
        let at = self.leg_at(number)?;
        let bytes = self.bytes;
        let state = |field| State::of(bytes.u8(at + field)).unwrap_or(State::Pending);
        let [one, other] = bytes.array(at + leg::DIPS);
        Some(Leg {
            from: self.node(bytes.u16(at + leg::FROM)),
            to: self.node(bytes.u16(at + leg::TO)),
            dips_half_m: [one, other],
            battery_e4: known_16(bytes.u16(at + leg::BATTERY)),
            departs_ds: Some(bytes.u32(at + leg::DEPARTS)).filter(|at| *at != NONE_32),
            lands_before: bytes.u8(at + leg::FLAGS) & leg::LANDS != 0,
            detour: state(leg::DETOUR_STATE),
            alternate: state(leg::ALTERNATE_STATE),
        })
    }

    /// The legs in their order.
    pub fn legs(&self) -> impl Iterator<Item = Leg> + use<'a> {
        let pack = *self;
        (0..pack.leg_count()).filter_map(move |number| pack.leg(number))
    }

    /// The detour to take if a leg closes, where the pack has it.
    pub fn detour(&self, number: u16) -> Option<Way<'a>> {
        self.way(number, (leg::DETOUR_STATE, leg::DETOUR))
    }

    /// The way to the alternate of a leg, where the pack has it.
    pub fn alternate(&self, number: u16) -> Option<Way<'a>> {
        self.way(number, (leg::ALTERNATE_STATE, leg::ALTERNATE))
    }

    fn way(&self, number: u16, (state, offset): (usize, usize)) -> Option<Way<'a>> {
        let at = self.leg_at(number)?;
        let is_given = State::of(self.bytes.u8(at + state)) == Some(State::Given);
        let from = self.bytes.u16(at + leg::FROM);
        is_given.then(|| Way::at(*self, from, self.bytes.u16(at + offset)))
    }

    /// A node of its table.
    pub(crate) fn node(&self, number: u16) -> Node {
        let bytes = self.bytes;
        let at = self.nodes_at() + usize::from(number) * NODE;
        let shift = bytes.u8(header::SHIFT);
        let coordinate = |axis: usize| {
            let origin = bytes.i32(header::ORIGIN + 4 * axis);
            origin.wrapping_add(bytes.i24(at + 4 + 3 * axis).wrapping_shl(u32::from(shift)))
        };
        let height = bytes.i16(at + 10);
        Node {
            index: bytes.u32(at),
            place: [coordinate(0), coordinate(1)],
            height_dm: (height != NO_HEIGHT).then_some(height),
        }
    }

    fn flags(&self) -> u8 {
        self.bytes.u8(header::FLAGS)
    }

    fn text(&self, at: usize, length: usize) -> &'a str {
        let end = at + usize::from(self.bytes.u8(length));
        let text = self.bytes.get(at..end).unwrap_or_default();
        core::str::from_utf8(text).unwrap_or_default()
    }

    /// Where the table of nodes begins: after both texts, at a multiple of four.
    pub(crate) fn nodes_at(&self) -> usize {
        let texts = [header::PLAN_LENGTH, header::NETWORK_LENGTH];
        let texts: usize = texts.map(|at| usize::from(self.bytes.u8(at))).iter().sum();
        (HEADER + texts).next_multiple_of(4)
    }

    pub(crate) fn node_count(&self) -> usize {
        usize::from(self.bytes.u16(header::NODES))
    }

    pub(crate) fn legs_at(&self) -> usize {
        self.nodes_at() + self.node_count() * NODE
    }

    pub(crate) fn ways_at(&self) -> usize {
        self.legs_at() + usize::from(self.leg_count()) * LEG
    }

    fn leg_at(&self, number: u16) -> Option<usize> {
        (number < self.leg_count()).then(|| self.legs_at() + usize::from(number) * LEG)
    }
}

pub(crate) fn known_16(number: u16) -> Option<u16> {
    (number != NONE_16).then_some(number)
}
