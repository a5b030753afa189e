//! Two exponentials by variable projection: rates need a start, amplitudes and offset do not.
//!
//! `cargo run -p errsep-solvers --example separable`

use errsep_solvers::{NoValue, Options, ProjectedJacobian, SeparableProblem, fit_separable};
use nalgebra::{DMatrix, DVector, dvector};

struct TwoDecays {
    times: DVector<f64>,
    readings: DVector<f64>,
}

impl SeparableProblem for TwoDecays {
    fn nonlinear_count(&self) -> usize {
        2
    }

    fn linear_count(&self) -> usize {
        3
    }

    fn observations(&self) -> &DVector<f64> {
        &self.readings
    }

    fn basis(&self, rates: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        Ok(DMatrix::from_fn(self.times.len(), 3, |i, j| match j {
            0 => 1.0,
            _ => (-rates[j - 1] * self.times[i]).exp(),
        }))
    }

    fn basis_derivative(&self, rates: &DVector<f64>, k: usize) -> Result<DMatrix<f64>, NoValue> {
        Ok(DMatrix::from_fn(self.times.len(), 3, |i, j| {
            if j == k + 1 {
                -self.times[i] * (-rates[k] * self.times[i]).exp()
            } else {
                0.0
            }
        }))
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let times = DVector::from_fn(60, |i, _| 0.1 * i as f64);
    let readings = times.map(|t| 0.3 + 2.0 * (-0.4 * t).exp() - 1.5 * (-2.5 * t).exp());
    let problem = TwoDecays { times, readings };
    let start = dvector![0.1, 1.0];
    let fit = fit_separable(
        &problem,
        start,
        ProjectedJacobian::Kaufman,
        &Options::default(),
    )?;
    println!("{} after {} iterations", fit.ending, fit.iterations);
    for (name, value) in fit.names.iter().zip(fit.parameters.iter()) {
        println!("{name} = {value:.6}");
    }
    Ok(())
}
