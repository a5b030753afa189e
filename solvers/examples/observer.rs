//! An observer of one's own, that prints how the fit gets on.
//!
//! `cargo run -p errsep-solvers --example observer`

use errsep_solvers::argmin::core::observers::{Observe, ObserverMode};
use errsep_solvers::argmin::core::{Error, KV, State};
use errsep_solvers::{FitState, NoValue, Options, Problem, fit_with};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

struct Progress;

impl Observe<FitState> for Progress {
    fn observe_iter(&mut self, state: &FitState, report: &KV) -> Result<(), Error> {
        let gain = report.get("gain").and_then(|value| value.get_float());
        println!(
            "iteration {:2}: cost {:.6e}, gain {}",
            state.get_iter() + 1,
            state.get_cost(),
            gain.map_or("-".to_string(), |gain| format!("{gain:.3}"))
        );
        Ok(())
    }
}

/// Rosenbrock's curved valley.
struct Valley;

impl Problem for Valley {
    fn parameter_count(&self) -> usize {
        2
    }

    fn residual_count(&self) -> usize {
        2
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        Ok(dvector![10.0 * (p[1] - p[0] * p[0]), 1.0 - p[0]])
    }

    fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        Ok(dmatrix![-20.0 * p[0], 10.0; -1.0, 0.0])
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let fit = fit_with(
        &Valley,
        dvector![-1.2, 1.0],
        &Options::default(),
        |executor| executor.add_observer(Progress, ObserverMode::Always),
    )?;
    println!("{} at {:?}", fit.ending, fit.parameters.as_slice());
    Ok(())
}
