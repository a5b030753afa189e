//! What the one redundancy of four channels says after a fit.

use errsep_solvers::structured::StructuredFit;

use super::problem::Reversal;
use super::readings::ChannelReadings;
use super::solution::Closure;
use crate::reversal::channel_noise::scatter::Scatter;
use crate::reversal::staged::Value;

/// The closure: the contrast the convention holds at zero, if it were released; and the closure
/// profile (R1A + R1B − R2A − R2B)/4 of the residuals.
pub fn of(
    problem: &Reversal,
    result: &StructuredFit,
    channels: &[ChannelReadings],
    residuals: &[Vec<f64>],
    scatter: &Scatter,
) -> Option<Closure> {
    let index = problem.unknowns.closure_index()?;
    let released = result.released(problem, index);
    if released.is_none() && problem.joined.is_none() {
        return None;
    }
    let slope = released.map(|(value, covariance)| {
        let own = covariance.variance(&[], &[(index, 1.0)]);
        let scatter = scatter.released(value * value / own);
        let (std, freedom) = scatter.spread(&covariance, &[], &[(index, 1.0)]);
        (Value { value, std }, freedom)
    });
    let (x, profile) = profile(problem, channels, residuals);
    let rms = (profile.iter().map(|c| c * c).sum::<f64>() / profile.len().max(1) as f64).sqrt();
    Some(Closure {
        slope: slope.map(|s| s.0),
        degrees_of_freedom: slope.map_or(f64::INFINITY, |s| s.1),
        x,
        profile,
        rms,
    })
}

/// Point by point where the four traces share their positions, otherwise by means over cells.
fn profile(
    problem: &Reversal,
    channels: &[ChannelReadings],
    residuals: &[Vec<f64>],
) -> (Vec<f64>, Vec<f64>) {
    let signed = |c: usize, i: usize| {
        let channel = &channels[c];
        channel.channel.spindle_sign() * residuals[c][i] / 4.0
    };
    let mut x = Vec::new();
    let mut closure = Vec::new();
    if channels.iter().all(|c| c.x == channels[0].x) {
        // Repeats at one position are averaged.
        let mut from = 0;
        for place in channels[0].x.chunk_by(|a, b| a == b) {
            let to = from + place.len();
            let mut sum = 0.0;
            for c in 0..channels.len() {
                for i in from..to {
                    sum += signed(c, i);
                }
            }
            x.push(place[0]);
            closure.push(sum / place.len() as f64);
            from = to;
        }
        return (x, closure);
    }
    let Some(basis) = problem.bases.first() else {
        return (x, closure);
    };
    let mut at = vec![0; channels.len()];
    for k in 0..basis.cell_count() {
        let (left, width) = basis.cell(k);
        let last = k + 1 == basis.cell_count();
        let means: Option<f64> = channels
            .iter()
            .enumerate()
            .map(|(c, channel)| {
                let from = at[c];
                let to = if last {
                    channel.len()
                } else {
                    channel.x.partition_point(|x| *x < left + width).max(from)
                };
                at[c] = to;
                (to > from)
                    .then(|| (from..to).map(|i| signed(c, i)).sum::<f64>() / (to - from) as f64)
            })
            .sum();
        if let Some(sum) = means {
            x.push(left + width / 2.0);
            closure.push(sum);
        }
    }
    (x, closure)
}
