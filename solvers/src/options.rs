//! The settings of a fit.
//!
//! | setting | default | meaning |
//! |---|---|---|
//! | `method` | Levenberg-Marquardt, Moré's trust region | how a step is chosen, see [`Method`] |
//! | `factorization` | `Qr` | how the Jacobian is decomposed, see [`Factorization`] |
//! | `geodesic_acceleration` | `false` | adds the second-order correction of Transtrum & Sethna to damped steps: fewer iterations in narrow curved valleys for one more residual evaluation each |
//! | `loss` | `Quadratic` | robust loss, see [`Loss`] |
//! | `bounds` | none | box bounds on the parameters |
//! | `cost_tolerance` | 1e-12 | converged when the cost fell, and was predicted to fall, by less than this share |
//! | `step_tolerance` | 1e-12 | converged when a step is shorter than this share of the parameters, both in units of the Jacobian's column norms |
//! | `gradient_tolerance` | 1e-14 | converged when the cosine between the residuals and every column of the Jacobian is below this |
//! | `rank_tolerance` | 1e-13 | a direction counts as undetermined when it changes the residuals by less than this share of what the best determined one does, after scaling columns to unit length; take 1e-7 where the Jacobian comes from differences |
//! | `max_iterations` | 1000 | iterations after which the fit gives up |
//! | `time_limit` | none | time after which the fit gives up, looked at once an iteration |
//! | `initial_radius` | 3 | first trust radius of Moré's method and of dogleg, as a multiple of ‖D p‖ (MINPACK's `factor`, which is 100 there: too bold for starts far from the minimum) |
//! | `initial_damping` | 1e-3 | first damping of Nielsen's method and of `GaussNewtonFirst`, relative to the scaled normal matrix |
//! | `finish` | `Polish` | what is done once a minimum shows, see [`Finish`] |
//! | `stop` | none | a flag that another thread raises to end the fit after the running iteration |

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::bounds::Bounds;
use crate::linear::dense::Factorization;
use crate::loss::Loss;
use crate::outcome::FitError;

/// How the damping of a Levenberg-Marquardt step is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Damping {
    /// Moré's: the damping that makes the step as long as a trust radius (Moré 1978, as in
    /// MINPACK). The safest choice from far away.
    #[default]
    More,
    /// Nielsen's: the damping itself is raised and lowered by the gain ratio (Nielsen 1999,
    /// IMM-REP-1999-05). One factorisation a step, smooth changes.
    Nielsen,
}

/// How a step is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Method {
    /// The undamped step, shortened by line search: fastest near the minimum of a mildly nonlinear
    /// problem, lost where the Jacobian loses rank on the way.
    GaussNewton,
    /// The undamped step, damped with Nielsen's schedule only from where one fails: fewest
    /// evaluations where most parameters enter the model almost linearly, or the start is good.
    GaussNewtonFirst,
    /// Damped steps: the method to take when nothing is known.
    LevenbergMarquardt(Damping),
    /// Powell's dogleg between steepest descent and the undamped step: cheaper than the exact
    /// trust-region step, about as robust where the Jacobian keeps its rank.
    Dogleg,
}

impl Default for Method {
    fn default() -> Self {
        Self::LevenbergMarquardt(Damping::More)
    }
}

/// What is done once a minimum shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Finish {
    /// Undamped steps until their length no longer falls: the parameters then are exact to the
    /// rounding of the residuals instead of to that of the cost, about twice the digits.
    #[default]
    Polish,
    /// The minimum is that of the last step whose cost was computed.
    Evaluated,
    /// The first undamped step that promises to lower the cost by no more than `cost_tolerance` of it
    /// is the last: it is taken on its promise, without an evaluation after it. For problems whose
    /// every evaluation is a pass over very many rows.
    Promised,
}

