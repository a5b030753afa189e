//! Every threshold that decides what a diagnosis says, in one table.
//!
//! Kinds: a *quantile* follows from a probability; a *tuned* one was chosen on cases that were looked
//! at, development seeds of `campaigns/blind` and `campaigns/independent_maker`
//! (`docs/validation/diagnosis.md` and `independent.md` say which figures are of seeds that no version had
//! seen, and of which version); a *limit* keeps work finite and costs power where it binds; a *reckoned*
//! one follows from a model's own arithmetic.
//! How many draws stand behind a figure is told where they are drawn.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

/// Quantile of the normal law.
pub(crate) fn normal_quantile(probability: f64) -> f64 {
    Normal::standard().inverse_cdf(probability)
}

/// Quantile of chi-squared with two degrees of freedom: −2 ln (1 − p).
pub(crate) fn chi_squared_of_two(probability: f64) -> f64 {
    -2.0 * (1.0 - probability).ln()
}

/// Quantile of chi-squared.
pub(crate) fn chi_squared_quantile(probability: f64, freedom: usize) -> f64 {
    ChiSquared::new(freedom as f64).map_or(f64::INFINITY, |law| law.inverse_cdf(probability))
}

// Noise.

/// *Reckoned.* Contrasts of repeats from which noise can be estimated: with eight a variance is known to
/// half of itself.
pub(crate) const FEWEST_CONTRASTS: usize = 8;
/// *Quantile*, 6 · 10⁻⁵ of normal readings: standard deviations to which a single reading is pulled in.
pub(crate) const SPIKE: f64 = 4.0;
/// *Tuned*, between normal noise (0.003) and Student's with three degrees of freedom (0.042): part of the
/// readings beyond three standard deviations, as their median tells it, that makes tails heavy.
pub(crate) const HEAVY_TAILS: f64 = 0.01;
/// *Quantile.* Tails are heavy only where normal noise has as many readings beyond three standard deviations with less than this
/// probability: [`HEAVY_TAILS`] of few readings are one or two, which chance makes.
pub(crate) const HEAVY_BY_CHANCE: f64 = 0.025;
/// *Reckoned.* Repeats without which a spike cannot be told from a form.
pub(crate) const SPIKE_REPEATS: usize = 3;
/// *Reckoned.* Readings of a trace without which a spike has no neighbours to stand out of.
pub(crate) const SPIKE_TRACE: usize = 5;
/// *Tuned.* Part of its height that a spike keeps over its neighbours of either side alone, and that a
/// step keeps in what follows it.
pub(crate) const KEPT: f64 = 0.6;
/// *Quantile*, 6 · 10⁻⁷ of normal readings: standard deviations of the difference of two neighbours
/// that make a step.
pub(crate) const STEP: f64 = 5.0;
/// *Quantile*, 2 · 10⁻⁹ of normal readings: standard deviations of the difference of two medians of eight readings that
/// make a step.
pub(crate) const LASTING_STEP: f64 = 6.0;
/// *Tuned*, the first value that was tried: height of a step by all readings of its channel over that by the medians
/// beside it, at least, and one over that, at most, as a shift between traces is no part of a step.
pub(crate) const AS_BESIDE: f64 = 0.7;
/// *Quantile*, set before the seeds on the pages: logarithm of how much likelier all laws together must make the repeats
/// without a jump than with it. The greatest of 1090 measurements with nothing there (seeds 17 and 38) is 8.2, one in a
/// hundred is above 5.5.
pub(crate) const LIKELIER: f64 = 12.0;
/// *Quantile*, twenty to one: logarithm of how much likelier the repeats must be without jumps than without the causes
/// that are named, for no name to be strong.
pub(crate) const LIKELIER_BY_JUMPS: f64 = 3.0;
/// *Tuned.* Logarithm of how much likelier the repeats must be where whole traces may drift than where none does, for
/// drifts to be noise. Beside the causes of 244 measurements without drifts it is 0.2 at most (seeds 92 to 95 of the
/// independent maker), 12.3 where a slow cause is withheld (one of 60); drifts of six standard deviations of a reading make
/// 27 to 70.
pub(crate) const LIKELIER_BY_DRIFTS: f64 = 12.0;
/// *Quantile*, twenty to one: logarithm of how much likelier residuals must be, where there are no repeats, under noise that
/// may be correlated along its trace than under white noise, for it to be, and causes beside white noise than such noise, for
/// them to be named.
pub(crate) const LIKELIER_BY_CORRELATION: f64 = 3.0;
/// *Limit.* Standard deviation of the part of noise that is correlated over that of the white part of a reading, where there
/// are no repeats: what is more is no noise.
pub(crate) const MOST_CORRELATED: f64 = 2.0;
/// *Limit.* Jumps of so little height that are taken out of all readings; of more none is.
pub(crate) const MOST_JUMPS: usize = 3;
/// *Limit.* Steps that are taken out of one group of repeats.
pub(crate) const MOST_STEPS: usize = 8;
/// *Quantile.* Student's t of a step between traces that is no chance, and the fewest degrees of freedom
/// that can tell: with five, 2 · 7 · 10⁻⁴ for all seven places of one channel. (A steady drift of eight
/// traces gives t = 4.)
pub(crate) const STAYS: f64 = 12.0;
/// See [`STAYS`].
pub(crate) const STAYS_FREEDOM: usize = 5;

