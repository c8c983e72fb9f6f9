//! Shapes that are the same in both dialects, said once, field by field, for both directions.
//!
//! `mirror!` names the fields of a shape with the kind of each:
//!
//! - `plain`: a value, an optional value or a list;
//! - `message`: a message that is always there;
//! - `time`, `maybe_time`: RFC 3339 text, a `Timestamp` in the message;
//! - `json`: a JSON value, its text in the message.
//!
//! A field that one side has and the list has not does not compile.

/// Conversions of a shape that has the same fields as its message.
macro_rules! mirror {
    ($shape:ty => $message:ident { $($field:ident: $kind:ident),* $(,)? }) => {
        impl $crate::api::grpc::convert::IntoProto<$crate::api::grpc::proto::$message> for $shape {
            fn into_proto(self) -> $crate::api::grpc::proto::$message {
                $crate::api::grpc::proto::$message {
                    $($field: $crate::api::grpc::mirror::into_field!($kind, self.$field),)*
                }
            }
        }

        impl $crate::api::grpc::convert::FromProto<$crate::api::grpc::proto::$message> for $shape {
            fn from_proto(
                message: $crate::api::grpc::proto::$message,
            ) -> Result<Self, $crate::api::grpc::convert::Unreadable> {
                Ok(Self {
                    $($field: $crate::api::grpc::mirror::from_field!($kind, message.$field, $field),)*
                })
            }
        }

        #[cfg(test)]
        impl $crate::api::grpc::sample::Sample for $shape {
            fn sample(sampler: &mut $crate::api::grpc::sample::Sampler) -> Self {
                Self {
                    $($field: $crate::api::grpc::sample::sample_field!($kind, sampler),)*
                }
            }
        }
    };
}

/// Conversions of an enumeration that has the same variants as that of the messages, which has `Unspecified`, too.
macro_rules! mirror_enum {
    ($name:ident { $($variant:ident),* $(,)? }) => {
        impl $crate::api::grpc::convert::IntoProto<i32> for $crate::wire::$name {
            fn into_proto(self) -> i32 {
                match self {
                    $(Self::$variant => $crate::api::grpc::proto::$name::$variant as i32,)*
                }
            }
        }

        impl $crate::api::grpc::convert::FromProto<i32> for $crate::wire::$name {
            fn from_proto(
                number: i32,
            ) -> Result<Self, $crate::api::grpc::convert::Unreadable> {
                use $crate::api::grpc::proto::$name as Message;
                match Message::try_from(number) {
                    $(Ok(Message::$variant) => Ok(Self::$variant),)*
                    Ok(Message::Unspecified) | Err(_) => {
                        let what = stringify!($name);
                        Err($crate::api::grpc::convert::Unreadable::UnknownNumber { what, number })
                    }
                }
            }
        }

        #[cfg(test)]
        impl $crate::api::grpc::sample::Sample for $crate::wire::$name {
            fn sample(sampler: &mut $crate::api::grpc::sample::Sampler) -> Self {
                sampler.one_of(&[$(Self::$variant),*])
            }
        }
    };
}

macro_rules! into_field {
    (plain, $value:expr) => {
        $crate::api::grpc::convert::IntoProto::into_proto($value)
    };
    (message, $value:expr) => {
        Some($crate::api::grpc::convert::IntoProto::into_proto($value))
    };
    (time, $value:expr) => {
        $crate::api::grpc::convert::timestamp(&$value)
    };
    (maybe_time, $value:expr) => {
        $value
            .as_deref()
            .and_then($crate::api::grpc::convert::timestamp)
    };
    (json, $value:expr) => {
        $value.to_string()
    };
}

macro_rules! from_field {
    (plain, $value:expr, $field:ident) => {
        $crate::api::grpc::convert::FromProto::from_proto($value)?
    };
    (message, $value:expr, $field:ident) => {
        $crate::api::grpc::convert::FromProto::from_proto($crate::api::grpc::mirror::required!(
            $value, $field
        ))?
    };
    (time, $value:expr, $field:ident) => {
        $crate::api::grpc::convert::instant_text(&$crate::api::grpc::mirror::required!(
            $value, $field
        ))
        .into()
    };
    (maybe_time, $value:expr, $field:ident) => {
        $value
            .as_ref()
            .map(|instant| $crate::api::grpc::convert::instant_text(instant).into())
    };
    (json, $value:expr, $field:ident) => {
        $crate::api::grpc::convert::json_value(&$value, stringify!($field))?
    };
}

macro_rules! required {
    ($value:expr, $field:ident) => {
        $value.ok_or($crate::api::grpc::convert::Unreadable::Missing {
            field: stringify!($field),
        })?
    };
}

pub(super) use {from_field, into_field, mirror, mirror_enum, required};
