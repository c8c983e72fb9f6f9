//! Between the shapes of the wire and the messages of gRPC: what the conversions of all services are made of.
//!
//! Both ways: the server writes answers, and a client in Rust reads them back into the shapes that REST has.

use super::proto;
use crate::wire::{Id, RegistryRevision};
use jiff::Timestamp;
use serde_json::Value;
use std::borrow::Cow;
use thiserror::Error;

/// Becomes the form in which a message has it; moves what is owned already.
pub trait IntoProto<P> {
    /// The message, or the value of its field.
    fn into_proto(self) -> P;
}

/// Is read from the form in which a message has it.
pub trait FromProto<P>: Sized {
    /// The shape of the wire.
    ///
    /// # Errors
    /// When something is missing, or not known, without which the shape cannot be.
    fn from_proto(message: P) -> Result<Self, Unreadable>;
}

/// A message that is not what an edge sends.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Unreadable {
    /// A field without which it says nothing.
    #[error("the field '{field}' is missing")]
    Missing {
        /// Its name.
        field: &'static str,
    },
    /// A number of an enumeration that this version does not know.
    #[error("{number} is no {what} that is known here; a newer version may know it")]
    UnknownNumber {
        /// The enumeration.
        what: &'static str,
        /// The number.
        number: i32,
    },
    /// A number that is too large.
    #[error("{number} is too large")]
    TooLarge {
        /// The number.
        number: u64,
    },
    /// Text that should be the revision of a registry.
    #[error("'{text}' is not the epoch and revision of a registry")]
    RegistryRevision {
        /// The text.
        text: String,
    },
    /// Text that should be JSON.
    #[error("the field '{field}' is not JSON: {reason}")]
    NotJson {
        /// Its name.
        field: &'static str,
        /// What is wrong.
        reason: String,
    },
}

macro_rules! same_in_both {
    ($($type:ty),*) => {$(
        impl IntoProto<$type> for $type {
            fn into_proto(self) -> $type {
                self
            }
        }

        impl FromProto<$type> for $type {
            fn from_proto(value: $type) -> Result<Self, Unreadable> {
                Ok(value)
            }
        }
    )*};
}

same_in_both!(bool, u32, u64, f64, String);

impl IntoProto<u32> for u16 {
    fn into_proto(self) -> u32 {
        u32::from(self)
    }
}

impl FromProto<u32> for u16 {
    fn from_proto(value: u32) -> Result<Self, Unreadable> {
        let number = u64::from(value);
        Self::try_from(value).map_err(|_| Unreadable::TooLarge { number })
    }
}

impl IntoProto<u64> for usize {
    fn into_proto(self) -> u64 {
        self as u64
    }
}

impl FromProto<u64> for usize {
    fn from_proto(number: u64) -> Result<Self, Unreadable> {
        Self::try_from(number).map_err(|_| Unreadable::TooLarge { number })
    }
}

impl IntoProto<String> for Cow<'_, str> {
    fn into_proto(self) -> String {
        self.into_owned()
    }
}

impl FromProto<String> for Cow<'_, str> {
    fn from_proto(text: String) -> Result<Self, Unreadable> {
        Ok(Cow::Owned(text))
    }
}

impl IntoProto<String> for RegistryRevision {
    fn into_proto(self) -> String {
        self.to_string()
    }
}

impl FromProto<String> for RegistryRevision {
    fn from_proto(text: String) -> Result<Self, Unreadable> {
        text.parse()
            .map_err(|_| Unreadable::RegistryRevision { text })
    }
}

impl IntoProto<String> for Id<'_> {
    fn into_proto(self) -> String {
        self.into_text()
    }
}

impl FromProto<String> for Id<'_> {
    fn from_proto(text: String) -> Result<Self, Unreadable> {
        Ok(Self::new(text))
    }
}

impl<T: IntoProto<P>, P> IntoProto<Option<P>> for Option<T> {
    fn into_proto(self) -> Option<P> {
        self.map(T::into_proto)
    }
}

impl<T: FromProto<P>, P> FromProto<Option<P>> for Option<T> {
    fn from_proto(value: Option<P>) -> Result<Self, Unreadable> {
        value.map(|value| T::from_proto(value)).transpose()
    }
}

impl<T: IntoProto<P>, P> IntoProto<P> for Box<T> {
    fn into_proto(self) -> P {
        (*self).into_proto()
    }
}

impl<T: FromProto<P>, P> FromProto<P> for Box<T> {
    fn from_proto(value: P) -> Result<Self, Unreadable> {
        T::from_proto(value).map(Self::new)
    }
}

impl<T: IntoProto<P>, P> IntoProto<Vec<P>> for Vec<T> {
    fn into_proto(self) -> Vec<P> {
        self.into_iter().map(T::into_proto).collect()
    }
}

impl<T: FromProto<P>, P> FromProto<Vec<P>> for Vec<T> {
    fn from_proto(values: Vec<P>) -> Result<Self, Unreadable> {
        values
            .into_iter()
            .map(|value| T::from_proto(value))
            .collect()
    }
}

impl IntoProto<proto::Coordinates> for [f64; 2] {
    fn into_proto(self) -> proto::Coordinates {
        let [x, y] = self;
        proto::Coordinates { x, y }
    }
}

impl FromProto<proto::Coordinates> for [f64; 2] {
    fn from_proto(position: proto::Coordinates) -> Result<Self, Unreadable> {
        Ok([position.x, position.y])
    }
}

/// The instant of an RFC 3339 text; none where it is no such text.
pub(super) fn timestamp(text: &str) -> Option<proto::Timestamp> {
    let instant: Timestamp = text.parse().ok()?;
    let (seconds, nanos) = (instant.as_second(), instant.subsec_nanosecond());
    // Before 1970 jiff counts both down from zero; a message counts nanoseconds up.
    Some(match nanos < 0 {
        true => proto::Timestamp {
            seconds: seconds - 1,
            nanos: nanos + 1_000_000_000,
        },
        false => proto::Timestamp { seconds, nanos },
    })
}

/// The RFC 3339 text of an instant. One that is out of range becomes text that says so: a client that reads times
/// then refuses it, or passes over it, as any other text that is no time.
pub(super) fn instant_text(timestamp: &proto::Timestamp) -> String {
    let &proto::Timestamp { seconds, nanos } = timestamp;
    let is_normal = (0..1_000_000_000).contains(&nanos);
    match Timestamp::new(seconds, nanos) {
        Ok(instant) if is_normal => instant.to_string(),
        _ => format!("{seconds} s and {nanos} ns from 1970"),
    }
}

/// A number as JSON has it. JSON has no infinities: one becomes text, which is refused where numbers are read.
pub(super) fn number_value(number: f64) -> Value {
    match number.is_finite() {
        true => Value::from(number),
        false => Value::from("not finite"),
    }
}

/// The JSON value of a text.
pub(super) fn json_value(text: &str, field: &'static str) -> Result<Value, Unreadable> {
    serde_json::from_str(text).map_err(|error| Unreadable::NotJson {
        field,
        reason: error.to_string(),
    })
}
