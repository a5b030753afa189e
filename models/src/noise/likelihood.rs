//! How likely a law of the noise makes values that hold nothing but noise, trace by trace.

use nalgebra::{Matrix2, Vector2};

use super::law::{about_middle, decays};

/// Variances of what a whole trace does.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OfWhole {
    /// Of its shift.
    pub shift: f64,
    /// Of the slope of its drift.
    pub drift: f64,
}

/// What a law says of values, its scale left open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likelihood {
    /// −ln L at the best scale; up to a constant also with the scale integrated out (1/scale).
    pub minus_log: f64,
    /// Quadratic form under the law of scale one; over the number of values it is the best scale.
    pub quadratic: f64,
}

/// The likelihoods of one white and one correlated part with each of some shifts and drifts of whole traces, summed
/// over traces.
#[derive(Debug, Clone)]
pub struct Likelihoods<'w> {
    whole: &'w [OfWhole],
    quadratics: Vec<f64>,
    log_determinants: Vec<f64>,
    count: f64,
}

/// The filter at one value: the same for all rows on the same positions.
struct Step {
    decay: f64,
    gain: f64,
    /// Innovations of a trace of ones and of one that drifts over their variance.
    slow: [f64; 2],
    /// 1/variance of the innovation.
    weight: f64,
}

impl<'w> Likelihoods<'w> {
    /// Of no value yet.
    pub fn new(whole: &'w [OfWhole]) -> Self {
        Self {
            whole,
            quadratics: vec![0.0; whole.len()],
            log_determinants: vec![0.0; whole.len()],
            count: 0.0,
        }
    }

    /// Adds rows on the same positions, each with the covariance of one trace; `one` is what a shift of one is in them,
    /// `law` the variances of the white and the correlated part and the length of the latter.
    ///
    /// The correlated part is Markov, so one pass of the Kalman filter gives determinant and quadratic
    /// form; shift and drift are an update of rank two: with U the traces of ones and of a drift, D their variances and
    /// G = UᵀV⁻¹U
    ///
    /// ```text
    ///     r'(V + UDUᵀ)⁻¹r = r'V⁻¹r − vᵀ(I + DG)⁻¹Dv,   v = UᵀV⁻¹r,      |V + UDUᵀ| = |V| |I + DG|
    /// ```
    pub fn add<'r>(
        &mut self,
        positions: &[f64],
        one: f64,
        rows: impl Iterator<Item = &'r [f64]>,
        (white, correlated, length): (f64, f64, f64),
    ) {
        let mut steps: Vec<Step> = Vec::with_capacity(positions.len());
        let places = about_middle(positions);
        let (mut slow, mut variance) = ([0.0; 2], correlated);
        let (mut gram, mut log_totals) = (Matrix2::zeros(), 0.0);
        let decays = if correlated > 0.0 {
            decays(positions, length)
        } else {
            vec![0.0; positions.len()]
        };
        for (k, decay) in decays.into_iter().enumerate() {
            if k > 0 {
                slow = slow.map(|s| s * decay);
                variance = decay * decay * variance + correlated * (1.0 - decay * decay);
            }
            let total = variance + white;
            let ones = [one, one * places[k]];
            let innovation = Vector2::new(ones[0] - slow[0], ones[1] - slow[1]);
            gram += innovation * innovation.transpose() / total;
            log_totals += total.ln();
            let gain = variance / total;
            slow = [0, 1].map(|l| slow[l] + gain * innovation[l]);
            variance *= 1.0 - gain;
            steps.push(Step {
                decay,
                gain,
                slow: [innovation[0] / total, innovation[1] / total],
                weight: 1.0 / total,
            });
        }
        // Over all rows: r'V⁻¹r and vvᵀ.
        let (mut own, mut together, mut count) = (0.0, Matrix2::zeros(), 0.0);
        for row in rows {
            let (mut state, mut along) = (0.0, Vector2::zeros());
            for (step, value) in steps.iter().zip(row) {
                state *= step.decay;
                let innovation = value - state;
                own += innovation * innovation * step.weight;
                along += Vector2::from(step.slow) * innovation;
                state += step.gain * innovation;
            }
            together += along * along.transpose();
            count += 1.0;
        }
        self.count += count * positions.len() as f64;
        for (k, of) in self.whole.iter().enumerate() {
            let sizes = Matrix2::from_diagonal(&Vector2::new(of.shift, of.drift));
            let grown = Matrix2::identity() + sizes * gram;
            let taken = grown
                .try_inverse()
                .map_or_else(Matrix2::zeros, |i| i * sizes);
            self.quadratics[k] += own - (taken * together).trace();
            self.log_determinants[k] += count * (log_totals + grown.determinant().ln());
        }
    }

    /// One for each shift and drift.
    pub fn found(self) -> Vec<Likelihood> {
        let both = self.quadratics.into_iter().zip(self.log_determinants);
        both.map(|(quadratic, log_determinant)| {
            let quadratic = quadratic.max(f64::MIN_POSITIVE);
            Likelihood {
                minus_log: 0.5 * (self.count * (quadratic / self.count).ln() + log_determinant),
                quadratic,
            }
        })
        .collect()
    }
}
