//! `errsep export`: a result as the compensation file of a controller, or as a calibration certificate.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde_json::json;

use super::{Answer, CommonArgs, Format};
use crate::export::{self, Admin, Exported, FORMATS, Grid, Kind, Request, Unit};
use crate::io::message::nearest;
use crate::io::provenance::Provenance;
use crate::io::source::begin_record;
use crate::io::{Message, OutFile, Status, printable};
use crate::report::{Page, Section};

/// The compensation file of a controller, or a calibration certificate, from a result, with what it says in a
/// side file.
#[derive(Debug, clap::Args)]
#[command(after_help = formats_help(), after_long_help = formats_help())]
pub struct Args {
    /// Format (below).
    #[arg(value_name = "FORMAT")]
    format_name: String,
    /// The result (result.json, or what --format json printed); a machine (TOML) for the 21 errors.
    #[arg(value_name = "RESULT.json")]
    result: PathBuf,
    /// The file; FILE.about.json beside it says sign, unit and what was left out, FILE.lis is the list in which
    /// isg-volumetric finds it.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Name or number of the axis for the controller; for siemens-cec X:Z, the axis that moves and the one
    /// that corrects.
    #[arg(long, value_name = "AXIS")]
    axis: Option<String>,
    /// Unit of the controller.
    #[arg(long, value_enum, value_name = "mm|inch")]
    unit: Option<UnitName>,
    /// Position where the deviation is to be zero, mm (degrees).
    #[arg(long, value_name = "POS", allow_negative_numbers = true)]
    reference: Option<f64>,
    /// So many evenly spaced points in place of those measured.
    #[arg(long, value_name = "N", conflicts_with = "step")]
    points: Option<usize>,
    /// Evenly spaced points so far apart, mm (degrees).
    #[arg(long, value_name = "MM")]
    step: Option<f64>,
    /// Travel of an axis whose errors are polynomials, such as X=0:500, mm; may be given several times.
    #[arg(long, value_name = "AXIS=FROM:TO", value_parser = parse_travel)]
    travel: Vec<(char, f64, f64)>,
    /// Laboratory, person, item, customer and dates of a certificate (TOML).
    #[arg(long, value_name = "ADMIN.toml")]
    admin: Option<PathBuf>,
    /// Replace the files if they are there.
    #[arg(long)]
    force: bool,
    /// How to print what was written.
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum UnitName {
    /// Millimetre.
    Mm,
    /// Inch.
    Inch,
}

fn formats_help() -> String {
    let mut text = "Formats:\n".to_owned();
    for format in FORMATS {
        text += &format!("  {:23} {}\n", format.name, format.meaning);
    }
    text + "\nExamples: errsep export linuxcnc positioning/result.json --out x.comp\n          \
            errsep export dcc reversal/result.json --admin admin.toml --out certificate.xml"
}

fn parse_travel(text: &str) -> Result<(char, f64, f64), String> {
    let parsed = || {
        let (axis, ends) = text.split_once('=')?;
        let (from, to) = ends.split_once(':')?;
        let (from, to): (f64, f64) = (from.parse().ok()?, to.parse().ok()?);
        let mut letters = axis.chars();
        let letter = letters.next().filter(|l| "XYZ".contains(*l))?;
        (letters.next().is_none() && from < to && (to - from).is_finite())
            .then_some((letter, from, to))
    };
    parsed().ok_or_else(|| "write AXIS=FROM:TO, such as X=0:500".to_owned())
}

impl Args {
    /// As the options that every command has; the folder of a report is none of them here.
    pub(super) fn common(&self) -> CommonArgs {
        CommonArgs {
            format: self.format,
            out: None,
            force: false,
            quiet: false,
            seed: 1,
        }
    }
}

/// Writes the file and what is told of it.
///
/// # Errors
/// An unknown format, a result that it does not take, options that do not fit, files that are there already
/// or cannot be written.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let format = FORMATS
        .into_iter()
        .find(|f| f.name == args.format_name)
        .ok_or_else(|| unknown(&args.format_name))?;
    let finite = [args.reference, args.step]
        .into_iter()
        .flatten()
        .all(f64::is_finite);
    if !finite {
        return Err(
            Message::bad_input("--reference or --step is not finite").remedy("give a number")
        );
    }
    let about_path = beside(&args.out, ".about.json");
    let list_path = beside(&args.out, ".lis");
    if args.admin.is_some() && format.takes != Kind::Numbers {
        return Err(
            Message::bad_input(format!("{} has no use for --admin", format.name))
                .remedy("leave it out"),
        );
    }
    let inputs: Vec<PathBuf> = [Some(&args.result), args.admin.as_ref()]
        .into_iter()
        .flatten()
        .cloned()
        .collect();
    let place = |path: &Path| reserve(path, &inputs, args.force);
    let (file, about_file) = (place(&args.out)?, place(&about_path)?);
    // The side file names the result by its digest, however the answer is printed.
    begin_record(true);
    let loaded = export::read(&args.result)?;
    let content = loaded
        .content(format)
        .map_err(|message| message.in_file(&args.result))?;
    let exported = (format.write)(content, &request(args)?)?;
    let list = match &exported.list {
        Some(text) => Some((place(&list_path)?, text)),
        None => None,
    };
    let mut about = exported.about(format.name);
    about["list"] = json!(list.as_ref().map(|_| list_path.display().to_string()));
    let provenance = Provenance::of(&[], inputs.iter().map(PathBuf::as_path), None)?;
    let provenance = serde_json::to_value(&provenance).map_err(|e| unwritable(&e))?;
    about["result"] = json!({"schema": loaded.schema, "sha256": provenance["inputs"][0]["sha256"]});
    let pretty = serde_json::to_string_pretty(&about).map_err(|e| unwritable(&e))?;
    about_file.write((printable::json(&pretty) + "\n").as_bytes())?;
    // Without its file the side file and the list tell of nothing.
    if let Some((place, text)) = list
        && let Err(message) = place.write(text.as_bytes())
    {
        let _ = std::fs::remove_file(&about_path);
        return Err(message);
    }
    if let Err(message) = file.write(exported.text.as_bytes()) {
        let _ = std::fs::remove_file(&about_path);
        if exported.list.is_some() {
            let _ = std::fs::remove_file(&list_path);
        }
        return Err(message);
    }
    let text = in_words(args, format.name, &exported, &about_path);
    Ok(Answer {
        page: Page::new("Export", format.name)
            .section(Section::new("Written").verbatim(text.as_str())),
        text,
        json: about,
        tables: Vec::new(),
        setup: None,
        inputs,
        seed: None,
        status: Status::Done,
    })
}

