//! Jumps that stay, each with the moment at which it fits the repeats of its channel best. What jumps once is no noise,
//! though the repeats before it differ from those after: without it they are likelier, under the law of noise that they
//! then allow.

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::{DMatrix, DVector};

use crate::noise::contrasts::Contrasts;
use crate::noise::law::{NoiseLaw, NoiseSource};
use crate::noise::piles::{Group, groups};

/// The readings without the jump, of any channel, that a law of the noise makes likelier most without it; whether it is
/// one at all the law does not say, which may hold the jump itself.
pub(crate) fn without_jump(
    model: &AnyModel,
    readings: &DVector<f64>,
    law: &NoiseLaw,
) -> Option<DVector<f64>> {
    if law.source != NoiseSource::Repeats {
        return None;
    }
    let likelihood = |readings: &DVector<f64>| {
        let contrasts = Contrasts::of(model, readings);
        -contrasts.likelihood(&law.parts).minus_log
    };
    let jumps = model.jumps();
    let channels = 0..model.channel_names().len();
    let candidates = channels.flat_map(|channel| {
        let all = groups(model).filter(|g| g.starts.len() > 1);
        let own: Vec<Group> = all
            .filter(|g| model.places()[g.starts[0]].channel == channel)
            .collect();
        let of = |jump: &DMatrix<f64>| best(model, &own, jump, readings);
        jumps.iter().filter_map(of).collect::<Vec<_>>()
    });
    let before = likelihood(readings);
    let judged = candidates.map(|change| {
        let level = readings - change;
        (likelihood(&level) - before, level)
    });
    let best = judged.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 > 0.0).then_some(best.1)
}

/// A reading of a channel among the repeats of its cell.
struct Reading {
    row: usize,
    time: f64,
    cell: usize,
    /// Row of Q.
    steady: [f64; 2],
    /// Of Py.
    away: f64,
}

/// What a jump that fits the repeats of a channel best adds to the readings, at its best moment.
///
/// With S the columns of the jump in the later rows and P = I − QQᵀ the projector that takes off mean and steady drift of
/// repeats, as the law's contrasts do, a moment takes bᵀN⁻¹b from the squares, b = SᵀPy, N = SᵀPS. Of a cell whose
/// later rows of Q add up to q the projector leaves m − |q|² of fᵀf, so that each of the m rows adds to both as it comes in,
/// the last one first.
fn best(
    model: &AnyModel,
    own: &[Group],
    jump: &DMatrix<f64>,
    readings: &DVector<f64>,
) -> Option<DVector<f64>> {
    let (all, cells) = among_repeats(model, own, readings);
    let columns = jump.ncols();
    let (mut normal, mut along) = (
        DMatrix::<f64>::zeros(columns, columns),
        DVector::<f64>::zeros(columns),
    );
    let mut come = vec![[0.0; 2]; cells];
    let mut best: Option<(usize, f64, DVector<f64>)> = None;
    for (k, reading) in all.iter().enumerate() {
        let of_row = jump.row(reading.row).transpose();
        let q = &mut come[reading.cell];
        let before = q[0] * q[0] + q[1] * q[1];
        *q = [q[0] + reading.steady[0], q[1] + reading.steady[1]];
        let part = 1.0 - (q[0] * q[0] + q[1] * q[1] - before);
        normal.ger(part, &of_row, &of_row, 1.0);
        along.axpy(reading.away, &of_row, 1.0);
        let ends = all.get(k + 1).is_none_or(|next| next.time < reading.time);
        if let (true, Some(factor)) = (ends, normal.clone().cholesky()) {
            let sizes = factor.solve(&along);
            let gain = along.dot(&sizes);
            if best.as_ref().is_none_or(|best| gain > best.1) {
                best = Some((k + 1, gain, sizes));
            }
        }
    }
    let (count, _, sizes) = best?;
    let mut change = DVector::zeros(readings.len());
    for reading in &all[..count] {
        change[reading.row] = jump.row(reading.row).tr_dot(&sizes);
    }
    Some(change)
}

/// The readings of a channel, the last one first, and the number of its cells.
fn among_repeats(
    model: &AnyModel,
    own: &[Group],
    readings: &DVector<f64>,
) -> (Vec<Reading>, usize) {
    let places = model.places();
    let mut all: Vec<Reading> = Vec::new();
    let mut cells = 0;
    for group in own {
        let repeats = group.starts.len() as f64;
        for k in 0..group.length {
            let rows = || group.starts.iter().map(|start| start + k);
            let middle = rows().map(|row| places[row].time).sum::<f64>() / repeats;
            let spread = rows().map(|row| (places[row].time - middle).powi(2));
            let spread = spread.sum::<f64>().sqrt();
            // Of two repeats a drift would leave nothing.
            let drifts = group.starts.len() > 2 && spread > 0.0;
            let steady = |row: usize| {
                let time = places[row].time - middle;
                let drift = if drifts { time / spread } else { 0.0 };
                [repeats.sqrt().recip(), drift]
            };
            let sum = |of: usize| {
                let values = rows().map(|row| steady(row)[of] * readings[row]);
                values.sum::<f64>()
            };
            let sums = [sum(0), sum(1)];
            all.extend(rows().map(|row| {
                let steady = steady(row);
                Reading {
                    row,
                    time: places[row].time,
                    cell: cells,
                    steady,
                    away: readings[row] - steady[0] * sums[0] - steady[1] * sums[1],
                }
            }));
            cells += 1;
        }
    }
    all.sort_by(|a, b| b.time.total_cmp(&a.time));
    (all, cells)
}
