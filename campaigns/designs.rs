//! Blind effects on eight channels: near, far, top and bottom at 0° and 180°.
//!
//! cargo run --release -p errsep-campaigns --bin designs -- [--cases N] [--nulls N] [--seed N] [--only EFFECT,...]
//! `                                               ` [--minutes N]
//!
//! A maker draws slopes, forms and an effect in its exact form (the simulator's own code, not the catalogue's
//! signatures), of such a size that it leaves 0.7 to 3 times the noise of a reading unabsorbed (machines are
//! drawn until one can have it so large); the library diagnoses the readings; the truth is opened and counted. Readings without any effect are diagnosed at
//! false-alarm probabilities of 1 % and 5 %. Case k of an effect has the seed `1000 * N + k`.
//!
//! Of the cases that are not right alone the certificate says whether they could be: *separable* are those
//! whose effect, at the size put in, is 4.65 standard deviations (twice the 99 % quantile) or more from the
//! effect most like it.

use std::time::{Duration, Instant};

use errsep::diagnosis::{Diagnosis, Kind, NoiseLaw, NoiseSource, Options, certificate, diagnose};
use errsep_models::model::FittedModel;
use errsep_models::reversal::designs::simulate::{
    DesignEffect, DesignEffectKind, DesignPlan, frame, simulate,
};
use errsep_models::reversal::designs::{
    Analysis, Design, DesignObservations, DesignReading, Zero, form_analysis, slope_analysis,
};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

const EIGHT: &str = "0/0,90/0,180/0,270/0,0/180,90/180,180/180,270/180";
const THICKNESS_MM: f64 = 40.0;
const NOISE_UM: f64 = 0.05;

/// What eight channels can show of the catalogue: all but those that the model absorbs whatever their size
/// (`taper` and `oval-cone` are terms of its fit, an angle of half a turn counts as tilt).
const SHOWN: [&str; 14] = [
    "ambient-cycle",
    "axis-backlash",
    "cyclic-error",
    "gain-mismatch",
    "hysteresis",
    "indicator-nonlinearity",
    "lateral-backlash",
    "local-contamination",
    "off-crest",
    "reversal-shift",
    "stick-slip",
    "thermal-drift",
    "thickness-shift",
    "zero-jump",
];

/// Sizes in units of the noise.
const SIZES: (f64, f64) = (0.7, 3.0);

/// Standard deviations between two effects from which on they count as told apart.
const APART: f64 = 4.65;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let option = |name: &str| -> Option<&String> {
        let at = arguments.iter().position(|a| a == name)?;
        arguments.get(at + 1)
    };
    let number = |name: &str, fallback: u64| -> u64 {
        option(name)
            .and_then(|v| v.parse().ok())
            .unwrap_or(fallback)
    };
    let seed = 1000 * number("--seed", 1);
    let until = Instant::now() + Duration::from_secs(60 * number("--minutes", 600));
    let wanted = |name: &&str| option("--only").is_none_or(|o| o.split(',').any(|w| w == *name));
    let names: Vec<&str> = SHOWN.into_iter().filter(wanted).collect();
    let (cases, nulls) = (number("--cases", 20), number("--nulls", 100));

    let mut counts = vec![Counts::default(); names.len()];
    let mut done = 0;
    while done < cases && Instant::now() < until {
        let found: Vec<Option<Case>> = names
            .par_iter()
            .map(|name| one(name, seed + done))
            .collect();
        for (count, said) in counts.iter_mut().zip(found) {
            count.add(said);
        }
        done += 1;
    }
    println!(
        "Seeds {seed} to {}, {done} cases an effect.\n",
        seed + done.max(1) - 1
    );
    println!(
        "| effect | cases | right, alone | right, in a group | wrong | unknown | none | right, of the separable |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let mut all = Counts::default();
    for (name, count) in names.iter().zip(&counts) {
        println!("| `{name}` {}", count.row());
        all = all.and(count);
    }
    println!("| all {}", all.row());

    let alarms: Vec<[bool; 2]> = (0..nulls)
        .into_par_iter()
        .filter(|_| Instant::now() < until)
        .filter_map(|k| nothing(seed + 500_000 + k))
        .collect();
    println!("\n| nothing there | alarms |\n|---|---|");
    for (k, level) in [1, 5].into_iter().enumerate() {
        let count = alarms.iter().filter(|a| a[k]).count();
        println!("| at {level} % | {} |", share(count, alarms.len()));
    }
}

