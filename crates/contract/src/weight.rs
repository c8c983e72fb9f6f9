//! About how many bytes of memory things take that clients sent.

use serde::Serialize;
use serde_json::Value;
use std::io;

/// What a member of an object takes beside its name and its value: its place in the map and in the order.
const MEMBER_BYTES: usize = 64;

/// About how many bytes a JSON value takes once it is read: many small ones take far more than their text.
pub fn value_bytes(value: &Value) -> usize {
    let inside = match value {
        Value::Null | Value::Bool(_) | Value::Number(_) => 0,
        Value::String(text) => text.len(),
        Value::Array(list) => list.iter().map(value_bytes).sum(),
        Value::Object(members) => {
            let each = members.iter();
            each.map(|(name, value)| MEMBER_BYTES + name.len() + value_bytes(value))
                .sum()
        }
    };
    size_of::<Value>() + inside
}

/// How long the JSON text of something is, without writing it anywhere.
pub fn text_bytes(told: &impl Serialize) -> usize {
    let mut counter = Counter(0);
    match serde_json::to_writer(&mut counter, told) {
        Ok(()) => counter.0,
        // What has no JSON form was never read from it.
        Err(_) => 0,
    }
}

struct Counter(usize);

impl io::Write for Counter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0 += bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
