//! The simultaneous solution as an outcome.

use std::path::Path;

use errsep_models::reversal::simultaneous::{
    self, ChannelNoise, KnotVerdict, Knots, Noise, NoiseOrigin, Options, ReversalError,
    Simultaneous, Thickness, With,
};
use errsep_models::reversal::staged::Value as Measured;
use errsep_models::reversal::{Channel, Contrast, Observations, Rounding};
use errsep_models::uncertainty::DegreesOfFreedom;

use super::effects;
use super::json;
use super::noise;
use super::outcome::{Angle, Closure, Convergence, Form, Outcome, Residual};
use super::refusal::OTHER_UNITS;
use crate::io::Message;
use crate::io::reversal::{ReversalData, ReversalSetup};
use crate::report::{self, number};

/// More positions than this of a form are not seen apart.
const MOST_POSITIONS: usize = 1001;

pub fn solve(
    file: &Path,
    data: &ReversalData,
    setup: &ReversalSetup,
    with: &[String],
) -> Result<(Outcome, Simultaneous), Message> {
    let options = Options {
        convention: setup.convention,
        thickness: match setup.thickness {
            None => Thickness::NotKnown,
            Some(d) if setup.fit_thickness => Thickness::Fitted(d),
            Some(d) => Thickness::Known(d),
        },
        noise: setup.noise.map_or(Noise::Estimated, Noise::Declared),
        knots: setup.knots.map_or(Knots::Chosen, Knots::Cells),
        effects: with.iter().map(With::named).collect(),
        ..Options::default()
    };
    let fit =
        simultaneous::fit(&data.observations, &options).map_err(|why| refusal(&why, file, data))?;
    let outcome = outcome(&fit, &data.observations, setup);
    Ok((outcome, fit))
}

fn refusal(why: &ReversalError, file: &Path, data: &ReversalData) -> Message {
    let message = refused(why, file, data);
    match why {
        ReversalError::NotConverged { ending, reached }
        | ReversalError::EffectsNotConverged {
            ending, reached, ..
        } => message.reaching(json::reached(reached, ending)),
        _ => message,
    }
}

fn refused(why: &ReversalError, file: &Path, data: &ReversalData) -> Message {
    if let Some(message) = effects::refusal(why) {
        return message.in_file(file);
    }
    let (message, remedy) = match why {
        ReversalError::NotConverged { .. } | ReversalError::NoStart(_) => (
            Message::not_converged(why.to_string()),
            "solve in stages (without --simultaneous), or give fewer [model] knots",
        ),
        ReversalError::ThicknessNotDetermined { .. } => (
            Message::not_determined(why.to_string()),
            "measure the thickness and leave fit_thickness out of the set-up",
        ),
        ReversalError::OnePosition { .. } => (
            Message::bad_input(why.to_string()),
            "read every channel at three or more different positions x",
        ),
        ReversalError::TooSteep { .. } => (Message::bad_input(why.to_string()), OTHER_UNITS),
        ReversalError::TooFewReadings { .. } | ReversalError::TooFewPositions { .. } => (
            Message::bad_input(why.to_string()),
            "take more readings, or give fewer [model] knots in the set-up",
        ),
        ReversalError::TooFewToTellNoise { .. } => (
            Message::not_determined(why.to_string()),
            "give fewer [model] knots, state [indicator] noise in the set-up, or take more readings",
        ),
        ReversalError::TooManyKnots { .. } => (
            Message::not_determined(why.to_string()),
            "give no more [model] knots than that, or leave them out: they are chosen from the data",
        ),
        ReversalError::NotDetermined { .. } => (
            Message::not_determined(why.to_string()),
            "give fewer [model] knots, or leave them out: they are chosen from the data",
        ),
        _ => (
            Message::bad_input(why.to_string()),
            "correct it in the data or the set-up",
        ),
    };
    let place = match why {
        ReversalError::OnePosition { channel, .. } | ReversalError::TooSteep { channel, .. } => {
            data.first_reading(channel)
        }
        _ => None,
    };
    match place {
        Some(place) => message.at(place.clone()).remedy(remedy),
        None => message.in_file(file).remedy(remedy),
    }
}

