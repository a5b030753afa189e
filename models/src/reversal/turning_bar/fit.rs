//! The fit of one model to a run, from starts that the run itself tells.

use std::sync::Arc;

use errsep_solvers::linear::bordered::BorderedCovariance;
use errsep_solvers::options::Options as Minimisation;
use errsep_solvers::structured::{Parameters, StructuredProblem, fit_structured};
use nalgebra::Complex;

use super::error::TurningError;
use super::nearest::{TurnSample, turn_near};
use super::problem::{ACROSS_E, ALONG_E, ECCENTRICITY, Held, SPEED, THETA, TurningProblem};
use super::run::Run;
use super::setting::{Setting, Wave};
use super::start::{Survey, TurnWave};
use crate::basis::bspline::CubicBSpline;

/// γ across the eccentricity is held at zero where it is below so many of its standard deviations: of
/// its square alone a run without recorded angle tells, and at zero nothing.
const ACROSS_SEEN: f64 = 5.0;

/// Steps at most: a steady turn fitted to one that is not leaves much, and then they come slowly.
const MOST_STEPS: u64 = 2000;

/// Readings for each coefficient of a spline that takes over the turn of a fit.
const SAMPLES: usize = 8;

/// Puts the unknowns where a fit begins.
type Begin<'b> = dyn Fn(&TurningProblem, &mut Parameters) + 'b;

/// A model at its least squares.
#[derive(Debug, Clone)]
pub struct TurningFit<'a> {
    pub(super) problem: TurningProblem<'a>,
    /// Where it is.
    pub(super) at: Parameters,
    /// (JᵀJ)⁻¹ over the unknowns of band and border; zero where held.
    pub(super) covariance: Arc<BorderedCovariance>,
    /// Reading less model, µm.
    pub residuals: Vec<f64>,
    /// ψ of every reading, rad.
    pub psi: Vec<f64>,
    /// Σ of the squares of the residuals, µm².
    pub squares: f64,
    /// Unknowns that were fitted.
    pub unknowns: usize,
    /// Steps of the minimisation.
    pub iterations: u64,
    /// Whether γ across the eccentricity was held at zero, because the run shows none.
    pub across_held: bool,
}

impl TurningFit<'_> {
    /// Root mean square of the residuals, µm.
    pub fn rms(&self) -> f64 {
        (self.squares / self.residuals.len() as f64).sqrt()
    }

    /// Readings beyond the unknowns.
    pub fn freedom(&self) -> f64 {
        (self.residuals.len() - self.unknowns) as f64
    }

    /// Unknowns of band and border, held or not.
    pub(super) fn count(&self) -> usize {
        self.problem.band_count() + self.problem.border_count()
    }

    /// What was fitted.
    pub fn setting(&self) -> &Setting {
        &self.problem.setting
    }

    /// γ across the eccentricity, µm over half the travel.
    pub(super) fn across(&self) -> f64 {
        self.at.border[ACROSS_E]
    }

    /// The once-per-turn wave of a bar of any axis, along the run.
    fn waves(&self) -> Option<Vec<TurnWave>> {
        let problem = &self.problem;
        let (Wave::Bent { .. }, Some(basis)) = (problem.setting.wave, &problem.wave) else {
            return None;
        };
        let [cos, sin] = [0, 1].map(|which| problem.wave_of(&self.at, which));
        let step = (self.psi.len() / (SAMPLES * basis.coefficient_count())).max(1);
        let readings = (0..self.psi.len()).step_by(step);
        let wave = |i: usize| {
            let (x, time) = (problem.run.x[i], problem.run.time[i]);
            let seen_rad = problem.setting.indicator_rad - problem.frame.base[i];
            let own = Complex::new(basis.evaluate(&cos, x).0, basis.evaluate(&sin, x).0);
            let z = own * Complex::from_polar(1.0, seen_rad - self.psi[i]);
            TurnWave { time, x, z }
        };
        Some(readings.map(wave).collect())
    }

    /// Coefficients of another spline in time that follows its turn, rad; `mirrored`: the turn by which the bar
    /// with γ across of the other sign makes the same wave.
    pub(super) fn turn_on(&self, basis: &CubicBSpline, mirrored: bool) -> Option<Vec<f64>> {
        let problem = &self.problem;
        let [e, along, across] = [ECCENTRICITY, ALONG_E, ACROSS_E].map(|j| self.at.border[j]);
        let step = (self.psi.len() / (SAMPLES * basis.coefficient_count())).max(1);
        let readings = (0..self.psi.len()).step_by(step);
        let samples: Vec<TurnSample> = readings
            .map(|i| {
                let seen_rad = problem.setting.indicator_rad - problem.frame.base[i];
                let xi = problem.frame.xi(problem.run.x[i]);
                let own = Complex::new(e + along * xi, across * xi);
                let turned = if mirrored { 2.0 * own.arg() } else { 0.0 };
                TurnSample {
                    time: problem.run.time[i],
                    stray: seen_rad - self.psi[i] + turned,
                    weight: step as f64 / self.psi.len() as f64,
                }
            })
            .collect();
        turn_near(basis, &samples)
    }
}

