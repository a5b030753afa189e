//! Quantities in D-SI: `si:real` and `si:realListXMLList`.

use super::numbers::{Entry, Uncertainty};
use super::xml::Node;
use crate::io::Message;

/// The D-SI element of a quantity or list.
///
/// # Errors
/// A unit without a name in D-SI.
pub fn element(entry: &Entry) -> Result<Node, Message> {
    let unit = unit(&entry.unit)?;
    let values = list(&entry.values);
    let (name, value_name, unit_name) = if entry.list {
        ("si:realListXMLList", "si:valueXMLList", "si:unitXMLList")
    } else {
        ("si:real", "si:value", "si:unit")
    };
    let mut nodes = vec![Node::text(value_name, values), Node::text(unit_name, unit)];
    nodes.extend(uncertainty(entry));
    Ok(Node::with(name, nodes))
}

fn uncertainty(entry: &Entry) -> Option<Node> {
    match &entry.uncertainty {
        Uncertainty::None | Uncertainty::Nominal => None,
        Uncertainty::Expanded {
            expanded,
            factors,
            probability,
            distribution,
        } => {
            let names = if entry.list { &LISTS } else { &SINGLE };
            let mut nodes = vec![
                Node::text(names[1], list(expanded)),
                Node::text(names[2], plain(once(factors))),
                Node::text(names[3], plain(&[*probability])),
            ];
            nodes.extend(distribution.map(|name| Node::text(names[4], name)));
            Some(Node::with(names[0], nodes))
        }
        Uncertainty::Interval {
            standard,
            low,
            high,
            probability,
        } => Some(Node::with(
            "si:coverageInterval",
            [
                Node::text("si:standardUnc", list(&[*standard])),
                Node::text("si:intervalMin", list(&[*low])),
                Node::text("si:intervalMax", list(&[*high])),
                Node::text("si:coverageProbability", plain(&[*probability])),
            ],
        )),
    }
}

const SINGLE: [&str; 5] = [
    "si:expandedUnc",
    "si:uncertainty",
    "si:coverageFactor",
    "si:coverageProbability",
    "si:distribution",
];
const LISTS: [&str; 5] = [
    "si:expandedUncXMLList",
    "si:uncertaintyXMLList",
    "si:coverageFactorXMLList",
    "si:coverageProbabilityXMLList",
    "si:distributionXMLList",
];

/// A list of equal numbers is given by one of them.
fn once(values: &[f64]) -> &[f64] {
    match values {
        [first, rest @ ..] if rest.iter().all(|v| v == first) => &values[..1],
        _ => values,
    }
}

/// Numbers with the digits that JSON has.
fn list(values: &[f64]) -> String {
    joined(values, |v| serde_json::json!(v).to_string())
}

/// Numbers without exponent: the schema has none in factors and probabilities.
fn plain(values: &[f64]) -> String {
    joined(values, |v| v.to_string())
}

fn joined(values: &[f64], text: impl Fn(f64) -> String) -> String {
    let texts: Vec<String> = values.iter().map(|v| text(*v)).collect();
    texts.join(" ")
}

/// Units of results by their names in D-SI.
const UNITS: [(&str, &str); 8] = [
    ("mm", r"\milli\metre"),
    ("um", r"\micro\metre"),
    ("rad", r"\radian"),
    ("deg", r"\degree"),
    ("arcsec", r"\arcsecond"),
    ("um/h", r"\micro\metre\hour\tothe{-1}"),
    ("arcsec/h", r"\arcsecond\hour\tothe{-1}"),
    ("1", r"\one"),
];

fn unit(name: &str) -> Result<&'static str, Message> {
    let found = UNITS.iter().find(|(own, _)| *own == name);
    found.map(|(_, unit)| *unit).ok_or_else(|| {
        Message::bad_input(format!(
            "the result has a number in `{name}`, which a certificate has no unit for"
        ))
        .remedy("run the command that made the result again with this version of errsep")
    })
}
