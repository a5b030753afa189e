//! Surface, straightness and tilt from the outputs.

use errsep_solvers::regularization::{Decomposition, Penalty};
use nalgebra::{DMatrix, DVector};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::frame::Frame;
use super::gauge::section;
use super::zone::minimum_zone;
use super::{
    Along, Choice, Chosen, Excess, FourSensorError, Geometry, Line, MinimumZone, Outputs, Parabola,
    Penalised, Scatter, choice, direct, excess, scatter,
};
use crate::uncertainty::DegreesOfFreedom;

/// How outputs are separated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// How λ is chosen.
    pub choice: Choice,
    /// Standard deviation of one reading, µm; estimated from the residuals where absent.
    pub noise: Option<f64>,
    /// Where the parabola comes from.
    pub parabola: Parabola,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            choice: Choice::LCurve,
            noise: None,
            parabola: Parabola::LeastNorm,
        }
    }
}

/// Values along x with what is known of their errors.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Values: µm, for a tilt rad.
    pub values: DVector<f64>,
    /// Standard uncertainties from the noise of the readings and from the pull of the penalty on a
    /// surface that scatters as [`Separation::scatter`] says. Of a parabola that was assumed
    /// nothing is in them.
    pub std: DVector<f64>,
    /// The penalty's pull if the truth were the estimate.
    pub bias: DVector<f64>,
    /// The largest pull of a truth whose ‖Lf‖ is that of the estimate.
    pub bias_bound: DVector<f64>,
}

/// Outputs separated into what they are made of.
#[derive(Debug, Clone)]
pub struct Separation {
    /// f at the surface positions, µm, length N.
    pub surface: Profile,
    /// S at the slide positions, µm, length K.
    pub straightness: Profile,
    /// γ at the slide positions, rad, length K; its mean goes with e₄ = 0.
    pub tilt: Profile,
    /// e of the four sensors, µm, with e₁ = e₄ = 0.
    pub zero_adjustment: [f64; 4],
    /// Their standard uncertainties, µm, as [`Profile::std`].
    pub zero_adjustment_std: [f64; 4],
    /// By what the penalty's pull is judged.
    pub scatter: Scatter,
    /// Output less model, µm, one row a slide position.
    pub residuals: Vec<[f64; 4]>,
    /// The standard deviation of one reading used, µm.
    pub noise: f64,
    /// Whether it was estimated from the residuals.
    pub noise_estimated: bool,
    /// How well that is known: infinite where it was stated.
    pub degrees_of_freedom: Option<DegreesOfFreedom>,
    /// λ and how it came about.
    pub chosen: Chosen,
    /// Coefficient of x² that was given to the surface, µm/mm².
    pub curvature: f64,
    /// By how much the errors are greater than white noise gives, where that is told.
    pub excess: Option<Excess>,
}

impl Separation {
    /// A draw of the noise of outputs, µm: white, `factor` times as large as it is, or correlated along the slide.
    pub(super) fn random_noise(
        &self,
        outputs: &Outputs,
        along: Option<&Along>,
        random: &mut impl Rng,
        factor: f64,
    ) -> Vec<[f64; 4]> {
        match along {
            Some(along) => along.drawn(outputs, random),
            None => outputs.random(random, factor * self.noise),
        }
    }

    /// A draw of such noise of outputs, µm, as lets S err as it does.
    pub(super) fn noise_of_straightness(
        &self,
        outputs: &Outputs,
        along: Option<&Along>,
        random: &mut impl Rng,
    ) -> Vec<[f64; 4]> {
        let factor = self.excess.map_or(1.0, |excess| excess.factors[1]);
        self.random_noise(outputs, along, random, factor)
    }
}

/// The direct system of one geometry, decomposed once for any number of outputs.
#[derive(Debug, Clone)]
pub struct Separator {
    geometry: Geometry,
    line: Line,
    /// (N + 2) × (N − 1).
    section: DMatrix<f64>,
    decomposition: Decomposition,
}

