//! An answer without its lists of numbers, as rows are read back: of a hundred kilobytes a few hundred
//! bytes are left, and the rest is passed over without being made into numbers.

use std::borrow::Cow;
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

/// The text of a row with only the first number of each list of numbers: what [`Lean`] makes of it is the
/// same, and the rest need not be looked at number by number.
pub(super) fn without_lists(text: &str) -> Cow<'_, str> {
    let bytes = text.as_bytes();
    let mut kept = String::new();
    let (mut from, mut at) = (0, 0);
    while let Some(next) = bytes[at..].iter().position(|b| matches!(b, b'[' | b'"')) {
        at += next + 1;
        if bytes[at - 1] == b'"' {
            at = after_text(bytes, at);
        } else if let Some((first, end)) = list_of_numbers(&bytes[at..]) {
            kept += &text[from..at + first];
            (from, at) = (at + end, at + end);
        }
    }
    if from == 0 {
        return Cow::Borrowed(text);
    }
    kept += &text[from..];
    Cow::Owned(kept)
}

/// The place after the quote that ends a text.
fn after_text(bytes: &[u8], mut at: usize) -> usize {
    while let Some(next) = bytes[at..].iter().position(|b| matches!(b, b'"' | b'\\')) {
        at += next + 1;
        if bytes[at - 1] == b'"' {
            return at;
        }
        at = bytes.len().min(at + 1);
    }
    bytes.len()
}

/// Where the first number of a list ends and where the list does, if it begins with a number and holds
/// neither texts nor lists.
fn list_of_numbers(after_bracket: &[u8]) -> Option<(usize, usize)> {
    after_bracket
        .first()
        .filter(|b| b.is_ascii_digit() || **b == b'-')?;
    let end = memchr::memchr3(b']', b'"', b'[', after_bracket)?;
    let first = memchr::memchr(b',', &after_bracket[..end])?;
    (after_bracket[end] == b']').then_some((first, end))
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
    fn leaving_lists_out_first_changes_nothing() {
        for (text, left) in [
            (r#"{"x":[1.5,-2,3e-7],"y":[4]}"#, r#"{"x":[1.5],"y":[4]}"#),
            (
                r#"{"why":"a [1,2] \"[3,4]","n":[-1,2]}"#,
                r#"{"why":"a [1,2] \"[3,4]","n":[-1]}"#,
            ),
            (
                r#"{"a":[[1,2],[3,4]],"m":[1,"a]"]}"#,
                r#"{"a":[[1],[3]],"m":[1,"a]"]}"#,
            ),
            (
                r#"{"o":[1,{}],"e":[],"t":["x","y"]}"#,
                r#"{"o":[1],"e":[],"t":["x","y"]}"#,
            ),
            ("[1,2", "[1,2"),
            (r#""\"#, r#""\"#),
        ] {
            assert_eq!(without_lists(text), left, "{text}");
            let lean = |text: &str| serde_json::from_str::<Lean>(text).ok();
            assert_eq!(lean(&without_lists(text)), lean(text), "{text}");
        }
    }

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
