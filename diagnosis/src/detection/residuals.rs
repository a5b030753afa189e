//! Which laws of noise the residuals of a fit allow, where there are no repeats that would tell.
//!
//! The likelihood is the restricted one: with V the covariance of the readings under a law, J what the fit absorbs and
//! e what it leaves in units of the noise, −2 ln L = ln |V| + ln |Jᵀ V⁻¹ J| + (n − p) ln |e|², the scale integrated out
//! (Patterson and Thompson, Biometrika 58 (1971) 545). White noise and noise with a part that is correlated along its
//! trace are as probable beforehand; the second on a grid of equal probabilities.

use errsep_models::model::{AnyModel, FittedModel};
use errsep_models::noise::{Law, spacing_and_length};
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::detection::space::Space;
use crate::levels::MOST_CORRELATED;
use crate::noise::law::{NoiseLaw, SEED};
use crate::noise::posterior::{Allowed, Proposal, resampled};

/// Standard deviations of the correlated part and lengths that are tried, each of equal probability.
const SIZES: usize = 8;
const LENGTHS: usize = 8;

/// What residuals say of several readings of a model.
pub(crate) struct ByResiduals {
    /// Laws in which each reading may be correlated with those before it, as well as white ones.
    pub any: Allowed,
    /// Logarithm of the probability density where the noise is white, to the constant of that of `any`.
    pub white: f64,
}

/// What the residuals of some readings of one model allow, each for itself; none where traces are too short to show
/// what is correlated, or noise cannot be. `white`: the standard deviation of a reading, roughly.
pub(crate) fn by_residuals(
    model: &AnyModel,
    readings: &[&DVector<f64>],
    white: f64,
) -> Option<Vec<ByResiduals>> {
    let traces = model.traces().iter().filter(|t| !t.is_empty());
    let ends = traces.map(|t| {
        let x = |row: usize| model.places()[row].x;
        (t.len(), x(t.start), x(t.end - 1))
    });
    let (spacing, travel) =
        spacing_and_length(ends).filter(|_| model.correlated_noise() && white > 0.0)?;
    // The mean of many readings has less white noise than each.
    let most = MOST_CORRELATED * model.readings_in_each().max(1.0).sqrt();
    let mut laws = vec![Law::of_white(1.0)];
    let lengths = (spacing.ln(), travel.max(2.0 * spacing).ln());
    for size in 0..SIZES {
        // Half-Cauchy's law of scale one below the greatest size.
        let part = (size as f64 + 0.5) / SIZES as f64;
        let sd = (part * most.atan()).tan();
        for length in 0..LENGTHS {
            let part = (length as f64 + 0.5) / LENGTHS as f64;
            laws.push(Law {
                correlated: sd * sd,
                length: (lengths.0 + part * (lengths.1 - lengths.0)).exp(),
                ..Law::of_white(1.0)
            });
        }
    }
    let mut found: Vec<Vec<Proposal>> = readings.iter().map(|_| Vec::new()).collect();
    let mut freedom = 0.0;
    for (k, law) in laws.iter().enumerate() {
        let space = Space::expecting(model, &NoiseLaw::stated(law.times(white * white)));
        freedom = space.degrees_of_freedom() as f64;
        let prior = if k == 0 {
            2.0
        } else {
            2.0 * (SIZES * LENGTHS) as f64
        };
        for (readings, found) in readings.iter().zip(&mut found) {
            let square = space.forward_vector(readings).norm_squared();
            let square = square.max(f64::MIN_POSITIVE);
            let minus_log = 0.5 * (freedom * square.ln() + space.log_determinant());
            found.push(Proposal {
                ratios: *law,
                quadratic: square * white * white,
                weight: -minus_log - f64::ln(prior),
            });
        }
    }
    let each = found.into_iter().map(|proposals| {
        let white = proposals.first()?.weight + f64::ln(2.0);
        let any = resampled(&proposals, freedom, &mut ChaCha8Rng::seed_from_u64(SEED))?;
        Some(ByResiduals { any, white })
    });
    each.collect()
}

#[cfg(test)]
mod tests {
    use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
    use errsep_models::reversal::exact_readings::{Scene, SceneNoise};
    use nalgebra::DMatrix;

    use super::*;
    use crate::detection::basis::with_volume;

    fn model(positions: usize, noise: SceneNoise, seed: u64) -> AnyModel {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let scene = Scene {
            both_directions: true,
            ..Scene::random(positions, 1, 1e-5, 2.0, noise, &mut random)
        };
        AnyModel::new(&Linearised::new(&scene.measured(seed), Assumptions::default()).unwrap())
    }

