//! What a further measurement is expected to show, written before it is made (`--seal`).
//!
//! The first line of the file is the SHA-256 of all that follows.

use std::io::Read;
use std::path::{Path, PathBuf};

use errsep_models::model::AnyModel;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use super::Args;
use super::case::{Said, catalogue};
use super::joined::Given;
use super::learnt::today;
use super::recognise;
use super::words::{number, shown};
use crate::cli::{ColumnArgs, progress};
use crate::diagnosis::{
    Diagnosis, Interval, Kind, NotSealed, Options, Sealed, SealedNumber, for_people, sealed,
};
use crate::io::provenance::Digested;
use crate::io::source::{InMemory, Read256, Source, digest_of, hexadecimal, hold};
use crate::io::{ColumnMap, Message, OutFile, SetupFile, TableReader};

/// `schema` of the file.
const SCHEMA: &str = "errsep.seal/1";

/// The file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SealFile {
    schema: String,
    /// Name of the model, as `--model` takes it.
    pub model: String,
    /// Version of the program.
    pub version: String,
    /// The day on which it was sealed.
    pub date: String,
    /// The verdict's sentence.
    pub statement: String,
    /// The set-up's text, where there was one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub setup: Option<String>,
    /// The text of the user's own effects, where there were any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub effects: Option<String>,
    /// Names and units of the columns, where they were given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    columns: Option<String>,
    /// The readings that it rests on.
    pub data: Digested,
    /// The plan.
    pub plan: Digested,
    /// What is expected.
    pub expected: Sealed,
    /// The digest in the file's first line.
    #[serde(skip)]
    pub sha256: String,
}

impl SealFile {
    /// The text of the file and its digest.
    fn text(&self) -> Result<(String, String), Message> {
        let body = toml::to_string(self)
            .map_err(|e| Message::bad_input(format!("what is expected cannot be written: {e}")))?;
        let body = format!(
            "# What a further measurement is expected to show. To score it: errsep check THIS_FILE NEW.csv\n# The line above is the SHA-256 of everything below it; keep it where nobody can change it.\n{body}"
        );
        let digest = digest(body.as_bytes());
        Ok((format!("{}{body}", first_line(&digest)), digest))
    }

    /// How the columns of the readings are called.
    ///
    /// # Errors
    /// The seal was made by a version that knew more of columns.
    pub fn columns(&self) -> Result<ColumnArgs, Message> {
        let Some(text) = &self.columns else {
            return Ok(ColumnArgs::default());
        };
        let map = text.parse().map_err(|why: String| {
            Message::bad_input(format!("the columns of the seal are not understood: {why}"))
                .remedy("score it with the version of errsep that sealed it")
        })?;
        Ok(ColumnArgs::of(map))
    }

    /// Reads a file whose digest holds.
    ///
    /// # Errors
    /// It cannot be read, its digest does not hold, or it is none.
    pub fn read(place: &Path) -> Result<Self, Message> {
        let text = text_of(place)?;
        let broken = |what: &str| {
            Message::bad_input(what)
                .in_file(place)
                .remedy("get the file as it was sealed: a prediction that was touched is none")
        };
        let (first, body) = text
            .split_once('\n')
            .filter(|(first, _)| first.starts_with("sha256 = "))
            .ok_or_else(|| broken("the file does not begin with the digest of a seal"))?;
        let digest = digest(body.as_bytes());
        if format!("{first}\n") != first_line(&digest) {
            return Err(broken(
                "the seal is broken: the digest in its first line is not that of the rest",
            ));
        }
        let mut seal: Self = toml::from_str(body).map_err(|e| {
            broken(&format!(
                "the seal holds, but it cannot be understood: {}",
                e.message()
            ))
        })?;
        if seal.schema != SCHEMA {
            return Err(broken(&format!(
                "the seal is `{}`, not `{SCHEMA}`",
                seal.schema
            )));
        }
        seal.sha256 = digest;
        Ok(seal)
    }
}

fn digest(bytes: &[u8]) -> String {
    hexadecimal(Sha256::new_with_prefix(bytes))
}

fn first_line(digest: &str) -> String {
    format!("sha256 = \"{digest}\"\n")
}

fn text_of(place: &Path) -> Result<String, Message> {
    let mut bytes = Vec::new();
    let read = Source::open(place).and_then(|mut source| source.read_to_end(&mut bytes));
    read.map_err(|e| {
        Message::bad_input(format!("the file cannot be read: {e}"))
            .in_file(place)
            .remedy("give a readable file")
    })?;
    String::from_utf8(bytes).map_err(|_| {
        Message::bad_input("the file is not text")
            .in_file(place)
            .remedy("save it as plain text (UTF-8)")
    })
}

