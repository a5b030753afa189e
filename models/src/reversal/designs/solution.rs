//! The solution of a design and what can be asked of it.

use errsep_solvers::linear::bordered::BorderedCovariance;
use errsep_solvers::outcome::{Ending, Iteration};
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{Parameters, StructuredFit};

use super::analysis::Analysis;
use super::channel::Design;
use super::closure::{self, DesignClosure, PositionSlope};
use super::determined::{Determined, SLOPES};
use super::error::DesignFitError;
use super::fit::DesignOptions;
use super::layout::{FormOf, Layout};
use super::problem::DesignProblem;
use super::readings::DesignObservations;
use crate::basis::bspline::{Cubic, CubicBSpline, horner};
use crate::reversal::forward::Attitude;
use crate::reversal::simultaneous::Axis;
use crate::reversal::simultaneous::fitted_knots::FittedKnots;
use crate::reversal::staged::Value;
use crate::units::{UM_PER_MM, mm_from_um};

/// A fitted slope or constant: an unknown by itself, or with others that the design does not tell from
/// it.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Its name, such as `alpha_h` or `alpha_h + cone`.
    pub name: String,
    /// Whether it is an unknown by itself.
    pub alone: bool,
    /// rad for slopes, µm for constants.
    pub value: Value,
}

/// A fitted form, or forms that the design does not tell apart.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundForm {
    /// Its name, such as `M_h`, `S_90` or `M_h + S_0`.
    pub name: String,
    /// The side of the artefact, degrees, where it is that of a side by itself.
    pub side: Option<f64>,
    /// Whether it is a form by itself.
    pub alone: bool,
    /// Values, µm, without straight-line part over the measured positions.
    pub values: Vec<f64>,
    /// Standard uncertainties, µm.
    pub std: Vec<f64>,
}

/// Residuals of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelResiduals {
    /// Number of readings.
    pub readings: usize,
    /// Root mean square, µm.
    pub rms: f64,
}

/// How the fit went.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignConvergence {
    /// How it ended.
    pub ending: Ending,
    /// One record a pass over all readings.
    pub history: Vec<Iteration>,
    /// Time of the whole fit.
    pub seconds: f64,
}

/// The simultaneous solution of a design.
#[derive(Debug, Clone)]
pub struct DesignFit {
    /// The channels.
    pub design: Design,
    /// What they determine.
    pub determined: Determined,
    layout: Layout,
    bases: Vec<CubicBSpline>,
    cubics: Vec<Vec<Cubic>>,
    axis: Axis,
    parameters: Parameters,
    covariance: BorderedCovariance,
    /// Half the thickness of the artefact, mm.
    half_mm: f64,
    /// Variance of a weighted reading.
    variance: f64,
    /// ½ Σ r² of the weighted residuals.
    pub cost: f64,
    /// Standard deviation of one reading, µm: declared, or from the residuals.
    pub noise_um: f64,
    /// Whether it was declared.
    pub noise_declared: bool,
    /// Readings less unknowns.
    pub degrees_of_freedom: f64,
    /// Reading less model, µm, in the order of the observations.
    pub residuals: Vec<f64>,
    /// The same by channel.
    pub by_channel: Vec<ChannelResiduals>,
    /// Combinations of channels that are zero whatever the forms are.
    pub closures: Vec<DesignClosure>,
    /// Slopes common to a position of the spindle, were they free.
    pub position_slopes: Vec<PositionSlope>,
    /// The knots.
    pub knots: FittedKnots,
    /// How the fit went.
    pub convergence: DesignConvergence,
}

impl DesignFit {
    pub(super) fn new(
        observations: &DesignObservations,
        determined: Determined,
        problem: &DesignProblem,
        result: &StructuredFit,
        by_channel: Vec<Vec<f64>>,
        knots: FittedKnots,
        options: &DesignOptions,
    ) -> Result<Self, DesignFitError> {
        let Some(covariance) = result.covariance() else {
            let ending = result.ending.to_string();
            return Err(DesignFitError::NotConverged { ending });
        };
        let readings = observations.readings.len();
        let degrees_of_freedom = readings as f64 - problem.layout.free_count() as f64;
        let squares: f64 = by_channel.iter().flatten().map(|r| r * r).sum();
        let (variance, noise_um) = match options.noise_um {
            Some(sigma) => (1.0, sigma),
            None => {
                let variance = squares / degrees_of_freedom;
                (variance, variance.sqrt())
            }
        };
        let mut residuals = vec![0.0; readings];
        for (trace, own) in problem.traces.iter().zip(&by_channel) {
            for (i, r) in trace.source.iter().zip(own) {
                residuals[*i] = *r;
            }
        }
        let design = observations.design.clone();
        let closures = closure::profiles(&design, &determined, problem, &by_channel, noise_um);
        let unit = match options.noise_um {
            Some(_) => None,
            None => Some((squares, degrees_of_freedom)),
        };
        let position_slopes = closure::slopes(problem, result, unit);
        Ok(Self {
            design,
            determined,
            layout: problem.layout.clone(),
            bases: problem.bases.clone(),
            cubics: problem.cubics(&result.parameters),
            axis: problem.axis,
            parameters: result.parameters.clone(),
            covariance,
            half_mm: problem.half_mm,
            variance,
            cost: result.cost,
            noise_um,
            noise_declared: options.noise_um.is_some(),
            degrees_of_freedom,
            residuals,
            by_channel: by_channel
                .iter()
                .map(|own| ChannelResiduals {
                    readings: own.len(),
                    rms: (own.iter().map(|r| r * r).sum::<f64>() / own.len() as f64).sqrt(),
                })
                .collect(),
            closures,
            position_slopes,
            knots,
            convergence: DesignConvergence {
                ending: result.ending.clone(),
                history: result.history.clone(),
                seconds: 0.0,
            },
        })
    }

