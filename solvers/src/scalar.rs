//! Searches in one unknown: the least value and the root between two places, by argmin's Brent.
//!
//! R. P. Brent, *Algorithms for Minimization without Derivatives* (1973), chapters 4 and 5.

use argmin::core::{CostFunction, Error, Executor, State};
use argmin::solver::brent::{BrentOpt, BrentRoot};

/// Evaluations at most: bisection through every number between two takes a tenth of it.
const MOST_ITERATIONS: u64 = 10_000;

/// Stands for values that are no finite number where the least is sought: above any other, and its
/// square still a number.
const HUGE: f64 = 1e150;

/// A function as argmin takes it.
struct Function<F>(F);

impl<F, E> CostFunction for Function<F>
where
    F: Fn(f64) -> Result<f64, E>,
    E: std::error::Error + Send + Sync + 'static,
{
    type Param = f64;
    type Output = f64;

    fn cost(&self, at: &f64) -> Result<f64, Error> {
        Ok((self.0)(*at)?)
    }
}

/// Why a search found nothing.
#[derive(Debug, thiserror::Error)]
pub enum NotFound<E> {
    /// The function failed.
    #[error(transparent)]
    Function(E),
    /// The ends do not bracket what is sought.
    #[error("{0}")]
    Bracket(String),
}

impl<E: std::error::Error + Send + Sync + 'static> NotFound<E> {
    fn of(error: Error) -> Self {
        match error.downcast::<E>() {
            Ok(own) => Self::Function(own),
            Err(other) => Self::Bracket(other.to_string()),
        }
    }
}

/// Where a function with one minimum between `low` and `high` is least, to `tolerance` and the rounding
/// of the place. Where it has no finite value it counts as very high.
///
/// # Errors
/// What the function failed with.
pub fn least_between<E>(
    low: f64,
    high: f64,
    tolerance: f64,
    function: impl Fn(f64) -> Result<f64, E>,
) -> Result<f64, NotFound<E>>
where
    E: std::error::Error + Send + Sync + 'static,
{
    let finite = |at: f64| {
        let value = function(at)?;
        Ok::<f64, E>(if value.is_finite() { value } else { HUGE })
    };
    let solver = BrentOpt::new(low, high).set_tolerance(4.0 * f64::EPSILON, tolerance);
    let run = Executor::new(Function(finite), solver)
        .configure(|state| state.max_iters(MOST_ITERATIONS))
        .ctrlc(false)
        .run()
        .map_err(NotFound::of)?;
    Ok(run.state.get_best_param().copied().unwrap_or(low))
}

/// Where a function that has different signs at `low` and `high` is zero, to `tolerance` and the
/// rounding of the place.
///
/// # Errors
/// [`NotFound::Bracket`] where the signs are alike; what the function failed with.
pub fn root_between<E>(
    low: f64,
    high: f64,
    tolerance: f64,
    function: impl Fn(f64) -> Result<f64, E>,
) -> Result<f64, NotFound<E>>
where
    E: std::error::Error + Send + Sync + 'static,
{
    // A value that is no number ends the search there.
    let number = |at: f64| {
        let value = function(at)?;
        Ok::<f64, E>(if value.is_nan() { 0.0 } else { value })
    };
    let run = Executor::new(Function(number), BrentRoot::new(low, high, tolerance))
        .configure(|state| state.max_iters(MOST_ITERATIONS))
        .ctrlc(false)
        .run()
        .map_err(NotFound::of)?;
    Ok(run.state.get_param().copied().unwrap_or(high))
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    fn always(value: f64) -> Result<f64, Infallible> {
        Ok(value)
    }

    #[test]
    fn least_value_and_root_are_found_to_the_tolerance() {
        let least = least_between(0.1, 5.0, 1e-9, |x| always(x - x.ln())).unwrap();
        // truncation: a least value is flat to √ε of its place
        assert!((least - 1.0).abs() < 1e-7, "{least}");
        let root = root_between(0.0, 2.0, 0.0, |x| always(x * x - 2.0)).unwrap();
        // epsilons
        assert!((root - 2f64.sqrt()).abs() <= 4.0 * f64::EPSILON, "{root}");
    }

    #[test]
    fn a_function_without_a_value_somewhere_is_searched_where_it_has_one() {
        let walled = |x: f64| {
            always(if x < 1.0 {
                f64::INFINITY
            } else {
                (x - 1.5).powi(2)
            })
        };
        let least = least_between(-3.0, 3.0, 1e-9, walled).unwrap();
        assert!((least - 1.5).abs() < 1e-7, "{least}");
    }

    #[test]
    fn ends_of_one_sign_and_a_failing_function_say_so() {
        let none = root_between(1.0, 2.0, 1e-9, always);
        assert!(matches!(none, Err(NotFound::Bracket(_))), "{none:?}");
        let failing = |_| Err::<f64, _>("x".parse::<f64>().unwrap_err());
        let failed = least_between(0.0, 1.0, 1e-9, failing);
        assert!(matches!(failed, Err(NotFound::Function(_))), "{failed:?}");
    }
}
