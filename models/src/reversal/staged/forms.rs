//! The forms: tilt out of every trace, all on one grid, combined.

use nalgebra::DMatrix;

use super::grid::{common_grid, counts_near};
use super::line::{Line, remove_line, variances_without_line};
use super::resample::{Interpolation, resample};
use super::rotation::{Removal, rotated, sheared};
use super::trace::Trace;
use super::{FORMS, Form, NoSolution};
use crate::reversal::combinations::determined;

pub(super) type Profile = (Vec<f64>, Vec<f64>);

pub(super) fn take_tilt_out(
    traces: &[Trace],
    lines: &[Line],
    removal: Removal,
    half_thickness: f64,
) -> Result<Vec<Profile>, NoSolution> {
    traces
        .iter()
        .zip(lines)
        .map(|(t, line)| match removal {
            Removal::Shear => Ok(sheared(t, line)),
            Removal::Rotation => {
                let profile = rotated(t, line, half_thickness);
                if profile.0.windows(2).all(|w| w[0] < w[1]) {
                    Ok(profile)
                } else {
                    Err(NoSolution::Folded {
                        channel: t.channel.name(),
                    })
                }
            }
        })
        .collect()
}

/// The rest of every channel on one grid.
pub(super) struct Together {
    pub(super) x: Vec<f64>,
    pub(super) rests: Vec<Vec<f64>>,
    pub(super) one_grid: bool,
}

/// All profiles on one grid: the positions that every one of them reaches.
pub(super) fn bring_together(
    traces: &[Trace],
    profiles: &[Profile],
    removal: Removal,
    how: Interpolation,
) -> Result<Together, NoSolution> {
    let (grid, one_grid) = common_grid(traces);
    if one_grid && removal == Removal::Shear {
        let rests = profiles.iter().map(|(_, y)| y.clone()).collect();
        return Ok(Together {
            x: grid,
            rests,
            one_grid,
        });
    }
    let values = profiles
        .iter()
        .map(|(x, y)| resample(x, y, &grid, how))
        .collect::<Vec<_>>();
    let reached = |k: &usize| values.iter().all(|v| v[*k].is_some());
    let kept = (0..grid.len()).filter(reached).collect::<Vec<_>>();
    if kept.len() < 3 {
        return Err(NoSolution::NoOverlap {
            positions: kept.len(),
        });
    }
    let rests = values
        .iter()
        .map(|v| kept.iter().filter_map(|&k| v[k]).collect())
        .collect();
    Ok(Together {
        x: kept.iter().map(|&k| grid[k]).collect(),
        rests,
        one_grid,
    })
}

/// The variance of each channel's mean at each position for noise 1. What interpolation averages is
/// not credited, so that the uncertainty of interpolated traces is a little too large.
pub(super) struct UnitVariances(Vec<Vec<f64>>);

impl UnitVariances {
    pub(super) fn of(traces: &[Trace], x: &[f64]) -> Self {
        Self(
            traces
                .iter()
                .map(|t| counts_near(t, x).iter().map(|n| 1.0 / n).collect())
                .collect(),
        )
    }

    pub(super) fn of_profile(&self, x: &[f64], weights: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; x.len()];
        for (variances, w) in self.0.iter().zip(weights) {
            for (s, v) in sum.iter_mut().zip(variances) {
                *s += w * w * v;
            }
        }
        variances_without_line(x, &sum)
    }
}

/// Σ weight·profile over the channels, in the gauge: without its least-squares line.
pub(super) fn combine(x: &[f64], rests: &[Vec<f64>], weights: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; x.len()];
    for (rest, w) in rests.iter().zip(weights) {
        for (s, r) in sum.iter_mut().zip(rest) {
            *s += w * r;
        }
    }
    remove_line(x, &mut sum);
    sum
}

pub(super) fn solve_forms(
    x: &[f64],
    rests: &[Vec<f64>],
    traces: &[Trace],
    unit: &UnitVariances,
    sigma: f64,
) -> Vec<Form> {
    let design = DMatrix::from_fn(traces.len(), 3, |r, c| {
        let channel = traces[r].channel;
        match c {
            0 => channel.indicator_sign(),
            1 => f64::from(u8::from(channel.is_side_a())),
            _ => f64::from(u8::from(!channel.is_side_a())),
        }
    });
    determined(&design, &[1, 2])
        .into_iter()
        .map(|combination| Form {
            name: combination.name(&FORMS),
            values: combine(x, rests, &combination.weights),
            std: unit
                .of_profile(x, &combination.weights)
                .iter()
                .map(|v| sigma * v.sqrt())
                .collect(),
            combination,
        })
        .collect()
}