/// The positions of the channel with the most of them, or as many even ones as are seen apart.
fn positions(data: &Observations) -> Vec<f64> {
    let of = |channel: Channel| {
        let mut x = data.of(channel).map(|r| r.x).collect::<Vec<_>>();
        x.sort_by(f64::total_cmp);
        x.dedup();
        x
    };
    let longest = data
        .channels()
        .into_iter()
        .map(of)
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

fn outcome(fit: &Simultaneous, data: &Observations, setup: &ReversalSetup) -> Outcome {
    let names = fit.convention.tilts();
    let tilts = fit
        .tilts()
        .into_iter()
        .map(|t| Angle {
            contrast: t.combination.single().map(|i| names[i]),
            name: t.name,
            angle: t.angle,
        })
        .collect::<Vec<_>>();
    let x = positions(data);
    let profiles = fit.forms(&x);
    let forms = profiles
        .iter()
        .map(|f| Form {
            is_single: errsep_models::reversal::staged::FORMS.contains(&f.name.as_str()),
            name: f.name.clone(),
            values: f.values.clone(),
            std: f.std.clone(),
        })
        .collect();
    let residuals = fit
        .records(data)
        .map(|r| Residual {
            channel: r.reading.channel,
            repeat: r.reading.repeat,
            backward: r.reading.direction == errsep_models::reversal::Direction::Backward,
            x: r.reading.x,
            residual: r.residual,
        })
        .collect::<Vec<_>>();
    let squares = residuals
        .iter()
        .map(|r| r.residual * r.residual)
        .sum::<f64>();
    let readings = fit.noise.iter().map(|n| n.readings as f64).sum::<f64>();
    let variance = fit
        .noise
        .iter()
        .map(|n| n.readings as f64 * n.sigma * n.sigma)
        .sum::<f64>();
    let closure = fit.closure.as_ref().map(|c| Closure {
        slope: c.slope,
        freedom: freedom(std::iter::once(c.degrees_of_freedom)),
        x: c.x.clone(),
        profile: c.profile.clone(),
        rms: c.rms,
        expected_rms: expected_closure(fit, c.profile.len()),
    });
    // The contrast that the convention holds at zero is the closure's, or the taper's that takes it up.
    let held = closure
        .as_ref()
        .and_then(|c| c.slope)
        .or_else(|| taper(fit));
    let contrasts = held.map(|held| {
        Contrast::ALL.map(|contrast| {
            let tilt = tilts.iter().find(|t| t.contrast == Some(contrast));
            (contrast, tilt.map_or(held, |t| t.angle))
        })
    });
    Outcome {
        channels: data.channels(),
        still: false,
        method: "simultaneous",
        convention: fit.convention,
        contrasts,
        forms,
        residual_rms: (squares / residuals.len().max(1) as f64).sqrt(),
        residuals,
        noise: (variance / readings).sqrt(),
        noise_words: noise_words(fit, data, &x),
        channel_noise: fit.noise.iter().map(|n| (n.channel, n.sigma)).collect(),
        degrees_of_freedom: fit.degrees_of_freedom,
        noise_law: match fit.noise_origin {
            NoiseOrigin::Repeats { law, shared } => Some((law, shared.map(|s| s.correlation))),
            NoiseOrigin::BetweenChannels { law } => Some((law, None)),
            _ => None,
        },
        noise_freedom: freedom(fit.tilts().iter().map(|t| t.degrees_of_freedom)),
        form_freedom: freedom(profiles.iter().map(|f| f.degrees_of_freedom)),
        disagree: match fit.knots.verdict {
            KnotVerdict::TooFew => Some(true),
            KnotVerdict::Enough | KnotVerdict::AsTheNoise => fit.agreement.disagree,
        },
        missed: fit.agreement.missed,
        method_errors: Vec::new(),
        convergence: Convergence {
            reason: fit.convergence.ending.to_string(),
            iterations: fit.convergence.iterations(),
            seconds: fit.convergence.seconds,
            costs: fit.convergence.history.iter().map(|i| i.cost).collect(),
        },
        knots: Some(knots(fit, setup)),
        warnings: warnings(fit, closure.as_ref(), setup),
        thickness: setup.fit_thickness.then(|| fit.thickness()),
        effects: fit.effects.clone(),
        effect_changes: fit.effect_changes.clone(),
        covariances: Some(fit.covariances()),
        x,
        closure,
        tilts,
    }
}

/// The half angle of a taper in the fit, rad.
fn taper(fit: &Simultaneous) -> Option<Measured> {
    let effect = fit.effects.iter().find(|e| e.effect == "taper")?;
    let angle = effect.parameters.first()?;
    Some(Measured {
        value: angle.value,
        std: angle.std?,
    })
}

/// The least of some degrees of freedom.
fn freedom(all: impl Iterator<Item = f64>) -> DegreesOfFreedom {
    let least = all.fold(f64::INFINITY, f64::min);
    if least.is_finite() {
        DegreesOfFreedom::Finite(least.max(1.0))
    } else {
        DegreesOfFreedom::Infinite
    }
}

/// Where the noise comes from, and what is assumed of it.
fn noise_words(fit: &Simultaneous, data: &Observations, x: &[f64]) -> String {
    let alike = fit.noise.windows(2).all(|n| n[0].sigma == n[1].sigma);
    noise::words(fit.noise_origin, alike, fit.degrees_of_freedom, || {
        let (share, part) = noise::SUPPOSED;
        let length = part * (x.last().unwrap_or(&0.0) - x.first().unwrap_or(&0.0));
        let factors = fit.if_correlated(data, 1, (share, length)).ok()?;
        let first = fit.tilts().into_iter().next();
        Some((
            length,
            first.map_or(String::new(), |t| t.name),
            *factors.first()?,
        ))
    })
}

/// What the noise alone gives a closure of so many points, each the mean of its share of a channel's
/// readings, µm. Of opposite indicators it holds the sum, (1 + correlation) of the variance.
fn expected_closure(fit: &Simultaneous, points: usize) -> f64 {
    let variance_of_mean = |n: &ChannelNoise| n.sigma * n.sigma * points as f64 / n.readings as f64;
    let share = match fit.noise_origin {
        NoiseOrigin::Repeats {
            shared: Some(shared),
            ..
        } => 1.0 + shared.correlation,
        _ => 1.0,
    };
    (share * fit.noise.iter().map(variance_of_mean).sum::<f64>()).sqrt() / 4.0
}

fn knots(fit: &Simultaneous, setup: &ReversalSetup) -> report::reversal::Knots {
    let cells = fit.knots.cells();
    let how = match (setup.knots, fit.knots.refuted()) {
        (Some(_), _) => "as the set-up says".to_owned(),
        (None, None) => {
            "chosen by the corrected information criterion (what they cut off the forms is in the bands)"
                .to_owned()
        }
        (None, Some(fewer)) => format!(
            "the fewest that leave no more than the finest do but for noise: with {fewer}, which the corrected \
             information criterion would have of so few readings, the forms would be told as noise"
        ),
    };
    let verdict = match fit.knots.verdict {
        KnotVerdict::Enough => "neighbouring residuals are not correlated",
        KnotVerdict::AsTheNoise => "neighbouring residuals go together as the noise does",
        KnotVerdict::TooFew => {
            "too few, or the noise is not independent: neighbouring residuals go together"
        }
    };
    report::reversal::Knots {
        criterion: "corrected Akaike criterion".to_owned(),
        tried: fit.knots.table.iter().map(|t| (t.cells, t.aicc)).collect(),
        chosen: cells,
        reason: format!("{}, {how}; {verdict}", number::counted(cells, "cell")),
    }
}

/// That repeats were brought to one height.
pub(super) fn levelled(greatest_um: f64) -> String {
    format!(
        "the traces of a channel differ as a whole, by up to {} µm from their mean, as where an indicator is set to zero before each of them: \
         they were brought to one height first, without which the forms would have steps between their readings, or the misfit would count as \
         noise",
        number::plain(greatest_um, 3)
    )
}

/// That readings are rounded more coarsely than they scatter.
pub(super) fn rounded(rounding: Rounding) -> String {
    format!(
        "readings are rounded to {} µm, more coarsely than they scatter (about {} µm before): repeats have an error of {} µm of it in common, which \
         no repeating takes away and the uncertainties count",
        number::plain(rounding.step, 3),
        number::plain(rounding.noise, 2),
        number::plain(rounding.std(), 2)
    )
}

/// That the heights of repeats are unknowns beside effects.
fn heights_beside(greatest_um: f64) -> String {
    format!(
        "the traces of a channel differ as a whole, by up to {} µm from their mean, as where an indicator is set to zero before each of them: their heights \
         are unknowns of the fit beside the effects",
        number::plain(greatest_um, 3)
    )
}

fn warnings(fit: &Simultaneous, closure: Option<&Closure>, setup: &ReversalSetup) -> Vec<String> {
    let heights = if fit.effects.is_empty() {
        levelled
    } else {
        heights_beside
    };
    let mut warnings: Vec<String> = fit.levelled_um.map(heights).into_iter().collect();
    warnings.extend(fit.rounding().map(rounded));
    if fit.agreement.disagree == Some(true) && fit.agreement.missed > 0.0 {
        warnings.push(noise::disagreement(fit.agreement.missed));
    }
    if fit.knots.verdict == KnotVerdict::TooFew {
        let counted = match fit.agreement.disagree {
            Some(true) => "",
            _ => "; the uncertainties are too small then",
        };
        warnings.push(format!(
            "residuals of neighbouring readings go together (correlation {}, {} standard deviations): \
             the forms have more detail than knots = {} follow, or the noise is not independent{counted}",
            number::plain(fit.knots.neighbour_correlation, 2),
            number::plain(fit.knots.neighbour_z, 2),
            fit.knots.cells()
        ));
    }
    match closure {
        Some(closure) => warnings.extend(
            closure
                .slope
                .and_then(|slope| super::staged::slope_warning(slope, fit.convention)),
        ),
        None => warnings.push(super::staged::NOTHING_CLOSES.to_owned()),
    }
    if fit.times_assumed {
        warnings.push(
            "no times are given: the readings are taken to follow each other evenly, one a second, first \
             spindle position first, each repeat forward and then backward; for an effect in time add a \
             column `time`"
                .to_owned(),
        );
    }
    if setup.fit_thickness {
        let thickness = fit.thickness();
        warnings.push(format!(
            "the thickness was fitted: {} mm",
            number::measured(thickness.value, Some(thickness.std))
        ));
    }
    warnings
}