/// What the diagnosis said of one case.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Said {
    Right,
    InGroup,
    Wrong,
    Unknown,
    Nothing,
}

#[derive(Debug, Clone, Copy, Default)]
struct Counts {
    of: [usize; 5],
    /// Not right alone, and not separable.
    alike: usize,
    not_made: usize,
}

/// One case: what was said, and whether the effect could be told from all others.
#[derive(Debug, Clone, Copy)]
struct Case {
    said: Said,
    separable: bool,
}

impl Counts {
    fn add(&mut self, case: Option<Case>) {
        match case {
            Some(case) => {
                self.of[case.said as usize] += 1;
                self.alike += usize::from(!case.separable);
            }
            None => self.not_made += 1,
        }
    }

    fn and(mut self, other: &Self) -> Self {
        for (a, b) in self.of.iter_mut().zip(other.of) {
            *a += b;
        }
        self.not_made += other.not_made;
        self.alike += other.alike;
        self
    }

    fn row(&self) -> String {
        let cases: usize = self.of.iter().sum();
        let shares: Vec<String> = self.of.iter().map(|k| share(*k, cases)).collect();
        let without = match self.not_made {
            0 => String::new(),
            n => format!(" ({n} not made)"),
        };
        let separable = share(self.of[Said::Right as usize], cases - self.alike);
        format!(
            "| {cases}{without} | {} | {separable} of {} |",
            shares.join(" | "),
            cases - self.alike
        )
    }
}

/// k of n with the 95 % interval of Wilson (1927).
fn share(k: usize, n: usize) -> String {
    if n == 0 {
        return "–".to_owned();
    }
    let (count, p, z2) = (n as f64, k as f64 / n as f64, 1.96f64 * 1.96);
    let centre = (p + z2 / (2.0 * count)) / (1.0 + z2 / count);
    let reach =
        1.96 / (1.0 + z2 / count) * (p * (1.0 - p) / count + z2 / (4.0 * count * count)).sqrt();
    let percent = |v: f64| (100.0 * v).clamp(0.0, 100.0);
    format!(
        "{k}: {:.0} % ({:.0} to {:.0})",
        percent(p),
        percent(centre - reach),
        percent(centre + reach)
    )
}

/// Slopes, forms and noise of a case.
fn bare(random: &mut ChaCha8Rng, seed: u64) -> Option<DesignPlan> {
    let mut slope = |size: f64| size * (2.0 * random.random::<f64>() - 1.0);
    let mut plan = DesignPlan {
        slopes_rad: [
            slope(1e-4),
            slope(1e-4),
            slope(6e-4),
            slope(6e-4),
            slope(4e-5),
            slope(2e-5),
            0.0,
        ],
        thickness_mm: THICKNESS_MM,
        positions: 61,
        repeats: 3,
        both_directions: true,
        interval_s: 2.0,
        forms_um: [1.5, 1.0],
        seed,
        ..DesignPlan::of(Design::parse(EIGHT).ok()?)
    };
    plan.turned_each_repeat = random.random_bool(0.5);
    Some(plan)
}

/// Machines that are drawn until one can have the effect at its size.
const ATTEMPTS: u64 = 40;