/// A seal that is begun: its file can be written, its plan is read.
pub(super) struct Seal {
    place: PathBuf,
    file: OutFile,
    plan: AnyModel,
    planned: Digested,
}

impl Seal {
    /// Begins a seal where one is asked for.
    ///
    /// # Errors
    /// The file cannot be written, the plan is bad, or the model cannot be sealed.
    pub fn begun(
        args: &Args,
        plan: impl Fn(&Args) -> Option<Result<AnyModel, Message>>,
    ) -> Result<Option<Self>, Message> {
        let (Some(place), Some(next)) = (&args.seal, &args.next) else {
            return Ok(None);
        };
        let file = OutFile::reserve(place)?;
        let model = recognise::model(args)?;
        let refused = || {
            Message::not_determined(format!("a {} cannot be sealed: what a plan without readings would show of it is not known", model.name))
                .in_file(&args.data)
                .remedy("seal a reversal or a calibration line; others are compared by --learn and --effects")
        };
        let column = model.reading.ok_or_else(refused)?;
        let held = with_readings(next, &column_of(args, column)?, &args.columns.map())?;
        let Read256::Digest(sha256) = digest_of(next) else {
            return Err(Message::bad_input("the plan changed while it was read")
                .in_file(next)
                .remedy("run the command again when nothing writes to the file"));
        };
        let given = Given {
            setup: args.setup.as_deref(),
            columns: args.columns.clone(),
            ..Given::to(model.name, &held, &[], &args.common)
        };
        let plan = plan(&given.args()).ok_or_else(refused)??;
        Ok(Some(Self {
            place: place.clone(),
            file,
            plan,
            planned: Digested {
                file: next.display().to_string(),
                sha256,
            },
        }))
    }

    /// Works out what is expected and writes it; what is said of it, in words and as JSON.
    ///
    /// # Errors
    /// Nothing explains the gap, or what is planned does not follow from the readings.
    pub fn written(
        self,
        model: &AnyModel,
        args: &Args,
        diagnosis: &Diagnosis,
        options: &Options,
    ) -> Result<Said, Message> {
        if diagnosis.verdict.kind == Kind::Unknown {
            return Err(Message::not_determined(
                "nothing explains the gap, so a further measurement cannot be predicted",
            )
            .in_file(&args.data)
            .remedy("learn the gap with --learn FILE and seal it with --effects FILE, or leave --seal out"));
        }
        let names = &diagnosis.verdict.effects;
        let bar = progress("sealing", None);
        let expected = sealed(model, &self.plan, catalogue(args, model)?, names, options);
        bar.finish_and_clear();
        let expected = expected.map_err(|why| refused(&why, args, &self.planned.file))?;
        let Read256::Digest(sha256) = digest_of(&args.data) else {
            return Err(Message::bad_input("the file changed while it was read")
                .in_file(&args.data)
                .remedy("run the command again when nothing writes to the file"));
        };
        let text = |place: &Option<PathBuf>| place.as_deref().map(text_of).transpose();
        let file = SealFile {
            schema: SCHEMA.to_owned(),
            model: recognise::model(args)?.name.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            date: today(),
            statement: diagnosis.verdict.statement.clone(),
            setup: text(&args.setup)?,
            effects: text(&args.effects)?,
            columns: args
                .columns
                .are_given()
                .then(|| args.columns.map().to_string()),
            data: Digested {
                file: args.data.display().to_string(),
                sha256,
            },
            plan: self.planned,
            expected,
            sha256: String::new(),
        };
        let (text, sha256) = file.text()?;
        self.file.write(text.as_bytes())?;
        let place = self.place.display().to_string();
        let words = in_words(&file.expected, &place, &sha256);
        Ok((words, told(&file.expected, &place, &sha256)))
    }
}

/// The name that options or a set-up give the column of the readings, or its usual one.
fn column_of(args: &Args, usual: &str) -> Result<String, Message> {
    if args.columns.are_given() {
        let map = args.columns.map();
        return Ok(map.column_of(usual).unwrap_or(usual).to_owned());
    }
    let Some(setup) = &args.setup else {
        return Ok(usual.to_owned());
    };
    let top: toml::Table = SetupFile::read(setup)?.parse()?;
    let own = top.get("columns").and_then(|columns| columns.get(usual));
    let own = own.and_then(toml::Value::as_str);
    let name = own.map_or(usual, |own| {
        own.rsplit_once(':').map_or(own, |(name, _)| name)
    });
    Ok(name.to_owned())
}

