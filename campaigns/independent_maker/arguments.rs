//! The command line.

use std::path::PathBuf;

use crate::design::{Count, Design};

/// From here on seeds are kept for the last run.
pub const FROZEN: u64 = 1000;

/// How to call it.
pub const USAGE: &str = "\
cargo run --release -p errsep-campaigns --bin independent_maker -- [SET] [--cases N] [--seed S] [--from K]
    [--design NAME] [--positions N] [--repeats N] [--one-way] [--only EFFECT[/REALISATION]] [--dump DIR] [--certificate] [--severity N] [--frozen]
SET: one effect a case (default), or --pairs, --withheld, --nulls
--cases N     seeds a realisation; with --pairs, --withheld cases; with --nulls cases a law (4)
--seed S      the first seed; of pairs, withheld and nulls the only one (1)
--from K      first number of a pair, a withheld case or a null (0)
--design      shared, jittered, shifted, thinned, different-grids, uneven, own-positions, three-channels, unequal-repeats
--positions N of a pass (150); --repeats N in each spindle position (4), each forward and
              backward unless --one-way is given
--dump DIR    writes readings and set-up of every case too
--certificate works out of every effect whether the certificate tells it from others
--severity N  rivals of each family for the severity of names (0: left out)
--frozen      allows seeds from 1000 on, which are run once, after thresholds are fixed";

/// What is run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Set {
    /// One effect a case.
    Single,
    /// Two effects a case.
    Pairs,
    /// One effect, withheld from the catalogue.
    Withheld,
    /// Nothing but noise.
    Nulls,
}

/// The arguments.
#[derive(Debug, Clone)]
pub struct Arguments {
    /// What is run.
    pub set: Set,
    /// Seeds a realisation, or cases.
    pub cases: u64,
    /// First seed.
    pub seed: u64,
    /// First number.
    pub from: u64,
    /// Where readings are taken, with its name.
    pub design: (&'static str, Design),
    /// How many readings.
    pub count: Count,
    /// One effect, and perhaps one realisation of it.
    pub only: Option<(String, Option<usize>)>,
    /// Where readings are written to.
    pub dump: Option<PathBuf>,
    /// Whether separability is worked out.
    pub certificate: bool,
    /// Rivals of each family for the severity of names.
    pub severity: usize,
}

impl Arguments {
    /// Reads a command line.
    pub fn read(line: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut read = Self {
            set: Set::Single,
            cases: 4,
            seed: 1,
            from: 0,
            design: Design::ALL[0],
            count: Count::default(),
            only: None,
            dump: None,
            certificate: false,
            severity: 0,
        };
        let mut frozen = false;
        let mut line = line;
        while let Some(word) = line.next() {
            let mut next = || line.next().ok_or_else(|| format!("{word} wants a value"));
            match word.as_str() {
                "--pairs" => read.set = Set::Pairs,
                "--withheld" => read.set = Set::Withheld,
                "--nulls" => read.set = Set::Nulls,
                "--cases" => read.cases = whole(&next()?)?,
                "--seed" => read.seed = whole(&next()?)?,
                "--from" => read.from = whole(&next()?)?,
                "--design" => read.design = design(&next()?)?,
                "--positions" => read.count.positions = whole(&next()?)?.max(3) as usize,
                "--repeats" => read.count.repeats = whole(&next()?)?.clamp(1, 100) as u32,
                "--one-way" => read.count.one_way = true,
                "--only" => read.only = Some(only(&next()?)?),
                "--dump" => read.dump = Some(PathBuf::from(next()?)),
                "--certificate" => read.certificate = true,
                "--severity" => read.severity = whole(&next()?)? as usize,
                "--frozen" => frozen = true,
                other => return Err(format!("{other} is not known")),
            }
        }
        let last = if read.set == Set::Single {
            read.seed.saturating_add(read.cases)
        } else {
            read.seed + 1
        };
        if last > FROZEN && !frozen {
            return Err(format!(
                "seeds from {FROZEN} on are kept for the last run: --frozen allows them"
            ));
        }
        Ok(read)
    }

    /// Whether a realisation is asked for.
    pub fn wants(&self, effect: &str, realisation: usize) -> bool {
        self.only.as_ref().is_none_or(|(name, which)| {
            name == effect && which.is_none_or(|which| which == realisation)
        })
    }
}

fn whole(word: &str) -> Result<u64, String> {
    word.parse()
        .map_err(|_| format!("{word} is no whole number"))
}

fn design(word: &str) -> Result<(&'static str, Design), String> {
    Design::ALL
        .into_iter()
        .find(|(name, _)| *name == word)
        .ok_or_else(|| format!("there is no design {word}"))
}

fn only(word: &str) -> Result<(String, Option<usize>), String> {
    match word.split_once('/') {
        None => Ok((word.to_owned(), None)),
        Some((name, which)) => {
            let which = which
                .parse()
                .map_err(|_| format!("{which} is no realisation"))?;
            Ok((name.to_owned(), Some(which)))
        }
    }
}
