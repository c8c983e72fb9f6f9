//! Where everything lies. All numbers are little-endian; `docs/pack.md` has the same as a table.

/// The first bytes of a pack.
pub(crate) const MAGIC: [u8; 4] = *b"SKPK";
/// The only format so far.
pub(crate) const FORMAT: u8 = 1;

/// What a pack of ten legs takes at most, in bytes.
pub const BYTES_OF_TEN_LEGS: usize = 2048;
/// What each further leg adds at most, in bytes.
pub const BYTES_PER_FURTHER_LEG: usize = 150;

/// What a pack of so many legs takes at most, in bytes.
pub const fn bytes_max(legs: usize) -> usize {
    BYTES_OF_TEN_LEGS + legs.saturating_sub(10) * BYTES_PER_FURTHER_LEG
}

/// Bytes of the parts of a pack.
pub(crate) const HEADER: usize = 104;
pub(crate) const NODE: usize = 12;
pub(crate) const LEG: usize = 20;
pub(crate) const WAY: usize = 8;
pub(crate) const HOP: usize = 4;
pub(crate) const STOP: usize = 8;
pub(crate) const SIGNATURE: usize = 64;
/// Ways are counted in units of so many bytes.
pub(crate) const UNIT: usize = 4;

/// The longest texts, in bytes.
pub(crate) const PLAN_ID_MAX: u8 = 128;
pub(crate) const NETWORK_NAME_MAX: u8 = 32;
/// Coordinates are whole units, shifted to the left by so much at most.
pub(crate) const SHIFT_MAX: u8 = 16;
/// Nodes are named by 15 bits.
pub(crate) const NODES_MAX: usize = 0x7fff;

/// Fields of the header, by their first bytes.
pub(crate) mod header {
    pub(crate) const FORMAT: usize = 4;
    pub(crate) const FLAGS: usize = 5;
    pub(crate) const PLAN_LENGTH: usize = 6;
    pub(crate) const NETWORK_LENGTH: usize = 7;
    pub(crate) const LENGTH: usize = 8;
    pub(crate) const LEGS: usize = 12;
    pub(crate) const NODES: usize = 14;
    pub(crate) const UNITS: usize = 16;
    pub(crate) const SHIFT: usize = 18;
    pub(crate) const SPARE: usize = 19;
    pub(crate) const VERSION: usize = 20;
    pub(crate) const TOKEN: usize = 24;
    pub(crate) const EPOCH: usize = 32;
    pub(crate) const NOT_AFTER: usize = 40;
    pub(crate) const DEPARTS_AT: usize = 48;
    pub(crate) const ORIGIN: usize = 56;
    pub(crate) const NETWORK_HASH: usize = 64;
    pub(crate) const KEY_ID: usize = 96;
}

/// Bits of the header's flags.
pub(crate) mod flag {
    pub(crate) const PLANAR: u8 = 1;
    pub(crate) const TIMED: u8 = 2;
    pub(crate) const CLOCK_AT: u8 = 2;
    pub(crate) const REFERENCE_AT: u8 = 4;
    pub(crate) const FIRST_STRETCH: u8 = 64;
    pub(crate) const SPARE: u8 = 128;
}

/// Fields of a leg.
pub(crate) mod leg {
    pub(crate) const FROM: usize = 0;
    pub(crate) const TO: usize = 2;
    pub(crate) const DIPS: usize = 4;
    pub(crate) const BATTERY: usize = 6;
    pub(crate) const DEPARTS: usize = 8;
    pub(crate) const FLAGS: usize = 12;
    pub(crate) const DETOUR_STATE: usize = 13;
    pub(crate) const ALTERNATE_STATE: usize = 14;
    pub(crate) const SPARE: usize = 15;
    pub(crate) const DETOUR: usize = 16;
    pub(crate) const ALTERNATE: usize = 18;
    pub(crate) const LANDS: u8 = 1;
}

/// Fields of a way.
pub(crate) mod way {
    pub(crate) const BATTERY: usize = 0;
    pub(crate) const REJOINS: usize = 2;
    pub(crate) const HOPS: usize = 4;
    pub(crate) const FLAGS: usize = 5;
    pub(crate) const SPARE: usize = 6;
    pub(crate) const RESERVE_USED: u8 = 1;
    pub(crate) const BEGINS_WITH_STOP: u8 = 2;
}

/// The bit of a hop's node that says that a stop follows.
pub(crate) const STOPS: u16 = 0x8000;
/// Fields of a stop.
pub(crate) mod stop {
    pub(crate) const BATTERY: usize = 0;
    pub(crate) const SPARE: usize = 2;
    pub(crate) const NOT_BEFORE: usize = 4;
}

/// A number of two or four bytes that says nothing.
pub(crate) const NONE_16: u16 = u16::MAX;
pub(crate) const NONE_32: u32 = u32::MAX;
/// The height that is unknown.
pub(crate) const NO_HEIGHT: i16 = i16::MIN;
/// A whole battery.
pub(crate) const FULL_BATTERY: u16 = 10_000;

/// What is known of a contingency.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// It is still being worked out.
    Pending,
    /// The pack has it.
    Given,
    /// There is none.
    None,
    /// There was one, and something has closed on it.
    Void,
    /// There is one that a pack cannot say, or has no room for.
    LeftOut,
}

impl State {
    pub(crate) const ALL: [Self; 5] = [
        Self::Pending,
        Self::Given,
        Self::None,
        Self::Void,
        Self::LeftOut,
    ];

    pub(crate) fn of(byte: u8) -> Option<Self> {
        Self::ALL.get(usize::from(byte)).copied()
    }

    /// The name in tables and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pending => "pending",
            Self::Given => "given",
            Self::None => "none",
            Self::Void => "void",
            Self::LeftOut => "left_out",
        }
    }
}

/// Numbers at a place of bytes; 0 where there are none, which [`crate::check`] has excluded.
pub(crate) trait Numbers {
    fn array<const N: usize>(&self, at: usize) -> [u8; N];

    fn u8(&self, at: usize) -> u8 {
        u8::from_le_bytes(self.array(at))
    }

    fn u16(&self, at: usize) -> u16 {
        u16::from_le_bytes(self.array(at))
    }

    fn u32(&self, at: usize) -> u32 {
        u32::from_le_bytes(self.array(at))
    }

    fn u64(&self, at: usize) -> u64 {
        u64::from_le_bytes(self.array(at))
    }

    fn i16(&self, at: usize) -> i16 {
        i16::from_le_bytes(self.array(at))
    }

    fn i24(&self, at: usize) -> i32 {
        let [low, middle, high] = self.array(at);
        i32::from_le_bytes([0, low, middle, high]) >> 8
    }

    fn i32(&self, at: usize) -> i32 {
        i32::from_le_bytes(self.array(at))
    }

    fn i64(&self, at: usize) -> i64 {
        i64::from_le_bytes(self.array(at))
    }
}

impl Numbers for [u8] {
    fn array<const N: usize>(&self, at: usize) -> [u8; N] {
        let rest = self.get(at..).unwrap_or_default();
        rest.first_chunk().copied().unwrap_or([0; N])
    }
}
