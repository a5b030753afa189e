//! The forms: tilt out of every trace, all on one grid, combined.

use super::designs::Designs;
use super::gauge::LinePart;
use super::grid::Grid;
use super::joint::Joint;
use super::line::Line;
use super::resample::{Interpolation, resample};
use super::rotation::{Removal, rotated, sheared};
use super::trace::Trace;
use super::{FORMS, Form, NoSolution};

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

/// What every channel leaves at the positions where that tells the forms apart.
pub(super) struct Together {
    pub(super) x: Vec<f64>,
    /// Place of each position in the grid.
    kept: Vec<usize>,
    /// By trace and position.
    rests: Vec<Vec<f64>>,
    /// Which traces have a value, by position.
    subsets: Vec<usize>,
    gauge: LinePart,
}

/// What the sheared traces leave on the grid.
pub(super) fn sheared_together(grid: &Grid, joint: &Joint, gauge: LinePart) -> Together {
    Together {
        x: grid.x.clone(),
        kept: (0..grid.x.len()).collect(),
        rests: joint.rests.clone(),
        subsets: grid.subsets.clone(),
        gauge,
    }
}

/// What the rotated traces leave: their points lie beside the grid and are interpolated back.
pub(super) fn rotated_together(
    grid: &Grid,
    designs: &Designs,
    profiles: &[Profile],
    gauge: LinePart,
    how: Interpolation,
) -> Result<Together, NoSolution> {
    let values: Vec<Vec<Option<f64>>> = profiles
        .iter()
        .zip(&grid.sights)
        .map(|((x, y), sights)| {
            let rotated = resample(x, y, &grid.x, how).into_iter();
            rotated
                .zip(sights)
                .map(|(v, s)| v.filter(|_| s.is_some()))
                .collect()
        })
        .collect();
    let mut together = Together {
        x: Vec::new(),
        kept: Vec::new(),
        rests: vec![Vec::new(); profiles.len()],
        subsets: Vec::new(),
        gauge,
    };
    for (k, x) in grid.x.iter().enumerate() {
        let has = |c: usize| values[c][k].is_some();
        let subset = (0..profiles.len())
            .filter(|c| has(*c))
            .fold(0, |s, c| s | (1 << c));
        if designs.weights(subset).is_none() {
            continue;
        }
        together.x.push(*x);
        together.kept.push(k);
        together.subsets.push(subset);
        for (rest, own) in together.rests.iter_mut().zip(&values) {
            rest.push(own[k].unwrap_or(0.0));
        }
    }
    let positions = designs.fewest(&together.subsets);
    if positions < 3 {
        return Err(NoSolution::NoOverlap { positions });
    }
    if together.x.len() < grid.x.len() {
        together.gauge = LinePart::over(&together.x);
    }
    Ok(together)
}

impl Together {
    /// Σ weight·rest over the channels at a position, and its variance for noise 1.
    fn at(&self, k: usize, weights: &[f64], joint: &Joint) -> (f64, f64) {
        let terms = self.rests.iter().zip(weights);
        let value = terms.map(|(rest, w)| w * rest[k]).sum();
        (value, joint.variance(self.kept[k], weights))
    }

    /// The forms, in the gauge.
    pub(super) fn forms(&self, designs: &Designs, joint: &Joint, sigma: f64) -> Vec<Form> {
        let combinations = designs.combinations().iter().enumerate();
        combinations
            .map(|(j, combination)| {
                let (mut values, variances): (Vec<f64>, Vec<f64>) = (0..self.x.len())
                    .filter_map(|k| {
                        let weights = designs.weights(self.subsets[k])?.get(j)?;
                        Some(self.at(k, weights, joint))
                    })
                    .unzip();
                self.gauge.remove(&self.x, &mut values);
                Form {
                    name: combination.name(&FORMS),
                    values,
                    std: variances.iter().map(|v| sigma * v.sqrt()).collect(),
                    combination: combination.clone(),
                }
            })
            .collect()
    }

    /// The closure profile without its line, at the positions that all four channels have: positions,
    /// values, variances for noise 1.
    pub(super) fn closure(
        &self,
        designs: &Designs,
        joint: &Joint,
    ) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let (mut x, mut values, mut variances) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..self.x.len() {
            if let Some(weights) = designs.closing(self.subsets[k]) {
                let (value, variance) = self.at(k, weights, joint);
                x.push(self.x[k]);
                values.push(value);
                variances.push(variance);
            }
        }
        LinePart::alike(&x, |_| true).remove(&x, &mut values);
        (x, values, variances)
    }
}
