//! What the redundancy of a design says after a fit.

use errsep_solvers::structured::StructuredFit;

use super::channel::Design;
use super::determined::Determined;
use super::problem::DesignProblem;
use super::words;
use crate::reversal::channel_noise::scatter::Scatter;
use crate::reversal::staged::Value;

/// A combination of channels that is zero whatever the forms are.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignClosure {
    /// Its name, such as `(1A + 1B - 2A - 2B)/4`.
    pub name: String,
    /// Positions at which all its channels were read, mm.
    pub x: Vec<f64>,
    /// Its value from the residuals, µm.
    pub profile: Vec<f64>,
    /// Root mean square of the profile, µm.
    pub rms: f64,
    /// What the noise alone would give, µm.
    pub expected_rms: f64,
}

/// A slope common to the channels of one position of the spindle, against that of all others, if it were
/// free: zero for a rigid artefact.
#[derive(Debug, Clone, PartialEq)]
pub struct PositionSlope {
    /// Its name, such as `beta_0`.
    pub name: String,
    /// rad.
    pub value: Value,
}

/// The closures of the forms, from the residuals and the noise of a reading (µm, by channel).
pub(super) fn profiles(
    design: &Design,
    determined: &Determined,
    problem: &DesignProblem,
    residuals: &[Vec<f64>],
    sigmas: &[f64],
) -> Vec<DesignClosure> {
    determined
        .forms
        .closures()
        .into_iter()
        .map(|weights| {
            let channels: Vec<usize> = (0..weights.len()).filter(|c| weights[*c] != 0.0).collect();
            let is_four = channels.len() == 4 && channels.iter().all(|c| weights[*c].abs() == 1.0);
            let scale = if is_four { 0.25 } else { 1.0 };
            let terms: Vec<(String, f64)> = channels
                .iter()
                .map(|c| (design.channels()[*c].name.clone(), weights[*c]))
                .collect();
            let name = match is_four {
                true => format!("({})/4", words::sum(&terms)),
                false => words::sum(&terms),
            };
            let scaled: Vec<(usize, f64)> =
                channels.iter().map(|c| (*c, scale * weights[*c])).collect();
            let (x, profile, variance) = profile(problem, residuals, sigmas, &scaled);
            let count = profile.len().max(1) as f64;
            DesignClosure {
                name,
                rms: (profile.iter().map(|v| v * v).sum::<f64>() / count).sqrt(),
                expected_rms: (variance / count).sqrt(),
                x,
                profile,
            }
        })
        .collect()
}

/// Point by point where the traces share their positions, otherwise by means over the cells of the
/// forms; and the sum over the points of their variance by the noise alone, µm².
fn profile(
    problem: &DesignProblem,
    residuals: &[Vec<f64>],
    sigmas: &[f64],
    weights: &[(usize, f64)],
) -> (Vec<f64>, Vec<f64>, f64) {
    let traces = problem.traces;
    let shared = weights
        .iter()
        .all(|(c, _)| traces[*c].x == traces[weights[0].0].x);
    let edges: Vec<f64> = if shared {
        let first = &traces[weights[0].0].x;
        first
            .chunk_by(|a, b| a == b)
            .map(|place| place[0])
            .collect()
    } else {
        let breaks = problem.splines.finest();
        breaks[..breaks.len() - 1].to_vec()
    };
    let (mut x, mut profile, mut variance) = (Vec::new(), Vec::new(), 0.0);
    let mut at = vec![0; weights.len()];
    for k in 0..edges.len() {
        let (mut sum, mut place, mut own, mut complete) = (0.0, 0.0, 0.0, true);
        for (at, (c, weight)) in at.iter_mut().zip(weights) {
            let trace = &traces[*c];
            let to = match edges.get(k + 1) {
                Some(next) => trace.x.partition_point(|x| x < next).max(*at),
                None => trace.len(),
            };
            let count = (to - *at) as f64;
            complete &= to > *at;
            sum += weight * residuals[*c][*at..to].iter().sum::<f64>() / count;
            place += trace.x[*at..to].iter().sum::<f64>() / count / weights.len() as f64;
            own += (weight * sigmas[*c]).powi(2) / count;
            *at = to;
        }
        if complete {
            x.push(place);
            profile.push(sum);
            variance += own;
        }
    }
    (x, profile, variance)
}

/// The slopes of the positions, each released by itself.
pub(super) fn slopes(
    problem: &DesignProblem,
    result: &StructuredFit,
    scatter: &Scatter,
) -> Vec<PositionSlope> {
    problem
        .layout
        .closures()
        .filter_map(|index| {
            let (value, covariance) = result.released(problem, index)?;
            let own = covariance.variance(&[], &[(index, 1.0)]);
            // The slope takes its part of the sum of squares, and one degree of freedom.
            let scatter = scatter.released(value * value / own);
            let (std, _) = scatter.spread(&covariance, &[], &[(index, 1.0)]);
            Some(PositionSlope {
                name: problem.layout.names[index].clone(),
                value: Value { value, std },
            })
        })
        .collect()
}
