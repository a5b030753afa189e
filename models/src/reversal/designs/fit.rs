//! The simultaneous fit of a design: start, knots, minimum.

use std::collections::HashMap;
use std::time::Instant;

use errsep_solvers::linear::bordered::{Bordered, BorderedCovariance};
use errsep_solvers::loss::Loss;
use errsep_solvers::options::Options as Minimisation;
use errsep_solvers::structured::{Parameters, StructuredProblem, evaluate, fit_structured};
use nalgebra::DVector;

use super::channel::Design;
use super::determined::{Determined, Zero};
use super::error::DesignFitError;
use super::layout::{FormOf, Layout};
use super::problem::DesignProblem;
use super::readings::{DesignObservations, Trace, range};
use super::solution::{DesignFit, Reached};
use super::staged;
use crate::basis::bspline::CubicBSpline;
use crate::reversal::channel_noise::along::AtRest;
use crate::reversal::channel_noise::settle::{Asked, Settled, settle};
use crate::reversal::channel_noise::survey::Survey;
use crate::reversal::channel_noise::weights_of;
use crate::reversal::channel_noise::white::Told;
use crate::reversal::forward::Attitude;
use crate::reversal::simultaneous::fitted_knots::FittedKnots;
use crate::reversal::simultaneous::knots::{
    FEWEST_POSITIONS, KnotTrial, PATIENCE, POSITIONS_A_CELL, ladder, trial,
};
use crate::reversal::simultaneous::{Axis, Knots, Noise};

/// Fewest readings beyond the unknowns from which the noise is told.
pub const FEWEST_FREE: usize = 3;

/// How to fit a design.
#[derive(Debug, Clone)]
pub struct DesignOptions {
    /// What becomes of the indicators' zeros.
    pub zero: Zero,
    /// Diameter of the artefact, mm; zero where it is not known: no shift between probe points.
    pub thickness_mm: f64,
    /// Noise of a reading.
    pub noise: Noise,
    /// Break points of the forms.
    pub knots: Knots,
    /// Settings of the minimisation.
    pub minimisation: Minimisation,
}

impl Default for DesignOptions {
    fn default() -> Self {
        Self {
            zero: Zero::default(),
            thickness_mm: 0.0,
            noise: Noise::default(),
            knots: Knots::default(),
            minimisation: Minimisation::structured(),
        }
    }
}

/// Fits slopes, constants and forms of a design to all readings at once.
///
/// # Errors
/// [`DesignFitError`]: readings or options that cannot be used, or a fit that has no answer.
pub fn fit(
    observations: &DesignObservations,
    options: &DesignOptions,
) -> Result<DesignFit, DesignFitError> {
    let began = Instant::now();
    check(observations, options)?;
    let traces = Trace::sort(observations);
    let determined = Determined::of(&observations.design, options.zero);
    let survey = Survey::new(&traces, |i| observations.taken(i));
    let mut sigmas = survey.first_noise(options.noise);
    let weights = weights_of(&sigmas);
    let ground = Ground::new(&observations.design, &determined, &traces, weights, options)?;
    let (breaks, table) = ground.breaks()?;
    let layout = ground.layout.with_coefficients(breaks.len() + 2);
    enough(&traces, layout.free_count(), is_declared(options))?;
    let (mut problem, start) = ground.problem(layout, &breaks)?;
    let asked = Asked {
        noise: options.noise,
        loss: Loss::Quadratic,
        minimisation: &options.minimisation,
    };
    let settled = settle(&mut problem, start, asked, &survey, &mut sigmas)?;
    let Some(covariance) = settled.fit.covariance() else {
        let ending = settled.fit.ending.to_string();
        return Err(DesignFitError::NotConverged { ending });
    };
    let told = told(&problem, &settled, &covariance, &survey, &sigmas, options)?;
    let knots = FittedKnots::new(breaks, table, &settled.residuals);
    let reached = Reached {
        problem: &problem,
        settled,
        covariance,
        told,
        sigmas,
        knots,
    };
    let mut solution = DesignFit::new(observations, determined.clone(), reached);
    solution.convergence.seconds = began.elapsed().as_secs_f64();
    Ok(solution)
}

