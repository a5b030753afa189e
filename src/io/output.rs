//! Writing results: CSV tables, and a folder that is written whole or not at all.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::Message;

/// One column of a written table.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Numbers, written so that they read back the same; not-a-number is an empty field.
    Numbers(Vec<f64>),
    /// Text.
    Texts(Vec<String>),
    /// One of a few words a row: the words, and which of them each row has.
    Words(Vec<&'static str>, Vec<u8>),
}

impl Values {
    /// Number of rows.
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(v) => v.len(),
            Self::Texts(v) => v.len(),
            Self::Words(_, v) => v.len(),
        }
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A table to be written as CSV.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CsvTable {
    /// File name, such as `profiles.csv`.
    pub file_name: String,
    /// Column names (with the unit, such as `M_um`) and values.
    pub columns: Vec<(String, Values)>,
}

impl CsvTable {
    /// An empty table.
    pub fn new(file_name: impl Into<String>) -> Self {
        Self {
            file_name: file_name.into(),
            columns: Vec::new(),
        }
    }

    /// Adds a column of numbers.
    #[must_use]
    pub fn numbers(mut self, name: impl Into<String>, values: impl Into<Vec<f64>>) -> Self {
        self.columns
            .push((name.into(), Values::Numbers(values.into())));
        self
    }

    /// Adds a column of text.
    #[must_use]
    pub fn texts(mut self, name: impl Into<String>, values: impl Into<Vec<String>>) -> Self {
        self.columns
            .push((name.into(), Values::Texts(values.into())));
        self
    }

    /// Adds a column of words: which of `words` each row has.
    #[must_use]
    pub fn words(
        mut self,
        name: impl Into<String>,
        words: impl Into<Vec<&'static str>>,
        which: impl Into<Vec<u8>>,
    ) -> Self {
        self.columns
            .push((name.into(), Values::Words(words.into(), which.into())));
        self
    }

    /// Writes the table: UTF-8, LF, comma, decimal point. A shorter column ends in empty fields.
    ///
    /// # Errors
    /// The writer's own.
    pub fn write(&self, writer: impl std::io::Write) -> Result<(), csv::Error> {
        let mut csv = csv::Writer::from_writer(writer);
        csv.write_record(self.columns.iter().map(|(name, _)| name))?;
        let rows = self.columns.iter().map(|(_, v)| v.len()).max().unwrap_or(0);
        for row in 0..rows {
            for (_, values) in &self.columns {
                match values {
                    Values::Numbers(v) => match v.get(row) {
                        Some(x) if !x.is_nan() => csv.write_field(x.to_string())?,
                        _ => csv.write_field("")?,
                    },
                    Values::Words(words, v) => {
                        let word = v.get(row).and_then(|w| words.get(usize::from(*w)));
                        csv.write_field(word.copied().unwrap_or(""))?;
                    }
                    Values::Texts(v) => csv.write_field(v.get(row).map_or("", String::as_str))?,
                }
            }
            csv.write_record(None::<&[u8]>)?;
        }
        csv.flush()?;
        Ok(())
    }
}

/// A folder for results that is filled aside and put in place at the end, or leaves no trace.
#[derive(Debug)]
pub struct OutFolder {
    place: PathBuf,
    aside: TempDir,
    existed: bool,
}

impl OutFolder {
    /// Makes sure, before any work, that results can be written to `place`.
    ///
    /// # Errors
    /// The folder cannot be made or written to.
    pub fn reserve(place: &Path) -> Result<Self, Message> {
        let refuse = |e: std::io::Error| {
            Message::bad_input(format!("nothing can be written here: {e}"))
                .in_file(place)
                .remedy("give --out a folder that you may write to")
        };
        let existed = place.exists();
        if existed && !place.is_dir() {
            return Err(Message::bad_input("is a file, not a folder")
                .in_file(place)
                .remedy("give --out a folder that you may write to"));
        }
        let beside = if existed {
            place.to_owned()
        } else {
            let parent = match place.parent() {
                Some(p) if !p.as_os_str().is_empty() => p.to_owned(),
                _ => PathBuf::from("."),
            };
            fs::create_dir_all(&parent).map_err(refuse)?;
            parent
        };
        let aside = tempfile::Builder::new()
            .prefix(".errsep-")
            .tempdir_in(beside)
            .map_err(refuse)?;
        Ok(Self {
            place: place.to_owned(),
            aside,
            existed,
        })
    }

    /// Where the results will be.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// Writes one file aside.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, name: &str, content: &[u8]) -> Result<(), Message> {
        fs::write(self.aside.path().join(name), content).map_err(|e| self.failed(name, &e))
    }

    /// Writes one table aside.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_table(&self, table: &CsvTable) -> Result<(), Message> {
        let name = &table.file_name;
        let file =
            fs::File::create(self.aside.path().join(name)).map_err(|e| self.failed(name, &e))?;
        table
            .write(std::io::BufWriter::new(file))
            .map_err(|e| self.failed(name, &std::io::Error::other(e)))
    }

    /// Puts everything in place.
    ///
    /// # Errors
    /// The files cannot be moved.
    pub fn finish(self) -> Result<(), Message> {
        let failed = |e: std::io::Error| {
            Message::bad_input(format!("the results cannot be put in place: {e}"))
                .in_file(&self.place)
                .remedy("give --out a folder that you may write to")
        };
        if self.existed {
            for entry in fs::read_dir(self.aside.path()).map_err(failed)? {
                let entry = entry.map_err(failed)?;
                fs::rename(entry.path(), self.place.join(entry.file_name())).map_err(failed)?;
            }
        } else {
            readable_by_others(self.aside.path()).map_err(failed)?;
            fs::rename(self.aside.path(), &self.place).map_err(failed)?;
        }
        Ok(())
    }

    fn failed(&self, name: &str, error: &std::io::Error) -> Message {
        Message::bad_input(format!("{name} cannot be written: {error}"))
            .in_file(&self.place)
            .remedy("give --out a folder with room that you may write to")
    }
}

/// A temporary folder is made for its owner alone; a results folder is an ordinary one.
fn readable_by_others(folder: &Path) -> std::io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        fs::set_permissions(folder, fs::Permissions::from_mode(0o755))?;
    }
    #[cfg(not(unix))]
    let _ = folder;
    Ok(())
}
