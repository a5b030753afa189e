//! What a certificate says beside its numbers: laboratory, persons, items, customer, dates. From a TOML.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use toml::value::Datetime;

use crate::io::Message;
use crate::io::setup::SetupFile;

/// The administrative data of a certificate.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Admin {
    /// `[certificate]`.
    #[serde(default)]
    pub certificate: Certificate,
    /// `[laboratory]`.
    #[serde(default)]
    pub laboratory: Contact,
    /// `[customer]`.
    #[serde(default)]
    pub customer: Contact,
    /// `[[person]]`.
    #[serde(default)]
    pub person: Vec<Person>,
    /// `[[item]]`.
    #[serde(default)]
    pub item: Vec<Thing>,
    /// `[[equipment]]`: may be left out.
    #[serde(default)]
    pub equipment: Vec<Thing>,
}

/// Identity, languages and dates.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Certificate {
    /// Unique in the world.
    pub identifier: String,
    /// ISO 3166-1, two letters.
    pub country: String,
    /// ISO 639-1, two letters each; the first is the mandatory one.
    pub languages: Vec<String>,
    /// Code of the laboratory, such as its number of accreditation.
    pub laboratory_code: Option<String>,
    /// Where was calibrated.
    pub place: String,
    /// When the item came.
    pub received: Option<Date>,
    /// First day of the calibration.
    pub begin: Option<Date>,
    /// Last day of it.
    pub end: Option<Date>,
    /// When the certificate was issued.
    pub issued: Option<Date>,
}

/// A name with an address.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Contact {
    pub name: Text,
    pub email: Option<String>,
    pub phone: Option<String>,
    pub fax: Option<String>,
    pub street: Option<String>,
    pub street_no: Option<String>,
    pub post_code: Option<String>,
    pub city: Option<String>,
    pub state: Option<String>,
    /// ISO 3166-1, two letters.
    pub country: Option<String>,
}

/// Who answers for the certificate.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Person {
    pub name: Text,
    pub email: Option<String>,
    pub phone: Option<String>,
    pub role: Option<String>,
    pub main_signer: bool,
}

/// What was calibrated, or with what.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Thing {
    pub name: Text,
    pub description: Option<Text>,
    pub manufacturer: Option<Text>,
    pub model: Option<String>,
    pub identification: Vec<Identification>,
}

/// A number by which somebody knows a thing.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Identification {
    /// Whose number it is.
    pub issuer: String,
    pub value: String,
    pub name: Option<Text>,
}

/// A text, in the first language or by language.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a text, or a table of texts by language"
)]
pub enum Text {
    One(String),
    ByLanguage(BTreeMap<String, String>),
}

impl Default for Text {
    fn default() -> Self {
        Self::One(String::new())
    }
}

/// A day: 2026-11-23, in quotes or without.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged, expecting = "expected a date, such as 2026-11-23")]
pub enum Date {
    Toml(Datetime),
    Text(String),
}

const PLACES: [&str; 5] = [
    "laboratory",
    "customer",
    "laboratoryBranch",
    "customerBranch",
    "other",
];
const ISSUERS: [&str; 5] = [
    "manufacturer",
    "calibrationLaboratory",
    "customer",
    "owner",
    "other",
];

impl Admin {
    /// Reads and checks the file.
    ///
    /// # Errors
    /// The file cannot be read or is no TOML; an entry is missing, unknown or of the wrong kind: the message
    /// names table and key.
    pub fn read(path: &Path) -> Result<Self, Message> {
        let admin: Self = SetupFile::read(path)?.parse()?;
        admin.check().map_err(|message| message.in_file(path))?;
        Ok(admin)
    }

    fn check(&self) -> Result<(), Message> {
        let (table, own) = ("[certificate]", &self.certificate);
        filled(table, "identifier", &own.identifier)?;
        code(
            table,
            "country",
            &own.country,
            char::is_ascii_uppercase,
            "\"DE\"",
        )?;
        if own.languages.is_empty() {
            return Err(missing(table, "languages", "[\"en\"]"));
        }
        for language in &own.languages {
            code(
                table,
                "languages",
                language,
                char::is_ascii_lowercase,
                "[\"en\"]",
            )?;
        }
        if !own.languages.iter().any(|l| l == "en") {
            return Err(Message::bad_input("[certificate] `languages` lacks \"en\"")
                .remedy("add it: the names of the results are in English"));
        }
        one_of(table, "place", &own.place, &PLACES)?;
        for (key, date) in [("begin", &own.begin), ("end", &own.end)] {
            if date.is_none() {
                return Err(missing(table, key, "2026-11-23"));
            }
        }
        for (key, date) in [
            ("received", &own.received),
            ("begin", &own.begin),
            ("end", &own.end),
            ("issued", &own.issued),
        ] {
            if let Some(date) = date
                && date.day().is_none()
            {
                return Err(Message::bad_input(format!("{table} `{key}` is no day"))
                    .remedy("write it as 2026-11-23"));
            }
        }
        if own.begin.as_ref().and_then(Date::day) > own.end.as_ref().and_then(Date::day) {
            return Err(Message::bad_input("[certificate] `end` is before `begin`")
                .remedy("give the first and the last day of the calibration"));
        }
        for (table, contact) in [
            ("[laboratory]", &self.laboratory),
            ("[customer]", &self.customer),
        ] {
            self.contact(table, contact)?;
        }
        self.people_and_things()
    }

