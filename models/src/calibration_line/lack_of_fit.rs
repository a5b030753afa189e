//! Lack of fit against pure error: does a linear model leave more than readings of the same place
//! scatter? (NIST/SEMATECH e-Handbook of Statistical Methods, 4.4.4.6.)

use std::collections::BTreeMap;

use errsep_solvers::linear::limited::svd;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

/// The outcome of the test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LackOfFit {
    /// Mean square of what the model misses of the cells' means, over that of the pure error.
    pub f: f64,
    /// Degrees of freedom of the numerator and of the pure error.
    pub freedom: [f64; 2],
    /// Probability of as great an F where the model is true.
    pub p_value: f64,
    /// Standard deviation of one reading from readings of the same cell.
    pub pure_error: f64,
    /// Standard deviation of the residuals of the model.
    pub residual: f64,
}

/// Tests the model whose columns are given; readings of the same cell repeat each other. None where
/// there is no pure error, no column more to spare, or dependent columns.
pub fn lack_of_fit(
    observed: &DVector<f64>,
    columns: &DMatrix<f64>,
    cells: &[usize],
) -> Option<LackOfFit> {
    let mut groups: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for (cell, value) in cells.iter().zip(observed.iter()) {
        groups.entry(*cell).or_default().push(*value);
    }
    let pure: f64 = groups
        .values()
        .map(|group| {
            let mean = group.iter().sum::<f64>() / group.len() as f64;
            group.iter().map(|v| (v - mean).powi(2)).sum::<f64>()
        })
        .sum();
    let unknowns = columns.ncols();
    let within = observed.len().checked_sub(groups.len())? as f64;
    let between = groups.len().checked_sub(unknowns)? as f64;
    if within == 0.0 || between == 0.0 || pure <= 0.0 {
        return None;
    }
    let factor = svd(columns.clone(), true, true)?;
    if factor.rank(1e-12 * factor.singular_values.amax()) < unknowns {
        return None;
    }
    let fitted = columns * factor.solve(observed, 0.0).ok()?;
    let left = (observed - fitted).norm_squared();
    let f = ((left - pure) / between).max(0.0) / (pure / within);
    let law = FisherSnedecor::new(between, within).ok()?;
    Some(LackOfFit {
        f,
        freedom: [between, within],
        p_value: law.sf(f),
        pure_error: (pure / within).sqrt(),
        residual: (left / (between + within)).sqrt(),
    })
}