    /// What the model's fit absorbs, readings × columns.
    fn absorbed(model: &AnyModel) -> DMatrix<f64> {
        let freedom = model.freedom();
        let profiles = freedom.profiles.unwrap();
        let length = model.traces()[0].len();
        let mut columns = Vec::new();
        for function in 0..profiles.patterns.ncols() {
            let mut free = DMatrix::identity(length, length);
            for (_, out) in profiles.withheld.iter().filter(|(f, _)| *f == function) {
                let unit = out.normalize();
                free -= &unit * (unit.transpose() * &free);
            }
            let (basis, _) = with_volume(&free, &vec![1.0; length]);
            for form in basis.column_iter() {
                let mut column = DVector::zeros(model.places().len());
                for (t, trace) in model.traces().iter().enumerate() {
                    let own = form * profiles.patterns[(t, function)];
                    column.rows_mut(trace.start, length).copy_from(&own);
                }
                columns.push(column);
            }
        }
        columns.extend(freedom.columns.column_iter().map(|c| c.into_owned()));
        DMatrix::from_columns(&columns)
    }

    /// *Limit*: of two laws the determinants differ as those of the dense matrices do, and what is left is as great.
    #[test]
    fn determinants_are_those_of_the_dense_matrices() {
        let white = SceneNoise {
            white: 0.1,
            ..SceneNoise::default()
        };
        let model = model(14, white, 1);
        let columns = absorbed(&model);
        let readings = model.linearised();
        let of = |law: Law| {
            let law = NoiseLaw::stated(law);
            let space = Space::new(&model, &law);
            let n = readings.len();
            let mut covariance = DMatrix::zeros(n, n);
            for trace in model.traces() {
                let x: Vec<f64> = model.places()[trace.clone()].iter().map(|p| p.x).collect();
                let block = law.covariance(&x);
                let at = (trace.start, trace.start);
                covariance.view_mut(at, block.shape()).copy_from(&block);
            }
            let factor = covariance.cholesky().unwrap().unpack();
            let whitened = factor.solve_lower_triangular(&columns).unwrap();
            let sizes: Vec<f64> = whitened.column_iter().map(|c| c.norm()).collect();
            let (basis, log_volume) = with_volume(&whitened, &sizes);
            let mut left = factor.solve_lower_triangular(&readings).unwrap();
            left -= &basis * basis.tr_mul(&left);
            let noise: f64 = factor.diagonal().map(|pivot| 2.0 * pivot.ln()).sum();
            let seen = space.forward_vector(&readings).norm_squared();
            assert_eq!(basis.ncols(), space.rank);
            // Rounding.
            assert!((seen / left.norm_squared() - 1.0).abs() < 1e-8);
            (space.log_determinant(), noise + 2.0 * log_volume)
        };
        let law = |white, correlated, length| Law {
            correlated,
            length,
            ..Law::of_white(white)
        };
        let (own, dense) = of(Law::of_white(0.01));
        for law in [
            law(0.03, 0.0, 1.0),
            law(0.01, 0.02, 10.0),
            law(0.02, 0.05, 90.0),
        ] {
            let (other, dense_other) = of(law);
            // Rounding of some hundred logarithms.
            assert!(((own - other) - (dense - dense_other)).abs() < 1e-7);
        }
    }

    /// *Simulated truth*: 61 positions there and back, once. Of 30 measurements with noise that is correlated over 15 mm, by
    /// half of its variance, most are told to be; of 30 with white noise, one in twenty at most is by the odds that are
    /// asked for: more than five of 30 have a probability of 0.3 %.
    #[test]
    fn correlated_noise_is_told_from_white_noise() {
        let told = |correlated: f64| {
            let noise = SceneNoise {
                white: 0.1,
                correlated,
                length: 15.0,
                shift: 0.0,
            };
            let each = (0..30).filter(|seed| {
                let model = model(61, noise, *seed);
                let found = by_residuals(&model, &[&model.linearised()], 0.1).unwrap();
                found[0].any.log_evidence - found[0].white > crate::levels::LIKELIER_BY_CORRELATION
            });
            each.count()
        };
        let (correlated, white) = (told(0.1), told(0.0));
        assert!(correlated >= 25, "{correlated}");
        assert!(white <= 5, "{white}");
    }
}