/// One case of an effect; `None` where no machine that is drawn can have it so large.
fn one(name: &str, seed: u64) -> Option<Case> {
    let made = |attempt: u64| made(name, seed + 1_000_000 * attempt);
    let (plan, visible) = (0..ATTEMPTS).find_map(made)?;
    let (readings, _) = simulate(&plan).ok()?;
    let said = judged(name, &diagnosed(&readings, 0.01, seed)?);
    let separable =
        said == Said::Right || apart(name, &plan, visible).is_some_and(|sd| sd >= APART);
    if said != Said::Right {
        eprintln!(
            "{name} seed {seed}: {said:?}, {:?} standard deviations apart",
            apart(name, &plan, visible)
        );
    }
    Some(Case { said, separable })
}

/// Standard deviations between an effect of which `visible` µm shows and the one most like it; `None` where
/// the certificate tells it from that one at no plausible size.
fn apart(name: &str, plan: &DesignPlan, visible: f64) -> Option<f64> {
    let undisturbed = DesignPlan {
        effects: Vec::new(),
        ..plan.clone()
    };
    let model = model(&simulate(&undisturbed).ok()?.0)?;
    let law = NoiseLaw::white(NOISE_UM, f64::INFINITY, NoiseSource::Stated);
    let options = Options {
        draws: 200,
        ..Options::default()
    };
    let rows = certificate(&model, model.effects(), &law, &options);
    let row = rows.into_iter().find(|row| row.effect == name)?;
    // The certificate's visible root mean square belongs to the smallest size seen.
    Some(APART * visible / (row.visible_rms? * row.identifiable? / row.detectable?))
}

/// A machine with the effect at a size that can be seen, and how much of it shows, µm.
fn made(name: &str, seed: u64) -> Option<(DesignPlan, f64)> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut plan = bare(&mut random, seed)?;
    if name == "thickness-shift" {
        // Only where the bar is much askew does a thickness show.
        for slope in &mut plan.slopes_rad[..4] {
            *slope *= 15.0;
        }
    }
    let target = NOISE_UM * (SIZES.0 + (SIZES.1 - SIZES.0) * random.random::<f64>());
    plan.effects = vec![sized(name, &mut plan, target, &mut random)?];
    plan.noise_um = NOISE_UM;
    Some((plan, target))
}

/// The effect at a size that leaves so much, µm root mean square, that the model does not absorb. Beside
/// the crest that hangs on how far the slide is askew, not on where the stylus stands at mid travel.
fn sized(
    name: &str,
    plan: &mut DesignPlan,
    target: f64,
    random: &mut ChaCha8Rng,
) -> Option<DesignEffect> {
    let frame = frame(plan).ok()?;
    let start = match name {
        "gain-mismatch" => 1e-3,
        "axis-backlash" | "stick-slip" => 0.05,
        "reversal-shift" => 0.1,
        "thickness-shift" => 20.0,
        "off-crest" => 0.2,
        _ => 5.0 * target,
    };
    let mut effect = DesignEffect::named(name, start, &plan.design, &frame, random)?;
    for _ in 0..8 {
        let with = DesignPlan {
            effects: vec![effect],
            ..plan.clone()
        };
        let (without, _) = simulate(plan).ok()?;
        let (with, _) = simulate(&with).ok()?;
        let left = unabsorbed(plan, &without, &with);
        if !(left > 0.0 && left.is_finite()) {
            return None;
        }
        if (left / target - 1.0).abs() < 0.05 {
            return plausible(&effect).then_some(effect);
        }
        let factor = (target / left).clamp(0.05, 20.0);
        if name == "off-crest" {
            plan.slopes_rad[..2].iter_mut().for_each(|s| *s *= factor);
            if plan.slopes_rad[..2].iter().any(|s| s.abs() > 5e-3) {
                return None;
            }
        } else {
            effect.size *= factor;
        }
    }
    None
}

/// Whether a machine could have it and still be measured.
fn plausible(effect: &DesignEffect) -> bool {
    match effect.kind {
        DesignEffectKind::AxisBacklash | DesignEffectKind::StickSlip { .. } => effect.size < 2.0,
        DesignEffectKind::ReversalShift => effect.size < 5.0,
        DesignEffectKind::ThicknessShift => effect.size < 150.0,
        DesignEffectKind::GainMismatch => effect.size < 0.2,
        DesignEffectKind::OffCrest => effect.size < 5.0,
        // An indicator that goes back while its stylus moves on is broken, not periodic.
        DesignEffectKind::CyclicReading { period, .. } => {
            std::f64::consts::TAU * effect.size < 0.9 * period
        }
        _ => true,
    }
}

