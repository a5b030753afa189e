//! Every model of a run beside the others, under one law of the noise.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::contrasts::{Scatter, TurnResiduals, turn_residuals};
use super::error::TurningError;
use super::fit::{TurningFit, bent, fit, steady, unsteady};
use super::noise::{laws, misfit, windows};
use super::problem::Held;
use super::run::Run;
use super::setting::{Setting, Wave};
use super::spread::{Slow, Spread};
use super::start::Survey;
use crate::noise::{Law, Posterior};

/// A cell of a spline is so many turns long or longer: each turn has one level and one wave, and what happens
/// within a turn is the section's.
const TURNS_A_CELL: f64 = 1.0;
/// Levels or waves of single turns are taken to hold more than noise where noise alone makes as much less often
/// than this: what were always added, and never taken away, would make uncertainties too large on average.
const SLOW_SEEN: f64 = 0.05;
/// Rungs of the ladder of cells up to here are all tried: with few cells a fit may end in a minimum far from the
/// best one, and the next rungs too.
const ALL_TRIED: usize = 40;
/// Beyond that, rungs without a better one after which it ends. A reading sees four coefficients of one spline, and
/// between these stand all that the other has over as many cells: where one has few cells and the other one a turn
/// of a long run, the band is as wide as a part of the run, and its memory goes by the square of the cells.
const PATIENCE: usize = 2;
/// −2 ln of the likelihood by which an unknown of the form must lower it (Akaike).
const AKAIKE: f64 = 2.0;
/// Cells from which the law of the noise is first taken, at most.
const FIRST_CELLS: (usize, usize) = (20, 40);

/// What is known of a run beforehand.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plan {
    /// Harmonics, indicator, handedness; cells and wave are the analysis's own.
    pub setting: Setting,
    /// Cells of the form; `None`: chosen.
    pub form_cells: Option<usize>,
    /// Cells of the turn; `None`: chosen.
    pub turn_cells: Option<usize>,
}

/// One model of the run.
#[derive(Debug, Clone)]
pub struct Rival<'a> {
    /// Its fit.
    pub fit: TurningFit<'a>,
    /// −2 ln of the likelihood of its residuals under the law, up to a constant.
    pub misfit: f64,
    /// What stands out of its residuals, turn by turn.
    pub turns: TurnResiduals,
    /// Root mean square of what it misses of turns that it was not fitted to, µm.
    pub held_out: Option<f64>,
}

/// All models of a run.
#[derive(Debug, Clone)]
pub struct Analysis<'a> {
    /// Law of the noise, µm² and the unit of time.
    pub law: Law,
    /// What levels and waves of single turns scatter beyond the law.
    pub slow: Slow,
    /// By how many times the squares of levels or waves of single turns, whichever are more, exceed what the
    /// law allows; 1 where noise alone makes as much.
    pub factor: f64,
    /// A straight bar that turns steadily, or as recorded.
    pub steady: Rival<'a>,
    /// The same with an angle that strays.
    pub unsteady: Option<Rival<'a>>,
    /// A bar of any axis that turns steadily.
    pub bent: Option<Rival<'a>>,
    /// Of the unsteady turn with γ across of the other sign: its misfit beyond the better one's.
    pub mirror: Option<f64>,
}

/// Fits every model.
///
/// # Errors
/// [`TurningError`] where the steady turn has no fit; of a rival that has none there is none.
pub fn analyse<'a>(
    run: &'a Run,
    survey: &'a Survey,
    plan: &Plan,
) -> Result<Analysis<'a>, TurningError> {
    let (noise, setting) = described(run, survey, plan)?;
    let even = steady(run, survey, &setting)?;
    let bend = bent(run, survey, &setting, &even).ok();
    let strays = unsteady(run, survey, &setting, &even, bend.as_ref()).unwrap_or_default();
    // The law is that of whatever leaves least.
    let least = strays.first().into_iter().chain(&bend).chain([&even]);
    let least = least.min_by(|a, b| {
        misfit(run, &a.residuals, &noise).total_cmp(&misfit(run, &b.residuals, &noise))
    });
    let known = least.map_or_else(
        || Posterior::of_white(noise.variance(), run.len()),
        |fit| laws(run, &fit.psi, &fit.residuals),
    );
    let noise = known.mean();
    let rival = |fit: TurningFit<'a>| Rival {
        misfit: misfit(run, &fit.residuals, &noise),
        turns: turn_residuals(&fit, &known),
        held_out: None,
        fit,
    };
    let mut strays = strays.into_iter().map(rival).collect::<Vec<_>>();
    strays.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    let mirror = (strays.len() > 1).then(|| strays[1].misfit - strays[0].misfit);
    let mut strays = strays.into_iter();
    let (even, stray, bend) = (rival(even), strays.next(), bend.map(rival));
    let (slow, factor) = slow_of([Some(&even), stray.as_ref(), bend.as_ref()]);
    Ok(Analysis {
        law: noise,
        slow,
        factor,
        steady: even,
        unsteady: stray,
        bent: bend,
        mirror,
    })
}

