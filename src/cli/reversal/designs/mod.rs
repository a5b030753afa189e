//! Designs other than the four channels: `errsep.reversal/2`.

mod json;
mod notes;
mod page;
mod text;

use errsep_models::reversal::Direction;
use errsep_models::reversal::designs::{
    DesignFit, DesignFitError, DesignOptions, Determined, FoundForm, fit,
};
use errsep_models::reversal::simultaneous::{Knots, Noise};
use errsep_models::uncertainty::{DegreesOfFreedom, coverage_factor};

use super::Args;
use super::diagnosed::Diagnosed;
use super::json::reached as reached_json;
use super::noise;
use super::refusal::OTHER_UNITS;
use crate::cli::Answer;
use crate::cli::diagnose::joined::Given;
use crate::cli::diagnose::reversal::design_with;
use crate::cli::quantity::COVERAGE;
use crate::io::reversal::{DesignData, ReversalSetup, corrected_design};
use crate::io::{CsvTable, Message, OutFile, Status};

/// More positions than this of a form are not seen apart.
const MOST_POSITIONS: usize = 1001;

/// A solved design with all that its answer tells.
struct Outcome<'a> {
    data: &'a DesignData,
    fit: DesignFit,
    x: Vec<f64>,
    forms: Vec<FoundForm>,
    warnings: Vec<String>,
}

/// Solves a design.
///
/// # Errors
/// What these options cannot do here, or readings that determine no answer.
pub fn answer(
    args: &Args,
    setup: &ReversalSetup,
    data: &DesignData,
    corrected: Option<OutFile>,
) -> Result<Answer, Message> {
    let mut options = options(setup, data).map_err(|why| match &args.setup {
        Some(file) => why.in_file(file),
        None => why.in_file(&args.data),
    })?;
    options.fit_thickness = setup.fit_thickness && setup.thickness.is_some();
    let fit = fit(&data.observations, &options).map_err(|why| refusal(&why, args, data))?;
    let x = positions(data);
    let outcome = Outcome {
        forms: fit.forms(&x),
        warnings: notes::warnings(&fit, data, setup, &options),
        x,
        fit,
        data,
    };
    let mut inputs = vec![args.data.clone()];
    inputs.extend(args.setup.clone());
    let answer = Answer {
        text: text::text(&args.data, &outcome)?,
        json: json::json(&outcome)?,
        page: page::page(&args.data, setup, &outcome)?,
        tables: tables(&outcome),
        inputs,
        setup: None,
        seed: None,
        status: Status::Done,
    };
    let fit = &outcome.fit;
    if args.diagnose {
        let seed = args.common.seed;
        return Diagnosed::of_design(&args.data, data, setup, fit, seed)?
            .beside(answer, &args.common);
    }
    if args.with.is_empty() {
        return Ok(answer);
    }
    let given = Given {
        setup: args.setup.as_deref(),
        columns: args.columns.clone(),
        ..Given::to("reversal", &args.data, &args.with, &args.common)
    };
    let (answer, changes) = design_with(answer, &given, setup, data, fit)?;
    if let Some(file) = corrected {
        write_corrected(args, setup, data, changes.as_deref(), file)?;
    }
    Ok(answer)
}

/// How a set-up has its design fitted, a thickness taken as known.
///
/// # Errors
/// Styluses of indicators that are not there.
pub fn options(setup: &ReversalSetup, data: &DesignData) -> Result<DesignOptions, Message> {
    let design = &data.observations.design;
    Ok(DesignOptions {
        zero: setup.zero,
        thickness_mm: setup.thickness.unwrap_or(0.0),
        crest: match &setup.crest {
            Some(crest) => Some(crest.of(design)?),
            None => None,
        },
        noise: setup.noise.map_or(Noise::Estimated, Noise::Declared),
        knots: setup.knots.map_or(Knots::Chosen, Knots::Cells),
        ..DesignOptions::default()
    })
}

