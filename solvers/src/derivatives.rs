//! Derivatives by differences: to check a Jacobian, or to do without one.

use std::fmt;

use nalgebra::{DMatrix, DVector};

use crate::problem::{NoValue, Problem};

/// ∂r/∂p by central differences, m × n, with relative error of about 1e-10 for smooth residuals.
///
/// The step is ε^(1/3) of each parameter, or of 1 for a parameter that is zero. A fit that uses
/// this Jacobian should raise `rank_tolerance` to about 1e-7.
///
/// # Errors
/// [`NoValue`] where the residuals are not defined on either side, or change their number.
pub fn central_differences(
    residuals: impl Fn(&DVector<f64>) -> Result<DVector<f64>, NoValue>,
    parameters: &DVector<f64>,
) -> Result<DMatrix<f64>, NoValue> {
    let step = f64::EPSILON.cbrt();
    differences(&residuals, parameters, step, |at, j, h| {
        Ok((along(at, parameters, j, h)? - along(at, parameters, j, -h)?) / (2.0 * h))
    })
}

/// Differences with an error of order h⁴, to check others with.
fn careful_differences(
    residuals: impl Fn(&DVector<f64>) -> Result<DVector<f64>, NoValue>,
    parameters: &DVector<f64>,
    step: f64,
) -> Result<DMatrix<f64>, NoValue> {
    differences(&residuals, parameters, step, |at, j, h| {
        let near = along(at, parameters, j, h)? - along(at, parameters, j, -h)?;
        let far = along(at, parameters, j, 2.0 * h)? - along(at, parameters, j, -2.0 * h)?;
        Ok((near * 8.0 - far) / (12.0 * h))
    })
}

fn along<F>(residuals: &F, p: &DVector<f64>, j: usize, by: f64) -> Result<DVector<f64>, NoValue>
where
    F: Fn(&DVector<f64>) -> Result<DVector<f64>, NoValue>,
{
    let mut moved = p.clone();
    moved[j] += by;
    residuals(&moved)
}

fn differences<F>(
    residuals: &F,
    parameters: &DVector<f64>,
    relative_step: f64,
    slope: impl Fn(&F, usize, f64) -> Result<DVector<f64>, NoValue>,
) -> Result<DMatrix<f64>, NoValue>
where
    F: Fn(&DVector<f64>) -> Result<DVector<f64>, NoValue>,
{
    let rows = residuals(parameters)?.len();
    let mut jacobian = DMatrix::zeros(rows, parameters.len());
    for j in 0..parameters.len() {
        let size = parameters[j].abs();
        // A power of two times ε: p + h − p is h exactly only for such steps.
        let wanted = relative_step * if size > 0.0 { size } else { 1.0 };
        let step = wanted.log2().round().exp2();
        let column = slope(residuals, j, step)?;
        if column.len() != rows {
            return Err(NoValue::new(
                "the number of residuals changes with the parameters",
            ));
        }
        jacobian.set_column(j, &column);
    }
    Ok(jacobian)
}

/// A Jacobian beside its differences.
#[derive(Debug, Clone)]
pub struct JacobianCheck {
    /// The Jacobian that the problem gives, m × n.
    pub given: DMatrix<f64>,
    /// The one found by differences, m × n.
    pub differences: DMatrix<f64>,
    /// For each parameter the largest disagreement of its column, relative to the column's
    /// largest entry, and the residual where it is.
    pub worst_by_parameter: Vec<(f64, usize)>,
    /// The parameters' names.
    pub names: Vec<String>,
}

/// Compares a problem's Jacobian with differences at some parameters.
///
/// Each column is held against differences over two steps, one where rounding and truncation meet
/// for a parameter of the size of its effect, ε^(1/5), and a sixteenth of that for narrow features;
/// the better agreement counts. Disagreements of 1e-8 and less are those of the differences; a wrong derivative shows as 0.1 or
/// more.
///
/// # Errors
/// [`NoValue`] where residuals or Jacobian are not defined, or the Jacobian has the wrong shape.
pub fn check_jacobian<P: Problem + ?Sized>(
    problem: &P,
    parameters: &DVector<f64>,
) -> Result<JacobianCheck, NoValue> {
    let given = problem.jacobian(parameters)?;
    let step = f64::EPSILON.powf(0.2);
    let mut differences = careful_differences(|p| problem.residuals(p), parameters, step)?;
    let finer = careful_differences(|p| problem.residuals(p), parameters, step / 16.0)?;
    if given.shape() != differences.shape() {
        return Err(NoValue::new(format!(
            "the Jacobian is {} by {} where {} by {} is needed",
            given.nrows(),
            given.ncols(),
            differences.nrows(),
            differences.ncols()
        )));
    }
    for j in 0..given.ncols() {
        let (coarse, _) = worst_of_column(&given, &differences, j);
        let (fine, _) = worst_of_column(&given, &finer, j);
        if fine < coarse {
            differences.set_column(j, &finer.column(j));
        }
    }
    let worst_by_parameter = (0..given.ncols())
        .map(|j| worst_of_column(&given, &differences, j))
        .collect();
    let names = (0..given.ncols())
        .map(|j| problem.parameter_name(j))
        .collect();
    Ok(JacobianCheck {
        given,
        differences,
        worst_by_parameter,
        names,
    })
}

fn worst_of_column(given: &DMatrix<f64>, found: &DMatrix<f64>, j: usize) -> (f64, usize) {
    let largest = given.column(j).amax().max(found.column(j).amax());
    let mut worst = (0.0, 0);
    for i in 0..given.nrows() {
        let difference = (given[(i, j)] - found[(i, j)]).abs();
        let share = if largest > 0.0 {
            difference / largest
        } else {
            0.0
        };
        if share > worst.0 || share.is_nan() {
            worst = (share, i);
        }
    }
    worst
}

impl JacobianCheck {
    /// The largest relative disagreement of all.
    pub fn worst(&self) -> f64 {
        let shares = self.worst_by_parameter.iter().map(|(share, _)| *share);
        shares.fold(0.0, |a, b| if b.is_nan() { b } else { f64::max(a, b) })
    }
}

impl fmt::Display for JacobianCheck {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "largest disagreement of each column, relative to its largest entry"
        )?;
        for (j, (share, i)) in self.worst_by_parameter.iter().enumerate() {
            writeln!(
                f,
                "{:>20}  {share:8.1e}  at residual {i}: given {:+.9e}, by differences {:+.9e}",
                self.names[j],
                self.given[(*i, j)],
                self.differences[(*i, j)]
            )?;
        }
        Ok(())
    }
}
