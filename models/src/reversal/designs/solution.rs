//! The solution of a design and what can be asked of it.

use errsep_solvers::linear::bordered::BorderedCovariance;
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::Parameters;

use super::analysis::Analysis;
use super::channel::Design;
use super::closure::{self, DesignClosure, PositionSlope};
use super::determined::{Determined, SLOPES};
use super::found::{ChannelResiduals, DesignConvergence, Found, FoundForm};
use super::layout::{FormOf, Layout};
use super::problem::crest::Beside;
use super::problem::{Body, DesignProblem, Splines};
use super::readings::{DesignObservations, Trace};
use crate::basis::bspline::{Cubic, horner};
use crate::reversal::Rounding;
use crate::reversal::channel_noise::gathered::Gathered;
use crate::reversal::channel_noise::scatter::Scatter;
use crate::reversal::channel_noise::settle::Settled;
use crate::reversal::channel_noise::supposed::against_white;
use crate::reversal::channel_noise::survey::Survey;
use crate::reversal::channel_noise::white::Told;
use crate::reversal::channel_noise::{freedom_left, rms, traces};
use crate::reversal::finer_forms::FinerForms;
use crate::reversal::forward::Attitude;
use crate::reversal::simultaneous::fitted_knots::FittedKnots;
use crate::reversal::simultaneous::{Agreement, Axis, NoiseOrigin};
use crate::reversal::staged::Value;
use crate::units::{UM_PER_MM, mm_from_um};

/// The simultaneous solution of a design.
#[derive(Debug, Clone)]
pub struct DesignFit {
    /// The channels.
    pub design: Design,
    /// What they determine.
    pub determined: Determined,
    layout: Layout,
    splines: Splines,
    cubics: Vec<Vec<Cubic>>,
    /// The forms on the break points and on finer ones, where they were chosen.
    finer: Option<FinerForms>,
    axis: Axis,
    parameters: Parameters,
    covariance: BorderedCovariance,
    /// The artefact; half its thickness as it was given.
    body: Body,
    /// How the bar stands beside the stylus of each channel, where that is a term.
    beside: Vec<Beside>,
    /// Half the thickness of the artefact as it is known or found, mm.
    half_mm: f64,
    scatter: Scatter,
    /// 1/σ by channel, 1/µm.
    weights: Vec<f64>,
    /// ½ Σ r² of the weighted residuals.
    pub cost: f64,
    /// Standard deviation of one reading, µm, all channels together.
    pub noise_um: f64,
    /// Where the noise comes from.
    pub noise_origin: NoiseOrigin,
    /// Whether model and readings agree.
    pub agreement: Agreement,
    /// Readings less unknowns.
    pub degrees_of_freedom: f64,
    /// Reading less model, µm, in the order of the observations.
    pub residuals: Vec<f64>,
    /// The greatest height taken out of a trace, µm, where repeats that stand apart were brought to one height for the fit.
    pub levelled_um: Option<f64>,
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

/// A minimum with its noise.
pub(super) struct Reached<'a> {
    pub problem: &'a DesignProblem<'a>,
    pub settled: Settled,
    pub covariance: BorderedCovariance,
    pub told: Told,
    /// Standard deviation of a reading of each channel in the weights, µm.
    pub sigmas: Vec<f64>,
    pub knots: FittedKnots,
    /// The forms on the break points and on finer ones, where they were chosen.
    pub finer: Option<FinerForms>,
    /// How the bar stands beside the stylus of each channel, where that is a term.
    pub beside: Vec<Beside>,
}

