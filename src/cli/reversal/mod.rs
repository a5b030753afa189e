//! `errsep reversal`: from the readings of a reversal to tilts and forms with their uncertainty.

mod designs;
mod diagnosed;
mod effects;
mod json;
mod noise;
mod outcome;
mod page;
mod refusal;
mod simultaneous;
mod staged;
mod tables;
mod text;

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::ValueEnum;
use errsep_models::reversal::Channel;
use errsep_models::reversal::simultaneous::Simultaneous;
use errsep_models::reversal::staged::{Removal, moved};
use serde_json::Value;

use super::{Answer, ColumnArgs, CommonArgs};
use crate::io::reversal::{Readings, ReversalData, ReversalSetup, read_any};
use crate::io::{Message, OutFile, Status};
pub use designs::options as design_options;
use diagnosed::Diagnosed;
use outcome::Outcome;

/// Reversal: the tilt between slide and spindle, the form of the slide and of the artefact.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
DATA.csv has one row a reading (channel,x,reading; also repeat,direction,time) or one column a
channel (x,1A,1B,2A,2B). Channels: 1A near indicator at 0 degrees, 1B far at 0, 2A far at 180,
2B near at 180. x in mm, readings in um, positive towards the indicator. Any of the channels may be
left out: the answer says what the rest determines. Other designs (both planes, every 90 degrees, any
number of indicators): columns indicator and spindle (degrees) in place of channel, or the angles of each
channel in [channels] of the set-up, such as 4D = { indicator = 270, spindle = 90 }; the answer is always
the simultaneous solution then.

Examples:
    errsep reversal data.csv
    errsep reversal data.csv --setup setup.toml --simultaneous --out report
    errsep reversal eight.csv --setup angles.toml --out report
    errsep reversal data.csv --simultaneous --diagnose
    errsep reversal data.csv --simultaneous --with thermal-drift,zero-jump --corrected clean.csv
    errsep reversal cad.csv --columns x=z_mm:mm,1A=I_0_0:mm,2B=I_0_180:mm")]
pub struct Args {
    /// The readings.
    #[arg(value_name = "DATA.csv")]
    data: PathBuf,
    /// What is known beside the readings (TOML): [artefact] thickness, [indicator] noise,
    /// [model] convention and interpolation, [columns].
    #[arg(long, value_name = "SETUP.toml")]
    setup: Option<PathBuf>,
    /// How the tilt is taken out of the traces before the forms are separated.
    #[arg(long, value_enum, default_value_t = Method::Auto, conflicts_with = "simultaneous")]
    method: Method,
    /// Solve tilts and forms in one least-squares fit with exact geometry.
    #[arg(long)]
    simultaneous: bool,
    /// Effects that are fitted along with tilts and forms, by the names of `errsep diagnose`, such as
    /// thermal-drift,zero-jump.
    #[arg(
        long,
        value_name = "EFFECT,...",
        value_delimiter = ',',
        requires = "simultaneous"
    )]
    with: Vec<String>,
    /// Write the readings without what these effects change in them into this file.
    #[arg(long, value_name = "FILE", requires = "with")]
    corrected: Option<PathBuf>,
    /// Say as well where and why model and readings disagree, as `errsep diagnose` does, by this fit.
    #[arg(long, requires = "simultaneous", conflicts_with = "with")]
    diagnose: bool,
    #[command(flatten)]
    columns: ColumnArgs,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Method {
    /// Subtract each channel's line.
    Shear,
    /// Rotate each channel back and interpolate.
    Rotation,
    /// Whichever has the smaller estimated error.
    Auto,
}