    /// Degrees of freedom of every standard uncertainty: infinite where the noise was declared.
    pub fn freedom(&self) -> f64 {
        if self.noise_declared {
            f64::INFINITY
        } else {
            self.degrees_of_freedom
        }
    }

    fn border_value(&self, j: usize) -> Value {
        Value {
            value: self.parameters.border[j],
            std: (self.variance * self.covariance.variance(&[], &[(j, 1.0)])).sqrt(),
        }
    }

    fn found(&self, analysis: &Analysis, from: usize) -> Vec<Found> {
        let names = Determined::names(analysis);
        let pivots = analysis.pivots().iter().enumerate();
        pivots
            .zip(names)
            .map(|((p, j), name)| Found {
                alone: analysis.alone(&analysis.unknowns()[*j]).is_some(),
                name,
                value: self.border_value(from + p),
            })
            .collect()
    }

    /// The slopes, rad, or what is determined of them, those of the slide first.
    pub fn slopes(&self) -> Vec<Found> {
        let mut slopes = self.found(&self.determined.slopes, 0);
        slopes.sort_by_key(|found| {
            let first = found.name.split(' ').next();
            SLOPES.iter().position(|name| Some(*name) == first)
        });
        slopes
    }

    /// The constants, µm, or what is determined of them.
    pub fn constants(&self) -> Vec<Found> {
        self.found(&self.determined.constants, self.layout.constants_from())
    }

    /// A slope by its name; `None` where the design does not determine it by itself.
    pub fn slope(&self, name: &str) -> Option<Value> {
        Some(self.border_value(self.determined.slopes.alone(name)?))
    }

    /// A constant by its name; `None` where the design does not determine it by itself.
    pub fn constant(&self, name: &str) -> Option<Value> {
        let p = self.determined.constants.alone(name)?;
        Some(self.border_value(self.layout.constants_from() + p))
    }

    /// The forms at positions (mm), or what is determined of them: those of the slide first.
    pub fn forms(&self, x: &[f64]) -> Vec<FoundForm> {
        let analysis = &self.determined.forms;
        let names = Determined::names(analysis);
        (0..self.layout.forms.len())
            .map(|form| {
                let unknown = self.layout.form_name(form, &self.design);
                let p = analysis
                    .pivots()
                    .iter()
                    .position(|j| analysis.unknowns()[*j] == unknown)
                    .unwrap_or(0);
                let alone = analysis.alone(&unknown).is_some();
                FoundForm {
                    name: names[p].clone(),
                    side: match self.layout.forms[form] {
                        FormOf::Side(side) if alone => Some(self.design.sides()[side]),
                        _ => None,
                    },
                    alone,
                    values: x.iter().map(|x| self.form_value(form, *x)).collect(),
                    std: x.iter().map(|x| self.form_std(form, *x)).collect(),
                }
            })
            .collect()
    }

    /// What a channel, by its place in the design, would read at a slide position (mm), µm.
    ///
    /// # Errors
    /// [`NoValue`] for a channel that is not in the design, or where the probe touches in two places.
    pub fn predict(&self, channel: usize, x: f64) -> Result<f64, NoValue> {
        let Some(side) = self.layout.side.get(channel).copied() else {
            return Err(NoValue::new(format!("there is no channel {channel}")));
        };
        let border = &self.parameters.border;
        let attitude = Attitude::new(self.layout.slope(channel, border), self.half_mm)?;
        let touched = |u: f64| {
            let basis = &self.bases[side];
            let k = basis.cell_of(u);
            let (left, width) = basis.cell(k);
            let [a, b, c, d] = self.cubics[side][k];
            let t = (u - left) / width;
            let height = horner(&[a, b, c, d], t);
            let slope = (b + t * (2.0 * c + 3.0 * t * d)) / width;
            (mm_from_um(height), mm_from_um(slope))
        };
        let u = attitude.contact(x, touched)?;
        let slide: f64 = self.layout.slides[channel]
            .iter()
            .map(|(form, factor)| factor * self.form_value(*form, x))
            .sum();
        let seen = UM_PER_MM * attitude.reading_mm(u, touched(u).0);
        Ok(seen + slide + self.layout.constant(channel, border))
    }

    fn form_value(&self, form: usize, at: f64) -> f64 {
        let basis = &self.bases[form];
        let k = basis.cell_of(at);
        let (left, width) = basis.cell(k);
        horner(&self.cubics[form][k], (at - left) / width)
    }

    fn form_std(&self, form: usize, at: f64) -> f64 {
        let (first, functions) = self.bases[form].values(at);
        let band: Vec<(usize, f64)> = functions
            .into_iter()
            .enumerate()
            .filter_map(|(l, f)| Some((self.layout.coefficient(form, first + l)?, f)))
            .collect();
        let [height, slope] = self.layout.line(form);
        let border = [(height, -1.0), (slope, -self.axis.xi(at))];
        (self.variance * self.covariance.variance(&band, &border)).sqrt()
    }
}
