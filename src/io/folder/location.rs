//! Where a folder is or will be, whoever else is at work there, and what a killed run left.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// How the names of folders begin that are being filled.
const ASIDE: &str = ".errsep-";

/// A folder that is there, or the names that are still to be made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Location {
    /// The deepest folder that is there, without links.
    pub there: PathBuf,
    /// Names below it that are not there yet.
    pub missing: Vec<OsString>,
}

impl Location {
    /// Finds a folder.
    ///
    /// # Errors
    /// Something on the way is no folder, or a link leads nowhere.
    pub fn of(place: &Path) -> io::Result<Self> {
        let mut there = std::path::absolute(place)?;
        let mut missing = Vec::new();
        while !there.exists() {
            let name = there.file_name().map(OsString::from);
            if there.symlink_metadata().is_ok() {
                return Err(io::Error::other("the link leads nowhere"));
            }
            missing.push(name.ok_or(io::ErrorKind::NotFound)?);
            if !there.pop() {
                return Err(io::ErrorKind::NotFound.into());
            }
        }
        if !there.is_dir() {
            return Err(io::ErrorKind::NotADirectory.into());
        }
        missing.reverse();
        Ok(Self {
            there: there.canonicalize()?,
            missing,
        })
    }
}

/// The right to put folders in place within one folder; other runs of this program wait for it.
pub(super) struct Lock {
    _folder: Option<File>,
}

impl Lock {
    /// Waits for the right. Where the file system has no locks there is nothing to wait for.
    pub fn wait(folder: &Path) -> Self {
        let file = File::open(folder).ok();
        Self {
            _folder: file.filter(|f| f.lock().is_ok()),
        }
    }

    /// Takes the right if nobody has it.
    fn at_once(folder: &Path) -> Option<Self> {
        let file = File::open(folder).ok()?;
        file.try_lock().ok()?;
        Some(Self {
            _folder: Some(file),
        })
    }
}

/// A folder beside the final one, that goes when it is dropped.
pub(super) struct Aside {
    path: PathBuf,
}

impl Aside {
    /// Makes one; the caller holds the lock of `beside`.
    ///
    /// # Errors
    /// The system's own.
    pub fn new(beside: &Path) -> io::Result<Self> {
        let process = std::process::id();
        let mut last = io::ErrorKind::AlreadyExists.into();
        for number in 0..100 {
            let path = beside.join(format!("{ASIDE}{process}-{number}"));
            match fs::create_dir(&path) {
                Ok(()) => return Ok(Self { path }),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => last = error,
                Err(error) => return Err(error),
            }
        }
        Err(last)
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Keeps what is there, under whatever name it has now.
    pub fn leave(mut self) {
        self.path.clear();
    }
}

impl Drop for Aside {
    fn drop(&mut self) {
        if !self.path.as_os_str().is_empty() {
            // What cannot be removed now is swept by a later run.
            let _ = fs::remove_dir_all(&self.path);
        }
    }
}

/// Removes what killed runs left in a folder, unless another run is at work there.
pub(super) fn sweep(folder: &Path) {
    let is_left = |name: &str| {
        let mut parts = name
            .strip_prefix(ASIDE)
            .into_iter()
            .flat_map(|n| n.split('-'));
        let mut number = || parts.next().is_some_and(|n| n.parse::<u32>().is_ok());
        number() && number() && parts.next().is_none()
    };
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    let left: Vec<PathBuf> = entries
        .flatten()
        .filter(|e| e.file_name().to_str().is_some_and(is_left))
        .filter(|e| e.file_type().is_ok_and(|t| t.is_dir()))
        .map(|e| e.path())
        .collect();
    if left.is_empty() {
        return;
    }
    if let Some(_lock) = Lock::at_once(folder) {
        for path in left {
            let _ = fs::remove_dir_all(path);
        }
    }
}
