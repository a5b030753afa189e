//! The direct fit of long records, through the band: the same unknowns, penalty and frame as
//! [`Separator`](super::Separator), at a cost linear in the number of points.

use errsep_solvers::regularization::{
    BandedSystem, Combination, Factored, Penalty, RegularizationError,
};
use nalgebra::{DMatrix, DVector, Vector2, Vector4};

use super::frame::Frame;
use super::gauge::conditions;
use super::separation::{degrees_of_freedom, normal};
use super::zone::minimum_zone;
use super::{
    Along, FourSensorError, Geometry, Line, MinimumZone, Outputs, Parabola, Penalised, Profile,
    Separation, Settings, choice, direct, excess, scatter,
};
use crate::uncertainty::DegreesOfFreedom;
use crate::units::UM_PER_MM;

/// The banded system of outputs: two rows a slide position over s2 + s3 + s4 + 1 neighbours and the
/// two slide-free combinations of e, with the three conditions that settle line and parabola.
///
/// # Errors
/// The penalty is wider than the sensors reach.
pub fn banded_system(
    outputs: &Outputs,
    penalised: Penalised,
) -> Result<BandedSystem, FourSensorError> {
    let geometry = outputs.geometry();
    let [.., reach] = geometry.offsets();
    let mut system = BandedSystem::new(
        geometry.point_count(),
        reach + 1,
        direct::ZERO_UNKNOWNS,
        &penalised.penalty(),
    )?;
    let rows = row_patterns(geometry);
    // Differences do not see a constant or a line, and neither do the outputs: the ends are held.
    let ends_held = penalised.penalty() != Penalty::Identity;
    if ends_held {
        system.hold(0)?;
    }
    for (n, readings) in outputs.readings().iter().enumerate() {
        let combined = geometry.slide_free().transpose() * Vector4::from(*readings);
        for (combination, (band, border)) in rows.iter().enumerate() {
            system.push(n, band, border, combined[combination])?;
        }
    }
    if ends_held {
        system.hold(geometry.point_count() - 1)?;
    }
    let settled = if ends_held { 2 } else { 0 };
    for condition in conditions(geometry, penalised.line())
        .column_iter()
        .skip(settled)
    {
        system.require(condition.iter().copied().collect())?;
    }
    Ok(system)
}

/// Band and border values of the two rows of any slide position.
fn row_patterns(geometry: &Geometry) -> [(Vec<f64>, [f64; 2]); 2] {
    let free = geometry.slide_free();
    let offsets = geometry.offsets();
    std::array::from_fn(|combination| {
        let mut band = vec![0.0; offsets[3] + 1];
        for (sensor, offset) in offsets.into_iter().enumerate() {
            band[offset] = free[(sensor, combination)];
        }
        let mut border = [0.0; 2];
        border[combination] = 1.0;
        (band, border)
    })
}

/// Separates long records.
///
/// # Errors
/// As [`LongSeparator::new`] and [`LongSeparator::separate`].
pub fn separate_long(
    outputs: &Outputs,
    penalised: Penalised,
    line: Line,
    settings: &Settings,
) -> Result<Separation, FourSensorError> {
    LongSeparator::new(outputs, penalised, line, settings)?.separate()
}

/// The banded system of one record of outputs.
#[derive(Debug, Clone)]
pub struct LongSeparator<'a> {
    outputs: &'a Outputs,
    settings: &'a Settings,
    system: BandedSystem,
    penalised: Penalised,
    line: Line,
}

impl<'a> LongSeparator<'a> {
    /// Builds the system; `line` is what the answer is stated from.
    ///
    /// # Errors
    /// The parabola comes from the zero-adjustments or the slope of the tilt, whose uncertainty is not
    /// local.
    pub fn new(
        outputs: &'a Outputs,
        penalised: Penalised,
        line: Line,
        settings: &'a Settings,
    ) -> Result<Self, FourSensorError> {
        if matches!(
            settings.parabola,
            Parabola::ZeroAdjustment(_) | Parabola::TiltSlope(_)
        ) {
            return Err(FourSensorError::ParabolaOfLongRecord);
        }
        Ok(Self {
            system: banded_system(outputs, penalised)?,
            outputs,
            settings,
            penalised,
            line,
        })
    }

