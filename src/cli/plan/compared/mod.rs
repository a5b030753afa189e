//! Designs that a plan compares, side by side.

mod file;
mod told;

use file::{File, common, designs};
use told::{json, page, text};

use super::Args;
use super::designs::{promise, told_apart};
use crate::cli::{Answer, progress};
use crate::io::{Message, SetupFile, Status};

/// Whether a plan names designs.
///
/// # Errors
/// The file is no TOML.
pub(super) fn is_asked(setup: &SetupFile) -> Result<bool, Message> {
    let top: toml::Table = setup.parse()?;
    Ok(top.contains_key("design") || top.contains_key("channels"))
}

/// Compares the designs of a plan.
///
/// # Errors
/// The plan is bad, or a design cannot be fitted or diagnosed.
pub(super) fn run(args: &Args, setup: &SetupFile) -> Result<Answer, Message> {
    let file: File = setup.parse()?;
    let plan = common(setup, &file, args.common.seed)?;
    let designs = designs(setup, &file)?;
    let bar = progress("planning", Some(designs.len() as u64));
    let promises = designs
        .into_iter()
        .map(|(name, design)| {
            let own = promise(name, &design, &plan).map_err(|m| m.in_file(&args.plan));
            bar.inc(1);
            own
        })
        .collect::<Result<Vec<_>, Message>>()?;
    bar.finish_and_clear();
    let told = told_apart(&promises);
    Ok(Answer {
        text: text(&promises, &told),
        json: json(&promises, &told, &plan),
        page: args.common.page(|| page(args, &promises, &told)),
        tables: Vec::new(),
        inputs: vec![args.plan.clone()],
        setup: None,
        seed: Some(args.common.seed),
        status: Status::Done,
    })
}
