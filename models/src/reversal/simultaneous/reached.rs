//! Where a fit stood that found no minimum.

use errsep_solvers::structured::StructuredFit;

use super::effects::HEIGHTS;
use super::problem::Reversal;

/// An unknown of an effect: its name, value and unit.
pub type Unknown = (String, f64, &'static str);

/// What a fit had come to when it stopped: no minimum, so nothing has an uncertainty, and no value is an
/// answer. It shows which of them went astray.
#[derive(Debug, Clone, PartialEq)]
pub struct Reached {
    /// The tilts by name, rad; with two channels the slope of each.
    pub tilts: Vec<(String, f64)>,
    /// The thickness where it was fitted, mm.
    pub thickness_mm: Option<f64>,
    /// The effects by name, with the unknowns of each: name, value, unit.
    pub effects: Vec<(&'static str, Vec<Unknown>)>,
    /// Root mean square of reading less model, µm; `None` where the model has no value.
    pub residual_rms_um: Option<f64>,
    /// Iterations made in the last descent.
    pub iterations: u64,
}

impl Reached {
    /// Where this fit of a problem stands.
    pub(super) fn of(problem: &Reversal, fit: &StructuredFit) -> Self {
        let (unknowns, border) = (&problem.unknowns, &fit.parameters.border);
        let names: Vec<String> = if unknowns.contrasts.is_empty() {
            let channels = unknowns.channels.iter();
            channels.map(|c| format!("slope of {}", c.name())).collect()
        } else {
            let contrasts = unknowns.contrasts.iter();
            contrasts
                .map(|c| c.name(unknowns.convention).to_owned())
                .collect()
        };
        let mut values = (0..unknowns.effects.len()).map(|k| border[unknowns.effect(k)]);
        let mut effects = Vec::new();
        for member in problem.joined.iter().flat_map(|j| j.members()) {
            let own = member.unknowns.iter().zip(&mut values);
            let own = own.map(|(u, value)| (u.name.to_string(), value, u.unit));
            let own = own.collect();
            if member.name != HEIGHTS {
                effects.push((member.name, own));
            }
        }
        let residuals = problem.residuals(&fit.parameters).ok();
        Self {
            tilts: names.into_iter().zip(border.iter().copied()).collect(),
            thickness_mm: unknowns
                .thickness
                .then(|| problem.thickness(&fit.parameters)),
            effects,
            residual_rms_um: residuals.map(|by_channel| {
                let all = || by_channel.iter().flatten();
                (all().map(|r| r * r).sum::<f64>() / all().count().max(1) as f64).sqrt()
            }),
            iterations: fit.iterations,
        }
    }
}
