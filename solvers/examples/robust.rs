//! A line through readings of which two are wrong: least squares beside robust losses.
//!
//! `cargo run -p errsep-solvers --example robust`

use errsep_solvers::{Loss, NoValue, Options, Problem, fit};
use nalgebra::{DMatrix, DVector, dvector};

struct Line {
    readings: Vec<f64>,
}

impl Problem for Line {
    fn parameter_count(&self) -> usize {
        2
    }

    fn residual_count(&self) -> usize {
        self.readings.len()
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        let rows = self.readings.iter().enumerate();
        let residuals = rows.map(|(i, y)| p[0] + p[1] * i as f64 - y);
        Ok(DVector::from_iterator(self.readings.len(), residuals))
    }

    fn jacobian(&self, _: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        let entry = |i: usize, j: usize| if j == 0 { 1.0 } else { i as f64 };
        Ok(DMatrix::from_fn(self.readings.len(), 2, entry))
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // 1 + 0.5 i with errors of 0.1, but for readings 3 and 8.
    let line = Line {
        readings: vec![
            1.08, 1.43, 2.04, 9.5, 2.97, 3.57, 3.94, 4.53, 0.2, 5.44, 6.07,
        ],
    };
    for loss in [
        Loss::Quadratic,
        Loss::Huber { scale: 0.1345 },
        Loss::SoftL1 { scale: 0.1 },
        Loss::Cauchy { scale: 0.2385 },
        Loss::Tukey { scale: 0.4685 },
    ] {
        let options = Options {
            loss,
            ..Options::default()
        };
        // Tukey's loss is flat beyond its scale: it needs a start that is nearly right.
        let fit = fit(&line, dvector![1.1, 0.48], &options)?;
        println!(
            "{loss:?}: {:.3} + {:.3} i, {}",
            fit.parameters[0], fit.parameters[1], fit.ending
        );
    }
    Ok(())
}
