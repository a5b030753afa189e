//! One attempt to find a law: chosen on one part of the repeats, accepted on the other.

use std::sync::OnceLock;

use errsep_models::model::{AnyModel, Shape};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::attribution::context::{Cause, Context};
use crate::detection::calm::spikes_of_draws;
use crate::detection::null::{BATCH, Tail};
use crate::levels::{ADEQUATE, CONFIRMED, LAW_LEFT, LAW_ODDS};
use crate::noise::dependence::Dependence;
use crate::noise::law::{NoiseLaw, draw_scatter};
use crate::options::Options;
use crate::symbolic::evidence::evidence;
use crate::symbolic::grammar::{Grammar, Term};
use crate::symbolic::lens::Lens;
use crate::symbolic::search::Search;
use crate::symbolic::smooth::Smooths;
use crate::symbolic::view::{Fitted, View, halves};

/// Draws of the noise behind the law of the greatest statistic.
const DRAWS: usize = 320;
/// *Limit.* Laws that predict equally well and are fitted to all repeats, the simplest first.
const JUDGED: usize = 6;

/// Part of what stands out, in squares, that one term along the reading must explain to be taken out before others.
const MOSTLY: f64 = 0.8;

/// Why no law is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Refusal {
    /// Nothing of the grammar shows.
    Nothing,
    /// Held-out repeats do not confirm the best.
    NotConfirmed,
    /// A smooth curve that is no law explains the gap as well.
    Smooth,
    /// Something is left beside it.
    Left,
    /// What differs between repeats beside it is no noise.
    NoNoise,
    /// Noise alone would show as much too often.
    Chance,
}

/// A law that is told.
pub(super) struct Accepted {
    /// On all repeats.
    pub fitted: Fitted,
    /// Others that predict the held-out repeats equally well, fitted to all.
    pub rivals: Vec<(Fitted, f64)>,
    /// Part of the held-out gap, squared, that it predicts.
    pub explained: f64,
    /// Standard deviations by which held-out repeats confirm it.
    pub confirmed: f64,
    /// ln of the evidence for it over that for smooth curves.
    pub odds: f64,
    /// Probability of what remains.
    pub adequacy: f64,
    /// Probability of as much with nothing there, over all that was tried.
    pub p_value: f64,
}

/// Everything that is fixed while laws are sought.
pub(super) struct Bench<'a> {
    pub model: &'a AnyModel,
    pub law: NoiseLaw,
    pub grammar: Grammar,
    pub whole: View,
    /// Either half of the repeats chosen on, the other held out: a jump that is in one of them cannot be found
    /// in the other.
    ways: [Way; 2],
    smooths: Smooths,
    options: &'a Options,
    context: OnceLock<Context<'a>>,
}

/// Repeats that a law is chosen on, and those that it is accepted on.
struct Way {
    chosen: View,
    held: View,
    lens: Lens,
    null: OnceLock<Tail>,
}

/// A law on the repeats that it was not chosen on.
struct Tried {
    fitted: Fitted,
    predicted: DVector<f64>,
    missed: f64,
}

impl<'a> Bench<'a> {
    /// Nothing where there are no repeats to hold out, or no coordinate.
    pub fn new(model: &'a AnyModel, law: NoiseLaw, options: &'a Options) -> Option<Self> {
        let grammar = Grammar::new(model)?;
        let ways = halves(model, &law)?.map(|[chosen, held]| Way {
            lens: Lens::new(&grammar, &chosen),
            chosen,
            held,
            null: OnceLock::new(),
        });
        let whole = View::whole(model, &law);
        Some(Self {
            smooths: Smooths::new(&grammar, &whole),
            grammar,
            whole,
            ways,
            model,
            law,
            options,
            context: OnceLock::new(),
        })
    }

    fn search<'s>(&'s self, way: &'s Way) -> Search<'s> {
        Search {
            grammar: &self.grammar,
            lens: &way.lens,
            view: &way.chosen,
        }
    }

    /// Number of different forms of one term.
    pub fn forms(&self) -> usize {
        self.ways[0].lens.forms()
    }