    fn people_and_things(&self) -> Result<(), Message> {
        for (table, count) in [
            ("[[person]]", self.person.len()),
            ("[[item]]", self.item.len()),
        ] {
            if count == 0 {
                return Err(missing(table, "name", "\"…\""));
            }
        }
        for person in &self.person {
            self.text("[[person]]", "name", &person.name)?;
            optional(
                "[[person]]",
                &[
                    ("email", &person.email),
                    ("phone", &person.phone),
                    ("role", &person.role),
                ],
            )?;
        }
        for (table, things) in [("[[item]]", &self.item), ("[[equipment]]", &self.equipment)] {
            for thing in things {
                self.thing(table, thing)?;
            }
        }
        if self.item.iter().any(|item| item.identification.is_empty()) {
            let example =
                "[{ issuer = \"manufacturer\", value = \"4711\", name = \"serial number\" }]";
            return Err(missing("[[item]]", "identification", example));
        }
        Ok(())
    }

    fn contact(&self, table: &str, contact: &Contact) -> Result<(), Message> {
        self.text(table, "name", &contact.name)?;
        if let Some(country) = &contact.country {
            code(
                table,
                "country",
                country,
                char::is_ascii_uppercase,
                "\"DE\"",
            )?;
        }
        let address = [
            ("street", &contact.street),
            ("street_no", &contact.street_no),
            ("post_code", &contact.post_code),
            ("city", &contact.city),
            ("state", &contact.state),
        ];
        optional(table, &address)?;
        optional(
            table,
            &[
                ("email", &contact.email),
                ("phone", &contact.phone),
                ("fax", &contact.fax),
            ],
        )?;
        if contact.city.is_none() {
            return Err(missing(table, "city", "\"…\""));
        }
        Ok(())
    }

    fn thing(&self, table: &str, thing: &Thing) -> Result<(), Message> {
        self.text(table, "name", &thing.name)?;
        for (key, text) in [
            ("description", &thing.description),
            ("manufacturer", &thing.manufacturer),
        ] {
            if let Some(text) = text {
                self.text(table, key, text)?;
            }
        }
        optional(table, &[("model", &thing.model)])?;
        for own in &thing.identification {
            one_of(table, "identification.issuer", &own.issuer, &ISSUERS)?;
            filled(table, "identification.value", &own.value)?;
            if let Some(name) = &own.name {
                self.text(table, "identification.name", name)?;
            }
        }
        Ok(())
    }

    fn text(&self, table: &str, key: &str, text: &Text) -> Result<(), Message> {
        match text {
            Text::One(text) => filled(table, key, text),
            Text::ByLanguage(texts) if texts.is_empty() => Err(missing(table, key, "\"…\"")),
            Text::ByLanguage(texts) => texts.iter().try_for_each(|(language, text)| {
                let known = &self.certificate.languages;
                if !known.contains(language) {
                    let what = format!("{table} `{key}` has a text in `{language}`, which is not in [certificate] `languages`");
                    return Err(Message::bad_input(what).remedy(format!("the languages are {}", known.join(", "))));
                }
                filled(table, key, text)
            }),
        }
    }
}

impl Date {
    /// As XML has it; nothing where it is no day.
    pub fn day(&self) -> Option<String> {
        let whole = match self {
            Self::Toml(whole) => *whole,
            Self::Text(text) => text.parse().ok()?,
        };
        match (whole.date, whole.time) {
            (Some(date), None) => Some(date.to_string()),
            _ => None,
        }
    }
}

fn missing(table: &str, key: &str, example: &str) -> Message {
    Message::bad_input(format!("{table} has no `{key}`")).remedy(format!(
        "write `{key} = {example}` under {table}; fixtures/dcc/admin.toml is an example"
    ))
}

fn filled(table: &str, key: &str, text: &str) -> Result<(), Message> {
    if text.trim().is_empty() {
        return Err(missing(table, key, "\"…\""));
    }
    if text.chars().any(|c| c.is_control() && !c.is_whitespace()) {
        return Err(
            Message::bad_input(format!("{table} `{key}` has a control character"))
                .remedy("remove it"),
        );
    }
    Ok(())
}

fn optional(table: &str, entries: &[(&str, &Option<String>)]) -> Result<(), Message> {
    entries.iter().try_for_each(|(key, text)| {
        text.as_ref()
            .map_or(Ok(()), |text| filled(table, key, text))
    })
}

fn code(
    table: &str,
    key: &str,
    text: &str,
    letter: fn(&char) -> bool,
    example: &str,
) -> Result<(), Message> {
    filled(table, key, text)?;
    if text.chars().count() == 2 && text.chars().all(|c| letter(&c)) {
        return Ok(());
    }
    Err(Message::bad_input(format!(
        "{table} `{key}`: `{text}` is no code of two letters"
    ))
    .remedy(format!("write it such as {key} = {example}")))
}

fn one_of(table: &str, key: &str, text: &str, known: &[&str]) -> Result<(), Message> {
    if text.is_empty() {
        return Err(missing(table, key, &format!("\"{}\"", known[0])));
    }
    if known.contains(&text) {
        return Ok(());
    }
    Err(
        Message::bad_input(format!("{table} `{key}`: `{text}` is not known"))
            .remedy(format!("write one of {}", known.join(", "))),
    )
}