impl Separator {
    /// Decomposes the direct system with a penalty; `line` is what the answer is stated from. N³
    /// operations, for up to a thousand points or two.
    ///
    /// # Errors
    /// The decomposition did not converge.
    pub fn new(
        geometry: &Geometry,
        penalised: Penalised,
        line: Line,
    ) -> Result<Self, FourSensorError> {
        let section = section(geometry, penalised.line());
        let matrix = direct::matrix(geometry) * &section;
        let penalty = direct::penalty(geometry, penalised) * &section;
        Ok(Self {
            geometry: *geometry,
            line,
            decomposition: Decomposition::general(&matrix, &Penalty::Custom(penalty))?,
            section,
        })
    }

    /// The decomposed system.
    pub fn decomposition(&self) -> &Decomposition {
        &self.decomposition
    }

    /// Separates outputs.
    ///
    /// # Errors
    /// The outputs belong to another geometry; a stated value is not finite; the system has no
    /// range of λ to choose from.
    pub fn separate(
        &self,
        outputs: &Outputs,
        settings: &Settings,
    ) -> Result<Separation, FourSensorError> {
        self.check(outputs)?;
        let data = direct::data(outputs);
        let spectrum = self.decomposition.with_data(&data)?;
        let chosen = choice::choose(&spectrum, settings.choice, settings.noise)?;
        let lambda = chosen.point.lambda;
        let solution = &self.section * spectrum.solution(lambda)?;
        let estimated = chosen.point.noise_estimate(data.len());
        let noise = match (settings.noise, estimated) {
            (Some(noise), _) => noise,
            (None, Some(noise)) => noise,
            (None, None) => return Err(FourSensorError::NoNoise),
        };
        let uncertainty = spectrum.uncertainty(lambda, noise)?;
        let frame = Frame::new(outputs, self.line, settings.parabola);
        let settled = frame.settle(&solution);
        let map = frame.map() * &self.section;
        let spread = (&map * &uncertainty.covariance)
            .component_mul(&map)
            .column_sum();
        let bias = &map * &uncertainty.bias_estimate;
        let pull = row_norms(&(&map * &uncertainty.pull));
        let own = frame.own_variances() * noise.powi(2);
        let scatter = scatter::of_surface(&spectrum, &chosen, noise)?;
        let pulled = pull.map(|pull| (scatter.held_back * pull).powi(2));
        let std = (spread + own + pulled).map(|variance| variance.max(0.0).sqrt());
        let pull = pull * chosen.point.seminorm;
        let points = self.geometry.point_count();
        let count = self.geometry.output_count();
        let profile = |values: DVector<f64>, from: usize| {
            let part = |all: &DVector<f64>| all.rows(from, values.len()).into_owned();
            Profile {
                std: part(&std),
                bias: part(&bias),
                bias_bound: part(&pull),
                values,
            }
        };
        Ok(Separation {
            residuals: frame.residuals(&settled),
            zero_adjustment: settled.zero_adjustment.into(),
            zero_adjustment_std: std::array::from_fn(|k| std[points + 2 * count + k]),
            scatter,
            curvature: settled.curvature,
            surface: profile(settled.surface, 0),
            straightness: profile(settled.straightness, points),
            tilt: profile(settled.tilt, points + count),
            noise,
            noise_estimated: settings.noise.is_none(),
            degrees_of_freedom: degrees_of_freedom(settings, &chosen, data.len()),
            chosen,
            excess: None,
        })
    }

    /// Errors of f, S, γ and e that white noise gives, with the λ that was chosen.
    ///
    /// # Errors
    /// As [`separate`](Self::separate).
    pub fn noise_errors(
        &self,
        outputs: &Outputs,
        settings: &Settings,
        found: &Separation,
    ) -> Result<Vec<excess::Found>, FourSensorError> {
        let of = self.error_of_draw(outputs, settings, found, None)?;
        (0..excess::DRAWS).map(of).collect()
    }