/// *Quantile.* What differs from repeat to repeat is said not to be independent noise where such noise would show as
/// much less often than this, a correlation of two channels or a period.
pub(crate) const DEPENDENT: f64 = 0.001;

// Detection.

/// *Limit.* A signature of which less than this part is visible is not looked for.
pub(crate) const INVISIBLE: f64 = 1e-4;

// Attribution.

/// *Tuned.* Probability at which a cause must stand out beside the others, and an effect to be tried.
pub(crate) const EARNED: f64 = 0.002;
/// *Tuned*: three causes imitate freely what none of them is. A set of one, two, three or more causes whose
/// remainder is less probable than this is not adequate.
pub(crate) const ADEQUATE: [f64; 3] = [0.001, 0.001, 0.01];
/// *Limit.* Standard deviations of chi-squared beyond which no doubt about the state excuses a remainder.
pub(crate) const FAR: f64 = 6.0;
/// *Limit.* Part of the misfit that causes may leave where what they leave is clearly more than the noise, whatever of it the
/// doubt about the state excuses: less than half is not what they explain.
pub(crate) const LEAVES: f64 = 0.5;
/// *Limit.* Part of the probability of what is adequate: where few draws of the state leave less than it, many do not
/// leave enough. Of 198 remainders that were looked at none came to another end by it.
pub(crate) const PAST_DOUBT: f64 = 1e-2;
/// *Reckoned.* Beside other causes a signature must keep this part of its visible length, squared, to be
/// told apart.
pub(crate) const SEPARABLE: f64 = 0.02;
/// *Tuned.* Part of a plausible range by which an uncertain size may lie outside it.
pub(crate) const SLACK: f64 = 0.1;
/// *Limit.* A cause whose statistic is below the best by this and by [`HOPELESS_PART`] of it cannot
/// become adequate, and is not refitted.
pub(crate) const HOPELESS: f64 = 80.0;
/// See [`HOPELESS`].
pub(crate) const HOPELESS_PART: f64 = 0.1;
/// *Limit.* The same part where no cause is adequate: an effect that bends the state may explain half of what
/// another seems to, until the state is fitted without it.
pub(crate) const BENT: f64 = 0.5;
/// *Limit.* So many causes are tried again by [`BENT`].
pub(crate) const MOST_BENT: usize = 2;
/// *Quantile*: odds at which one explanation outweighs another. Of two that are d standard deviations apart the
/// right one is outweighed with the probability Φ(−d/2 − ln(odds)/d), at most 0.12 %.
pub(crate) const ODDS: f64 = 100.0;
/// *Tuned* on withheld effects: part of the strongest cause's change, squared, that a further one must
/// reach. What is less may be the remainder of a cause taken for another whose signature is off by a
/// fifth of its size.
pub(crate) const WEIGHTY: f64 = 0.04;
/// *Limit.* A relative of a cause that explains less than this part of what it does cannot stand for it.
pub(crate) const NEAR: f64 = 0.7;
/// *Tuned.* A size counts from this many of its standard uncertainties on: that of the only cause, and
/// those of several, which may imitate what another leaves.
pub(crate) const STANDS: [f64; 2] = [1.0, 2.0];
/// *Tuned*, odds of 1 to 22 000. An effect with more unknowns than that of greatest evidence stands in its
/// place by its freedom alone where its log-evidence is less by this, and it was given more amplitudes than its
/// usual form has or explains no more than chance by them.
pub(crate) const OUTDONE: f64 = 10.0;
/// *Limit.* A signature of which less than this part, squared, is left beside another is held by it: what is
/// left of them at states that differ by their noise.
pub(crate) const HELD: f64 = 1e-3;
/// *Reckoned.* Log-evidence that differs by less is equal: of exact aliases the one of more usual size
/// goes first.
pub(crate) const EQUAL_EVIDENCE: f64 = 1e-3;
/// *Limit.* A swap of causes must raise the statistic by more than what searches leave open.
pub(crate) const BETTER: f64 = 0.01;
/// *Limit.* Pairs that are fitted with everything else free, and how far above the best misfit a coarse
/// fit may be to become it by refining.
pub(crate) const PAIRS: usize = 3;
/// See [`PAIRS`].
pub(crate) const PAIR_REACH: f64 = 1.3;
/// *Limit.* Effects in one verdict.
pub(crate) const MOST_CAUSES: usize = 6;
/// *Limit.* As many are sought before all pairs are tried.
pub(crate) const FREELY: usize = 3;
/// *Tuned.* Where more than this part of what was left beyond the noise is left by a further cause, no more are
/// sought: of six equal causes the first takes a sixth away, what imitates a cause a tenth at most.
pub(crate) const STALLED: f64 = 0.85;
/// *Limit.* Effects of greatest score that are refined to find the strongest, and rounds of refining each
/// cause beside the others.
pub(crate) const REFINED: usize = 5;
/// See [`REFINED`].
pub(crate) const POLISHED: usize = 3;
/// *Limit.* Part of a statistic that searching may add to that of a relative where it stands.
pub(crate) const UNSEARCHED: f64 = 0.2;
/// *Limit.* Causes that were judged are not judged again where the squares that they leave are not less by more
/// than this: a standard deviation.
pub(crate) const NO_BETTER: f64 = 1.0;
/// *Limit.* Relatives of one variant that are searched: the best of those that are tried.
pub(crate) const ALIKE: usize = 4;
/// *Limit.* Part of the greatest statistic from which on values that come back are tried around their cycles.
pub(crate) const IN_REACH: f64 = 0.5;