fn unwritable(error: &serde_json::Error) -> Message {
    Message::bad_input(format!("the side file cannot be written: {error}"))
}

fn request(args: &Args) -> Result<Request, Message> {
    Ok(Request {
        axis: args.axis.clone(),
        unit: args.unit.map(|unit| match unit {
            UnitName::Mm => Unit::Mm,
            UnitName::Inch => Unit::Inch,
        }),
        reference: args.reference,
        grid: match (args.points, args.step) {
            (Some(n), _) => Some(Grid::Points(n)),
            (None, Some(step)) => Some(Grid::Step(step)),
            (None, None) => None,
        },
        travel: args.travel.clone(),
        file_name: args
            .out
            .file_name()
            .map(|name| name.to_string_lossy().into_owned())
            .unwrap_or_default(),
        admin: args.admin.as_deref().map(Admin::read).transpose()?,
    })
}

/// `FILE.about.json` and `FILE.lis`.
fn beside(file: &Path, ending: &str) -> PathBuf {
    let mut name: OsString = file.as_os_str().to_owned();
    name.push(ending);
    name.into()
}

fn reserve(path: &Path, inputs: &[PathBuf], force: bool) -> Result<OutFile, Message> {
    if !force {
        return OutFile::reserve(path);
    }
    let same = |a: &Path, b: &Path| match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    };
    if let Some(place) = inputs.iter().position(|input| same(path, input)) {
        let what = [
            "is the result that is to be exported",
            "is the file of --admin",
        ][place.min(1)];
        return Err(Message::bad_input(what)
            .in_file(path)
            .remedy("give another name as --out"));
    }
    OutFile::replacing(path)
}

fn unknown(name: &str) -> Message {
    let known: Vec<&str> = FORMATS.iter().map(|f| f.name).collect();
    Message::bad_input(format!("there is no format `{name}`")).remedy(
        match nearest(name, known.iter().copied()) {
            Some(near) => format!("did you mean `{near}`? There are {}", known.join(", ")),
            None => format!("there are {}", known.join(", ")),
        },
    )
}

fn in_words(args: &Args, format: &str, exported: &Exported, about: &Path) -> String {
    let mut text = format!(
        "Written {format}: {} ({})\n  exported    {}\n",
        args.out.display(),
        exported.unit,
        exported.exported.join(", ")
    );
    if exported.list.is_some() {
        text += &format!("  list        {}\n", beside(&args.out, ".lis").display());
    }
    for (name, why) in &exported.not_exported {
        text += &format!("  left out    {name}: {why}\n");
    }
    text += &format!("  sign        {}\n", exported.sign);
    let cost = export::in_words(&exported.missed, &exported.known, exported.position_unit);
    for sentence in cost {
        text += &format!("  points      {sentence}\n");
    }
    for step in &exported.load {
        text += &format!("  load        {step}\n");
    }
    text + &format!(
        "  verify      {}\nAll this stands in {}\n",
        exported.verify,
        about.display()
    )
}
