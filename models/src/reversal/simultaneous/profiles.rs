//! The forms of a solution, with their bands.

use errsep_solvers::linear::bordered::BorderedCovariance;
use nalgebra::DMatrix;
use rayon::prelude::*;

use super::solution::{Profile, Simultaneous};
use super::unknowns::Form;
use crate::basis::bspline::{horner, horner_slope};
use crate::reversal::combinations::determined;

/// Names of the forms, in the order of their columns.
const FORMS: [&str; 3] = ["M", "S_A", "S_B"];

/// Weights of unknowns of band and border.
type Terms = (Vec<(usize, f64)>, Vec<(usize, f64)>);

/// What neighbouring positions of a form share.
#[derive(Default)]
struct Room {
    terms: Terms,
    /// The cell of the last position in each form.
    cells: Vec<usize>,
    /// Their weights alone.
    weights: Vec<f64>,
    /// The unknowns of the last position, band and border.
    unknowns: (Vec<usize>, Vec<usize>),
    /// Their covariance matrix for unit noise, where it is known.
    among: Option<DMatrix<f64>>,
}

impl Simultaneous {
    /// The forms, or the combinations of forms which the channels determine, at positions (mm):
    /// M on the slide, S_A and S_B on the artefact's own axis.
    pub fn forms(&self, x: &[f64]) -> Vec<Profile> {
        self.determined_forms()
            .into_iter()
            .map(|(name, weights)| {
                let at: Vec<[f64; 3]> = x
                    .par_iter()
                    .map_init(Room::default, |room, x| self.form_at(&weights, *x, room))
                    .collect();
                let beside = self.agreement.missed.max(self.cut_off(&weights));
                Profile {
                    name,
                    x: x.to_vec(),
                    values: at.iter().map(|a| a[0]).collect(),
                    std: at.iter().map(|a| a[1].hypot(beside)).collect(),
                    degrees_of_freedom: at.iter().fold(f64::INFINITY, |m, a| m.min(a[2])),
                }
            })
            .collect()
    }

    /// What the knots cut off a sum of forms, µm root mean square: zero where they were not chosen.
    fn cut_off(&self, weights: &[f64]) -> f64 {
        let Some(finer) = &self.finer else {
            return 0.0;
        };
        let weighted = weights.iter().copied().enumerate();
        let sum: Vec<(usize, f64)> = weighted.filter(|(_, w)| *w != 0.0).collect();
        finer.cut_off(&sum, |x| {
            self.form_at(weights, x, &mut Room::default())[1].powi(2)
        })
    }

    /// Names and values of the forms at positions, without their uncertainty.
    pub(super) fn form_values(&self, x: &[f64]) -> Vec<(String, Vec<f64>)> {
        self.determined_forms()
            .into_iter()
            .map(|(name, weights)| {
                let values = x.iter().map(|x| self.form_value(&weights, *x)).collect();
                (name, values)
            })
            .collect()
    }

    /// Name and weights on the fitted forms of every combination that the channels determine.
    fn determined_forms(&self) -> Vec<(String, Vec<f64>)> {
        let channels = self.channels();
        let design = DMatrix::from_fn(channels.len(), 3, |r, c| match c {
            0 => channels[r].indicator_sign(),
            1 => f64::from(u8::from(channels[r].is_side_a())),
            _ => f64::from(u8::from(!channels[r].is_side_a())),
        });
        determined(&design, &[1, 2])
            .into_iter()
            .map(|combination| {
                // Σ weight·channel, each channel a sum of the fitted forms.
                let mut weights = vec![0.0; self.unknowns.forms.len()];
                for (channel, weight) in channels.iter().zip(&combination.weights) {
                    weights[self.unknowns.side_of(*channel)] += weight;
                    if let Some(slide) = self.unknowns.place(Form::Slide) {
                        weights[slide] += weight * channel.indicator_sign();
                    }
                }
                // Weights are sums of halves and quarters: less is rounding.
                for weight in &mut weights {
                    if weight.abs() < 1e-12 {
                        *weight = 0.0;
                    }
                }
                (combination.name(&FORMS), weights)
            })
            .collect()
    }

