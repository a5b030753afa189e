//! The staged solution as an outcome.

use std::path::Path;

use errsep_models::reversal::Convention;
use errsep_models::reversal::staged::{
    self, Moved, Noise, NoiseSource, Options, Removal, Staged, Value,
};
use errsep_models::uncertainty::DegreesOfFreedom;

use super::outcome::{Angle, Closure, Convergence, Form, Outcome, Residual};
use super::refusal;
use crate::io::Message;
use crate::io::reversal::{ReversalData, ReversalSetup};
use crate::io::units::urad_from_rad;
use crate::report::number;

pub fn solve(
    file: &Path,
    data: &ReversalData,
    setup: &ReversalSetup,
    removal: Option<Removal>,
) -> Result<Outcome, Message> {
    let options = Options {
        removal,
        interpolation: setup.interpolation,
        convention: setup.convention,
        thickness: setup.thickness,
        noise: setup.noise,
    };
    let solution = staged::solve(&data.observations, &options)
        .map_err(|why| refusal::message(&why, file, data))?;
    Ok(outcome(solution, setup))
}

fn outcome(s: Staged, setup: &ReversalSetup) -> Outcome {
    let contrasts = s.convention.tilts();
    let tilts = s
        .tilts
        .iter()
        .map(|t| Angle {
            name: t.name.clone(),
            contrast: t.combination.single().map(|i| contrasts[i]),
            angle: t.angle,
        })
        .collect();
    let residuals = s
        .residuals()
        .into_iter()
        .flat_map(|(channel, values)| {
            let x = s.closure.iter().flat_map(|c| &c.x);
            x.zip(values).map(move |(&x, residual)| Residual {
                channel,
                repeat: 1,
                backward: false,
                x,
                residual,
            })
        })
        .collect();
    Outcome {
        channels: s.lines.iter().map(|l| l.channel).collect(),
        still: false,
        method: s.removal.name(),
        thickness: None,
        covariances: None,
        convention: s.convention,
        tilts,
        contrasts: s.contrasts,
        closure: s.closure.as_ref().map(|c| Closure {
            slope: Some(c.slope),
            freedom: freedom(s.slope_freedom),
            x: c.x.clone(),
            profile: c.profile.clone(),
            rms: c.rms,
            expected_rms: c.expected_rms,
        }),
        residuals,
        residual_rms: s.residual.rms,
        noise: s.noise.sigma,
        noise_words: noise_words(&s),
        channel_noise: Vec::new(),
        degrees_of_freedom: s.residual.degrees_of_freedom as f64,
        noise_law: None,
        noise_freedom: freedom(s.slope_freedom),
        form_freedom: freedom(s.of_mean.degrees_of_freedom),
        disagree: profile_exceeds_noise(&s),
        missed: 0.0,
        method_errors: method_errors(&s),
        convergence: Convergence {
            reason: "solved in stages, without iteration".to_owned(),
            iterations: 0,
            seconds: 0.0,
            costs: Vec::new(),
        },
        knots: None,
        warnings: warnings(&s, setup),
        effects: Vec::new(),
        effect_changes: Vec::new(),
        forms: s
            .forms
            .into_iter()
            .map(|f| Form {
                is_single: f.combination.single().is_some(),
                name: f.name,
                values: f.values,
                std: f.std,
            })
            .collect(),
        x: s.x,
    }
}

fn freedom(known: Option<f64>) -> DegreesOfFreedom {
    known.map_or(DegreesOfFreedom::Infinite, |n| {
        DegreesOfFreedom::Finite(n.max(1.0))
    })
}

fn noise_words(s: &Staged) -> String {
    let freedom = match s.noise.degrees_of_freedom {
        Some(n) => format!(", {n:.0} degrees of freedom"),
        None => String::new(),
    };
    let mut words = format!("{}{freedom}", s.noise.source.name());
    for other in s.noise_figures.iter().skip(1) {
        words += &format!(
            "; {} {} µm",
            other.source.name(),
            number::plain(other.sigma, 3)
        );
    }
    match s.correlated {
        Some(law) => {
            words
                + &format!(
                    "; taken as equal in all channels, and a part of {} µm as correlated over {} mm along a trace, as the \
                     closure profile is, which tilts are told with",
                    number::plain(law.correlated.sqrt(), 2),
                    number::plain(law.length, 2)
                )
        }
        None => words + "; taken as equal in all channels and independent from reading to reading",
    }
}

fn method_errors(s: &Staged) -> Vec<(String, f64, String)> {
    let e = s.error_rms();
    let mut errors = vec![
        (
            "shear",
            e.shear,
            "what subtracting a line instead of rotating misses",
        ),
        (
            "interpolation",
            e.interpolation,
            "what bringing rotated points back to the grid misses",
        ),
        (
            "shear, as the source document has it",
            e.shear_as_printed,
            "-S theta^2/2: leaves out the sideways shift",
        ),
        (
            "interpolation, as the source document has it",
            e.interpolation_as_printed,
            "(S theta)^2/8 |S''|: leaves out the spacing of the grid",
        ),
    ];
    if let Some(thickness) = e.thickness {
        errors.push((
            "thickness",
            thickness,
            "near and far probes on different places of the tilted artefact; shear leaves it in",
        ));
    }
    errors
        .into_iter()
        .map(|(name, rms, meaning)| (name.to_owned(), rms, meaning.to_owned()))
        .collect()
}

