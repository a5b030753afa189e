//! The same problem with a dense Jacobian, for dense methods and as a check of the structured one.

use errsep_solvers::linear::banded::Tall;
use errsep_solvers::problem::{NoValue, Problem};
use errsep_solvers::structured::Parameters;
use nalgebra::{DMatrix, DVector};

use super::problem::Reversal;

/// A reversal whose unknowns are the coefficients, the tilts, the offsets and (where it is fitted)
/// the thickness; the lines of the gauge follow from the coefficients.
#[derive(Debug, Clone)]
pub struct DenseReversal<'a> {
    problem: &'a Reversal<'a>,
    /// Border unknowns that are parameters here.
    kept: Vec<usize>,
    /// Border unknowns that follow from the coefficients, one a constraint.
    lines: Vec<usize>,
}

impl<'a> DenseReversal<'a> {
    /// The dense view of a problem.
    pub fn new(problem: &'a Reversal<'a>) -> Self {
        let unknowns = &problem.unknowns;
        let lines = unknowns.lines();
        let kept = unknowns.kept();
        Self {
            problem,
            kept,
            lines,
        }
    }

    /// The dense parameters of a point.
    pub fn parameters_of(&self, at: &Parameters) -> DVector<f64> {
        let band = at.band.iter().copied();
        let border = self.kept.iter().map(|j| at.border[*j]);
        DVector::from_vec(band.chain(border).collect())
    }

    /// The point of dense parameters.
    pub fn point_of(&self, parameters: &DVector<f64>) -> Parameters {
        let n = self.problem.unknowns.band_count();
        let mut at = Parameters::zeros(n, self.problem.unknowns.border_count());
        at.band.copy_from_slice(&parameters.as_slice()[..n]);
        for (l, j) in self.kept.iter().enumerate() {
            at.border[*j] = parameters[n + l];
        }
        let missing = self.problem.gauge().missing(&at.band, &at.border);
        for (line, m) in self.lines.iter().zip(missing.iter()) {
            at.border[*line] = -m;
        }
        at
    }
}

impl Problem for DenseReversal<'_> {
    fn parameter_count(&self) -> usize {
        self.problem.unknowns.band_count() + self.kept.len()
    }

    fn residual_count(&self) -> usize {
        self.problem.channels.iter().map(|c| c.len()).sum()
    }

    fn residuals(&self, parameters: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        let channels = self.problem.residuals(&self.point_of(parameters))?;
        let weighted = channels
            .iter()
            .zip(&self.problem.weights)
            .flat_map(|(residuals, weight)| residuals.iter().map(move |r| -weight * r));
        Ok(DVector::from_iterator(self.residual_count(), weighted))
    }

    fn jacobian(&self, parameters: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        let n = self.problem.unknowns.band_count();
        let mut jacobian = DMatrix::zeros(self.residual_count(), self.parameter_count());
        let starts = self.problem.row_starts();
        let gauge = &self.problem.gauge().band;
        let mut border = vec![0.0; self.problem.unknowns.border_count()];
        self.problem.for_each_batch(
            &self.point_of(parameters),
            |c, first, band, shares, batch: &Tall| {
                for row in 0..batch.rows() {
                    let at = starts[c] + first + row;
                    for (l, unknown) in band.iter().enumerate() {
                        if let Some(j) = unknown {
                            jacobian[(at, *j)] += batch.column(l)[row];
                        }
                    }
                    border.fill(0.0);
                    for share in shares {
                        border[share.unknown as usize] +=
                            share.weight * batch.column(share.column as usize)[row];
                    }
                    for (l, j) in self.kept.iter().enumerate() {
                        jacobian[(at, n + l)] = border[*j];
                    }
                    for (line, weights) in self.lines.iter().zip(gauge) {
                        let through = border[*line];
                        if through != 0.0 {
                            for (j, w) in weights.iter().enumerate() {
                                jacobian[(at, j)] += through * w;
                            }
                        }
                    }
                }
            },
        )?;
        Ok(jacobian)
    }
}