/// Fits a steady turn, or the recorded one: of the starts that the turns tell one by one.
///
/// # Errors
/// [`TurningError`]: a fit that has no answer.
pub fn steady<'a>(
    run: &'a Run,
    survey: &'a Survey,
    setting: &Setting,
) -> Result<TurningFit<'a>, TurningError> {
    let setting = Setting {
        wave: Wave::Steady,
        ..setting.clone()
    };
    fit_seen(run, survey, &setting, &|problem, at| {
        at.border[THETA] = survey.steady.theta;
        at.border[SPEED] = survey.steady.speed;
        put_bar(problem, at, survey.steady.bar);
    })
}

/// Fits a turn that strays, from three starts: the bar inclined to either side across its eccentricity,
/// each with the turn that the waves then tell, and the steady turn; then from the mirror of the best of them,
/// as all three may end on the side that is not the best. Where a bent bar leaves less, also from the turn that a
/// straight one would need to show the same wave. Returns the fits with γ across
/// positive and negative, the better first; one where both come to the same.
///
/// # Errors
/// [`TurningError`] of the last start where none has an answer.
pub fn unsteady<'a>(
    run: &'a Run,
    survey: &'a Survey,
    setting: &Setting,
    steady: &TurningFit,
    bent: Option<&TurningFit>,
) -> Result<Vec<TurningFit<'a>>, TurningError> {
    let [e, along, across] = survey.bar;
    let from_steady = |problem: &TurningProblem, at: &mut Parameters| {
        let theta = steady.at.border[THETA];
        let speed = steady.at.border[SPEED] / problem.frame.half_time;
        put_turn(problem, at, &|basis| {
            basis.line(theta - speed * problem.frame.middle, speed)
        });
        let bar = [ECCENTRICITY, ALONG_E, ACROSS_E].map(|j| steady.at.border[j]);
        put_bar(problem, at, bar);
    };
    let starts: [&Begin; 3] = [
        &seen_in(survey, [e, along, across]),
        &seen_in(survey, [e, along, -across]),
        &from_steady,
    ];
    let mut found: Vec<TurningFit<'a>> = Vec::new();
    let mut failed = TurningError::NoWave;
    for start in starts {
        match fit_seen(run, survey, setting, start) {
            Ok(fit) => keep_better(&mut found, fit),
            Err(why) => failed = why,
        }
    }
    let mirrored = found.first().filter(|best| !best.across_held);
    let mirrored = mirrored.and_then(|best| {
        let start: &Begin = &|problem, at| {
            put_turn(problem, at, &|basis| {
                best.turn_on(basis, true)
                    .unwrap_or_else(|| survey.turn(basis, [e, along, -best.across()]))
            });
            let [e, along] = [ECCENTRICITY, ALONG_E].map(|j| best.at.border[j]);
            put_bar(problem, at, [e, along, -best.across()]);
        };
        fit_seen(run, survey, setting, start).ok()
    });
    if let Some(fit) = mirrored {
        keep_better(&mut found, fit);
    }
    let better = |bent: &&TurningFit| found.first().is_none_or(|f| bent.squares < f.squares);
    if let Some(waves) = bent.filter(better).and_then(TurningFit::waves) {
        let shown = survey.with_waves(waves);
        let [e, along, across] = shown.bar;
        for across in [across, -across] {
            if let Ok(fit) = fit_seen(run, survey, setting, &seen_in(&shown, [e, along, across])) {
                keep_better(&mut found, fit);
            }
        }
    }
    if found.is_empty() {
        return Err(failed);
    }
    // Of a bar that is not seen to incline across there is one answer.
    if found.iter().any(|f| f.across_held) {
        found.truncate(1);
    }
    Ok(found)
}

