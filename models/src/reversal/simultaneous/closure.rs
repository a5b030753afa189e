//! What the one redundancy of four channels says after a fit.

use errsep_solvers::structured::StructuredFit;
use nalgebra::DVector;

use super::gauge::range;
use super::problem::Reversal;
use super::readings::ChannelReadings;
use super::solution::{Closure, Simultaneous};
use super::unknowns::Form;
use crate::reversal::staged::Value;
use crate::reversal::straight_line;
use crate::units::mm_from_um;

/// Places at which forms are looked at to tell their straight line.
const PLACES: usize = 200;

/// A contrast of four channels is known as well as a tilt: known to so many times less, an effect in the fit takes it up
/// but for rounding.
const TAKEN_UP: f64 = 1e3;

/// The closure: the contrast the convention holds at zero, if it were released; and the closure
/// profile (R1A + R1B − R2A − R2B)/4 of the residuals. No contrast where an effect in the fit takes it up. `ends`: over how much the traces' first positions
/// spread, and their last, mm.
pub fn of(
    problem: &Reversal,
    result: &StructuredFit,
    channels: &[ChannelReadings],
    residuals: &[Vec<f64>],
    solution: &Simultaneous,
    ends: [f64; 2],
) -> Option<Closure> {
    let index = problem.unknowns.closure_index()?;
    let released = result.released(problem, index);
    if released.is_none() && problem.joined.is_none() {
        return None;
    }
    let slope = released.map(|(value, covariance)| {
        let own = covariance.variance(&[], &[(index, 1.0)]);
        let scatter = solution.scatter.released(value * value / own);
        let (std, freedom) = scatter.spread(&covariance, &[], &[(index, 1.0)]);
        let std = std.hypot(by_ends(solution, channels, ends));
        (Value { value, std }, freedom)
    });
    let of_tilts = solution
        .tilts()
        .iter()
        .map(|t| t.angle.std)
        .fold(0.0, f64::max);
    let slope = slope.filter(|(slope, _)| slope.std <= TAKEN_UP * of_tilts);
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

/// The definitional uncertainty of the contrast, rad: the forms have no straight line over the travel of all traces
/// together, and another one over that of each.
fn by_ends(solution: &Simultaneous, channels: &[ChannelReadings], ends: [f64; 2]) -> f64 {
    let unknowns = &solution.unknowns;
    let Some(contrast) = unknowns.closure.filter(|_| ends != [0.0; 2]) else {
        return 0.0;
    };
    let mut weights = vec![0.0; unknowns.forms.len()];
    for own in channels {
        let weight = contrast.sign(own.channel) / channels.len() as f64;
        weights[unknowns.side_of(own.channel)] += weight;
        if let Some(slide) = unknowns.place(Form::Slide) {
            weights[slide] += weight * own.channel.indicator_sign();
        }
    }
    let (low, high) = range(channels);
    let step = (high - low) / PLACES as f64;
    let places: Vec<f64> = (0..PLACES).map(|k| low + (k as f64 + 0.5) * step).collect();
    let of = |x: &f64| -> f64 {
        let forms = weights.iter().enumerate();
        forms
            .map(|(form, w)| w * solution.value_of(form, *x).0)
            .sum()
    };
    let profile = DVector::from_iterator(PLACES, places.iter().map(of));
    mm_from_um(straight_line::definitional_std(&profile, &places, ends))
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
