//! Writing results as CSV tables.

use std::borrow::Cow;

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

    /// Writes the table: UTF-8, LF, comma, decimal point. A shorter column ends in empty fields. A
    /// text that a spreadsheet would work out as a formula begins with an apostrophe.
    ///
    /// # Errors
    /// The writer's own.
    pub fn write(&self, writer: impl std::io::Write) -> Result<(), csv::Error> {
        let mut csv = csv::Writer::from_writer(writer);
        csv.write_record(
            self.columns
                .iter()
                .map(|(name, _)| plain(name).into_owned()),
        )?;
        let rows = self.columns.iter().map(|(_, v)| v.len()).max().unwrap_or(0);
        for row in 0..rows {
            for (_, values) in &self.columns {
                match values {
                    Values::Numbers(v) => match v.get(row) {
                        Some(x) if x.is_finite() => csv.write_field(x.to_string())?,
                        _ => csv.write_field("")?,
                    },
                    Values::Words(words, v) => {
                        let word = v.get(row).and_then(|w| words.get(usize::from(*w)));
                        csv.write_field(word.copied().unwrap_or(""))?;
                    }
                    Values::Texts(v) => {
                        let text = v.get(row).map_or("", String::as_str);
                        csv.write_field(plain(text).as_ref())?;
                    }
                }
            }
            csv.write_record(None::<&[u8]>)?;
        }
        csv.flush()?;
        Ok(())
    }
}

/// A text that no spreadsheet takes for a formula: one that begins like it, and is no number, gets an
/// apostrophe in front.
fn plain(text: &str) -> Cow<'_, str> {
    let begins = text.starts_with(['=', '@', '+', '-', '\t', '\r', '\n']);
    if begins && !text.parse::<f64>().is_ok_and(f64::is_finite) {
        Cow::Owned(format!("'{text}"))
    } else {
        Cow::Borrowed(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_no_formulas() {
        let table = CsvTable::new("t.csv")
            .texts(
                "=1+1",
                ["=cmd|' /C calc'!A0", "@x", "-a", "-1.5"].map(str::to_owned),
            )
            .texts("name", ["+3", "\t=1", "a=b", "+x"].map(str::to_owned))
            .numbers("y", [-1.0, 2.0, f64::NAN, -4e-300]);
        let mut written = Vec::new();
        table.write(&mut written).unwrap();
        let mut read = csv::ReaderBuilder::new()
            .has_headers(false)
            .from_reader(written.as_slice());
        let rows: Vec<Vec<String>> = read
            .records()
            .map(|row| row.unwrap().iter().map(str::to_owned).collect())
            .collect();
        let expected: [[&str; 2]; 5] = [
            ["'=1+1", "name"],
            ["'=cmd|' /C calc'!A0", "+3"],
            ["'@x", "'\t=1"],
            ["'-a", "a=b"],
            ["-1.5", "'+x"],
        ];
        for (row, expected) in rows.iter().zip(expected) {
            assert_eq!(row[..2], expected);
        }
        assert_eq!([&rows[1][2], &rows[3][2]], ["-1", ""]);
    }
}
