//! A folder for a report, written whole or not at all.
//!
//! Until everything is written nothing has a name (Linux: `O_TMPFILE`; elsewhere the files wait in
//! memory), so that a run that ends early, however it ends, leaves nothing. Then the files are
//! gathered in a folder aside, which takes the place of the final one in a single step: a new folder,
//! with the folders above it, by renaming; an old report by exchanging the two (Linux: `renameat2`).
//! SIGINT and SIGTERM wait for the few system calls that this takes. What SIGKILL leaves between two
//! of them is a folder `.errsep-<process>-<number>` that the next run removes.
//!
//! In place, file by file, is written where the two cannot be exchanged: into the working directory,
//! a mount point, a folder that holds folders or has another owner, and on systems other than Linux.
//! Each file is then old or new as a whole, and `result.json` is the last.

mod belongings;
mod contents;
mod location;
mod signals;
mod single;
mod staged;

use std::ffi::OsStr;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use belongings::RESULT;
use contents::Contents;
use location::{Aside, Location, Lock, sweep};
use signals::Held;
pub use single::OutFile;
use staged::Staged;

use super::provenance::Digested;
use super::{CsvTable, Message};

/// More files than these beside a report are not linked into its new folder.
const MOST_LINKED: usize = 256;

/// How often the folder may change under our hands before we give up.
const ATTEMPTS: usize = 3;

const WRITABLE: &str = "give --out a folder that you may write to";

/// A folder that is filled aside and put in place at the end, or leaves no trace.
pub struct OutFolder {
    place: PathBuf,
    force: bool,
    files: Vec<(String, Staged)>,
    signals_wait: bool,
}

impl OutFolder {
    /// Makes sure, before any work, that results can be written to `place`; `force` allows to replace
    /// what this program did not write.
    ///
    /// # Errors
    /// Nothing can be written there, or a report would replace what this program did not write.
    pub fn reserve(place: &Path, force: bool) -> Result<Self, Message> {
        if place.is_file() {
            return Err(Message::bad_input("is a file, not a folder")
                .in_file(place)
                .remedy(WRITABLE));
        }
        let folder = Self {
            place: place.to_owned(),
            force,
            files: Vec::new(),
            signals_wait: true,
        };
        let location = Location::of(place).map_err(|e| folder.refused(&e))?;
        sweep(&location.there);
        Staged::new(&location.there).map_err(|e| folder.refused(&e))?;
        if location.missing.is_empty() {
            location.there.parent().into_iter().for_each(sweep);
            Contents::of(&location.there, place, &["report.html", RESULT], &[], force)?;
        }
        Ok(folder)
    }

    /// Leaves the signals of the process alone: for a program that handles them itself. Otherwise they
    /// wait while the folder is put in place, and from then on end the program.
    #[must_use]
    pub fn leave_signals(mut self) -> Self {
        self.signals_wait = false;
        self
    }