/// What slopes, constants and forms do not absorb of a difference: root mean square over the degrees of
/// freedom, by means over repeats and directions and by straight lines.
fn unabsorbed(plan: &DesignPlan, without: &DesignObservations, with: &DesignObservations) -> f64 {
    let x = plan.x();
    let (n, channels) = (x.len(), plan.design.channels().len());
    let place = |r: &DesignReading| (r.x / x[1]).round() as usize;
    let pairs = || with.readings.iter().zip(&without.readings);
    let per_cell = with.readings.len() as f64 / (n * channels) as f64;
    let mut means = DMatrix::zeros(channels, n);
    for (a, b) in pairs() {
        means[(a.channel, place(a))] += (a.value - b.value) / per_cell;
    }
    let centre = x.iter().sum::<f64>() / n as f64;
    let along = DVector::from_iterator(n, x.iter().map(|x| x - centre)).normalize();
    let level = DVector::from_element(n, 1.0 / (n as f64).sqrt());
    let (slopes, levels) = (&means * &along, &means * &level);
    let forms = &means - &slopes * along.transpose() - &levels * level.transpose();
    let (of_forms, of_slopes) = (form_analysis(&plan.design), slope_analysis(&plan.design, 2));
    let fitted = levels * level.transpose()
        + taken_up(&of_slopes, &DMatrix::from_columns(&[slopes])) * along.transpose()
        + taken_up(&of_forms, &forms);
    let left: f64 = pairs()
        .map(|(a, b)| (a.value - b.value - fitted[(a.channel, place(a))]).powi(2))
        .sum();
    let unknowns = channels + of_slopes.rank() + (n - 2) * of_forms.rank();
    (left / (with.readings.len() - unknowns) as f64).sqrt()
}

/// The part of columns, one row a channel, that the fitted unknowns take up.
fn taken_up(analysis: &Analysis, columns: &DMatrix<f64>) -> DMatrix<f64> {
    let base = analysis.matrix().select_columns(analysis.pivots()).qr().q();
    &base * (base.transpose() * columns)
}

fn model(readings: &DesignObservations) -> Option<Linearised> {
    let assumptions = Assumptions {
        thickness: Some(THICKNESS_MM),
        ..Assumptions::default()
    };
    Linearised::of_design(readings, Zero::Reset, None, assumptions).ok()
}

fn diagnosed(readings: &DesignObservations, false_alarm: f64, seed: u64) -> Option<Diagnosis> {
    let options = Options {
        seed,
        false_alarm,
        ..Options::default()
    };
    Some(diagnose(&model(readings)?, &options))
}

fn judged(name: &str, diagnosis: &Diagnosis) -> Said {
    let verdict = &diagnosis.verdict;
    match verdict.kind {
        Kind::None => Said::Nothing,
        Kind::Unknown => Said::Unknown,
        Kind::Effect => {
            let alone = verdict.indistinguishable.is_empty();
            let mut groups = verdict.indistinguishable.iter().flatten();
            if alone && verdict.effects.len() == 1 && verdict.effects[0] == name {
                Said::Right
            } else if !alone && groups.any(|member| member == name) {
                Said::InGroup
            } else {
                Said::Wrong
            }
        }
    }
}

/// Whether readings without any effect raise an alarm at 1 % and at 5 %.
fn nothing(seed: u64) -> Option<[bool; 2]> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let plan = DesignPlan {
        noise_um: NOISE_UM,
        ..bare(&mut random, seed)?
    };
    let (readings, _) = simulate(&plan).ok()?;
    let alarm = |level: f64| Some(diagnosed(&readings, level, seed)?.verdict.kind != Kind::None);
    Some([alarm(0.01)?, alarm(0.05)?])
}
