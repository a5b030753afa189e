//! What the knots that were chosen cut off the form and the turn of a fit, as of the forms of a reversal.

use super::fit::{TurningFit, fit};
use super::problem::Held;
use super::run::Run;
use super::setting::{Setting, Wave};
use super::spread::Spread;
use super::start::Survey;
use crate::reversal::finer_forms::{TIMES, cut_off};

/// Places in which the fit and the finer one are compared.
const PLACES: usize = 121;

/// Root mean squares.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct CutOff {
    /// Of the form, µm.
    pub form_um: f64,
    /// Of the turn, rad.
    pub lag_rad: f64,
}

impl CutOff {
    /// Of a fit, by one on twice the cells; of none, where these readings have none.
    pub fn of(run: &Run, survey: &Survey, taken: &TurningFit, spread: &Spread) -> Self {
        let most = (survey.turns as usize).max(1);
        let more = |cells: usize| (TIMES * cells).min(most).max(cells);
        let setting = Setting {
            form_cells: more(taken.setting().form_cells),
            wave: match taken.setting().wave {
                Wave::Unsteady { cells } => Wave::Unsteady { cells: more(cells) },
                wave => wave,
            },
            ..taken.setting().clone()
        };
        let hold = Held {
            across: taken.across_held,
            ..Held::default()
        };
        let finer = fit(run, survey, &setting, hold, &|problem, at| {
            at.border.clone_from(&taken.at.border);
            if let (Wave::Unsteady { .. }, Some(basis), Some(unknowns)) =
                (setting.wave, &problem.wave, problem.wave_unknowns.first())
            {
                let turn = taken.turn_on(basis, false).unwrap_or_default();
                for (j, value) in unknowns.iter().zip(turn) {
                    at.band[*j] = value;
                }
            }
        });
        let Ok(finer) = finer else {
            return Self::default();
        };
        let unknowns = |cells: usize| (cells + 1) as f64;
        let (low, high) = run.range();
        let places: Vec<f64> = (0..PLACES)
            .map(|k| low + (high - low) * (k as f64 + 0.5) / PLACES as f64)
            .collect();
        let own = taken.form(&places, spread);
        let detailed = finer.form_values(&places);
        let apart = own
            .iter()
            .zip(&detailed)
            .map(|(a, b)| (a.value - b).powi(2));
        let noise = own.iter().map(|t| t.std.powi(2));
        let form_um = cut_off(
            apart.sum::<f64>() / PLACES as f64,
            unknowns(setting.form_cells) / unknowns(taken.setting().form_cells) - 1.0,
            noise.sum::<f64>() / PLACES as f64,
        );
        let lag_rad = match (taken.setting().wave, setting.wave) {
            (Wave::Unsteady { cells }, Wave::Unsteady { cells: finer_cells }) => {
                let (own, detailed) = (taken.curve(PLACES, 0.0, spread), finer.lags(PLACES));
                own.zip(detailed).map_or(0.0, |(own, detailed)| {
                    let lags = own.lag_rad.iter().zip(&detailed);
                    cut_off(
                        lags.map(|(a, b)| (a - b).powi(2)).sum::<f64>() / PLACES as f64,
                        unknowns(finer_cells) / unknowns(cells) - 1.0,
                        own.lag_std.iter().map(|s| s * s).sum::<f64>() / PLACES as f64,
                    )
                })
            }
            _ => 0.0,
        };
        Self { form_um, lag_rad }
    }
}
