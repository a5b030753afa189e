//! A digital calibration certificate: DCC 3.2.1 with D-SI 2.1.0, the version that it imports.
//!
//! S. Hackel et al., *The digital calibration certificate*, PTB-Mitteilungen 127 (2017) 4, 75–81; the schemas are at
//! `https://ptb.de/dcc/v3.2.1/dcc.xsd` and `https://ptb.de/si/v2.1.0/SI_Format.xsd`. D-SI 2.2 keeps the elements of
//! uncertainty that 2.1.0 has (`expandedUnc`, `coverageInterval`) beside those that it adds, so that the certificate is
//! valid with both.

mod admin;
mod document;
mod numbers;
mod results;
mod si;
mod xml;

pub use admin::Admin;
pub use numbers::{Entry, Group, Numbers, Uncertainty};
pub use results::{known, numbers};

use super::{Content, Exported, Format, Kind, Request};
use crate::io::Message;

pub const FORMAT: Format = Format {
    name: "dcc",
    meaning: "digital calibration certificate (DCC 3.2.1, XML), with --admin",
    takes: Kind::Numbers,
    write,
};

fn write(content: &Content, request: &Request) -> Result<Exported, Message> {
    let unused = [
        "--axis",
        "--unit",
        "--reference",
        "--points or --step",
        "--travel",
    ];
    request.without(FORMAT.name, &unused)?;
    let Content::Numbers(numbers) = content else {
        return Err(super::source::wrong(&FORMAT));
    };
    let Some(admin) = &request.admin else {
        return Err(Message::bad_input("dcc needs --admin: laboratory, person, item, customer and dates")
            .remedy("give a TOML file; docs/recipes/calibration-certificate.md explains it, fixtures/dcc/admin.toml is an example"));
    };
    let text = document::document(numbers, admin)?
        .document()
        .map_err(|e| Message::bad_input(format!("the certificate cannot be written: {e}")))?;
    let told = numbers.groups.iter().map(|group| {
        let names: Vec<&str> = group.entries.iter().map(|e| e.name.as_str()).collect();
        format!("{}: {}", group.name, names.join(", "))
    });
    let mut not_exported = numbers.left.clone();
    for group in &numbers.groups {
        let without = group
            .entries
            .iter()
            .filter(|e| e.uncertainty == Uncertainty::None);
        let names: Vec<&str> = without.map(|e| e.name.as_str()).collect();
        if !names.is_empty() {
            let what = format!("uncertainty of {}: {}", group.name, names.join(", "));
            not_exported.push((what, "the result tells none that can be stated".to_owned()));
        }
    }
    Ok(Exported {
        text,
        unit: "D-SI, beside each quantity".to_owned(),
        sign: "Numbers are those of the result, to the last digit; U = k u.".to_owned(),
        exported: told.collect(),
        not_exported,
        rounding: (0.0, "any unit".to_owned()),
        load: vec![
            "sign the certificate: it has no ds:Signature".to_owned(),
        ],
        verify: "Validate it against dcc.xsd 3.2.1 (examples/dcc/validate.sh), and compare it with the report of the result."
            .to_owned(),
        ..Exported::default()
    })
}