impl DesignFit {
    pub(super) fn new(
        observations: &DesignObservations,
        determined: Determined,
        reached: Reached,
    ) -> Self {
        let Reached { problem, told, .. } = reached;
        let (result, left) = (&reached.settled.fit, &reached.settled.residuals);
        let readings = observations.readings.len();
        let mut residuals = vec![0.0; readings];
        for (trace, own) in problem.traces.iter().zip(left) {
            for (i, r) in trace.source.iter().zip(own) {
                residuals[*i] = *r;
            }
        }
        let by_channel: Vec<ChannelResiduals> = left
            .iter()
            .zip(&reached.sigmas)
            .map(|(own, sigma)| ChannelResiduals {
                readings: own.len(),
                rms: rms(own),
                sigma: told.sigma(*sigma),
            })
            .collect();
        let sigmas: Vec<f64> = by_channel.iter().map(|c| c.sigma).collect();
        let squares = by_channel
            .iter()
            .map(|c| c.readings as f64 * c.sigma * c.sigma);
        let noise_um = (squares.sum::<f64>() / readings as f64).sqrt();
        let design = observations.design.clone();
        Self {
            closures: closure::profiles(&design, &determined, problem, left, &sigmas),
            position_slopes: closure::slopes(problem, result, &told.scatter),
            design,
            determined,
            layout: problem.layout.clone(),
            splines: problem.splines.clone(),
            cubics: problem.cubics(&result.parameters),
            finer: reached.finer,
            axis: problem.axis,
            parameters: result.parameters.clone(),
            covariance: reached.covariance,
            body: problem.body.clone(),
            beside: reached.beside,
            half_mm: problem.half_mm(&result.parameters),
            scatter: told.scatter,
            weights: problem.weights.clone(),
            cost: result.cost,
            noise_um,
            noise_origin: told.origin,
            agreement: told.agreement,
            degrees_of_freedom: freedom_left(problem),
            residuals,
            levelled_um: None,
            by_channel,
            knots: reached.knots,
            convergence: DesignConvergence {
                ending: result.ending.clone(),
                history: reached.settled.history.clone(),
                seconds: 0.0,
            },
        }
    }

    /// By what factor the standard uncertainty of each of [`Self::slopes`] would change if that share of
    /// the noise's variance were correlated along the traces over a length, mm, instead of white.
    ///
    /// # Errors
    /// [`NoValue`] where a probe touches in two places.
    pub fn if_correlated(
        &self,
        observations: &DesignObservations,
        share: f64,
        length: f64,
    ) -> Result<Vec<f64>, NoValue> {
        let own = Trace::sort(observations);
        let survey = Survey::new(&own, |i| observations.taken(i));
        let groups = traces::grouped(&survey.x, &survey.traces);
        let problem = DesignProblem::new(
            &own,
            self.layout.clone(),
            self.splines.clone(),
            self.axis,
            self.body.clone(),
            self.weights.clone(),
        );
        let prepared = problem.at(&self.parameters)?;
        let row = |channel, row| problem.derivatives(&prepared, channel, row);
        let gathered = Gathered::new(row, &survey, &groups, &self.weights)?;
        let factor = |p: &usize| {
            let counted = gathered.counted(&self.covariance, &[(*p, 1.0)]);
            against_white(&counted, share, length).sqrt()
        };
        Ok(self.slope_order().iter().map(factor).collect())
    }

    /// How readings were rounded where that is more coarsely than they scatter: the channel of which repeats have most of it in
    /// common. It is in the uncertainties.
    pub fn rounding(&self) -> Option<Rounding> {
        self.scatter.rounding()
    }

    fn border_value(&self, j: usize) -> (Value, f64) {
        let (std, freedom) = self.scatter.spread(&self.covariance, &[], &[(j, 1.0)]);
        let value = self.parameters.border[j];
        (Value { value, std }, freedom)
    }

    fn found(&self, analysis: &Analysis, from: usize) -> Vec<Found> {
        let names = Determined::names(analysis);
        let pivots = analysis.pivots().iter().enumerate();
        pivots
            .zip(names)
            .map(|((p, j), name)| {
                let (value, degrees_of_freedom) = self.border_value(from + p);
                Found {
                    alone: analysis.alone(&analysis.unknowns()[*j]).is_some(),
                    name,
                    value,
                    degrees_of_freedom,
                }
            })
            .collect()
    }

    /// The places of the fitted slopes, those of the slide first.
    fn slope_order(&self) -> Vec<usize> {
        let names = Determined::names(&self.determined.slopes);
        let mut order: Vec<usize> = (0..names.len()).collect();
        order.sort_by_key(|p| {
            let first = names[*p].split(' ').next();
            SLOPES.iter().position(|name| Some(*name) == first)
        });
        order
    }

    /// The slopes, rad, or what is determined of them, those of the slide first.
    pub fn slopes(&self) -> Vec<Found> {
        let found = self.found(&self.determined.slopes, 0);
        let order = self.slope_order().into_iter();
        order.map(|p| found[p].clone()).collect()
    }

    /// The constants, µm, or what is determined of them.
    pub fn constants(&self) -> Vec<Found> {
        self.found(&self.determined.constants, self.layout.constants_from())
    }