/// The fit of the same model with γ across of the other sign, and the turn with which it makes the same waves.
pub(super) fn mirrored<'a>(
    run: &'a Run,
    survey: &'a Survey,
    of: &TurningFit<'a>,
) -> Option<TurningFit<'a>> {
    let start: &Begin = &|problem, at| {
        *at = problem.taken_over(&of.problem, &of.at);
        at.border[ACROSS_E] = -of.across();
        if problem.wave.is_some() {
            put_turn(problem, at, &|basis| {
                of.turn_on(basis, true).unwrap_or_default()
            });
        } else {
            let (low, high) = run.range();
            let (from, to) = (of.axis_direction(low), of.axis_direction(high));
            let forward = (run.x[run.len() - 1] - run.x[0]).signum();
            at.border[THETA] += from + to;
            at.border[SPEED] += forward * (to - from);
        }
    };
    fit(run, survey, of.setting(), Held::default(), start).ok()
}

/// A start with a bar, and the turn by which it makes the waves of a survey.
fn seen_in(survey: &Survey, bar: [f64; 3]) -> impl Fn(&TurningProblem, &mut Parameters) {
    move |problem, at| {
        put_turn(problem, at, &|basis| survey.turn(basis, bar));
        put_bar(problem, at, bar);
    }
}

/// Adds a fit to those found, one for either sign of γ across, the better first.
fn keep_better<'a>(found: &mut Vec<TurningFit<'a>>, fit: TurningFit<'a>) {
    let same = |f: &TurningFit| (f.across() < 0.0) == (fit.across() < 0.0);
    match found.iter().position(same) {
        Some(k) if fit.squares < found[k].squares => found[k] = fit,
        Some(_) => {}
        None => found.push(fit),
    }
    found.sort_by(|a, b| a.squares.total_cmp(&b.squares));
}

/// Fits a bar of any axis that turns as the steady fit found, with as many cells as the setting has.
///
/// # Errors
/// [`TurningError`]: a fit that has no answer.
pub fn bent<'a>(
    run: &'a Run,
    survey: &'a Survey,
    setting: &Setting,
    steady: &TurningFit,
) -> Result<TurningFit<'a>, TurningError> {
    let cells = match setting.wave {
        Wave::Unsteady { cells } | Wave::Bent { cells } => cells,
        Wave::Steady => setting.form_cells,
    };
    let setting = Setting {
        wave: Wave::Bent { cells },
        ..setting.clone()
    };
    fit(run, survey, &setting, Held::default(), &|_, at| {
        at.border[THETA] = steady.at.border[THETA];
        at.border[SPEED] = steady.at.border[SPEED];
    })
}

