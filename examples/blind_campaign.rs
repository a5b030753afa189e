//! Blind campaign on the reversal: a maker draws machines, artefacts, noise and effects and prints
//! a digest of the answers; the solver sees readings only, and a digest of its reports is printed;
//! then the judge opens the answers, checks them against their seals and counts.
//!
//! cargo run --release --example blind_campaign -- --cases 20 --seed 1 --set single|pairs|null|withheld|small

use std::collections::BTreeMap;
use std::time::Instant;

use errsep::diagnosis::{Diagnosis, Kind, Options, diagnose};
use errsep_models::reversal::Observations;
use errsep_models::reversal::diagnosable::{Assumptions, FirstOrder};
use errsep_models::reversal::exact_readings::{Injection, Scene, SceneNoise};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sha2::{Digest, Sha256};

/// The effects that a reversal can show.
const SHOWN: [&str; 11] = [
    "axis-backlash",
    "cyclic-error",
    "gain-mismatch",
    "hysteresis",
    "indicator-nonlinearity",
    "local-contamination",
    "reversal-shift",
    "taper",
    "thermal-drift",
    "thickness-shift",
    "zero-jump",
];

/// One case: what the maker made.
struct Made {
    observations: Observations,
    effects: Vec<&'static str>,
    truth: Vec<Injection>,
    gap: f64,
    seal: String,
}