    fn context(&self) -> &Context<'a> {
        self.context.get_or_init(|| {
            let (law, options) = (self.law.clone(), self.options);
            Context::new(self.model, &[], law, options.draws, options.seed)
        })
    }

    /// Noise of all readings.
    pub fn noise(&self, draw: usize, random: &mut ChaCha8Rng) -> DVector<f64> {
        let spikes = spikes_of_draws(self.model, &self.law);
        self.law
            .draw_possible(self.model, spikes.as_ref(), draw, random)
            + draw_scatter(self.model, random)
    }

    /// The law of the greatest surprise over the grammar with nothing there.
    fn null<'s>(&'s self, way: &'s Way) -> &'s Tail {
        way.null.get_or_init(|| {
            let draws = DRAWS.min(self.options.draws.max(1));
            let batch = |batch: usize| {
                let mut random = ChaCha8Rng::seed_from_u64(self.options.seed ^ 0x006c_6177);
                random.set_stream(batch as u64 + 1);
                let count = BATCH.min(draws - batch * BATCH);
                let columns: Vec<DVector<f64>> = (0..count)
                    .map(|k| {
                        let noise = self.noise(batch * BATCH + k, &mut random);
                        way.chosen.residual(&noise)
                    })
                    .collect();
                self.search(way).surprises(DMatrix::from_columns(&columns))
            };
            let all: Vec<Vec<f64>> = (0..draws.div_ceil(BATCH))
                .into_par_iter()
                .map(batch)
                .collect();
            Tail::new(all.concat())
        })
    }

    /// Square of what stands out of the noise, in units of it.
    pub fn visible(&self, readings: &DVector<f64>) -> f64 {
        let square = self.whole.residual(readings).norm_squared();
        square - self.whole.space.degrees_of_freedom() as f64
    }

    /// The best law on all readings, whether it may be told or not: of either way the one that predicts best.
    pub fn best(&self, readings: &DVector<f64>) -> Option<Fitted> {
        let residual = self.whole.residual(readings);
        let of = |way: &Way| {
            let tried = self.tried(way, readings);
            let best = tried
                .into_iter()
                .min_by(|a, b| a.missed.total_cmp(&b.missed))?;
            self.whole
                .refined(&self.grammar, &best.fitted.terms, &residual)
        };
        let both = self.ways.iter().filter_map(of);
        both.max_by(|a, b| a.explained.total_cmp(&b.explained))
    }

    /// The best law of one term along the reading, where it explains most of what stands out. Changed by the law
    /// itself, the readings give it away to laws of two terms until it is taken out of them.
    pub fn along_reading(&self, readings: &DVector<f64>) -> Option<Fitted> {
        let residual = self.whole.residual(readings);
        let least = MOSTLY * self.visible(readings);
        let of = |way: &Way| {
            let mut singles = self.search(way).singles(&way.chosen.residual(readings));
            singles.retain(|f| self.grammar.is_along_reading(&f.terms));
            singles.retain(|f| self.grammar.is_possible(f));
            let best = singles
                .into_iter()
                .max_by(|a, b| a.explained.total_cmp(&b.explained))?;
            self.whole.refined(&self.grammar, &best.terms, &residual)
        };
        let both = self.ways.iter().filter_map(of);
        let best = both.max_by(|a, b| a.explained.total_cmp(&b.explained));
        best.filter(|best| best.explained >= least)
    }

    fn tried(&self, way: &Way, readings: &DVector<f64>) -> Vec<Tried> {
        let held = way.held.residual(readings);
        let mut found = self.search(way).candidates(&way.chosen.residual(readings));
        found.retain(|f| self.grammar.is_possible(f));
        let predicted = |fitted: Fitted| {
            let columns = self.grammar.columns(&fitted.terms, &way.held.rows);
            let change = columns * &fitted.amplitudes;
            let predicted = way.held.space.forward_vector(&change);
            Tried {
                missed: (&held - &predicted).norm_squared(),
                predicted,
                fitted,
            }
        };
        found.into_iter().map(predicted).collect()
    }

    /// A law that these readings follow.
    ///
    /// The residual e of the held-out repeats has unit noise, so of two predictions a and b that are equally far
    /// from the truth |e − a|² − |e − b|² has the standard deviation 2 |a − b|.
    pub fn attempt(&self, readings: &DVector<f64>) -> Result<Accepted, Refusal> {
        let residual = self.whole.residual(readings);
        let smooth = OnceLock::new();
        let smooth = || *smooth.get_or_init(|| self.smooths.evidence(&residual));
        let first = self.attempt_by(&self.ways[0], readings, &residual, &smooth);
        if first.is_ok() {
            return first;
        }
        self.attempt_by(&self.ways[1], readings, &residual, &smooth)
    }

    fn attempt_by(
        &self,
        way: &Way,
        readings: &DVector<f64>,
        residual: &DVector<f64>,
        smooth: &dyn Fn() -> f64,
    ) -> Result<Accepted, Refusal> {
        let tried = self.tried(way, readings);
        let before = way.held.residual(readings).norm_squared();
        let best = tried.iter().min_by(|a, b| a.missed.total_cmp(&b.missed));
        let best = best.ok_or(Refusal::Nothing)?;
        let worse = |t: &Tried| {
            let reach = 2.0 * (&t.predicted - &best.predicted).norm();
            (t.missed - best.missed) / reach.max(f64::MIN_POSITIVE)
        };
        let mut equal: Vec<&Tried> = tried
            .iter()
            .filter(|t| std::ptr::eq(*t, best) || worse(t) <= CONFIRMED)
            .collect();
        equal.sort_by_key(|t| self.grammar.complexity(&t.fitted.terms));
        let freedom = way.held.space.degrees_of_freedom() as f64;
        let mut why = Refusal::NotConfirmed;
        for law in equal.iter().take(JUDGED) {
            let confirmed = (before - law.missed) / (2.0 * law.predicted.norm());
            if !(confirmed > CONFIRMED) {
                continue;
            }
            match self.judged(way, law, (readings, residual, smooth())) {
                Ok(mut accepted) => {
                    accepted.confirmed = confirmed;
                    let gap = (before - freedom).max(f64::MIN_POSITIVE);
                    accepted.explained = ((before - law.missed) / gap).clamp(0.0, 1.0);
                    let others = equal.iter().filter(|t| !std::ptr::eq(**t, *law));
                    accepted.rivals = others
                        .filter_map(|t| {
                            let terms = &t.fitted.terms;
                            let on_all = self.whole.refined(&self.grammar, terms, residual)?;
                            Some((on_all, worse(t)))
                        })
                        .collect();
                    return Ok(accepted);
                }
                Err(refusal) => why = refusal,
            }
        }
        Err(why)
    }

    /// Whether a law stands beside smooth curves and noise, and leaves nothing.
    fn judged(
        &self,
        way: &Way,
        law: &Tried,
        (readings, residual, smooth): (&DVector<f64>, &DVector<f64>, f64),
    ) -> Result<Accepted, Refusal> {
        let terms = &law.fitted.terms;
        let fitted = self.whole.refined(&self.grammar, terms, residual);
        let fitted = fitted.ok_or(Refusal::Nothing)?;
        let prior = self.ways[0].lens.prior(&self.grammar, &fitted.terms);
        let own = evidence(&self.grammar, &self.whole, &fitted, prior);
        let odds = own.ok_or(Refusal::Nothing)? - smooth;
        if odds < LAW_ODDS.ln() {
            return Err(Refusal::Smooth);
        }
        let change = self.grammar.columns(&fitted.terms, &self.whole.rows) * &fitted.amplitudes;
        let left = readings - &change;
        if self.smooths.greatest(&self.whole.residual(&left)) > LAW_LEFT {
            return Err(Refusal::Left);
        }
        let chosen = way.chosen.residual(readings);
        let surprises = self.search(way).surprises(DMatrix::from_columns(&[chosen]));
        // Either half may show it.
        let alone = self
            .null(way)
            .beyond(surprises.first().copied().unwrap_or(0.0));
        let p_value = (self.ways.len() as f64 * alone).min(1.0);
        if p_value > self.options.false_alarm {
            return Err(Refusal::Chance);
        }
        let context = self.context();
        let cause = Cause {
            effect: 0,
            shape: Shape::only(),
            columns: Vec::new(),
            projected: self.tangents(&fitted),
            choices: 0,
        };
        let causes = [cause];
        let remainder = context.remainder(&left, &causes);
        let adequacy = context.detection(&remainder);
        if adequacy <= ADEQUATE[0] || !context.adequate(&causes, &remainder) {
            return Err(Refusal::Left);
        }
        let show_whole = || context.repeats_show_whole();
        if Dependence::of(self.model, &context.law, &left, show_whole).is_no_noise() {
            return Err(Refusal::NoNoise);
        }
        Ok(Accepted {
            fitted,
            rivals: Vec::new(),
            explained: 0.0,
            confirmed: 0.0,
            odds,
            adequacy,
            p_value,
        })
    }

    /// What is seen of a law's parameters, amplitudes first, then shapes but a step's.
    pub fn tangents(&self, fitted: &Fitted) -> DMatrix<f64> {
        tangents(&self.grammar, &self.whole, fitted)
    }

    /// A term's form in the lens, for drawing one.
    pub fn patterns_of(&self, kind: usize) -> &[usize] {
        &self.ways[0].lens.patterns[kind]
    }

    /// The change of all readings by a law.
    pub fn change(&self, terms: &[Term], amplitudes: &DVector<f64>) -> DVector<f64> {
        self.grammar.columns(terms, &self.whole.rows) * amplitudes
    }
}

/// What a view sees of a law's parameters, amplitudes first, then shapes but a step's.
pub(super) fn tangents(grammar: &Grammar, view: &View, fitted: &Fitted) -> DMatrix<f64> {
    let columns = grammar.columns(&fitted.terms, &view.rows);
    let slopes = grammar.slopes(&fitted.terms, &fitted.amplitudes, &view.rows);
    let amplitudes = columns.ncols();
    let mut all = columns.insert_columns(amplitudes, slopes.ncols(), 0.0);
    all.columns_mut(amplitudes, slopes.ncols())
        .copy_from(&slopes);
    view.space.forward(all).0
}
