//! What becomes of each thing that a folder already holds.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::{Path, PathBuf};

use super::belongings::{Report, Whose};
use crate::io::Message;

/// What a folder holds, by what becomes of it when a report is put there.
#[derive(Debug, Default)]
pub(super) struct Contents {
    /// Takes a file of the new report in its place.
    pub replaced: Vec<OsString>,
    /// Belongs to the old report and goes with it.
    pub removed: Vec<OsString>,
    /// Has nothing to do with reports.
    pub kept: Vec<OsString>,
    /// Whether a folder is among what is kept.
    pub has_folders: bool,
}

/// Why something may not be replaced or removed.
struct Objection {
    name: OsString,
    why: &'static str,
}

const ANOTHER_FOLDER: &str = "give --out another folder, or --force to replace what is there";

impl Contents {
    /// Sorts what `folder` holds for a report with the files `names`; `inputs` are the files that
    /// were read.
    ///
    /// # Errors
    /// The folder cannot be read; without `force`, something would be lost that this program did not
    /// write or that it has just read.
    pub fn of(
        folder: &Path,
        given: &Path,
        names: &[&str],
        inputs: &[PathBuf],
        force: bool,
    ) -> Result<Self, Message> {
        let unreadable = |e: std::io::Error| {
            Message::bad_input(format!("the folder cannot be read: {e}"))
                .in_file(given)
                .remedy("give --out a folder that you may read and write")
        };
        let inputs: Vec<PathBuf> = inputs.iter().flat_map(|i| i.canonicalize()).collect();
        let report = Report::of(folder);
        let mut contents = Self::default();
        let mut objections = Vec::new();
        for entry in fs::read_dir(folder).map_err(unreadable)? {
            let entry = entry.map_err(unreadable)?;
            let name = entry.file_name();
            let is_folder = entry.file_type().map_err(unreadable)?.is_dir();
            let is_new = names.iter().any(|n| name == OsStr::new(n));
            if is_new && is_folder {
                return Err(Message::bad_input(
                    "is a folder, and the report has a file of that name",
                )
                .in_file(&given.join(&name))
                .remedy("give --out another folder"));
            }
            let is_input = || {
                let path = entry.path().canonicalize();
                path.is_ok_and(|path| inputs.contains(&path))
            };
            let whose = match name.to_str() {
                Some(name) if !is_folder => report.whose(folder, name),
                _ => Whose::Foreign,
            };
            let why = match (is_new, whose) {
                (false, Whose::Foreign | Whose::Changed) => None,
                _ if is_input() => Some("is an input of this run"),
                (_, Whose::Ours) => None,
                (true, Whose::Changed) => Some("was changed since errsep wrote it"),
                (true, Whose::Foreign) => Some("was not written by errsep"),
            };
            let stays = !is_new && (whose != Whose::Ours || why.is_some());
            if let Some(why) = why {
                let name = name.clone();
                objections.push(Objection { name, why });
            }
            contents.has_folders |= is_folder && stays;
            let list = match (is_new, stays) {
                (true, _) => &mut contents.replaced,
                (false, true) => &mut contents.kept,
                (false, false) => &mut contents.removed,
            };
            list.push(name);
        }
        if force || objections.is_empty() {
            return Ok(contents);
        }
        objections.sort_by(|a, b| a.name.cmp(&b.name));
        let more = match objections.len() {
            1 => String::new(),
            n => format!(" (and {} more)", n - 1),
        };
        let first = &objections[0];
        Err(Message::bad_input(format!(
            "{}, and the report would take its place{more}",
            first.why
        ))
        .in_file(&given.join(&first.name))
        .remedy(ANOTHER_FOLDER))
    }
}