    /// Separates the outputs.
    ///
    /// # Errors
    /// As [`Separator::separate`](super::Separator::separate).
    pub fn separate(&self) -> Result<Separation, FourSensorError> {
        let (outputs, settings) = (self.outputs, self.settings);
        let chosen = choice::choose(&self.system, settings.choice, settings.noise)?;
        let factored = self.system.factor(chosen.point.lambda)?;
        let rows = 2 * outputs.readings().len();
        let noise = match (settings.noise, chosen.point.noise_estimate(rows)) {
            (Some(noise), _) | (None, Some(noise)) => noise,
            (None, None) => return Err(FourSensorError::NoNoise),
        };
        let scatter = scatter::of_surface(&self.system, &chosen, noise)?;
        let frame = Frame::new(outputs, self.line, settings.parabola);
        let settled = frame.settle(&DVector::from_column_slice(factored.solution()));
        let bias = frame.change(&DVector::from_vec(factored.bias_estimate()));

        let stated = Stated::new(outputs.geometry(), self.penalised.line(), self.line);
        let (variances, pulls) = factored.variances_of(|factored| stated.forms(factored))?;
        let variances = (variances + frame.own_variances()) * noise.powi(2)
            + pulls.map(|pull| (scatter.held_back * pull).powi(2));
        let std = variances.map(|variance| variance.max(0.0).sqrt());
        let bound = pulls * chosen.point.seminorm;
        let points = settled.surface.len();
        let count = settled.tilt.len();
        let profile = |values: DVector<f64>, bias: DVector<f64>, from: usize| Profile {
            std: std.rows(from, values.len()).into_owned(),
            bias_bound: bound.rows(from, values.len()).into_owned(),
            bias,
            values,
        };
        Ok(Separation {
            residuals: frame.residuals(&settled),
            zero_adjustment: settled.zero_adjustment.into(),
            zero_adjustment_std: std::array::from_fn(|k| std[points + 2 * count + k]),
            scatter,
            curvature: settled.curvature,
            surface: profile(settled.surface, bias.surface, 0),
            straightness: profile(settled.straightness, bias.straightness, points),
            tilt: profile(settled.tilt, bias.tilt, points + count),
            noise,
            noise_estimated: settings.noise.is_none(),
            degrees_of_freedom: degrees_of_freedom(settings, &chosen, rows),
            chosen,
            excess: None,
        })
    }

    /// Errors of f, S, γ and e that white noise gives, with the λ that was chosen.
    ///
    /// # Errors
    /// As [`separate`](Self::separate).
    pub fn noise_errors(&self, found: &Separation) -> Result<Vec<excess::Found>, FourSensorError> {
        let of = self.error_of_draw(found, None)?;
        (0..excess::DRAWS).map(of).collect()
    }

    /// Counts noise that is correlated along the slide in the uncertainties of what was found of outputs that were read once,
    /// where these show it, and gives it.
    ///
    /// # Errors
    /// As [`separate`](Self::separate).
    pub fn count_correlation(
        &self,
        found: &mut Separation,
    ) -> Result<Option<Along>, FourSensorError> {
        let Some(along) = Along::of(self.outputs) else {
            return Ok(None);
        };
        let of = |along| excess::mean_squares(self.error_of_draw(found, along)?);
        let (correlated, white) = (of(Some(&along))?, of(None)?);
        found.count_correlation(&along, &correlated, &white);
        Ok(Some(along))
    }

    fn error_of_draw<'b>(
        &'b self,
        found: &'b Separation,
        along: Option<&'b Along>,
    ) -> Result<impl Fn(u64) -> Result<excess::Found, FourSensorError> + 'b, FourSensorError> {
        let factored = self.system.factor(found.chosen.point.lambda)?;
        let frame = Frame::new(self.outputs, self.line, self.settings.parabola);
        let truth = vec![0.0; self.system.penalty_rows()];
        Ok(move |draw| {
            let random = &mut excess::random(draw);
            let noise = found.random_noise(self.outputs, along, random, 1.0);
            let seen = direct::slide_free_part(self.outputs.geometry(), &noise);
            let error = DVector::from_vec(factored.change(seen.as_slice(), &truth)?);
            Ok(frame.error(&error, &noise).profiles())
        })
    }

    /// The minimum-zone straightness of S that was found, the noise known to `degrees` of freedom
    /// ([`Separation::degrees_of_freedom`], unless it came from elsewhere).
    ///
    /// # Errors
    /// As [`separate`](Self::separate).
    pub fn straightness_error(
        &self,
        found: &Separation,
        degrees: DegreesOfFreedom,
        along: Option<&Along>,
    ) -> Result<MinimumZone, FourSensorError> {
        let geometry = self.outputs.geometry();
        let factored = self.system.factor(found.chosen.point.lambda)?;
        let frame = Frame::new(self.outputs, self.line, self.settings.parabola);
        let positions = self.outputs.slide_positions();
        minimum_zone(&positions, &found.straightness.values, degrees, |random| {
            let noise = found.noise_of_straightness(self.outputs, along, random);
            let truth: Vec<f64> = (0..self.system.penalty_rows())
                .map(|_| found.scatter.held_back * normal(random))
                .collect();
            let seen = direct::slide_free_part(geometry, &noise);
            let error = DVector::from_vec(factored.change(seen.as_slice(), &truth)?);
            Ok(frame.error(&error, &noise).straightness)
        })
    }
}

