//! Any problem as one with a band and a border: its last unknowns in the border, the others in a
//! band as wide as they are many.

use errsep_solvers::Problem;
use errsep_solvers::linear::bordered::{Constraints, Share};
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{Parameters, Sink, StructuredProblem};
use nalgebra::{DMatrix, DVector};

/// Rows handed over at a time.
const BATCH: usize = 32;

/// A problem with its unknowns divided into band and border.
pub struct Divided<'a, P> {
    problem: &'a P,
    band: usize,
    border: usize,
    constraints: Constraints,
    held: Vec<bool>,
}

impl<'a, P: Problem> Divided<'a, P> {
    /// The last `border` unknowns of the problem go into the border.
    pub fn new(problem: &'a P, border: usize) -> Self {
        Self {
            problem,
            band: problem.parameter_count() - border,
            border,
            constraints: Constraints::none(border),
            held: vec![false; border],
        }
    }

    /// A point of the problem as one of this form.
    pub fn divide(&self, parameters: &[f64]) -> Parameters {
        let (band, border) = parameters.split_at(self.band);
        Parameters {
            band: band.to_vec(),
            border: border.to_vec(),
        }
    }
}

impl<P: Problem + Sync> StructuredProblem for Divided<'_, P> {
    type Prepared = (DVector<f64>, DMatrix<f64>);

    fn band_count(&self) -> usize {
        self.band
    }

    fn border_count(&self) -> usize {
        self.border
    }

    fn constraints(&self) -> &Constraints {
        &self.constraints
    }

    fn held(&self) -> &[bool] {
        &self.held
    }

    fn prepare(&self, at: &Parameters) -> Result<Self::Prepared, NoValue> {
        let point = at.joined();
        Ok((
            self.problem.residuals(&point)?,
            self.problem.jacobian(&point)?,
        ))
    }

    fn band_width(&self, _: &Self::Prepared) -> usize {
        self.band
    }

    fn task_count(&self, (residuals, _): &Self::Prepared) -> usize {
        residuals.len().div_ceil(BATCH)
    }

    fn task(
        &self,
        (residuals, jacobian): &Self::Prepared,
        index: usize,
        sink: &mut Sink,
    ) -> Result<(), NoValue> {
        let first = index * BATCH;
        let rows = BATCH.min(residuals.len() - first);
        let unknowns = self.band + self.border;
        sink.open(unknowns + 1);
        let batch = sink.batch(rows);
        for j in 0..unknowns {
            batch
                .column_mut(j)
                .copy_from_slice(&jacobian.column(j).as_slice()[first..first + rows]);
        }
        batch
            .column_mut(unknowns)
            .copy_from_slice(&residuals.as_slice()[first..first + rows]);
        sink.push();
        let shares = (0..self.border).map(|k| Share {
            column: (self.band + k) as u32,
            unknown: k as u32,
            weight: 1.0,
        });
        sink.close((0..self.band).map(Some).collect(), shares.collect(), 0);
        Ok(())
    }

    fn border_name(&self, index: usize) -> String {
        self.problem.parameter_name(self.band + index)
    }

    fn band_name(&self, index: usize) -> String {
        self.problem.parameter_name(index)
    }
}