// Verdict.

/// *Tuned.* Part of the predicted shrinking that a named cause must reach.
pub(crate) const PROMISE: f64 = 0.5;
/// *Quantile.* Places are reported up to this probability.
pub(crate) const PLACE: f64 = 0.05;
/// *Tuned.* A range over more than this part of all that was tried says nothing of where.
pub(crate) const EVERYWHERE: f64 = 0.8;
/// *Quantile.* A channel holds the gap when it stands out at this level, and is free of it beyond
/// [`ABSENT`].
pub(crate) const PRESENT: f64 = 0.01;
/// See [`PRESENT`].
pub(crate) const ABSENT: f64 = 0.1;
/// *Tuned.* Part by which two figures of the noise may differ beyond three standard deviations of their
/// ratio before it is told.
pub(crate) const NOISE_DIFFERS: f64 = 0.15;
/// *Tuned.* Share of a gap from which on it is said to turn with the direction, or to come back in every
/// repeat; below the rest it is said not to.
pub(crate) const MOSTLY: f64 = 0.8;

// Severity.

/// *Quantile.* A name is strong where the lower limit of its severity, with the probability of
/// [`SURE`], reaches this.
pub(crate) const STRONG: f64 = 0.95;
/// See [`STRONG`].
pub(crate) const SURE: f64 = 0.95;
/// *Quantile.* A name is strong where what the causes leave would stand out as much in more than this part of noise
/// alone. ([`ADEQUATE`] asks what may be excused, this what nothing need be said about.)
pub(crate) const SUSPECT: f64 = 0.05;
/// *Reckoned.* What is smooth, and nearer to an effect than this cosine, is that effect to whoever acts on
/// the name.
pub(crate) const SAME: f64 = 0.9;

// Planning.

/// *Quantile.* Power at which an effect of the smallest size is seen.
pub(crate) const POWER: f64 = 0.8;
/// *Reckoned.* An effect that makes the variance which repeats tell of white noise greater by this part, its standard
/// deviation by a tenth, is said to be taken for noise.
pub(crate) const SWELLS: f64 = 0.2;
/// *Reckoned.* Where noise may be correlated, an effect that adds this to the sum of squares of the differences between
/// repeats, in units of the noise, is said to be: as much as noise of one degree of freedom.
pub(crate) const PASSES_FOR_NOISE: f64 = 1.0;
/// *Quantile.* Probability at which two effects are told apart.
pub(crate) const TELL: f64 = 0.99;
/// *Reckoned.* A plan promises nothing of an effect, and none is put in for a proof, of which less than
/// this part is visible: the model of the plan is not that exact.
pub(crate) const PLANNED: f64 = 0.01;

/// *Quantile.* An effect that is given and stands out less than this is told not to: its size may be zero.
pub(crate) const WEAK: f64 = 0.05;

// A bar that turns.

/// *Tuned.* What an effect leaves may exceed the noise law by no more than the noise itself and by no more
/// than this part of the gap before, or it is not adequate.
pub(crate) const TURN_LEFT: f64 = 0.2;
/// *Quantile.* Evidence (natural logarithm) by which two explanations, or the two signs of γ across, must
/// differ to be told apart: odds of 150 to 1.
pub(crate) const TURN_APART: f64 = 5.0;

// Learning.

/// *Quantile*, 1 % of normal noise over the seven ways to bind a gap: standard deviations by which a learnt
/// curve must make the held-out residual smaller.
pub(crate) const CONFIRMED: f64 = 3.0;
/// *Quantile*, one standard error: a way to bind a gap by fewer curves is no worse than the best.
pub(crate) const NO_WORSE: f64 = 1.0;

// Laws.

/// *Quantile*: the evidence for a law over that for smooth curves, which a gap of these exceeds in less than one
/// of as many (Markov's inequality), whatever the law.
pub(crate) const LAW_ODDS: f64 = 100.0;
/// *Quantile.* ln of the evidence for a smooth curve in what a law leaves from which on it is there: with one curve
/// of one mode χ² beyond 16, with the fifty of different lengths 0.3 % of normal noise.
pub(crate) const LAW_LEFT: f64 = 8.0;
