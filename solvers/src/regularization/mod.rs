//! Regularization of linear least squares: minimise ‖Ax − b‖² + λ²‖Lx‖², and choose λ.
//!
//! One decomposition serves every λ. [`Decomposition`] holds it for a dense A of up to a few
//! thousand columns; [`BandedSystem`] does the same work through the band when A has few nonzeros
//! a row, at linear cost for each λ. Both hand out a [`Family`]: the residual norm, the seminorm,
//! its derivative and the effective number of parameters at any λ. The rules that choose λ know
//! nothing else:
//!
//! | rule | needs | use it when |
//! |---|---|---|
//! | [`l_curve`] | nothing | the noise level is not known; it says when there is no corner |
//! | [`gcv`] | nothing | the noise is white |
//! | [`likelihood`](fn@likelihood) | nothing | the noise is white and Lx scatters evenly: less erratic than [`gcv`] |
//! | [`discrepancy`] | the noise level | the noise level is known |
//! | [`periodogram`](fn@periodogram) (feature `periodogram`) | residuals in their natural order | the noise is white and the signal is not |
//!
//! A regularized solution is biased by construction. [`Uncertainty`] keeps the two parts apart: the
//! covariance that noise gives the estimate, and how far the penalty may have pulled it.

mod banded;
mod curve;
mod decomposition;
mod discrepancy;
mod error;
mod factored;
mod gcv;
mod l_curve;
mod likelihood;
mod penalty;
#[cfg(feature = "periodogram")]
mod periodogram;
mod search;
mod spectrum;
mod uncertainty;

pub use banded::BandedSystem;
pub use curve::{Family, Point};
pub use decomposition::Decomposition;
pub use discrepancy::{Discrepancy, discrepancy};
pub use error::RegularizationError;
pub use factored::{Combination, Factored};
pub use gcv::{Gcv, gcv, gcv_among};
pub use l_curve::{Corner, CornerStatus, LCurve, l_curve, l_curve_between};
pub use likelihood::{Likelihood, likelihood, likelihood_among};
pub use penalty::Penalty;
#[cfg(feature = "periodogram")]
pub use periodogram::{Periodogram, periodogram, whiteness_distance};
pub use spectrum::Spectrum;
pub use uncertainty::Uncertainty;
