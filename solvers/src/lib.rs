//! Nonlinear least squares for people who must say how sure they are.
//!
//! A fit minimises ½ Σ ρ(rᵢ(p)²) over parameters p, r = (model − observation) / σ; ρ(s) = s unless
//! a robust [`Loss`] is chosen. It ends with a sentence ([`Ending`]): a minimum and which test
//! found it, or that the data do not determine some named combination of parameters, or why
//! no minimum was reached.
//!
//! # Three steps
//!
//! 1. Implement [`Problem`]: residuals, Jacobian, names. [`check_jacobian`] compares the Jacobian
//!    with differences; [`central_differences`] makes one.
//! 2. [`fit`] it from a start, with [`Options`].
//! 3. Read [`Fit::ending`], [`Fit::parameters`] and [`Fit::covariance`].
//!
//! ```
//! use errsep_solvers::{NoValue, Options, Problem, fit};
//! use nalgebra::{DMatrix, DVector, dvector};
//!
//! /// y = a exp(−k t) at t = 0, 1, 2, 3, 4.
//! struct Decay([f64; 5]);
//!
//! impl Problem for Decay {
//!     fn parameter_count(&self) -> usize { 2 }
//!     fn residual_count(&self) -> usize { 5 }
//!     fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
//!         Ok(DVector::from_fn(5, |t, _| p[0] * (-p[1] * t as f64).exp() - self.0[t]))
//!     }
//!     fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
//!         Ok(DMatrix::from_fn(5, 2, |t, j| {
//!             let decay = (-p[1] * t as f64).exp();
//!             if j == 0 { decay } else { -p[0] * t as f64 * decay }
//!         }))
//!     }
//! }
//!
//! let fit = fit(&Decay([2.02, 1.21, 0.75, 0.44, 0.28]), dvector![1.0, 1.0], &Options::default())?;
//! assert!(fit.ending.is_converged(), "{}", fit.ending);
//! let covariance = fit.covariance().scaled_by_residuals().expect("three degrees of freedom");
//! println!("k = {} ± {}", fit.parameters[1], covariance.standard_uncertainty(1));
//! # Ok::<(), errsep_solvers::FitError>(())
//! ```
//!
//! # Which method
//!
//! | your problem | take |
//! |---|---|
//! | nothing special, or a start far away | the default: Levenberg-Marquardt with Moré's trust region |
//! | a long narrow curved valley (sums of exponentials, ratios) | the default with `geodesic_acceleration` |
//! | a good start and a mildly nonlinear model | [`Method::GaussNewton`]: fewest evaluations, lost where the Jacobian loses rank on the way |
//! | evaluations cheap beside the linear algebra, many parameters | [`Method::Dogleg`]: one factorisation a step |
//! | model linear in some parameters | [`SeparableProblem`] with [`fit_separable`]: no start for the linear ones |
//! | columns that may be dependent, and the shortest step is wanted | [`Factorization::Svd`] |
//! | limits on parameters | [`Bounds`] in [`Options::bounds`] |
//! | some readings wrong | a [`Loss`]: Huber or soft-L1 first, Tukey from a start that is nearly right |
//! | a good start and a model linear in most of its parameters | [`Method::GaussNewtonFirst`] |
//! | thousands of local unknowns in order along an axis, a few global ones, any number of readings | [`StructuredProblem`] with [`fit_structured`]: banded with a border, streaming |
//! | an ill-posed linear problem | [`regularization`]: Tikhonov, truncated SVD and the choice of their parameter |
//!
//! # How sure
//!
//! [`Fit::covariance`] is right to first order and names what it does not determine;
//! [`profile_interval`] follows the cost where curvature makes an interval lopsided;
//! [`bootstrap()`] asks nothing of the distribution of the errors.
//!
//! # Features
//!
//! | feature, on unless turned off | what | brings |
//! |---|---|---|
//! | `checkpoint` | [`CheckpointFile`] | `ciborium` |
//! | `periodogram` | [`regularization::periodogram`](fn@regularization::periodogram) | `realfft` |
//! | `bootstrap` | [`bootstrap()`] | `rand`, `rand_chacha` |
//!
//! # Long runs
//!
//! The methods are argmin solvers: [`fit_with`] and [`fit_structured_with`] open argmin's executor for
//! observers, checkpoints ([`CheckpointFile`]) and interruption, and [`Options`] has a time limit and a stop flag.
//!
//! ```
//! # use errsep_solvers::{NoValue, Options, Problem, fit_with};
//! # use nalgebra::{DMatrix, DVector, dmatrix, dvector};
//! # struct Valley;
//! # impl Problem for Valley {
//! #     fn parameter_count(&self) -> usize { 2 }
//! #     fn residual_count(&self) -> usize { 2 }
//! #     fn residuals(&self, p: &DVector<f64>) -> Result<DVector<f64>, NoValue> {
//! #         Ok(dvector![10.0 * (p[1] - p[0] * p[0]), 1.0 - p[0]])
//! #     }
//! #     fn jacobian(&self, p: &DVector<f64>) -> Result<DMatrix<f64>, NoValue> {
//! #         Ok(dmatrix![-20.0 * p[0], 10.0; -1.0, 0.0])
//! #     }
//! # }
//! use errsep_solvers::FitState;
//! use errsep_solvers::argmin::core::observers::{Observe, ObserverMode};
//! use errsep_solvers::argmin::core::{Error, KV};
//!
//! struct Print;
//! impl Observe<FitState> for Print {
//!     fn observe_iter(&mut self, state: &FitState, _: &KV) -> Result<(), Error> {
//!         println!("{}: {:e}", state.iter, state.cost);
//!         Ok(())
//!     }
//! }
//!
//! let fit = fit_with(&Valley, dvector![-1.2, 1.0], &Options::default(), |executor| {
//!     executor.add_observer(Print, ObserverMode::Always)
//! })?;
//! assert!(fit.ending.is_converged());
//! # Ok::<(), errsep_solvers::FitError>(())
//! ```

pub mod bounds;
#[cfg(feature = "checkpoint")]
pub mod checkpoint;
pub mod covariance;
pub mod derivatives;
mod fit;
pub mod linear;
pub mod loss;
pub mod nonlinear;
pub mod options;
pub mod outcome;
pub mod problem;
mod processor;
pub mod regularization;
pub mod scalar;
pub mod separable;
pub mod structured;
pub mod uncertainty;

pub use argmin;
pub use bounds::{ActiveBound, Bounds, Side};
#[cfg(feature = "checkpoint")]
pub use checkpoint::CheckpointFile;
pub use covariance::Covariance;
pub use derivatives::{JacobianCheck, central_differences, check_jacobian};
pub use fit::{DenseMinimiser, FitExecutor, fit, fit_separable, fit_with};
pub use linear::dense::Factorization;
pub use loss::Loss;
pub use nonlinear::minimiser::FitState;
pub use nonlinear::variable_projection::{ProjectedJacobian, VariableProjection};
pub use options::{Damping, Finish, Method, Options};
pub use outcome::{Combination, Convergence, Ending, Fit, FitError, Iteration};
pub use problem::{NoValue, Problem};
pub use separable::{Joint, SeparableProblem};
pub use structured::{StructuredFit, StructuredProblem, fit_structured, fit_structured_with};
#[cfg(feature = "bootstrap")]
pub use uncertainty::bootstrap::{Bootstrap, bootstrap};
pub use uncertainty::profile::{Limit, ProfileInterval, ResidualScale, profile_interval};