    fn form_value(&self, weights: &[f64], x: f64) -> f64 {
        weights
            .iter()
            .enumerate()
            .filter(|(_, weight)| **weight != 0.0)
            .map(|(form, weight)| weight * self.value_of(form, x).0)
            .sum()
    }

    /// A form, the part of its standard uncertainty that the noise makes, and the degrees of freedom of that. Under white noise positions of one cell share the
    /// covariance of its coefficients.
    fn form_at(&self, weights: &[f64], x: f64, room: &mut Room) -> [f64; 3] {
        let (band, border) = &mut room.terms;
        band.clear();
        border.clear();
        room.cells.resize(weights.len(), 0);
        let mut value = 0.0;
        for (form, weight) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
            let basis = &self.bases[form];
            let k = basis.cell_near(x, room.cells[form]);
            room.cells[form] = k;
            let (left, width) = basis.cell(k);
            let t = (x - left) / width;
            value += weight * horner(&self.cubics[form][k], t);
            for (l, function) in basis.polynomials(k).iter().enumerate() {
                if let Some(j) = self.unknowns.coefficient(form, k + l) {
                    band.push((j, weight * horner(function, t)));
                }
            }
            let [height, slope] = self.unknowns.line(form);
            border.push((height, -weight));
            border.push((slope, -weight * self.axis.xi(x)));
        }
        let white = self.scatter.white();
        let (std, freedom) = match white.zip(room.variance(&self.covariance)) {
            Some(((variance, freedom), own)) => ((variance * own).sqrt(), freedom),
            None => {
                let (band, border) = &room.terms;
                self.scatter.spread(&self.covariance, band, border)
            }
        };
        [value, std, freedom]
    }

    pub(super) fn value_of(&self, form: usize, at: f64) -> (f64, f64) {
        let basis = &self.bases[form];
        let k = basis.cell_of(at);
        let (left, width) = basis.cell(k);
        let (cubic, t) = (&self.cubics[form][k], (at - left) / width);
        (horner(cubic, t), horner_slope(cubic, t) / width)
    }

    pub(super) fn push_basis(
        &self,
        form: usize,
        at: f64,
        factor: f64,
        band: &mut Vec<(usize, f64)>,
    ) {
        let (k, functions) = self.bases[form].values(at);
        for (l, function) in functions.into_iter().enumerate() {
            if let Some(j) = self.unknowns.coefficient(form, k + l) {
                band.push((j, factor * function));
            }
        }
    }
}

impl Room {
    /// The variance of the terms for unit noise, where their covariance matrix is known.
    fn variance(&mut self, covariance: &BorderedCovariance) -> Option<f64> {
        let (band, border) = &self.terms;
        let same = |terms: &[(usize, f64)], unknowns: &[usize]| {
            terms.iter().map(|t| t.0).eq(unknowns.iter().copied())
        };
        if !same(band, &self.unknowns.0) || !same(border, &self.unknowns.1) {
            self.unknowns.0 = band.iter().map(|t| t.0).collect();
            self.unknowns.1 = border.iter().map(|t| t.0).collect();
            self.among = covariance.among(&self.unknowns.0, &self.unknowns.1);
        }
        let among = self.among.as_ref()?.as_slice();
        let count = self.unknowns.0.len() + self.unknowns.1.len();
        self.weights.clear();
        self.weights.extend(band.iter().chain(border).map(|t| t.1));
        let mut sum = 0.0;
        for (column, own) in among.chunks_exact(count.max(1)).zip(&self.weights) {
            let along: f64 = column.iter().zip(&self.weights).map(|(c, w)| c * w).sum();
            sum += own * along;
        }
        Some(sum.max(0.0))
    }
}