/// What the fit tells of its noise: white, unless repeats tell more.
fn told(
    problem: &DesignProblem,
    settled: &Settled,
    covariance: &BorderedCovariance,
    survey: &Survey,
    sigmas: &[f64],
    options: &DesignOptions,
) -> Result<Told, DesignFitError> {
    let white = Told::white(problem, settled, sigmas, options.noise, Loss::Quadratic);
    if is_declared(options) || survey.repeats.is_empty() {
        return Ok(white);
    }
    let prepared = problem.at(&settled.fit.parameters)?;
    let layout = &problem.layout;
    let at_rest = AtRest {
        row: |channel, row| problem.derivatives(&prepared, channel, row),
        covariance,
        weights: &problem.weights,
        counts: (
            layout.band_count(),
            layout.border_count(),
            layout.free_count(),
        ),
    };
    Ok(Told::along(&at_rest, survey, &settled.residuals, sigmas)?.unwrap_or(white))
}

/// The largest difference between an analytic derivative of a residual at the fit and a central
/// difference, as a share of the largest derivative by the same unknown: a check of the model.
///
/// # Errors
/// As [`fit`].
#[doc(hidden)]
pub fn central_differences(
    observations: &DesignObservations,
    options: &DesignOptions,
) -> Result<f64, DesignFitError> {
    let traces = Trace::sort(observations);
    let determined = Determined::of(&observations.design, options.zero);
    let survey = Survey::new(&traces, |i| observations.taken(i));
    let weights = weights_of(&survey.first_noise(options.noise));
    let ground = Ground::new(&observations.design, &determined, &traces, weights, options)?;
    let (breaks, _) = ground.breaks()?;
    let layout = ground.layout.with_coefficients(breaks.len() + 2);
    let (problem, start) = ground.problem(layout, &breaks)?;
    let at = fit_structured(&problem, start, &options.minimisation)?.parameters;
    let analytic = problem.jacobian(&at)?;
    let n = at.band.len();
    let slopes = n..n + problem.layout.constants_from();
    let by_row: Vec<f64> = traces
        .iter()
        .zip(&problem.weights)
        .flat_map(|(t, weight)| vec![*weight; t.len()])
        .collect();
    let mut worst: f64 = 0.0;
    for (j, column) in analytic.column_iter().enumerate() {
        let step = if slopes.contains(&j) { 1e-7 } else { 1e-2 };
        let residuals = |by: f64| -> Result<Vec<f64>, DesignFitError> {
            let mut moved = at.clone();
            match j.checked_sub(n) {
                None => moved.band[j] += by,
                Some(k) => moved.border[k] += by,
            }
            Ok(problem.residuals(&moved)?.concat())
        };
        let (up, down) = (residuals(step)?, residuals(-step)?);
        let largest = column.amax();
        for (i, own) in column.iter().enumerate() {
            // The rows are model less reading.
            let difference = -by_row[i] * (up[i] - down[i]) / (2.0 * step);
            worst = worst.max((own - difference).abs() / largest);
        }
    }
    Ok(worst)
}

fn check(observations: &DesignObservations, options: &DesignOptions) -> Result<(), DesignFitError> {
    let not_usable =
        |what: String, value: f64, must| Err(DesignFitError::NotUsable { what, value, must });
    if !(options.thickness_mm >= 0.0 && options.thickness_mm.is_finite()) {
        return not_usable("the thickness".into(), options.thickness_mm, "0 mm or more");
    }
    if let Noise::Declared(sigma) = options.noise
        && !(sigma > 0.0 && sigma.is_finite())
    {
        return not_usable("the noise".into(), sigma, "above 0 um");
    }
    let channels = observations.design.channels();
    for reading in &observations.readings {
        let Some(channel) = channels.get(reading.channel) else {
            return not_usable(
                "a channel's place".into(),
                reading.channel as f64,
                "in the design",
            );
        };
        for (what, value) in [("position", reading.x), ("reading", reading.value)] {
            if !value.is_finite() {
                return not_usable(
                    format!("a {what} of channel {}", channel.name),
                    value,
                    "finite",
                );
            }
        }
    }
    Ok(())
}

fn is_declared(options: &DesignOptions) -> bool {
    matches!(options.noise, Noise::Declared(_))
}

