//! What the first-order reversal model leaves out: one file an effect.
//!
//! Effects are told by the angles of indicators, spindle and sides: one catalogue serves the four
//! channels and any design. To add an effect, write its file and add it to [`all`]; the tests that
//! inject every effect blind find it there.

mod ambient_cycle;
mod axis_backlash;
mod common_gain;
mod cyclic_error;
mod gain_mismatch;
mod gravity_sag;
mod hysteresis;
mod indexing_error;
mod indicator_nonlinearity;
mod indicators;
mod lateral_backlash;
mod local_contamination;
mod off_crest;
mod oval_cone;
mod passes;
mod reversal_shift;
mod stick_slip;
mod sticking_plunger;
mod taper;
mod thermal_drift;
mod thickness_shift;
mod tip_radius;
mod zero_jump;

use nalgebra::DMatrix;

use super::Channel;
use super::designs::{Design, DesignChannel, Zero};
use super::diagnosable::{Arrangement, Linearised};
use super::simultaneous;
use crate::model::{Effect, Parameter, Shape};
use indicators::Indicators;

/// The catalogue for readings of these channels.
pub fn all(channels: &Arrangement) -> Vec<Box<dyn Effect<Linearised>>> {
    let indicators = || Indicators::new(channels);
    let mut effects: Vec<Box<dyn Effect<Linearised>>> = vec![
        Box::new(ambient_cycle::AmbientCycle(indicators())),
        Box::new(axis_backlash::AxisBacklash),
        Box::new(common_gain::CommonGain),
        Box::new(cyclic_error::CyclicError::new(channels)),
        Box::new(gain_mismatch::GainMismatch(indicators())),
        Box::new(gravity_sag::GravitySag),
        Box::new(hysteresis::Hysteresis(indicators())),
        Box::new(indexing_error::IndexingError::new(channels)),
        Box::new(indicator_nonlinearity::IndicatorNonlinearity::new(channels)),
        Box::new(lateral_backlash::LateralBacklash::new(channels)),
        Box::new(local_contamination::LocalContamination::new(channels)),
        Box::new(off_crest::OffCrest::new(channels)),
        Box::new(reversal_shift::ReversalShift::new(channels)),
        Box::new(stick_slip::StickSlip::new(channels)),
        Box::new(sticking_plunger::StickingPlunger(indicators())),
        Box::new(taper::Taper),
        Box::new(thermal_drift::ThermalDrift(indicators())),
        Box::new(thickness_shift::ThicknessShift),
        Box::new(tip_radius::TipRadius),
        Box::new(zero_jump::ZeroJump(indicators())),
    ];
    if !channels.is_four() {
        effects.push(Box::new(oval_cone::OvalCone::new(channels)));
    }
    effects
}

/// What the size of an effect on readings of the four channels is: its first amplitude. `None` where the
/// catalogue has no such effect.
pub fn amplitude(effect: &str) -> Option<Parameter> {
    let channels = Channel::ALL.map(DesignChannel::from).to_vec();
    amplitude_of_design(&Design::new(channels).ok()?, effect)
}

/// The same for readings of a design.
pub fn amplitude_of_design(design: &Design, effect: &str) -> Option<Parameter> {
    let channels = Arrangement::new(design.clone(), Zero::Reset, None);
    let catalogue = all(&channels);
    let own = catalogue.iter().find(|known| known.name() == effect)?;
    own.amplitudes().into_iter().next()
}

/// Whether `simultaneous::effects` has an effect too, in the variant that a diagnosis tells in words: a
/// lost motion that grows along the screw, lines of the slide with forms of their own, dirt that stays once it
/// has come, and curves of two powers or about another point in each channel are diagnosed, but are no unknowns of the fit.
pub fn joins_the_fit(effect: &str, variant: Option<&str>) -> bool {
    const APART: [&str; 5] = [
        axis_backlash::GROWS,
        indicator_nonlinearity::ABOUT_ANOTHER,
        indicator_nonlinearity::MIXED,
        lateral_backlash::LEANS,
        lateral_backlash::OWN_FORMS,
    ];
    let known = simultaneous::effects::CATALOGUE.iter();
    known.into_iter().any(|entry| entry.name == effect)
        && !variant.is_some_and(|words| {
            APART.iter().any(|apart| words.starts_with(apart))
                || [
                    local_contamination::STAYS,
                    cyclic_error::OWN_PHASES,
                    stick_slip::LAG,
                    stick_slip::LEAN,
                ]
                .iter()
                .any(|apart| words.contains(apart))
        })
}

/// The start of an effect whose signature depends on its own size: infinitely small.
const SETTLING: Shape = Shape {
    variant: 0,
    values: Vec::new(),
    steps: Vec::new(),
};

/// A position as a part of the travel, −1 to 1.
fn part_of_travel(model: &Linearised, x: f64) -> f64 {
    let first = model.positions().first().copied().unwrap_or(0.0);
    2.0 * (x - first) / model.travel() - 1.0
}

/// A number to four significant digits, or to whole ones, for the words of a variant: its uncertainty is told of the
/// parameter that it is made of.
fn rounded(value: f64) -> String {
    let decimals = (3.0 - value.abs().log10().floor()).clamp(0.0, 12.0);
    format!("{value:.*}", decimals as usize)
}

/// Standard uncertainty of a weighted sum of parameters.
fn spread(covariance: &DMatrix<f64>, weights: &[(usize, f64)]) -> f64 {
    let at = |i: usize, j: usize| covariance.get((i, j)).map_or(f64::NAN, |v| *v);
    let terms = weights
        .iter()
        .flat_map(|(i, w)| weights.iter().map(move |(j, v)| w * v * at(*i, *j)));
    terms.sum::<f64>().clamp(0.0, f64::INFINITY).sqrt()
}

#[cfg(test)]
mod tests {
    use super::rounded;

    #[test]
    fn periods_have_four_digits() {
        // Definition.
        let told = [5489.3209, 38.3051, 0.012_346_1, 86_400.4].map(rounded);
        assert_eq!(told, ["5489", "38.31", "0.01235", "86400"]);
    }
}
