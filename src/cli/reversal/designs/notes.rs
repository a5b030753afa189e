//! What people should know of an answer.

use errsep_models::reversal::designs::{
    DesignFit, DesignObservations, DesignOptions, angle_name, fit,
};
use errsep_models::reversal::simultaneous::KnotVerdict;

use super::noise;
use crate::io::reversal::{DesignData, ReversalSetup};
use crate::report::number;

/// Squares beyond their mean by so many standard deviations are told.
const CLEAR: f64 = 4.0;

/// Residuals that fall below this share with the sign of an indicator turned are told.
const TURNED: f64 = 0.2;

/// The indicator with whose sign turned the model meets the readings, where it does not without.
fn turned_sign(found: &DesignFit, data: &DesignData, options: &DesignOptions) -> Option<String> {
    let observations = &data.observations;
    let design = &observations.design;
    let indicators = design.indicators();
    if indicators.len() < 2 {
        return None;
    }
    let rms = |residuals: &[f64]| {
        let squares: f64 = residuals.iter().map(|r| r * r).sum();
        (squares / residuals.len() as f64).sqrt()
    };
    let before = rms(&found.residuals);
    let alike = DesignOptions {
        alike: true,
        fit_thickness: false,
        ..options.clone()
    };
    let with = |indicator: f64| {
        let mut turned: DesignObservations = observations.clone();
        for reading in &mut turned.readings {
            if design.channels()[reading.channel].indicator == indicator {
                reading.value = -reading.value;
            }
        }
        Some(rms(&fit(&turned, &alike).ok()?.residuals))
    };
    // Of two that face each other either may be the wrong one.
    let better: Vec<(f64, f64)> = indicators
        .into_iter()
        .filter_map(|indicator| Some((indicator, with(indicator)?)))
        .filter(|(_, after)| *after < TURNED * before)
        .collect();
    let after = better.first()?.1;
    let names: Vec<String> = better
        .iter()
        .map(|b| format!("{}°", angle_name(b.0)))
        .collect();
    Some(format!(
        "with the sign of the readings of the indicator at {} turned, {} µm rms are left in place of {}: readings \
         are positive towards their own indicator; check the sign",
        names.join(" or "),
        number::plain(after, 3),
        number::plain(before, 3)
    ))
}

/// What the fit takes as known across the line of an indicator, and a thickness that was fitted.
fn presumed(fit: &DesignFit, setup: &ReversalSetup) -> Vec<String> {
    let mut told = Vec::new();
    if let Some(thickness) = fit.thickness() {
        told.push(format!(
            "the thickness was fitted: {} mm",
            number::measured(thickness.value.value, Some(thickness.value.std))
        ));
    } else if setup.fit_thickness {
        told.push(
            "fit_thickness needs a first guess: give [artefact] thickness too; none was fitted"
                .to_owned(),
        );
    }
    if setup.crest.is_some() {
        let open = |name: &&&str| fit.slope(name).is_none();
        let slopes = ["alpha_h", "alpha_v", "gamma_1", "gamma_2"];
        let open: Vec<&str> = slopes.iter().filter(open).copied().collect();
        if !open.is_empty() {
            told.push(format!(
                "what a stylus loses beside the crest hangs on slopes across its line, and these channels do not \
                 determine {} by {}: what is not found is taken as zero there",
                open.join(", "),
                if open.len() == 1 { "itself" } else { "themselves" }
            ));
        }
    }
    told
}

/// All notes of an answer.
pub(super) fn warnings(
    fit: &DesignFit,
    data: &DesignData,
    setup: &ReversalSetup,
    options: &DesignOptions,
) -> Vec<String> {
    let mut warnings = presumed(fit, setup);
    warnings.extend(
        fit.levelled_um
            .map(crate::cli::reversal::simultaneous::levelled),
    );
    warnings.extend(
        fit.rounding()
            .map(crate::cli::reversal::simultaneous::rounded),
    );
    if !data.not_read.is_empty() {
        let names = data.not_read.join(", ");
        warnings.push(format!("channels of the set-up without a reading: {names}"));
    }
    let design = &fit.design;
    let once: Vec<String> = (0..design.sides().len())
        .filter_map(|side| {
            let mut seen = (0..design.channels().len()).filter(|c| design.side_of(*c) == side);
            let (first, second) = (seen.next()?, seen.next());
            let name = &design.channels()[first].name;
            let angle = angle_name(design.sides()[side]);
            second.is_none().then(|| format!("{angle}° (by {name})"))
        })
        .collect();
    if !once.is_empty() {
        warnings.push(format!(
            "sides seen once only: {}; nothing checks their forms, and a wrong angle would show just so: \
             check the angles of these channels",
            once.join(", ")
        ));
    }
    for (channel, own) in design.channels().iter().zip(&fit.by_channel) {
        let stands = |value: Option<f64>| {
            let readings = data.observations.readings.iter();
            let at = design.channels().iter().position(|c| c == channel);
            readings
                .filter(|r| Some(r.channel) == at)
                .all(|r| Some(r.value) == value)
        };
        let first = data
            .observations
            .readings
            .iter()
            .find(|r| design.channels()[r.channel] == *channel);
        if own.readings > 1 && stands(first.map(|r| r.value)) {
            warnings.push(format!(
                "all readings of {} are equal: an indicator that does not move tells nothing; check it",
                channel.name
            ));
        }
    }
    if fit.agreement.disagree == Some(true) && fit.agreement.missed > 0.0 {
        warnings.push(noise::disagreement(fit.agreement.missed));
        warnings.extend(turned_sign(fit, data, options));
    }
    let exceeds = |squares: f64, freedom: f64| squares > freedom + CLEAR * (2.0 * freedom).sqrt();
    for closure in &fit.closures {
        let count = closure.profile.len() as f64;
        if closure.expected_rms > 0.0
            && exceeds(count * (closure.rms / closure.expected_rms).powi(2), count)
        {
            warnings.push(format!(
                "{} does not close: {} µm, noise alone would give {}",
                closure.name,
                number::plain(closure.rms, 3),
                number::plain(closure.expected_rms, 3)
            ));
        }
    }
    for slope in &fit.position_slopes {
        if slope.value.value.abs() > CLEAR * slope.value.std {
            warnings.push(format!(
                "{} is no zero: something changed between the positions of the spindle",
                slope.name
            ));
        }
    }
    if fit.knots.verdict == KnotVerdict::TooFew {
        let counted = match fit.agreement.disagree {
            Some(true) => "",
            _ => "; the uncertainties are too small then",
        };
        warnings.push(format!(
            "neighbouring residuals go together: the noise is correlated, or the forms have finer detail \
             than the knots follow{counted}"
        ));
    }
    warnings
}