/// Solves a reversal.
///
/// # Errors
/// The readings or the set-up are wrong, or the readings determine no answer.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let mut setup = match &args.setup {
        Some(path) => ReversalSetup::read(path)?,
        None => ReversalSetup::default(),
    };
    if args.columns.are_given() {
        setup.columns = args.columns.map();
    }
    let corrected = args
        .corrected
        .as_deref()
        .map(OutFile::reserve)
        .transpose()?;
    let progress = super::progress("reading", None);
    let data = match read_any(&args.data, &setup)? {
        Readings::Four(data) => {
            no_crest(&setup, args.setup.as_deref())?;
            data
        }
        Readings::Other(data) => {
            let answer = designs::answer(args, &setup, &data, corrected);
            progress.finish_and_clear();
            return answer;
        }
    };
    progress.set_message("solving");
    let (mut outcome, fit) = solve(args, &data, &setup)?;
    let equal = still(&data);
    outcome.still = equal.len() == outcome.channels.len() && setup.noise.is_none();
    outcome.warnings.extend(still_in_words(&equal));
    let moved = moved(&data.observations);
    if let Some(moved) = &moved {
        if !moved.in_height {
            outcome.disagree = Some(true);
        }
        outcome.warnings.push(staged::moved_in_words(moved));
    }
    let diagnosed = match fit.filter(|_| args.diagnose) {
        Some(fit) => Some(Diagnosed::of(
            &args.data,
            &data,
            &setup,
            &fit,
            args.common.seed,
        )?),
        None => {
            outcome
                .warnings
                .extend(pointer(args, &outcome, moved.is_some()));
            None
        }
    };
    if let Some(file) = corrected {
        effects::write_corrected(&args.data, &setup, &data, &outcome, file)?;
    }
    progress.finish_and_clear();
    let mut inputs = vec![args.data.clone()];
    inputs.extend(args.setup.clone());
    // Of a million readings each of these is as large as the data: made only where asked for.
    let common = &args.common;
    let answer = Answer {
        text: common.text(|| text::text(&args.data, &data, &outcome)),
        json: if common.wants_json() {
            json::json(&data, &outcome)?
        } else {
            Value::Null
        },
        page: common.page(|| page::page(&args.data, &data, &setup, &outcome)),
        tables: common.tables(|| tables::tables(&outcome)),
        inputs,
        setup: None,
        seed: None,
        status: Status::Done,
    };
    match diagnosed {
        Some(diagnosed) => diagnosed.beside(answer, common),
        None => Ok(answer),
    }
}

/// What a stylus beside the crest loses hangs on slopes across its line.
///
/// # Errors
/// A set-up that states it of the four channels.
pub fn no_crest(setup: &ReversalSetup, file: Option<&Path>) -> Result<(), Message> {
    match (&setup.crest, file) {
        (Some(_), Some(file)) => Err(Message::bad_input(
            "off_crest is for indicators in two planes: 1A, 1B, 2A, 2B do not see how slide and bar run \
             across their line, on which the loss beside the crest hangs",
        )
        .in_file(file)
        .remedy(
            "leave tip_radius and off_crest out, or read top and bottom too and name the channels by their angles",
        )),
        _ => Ok(()),
    }
}

/// Channels whose readings are all equal.
fn still(data: &ReversalData) -> Vec<&'static str> {
    let stands = |channel: &Channel| {
        let mut readings = data.observations.of(*channel).map(|r| r.value);
        let first = readings.next();
        readings.all(|r| Some(r) == first)
    };
    let channels = data.observations.channels();
    let still = channels.iter().filter(|c| stands(c));
    still.map(|c| c.name()).collect()
}

fn still_in_words(names: &[&str]) -> Option<String> {
    (!names.is_empty()).then(|| {
        format!(
            "all readings of {} are equal: an indicator that does not move, or whose resolution hides \
             everything, tells nothing of the noise, and uncertainties are too small; check it, or \
             state the noise in the set-up ([indicator] noise)",
            names.join(", ")
        )
    })
}

/// Where to go from an answer whose model and readings disagree.
fn pointer(args: &Args, o: &Outcome, moved: bool) -> Option<String> {
    let closes = o
        .closure
        .as_ref()
        .and_then(|c| c.slope)
        .is_none_or(|slope| !staged::does_not_close(slope));
    let disagree = o.disagree == Some(true) || !closes;
    if !disagree && !moved {
        return None;
    }
    let mut command = format!("errsep diagnose {}", args.data.display());
    if let Some(setup) = &args.setup {
        command += &format!(" --setup {}", setup.display());
    }
    if args.columns.are_given() {
        command += ", with the same --columns";
    }
    let why = match disagree {
        true => "where they disagree and why",
        false => "whether a cause that is known moved them",
    };
    Some(format!("to see {why}: {command}"))
}

/// The outcome, and the fit where it is a simultaneous one.
fn solve(
    args: &Args,
    data: &ReversalData,
    setup: &ReversalSetup,
) -> Result<(Outcome, Option<Simultaneous>), Message> {
    if args.simultaneous {
        let (outcome, fit) = simultaneous::solve(&args.data, data, setup, &args.with)?;
        return Ok((outcome, Some(fit)));
    }
    let begin = Instant::now();
    let removal = match args.method {
        Method::Shear => Some(Removal::Shear),
        Method::Rotation => Some(Removal::Rotation),
        Method::Auto => None,
    };
    let mut outcome = staged::solve(&args.data, data, setup, removal)?;
    outcome.convergence.seconds = begin.elapsed().as_secs_f64();
    Ok((outcome, None))
}
