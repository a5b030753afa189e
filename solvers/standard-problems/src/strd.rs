//! NIST Statistical Reference Datasets, nonlinear regression: 27 problems, two starts each.
//!
//! The files stay where the reader has them. Each gives starts, certified parameters with their
//! standard deviations to 11 digits, the residual sum of squares and the data.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use errsep_solvers::{NoValue, Problem};
use nalgebra::{DMatrix, DVector};

use crate::dual::{Dual, Scalar};

mod models;

pub use models::{NAMES, model};

/// A model over plain numbers: parameters, predictors, prediction.
pub type Values = fn(&[f64], &[f64]) -> f64;
/// The same model over dual numbers.
pub type Duals = fn(&[Dual], &[f64]) -> Dual;

/// One problem as certified.
#[derive(Debug, Clone)]
pub struct Certified {
    /// Name of the data set.
    pub name: String,
    /// The two certified starts, each of length n.
    pub starts: [Vec<f64>; 2],
    /// Certified parameters, length n.
    pub parameters: Vec<f64>,
    /// Certified standard deviations of the parameters, length n.
    pub deviations: Vec<f64>,
    /// Certified residual standard deviation.
    pub residual_deviation: f64,
    /// The response, as the model predicts it.
    responses: Vec<f64>,
    /// Predictors of each observation.
    predictors: Vec<Vec<f64>>,
    values: Values,
    duals: Duals,
}

/// The folder of the data sets: `nist_strd` in the folder that `ERRSEP_DATA` names, else in
/// `../shared/data` beside the workspace; `None` where that is absent.
pub fn folder() -> Option<PathBuf> {
    let data = env::var_os("ERRSEP_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        PathBuf::from,
    );
    let folder = data.join("nist_strd");
    folder.is_dir().then_some(folder)
}

/// Reads one data set.
///
/// # Errors
/// A sentence with the file and what is wrong with it.
pub fn read(folder: &Path, name: &str) -> Result<Certified, String> {
    let path = folder.join(format!("{name}.dat"));
    let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let (values, duals) = model(name).ok_or_else(|| format!("no model is known for {name}"))?;
    let wrong = |what: &str| format!("{}: {what}", path.display());

    let mut starts = [Vec::new(), Vec::new()];
    let (mut parameters, mut deviations) = (Vec::new(), Vec::new());
    let mut residual_deviation = None;
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut in_data = false;
    for line in text.lines() {
        let trimmed = line.trim();
        if let Some(rest) = trimmed.strip_prefix("Residual Standard Deviation:") {
            residual_deviation = rest.trim().parse().ok();
        } else if let Some((_, rest)) = parameter_line(trimmed) {
            let numbers = numbers(rest).ok_or_else(|| wrong("a parameter that is no number"))?;
            let [first, second, value, deviation] = numbers[..] else {
                return Err(wrong("a parameter without two starts, value and deviation"));
            };
            starts[0].push(first);
            starts[1].push(second);
            parameters.push(value);
            deviations.push(deviation);
        } else if trimmed.starts_with("Data:") {
            in_data = trimmed.contains('y') && !trimmed.contains("Response");
        } else if in_data && !trimmed.is_empty() {
            rows.push(numbers(trimmed).ok_or_else(|| wrong("a reading that is no number"))?);
        }
    }
    if parameters.is_empty() || rows.len() <= parameters.len() {
        return Err(wrong("parameters or data are missing"));
    }
    Ok(Certified {
        name: name.to_string(),
        starts,
        parameters,
        deviations,
        residual_deviation: residual_deviation
            .ok_or_else(|| wrong("the residual standard deviation is missing"))?,
        responses: rows
            .iter()
            // Nelson's model is of the logarithm of the response.
            .map(|row| {
                if name == "Nelson" {
                    row[0].ln()
                } else {
                    row[0]
                }
            })
            .collect(),
        predictors: rows.iter().map(|row| row[1..].to_vec()).collect(),
        values,
        duals,
    })
}

/// Splits "b3 = …" into the parameter's number and the rest.
fn parameter_line(line: &str) -> Option<(usize, &str)> {
    let (name, rest) = line.split_once('=')?;
    let index = name.trim().strip_prefix('b')?.parse().ok()?;
    Some((index, rest))
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split_whitespace()
        .map(|word| word.parse().ok())
        .collect()
}

impl Certified {
    /// Responses, as the model predicts them.
    pub fn responses(&self) -> &[f64] {
        &self.responses
    }

    /// Predictors of each observation.
    pub fn predictors(&self) -> &[Vec<f64>] {
        &self.predictors
    }
}

impl Problem for Certified {
    fn parameter_count(&self) -> usize {
        self.parameters.len()
    }

    fn residual_count(&self) -> usize {
        self.responses.len()
    }

    fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
        Ok(DVector::from_fn(self.responses.len(), |i, _| {
            (self.values)(p.as_slice(), &self.predictors[i]) - self.responses[i]
        }))
    }

    fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
        let parameters = dual_parameters(p);
        let mut jacobian = DMatrix::zeros(self.responses.len(), p.len());
        for (i, predictors) in self.predictors.iter().enumerate() {
            let at = (self.duals)(&parameters, predictors);
            for j in 0..p.len() {
                jacobian[(i, j)] = at.gradient[j];
            }
        }
        Ok(jacobian)
    }

    fn parameter_name(&self, index: usize) -> String {
        format!("b{}", index + 1)
    }
}

/// Parameters as dual numbers.
pub(crate) fn dual_parameters(p: &DVector<f64>) -> Vec<Dual> {
    p.iter()
        .enumerate()
        .map(|(j, &value)| Dual::parameter(value, j))
        .collect()
}

/// Digits that a value shares with a certified one: −log₁₀ of the relative error, at most the 11
/// digits that are certified.
pub fn matching_digits(value: f64, certified: f64) -> f64 {
    const CERTIFIED: f64 = 11.0;
    if value == certified {
        return CERTIFIED;
    }
    let error = if certified == 0.0 {
        value.abs()
    } else {
        ((value - certified) / certified).abs()
    };
    if error.is_nan() {
        return 0.0;
    }
    (-error.log10()).clamp(0.0, CERTIFIED)
}

/// The fewest digits shared by any entry of two lists.
pub fn worst_digits(values: &[f64], certified: &[f64]) -> f64 {
    values
        .iter()
        .zip(certified)
        .map(|(&value, &truth)| matching_digits(value, truth))
        .fold(11.0, f64::min)
}

/// The value alone of a scalar expression, for models that branch.
pub(crate) fn polynomial<T: Scalar>(coefficients: &[T], x: f64) -> T {
    coefficients
        .iter()
        .rev()
        .fold(T::constant(0.0), |sum, &c| sum * x + c)
}