/// Writes the readings less what the effects change in them.
fn write_corrected(
    args: &Args,
    setup: &ReversalSetup,
    data: &DesignData,
    changes: Option<&[f64]>,
    file: OutFile,
) -> Result<(), Message> {
    let Some(changes) = changes else {
        return Err(Message::not_determined(
            "the traces have positions of their own: what the effects change is known at common places, \
             not reading by reading",
        )
        .in_file(&args.data)
        .remedy("leave --corrected out, or read all channels at the same positions"));
    };
    let comment = format!(
        "readings of {} less what {} changes in them by the fit of these same readings: no independent evidence",
        args.data.display().to_string().replace(['\n', '\r'], " "),
        args.with.join(" and ")
    );
    let content = corrected_design(&args.data, setup, data.dialect, changes, &comment)?;
    file.write(&content)
}

impl Outcome<'_> {
    /// Degrees of freedom of the slopes: the fewest of any.
    fn freedom(&self) -> DegreesOfFreedom {
        fewest(self.fit.slopes().iter().map(|s| s.degrees_of_freedom))
    }

    /// Coverage factor of the slopes.
    fn factor(&self) -> f64 {
        // Degrees of freedom are positive, so that they have a coverage factor.
        coverage_factor(COVERAGE, self.freedom()).unwrap_or(f64::NAN)
    }

    /// Coverage factor of a form.
    fn form_factor(&self, form: &FoundForm) -> f64 {
        coverage_factor(COVERAGE, degrees(form.degrees_of_freedom)).unwrap_or(f64::NAN)
    }

    /// Where the noise comes from, and what is assumed of it.
    fn noise_words(&self) -> String {
        let fit = &self.fit;
        let alike = fit.by_channel.windows(2).all(|n| n[0].sigma == n[1].sigma);
        noise::words(fit.noise_origin, alike, fit.degrees_of_freedom, || {
            let (share, part) = noise::SUPPOSED;
            let length = part * (self.x.last()? - self.x.first()?);
            let factors = fit.if_correlated(&self.data.observations, share, length);
            let first = fit.slopes().into_iter().next()?;
            Some((length, first.name, *factors.ok()?.first()?))
        })
    }

    fn residual_rms(&self) -> f64 {
        let squares: f64 = self.fit.residuals.iter().map(|r| r * r).sum();
        (squares / self.fit.residuals.len() as f64).sqrt()
    }

    /// What the design leaves open, with what to do: combination and remedy.
    fn open(&self) -> Vec<(String, String)> {
        let determined: &Determined = &self.fit.determined;
        let mut open: Vec<(String, String)> = determined
            .not_determined
            .iter()
            .map(|n| {
                let remedy = match &n.remedy {
                    Some(remedy) => remedy.words.clone(),
                    None => "more than one trace more is needed".to_owned(),
                };
                (n.combination.clone(), remedy)
            })
            .collect();
        let blind: Vec<&str> = determined.not_seen.iter().map(|n| &n[..]).collect();
        if !blind.is_empty() {
            open.push((
                format!("{}: seen by no channel", blind.join(", ")),
                blind_remedy(&blind),
            ));
        }
        open
    }
}

/// What would see unknowns that no channel sees.
fn blind_remedy(names: &[&str]) -> String {
    let any = |list: &[&str]| names.iter().any(|n| list.contains(n));
    let mut ways = Vec::new();
    if any(&["M_h", "alpha_h"]) {
        ways.push("an indicator at 0° or 180°");
    }
    if any(&["M_v", "alpha_v"]) {
        ways.push("an indicator at 90° or 270°");
    }
    if any(&["gamma_1", "gamma_2", "kappa_c"]) {
        ways.push("sides 90° apart");
    }
    if any(&["kappa_s"]) {
        ways.push("sides between the right angles for kappa_s");
    }
    format!("if wanted: {}", ways.join(", "))
}

