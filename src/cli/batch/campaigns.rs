//! The list of campaigns.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use clap::CommandFactory;
use serde::{Deserialize, Serialize};

use super::selection::Selection;
use crate::cli::Cli;
use crate::io::message::nearest;
use crate::io::source::STANDARD_INPUT;
use crate::io::{Message, Row, TableReader};

/// Commands that are no campaign: they make no answer from data.
const NOT_HERE: [&str; 5] = ["batch", "completions", "export", "man", "help"];
/// Options that the batch itself decides.
const DECIDED: [&str; 5] = ["--out", "--format", "--force", "--quiet", "-q"];

/// One campaign.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Campaign {
    /// Its name, no other's.
    pub id: String,
    /// The arguments of the command, its name first; paths as this process opens them.
    pub arguments: Vec<String>,
    /// The files among them.
    pub files: Vec<PathBuf>,
    /// The rows of a Parquet file that are its data; `files` has their name.
    pub selection: Option<Selection>,
    /// The arguments as the list has them: what they are called does not hang on where the list lies.
    pub as_listed: Vec<String>,
}

/// All campaigns, in the order of the list.
pub(super) struct Campaigns(pub Vec<Campaign>);

impl Campaigns {
    /// Reads a list.
    ///
    /// # Errors
    /// It is no such list: the message says where.
    pub fn read(path: &Path) -> Result<Self, Message> {
        let mut table = TableReader::open(path)?;
        table.only(&["id", "command", "data", "key", "setup", "options"])?;
        let (id, command) = (table.column("id")?, table.column("command")?);
        let (data, setup) = (table.optional("data"), table.optional("setup"));
        let (selects, options) = (table.optional("key"), table.optional("options"));
        let known: Vec<String> = Cli::command()
            .get_subcommands()
            .map(|c| c.get_name().to_owned())
            .filter(|name| !NOT_HERE.contains(&name.as_str()))
            .collect();
        let folder = path.parent().unwrap_or_else(|| Path::new("")).to_owned();
        let mut lines: HashMap<String, usize> = HashMap::new();
        let mut campaigns = Vec::new();
        while let Some(row) = table.next_row()? {
            let text = |column: &Option<_>| column.as_ref().map_or("", |c| row.text(c));
            let name = row.text(&id).to_owned();
            if name.is_empty() {
                return Err(row
                    .error(&id, "the campaign has no id")
                    .remedy("give every campaign an id of its own"));
            }
            if let Some(line) = lines.insert(name.clone(), row.line()) {
                return Err(row
                    .error(&id, format!("id `{name}` stands in line {line} already"))
                    .remedy("give every campaign an id of its own"));
            }
            let word = row.text(&command);
            if !known.iter().any(|k| k == word) {
                let remedy = match nearest(word, known.iter().map(String::as_str)) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => format!("commands are {}", known.join(", ")),
                };
                return Err(row
                    .error(&command, format!("`{word}` is no command for a campaign"))
                    .remedy(remedy));
            }
            let own = words(row, options.as_ref())?;
            let mut campaign = Campaign {
                id: name,
                arguments: Vec::new(),
                files: Vec::new(),
                selection: None,
                as_listed: Vec::new(),
            };
            campaign.word(word);
            for column in [&data, &setup].into_iter().flatten() {
                if row.text(column) == STANDARD_INPUT {
                    return Err(row
                        .error(column, "standard input cannot be shared by campaigns")
                        .remedy("write it to a file, and name that"));
                }
            }
            match selects.as_ref().filter(|c| !row.text(c).is_empty()) {
                Some(key) => campaign
                    .select(&folder, text(&data), row.text(key))
                    .map_err(|(what, remedy)| row.error(key, what).remedy(remedy))?,
                None if !text(&data).is_empty() => campaign.file(&folder, text(&data)),
                None => {}
            }
            if !text(&setup).is_empty() {
                campaign.word("--setup");
                campaign.file(&folder, text(&setup));
            }
            for option in own {
                campaign.word_or_file(&folder, &option);
            }
            campaigns.push(campaign);
        }
        if campaigns.is_empty() {
            return Err(table.no_rows());
        }
        Ok(Self(campaigns))
    }
}

/// The options of a row, word by word as a shell takes them.
fn words(row: Row<'_>, column: Option<&crate::io::Column>) -> Result<Vec<String>, Message> {
    let Some(column) = column else {
        return Ok(Vec::new());
    };
    let words = shlex::split(row.text(column)).ok_or_else(|| {
        row.error(column, "the options have a quote that does not end")
            .remedy("close the quote")
    })?;
    let decided = words.iter().find(|word| {
        let name = word.split('=').next().unwrap_or_default();
        DECIDED.contains(&name)
    });
    match decided {
        Some(word) => Err(row
            .error(column, format!("`{word}` is not for a campaign of a batch"))
            .remedy("leave it out: the batch prints nothing and writes its own folder")),
        None => Ok(words),
    }
}

impl Campaign {
    fn word(&mut self, word: &str) {
        self.arguments.push(word.to_owned());
        self.as_listed.push(word.to_owned());
    }

    fn file(&mut self, folder: &Path, name: &str) {
        let place = folder.join(name);
        self.arguments.push(place.to_string_lossy().into_owned());
        self.as_listed.push(name.to_owned());
        self.files.push(place);
    }

    /// The rows of a Parquet file that a key selects are the data.
    fn select(
        &mut self,
        folder: &Path,
        data: &str,
        key: &str,
    ) -> Result<(), (&'static str, &'static str)> {
        if !cfg!(feature = "parquet") {
            return Err((
                "a key selects rows of a Parquet file, and this errsep was built without Parquet",
                "give every campaign a CSV of its own; or build errsep with it: \
                 cargo install --path . --features parquet",
            ));
        }
        let selection = Selection::of(folder.join(data), key).filter(|_| !data.is_empty());
        let selection = selection.ok_or((
            "a key selects rows of `data`",
            "name a Parquet file in data, and write the key as COLUMN=VALUE, such as campaign=m1",
        ))?;
        self.as_listed.push(format!("{data}[{key}]"));
        let name = selection.name();
        self.arguments.push(name.to_string_lossy().into_owned());
        self.files.push(name);
        self.selection = Some(selection);
        Ok(())
    }

    /// The file on the disk in which one of `files` is.
    pub fn place<'c>(&'c self, file: &'c Path) -> &'c Path {
        match &self.selection {
            Some(selection) if selection.name() == file => &selection.file,
            _ => file,
        }
    }

    /// An option that names a file beside the list stands for that file, `--option=FILE` too.
    fn word_or_file(&mut self, folder: &Path, word: &str) {
        match word.split_once('=') {
            _ if !word.starts_with('-') && folder.join(word).is_file() => self.file(folder, word),
            Some((option, name)) if option.starts_with("--") && folder.join(name).is_file() => {
                self.word(option);
                self.file(folder, name);
            }
            _ => self.word(word),
        }
    }
}
