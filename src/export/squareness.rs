//! Squareness of the axes for controllers that shear the coordinates.

use errsep_models::machine::{Component, Kind as ComponentKind};

use super::{Content, Exported, Format, Request, source};
use crate::io::Message;

/// A greater angle is no squareness of a machine, rad.
const GREATEST: f64 = 0.5;

/// The three angles, rad, of the tool against the workpiece; zero where one is not told.
#[derive(Debug, Clone, Copy)]
pub(super) struct Squareness {
    pub a0z: f64,
    pub b0z: f64,
    pub c0y: f64,
}

/// The angles of a result and what is to be told of them, `text` left out.
///
/// # Errors
/// Content of another kind, or without any squareness.
pub(super) fn squareness(
    format: &Format,
    content: &Content,
    request: &Request,
) -> Result<(Squareness, Exported), Message> {
    let unused = [
        "--axis",
        "--unit",
        "--reference",
        "--points or --step",
        "--travel",
    ];
    request.without(format.name, &unused)?;
    let Content::Machine(errors) = content else {
        return Err(source::wrong(format));
    };
    let of = |name: &str| {
        let found = errors
            .squareness
            .iter()
            .find(|(c, _)| c.to_string() == name);
        found.map(|(_, value)| *value)
    };
    let found = [("C0Y", of("C0Y")), ("B0Z", of("B0Z")), ("A0Z", of("A0Z"))];
    if found.iter().all(|(_, value)| value.is_none()) {
        return Err(
            Message::bad_input("the result tells no squareness (C0Y, B0Z, A0Z)").remedy(
                "measure the diagonals of all planes, or give a machine (TOML) that names them",
            ),
        );
    }
    if let Some((name, Some(value))) = found
        .iter()
        .find(|(_, v)| v.is_some_and(|v| v.abs() > GREATEST))
    {
        return Err(
            Message::bad_input(format!("{name} = {value} rad is no squareness error"))
                .remedy("give angles in rad"),
        );
    }
    let mut not_exported = Vec::new();
    for (name, value) in &found {
        if value.is_none() {
            let own = errors.missing.iter().find(|(n, _)| n == name);
            let why = own.map_or("the result does not tell it", |(_, why)| why.as_str());
            not_exported.push(((*name).to_owned(), format!("{why}; written as zero")));
        }
    }
    let functions: Vec<String> = errors
        .functions
        .iter()
        .map(|(c, _): &(Component, _)| c.to_string())
        .collect();
    if !functions.is_empty() {
        let why = "the controller corrects constant angles between axes alone".to_owned();
        not_exported.push((functions.join(", "), why));
    }
    not_exported.push((
        "lost motion".to_owned(),
        "a result of errsep positioning tells it (B)".to_owned(),
    ));
    let told = found.iter().filter(|(_, v)| v.is_some());
    let exported = Exported {
        unit: "rad".to_owned(),
        moves: errors.moves.clone(),
        exported: told.map(|(name, _)| (*name).to_owned()).collect(),
        not_exported,
        verify: "Measure the squareness of one plane again: it must fall to the noise; if it doubles, turn the sign."
            .to_owned(),
        ..Exported::default()
    };
    let [c0y, b0z, a0z] = found.map(|(_, value)| value.unwrap_or(0.0));
    debug_assert!(
        errors
            .squareness
            .iter()
            .all(|(c, _)| c.kind == ComponentKind::Squareness)
    );
    Ok((Squareness { a0z, b0z, c0y }, exported))
}
