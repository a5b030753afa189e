//! What is told of a run, worked out once for text, JSON and page.

use std::fmt::Write;

use errsep_models::reversal::turning_bar::{
    Analysis, Bar, Harmonic, Pairs, Possible, Rival, Run, Slow, Spread, Survey, Told as Value,
    TurnCurve,
};
use errsep_models::uncertainty::{DegreesOfFreedom, coverage_factor};

use crate::diagnosis::Kind;
use crate::diagnosis::turning::{BAR_BEND, RECORDED_ANGLE, Weighed};
use crate::number::{fixed, measured, percent, plain, probability};

/// Places along the bar and times of the curves.
const POINTS: usize = 201;
/// Seconds in a minute.
const MINUTE: f64 = 60.0;
/// µrad in a rad.
const URAD: f64 = 1e6;

/// Everything that is told.
pub(super) struct Told<'a, 'b> {
    pub run: &'a Run,
    pub survey: &'a Survey,
    pub analysis: &'b Analysis<'a>,
    pub weighed: &'b Weighed,
    /// The rival whose figures are the answer.
    pub chosen: &'b Rival<'a>,
    /// α + τ without and with what was named, rad.
    pub slope: (Value, Value),
    /// What the slope is, by the direction of the indicator.
    pub combination: String,
    /// Turns in a unit of time; `None` where the axis of the bar may be any.
    pub speed: Option<Value>,
    pub bar: Option<Bar>,
    pub curve: Option<TurnCurve>,
    pub harmonics: Vec<Harmonic>,
    pub pairs: Option<Pairs>,
    pub places: Vec<f64>,
    /// µm.
    pub axis: Vec<(f64, f64)>,
    /// µm.
    pub form: Vec<Value>,
}

impl<'a, 'b> Told<'a, 'b> {
    pub(super) fn new(
        run: &'a Run,
        survey: &'a Survey,
        analysis: &'b Analysis<'a>,
        weighed: &'b Weighed,
    ) -> Self {
        let chosen = weighed.chosen(analysis);
        let (spread, plain_spread) = (chosen.spread(analysis), analysis.steady.spread(analysis));
        let (low, high) = run.range();
        let step = (high - low) / (POINTS - 1) as f64;
        let places: Vec<f64> = (0..POINTS).map(|k| low + step * k as f64).collect();
        let possible = Possible::of(run, survey, analysis, chosen, weighed.across_told);
        let bar = possible.bar();
        Self {
            slope: (analysis.steady.fit.slope(&plain_spread), possible.slope()),
            combination: combination(chosen.fit.setting().indicator_rad),
            speed: possible.speed(survey.base_hz),
            curve: possible.curve(POINTS, survey.base_hz),
            harmonics: possible.harmonics(),
            pairs: chosen.fit.pairs(&spread),
            axis: match bar {
                Some(_) => chosen.fit.axis(&places),
                None => Vec::new(),
            },
            form: possible.form(&places),
            bar,
            places,
            run,
            survey,
            analysis,
            weighed,
            chosen,
        }
    }

    /// The side of the bar that each reading sees, degrees.
    pub(super) fn sides(&self) -> Vec<f64> {
        let psi = self.chosen.fit.psi.iter();
        psi.map(|p| p.to_degrees().rem_euclid(360.0)).collect()
    }

    /// Speeds for people: turns a minute; of a run without times, turns a reading.
    pub(super) fn per_minute(&self, speed: &[f64]) -> Vec<f64> {
        let factor = if self.run.timed { MINUTE } else { 1.0 };
        speed.iter().map(|v| factor * v).collect()
    }