    /// Counts noise that is correlated along the slide in the uncertainties of what was found of outputs that were read once,
    /// where these show it, and gives it.
    ///
    /// # Errors
    /// As [`separate`](Self::separate).
    pub fn count_correlation(
        &self,
        outputs: &Outputs,
        settings: &Settings,
        found: &mut Separation,
    ) -> Result<Option<Along>, FourSensorError> {
        let Some(along) = Along::of(outputs) else {
            return Ok(None);
        };
        let of = |along| excess::mean_squares(self.error_of_draw(outputs, settings, found, along)?);
        let (correlated, white) = (of(Some(&along))?, of(None)?);
        found.count_correlation(&along, &correlated, &white);
        Ok(Some(along))
    }

    fn error_of_draw<'a>(
        &'a self,
        outputs: &'a Outputs,
        settings: &Settings,
        found: &'a Separation,
        along: Option<&'a Along>,
    ) -> Result<impl Fn(u64) -> Result<excess::Found, FourSensorError> + 'a, FourSensorError> {
        self.check(outputs)?;
        let lambda = found.chosen.point.lambda;
        let frame = Frame::new(outputs, self.line, settings.parabola);
        Ok(move |draw| {
            let noise = found.random_noise(outputs, along, &mut excess::random(draw), 1.0);
            let seen = direct::slide_free_part(&self.geometry, &noise);
            let error = self.decomposition.with_data(&seen)?.solution(lambda)?;
            Ok(frame.error(&(&self.section * error), &noise).profiles())
        })
    }

    /// The minimum-zone straightness of S that was found of these outputs, the noise known to `degrees`
    /// of freedom ([`Separation::degrees_of_freedom`], unless it came from elsewhere).
    ///
    /// # Errors
    /// As [`separate`](Self::separate).
    pub fn straightness_error(
        &self,
        outputs: &Outputs,
        settings: &Settings,
        found: &Separation,
        degrees: DegreesOfFreedom,
        along: Option<&Along>,
    ) -> Result<MinimumZone, FourSensorError> {
        self.check(outputs)?;
        let lambda = found.chosen.point.lambda;
        let spectrum = self.decomposition.with_data(&direct::data(outputs))?;
        let pull = spectrum.uncertainty(lambda, found.noise)?.pull;
        let frame = Frame::new(outputs, self.line, settings.parabola);
        let positions = outputs.slide_positions();
        minimum_zone(&positions, &found.straightness.values, degrees, |random| {
            let noise = found.noise_of_straightness(outputs, along, random);
            let seen = self
                .decomposition
                .with_data(&direct::slide_free_part(&self.geometry, &noise))?;
            let truth = DVector::from_fn(pull.ncols(), |_, _| normal(random));
            let error = seen.solution(lambda)? - &pull * truth * found.scatter.held_back;
            Ok(frame.error(&(&self.section * error), &noise).straightness)
        })
    }

    fn check(&self, outputs: &Outputs) -> Result<(), FourSensorError> {
        if outputs.geometry() != &self.geometry {
            return Err(FourSensorError::OutputCount {
                found: outputs.readings().len(),
                expected: self.geometry.output_count(),
            });
        }
        Ok(())
    }
}

pub(super) fn normal(random: &mut impl Rng) -> f64 {
    StandardNormal.sample(random)
}

/// Of the noise of one reading: what the residuals of `rows` leave, unless it was stated.
pub(super) fn degrees_of_freedom(
    settings: &Settings,
    chosen: &Chosen,
    rows: usize,
) -> Option<DegreesOfFreedom> {
    match settings.noise {
        Some(_) => Some(DegreesOfFreedom::Infinite),
        None => DegreesOfFreedom::new(chosen.point.residual_degrees_of_freedom(rows)).ok(),
    }
}

fn row_norms(matrix: &DMatrix<f64>) -> DVector<f64> {
    DVector::from_iterator(matrix.nrows(), matrix.row_iter().map(|row| row.norm()))
}