/// Whether there are as many readings and positions as the unknowns need.
fn enough(traces: &[Trace], unknowns: usize, declared: bool) -> Result<(), DesignFitError> {
    let readings: usize = traces.iter().map(Trace::len).sum();
    let free = if declared { 0 } else { FEWEST_FREE };
    if readings < unknowns + free {
        return Err(DesignFitError::TooFewReadings { readings, unknowns });
    }
    let positions = traces.iter().map(Trace::positions).max().unwrap_or(0);
    if positions < FEWEST_POSITIONS {
        return Err(DesignFitError::TooFewPositions { positions });
    }
    Ok(())
}

/// What every stage of a fit stands on.
struct Ground<'a> {
    design: &'a Design,
    determined: &'a Determined,
    traces: &'a [Trace],
    options: &'a DesignOptions,
    layout: Layout,
    /// Tilt (rad) and height (µm) of each channel's line.
    lines: Vec<(f64, f64)>,
    axis: Axis,
    /// First weights, 1/σ by channel.
    weights: Vec<f64>,
}

impl<'a> Ground<'a> {
    fn new(
        design: &'a Design,
        determined: &'a Determined,
        traces: &'a [Trace],
        weights: Vec<f64>,
        options: &'a DesignOptions,
    ) -> Result<Self, DesignFitError> {
        let lines = staged::lines(design, traces)?;
        let count: usize = traces.iter().map(Trace::len).sum();
        let center = traces.iter().map(|t| t.x.iter().sum::<f64>()).sum::<f64>() / count as f64;
        let (low, high) = range(traces);
        let scale = (high - low) / 2.0;
        Ok(Self {
            layout: Layout::new(design, determined, FEWEST_POSITIONS),
            design,
            determined,
            traces,
            options,
            lines,
            axis: Axis { center, scale },
            weights,
        })
    }

    /// The break points that the options ask for, and the ladder where they are chosen.
    fn breaks(&self) -> Result<(Vec<f64>, Vec<KnotTrial>), DesignFitError> {
        match &self.options.knots {
            Knots::At(breaks) => Ok((breaks.clone(), Vec::new())),
            Knots::Cells(asked) => match self.most_cells() {
                most if *asked > most && most > 0 => {
                    let asked = *asked;
                    Err(DesignFitError::TooManyKnots { asked, most })
                }
                _ => Ok((self.even(*asked)?, Vec::new())),
            },
            Knots::Chosen => {
                let (cells, table) = self.choose()?;
                Ok((self.even(cells)?, table))
            }
        }
    }

    /// Most cells that the readings carry: a spline of K cells with its slope and constant has K + 3
    /// unknowns and needs as many positions, and all unknowns need as many readings.
    fn most_cells(&self) -> usize {
        let readings: usize = self.traces.iter().map(Trace::len).sum();
        let free = if is_declared(self.options) {
            0
        } else {
            FEWEST_FREE
        };
        let others = self.layout.free_count() - self.layout.band_count();
        let by_readings = readings.saturating_sub(others + free) / self.layout.forms.len().max(1);
        let positions = self.traces.iter().map(Trace::positions).max().unwrap_or(0);
        let by_positions = positions.saturating_sub(FEWEST_POSITIONS - 1);
        by_readings.saturating_sub(1).min(by_positions)
    }

    /// Goes up a ladder of cells; the best by the corrected information criterion, and the table.
    fn choose(&self) -> Result<(usize, Vec<KnotTrial>), DesignFitError> {
        let readings: usize = self.traces.iter().map(Trace::len).sum();
        let positions = self.traces.iter().map(Trace::positions).max().unwrap_or(0);
        let (mut table, mut best): (Vec<KnotTrial>, usize) = (Vec::new(), 0);
        for cells in std::iter::once(1).chain(ladder(positions / POSITIONS_A_CELL)) {
            let breaks = self.even(cells)?;
            let layout = self.layout.with_coefficients(breaks.len() + 2);
            let count = layout.free_count();
            if table.last().is_some_and(|t| t.cells == breaks.len() - 1) {
                continue;
            }
            if readings < count + FEWEST_FREE {
                break;
            }
            let (problem, start) = self.problem(layout, &breaks)?;
            let evaluation = evaluate(&problem, &start)?;
            let Some(squares) = squares_left(&problem, &evaluation.system) else {
                break;
            };
            table.push(trial(breaks.len() - 1, readings, count, squares));
            let last = table.len() - 1;
            if table[last].aicc < table[best].aicc {
                best = last;
            } else if last >= best + PATIENCE {
                break;
            }
        }
        Ok((table.get(best).map_or(1, |t| t.cells), table))
    }