/// A fit in which γ across the eccentricity is held where it is not seen.
fn fit_seen<'a>(
    run: &'a Run,
    survey: &'a Survey,
    setting: &Setting,
    start: &Begin,
) -> Result<TurningFit<'a>, TurningError> {
    let free = fit(run, survey, setting, Held::default(), start);
    if run.angle.is_some() || !setting.growing {
        return free;
    }
    let seen = free.as_ref().is_ok_and(|fit| {
        let own = fit.covariance.border()[(ACROSS_E, ACROSS_E)];
        let variance = own * fit.squares / fit.freedom();
        fit.across().powi(2) > ACROSS_SEEN.powi(2) * variance
    });
    if seen {
        return free;
    }
    let hold = Held {
        across: true,
        ..Held::default()
    };
    fit(run, survey, setting, hold, &|problem, at| {
        start(problem, at);
        at.border[ACROSS_E] = 0.0;
    })
}

/// Fits from a start.
pub(super) fn fit<'a>(
    run: &'a Run,
    survey: &'a Survey,
    setting: &Setting,
    hold: Held,
    start: &Begin,
) -> Result<TurningFit<'a>, TurningError> {
    fit_within(run, survey, setting, hold, start, MOST_STEPS)
}

fn fit_within<'a>(
    run: &'a Run,
    survey: &'a Survey,
    setting: &Setting,
    hold: Held,
    start: &Begin,
    most_steps: u64,
) -> Result<TurningFit<'a>, TurningError> {
    setting.check()?;
    let problem = TurningProblem::new(run, setting, &survey.frame, hold)?;
    let mut at = Parameters::zeros(problem.band_count(), problem.border_count());
    start(&problem, &mut at);
    let options = Minimisation {
        max_iterations: most_steps,
        ..Minimisation::structured()
    };
    let result = fit_structured(&problem, at, &options)?;
    let residuals = problem.residuals(&result.parameters);
    let squares: f64 = residuals.iter().map(|r| r * r).sum();
    let covariance = result
        .covariance()
        .ok_or_else(|| TurningError::NotConverged {
            ending: result.ending.to_string(),
            residual_rms_um: (squares / residuals.len() as f64).sqrt(),
            iterations: result.iterations,
        })?;
    let at = result.parameters;
    Ok(TurningFit {
        psi: problem.seen(&at),
        squares,
        unknowns: problem.free_count(),
        iterations: result.iterations,
        across_held: hold.across,
        residuals,
        covariance: Arc::new(covariance),
        at,
        problem,
    })
}

fn put_bar(problem: &TurningProblem, at: &mut Parameters, bar: [f64; 3]) {
    let places = [ECCENTRICITY, ALONG_E, ACROSS_E];
    for (place, value) in places.into_iter().zip(bar) {
        if !problem.held()[place] {
            at.border[place] = value;
        }
    }
}

fn put_turn(
    problem: &TurningProblem,
    at: &mut Parameters,
    coefficients: &dyn Fn(&CubicBSpline) -> Vec<f64>,
) {
    if let (Some(basis), Some(unknowns)) = (&problem.wave, problem.wave_unknowns.first()) {
        for (j, value) in unknowns.iter().zip(coefficients(basis)) {
            at.band[*j] = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::simulate::{TurningPlan, simulate};
    use super::*;

    #[test]
    fn a_fit_without_a_minimum_tells_how_far_it_got() {
        let plan = TurningPlan {
            readings: 1200,
            turns: 20.0,
            ..TurningPlan::default()
        };
        let run = Run::new(&simulate(&plan).0).expect("a run");
        let setting = Setting::default();
        let survey = Survey::new(&run, 0.0, 1.0, None).expect("a bar that turns");
        let begin: &Begin = &|_, at| {
            at.border[THETA] = survey.steady.theta;
            at.border[SPEED] = survey.steady.speed;
        };
        let within = |steps| fit_within(&run, &survey, &setting, Held::default(), begin, steps);
        let best = within(MOST_STEPS).expect("a fit");
        let Err(TurningError::NotConverged {
            ending,
            residual_rms_um,
            iterations,
        }) = within(1)
        else {
            panic!("one step from a bar that runs true is no fit");
        };
        assert!(ending.contains("iteration"), "{ending}");
        assert_eq!(iterations, 1);
        assert!(residual_rms_um > best.rms() && residual_rms_um.is_finite());
    }
}
