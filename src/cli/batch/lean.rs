//! An answer without its lists of numbers, as rows are read back: of a hundred kilobytes a few hundred
//! bytes are left, and the rest is passed over without being made into numbers.

use std::fmt;

use serde::de::{Deserialize, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};

/// A value of an answer.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Lean {
    /// `null`, and lists of anything but texts.
    Nothing,
    Truth(bool),
    Number(f64),
    Text(String),
    Texts(Vec<String>),
    Object(Vec<(String, Lean)>),
}

impl Lean {
    /// What an object has under a name.
    pub fn get(&self, name: &str) -> Option<&Self> {
        match self {
            Self::Object(members) => members.iter().find(|m| m.0 == name).map(|m| &m.1),
            _ => None,
        }
    }

    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            _ => None,
        }
    }

    pub fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }
}

impl<'de> Deserialize<'de> for Lean {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Reading)
    }
}

struct Reading;

impl<'de> Visitor<'de> for Reading {
    type Value = Lean;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value of JSON")
    }

    fn visit_unit<E>(self) -> Result<Lean, E> {
        Ok(Lean::Nothing)
    }

    fn visit_bool<E>(self, truth: bool) -> Result<Lean, E> {
        Ok(Lean::Truth(truth))
    }

    fn visit_i64<E>(self, number: i64) -> Result<Lean, E> {
        Ok(Lean::Number(number as f64))
    }

    fn visit_u64<E>(self, number: u64) -> Result<Lean, E> {
        Ok(Lean::Number(number as f64))
    }

    fn visit_f64<E>(self, number: f64) -> Result<Lean, E> {
        Ok(Lean::Number(number))
    }

    fn visit_str<E>(self, text: &str) -> Result<Lean, E> {
        Ok(Lean::Text(text.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Lean, A::Error> {
        let mut texts = Vec::new();
        // The first tells what the others are.
        while let Some(next) = list.next_element::<Lean>()? {
            let Lean::Text(text) = next else {
                while list.next_element::<IgnoredAny>()?.is_some() {}
                return Ok(Lean::Nothing);
            };
            texts.push(text);
        }
        Ok(Lean::Texts(texts))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Lean, A::Error> {
        let mut members = Vec::new();
        while let Some(member) = map.next_entry()? {
            members.push(member);
        }
        Ok(Lean::Object(members))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_numbers_and_objects_are_passed_over() {
        let text = r#"{"a":{"value":1.5,"n":3,"list":[1,2,{"b":[3]}]},"ok":true,"none":null,
            "effects":["x","y"],"mixed":["x",1],"of":[{"c":1}],"why":"so"}"#;
        let lean: Lean = serde_json::from_str(text).unwrap();
        let a = lean.get("a").unwrap();
        assert_eq!(a.get("value").unwrap().number(), Some(1.5));
        assert_eq!(a.get("n").unwrap().number(), Some(3.0));
        for list in [
            a.get("list"),
            lean.get("mixed"),
            lean.get("of"),
            lean.get("none"),
        ] {
            assert_eq!(list, Some(&Lean::Nothing));
        }
        assert_eq!(lean.get("ok"), Some(&Lean::Truth(true)));
        let effects = vec!["x".to_owned(), "y".to_owned()];
        assert_eq!(lean.get("effects"), Some(&Lean::Texts(effects)));
        assert_eq!(lean.get("why").unwrap().text(), Some("so"));
    }
}
