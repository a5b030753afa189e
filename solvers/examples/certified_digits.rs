//! The table of digits on NIST's certified regression problems, one line a fit.
//!
//! `cargo run --release -p errsep-solvers --example certified_digits [gn|more|nielsen|dogleg]`
//! reads the data sets from `../shared/data/nist_strd` or the folder `nist_strd` in `ERRSEP_DATA`.
//! Columns: data set, start, digits of the worst parameter, of the worst standard deviation, of the
//! residual standard deviation, iterations, evaluations of residuals and of Jacobians, microseconds,
//! ending.

use std::time::Instant;

use errsep_solvers::{Damping, Method, Options, fit};
use errsep_standard_problems::strd::{self, NAMES, matching_digits, worst_digits};
use nalgebra::DVector;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let method = match std::env::args().nth(1).as_deref() {
        None | Some("more") => Method::LevenbergMarquardt(Damping::More),
        Some("nielsen") => Method::LevenbergMarquardt(Damping::Nielsen),
        Some("gn") => Method::GaussNewton,
        Some("dogleg") => Method::Dogleg,
        Some(other) => return Err(format!("no method is called {other}").into()),
    };
    let Some(folder) = strd::folder() else {
        println!("skipped: no folder nist_strd, see ERRSEP_DATA");
        return Ok(());
    };
    let options = Options::with_method(method);
    for name in NAMES {
        let problem = strd::read(&folder, name)?;
        for (k, start) in problem.starts.iter().enumerate() {
            let begun = Instant::now();
            let fit = fit(&problem, DVector::from_column_slice(start), &options)?;
            let microseconds = begun.elapsed().as_secs_f64() * 1e6;
            let covariance = fit.covariance().scaled_by_residuals();
            let deviations = covariance.map_or(0.0, |c| {
                worst_digits(c.standard_uncertainties().as_slice(), &problem.deviations)
            });
            let residual = fit.residual_deviation().unwrap_or(f64::NAN);
            println!(
                "{name:9} {} {:4.1} {:4.1} {:4.1} {:4} {:4} {:4} {:8.0} {}",
                k + 1,
                worst_digits(fit.parameters.as_slice(), &problem.parameters),
                deviations,
                matching_digits(residual, problem.residual_deviation),
                fit.iterations,
                fit.residual_evaluations,
                fit.jacobian_evaluations,
                microseconds,
                fit.ending
            );
        }
    }
    Ok(())
}