/// Holds the plan with readings of zero in memory; the name under which it is held.
fn with_readings(place: &Path, column: &str, map: &ColumnMap) -> Result<PathBuf, Message> {
    let table = TableReader::open(place)?;
    let there =
        |(bare, written): (&str, &str)| written == column || (map.is_empty() && bare == column);
    if let Some(index) = table.bare_names().zip(table.names()).position(there) {
        return Err(table
            .in_header(index, format!("the plan has readings (`{column}`) already"))
            .remedy("leave that column out: a seal is written before the measurement"));
    }
    let delimiter = char::from(table.dialect().delimiter.byte());
    let text = text_of(place)?;
    let mut heading = true;
    let line = |line: &str| {
        let bare = line.trim_end_matches(['\n', '\r']);
        if bare.trim().is_empty() || bare.trim_start_matches('\u{feff}').starts_with('#') {
            return format!("{bare}\n");
        }
        let last = if std::mem::take(&mut heading) {
            column
        } else {
            "0"
        };
        format!("{bare}{delimiter}{last}\n")
    };
    let ends = if text.contains('\n') { '\n' } else { '\r' };
    let whole: String = text.split_inclusive(ends).map(line).collect();
    let name = format!("{} (plan)", place.display());
    hold(InMemory {
        name: name.clone(),
        bytes: whole.into_bytes().into(),
    });
    Ok(PathBuf::from(name))
}

fn refused(why: &NotSealed, args: &Args, plan: &str) -> Message {
    let place = Path::new(plan);
    match why {
        NotSealed::NoChannel(_) => Message::bad_input(why.to_string())
            .in_file(place)
            .remedy("plan only channels that were read"),
        NotSealed::Beyond { .. } => Message::bad_input(why.to_string())
            .in_file(place)
            .remedy("plan positions within those that were read"),
        NotSealed::DoneAnew(_) => Message::not_determined(why.to_string())
            .in_file(&args.data)
            .remedy("leave --seal out, and measure again once the cause is removed"),
        NotSealed::NotCarried(_) | NotSealed::NotJoined(_) | NotSealed::Undetermined => {
            Message::not_determined(why.to_string())
                .in_file(&args.data)
                .remedy("leave --seal out, or measure more repeats first")
        }
    }
}

/// Value and interval in the unit they are shown in.
pub(in crate::cli) fn interval(value: f64, ends: [f64; 2], unit: &str) -> String {
    let (value, shown_unit) = shown(value, unit);
    let [low, high] = ends.map(|end| number(shown(end, unit).0));
    format!("{} [{low}, {high}] {shown_unit}", number(value))
        .trim_end()
        .to_owned()
}

fn in_words(expected: &Sealed, place: &str, sha256: &str) -> String {
    let mut text = format!(
        "\nSealed in {place}, SHA-256 {sha256}. A further measurement is expected to find (95 %):\n"
    );
    let line = |name: String, n: &SealedNumber| {
        format!("  {name:<32} {}\n", interval(n.value, n.found95, &n.unit))
    };
    for effect in &expected.effect {
        for n in &effect.parameter {
            text += &line(format!("{} {}", effect.name, n.name), n);
        }
    }
    for n in &expected.quantity {
        text += &line(n.name.clone(), n);
    }
    let unit = for_people(&expected.unit);
    let gap = |what: &str, gap: &Interval| {
        format!("  {what:<32} {}\n", interval(gap.rms, gap.ci95, unit))
    };
    if expected.effect.is_empty() {
        text += &gap("gap, RMS", &expected.gap.with);
    } else {
        text += &gap("gap without the cause, RMS", &expected.gap.without);
        text += &gap("gap with the cause, RMS", &expected.gap.with);
    }
    let readings: usize = expected.trace.iter().map(|t| t.x.len()).sum();
    text += &format!(
        "  and {readings} readings, each with its band.\nKeep the digest where nobody can change it. To score the measurement: errsep check {place} NEW.csv\n"
    );
    text
}

fn told(expected: &Sealed, place: &str, sha256: &str) -> Value {
    let effects: Vec<Value> = (expected.effect.iter())
        .map(|e| json!({"effect": e.name, "variant": e.variant, "parameters": e.parameter}))
        .collect();
    json!({
        "file": place,
        "sha256": sha256,
        "effects": effects,
        "quantities": expected.quantity,
        "gap": {"unit": expected.unit, "without": expected.gap.without, "with": expected.gap.with},
        "readings": expected.trace.iter().map(|t| t.x.len()).sum::<usize>(),
    })
}
