//! All fits of one model that a run allows, where one fit with its covariance is not all.
//!
//! Without a recorded angle |e + γx|² = |e|² + 2(e·γ)x + |γ|²x² is what counts. Near γ across e = 0 a derivative by it says
//! nothing, and whatever its size a bar inclined to the other side that turns a little otherwise reads alike. Speed and curve
//! of the turn go with γ across to first order, so that they are no surer than it is. So the model is fitted with γ across
//! held at values to both sides of zero, or at both its signs; each fit counts with its likelihood, and what is told has the
//! variances within the fits and between them.

use super::analysis::{Analysis, Rival};
use super::answers::{Bar, Harmonic, Told, TurnCurve};
use super::cut_off::CutOff;
use super::fit::{TurningFit, fit, mirrored};
use super::noise::misfit;
use super::problem::{ACROSS_E, ALONG_E, ECCENTRICITY, Held};
use super::run::Run;
use super::setting::Wave;
use super::spread::{Slow, Spread};
use super::start::Survey;
use crate::noise::Law;

/// Values of γ across on either side of zero.
const VALUES: usize = 6;
/// −2 ln of the likelihood of the outermost of them beside the best: 0.2 % of it.
const OUTERMOST: f64 = 12.0;
/// Fits at most while the outermost is sought.
const SOUGHT: usize = 24;

/// One of the fits.
struct Part<'a> {
    weight: f64,
    fit: TurningFit<'a>,
    spread: Spread,
}

/// The fits that count, their weights together one.
pub struct Possible<'a> {
    parts: Vec<Part<'a>>,
    /// The one whose values are told, where they are not means over all.
    own: Option<usize>,
    cut_off: CutOff,
}

impl<'a> Possible<'a> {
    /// Those of a rival. `sign_told`: whether something tells the sign of γ across.
    pub fn of(
        run: &'a Run,
        survey: &'a Survey,
        analysis: &Analysis<'a>,
        rival: &Rival<'a>,
        sign_told: bool,
    ) -> Self {
        Self::of_fit(
            run,
            survey,
            &rival.fit,
            (&analysis.law, analysis.slow, analysis.factor),
            sign_told,
        )
    }

    /// Those of a fit under a law of the noise, what is slower, and by how many times that raises squares.
    pub(super) fn of_fit(
        run: &'a Run,
        survey: &'a Survey,
        chosen: &TurningFit<'a>,
        (law, slow, factor): (&Law, Slow, f64),
        sign_told: bool,
    ) -> Self {
        let spread = Spread::new(chosen, law, slow);
        let free = run.angle.is_none()
            && chosen.setting().growing
            && !matches!(chosen.setting().wave, Wave::Bent { .. });
        let doubted = |fit: &TurningFit| misfit(run, &fit.residuals, law) / factor;
        let (fits, own) = if free && chosen.across_held {
            (with_values(run, survey, chosen, &doubted), None)
        } else {
            let mut fits = vec![(doubted(chosen), chosen.clone())];
            if free && !sign_told {
                let other = mirrored(run, survey, chosen);
                let other = other.filter(|f| (f.across() < 0.0) != (chosen.across() < 0.0));
                fits.extend(other.map(|fit| (doubted(&fit), fit)));
            }
            (fits, Some(0))
        };
        let least = fits.iter().map(|f| f.0).fold(f64::INFINITY, f64::min);
        let likely = |misfit: f64| (0.5 * (least - misfit)).exp();
        let whole: f64 = fits.iter().map(|f| likely(f.0)).sum();
        let parts = fits
            .into_iter()
            .map(|(misfit, fit)| Part {
                weight: likely(misfit) / whole,
                spread: Spread::new(&fit, law, slow),
                fit,
            })
            .collect();
        Self {
            parts,
            own,
            cut_off: CutOff::of(run, survey, chosen, &spread),
        }
    }