/// What is stated, as combinations of the unknowns of the banded system: local ones, and the line
/// that is taken away where the answer has another line than the penalty.
struct Stated {
    combinations: Vec<Combination>,
    /// Two weights over all points whose values tell the line.
    line: Option<[Vec<f64>; 2]>,
    /// How much of either each combination has.
    shares: Vec<[f64; 2]>,
}

impl Stated {
    fn new(geometry: &Geometry, penalised: Line, stated: Line) -> Self {
        let (points, count) = (geometry.point_count(), geometry.output_count());
        let combinations = combinations(geometry);
        let last = (points - 1) as f64;
        let centre = 0.5 * last;
        let (weights, slope): ([Vec<f64>; 2], [f64; 2]) = match stated {
            Line::EndPoints => {
                let unit = |at: usize| (0..points).map(|n| f64::from(n == at)).collect();
                ([unit(0), unit(points - 1)], [-1.0 / last, 1.0 / last])
            }
            Line::LeastSquares => {
                let arm = |n: usize| n as f64 - centre;
                let inertia: f64 = (0..points).map(|n| arm(n).powi(2)).sum();
                let mean = vec![1.0 / points as f64; points];
                let slope = (0..points).map(|n| arm(n) / inertia).collect();
                ([mean, slope], [0.0, 1.0])
            }
        };
        let line_at = |n: usize| match stated {
            Line::EndPoints => [1.0 - n as f64 / last, n as f64 / last],
            Line::LeastSquares => [1.0, n as f64 - centre],
        };
        // f − line, S + line, γ + its slope; e keeps its values.
        let per_step = 1.0 / (UM_PER_MM * geometry.step());
        let shares = (0..points)
            .map(|n| line_at(n).map(|share| -share))
            .chain((0..count).map(line_at))
            .chain((0..count).map(|_| slope.map(|share| share * per_step)))
            .chain((0..4).map(|_| [0.0; 2]))
            .collect();
        Self {
            combinations,
            line: (penalised != stated).then_some(weights),
            shares,
        }
    }

    /// wᵀ(AᵀA + λ²LᵀL)⁻¹w of each: f, S, γ, e.
    fn forms(&self, factored: &Factored<'_>) -> Result<Vec<f64>, RegularizationError> {
        let mut forms = factored.forms(&self.combinations);
        let Some(line) = &self.line else {
            return Ok(forms);
        };
        let columns = [factored.column(&line[0])?, factored.column(&line[1])?];
        let between = |j: usize, k: usize| -> f64 {
            line[j].iter().zip(&columns[k]).map(|(w, c)| w * c).sum()
        };
        let own = [between(0, 0), between(0, 1), between(1, 1)];
        for ((form, combination), [a, b]) in
            forms.iter_mut().zip(&self.combinations).zip(&self.shares)
        {
            *form += 2.0 * (a * combination.of(&columns[0]) + b * combination.of(&columns[1]))
                + a * a * own[0]
                + 2.0 * a * b * own[1]
                + b * b * own[2];
        }
        Ok(forms)
    }
}

/// f at each point, then S and γ at each slide position, then e, as combinations of the unknowns. Under
/// the conditions the penalty's line and the parabola are settled already, so each is local.
fn combinations(geometry: &Geometry) -> Vec<Combination> {
    let offsets = geometry.offsets();
    let width = offsets[3] + 1;
    let slide = direct::slide_of(geometry);
    let zeros = DMatrix::from_fn(4, 2, |sensor, combination| {
        let mut unit = Vector2::zeros();
        unit[combination] = 1.0;
        direct::zero_adjustments(geometry, unit)[sensor]
    });
    let of_surface = (0..geometry.point_count()).map(|n| Combination {
        first: n,
        band: vec![1.0],
        border: vec![0.0; 2],
    });
    let of_slide = (0..2).flat_map(|row| {
        let mut band = vec![0.0; width];
        let mut border = vec![0.0; 2];
        for (sensor, offset) in offsets.into_iter().enumerate() {
            band[offset] -= slide[(row, sensor)];
            for (combination, border) in border.iter_mut().enumerate() {
                *border -= slide[(row, sensor)] * zeros[(sensor, combination)];
            }
        }
        (0..geometry.output_count()).map(move |n| Combination {
            first: n,
            band: band.clone(),
            border: border.clone(),
        })
    });
    let of_zero = (0..4).map(|sensor| Combination {
        first: 0,
        band: Vec::new(),
        border: vec![zeros[(sensor, 0)], zeros[(sensor, 1)]],
    });
    of_surface.chain(of_slide).chain(of_zero).collect()
}