    /// A slope by its name; `None` where the design does not determine it by itself.
    pub fn slope(&self, name: &str) -> Option<Value> {
        Some(self.border_value(self.determined.slopes.alone(name)?).0)
    }

    /// A constant by its name; `None` where the design does not determine it by itself.
    pub fn constant(&self, name: &str) -> Option<Value> {
        let p = self.determined.constants.alone(name)?;
        Some(self.border_value(self.layout.constants_from() + p).0)
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
                let spread: Vec<(f64, f64)> = x.iter().map(|x| self.form_std(form, *x)).collect();
                // What the model misses may lie in the form itself, finer than the knots.
                let cut_off = self.finer.as_ref().map_or(0.0, |finer| {
                    finer.cut_off(&[(form, 1.0)], |x| self.form_std(form, x).0.powi(2))
                });
                let missed = self.agreement.missed.max(cut_off);
                FoundForm {
                    name: names[p].clone(),
                    side: match self.layout.forms[form] {
                        FormOf::Side(side) if alone => Some(self.design.sides()[side]),
                        _ => None,
                    },
                    alone,
                    values: x.iter().map(|x| self.form_value(form, *x)).collect(),
                    std: spread.iter().map(|s| s.0.hypot(missed)).collect(),
                    missed,
                    degrees_of_freedom: spread.iter().fold(f64::INFINITY, |l, s| l.min(s.1)),
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
            let basis = &self.splines.bases[side];
            let k = basis.cell_of(u);
            let (left, width) = basis.cell(k);
            let [a, b, c, d] = self.cubics[side][k];
            let t = (u - left) / width;
            let height = horner(&[a, b, c, d], t);
            let slope = (b + t * (2.0 * c + 3.0 * t * d)) / width;
            (mm_from_um(height), mm_from_um(slope))
        };
        let u = attitude.contact(x, touched)?;
        let slides = self.layout.slides[channel].iter();
        let slide: f64 = slides
            .map(|seen| seen.along * self.form_value(seen.form, x))
            .sum();
        let seen = UM_PER_MM * attitude.reading_mm(u, touched(u).0);
        let lost = self.lost(channel, x)?;
        Ok(seen + slide + self.layout.constant(channel, border) - lost)
    }

    /// What a channel loses at a slide position (mm) because its stylus stands beside the crest, µm; zero
    /// where that is no term.
    ///
    /// # Errors
    /// [`NoValue`] where the stylus stands beside the bar.
    pub fn lost(&self, channel: usize, x: f64) -> Result<f64, NoValue> {
        let Some(beside) = self.beside.get(channel) else {
            return Ok(0.0);
        };
        let slides = self.layout.slides[channel].iter();
        let wander = slides.map(|seen| seen.across * self.form_value(seen.form, x));
        Ok(beside.loss(x, wander.sum())?.um)
    }

    /// The thickness where it is fitted, mm, with its degrees of freedom.
    pub fn thickness(&self) -> Option<Found> {
        let (value, degrees_of_freedom) = self.border_value(self.layout.thickness_index()?);
        Some(Found {
            name: "thickness".to_owned(),
            alone: true,
            value,
            degrees_of_freedom,
        })
    }

    /// The cells of each form, by its name.
    pub fn cells(&self) -> Vec<(String, usize)> {
        let forms = self.splines.breaks.iter().enumerate();
        forms
            .map(|(form, breaks)| (self.layout.form_name(form, &self.design), breaks.len() - 1))
            .collect()
    }

    fn form_value(&self, form: usize, at: f64) -> f64 {
        let basis = &self.splines.bases[form];
        let k = basis.cell_of(at);
        let (left, width) = basis.cell(k);
        horner(&self.cubics[form][k], (at - left) / width)
    }

    /// The part of the standard uncertainty of a form at a position that the noise makes, µm, and its degrees of freedom.
    fn form_std(&self, form: usize, at: f64) -> (f64, f64) {
        let (first, functions) = self.splines.bases[form].values(at);
        let band: Vec<(usize, f64)> = functions
            .into_iter()
            .enumerate()
            .filter_map(|(l, f)| Some((self.layout.coefficient(form, first + l)?, f)))
            .collect();
        let [height, slope] = self.layout.line(form);
        let border = [(height, -1.0), (slope, -self.axis.xi(at))];
        let (std, freedom) = self.scatter.spread(&self.covariance, &band, &border);
        (std, freedom)
    }
}
