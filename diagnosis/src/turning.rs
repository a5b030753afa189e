//! The verdict on a run of a turning bar: whether the steady turn (or the recorded one) misses anything,
//! and which rival accounts for it.
//!
//! The rivals are fitted, not linearised: a turn that strays by a whole turn is no small change. Their
//! likelihoods stand under one law of the noise, taken from what is faster than a turn, so that no rival
//! has a noise of its own.

use errsep_models::noise::decays;
use errsep_models::reversal::turning_bar::{Analysis, Rival, Run};

use super::attribution::shrink::Size;
use super::levels::{TURN_APART, TURN_LEFT, normal_quantile};
use super::verdict::types::Kind;

/// Name of the effect of a turn that is not steady.
pub const UNSTEADY_TURN: &str = "unsteady-turn";
/// Name of the effect of an angle that was recorded wrong.
pub const RECORDED_ANGLE: &str = "recorded-angle";
/// Name of the effect of a bar whose axis is no straight line.
pub const BAR_BEND: &str = "bar-bend";

/// A rival beside the steady turn.
#[derive(Debug, Clone, PartialEq)]
pub struct Weight {
    /// Its name.
    pub effect: &'static str,
    /// Part of the gap's square that it takes away.
    pub explained: f64,
    /// Probability that noise makes the misfit fall by as much.
    pub p_value: f64,
    /// Logarithm of the evidence against the steady turn.
    pub evidence: f64,
    /// Whether what it leaves is no more than noise, or next to nothing beside the gap.
    pub adequate: bool,
    /// What it leaves, noise taken out, µm.
    pub left: Size,
    /// Probability of what stands out of it, turn by turn.
    pub adequacy: f64,
    /// What it misses of turns that were held out, µm.
    pub held_out: Option<f64>,
}

/// The verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct Weighed {
    /// Its kind.
    pub kind: Kind,
    /// The effects named.
    pub effects: Vec<&'static str>,
    /// Groups that the readings do not tell apart.
    pub indistinguishable: Vec<Vec<&'static str>>,
    /// Effects that explain a part of an unknown gap.
    pub partial: Vec<&'static str>,
    /// Probability of as much standing out of the steady turn with nothing there.
    pub p_value: f64,
    /// Probability of what remains.
    pub adequacy: f64,
    /// Standard deviation of one reading, µm.
    pub noise: f64,
    /// What the steady turn misses, noise taken out, µm.
    pub before: Size,
    /// What is left, noise taken out, µm.
    pub after: Size,
    /// The rivals, the greatest evidence first.
    pub weights: Vec<Weight>,
    /// Whether the sign of γ across is told by the section.
    pub across_told: bool,
}

impl Weighed {
    /// The rival whose figures are the answer: the effect named, or that explains a part; the steady turn
    /// otherwise.
    pub fn chosen<'a, 'b>(&self, analysis: &'b Analysis<'a>) -> &'b Rival<'a> {
        let named = self.effects.first().or(self.partial.first());
        let rival = match named {
            Some(&BAR_BEND) => analysis.bent.as_ref(),
            Some(_) => analysis.unsteady.as_ref(),
            None => None,
        };
        rival.unwrap_or(&analysis.steady)
    }
}

/// Weighs the rivals of a run; `without` are effects left out of it.
pub fn weigh(run: &Run, analysis: &Analysis, false_alarm: f64, without: &[String]) -> Weighed {
    let noise = analysis.law.variance().sqrt();
    let size = |rival: &Rival| size(run, analysis, rival);
    let before = size(&analysis.steady);
    let turn = if run.angle.is_some() {
        RECORDED_ANGLE
    } else {
        UNSTEADY_TURN
    };
    let rivals = [(turn, &analysis.unsteady), (BAR_BEND, &analysis.bent)];
    let mut weights: Vec<Weight> = rivals
        .into_iter()
        .filter(|(name, _)| !without.iter().any(|w| w == name))
        .filter_map(|(effect, rival)| {
            let rival = rival.as_ref()?;
            let left = size(rival);
            let adequacy = rival.turns.p_value;
            let explained = if before.rms > 0.0 {
                (1.0 - (left.rms / before.rms).powi(2)).max(0.0)
            } else {
                0.0
            };
            Some(Weight {
                effect,
                explained,
                p_value: analysis.p_value(rival),
                evidence: analysis.evidence(rival),
                adequate: adequacy > false_alarm
                    || (left.rms <= noise && left.rms <= TURN_LEFT * before.rms),
                left,
                adequacy,
                held_out: rival.held_out,
            })
        })
        .collect();
    weights.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let stray = match weights.iter().any(|w| w.effect == turn) {
        true => analysis.p_steady(),
        false => 1.0,
    };
    // Two looks at the same residuals: turn by turn, and the stray as a whole.
    let p_value = (2.0 * analysis.steady.turns.p_value.min(stray)).min(1.0);
    let mut weighed = Weighed {
        kind: Kind::None,
        effects: Vec::new(),
        indistinguishable: Vec::new(),
        partial: Vec::new(),
        p_value,
        adequacy: p_value,
        noise,
        before,
        after: before,
        across_told: run.angle.is_some()
            || analysis
                .mirror
                .is_some_and(|m| 0.5 * m / analysis.factor > TURN_APART),
        weights,
    };
    if p_value > false_alarm {
        weighed.before.ci95[0] = 0.0;
        weighed.after = weighed.before;
        return weighed;
    }
    weighed.attribute();
    weighed
}

impl Weighed {
    /// Names the adequate rival of greatest evidence, with those that come near it.
    fn attribute(&mut self) {
        let adequate = |w: &&Weight| w.adequate && w.evidence > TURN_APART;
        if let Some(best) = self.weights.iter().find(adequate) {
            self.kind = Kind::Effect;
            self.effects = vec![best.effect];
            let near = self.weights.iter().filter(adequate);
            let near: Vec<&'static str> = near
                .filter(|w| best.evidence - w.evidence < TURN_APART)
                .map(|w| w.effect)
                .collect();
            if near.len() > 1 {
                self.indistinguishable = vec![near];
            }
            self.adequacy = best.adequacy;
            self.after = best.left;
            return;
        }
        self.kind = Kind::Unknown;
        let part = |w: &&Weight| w.evidence > TURN_APART && w.explained > TURN_LEFT;
        if let Some(best) = self.weights.iter().find(part) {
            self.partial = vec![best.effect];
            self.adequacy = best.adequacy;
            self.after = best.left;
        }
    }
}

/// What a rival misses, noise taken out, with the interval that the noise leaves to a mean square.
fn size(run: &Run, analysis: &Analysis, rival: &Rival) -> Size {
    let law = &analysis.law;
    let n = rival.fit.residuals.len() as f64;
    let mean = rival.fit.squares / rival.fit.freedom().max(1.0);
    let along = |length: f64| decays(&run.time, length);
    let squares = law.squares(&along(law.length), &along(0.5 * law.length));
    let doubt = normal_quantile(0.975) * (2.0 * squares).sqrt() / n;
    let beyond = mean - law.variance();
    Size {
        rms: beyond.max(0.0).sqrt(),
        ci95: [
            (beyond - doubt).max(0.0).sqrt(),
            (beyond + doubt).max(0.0).sqrt(),
        ],
    }
}
