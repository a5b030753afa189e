//! A single file, written whole or not at all.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::staged::Staged;
use crate::io::Message;

/// A file that gets its name when it is complete; it replaces nothing unless that was asked for.
pub struct OutFile {
    place: PathBuf,
    replaces: bool,
}

impl OutFile {
    /// Makes sure, before any work, that `place` can be written.
    ///
    /// # Errors
    /// Nothing can be written there, or something is there already.
    pub fn reserve(place: &Path) -> Result<Self, Message> {
        if place.symlink_metadata().is_ok() {
            return Err(Message::bad_input("exists already")
                .in_file(place)
                .remedy("give another name, or remove it first"));
        }
        Self::checked(place, false)
    }

    /// The same for a place where a file may stand, which is then replaced in one step.
    ///
    /// # Errors
    /// Nothing can be written there, or something other than a file is there.
    pub fn replacing(place: &Path) -> Result<Self, Message> {
        if place.symlink_metadata().is_ok_and(|there| !there.is_file()) {
            return Err(Message::bad_input("is there and is no file")
                .in_file(place)
                .remedy("give another name"));
        }
        Self::checked(place, true)
    }

    fn checked(place: &Path, replaces: bool) -> Result<Self, Message> {
        let file = Self {
            place: place.to_owned(),
            replaces,
        };
        Staged::new(file.folder()).map_err(|e| file.unwritable(&e))?;
        Ok(file)
    }

    /// Writes it, and only then gives it its name.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(self, content: &[u8]) -> Result<(), Message> {
        let written = Staged::new(self.folder()).and_then(|mut staged| {
            staged.write_all(content)?;
            if !self.replaces {
                return staged.name(&self.place);
            }
            // Only a name can be exchanged for a name.
            let beside = self
                .folder()
                .join(format!(".errsep-{}.part", std::process::id()));
            staged.name(&beside)?;
            std::fs::rename(&beside, &self.place).inspect_err(|_| {
                let _ = std::fs::remove_file(&beside);
            })
        });
        written.map_err(|e| self.unwritable(&e))
    }

    fn folder(&self) -> &Path {
        match self.place.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        }
    }

    fn unwritable(&self, error: &std::io::Error) -> Message {
        Message::bad_input(format!("cannot be written: {error}"))
            .in_file(&self.place)
            .remedy("give a file in a folder that is there and that you may write to")
    }
}