/// A first law of the noise, and the cells that describe the run best under it.
fn described(run: &Run, survey: &Survey, plan: &Plan) -> Result<(Law, Setting), TurningError> {
    let most = ((survey.turns / TURNS_A_CELL) as usize).max(1);
    let first = Setting {
        form_cells: plan.form_cells.unwrap_or(most.min(FIRST_CELLS.0)),
        wave: Wave::Unsteady {
            cells: plan.turn_cells.unwrap_or(most.min(FIRST_CELLS.1)),
        },
        ..plan.setting.clone()
    };
    let even = steady(run, survey, &first)?;
    let bend = bent(run, survey, &first, &even).ok();
    let Ok(fits) = unsteady(run, survey, &first, &even, bend.as_ref()) else {
        return Ok((laws(run, &even.psi, &even.residuals).mean(), first));
    };
    let noise = laws(run, &fits[0].psi, &fits[0].residuals).mean();
    let setting = chosen(run, survey, &first, &fits[0], plan, &noise, most);
    Ok((noise, setting))
}

/// What is slow in the rival of least misfit where it is seen, and by what it raises the variances.
fn slow_of(rivals: [Option<&Rival>; 3]) -> (Slow, f64) {
    let all = rivals.into_iter().flatten();
    let least = all.min_by(|a, b| a.misfit.total_cmp(&b.misfit));
    let seen = |of: fn(&TurnResiduals) -> Scatter| {
        let scatter = least.map(|rival| of(&rival.turns));
        scatter.filter(|s| s.p_value < SLOW_SEEN && s.ratio > 1.0)
    };
    let (levels, waves) = (seen(|t| t.levels), seen(|t| t.waves));
    let ratio = |s: Option<Scatter>| s.map_or(1.0, |s| s.ratio);
    let excess = |s: Option<Scatter>| s.map_or(0.0, |s| s.excess);
    let slow = Slow {
        level: excess(levels),
        wave: excess(waves),
    };
    (slow, ratio(levels).max(ratio(waves)))
}

/// The cells that describe the run: of the turn, then of the form, one rung of a ladder above those of greatest
/// likelihood under the law less ½ ln n for each unknown of the turn (Schwarz), which is a rival, and less one for each of the
/// form (Akaike), which any run has.
///
/// At the best rung what the cells do not follow is as great as the noise that one more rung would take up. A rung above, the
/// error of a cubic spline, which falls by the fourth power of the length of its cells, is a quarter of that; what is left
/// is counted by [`CutOff`](super::cut_off::CutOff).
fn chosen(
    run: &Run,
    survey: &Survey,
    first: &Setting,
    from: &TurningFit,
    plan: &Plan,
    noise: &Law,
    most: usize,
) -> Setting {
    let hold = Held {
        across: from.across_held,
        ..Held::default()
    };
    let score = |setting: &Setting, a_unknown: f64| {
        let fitted = fit(run, survey, setting, hold, &|problem, at| {
            at.border.clone_from(&from.at.border);
            if let (Some(basis), Some(unknowns)) = (&problem.wave, problem.wave_unknowns.first()) {
                let turn = from.turn_on(basis, false).unwrap_or_default();
                for (j, value) in unknowns.iter().zip(turn) {
                    at.band[*j] = value;
                }
            }
        });
        let fitted = fitted.ok()?;
        let price = a_unknown * fitted.unknowns as f64;
        Some(misfit(run, &fitted.residuals, noise) + price)
    };
    let mut setting = first.clone();
    if plan.turn_cells.is_none() {
        let with = |cells| Setting {
            wave: Wave::Unsteady { cells },
            ..setting.clone()
        };
        let score = |setting: &Setting| score(setting, (run.len() as f64).ln());
        setting = above_best_of(most, with, &score).unwrap_or(setting);
    }
    if plan.form_cells.is_none() {
        let with = |form_cells| Setting {
            form_cells,
            ..setting.clone()
        };
        let by = |price: f64| above_best_of(most, with, &|s: &Setting| score(s, price));
        // With a cell a turn the form takes up what the noise holds of slow changes, which no law within a few turns tells.
        let taken = match by(AKAIKE) {
            Some(fine) if fine.form_cells >= most => by((run.len() as f64).ln())
                .filter(|coarse| 2 * coarse.form_cells <= most)
                .or(Some(fine)),
            taken => taken,
        };
        setting = taken.unwrap_or(setting);
    }
    setting
}