    /// A value of every fit as one: with the variance within the fits and between them.
    fn one(&self, of: impl Fn(&Part<'a>) -> Told) -> Told {
        let all: Vec<Told> = self.parts.iter().map(of).collect();
        self.joined(&all)
    }

    fn joined(&self, all: &[Told]) -> Told {
        let weighed = || self.parts.iter().map(|p| p.weight).zip(all);
        let value = match self.own {
            Some(own) => all[own].value,
            None => weighed().map(|(w, told)| w * told.value).sum(),
        };
        let variance: f64 = weighed()
            .map(|(w, told)| w * (told.std.powi(2) + (told.value - value).powi(2)))
            .sum();
        Told {
            value,
            std: variance.sqrt(),
        }
    }

    /// As [`TurningFit::slope`].
    pub fn slope(&self) -> Told {
        self.one(|p| p.fit.slope(&p.spread))
    }

    /// As [`TurningFit::speed`]; `None` of a bar of any axis, whose direction is one with the turn where no angle was
    /// recorded.
    pub fn speed(&self, base_hz: f64) -> Option<Told> {
        let first = &self.parts.first()?.fit;
        let any_axis = matches!(first.setting().wave, Wave::Bent { .. });
        let told = first.problem.run.angle.is_some() || !any_axis;
        told.then(|| self.one(|p| p.fit.speed(base_hz, &p.spread)))
    }

    /// As [`TurningFit::form`], with what the knots cut off.
    pub fn form(&self, places: &[f64]) -> Vec<Told> {
        let all: Vec<Vec<Told>> = self
            .parts
            .iter()
            .map(|p| p.fit.form(places, &p.spread))
            .collect();
        (0..places.len())
            .map(|k| {
                let here: Vec<Told> = all.iter().map(|of| of[k]).collect();
                let told = self.joined(&here);
                Told {
                    std: told.std.hypot(self.cut_off.form_um),
                    ..told
                }
            })
            .collect()
    }

    /// As [`TurningFit::bar`]. Where the sign of γ across is not told, γ across and the turning of e + γx are told but for it.
    pub fn bar(&self) -> Option<Bar> {
        let all: Option<Vec<Bar>> = self.parts.iter().map(|p| p.fit.bar(&p.spread)).collect();
        let all = all?;
        let towards = |bar: &Bar, told: Told| match self.own {
            Some(own) if bar.across_rad.value * all[own].across_rad.value < 0.0 => Told {
                value: -told.value,
                ..told
            },
            _ => told,
        };
        let of = |one: &dyn Fn(&Bar) -> Told| self.joined(&all.iter().map(one).collect::<Vec<_>>());
        Some(Bar {
            eccentricity_um: of(&|b| b.eccentricity_um),
            along_rad: of(&|b| b.along_rad),
            across_rad: of(&|b| towards(b, b.across_rad)),
            inclination_rad: of(&|b| b.inclination_rad),
            turned_rad: of(&|b| towards(b, b.turned_rad)),
        })
    }

    /// As [`TurningFit::harmonics`]: of one fit, the amplitudes as unsure as they differ from fit to fit.
    pub fn harmonics(&self) -> Vec<Harmonic> {
        let likeliest = (0..self.parts.len())
            .max_by(|a, b| self.parts[*a].weight.total_cmp(&self.parts[*b].weight));
        let Some(own) = self.own.or(likeliest) else {
            return Vec::new();
        };
        let all: Vec<Vec<Harmonic>> = self
            .parts
            .iter()
            .map(|p| p.fit.harmonics(&p.spread))
            .collect();
        let mut told = all[own].clone();
        for (h, harmonic) in told.iter_mut().enumerate() {
            let size = harmonic.middle.norm();
            let variance: f64 = (self.parts.iter().zip(&all))
                .map(|(p, of)| {
                    p.weight * (of[h].std.powi(2) + (of[h].middle.norm() - size).powi(2))
                })
                .sum();
            harmonic.std = variance.sqrt();
        }
        told
    }

    /// As [`TurningFit::curve`], with what the knots cut off.
    pub fn curve(&self, points: usize, base_hz: f64) -> Option<TurnCurve> {
        let all: Option<Vec<TurnCurve>> = self
            .parts
            .iter()
            .map(|p| p.fit.curve(points, base_hz, &p.spread))
            .collect();
        let all = all?;
        let mut curve = all.get(self.own.unwrap_or(0))?.clone();
        for k in 0..curve.time.len() {
            let here = |c: &TurnCurve| Told {
                value: c.lag_rad[k],
                std: c.lag_std[k],
            };
            let told = self.joined(&all.iter().map(here).collect::<Vec<_>>());
            curve.lag_rad[k] = told.value;
            curve.lag_std[k] = told.std.hypot(self.cut_off.lag_rad);
            if self.own.is_none() {
                let speeds = self.parts.iter().zip(&all);
                curve.speed[k] = speeds.map(|(p, c)| p.weight * c.speed[k]).sum();
            }
        }
        curve.seek_greatest();
        Some(curve)
    }
}

/// The model with γ across held at values to both sides of zero, as far as the readings allow, each with its misfit.
fn with_values<'a>(
    run: &'a Run,
    survey: &'a Survey,
    chosen: &TurningFit<'a>,
    doubted: &impl Fn(&TurningFit) -> f64,
) -> Vec<(f64, TurningFit<'a>)> {
    let hold = Held {
        across: true,
        ..Held::default()
    };
    let at = |across: f64| {
        let start = |problem: &super::problem::TurningProblem,
                     at: &mut errsep_solvers::structured::Parameters| {
            *at = problem.taken_over(&chosen.problem, &chosen.at);
            at.border[ACROSS_E] = across;
        };
        let fitted = fit(run, survey, chosen.setting(), hold, &start).ok()?;
        Some((doubted(&fitted), fitted))
    };
    let zero = (doubted(chosen), chosen.clone());
    // What a bar that runs out by A shows of it is its square over 2A, and n readings show an amplitude of σ√(2/n).
    let noise = (2.0 * chosen.squares).sqrt() / run.len() as f64;
    let size = chosen.at.border[ECCENTRICITY].hypot(chosen.at.border[ALONG_E]);
    let first = (2.0 * size.max(noise) * noise).sqrt();
    let mut least = zero.0;
    let mut fits = Vec::new();
    // The section may tell more of one side than of the other.
    for side in [first, -first] {
        let (mut inside, mut outside) = (0.0, None);
        for _ in 0..SOUGHT {
            let tried = match outside {
                None if inside == 0.0 => side,
                None => 2.0 * inside,
                Some(outside) => f64::midpoint(inside, outside),
            };
            let beyond = match at(tried) {
                Some((misfit, _)) => {
                    least = misfit.min(least);
                    misfit - least
                }
                None => f64::INFINITY,
            };
            if beyond < OUTERMOST {
                inside = tried;
            } else {
                outside = Some(tried);
                if beyond < 3.0 * OUTERMOST {
                    break;
                }
            }
        }
        let reach = outside.unwrap_or(inside);
        let steps = (1..=VALUES).map(|k| reach * k as f64 / VALUES as f64);
        fits.extend(steps.filter_map(|across| {
            let (misfit, fit) = at(across)?;
            Some((misfit, reach.abs(), fit))
        }));
    }
    let widths: f64 = fits.iter().map(|f| f.1).sum::<f64>() / fits.len().max(1) as f64;
    fits.push((zero.0, widths, zero.1));
    // Each stands for as much of γ across as lies about it.
    fits.into_iter()
        .map(|(misfit, width, fit)| (misfit - 2.0 * width.max(f64::MIN_POSITIVE).ln(), fit))
        .collect()
}
