//! A model of one's own: an exponential decay, fitted from a rough start.
//!
//! `cargo run -p errsep-solvers --example plain`

use errsep_solvers::{NoValue, Options, Problem, fit};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

struct Decay {
    times: Vec<f64>,
    readings: Vec<f64>,
}

impl Problem for Decay {
    fn parameter_count(&self) -> usize {
        2
    }

    fn residual_count(&self) -> usize {
        self.times.len()
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        let model = |t: &f64| p[0] * (-p[1] * t).exp();
        let rows = self.times.iter().zip(&self.readings);
        Ok(DVector::from_iterator(
            rows.len(),
            rows.map(|(t, y)| model(t) - y),
        ))
    }

    fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        let rows: Vec<_> = self
            .times
            .iter()
            .map(|t| dmatrix![(-p[1] * t).exp(), -p[0] * t * (-p[1] * t).exp()])
            .map(|row| row.row(0).into_owned())
            .collect();
        Ok(DMatrix::from_rows(&rows))
    }

    fn parameter_name(&self, index: usize) -> String {
        ["amplitude", "rate"][index].to_string()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let decay = Decay {
        times: vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0],
        readings: vec![2.02, 1.21, 0.75, 0.44, 0.28, 0.16],
    };
    let fit = fit(&decay, dvector![1.0, 1.0], &Options::default())?;
    println!("{}", fit.ending);
    let covariance = fit
        .covariance()
        .scaled_by_residuals()
        .ok_or("no degrees of freedom")?;
    for (j, name) in fit.names.iter().enumerate() {
        let uncertainty = covariance.standard_uncertainty(j);
        println!(
            "{name} = {:.4} with standard uncertainty {uncertainty:.4}",
            fit.parameters[j]
        );
    }
    Ok(())
}