    /// Breaks of so many equal cells; a cell in which the channels with a reading do not tell all forms
    /// apart is joined to the next.
    fn even(&self, cells: usize) -> Result<Vec<f64>, DesignFitError> {
        let (low, high) = range(self.traces);
        let even = CubicBSpline::uniform(low, high, cells.max(1))?;
        let mut breaks = vec![low];
        let mut seen = vec![false; self.traces.len()];
        let mut at = vec![0; self.traces.len()];
        let mut told: HashMap<Vec<bool>, bool> = HashMap::new();
        for right in &even.breaks()[1..] {
            for (c, trace) in self.traces.iter().enumerate() {
                let next = at[c] + trace.x[at[c]..].partition_point(|x| x < right);
                seen[c] |= next > at[c];
                at[c] = next;
            }
            let apart = *told
                .entry(seen.clone())
                .or_insert_with(|| staged::tell_apart(&self.determined.forms, &seen));
            if apart {
                breaks.push(*right);
                seen.fill(false);
            }
        }
        // What is left at the end belongs to the last cell.
        if breaks.len() > 1 {
            breaks.pop();
        }
        breaks.push(high);
        Ok(breaks)
    }

    /// The problem on these breaks, and where it begins: slopes and constants of the channels' lines,
    /// forms of zero (they enter linearly: the first step finds them).
    fn problem(
        &self,
        layout: Layout,
        breaks: &[f64],
    ) -> Result<(DesignProblem<'a>, Parameters), DesignFitError> {
        let half_mm = self.options.thickness_mm / 2.0;
        let bases = self.bases(&layout, breaks, half_mm)?;
        let mut start = Parameters::zeros(layout.band_count(), layout.border_count());
        let (slopes, constants) = staged::start(self.determined, &self.lines);
        start.border[..slopes.len()].copy_from_slice(&slopes);
        start.border[layout.constants_from()..][..constants.len()].copy_from_slice(&constants);
        let problem = DesignProblem::new(
            self.traces,
            layout,
            bases,
            self.axis,
            half_mm,
            self.weights.clone(),
        );
        Ok((problem, start))
    }

    /// The bases of the forms: the slide's on the positions, a side's stretched to where the tilted
    /// probes touch it.
    fn bases(
        &self,
        layout: &Layout,
        breaks: &[f64],
        half_mm: f64,
    ) -> Result<Vec<CubicBSpline>, DesignFitError> {
        let (low, high) = range(self.traces);
        let slide = CubicBSpline::new(breaks.to_vec())?;
        let mut bases = Vec::with_capacity(layout.forms.len());
        for form in &layout.forms {
            let FormOf::Side(side) = form else {
                bases.push(slide.clone());
                continue;
            };
            let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
            for (c, (trace, line)) in self.traces.iter().zip(&self.lines).enumerate() {
                if self.design.side_of(c) == *side
                    && let (Some(first), Some(last)) = (trace.x.first(), trace.x.last())
                {
                    let attitude = Attitude::new(line.0, half_mm)?;
                    let touched = |x: f64| (x + half_mm * attitude.sin) / attitude.cos;
                    from = from.min(touched(*first));
                    to = to.max(touched(*last));
                }
            }
            let stretched = |b: &f64| from + (to - from) * ((b - low) / (high - low));
            bases.push(CubicBSpline::new(breaks.iter().map(stretched).collect())?);
        }
        Ok(bases)
    }
}

/// The sum of squares that the linear fit leaves.
fn squares_left(problem: &DesignProblem, system: &Bordered) -> Option<f64> {
    let missing = DVector::zeros(problem.constraints().len());
    let solved = system
        .solve(problem.constraints(), &missing, problem.held())
        .ok()?;
    let left =
        system.sum_of_squares() - 2.0 * system.predicted_reduction(&solved.band, &solved.border);
    Some(left.max(system.unreachable_residual().powi(2)))
}