/// The rung above the best of a ladder of cells.
fn above_best_of(
    most: usize,
    with: impl Fn(usize) -> Setting,
    score: &impl Fn(&Setting) -> Option<f64>,
) -> Option<Setting> {
    let above = |cells: usize| (cells + 1).max(cells * 7 / 5).min(most);
    let mut best: Option<(f64, usize)> = None;
    let (mut cells, mut since) = (1, 0);
    loop {
        let value = score(&with(cells)).unwrap_or(f64::INFINITY);
        if value.is_finite() && best.is_none_or(|b| value < b.0) {
            best = Some((value, cells));
            since = 0;
        } else if cells > ALL_TRIED {
            since += 1;
        }
        if cells >= most || since > PATIENCE {
            return best.map(|b| with(above(b.1)));
        }
        cells = above(cells);
    }
}

impl Rival<'_> {
    /// Covariance of its unknowns.
    pub fn spread(&self, analysis: &Analysis) -> Spread {
        Spread::new(&self.fit, &analysis.law, analysis.slow)
    }
}

impl Analysis<'_> {
    /// Evidence for a rival against the steady turn: half of what the misfit falls by, less ½ ln n for
    /// each further unknown (Schwarz).
    pub fn evidence(&self, rival: &Rival) -> f64 {
        let n = rival.fit.residuals.len() as f64;
        let more = rival.fit.unknowns as f64 - self.steady.fit.unknowns as f64;
        0.5 * (self.steady.misfit - rival.misfit - more * n.ln())
    }

    /// Probability that noise alone makes the misfit fall by as much.
    pub fn p_value(&self, rival: &Rival) -> f64 {
        let more = rival.fit.unknowns as f64 - self.steady.fit.unknowns as f64;
        let fall = (self.steady.misfit - rival.misfit) / self.factor;
        match ChiSquared::new(more.max(1.0)) {
            Ok(law) if fall > 0.0 => law.sf(fall),
            _ => 1.0,
        }
    }

    /// Probability that a steady turn seems to stray as much, from the covariance of the stray itself; where the
    /// likelihood falls less, that of the fall: with γ across of the other sign a steady turn is one that strays, and
    /// of two fits alike the stray of one says nothing.
    pub fn p_steady(&self) -> f64 {
        let Some(rival) = &self.unsteady else {
            return 1.0;
        };
        match rival.fit.strays(&rival.spread(self)) {
            Some((square, freedom)) if freedom > 0.0 => {
                let known = self.steady.turns.freedom.max(3.0);
                // The covariance is the mean over the laws, known / (known − 2) of Fisher's scale.
                let ratio = square / freedom * known / (known - 2.0);
                let own = FisherSnedecor::new(freedom, known).map_or(1.0, |law| law.sf(ratio));
                own.max(self.p_value(rival))
            }
            _ => 1.0,
        }
    }

    /// Fits steady turn and rivals to every other turn and sees what they miss of the turns between. Where a
    /// spline has cells shorter than two turns nothing is told: a cell would have no reading that is fitted.
    pub fn hold_out(&mut self, run: &Run, survey: &Survey) {
        let mut turn = vec![0; run.len()];
        for (k, window) in windows(&self.steady.fit.psi, 1.0).into_iter().enumerate() {
            turn[window].fill(k);
        }
        let rivals = [
            Some(&mut self.steady),
            self.unsteady.as_mut(),
            self.bent.as_mut(),
        ];
        let most = (survey.turns / 2.0) as usize;
        for rival in rivals.into_iter().flatten() {
            if rival.fit.setting().most_cells() > most {
                continue;
            }
            let halves =
                [0, 1].map(|half| missed(&rival.fit, survey, run, &|i| turn[i] % 2 == half));
            rival.held_out = match halves {
                [Some(a), Some(b)] => Some(((a.0 + b.0) / (a.1 + b.1)).sqrt()),
                _ => None,
            };
        }
    }
}

/// Sum of squares and number of the readings that were left out of a fit to those that `keep` keeps.
fn missed(
    whole: &TurningFit,
    survey: &Survey,
    run: &Run,
    keep: &impl Fn(usize) -> bool,
) -> Option<(f64, f64)> {
    let part = run.part(keep);
    let own = Survey {
        frame: survey.frame.part(keep),
        ..survey.clone()
    };
    let hold = Held {
        across: whole.across_held,
        ..Held::default()
    };
    let fitted = fit(&part, &own, whole.setting(), hold, &|problem, at| {
        *at = problem.taken_over(&whole.problem, &whole.at);
    })
    .ok()?;
    let at = whole.problem.taken_over(&fitted.problem, &fitted.at);
    let left = whole.problem.residuals(&at);
    let out = left.iter().enumerate().filter(|(i, _)| !keep(*i));
    let (sum, count) = out.fold((0.0, 0.0), |(s, n), (_, r)| (s + r * r, n + 1.0));
    Some((sum, count))
}