/// The settings of a fit; the module's table says what each means.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Options {
    /// How a step is chosen.
    pub method: Method,
    /// How a dense Jacobian is decomposed.
    pub factorization: Factorization,
    /// Whether damped steps get the geodesic second-order correction.
    pub geodesic_acceleration: bool,
    /// The loss to minimise.
    pub loss: Loss,
    /// Box bounds on the parameters.
    pub bounds: Option<Bounds>,
    /// Relative fall of the cost that counts as none.
    pub cost_tolerance: f64,
    /// Relative step that counts as none.
    pub step_tolerance: f64,
    /// Cosine between residuals and columns of the Jacobian that counts as none.
    pub gradient_tolerance: f64,
    /// Relative size below which a direction counts as undetermined.
    pub rank_tolerance: f64,
    /// Iterations after which the fit gives up.
    pub max_iterations: u64,
    /// Time after which the fit gives up.
    pub time_limit: Option<Duration>,
    /// First trust radius as a multiple of the scaled parameters' length.
    pub initial_radius: f64,
    /// First damping of Nielsen's method, and of Gauss-Newton after a failure.
    pub initial_damping: f64,
    /// What is done once a minimum shows.
    pub finish: Finish,
    /// Ends the fit when raised.
    #[serde(skip)]
    pub stop: Option<Arc<AtomicBool>>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            method: Method::default(),
            factorization: Factorization::default(),
            geodesic_acceleration: false,
            loss: Loss::default(),
            bounds: None,
            cost_tolerance: 1e-12,
            step_tolerance: 1e-12,
            gradient_tolerance: 1e-14,
            rank_tolerance: 1e-13,
            max_iterations: 1000,
            time_limit: None,
            initial_radius: 3.0,
            initial_damping: 1e-3,
            finish: Finish::default(),
            stop: None,
        }
    }
}

impl Options {
    /// The defaults with another method.
    pub fn with_method(method: Method) -> Self {
        Self {
            method,
            ..Self::default()
        }
    }

    /// The settings for a [`StructuredProblem`](crate::structured::StructuredProblem), of whose rows
    /// every evaluation makes a pass: undamped steps first, the last one taken on its promise, at
    /// most 50 of them.
    pub fn structured() -> Self {
        Self {
            finish: Finish::Promised,
            max_iterations: 50,
            ..Self::with_method(Method::GaussNewtonFirst)
        }
    }

    /// Checks every number.
    ///
    /// # Errors
    /// [`FitError::Setting`] with the name of the first setting out of range.
    pub fn validate(&self) -> Result<(), FitError> {
        let shares = [
            ("cost_tolerance", self.cost_tolerance),
            ("step_tolerance", self.step_tolerance),
            ("gradient_tolerance", self.gradient_tolerance),
            ("rank_tolerance", self.rank_tolerance),
        ];
        for (setting, value) in shares {
            check(
                setting,
                value,
                (0.0..1.0).contains(&value),
                "at least 0 and below 1",
            )?;
        }
        let positive = [
            ("initial_radius", self.initial_radius),
            ("initial_damping", self.initial_damping),
            ("loss", self.loss.scale().unwrap_or(1.0)),
        ];
        for (setting, value) in positive {
            let good = value > 0.0 && value.is_finite();
            check(setting, value, good, "positive and finite")?;
        }
        check(
            "max_iterations",
            self.max_iterations as f64,
            self.max_iterations > 0,
            "at least 1",
        )
    }
}

fn check(
    setting: &'static str,
    value: f64,
    good: bool,
    must: &'static str,
) -> Result<(), FitError> {
    if good {
        return Ok(());
    }
    Err(FitError::Setting {
        setting,
        value: value.to_string(),
        must,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_each_bad_setting_is_named() {
        let good = Options::default();
        assert_eq!(good.validate(), Ok(()));
        let broken: [(&str, Options); 6] = [
            (
                "cost_tolerance",
                Options {
                    cost_tolerance: f64::NAN,
                    ..good.clone()
                },
            ),
            (
                "step_tolerance",
                Options {
                    step_tolerance: -1e-9,
                    ..good.clone()
                },
            ),
            (
                "rank_tolerance",
                Options {
                    rank_tolerance: 1.0,
                    ..good.clone()
                },
            ),
            (
                "initial_radius",
                Options {
                    initial_radius: 0.0,
                    ..good.clone()
                },
            ),
            (
                "loss",
                Options {
                    loss: Loss::Huber { scale: -2.0 },
                    ..good.clone()
                },
            ),
            (
                "max_iterations",
                Options {
                    max_iterations: 0,
                    ..good
                },
            ),
        ];
        for (name, options) in broken {
            match options.validate() {
                Err(FitError::Setting { setting, .. }) => assert_eq!(setting, name),
                other => panic!("{name}: {other:?}"),
            }
        }
    }
}
