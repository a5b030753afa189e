//! JSON with numbers to the last digit.
//!
//! The reader of JSON may miss the nearest double by its last bit, which a certificate would show in the last
//! digit; numbers are read from their text here.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, MapAccess, Visitor};
use serde_json::value::RawValue;
use serde_json::{Map, Number, Value};

/// A JSON text, each number the double nearest to it.
///
/// # Errors
/// The text is no JSON, or nests deeper than 128 levels.
pub fn json(text: &str) -> serde_json::Result<Value> {
    // The reader's own limit of depth holds for what follows.
    serde_json::from_str::<Value>(text)?;
    exact(text)
}

fn exact(text: &str) -> serde_json::Result<Value> {
    let text = text.trim();
    match text.as_bytes().first() {
        Some(b'{') => serde_json::from_str(text).map(|Entries(entries)| Value::Object(entries)),
        Some(b'[') => {
            let items: Vec<&RawValue> = serde_json::from_str(text)?;
            let items = items.into_iter().map(|item| exact(item.get()));
            items.collect::<Result<_, _>>().map(Value::Array)
        }
        Some(b'-' | b'0'..=b'9') => {
            let read: Value = serde_json::from_str(text)?;
            let nearest = text.parse().ok().filter(|_| read.is_f64());
            let nearest = nearest.and_then(Number::from_f64);
            Ok(nearest.map_or(read, Value::Number))
        }
        _ => serde_json::from_str(text),
    }
}

/// An object in the order of the text.
struct Entries(Map<String, Value>);

impl<'de> Deserialize<'de> for Entries {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Read;
        impl<'de> Visitor<'de> for Read {
            type Value = Entries;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Entries, A::Error> {
                let mut entries = Map::new();
                while let Some((key, value)) = map.next_entry::<String, &RawValue>()? {
                    entries.insert(key, exact(value.get()).map_err(A::Error::custom)?);
                }
                Ok(Entries(entries))
            }
        }
        deserializer.deserialize_map(Read)
    }
}
