//! Bounds: a thickness that cannot be negative, and what the covariance says of it.
//!
//! `cargo run -p errsep-solvers --example bounded`

use errsep_solvers::{Bounds, NoValue, Options, Problem, central_differences, fit};
use nalgebra::{DMatrix, DVector, dvector};

/// y = slope x + thickness exp(−x), with readings that would like a negative thickness.
struct Film;

const READINGS: [f64; 8] = [-0.04, 0.48, 1.01, 1.52, 1.98, 2.51, 3.02, 3.49];

impl Problem for Film {
    fn parameter_count(&self) -> usize {
        2
    }

    fn residual_count(&self) -> usize {
        READINGS.len()
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        Ok(DVector::from_fn(READINGS.len(), |i, _| {
            let x = 0.5 * i as f64;
            p[0] * x + p[1] * (-x).exp() - READINGS[i]
        }))
    }

    fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        central_differences(|at| self.residuals(at), p)
    }

    fn parameter_name(&self, index: usize) -> String {
        ["slope", "thickness"][index].to_string()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = Options {
        bounds: Some(Bounds::none(2).with(1, 0.0, f64::INFINITY)),
        rank_tolerance: 1e-7,
        ..Options::default()
    };
    let fit = fit(&Film, dvector![0.5, 0.1], &options)?;
    println!("{}", fit.ending);
    let covariance = fit
        .covariance()
        .scaled_by_residuals()
        .ok_or("no degrees of freedom")?;
    println!(
        "slope = {:.4} ± {:.4}",
        fit.parameters[0],
        covariance.standard_uncertainty(0)
    );
    for bound in &fit.active_bounds {
        println!(
            "{} is held at its {:?} bound {}",
            bound.name, bound.side, bound.value
        );
    }
    Ok(())
}