fn seal(text: &str) -> String {
    Sha256::digest(text.as_bytes())
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

fn scene(correlated: bool, tilt: f64, random: &mut impl Rng) -> Scene {
    let white = 0.02 + 0.06 * random.random::<f64>();
    let part = |low: f64, high: f64, random: &mut dyn FnMut() -> f64| {
        white * (low + (high - low) * random())
    };
    let mut draw = || random.random::<f64>();
    let noise = if correlated {
        SceneNoise {
            white,
            correlated: part(0.5, 1.0, &mut draw),
            length: 4.0 + 12.0 * draw(),
            shift: part(0.2, 0.5, &mut draw),
        }
    } else {
        SceneNoise {
            white,
            ..SceneNoise::default()
        }
    };
    Scene::random(150, 4, tilt, 2.0, noise, random)
}

/// What the seed's model cannot absorb of exact differences: root mean square over its degrees of
/// freedom, for a complete plan, by means over cells and straight lines.
fn unabsorbed(scene: &Scene, without: &Observations, with: &Observations) -> f64 {
    use errsep_models::reversal::Channel;
    let x = &scene.positions;
    let n = x.len();
    let index: BTreeMap<i64, usize> = x
        .iter()
        .enumerate()
        .map(|(k, v)| ((v * 1e6) as i64, k))
        .collect();
    let place = |v: f64| index[&((v * 1e6) as i64)];
    let mut means = [const { Vec::new() }; 4];
    for mean in &mut means {
        *mean = vec![0.0; n];
    }
    let per_cell = with.readings.len() as f64 / (4 * n) as f64;
    let difference = |k: usize| with.readings[k].value - without.readings[k].value;
    for (k, reading) in with.readings.iter().enumerate() {
        means[reading.channel.index()][place(reading.x)] += difference(k) / per_cell;
    }
    let centre = x.iter().sum::<f64>() / n as f64;
    let sxx: f64 = x.iter().map(|v| (v - centre).powi(2)).sum();
    let line = |values: &[f64]| -> (f64, f64) {
        let level = values.iter().sum::<f64>() / n as f64;
        let slope = values
            .iter()
            .zip(x)
            .map(|(y, v)| y * (v - centre))
            .sum::<f64>()
            / sxx;
        (level, slope)
    };
    let signs = [1.0, 1.0, -1.0, -1.0];
    let closure: Vec<f64> = (0..n)
        .map(|k| (0..4).map(|c| signs[c] * means[c][k]).sum::<f64>() / 4.0)
        .collect();
    let (level, slope) = line(&closure);
    let cone = (0..4).map(|c| line(&means[c]).1).sum::<f64>() / 4.0;
    let mut sum = 0.0;
    for (k, reading) in with.readings.iter().enumerate() {
        let (c, j) = (reading.channel.index(), place(reading.x));
        debug_assert_eq!(Channel::ALL[c], reading.channel);
        let left = closure[j] - level - slope * (x[j] - centre);
        let fitted = means[c][j] - signs[c] * left - cone * (x[j] - centre);
        sum += (difference(k) - fitted).powi(2);
    }
    let freedom = with.readings.len() as f64 - (3 * n - 1 + 2) as f64;
    (sum / freedom).sqrt()
}

/// A size of the named effect that leaves `target` µm unabsorbed, found by the secant rule.
fn sized(scene: &Scene, name: &str, target: f64, random: &mut ChaCha8Rng) -> Option<Injection> {
    let draws = random.clone();
    let without = scene.exact();
    let frame = scene.frame();
    let mut size = match name {
        "taper" => 1e-6,
        "gain-mismatch" | "common-gain" => 1e-3,
        "axis-backlash" | "reversal-shift" => 1e-2,
        "thickness-shift" => 20.0,
        _ => 10.0 * target,
    };
    let mut made = None;
    for _ in 0..7 {
        let mut same = draws.clone();
        let injection = Injection::named(name, size, &frame, &mut same)?;
        let mut with = scene.clone();
        with.effects.push(injection);
        let left = unabsorbed(scene, &without, &with.exact());
        if !left.is_finite() || left <= 0.0 {
            return None;
        }
        made = Some((injection, same, left));
        if (left / target - 1.0).abs() < 0.02 {
            break;
        }
        size *= target / left;
    }
    let (injection, same, left) = made?;
    *random = same;
    let plausible = match injection {
        Injection::ThicknessShift(thickness) => thickness < 150.0,
        Injection::AxisBacklash(lost) => lost < 2.0,
        Injection::ReversalShift(shift) => shift < 3.0,
        Injection::GainMismatch(gain) => gain < 0.2,
        _ => true,
    };
    (plausible && (left / target - 1.0).abs() < 0.1).then_some(injection)
}

fn make(names: &[&'static str], seed: u64, sizes: (f64, f64), correlated: bool) -> Option<Made> {
    for attempt in 0..40u64 {
        let mut random = ChaCha8Rng::seed_from_u64(seed * 1000 + attempt);
        let tilt = if names.contains(&"thickness-shift") {
            4e-3
        } else {
            3e-5
        };
        let bare = scene(correlated, tilt, &mut random);
        let noise =
            (bare.noise.white.powi(2) + bare.noise.correlated.powi(2) + bare.noise.shift.powi(2))
                .sqrt();
        let mut full = bare.clone();
        let mut failed = false;
        for name in names {
            let target = noise * (sizes.0 + (sizes.1 - sizes.0) * random.random::<f64>());
            match sized(&bare, name, target, &mut random) {
                Some(injection) => full.effects.push(injection),
                None => failed = true,
            }
        }
        if failed {
            continue;
        }
        let gap = unabsorbed(&bare, &bare.exact(), &full.exact());
        let seal = seal(&format!("{:?} {gap}", full.effects));
        return Some(Made {
            observations: full.measured(seed.wrapping_mul(7919) + attempt),
            effects: names.to_vec(),
            truth: full.effects,
            gap,
            seal,
        });
    }
    None
}

fn solve(observations: &Observations, without: &[&str], seed: u64) -> Option<Diagnosis> {
    let model = FirstOrder::new(observations, Assumptions::default()).ok()?;
    let options = Options {
        seed,
        draws: 400,
        without: without.iter().map(|s| (*s).to_owned()).collect(),
        ..Options::default()
    };
    Some(diagnose(&model, &options))
}

fn label(diagnosis: &Diagnosis) -> String {
    match diagnosis.verdict.kind {
        Kind::None => "none".to_owned(),
        Kind::Unknown => format!("unknown({})", diagnosis.verdict.partial.join("+")),
        Kind::Effect if diagnosis.verdict.indistinguishable.is_empty() => {
            let mut names = diagnosis.verdict.effects.clone();
            names.sort();
            names.join("+")
        }
        Kind::Effect => {
            let mut names = diagnosis.verdict.effects.clone();
            names.sort();
            format!(
                "{} |{:?}",
                names.join("+"),
                diagnosis.verdict.indistinguishable
            )
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let option = |name: &str, fallback: &str| -> String {
        arguments
            .iter()
            .position(|a| a == name)
            .and_then(|k| arguments.get(k + 1))
            .cloned()
            .unwrap_or_else(|| fallback.to_owned())
    };
    let cases: u64 = option("--cases", "4").parse().unwrap_or(4);
    let seed: u64 = option("--seed", "1").parse().unwrap_or(1);
    let only = option("--only", "");
    let start = Instant::now();
    match option("--set", "single").as_str() {
        "null" => nulls(cases, seed),
        set => effects(set, cases, seed, &only),
    }
    eprintln!("{:.1} s", start.elapsed().as_secs_f64());
}

fn nulls(cases: u64, seed: u64) {
    for correlated in [false, true] {
        let mut p: Vec<f64> = (0..cases)
            .into_par_iter()
            .filter_map(|k| {
                let made = make(&[], seed * 100_000 + k, (0.0, 0.0), correlated)?;
                Some(solve(&made.observations, &[], k)?.verdict.p_value)
            })
            .collect();
        p.sort_by(f64::total_cmp);
        let below = |level: f64| p.iter().filter(|v| **v <= level).count() as f64 / p.len() as f64;
        println!(
            "null correlated={correlated}: n={} 1% {:.4} 5% {:.4} 10% {:.4} 50% {:.3}",
            p.len(),
            below(0.01),
            below(0.05),
            below(0.1),
            below(0.5)
        );
    }
}

fn effects(set: &str, cases: u64, seed: u64, only: &str) {
    let mut combinations: Vec<Vec<&'static str>> = SHOWN.iter().map(|n| vec![*n]).collect();
    if set == "pairs" {
        combinations = SHOWN
            .iter()
            .enumerate()
            .flat_map(|(k, a)| SHOWN[k + 1..].iter().map(move |b| vec![*a, *b]))
            .collect();
    }
    combinations.retain(|c| only.is_empty() || c.iter().any(|n| only.split(',').any(|o| o == *n)));
    let sizes = if set == "small" {
        (0.03, 0.15)
    } else {
        (0.7, 3.0)
    };
    let jobs: Vec<(Vec<&'static str>, u64)> = combinations
        .iter()
        .enumerate()
        .flat_map(|(c, names)| {
            (0..cases).map(move |k| (names.clone(), seed * 1_000_000 + (c as u64) * 1000 + k))
        })
        .collect();
    let asked = jobs.len();
    let made: Vec<(Made, u64)> = jobs
        .into_par_iter()
        .filter_map(|(names, case)| Some((make(&names, case, sizes, case % 2 == 1)?, case)))
        .collect();
    let seals: Vec<&str> = made.iter().map(|(m, _)| m.seal.as_str()).collect();
    println!(
        "answers sealed: {}, {} cases; {} could not be made at the size asked",
        seal(&seals.concat()),
        made.len(),
        asked - made.len()
    );
    let done: Vec<(Made, Diagnosis, f64)> = made
        .into_par_iter()
        .filter_map(|(made, case)| {
            let withheld: &[&str] = if set == "withheld" {
                &made.effects[..1]
            } else {
                &[]
            };
            let start = Instant::now();
            let diagnosis = solve(&made.observations, withheld, case)?;
            Some((made, diagnosis, start.elapsed().as_secs_f64()))
        })
        .collect();
    let reports: Vec<String> = done
        .iter()
        .map(|(_, d, _)| format!("{} {}", label(d), d.gap.before.rms))
        .collect();
    println!("reports sealed: {}", seal(&reports.concat()));
    let mut confusion: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    let (mut gap_right, mut floor_right, mut right, mut slow) = (0, 0, 0, 0.0f64);
    for (made, diagnosis, seconds) in &done {
        let mut names = made.effects.clone();
        names.sort_unstable();
        let said = label(diagnosis);
        slow = slow.max(*seconds);
        right += usize::from(said == names.join("+"));
        gap_right += usize::from((diagnosis.gap.before.rms / made.gap - 1.0).abs() < 0.15);
        if let Some(held) = diagnosis.gap.held_out {
            floor_right += usize::from(held.after <= 1.2 * held.floor);
        }
        if said != names.join("+") && std::env::var("VERBOSE").is_ok() {
            println!("  {:?} -> {said}", made.truth);
            println!(
                "     {} adequacy {:.1e} p {:.1e} gap {:.4}/{:.4} {:?}",
                diagnosis.verdict.statement,
                diagnosis.verdict.adequacy,
                diagnosis.verdict.p_value,
                diagnosis.gap.before.rms,
                made.gap,
                diagnosis.noise
            );
        }
        if seal(&format!("{:?} {}", made.truth, made.gap)) != made.seal {
            println!("the answer of a case of {names:?} does not fit its seal");
        }
        *confusion
            .entry(names.join("+"))
            .or_default()
            .entry(said)
            .or_default() += 1;
    }
    for (truth, said) in &confusion {
        println!("{truth}: {said:?}");
    }
    println!(
        "{set}: {} cases, right alone {right}, gap within 15 % {gap_right}, held-out after within 1.2 floors {floor_right}, slowest {slow:.2} s",
        done.len()
    );
}