    pub(super) fn speed_unit(&self) -> &'static str {
        if self.run.timed {
            "turns/min"
        } else {
            "turns/reading"
        }
    }

    pub(super) fn clock(&self) -> (&'static str, &'static str) {
        if self.run.timed {
            ("time", "s")
        } else {
            ("number of the reading", "")
        }
    }

    /// Standard uncertainty of α + τ where the readings were independent, rad.
    pub(super) fn slope_std_white(&self) -> f64 {
        let variance = self.chosen.fit.squares / self.chosen.fit.freedom();
        let law = errsep_models::noise::Law::of_white(variance);
        let spread = Spread::new(&self.chosen.fit, &law, Slow::default());
        self.chosen.fit.slope(&spread).std
    }

    /// Degrees of freedom to which the law of the noise is known, and with it every standard uncertainty.
    pub(super) fn degrees_of_freedom(&self) -> f64 {
        self.chosen.turns.freedom
    }

    /// Half a 95 % interval in standard uncertainties.
    pub(super) fn half_interval(&self) -> f64 {
        DegreesOfFreedom::new(self.degrees_of_freedom().max(1.0))
            .and_then(|freedom| coverage_factor(0.95, freedom))
            .unwrap_or(f64::INFINITY)
    }

    /// The sentence a person acts on.
    pub(super) fn statement(&self) -> String {
        let weighed = self.weighed;
        let rms = |rival: &Rival| plain(rival.fit.rms(), 3);
        let (before, after) = (rms(&self.analysis.steady), rms(self.chosen));
        let slope = measured(URAD * self.slope.1.value, Some(URAD * self.slope.1.std));
        let answer = format!("{} is {slope} µrad.", self.combination);
        let turned = if self.run.angle.is_some() {
            "the recorded angle of the spindle"
        } else {
            "a steady turn"
        };
        match weighed.kind {
            Kind::None => format!(
                "A straight bar and {turned} account for the readings, to {before} µm RMS; no gap is detected. {answer}"
            ),
            Kind::Effect => {
                let group = weighed.indistinguishable.first();
                let cause = match group {
                    Some(group) => format!(
                        "One of {} is the cause, and these readings cannot tell which",
                        group.join(", ")
                    ),
                    None => self.cause(),
                };
                format!("{cause}: with it {after} µm RMS are left of {before} µm. {answer}")
            }
            Kind::Unknown => {
                let part = match weighed.partial.first() {
                    Some(effect) => format!(
                        " `{effect}` explains a part: {after} µm RMS are left of {before} µm."
                    ),
                    None => format!(" {before} µm RMS are left."),
                };
                format!(
                    "Neither a turn that is not steady nor a bend of the bar accounts for what a straight bar and {turned} miss: the cause is unknown.{part} {answer}"
                )
            }
        }
    }

    fn cause(&self) -> String {
        match self.weighed.effects.first() {
            Some(&BAR_BEND) => "The axis of the bar is no straight line (`bar-bend`)".to_owned(),
            Some(&RECORDED_ANGLE) => format!(
                "The recorded angle does not follow the bar (`recorded-angle`): {}",
                self.greatest()
            ),
            _ => format!(
                "The spindle did not turn steadily (`unsteady-turn`): {}",
                self.greatest()
            ),
        }
    }

    /// Place and size of the greatest lag, in words.
    fn greatest(&self) -> String {
        let Some(curve) = &self.curve else {
            return String::new();
        };
        let k = curve.greatest;
        let degrees = measured(
            curve.lag_rad[k].abs().to_degrees(),
            Some(curve.lag_std[k].to_degrees()),
        );
        let way = if curve.lag_rad[k] > 0.0 {
            "behind"
        } else {
            "ahead of"
        };
        let when = if self.run.timed {
            format!("{} s", fixed(curve.time[k], 0))
        } else {
            format!("reading {}", curve.time[k].round())
        };
        let (slow, fast) = curve
            .speed
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(s, f), v| (s.min(*v), f.max(*v)));
        let speeds = self.per_minute(&[slow, fast]);
        format!(
            "it was {degrees}° {way} a steady turn at {when} (x = {} mm), and its speed ran from {} to {} {}",
            fixed(curve.x[k], 1),
            plain(speeds[0], 4),
            plain(speeds[1], 4),
            self.speed_unit()
        )
    }

    /// What one indicator cannot tell apart.
    pub(super) fn not_told(&self) -> Vec<String> {
        let mut all = vec![
            format!(
                "{}: the slide against the spindle axis and half the cone of the bar come as one. A bar of known taper, or a second indicator on the far side, tells them apart.",
                self.combination
            ),
            "The form along x is that of the slide and the mean form of the bar together (a_0 and M).".to_owned(),
            format!(
                "What drifts during the run (the zero of the indicator, temperatures) is in the form and in {}, and in no uncertainty: one run passes each place once. The same run backwards tells.",
                self.combination
            ),
        ];
        let Some(bar) = &self.bar else {
            if self.run.angle.is_none() {
                all.push("No angle was recorded: the direction of the bar's axis and the speed of the spindle are one, so that neither is known. A mark on the spindle, or an encoder, would settle them.".to_owned());
            }
            return all;
        };
        if self.run.angle.is_none() {
            let turned = plain(bar.turned_rad.value.abs().to_degrees(), 2);
            all.push(format!(
                "No angle was recorded: the direction of e + γx (which turns by {turned}° along the travel) and the speed of the spindle are one. What counts is the length of e + γx; a mark on the spindle, or an encoder, would settle the direction."
            ));
            all.push(if self.chosen.fit.across_held {
                let half = self.half_interval() * bar.across_rad.std;
                let [low, high] = [-half, half].map(|h| plain(URAD * (bar.across_rad.value + h), 2));
                format!(
                    "γ across e is not seen for sure in these readings: it lies between {low} and {high} µrad (95 %), and the uncertainties of the others allow for that."
                )
            } else if self.weighed.across_told {
                "The sign of γ across e follows from the section of the bar (its harmonics): with the other sign the readings are met worse.".to_owned()
            } else {
                "γ across e is known but for its sign: the section of the bar is too round to decide it. With the other sign speed and curve of the turn change with it, which their uncertainties allow for.".to_owned()
            });
        }
        all
    }

    /// What remains in the residuals, and what pairs of angles would show.
    pub(super) fn remains(&self) -> Vec<String> {
        let law = &self.analysis.law;
        let mut all = Vec::new();
        let mean_step = (self.run.times().1 - self.run.times().0) / (self.run.len() - 1) as f64;
        if law.correlated > 0.0 {
            // The correlation has gone to a twentieth after three lengths.
            let readings = (3.0 * law.length / mean_step).ceil();
            let slower = correlated_over(&self.chosen.fit.residuals);
            all.push(format!(
                "Noise of one reading: {} µm, of which {} µm is correlated over about {readings} readings. Uncertainties take that into account, and are known to {} degrees of freedom (95 % intervals: {} u){}; were the readings independent, u of {} would be {} µrad.",
                plain(self.weighed.noise, 2),
                plain(law.correlated.sqrt(), 2),
                self.degrees_of_freedom().round(),
                plain(self.half_interval(), 3),
                if self.analysis.factor > 1.0 {
                    format!(
                        ". What is slower, within two turns or more, is not counted as noise (all that is left stays together over about {slower} readings): from turn to turn levels scatter by {} µm and waves by {} µm beyond it, which is added",
                        plain(self.analysis.slow.level.sqrt(), 2),
                        plain(self.analysis.slow.wave.sqrt(), 2)
                    )
                } else {
                    String::new()
                },
                self.combination,
                plain(URAD * self.slope_std_white(), 2)
            ));
        }
        if let Some(step) = resolution(&self.run.value) {
            all.push(format!(
                "The readings come in steps of {} µm, which alone is {} µm RMS.",
                plain(step, 2),
                plain(step / 12f64.sqrt(), 2)
            ));
        }
        if self.weighed.kind != Kind::None && self.weighed.adequacy < 0.01 {
            all.push(format!(
                "Some turns differ from the model by more than this noise allows (p {}), by {} µm RMS in all.",
                probability(self.weighed.adequacy),
                plain(self.weighed.after.rms, 2)
            ));
        }
        if let (Some(pairs), Some(bar)) = (&self.pairs, &self.bar) {
            all.push(format!(
                "Traces at pairs of opposite angles of the once-per-turn wave differ in slope by an amplitude of {} µrad that follows twice the angle. That is ovality: a section oval by {} µm, the same all along the bar, makes {} µrad of it, because the direction of e + γx turns by {}° along the travel.",
                measured(URAD * pairs.amplitude_rad.value, Some(URAD * pairs.amplitude_rad.std)),
                plain(pairs.oval_um, 2),
                plain(URAD * pairs.of_oval_rad, 2),
                plain(bar.turned_rad.value.abs().to_degrees(), 2)
            ));
        }
        all
    }

    /// The answer on a terminal.
    pub(super) fn text(&self, data: &str) -> String {
        let weighed = self.weighed;
        let mut text = format!(
            "{data}: {} readings over {} turns, {} mm of feed, angle of the spindle {}\n\n{}\n\n",
            self.run.len(),
            plain(self.survey.turns, 4),
            plain(self.run.range().1 - self.run.range().0, 4),
            if self.run.angle.is_some() {
                "recorded"
            } else {
                "found"
            },
            self.statement()
        );
        let named = weighed.kind != Kind::None && !std::ptr::eq(self.chosen, &self.analysis.steady);
        let arrow = |a: f64, b: f64| match named {
            true => format!("{} -> {}", plain(a, 3), plain(b, 3)),
            false => plain(a, 3),
        };
        let _ = writeln!(
            text,
            "Residuals, µm RMS         {}\nGap, noise taken out      {}   noise of one reading {}",
            arrow(self.analysis.steady.fit.rms(), self.chosen.fit.rms()),
            arrow(weighed.before.rms, weighed.after.rms),
            plain(weighed.noise, 2)
        );
        if let (Some(a), Some(b)) = (self.analysis.steady.held_out, self.chosen.held_out) {
            let _ = writeln!(text, "On turns held out         {}", arrow(a, b));
        }
        let _ = writeln!(
            text,
            "\nExplanation        evidence  explains         p   left"
        );
        for w in &weighed.weights {
            let mark = if weighed.effects.contains(&w.effect) {
                "*"
            } else {
                " "
            };
            let _ = writeln!(
                text,
                "{mark} {:<16} {:>8}  {:>8}  {:>8}   {} µm",
                w.effect,
                plain(w.evidence, 3),
                percent(w.explained),
                probability(w.p_value),
                plain(w.left.rms, 2)
            );
        }
        let figure =
            |value: &Value, factor: f64| measured(factor * value.value, Some(factor * value.std));
        let _ = writeln!(
            text,
            "\n{:<26}{} µrad",
            self.combination,
            figure(&self.slope.1, URAD)
        );
        let minute = if self.run.timed { MINUTE } else { 1.0 };
        if let Some(speed) = &self.speed {
            let told = if speed.std > 0.0 {
                figure(speed, minute)
            } else {
                plain(minute * speed.value, 5)
            };
            let _ = writeln!(text, "{:<26}{told} {}", "mean speed", self.speed_unit());
        }
        if let Some(bar) = &self.bar {
            let _ = writeln!(
                text,
                "{:<26}{} µm\n{:<26}{} µrad\n{:<26}{}{} µrad",
                "e at mid travel",
                figure(&bar.eccentricity_um, 1.0),
                "γ along e",
                figure(&bar.along_rad, URAD),
                "γ across e",
                if self.weighed.across_told || self.chosen.fit.across_held {
                    ""
                } else {
                    "± "
                },
                figure(&bar.across_rad, URAD)
            );
        }
        for note in self.not_told().iter().chain(&self.remains()) {
            let _ = writeln!(text, "\nNote: {note}");
        }
        text
    }
}

