//! How much the surface scatters: what the pull of the penalty is judged by.
//!
//! The penalty pulls every estimate towards a flat surface. How far depends on the true surface, of
//! which the outputs tell the size where they see it well. With s the standard deviation of the entries
//! of Lf, the pull of a combination is expected to be s‖B‖, with B as in
//! [`Uncertainty::pull`](errsep_solvers::regularization::Uncertainty); for λ = σ/s, noise and pull together
//! are the posterior variance.

use errsep_solvers::regularization::{Family, Point, likelihood_among};

use super::{Chosen, FourSensorError, direct};

/// Standard deviations of the entries of Lf, µm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// If all were alike: that of the restricted likelihood, √(‖Lf‖²/e) with e the effective number of
    /// penalised parameters there.
    pub even: f64,
    /// The largest that those parts of the surface show which the penalty holds back, where they stand
    /// out of the noise, and no less than `even`. Long waves are seen least, and are the largest of most
    /// real surfaces: it is this that the uncertainties count.
    pub held_back: f64,
}

impl Scatter {
    /// The penalty does not fit the surface: what it holds back is more than twice the rest. The
    /// uncertainties may then be too small.
    pub fn is_uneven(&self) -> bool {
        self.held_back > 2.0 * self.even
    }
}

/// What a λ shows of the components φ²β²/γ², φ their filter factors, β their coefficients.
#[derive(Clone, Copy)]
struct Seen {
    /// λ.
    lambda: f64,
    /// Σφ²β²/γ² = ‖Lf‖².
    squares: f64,
    /// Σφ, of the penalised components.
    parameters: f64,
    /// Σφ(1 − φ).
    edge: f64,
    /// Σφ²(1 − φ)β²/γ².
    edge_squares: f64,
}

impl Seen {
    /// Both sums over the edge are derivatives by λ: of ‖Lf‖² and of the effective parameters.
    fn at<F: Family + ?Sized>(family: &F, lambda: f64) -> Result<Self, FourSensorError> {
        // A central difference over ±5 % of λ is good to three digits of a number that is itself a draw.
        const STEP: f64 = 0.05;
        let parameters = |point: &Point| point.effective_parameters - direct::ZERO_UNKNOWNS as f64;
        let point = family.point(lambda)?;
        let below = parameters(&family.point(lambda * (-STEP).exp())?);
        let above = parameters(&family.point(lambda * STEP.exp())?);
        Ok(Self {
            lambda,
            squares: point.seminorm.powi(2),
            parameters: parameters(&point),
            edge: (below - above) / (4.0 * STEP),
            edge_squares: -0.25 * lambda * point.seminorm_sq_slope,
        })
    }

    /// Variance of the components about whose φ is a half: Σφ²(1 − φ)β²/γ² has the expectation
    /// s²Σφ(1 − φ) for s = σ/λ.
    fn of_edge(&self) -> Option<f64> {
        // Fewer components than this are pulled by nothing worth counting.
        (self.edge > 1e-6).then(|| self.edge_squares / self.edge)
    }

    /// Variance of the components that `finer`, a smaller λ, lets through and this one does not, if it
    /// is more than the noise of readings of standard deviation σ gives them. The noise in ‖Lf‖² is
    /// σ²Σφ²/γ² = σ²Σφ(1 − φ)/λ².
    fn between(&self, finer: &Self, noise: f64) -> Option<f64> {
        // Less than a third of a component is none.
        const FEWEST: f64 = 0.3;
        let passed = |seen: &Self| seen.parameters - seen.edge;
        let count = passed(finer) - passed(self);
        let of_noise = |seen: &Self| seen.edge * (noise / seen.lambda).powi(2);
        let expected = of_noise(finer) - of_noise(self);
        let signal = finer.squares - self.squares - expected;
        (count > FEWEST && signal > expected.abs()).then(|| signal / count)
    }
}

/// The scatter of the surface from a family of solutions, whatever rule chose λ, and the standard
/// deviation of a reading, µm.
pub(super) fn of_surface<F: Family + ?Sized>(
    family: &F,
    chosen: &Chosen,
    noise: f64,
) -> Result<Scatter, FourSensorError> {
    // Octaves of λ below the one taken.
    const OCTAVES: i32 = 5;
    let likeliest = likelihood_among(family, &chosen.curve.points)?;
    let lambda = if likeliest.at_edge {
        chosen.point.lambda
    } else {
        likeliest.point.lambda
    };
    let seen = Seen::at(family, lambda)?;
    let even = if seen.parameters > 0.0 {
        seen.squares / seen.parameters
    } else {
        0.0
    };
    let mut held_back = even.max(seen.of_edge().unwrap_or(0.0));
    let base = Seen::at(family, chosen.point.lambda)?;
    for octave in 1..=OCTAVES {
        let finer = Seen::at(family, chosen.point.lambda * 0.5_f64.powi(octave))?;
        held_back = held_back.max(base.between(&finer, noise).unwrap_or(0.0));
    }
    Ok(Scatter {
        even: even.sqrt(),
        held_back: held_back.sqrt(),
    })
}
