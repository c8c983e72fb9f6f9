//! Why bytes are no pack.

use core::fmt;

/// Why bytes are no pack, or none to go by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// They do not begin as packs do.
    Magic,
    /// A format that this reader does not know.
    Format(u8),
    /// They are fewer or more than they say.
    Length,
    /// A field has a value that it cannot have; where it begins, in bytes.
    Field(usize),
    /// The signature is of another key.
    Key,
    /// The signature does not hold: the bytes are not as they were signed.
    Signature,
}

impl fmt::Display for Fault {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Magic => formatter.write_str("the bytes do not begin as a pack does"),
            Self::Format(format) => {
                write!(
                    formatter,
                    "format {format} is not known: this reader knows 1"
                )
            }
            Self::Length => formatter.write_str("the bytes are fewer or more than they say"),
            Self::Field(at) => write!(formatter, "the field at byte {at} cannot be as it is"),
            Self::Key => formatter.write_str("the signature is of another key"),
            Self::Signature => {
                formatter.write_str("the signature does not hold: the bytes are not as signed")
            }
        }
    }
}

impl core::error::Error for Fault {}
