//! A written file that has no name yet: a run that is killed leaves nothing of it.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

use sha2::{Digest, Sha256};

use crate::io::source::hexadecimal;

/// A file that is being written or waits for its place.
pub(super) struct Staged {
    content: Content,
    hash: Sha256,
}

enum Content {
    /// A file without a name: it goes with the process.
    #[cfg(target_os = "linux")]
    Nameless(io::BufWriter<File>),
    /// Where the file system has no nameless files.
    Memory(Vec<u8>),
}

impl Staged {
    /// A file that will be put into a folder of the same file system as `beside`.
    ///
    /// # Errors
    /// Nothing can be written there.
    pub fn new(beside: &Path) -> io::Result<Self> {
        Ok(Self {
            content: nameless(beside)?,
            hash: Sha256::new(),
        })
    }

    /// Gives it a name; it may have several.
    ///
    /// # Errors
    /// The system's own.
    pub fn name(&mut self, path: &Path) -> io::Result<()> {
        match &mut self.content {
            #[cfg(target_os = "linux")]
            Content::Nameless(writer) => {
                writer.flush()?;
                link(writer.get_mut(), path)
            }
            Content::Memory(bytes) => std::fs::write(path, bytes),
        }
    }

    /// The digest of what has been written.
    pub fn digest(&self) -> String {
        hexadecimal(self.hash.clone())
    }
}

impl Write for Staged {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = match &mut self.content {
            #[cfg(target_os = "linux")]
            Content::Nameless(writer) => writer.write(bytes)?,
            Content::Memory(memory) => memory.write(bytes)?,
        };
        self.hash.update(&bytes[..n]);
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.content {
            #[cfg(target_os = "linux")]
            Content::Nameless(writer) => writer.flush(),
            Content::Memory(_) => Ok(()),
        }
    }
}

#[cfg(target_os = "linux")]
fn nameless(beside: &Path) -> io::Result<Content> {
    use rustix::fs::{Access, CWD, Mode, OFlags, access, openat};
    use rustix::io::Errno;
    let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
    match openat(CWD, beside, flags, Mode::from_raw_mode(0o666)) {
        Ok(file) => Ok(Content::Nameless(io::BufWriter::new(File::from(file)))),
        // The file system, or the kernel, has none.
        Err(Errno::OPNOTSUPP | Errno::ISDIR | Errno::INVAL) => {
            access(beside, Access::WRITE_OK | Access::EXEC_OK)?;
            Ok(Content::Memory(Vec::new()))
        }
        Err(error) => Err(error.into()),
    }
}

#[cfg(not(target_os = "linux"))]
fn nameless(beside: &Path) -> io::Result<Content> {
    if std::fs::metadata(beside)?.permissions().readonly() {
        return Err(io::ErrorKind::PermissionDenied.into());
    }
    Ok(Content::Memory(Vec::new()))
}

/// Names a nameless file; where `/proc` is not there, copies it.
#[cfg(target_os = "linux")]
fn link(file: &mut File, path: &Path) -> io::Result<()> {
    use rustix::fs::{AtFlags, CWD, linkat};
    use std::io::Seek;
    use std::os::fd::AsRawFd;
    let itself = format!("/proc/self/fd/{}", file.as_raw_fd());
    if linkat(CWD, itself, CWD, path, AtFlags::SYMLINK_FOLLOW).is_ok() {
        return Ok(());
    }
    file.rewind()?;
    io::copy(file, &mut File::create_new(path)?).map(drop)
}