/// What the slope of the form is, by the direction of the indicator (rad).
fn combination(indicator: f64) -> String {
    // To a millionth of a degree.
    let degrees = (indicator.to_degrees().rem_euclid(360.0) * 1e6).round() / 1e6;
    let name = [
        (0.0, "alpha_h + cone"),
        (90.0, "alpha_v + cone"),
        (180.0, "cone - alpha_h"),
        (270.0, "cone - alpha_v"),
    ];
    match name.iter().find(|(of, _)| *of == degrees) {
        Some((_, name)) => (*name).to_owned(),
        None => format!("alpha towards {degrees}° + cone"),
    }
}

/// Over how many readings residuals are correlated: until their correlation has gone to a twentieth.
fn correlated_over(residuals: &[f64]) -> usize {
    let mean = residuals.iter().sum::<f64>() / residuals.len() as f64;
    let product = |lag: usize| -> f64 {
        let pairs = residuals.iter().zip(&residuals[lag..]);
        pairs.map(|(a, b)| (a - mean) * (b - mean)).sum()
    };
    let whole = product(0);
    (1..residuals.len() / 2)
        .find(|lag| product(*lag) <= 0.05 * whole)
        .unwrap_or(residuals.len() / 2)
}

/// The step in which readings come, µm, where most of them are whole multiples of it.
fn resolution(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let largest = sorted.last()?.abs().max(sorted.first()?.abs());
    let steps = sorted.windows(2).map(|w| w[1] - w[0]);
    let least = steps
        .filter(|s| *s > 1e-9 * largest)
        .fold(f64::INFINITY, f64::min);
    let whole = |v: &f64| {
        let multiple = (v - sorted[0]) / least;
        (multiple - multiple.round()).abs() < 0.01
    };
    // Coarse only where a step is taken by several readings on average.
    let span = sorted[sorted.len() - 1] - sorted[0];
    let coarse = least.is_finite() && sorted.len() as f64 > 4.0 * span / least;
    (coarse && sorted.iter().all(whole)).then_some(least)
}