    /// Where the results will be.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// Writes one file aside.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&mut self, name: &str, content: &[u8]) -> Result<(), Message> {
        self.add(name, |file| file.write_all(content))
    }

    /// Writes one table aside.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_table(&mut self, table: &CsvTable) -> Result<(), Message> {
        self.add(&table.file_name, |file| {
            table.write(file).map_err(io::Error::other)
        })
    }

    fn add(
        &mut self,
        name: &str,
        write: impl FnOnce(&mut Staged) -> io::Result<()>,
    ) -> Result<(), Message> {
        let written = Location::of(&self.place).and_then(|location| {
            let mut file = Staged::new(&location.there)?;
            write(&mut file)?;
            file.flush()?;
            Ok(file)
        });
        match written {
            Ok(file) => {
                self.files.push((name.to_owned(), file));
                Ok(())
            }
            Err(error) => Err(
                Message::bad_input(format!("{name} cannot be written: {error}"))
                    .in_file(&self.place)
                    .remedy("give --out a folder with room that you may write to"),
            ),
        }
    }

    /// The files written so far with their digests, for `result.json`.
    pub fn written(&self) -> Vec<Digested> {
        self.files
            .iter()
            .map(|(name, file)| Digested {
                file: name.clone(),
                sha256: file.digest(),
            })
            .collect()
    }

    /// Puts everything in place; `inputs` are the files that were read, which are not replaced.
    ///
    /// # Errors
    /// Something would be lost that this program did not write; the files cannot be moved.
    pub fn finish(mut self, inputs: &[PathBuf]) -> Result<(), Message> {
        let _held = self.signals_wait.then(Held::new);
        for attempt in 1.. {
            match self.put_in_place(inputs)? {
                Ok(()) => break,
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists && attempt < ATTEMPTS => {}
                Err(e) => return Err(self.refused(&e)),
            }
        }
        Ok(())
    }

    /// Looks at what is there and puts the files beside or in place of it.
    fn put_in_place(&mut self, inputs: &[PathBuf]) -> Result<io::Result<()>, Message> {
        let location = match Location::of(&self.place) {
            Ok(location) => location,
            Err(error) => return Ok(Err(error)),
        };
        let folder = &location.there;
        if !location.missing.is_empty() {
            return Ok(self.make(&location));
        }
        let names: Vec<&str> = self.files.iter().map(|(name, _)| name.as_str()).collect();
        let contents = Contents::of(folder, &self.place, &names, inputs, self.force)?;
        if self.exchange(folder, &contents).is_ok() {
            return Ok(Ok(()));
        }
        Ok(self.write_into(folder, &contents))
    }

    /// Gives every file its name in a folder, `result.json` first: it tells what the others are.
    fn name_all(&mut self, folder: &Path) -> io::Result<()> {
        self.files.sort_by_key(|(name, _)| name != RESULT);
        self.files
            .iter_mut()
            .try_for_each(|(name, file)| file.name(&folder.join(name)))
    }

    /// A folder that is not there yet, with those above it.
    fn make(&mut self, location: &Location) -> io::Result<()> {
        let Some((first, below)) = location.missing.split_first() else {
            return Err(io::ErrorKind::AlreadyExists.into());
        };
        let _lock = Lock::wait(&location.there);
        let aside = Aside::new(&location.there)?;
        let folder = aside.path().join(below.iter().collect::<PathBuf>());
        fs::create_dir_all(&folder)?;
        self.name_all(&folder)?;
        rename_to_new(aside.path(), &location.there.join(first))?;
        aside.leave();
        Ok(())
    }

    /// A folder that is there, in one step.
    fn exchange(&mut self, folder: &Path, contents: &Contents) -> io::Result<()> {
        let parent = folder.parent().ok_or(io::ErrorKind::Unsupported)?;
        let here = std::env::current_dir().and_then(|p| p.canonicalize());
        if contents.has_folders
            || contents.kept.len() > MOST_LINKED
            || here.is_ok_and(|here| here == folder)
        {
            return Err(io::ErrorKind::Unsupported.into());
        }
        let _lock = Lock::wait(parent);
        let aside = Aside::new(parent)?;
        like(aside.path(), folder)?;
        self.name_all(aside.path())?;
        for name in &contents.kept {
            fs::hard_link(folder.join(name), aside.path().join(name))?;
        }
        exchange(aside.path(), folder)?;
        // What came into the folder meanwhile stays there; what is left of the old one goes.
        let known = |name: &OsStr| {
            let mut all = [&contents.replaced, &contents.removed, &contents.kept].into_iter();
            all.any(|list| list.iter().any(|n| n == name))
        };
        for entry in fs::read_dir(aside.path()).into_iter().flatten().flatten() {
            if !known(&entry.file_name()) {
                let _ = rename_to_new(&entry.path(), &folder.join(entry.file_name()));
            }
        }
        Ok(())
    }

    /// A folder that is there, file by file.
    fn write_into(&mut self, folder: &Path, contents: &Contents) -> io::Result<()> {
        let _lock = Lock::wait(folder);
        let aside = Aside::new(folder)?;
        self.name_all(aside.path())?;
        for (name, _) in self.files.iter().rev() {
            fs::rename(aside.path().join(name), folder.join(name))?;
        }
        for name in &contents.removed {
            fs::remove_file(folder.join(name))?;
        }
        Ok(())
    }

    fn refused(&self, error: &io::Error) -> Message {
        Message::bad_input(format!("nothing can be written here: {error}"))
            .in_file(&self.place)
            .remedy(WRITABLE)
    }
}

/// Renames, unless something has the new name already.
fn rename_to_new(from: &Path, to: &Path) -> io::Result<()> {
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        use rustix::io::Errno;
        match renameat_with(CWD, from, CWD, to, RenameFlags::NOREPLACE) {
            // The file system does not know this call.
            Err(Errno::INVAL | Errno::NOSYS) => {}
            done => return done.map_err(io::Error::from),
        }
    }
    if to.symlink_metadata().is_ok() {
        return Err(io::ErrorKind::AlreadyExists.into());
    }
    fs::rename(from, to)
}

/// Exchanges two folders in one step.
#[cfg(target_os = "linux")]
fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE)?)
}

#[cfg(not(target_os = "linux"))]
fn exchange(_one: &Path, _other: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Gives a new folder the permissions of another, which must have the same owner.
#[cfg(unix)]
fn like(new: &Path, old: &Path) -> io::Result<()> {
    use std::os::unix::fs::MetadataExt;
    let (of_new, of_old) = (fs::metadata(new)?, fs::metadata(old)?);
    let owner = |m: &fs::Metadata| (m.uid(), m.gid(), m.dev());
    if owner(&of_new) != owner(&of_old) {
        return Err(io::ErrorKind::Unsupported.into());
    }
    if of_new.mode() != of_old.mode() {
        fs::set_permissions(new, of_old.permissions())?;
    }
    Ok(())
}

#[cfg(not(unix))]
fn like(_new: &Path, _old: &Path) -> io::Result<()> {
    Ok(())
}