fn refusal(why: &DesignFitError, args: &Args, data: &DesignData) -> Message {
    let (message, remedy) = match why {
        DesignFitError::NotConverged { .. } | DesignFitError::NoStart(_) => (
            Message::not_converged(why.to_string()),
            "give fewer [model] knots, and check the angles of the channels",
        ),
        DesignFitError::OnePosition { .. } | DesignFitError::TooFewPositions { .. } => (
            Message::bad_input(why.to_string()),
            "read every channel at four or more different positions x",
        ),
        DesignFitError::TooSteep { .. } => (Message::bad_input(why.to_string()), OTHER_UNITS),
        DesignFitError::ThicknessNotDetermined { .. } => (
            Message::not_determined(why.to_string()),
            "measure the thickness and leave fit_thickness out of the set-up",
        ),
        DesignFitError::TooFewReadings { .. } | DesignFitError::TooManyKnots { .. } => (
            Message::not_determined(why.to_string()),
            "take more readings, or give fewer [model] knots, or leave them out: they are chosen from the data",
        ),
        _ => (
            Message::bad_input(why.to_string()),
            "correct it in the data or the set-up",
        ),
    };
    let named = match why {
        DesignFitError::OnePosition { channel, .. } | DesignFitError::TooSteep { channel, .. } => {
            let channels = data.observations.design.channels();
            channels.iter().position(|c| c.name == *channel)
        }
        _ => None,
    };
    let message = match named.and_then(|c| data.first.get(c)) {
        Some(place) => message.at(place.clone()).remedy(remedy),
        None => message.in_file(&args.data).remedy(remedy),
    };
    match why {
        DesignFitError::NotConverged { ending, reached } => {
            message.reaching(reached_json(reached, ending))
        }
        _ => message,
    }
}

/// The positions of the channel with the most of them, or as many even ones as are seen apart.
fn positions(data: &DesignData) -> Vec<f64> {
    let mut by_channel = vec![Vec::new(); data.observations.design.channels().len()];
    for reading in &data.observations.readings {
        by_channel[reading.channel].push(reading.x);
    }
    for x in &mut by_channel {
        x.sort_by(f64::total_cmp);
        x.dedup();
    }
    let longest = by_channel
        .into_iter()
        .max_by_key(Vec::len)
        .unwrap_or_default();
    if longest.len() <= MOST_POSITIONS {
        return longest;
    }
    let (first, last) = (longest[0], longest[longest.len() - 1]);
    let step = (last - first) / (MOST_POSITIONS - 1) as f64;
    (0..MOST_POSITIONS)
        .map(|k| first + k as f64 * step)
        .collect()
}

/// Degrees of freedom as those of a quantity.
fn degrees(freedom: f64) -> DegreesOfFreedom {
    if freedom.is_finite() {
        DegreesOfFreedom::Finite(freedom.max(1.0))
    } else {
        DegreesOfFreedom::Infinite
    }
}

/// The least of some degrees of freedom.
fn fewest(all: impl Iterator<Item = f64>) -> DegreesOfFreedom {
    degrees(all.fold(f64::INFINITY, f64::min))
}

fn tables(o: &Outcome) -> Vec<CsvTable> {
    let profiles = o.forms.iter().fold(
        CsvTable::new("profiles.csv").numbers("x_mm", o.x.clone()),
        |table, form| {
            table
                .numbers(format!("{}_um", form.name), form.values.clone())
                .numbers(format!("{}_std_um", form.name), form.std.clone())
        },
    );
    let readings = &o.data.observations.readings;
    let name = |c: usize| o.fit.design.channels()[c].name.clone();
    let ways = readings
        .iter()
        .map(|r| u8::from(r.direction == Direction::Backward));
    let residuals = CsvTable::new("residuals.csv")
        .texts(
            "channel",
            readings.iter().map(|r| name(r.channel)).collect::<Vec<_>>(),
        )
        .numbers(
            "repeat",
            readings
                .iter()
                .map(|r| f64::from(r.repeat))
                .collect::<Vec<_>>(),
        )
        .words(
            "direction",
            ["forward", "backward"],
            ways.collect::<Vec<_>>(),
        )
        .numbers("x_mm", readings.iter().map(|r| r.x).collect::<Vec<_>>())
        .numbers("residual_um", o.fit.residuals.clone());
    vec![profiles, residuals]
}
