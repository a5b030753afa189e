//! A run that is killed on the way and continues from its checkpoint.
//!
//! `cargo run -p errsep-solvers --example checkpoint`

use errsep_solvers::argmin::core::observers::{Observe, ObserverMode};
use errsep_solvers::argmin::core::{Error, KV, State};
use errsep_solvers::{CheckpointFile, FitState, NoValue, Options, Problem, fit_with};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

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

/// Stands for the power cut.
struct PowerCut;

impl Observe<FitState> for PowerCut {
    fn observe_iter(&mut self, state: &FitState, _: &KV) -> Result<(), Error> {
        match state.get_iter() {
            5 => Err(Error::msg("the power is gone")),
            _ => Ok(()),
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = std::env::temp_dir().join(format!("errsep-checkpoint-{}", std::process::id()));
    let (start, options) = (dvector![-1.2, 1.0], Options::default());

    let killed = fit_with(&Valley, start.clone(), &options, |executor| {
        executor
            .checkpointing(CheckpointFile::new(&file, 1))
            .add_observer(PowerCut, ObserverMode::Always)
    });
    if let Err(error) = killed {
        println!("{error}");
    }
    let fit = fit_with(&Valley, start, &options, |executor| {
        executor.checkpointing(CheckpointFile::new(&file, 1))
    })?;
    println!("{} after {} iterations in all", fit.ending, fit.iterations);
    std::fs::remove_file(file)?;
    Ok(())
}