/// A contrast or closure beyond this many standard uncertainties is told.
const SIGNIFICANT: f64 = 4.0;

/// A closure larger than the noise explains by this share is told, where chance does not make it.
const EXCESS: f64 = 1.5;

pub const NOTHING_CLOSES: &str = "with fewer than four channels nothing closes: drift, a poor reversal \
     and other errors of the method go unnoticed";

/// Whether the slopes do not close within their uncertainty.
pub fn does_not_close(slope: Value) -> bool {
    slope.value.abs() > SIGNIFICANT * slope.std
}

/// Slopes that do not close.
pub fn slope_warning(slope: Value, convention: Convention) -> Option<String> {
    let contrast = convention.closure();
    does_not_close(slope).then(|| {
        format!(
            "the slopes do not close: {} µrad in the contrast {} ({})",
            number::measured(urad_from_rad(slope.value), Some(urad_from_rad(slope.std))),
            contrast.pattern(),
            contrast.meaning(convention)
        )
    })
}

/// Traces that moved between their repeats, in words.
pub fn moved_in_words(moved: &Moved) -> String {
    let (repeats, neighbours) = (
        number::plain(moved.repeats, 3),
        number::plain(moved.neighbours, 3),
    );
    let channel = moved.channel.name();
    let scatter = format!(
        "repeats of {channel} scatter by {repeats} µm, neighbouring readings by {neighbours} µm only"
    );
    match moved.in_height {
        true => format!(
            "{scatter}: they differ in height above all, as where an indicator is zeroed anew or jumps, and heights change \
             neither tilts nor forms"
        ),
        false => format!(
            "model and readings disagree: {scatter}; traces drifted between the repeats, by more than their height, which the \
             model does not have and the uncertainties take for noise"
        ),
    }
}

/// Whether the closure profile is larger than the noise explains; absent where the noise is not known
/// apart from the model. Where the closure alone tells the noise, neighbouring readings bound it.
fn profile_exceeds_noise(s: &Staged) -> Option<bool> {
    let closing = noise_by(s, NoiseSource::Closure)?;
    match s.noise.source {
        NoiseSource::Declared | NoiseSource::Repeats => {
            // Few positions scatter: by chance the closure of seven exceeds the share once in twenty.
            let clear = s.of_mean.exceeded_by(closing).is_some();
            Some(clear && closing.sigma > EXCESS * s.of_mean.sigma)
        }
        NoiseSource::Closure => {
            let neighbours = noise_by(s, NoiseSource::Neighbours).filter(|_| s.one_grid)?;
            neighbours.exceeded_by(closing).map(|_| true)
        }
        NoiseSource::Neighbours => None,
    }
}

fn noise_by(s: &Staged, source: NoiseSource) -> Option<&Noise> {
    s.noise_figures.iter().find(|n| n.source == source)
}

fn warnings(s: &Staged, setup: &ReversalSetup) -> Vec<String> {
    let mut warnings: Vec<String> = (s.levelled_um.map(super::simultaneous::levelled))
        .into_iter()
        .collect();
    warnings.extend(s.rounding.map(super::simultaneous::rounded));
    if !s.one_grid {
        warnings.push(
            "the traces have different positions: they were interpolated onto the coarsest grid; \
             --simultaneous uses them as they are"
                .to_owned(),
        );
    }
    if s.left_out > 0
        && let (Some(first), Some(last)) = (s.x.first(), s.x.last())
    {
        warnings.push(format!(
            "at {} of the measured positions too few channels were read to tell the forms apart: tilts \
             and forms are those of the other positions, x = {} to {} mm; --simultaneous uses all \
             readings",
            s.left_out,
            number::plain(*first, 6),
            number::plain(*last, 6)
        ));
    }
    match &s.closure {
        Some(closure) => {
            warnings.extend(slope_warning(closure.slope, s.convention));
            if profile_exceeds_noise(s) == Some(true) {
                // The noise that the closure itself told has no say here.
                let bound = match (s.noise.source, noise_by(s, NoiseSource::Neighbours)) {
                    (NoiseSource::Closure, Some(n)) => n.sigma / s.noise.sigma,
                    _ => 1.0,
                };
                warnings.push(format!(
                    "model and readings disagree: the closure profile, {} µm, is larger than the noise \
                     explains, {} µm",
                    number::plain(closure.rms, 2),
                    number::plain(bound * closure.expected_rms, 2)
                ));
            }
        }
        None => warnings.push(NOTHING_CLOSES.to_owned()),
    }
    if s.noise.source == NoiseSource::Neighbours {
        warnings.push(
            "the noise is taken from each reading against its neighbours; declare it in the set-up \
             or take repeats for a firmer uncertainty"
                .to_owned(),
        );
    }
    if s.removal == Removal::Rotation && setup.thickness.is_none() {
        warnings.push(
            "the artefact's thickness is not given: rotation is about its surface, and near and far \
             probe points are taken as opposite"
                .to_owned(),
        );
    }
    for line in &s.lines {
        if let Some(d) = line.direction_difference
            && d.abs() > SIGNIFICANT * s.noise.sigma * (2.0 / line.positions as f64).sqrt()
        {
            warnings.push(format!(
                "channel {} reads {} µm more backward than forward: the mean of both is used",
                line.channel.name(),
                number::plain(d, 3)
            ));
        }
    }
    warnings
}
