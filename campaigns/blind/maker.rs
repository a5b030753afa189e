//! The maker: machines, artefacts, noise and effects drawn at random.

use std::collections::BTreeMap;

use errsep_models::reversal::exact_readings::{Injection, Scene, SceneNoise};
use errsep_models::reversal::{Channel, Observations};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StudentT};
use sha2::{Digest, Sha256};

/// The law of the noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Noise {
    White,
    /// White, correlated along the trace, and shifts of whole traces.
    Correlated,
    /// Student's law with three degrees of freedom: not what the diagnosis assumes.
    Tails,
}

impl Noise {
    pub fn name(self) -> &'static str {
        match self {
            Self::White => "white",
            Self::Correlated => "correlated",
            Self::Tails => "heavy tails",
        }
    }
}

/// One case: what the maker made.
pub struct Made {
    pub observations: Observations,
    pub effects: Vec<&'static str>,
    pub truth: Vec<Injection>,
    pub gap: f64,
    pub seal: String,
}

/// A digest in hexadecimal.
pub fn seal(text: &str) -> String {
    Sha256::digest(text.as_bytes())
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

fn scene(law: Noise, tilt: f64, random: &mut impl Rng) -> Scene {
    let white = 0.02 + 0.06 * random.random::<f64>();
    let part = |low: f64, high: f64, random: &mut dyn FnMut() -> f64| {
        white * (low + (high - low) * random())
    };
    let mut draw = || random.random::<f64>();
    let noise = if law == Noise::Correlated {
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
        // An indicator that goes back while its stylus moves on is broken, not periodic.
        Injection::CyclicError {
            amplitude,
            period,
            of_reading: true,
            ..
        } => std::f64::consts::TAU * amplitude < 0.9 * period,
        _ => true,
    };
    (plausible && (left / target - 1.0).abs() < 0.1).then_some(injection)
}

/// A case with the named effects, each sized in units of the noise of one reading.
pub fn make(names: &[&'static str], seed: u64, sizes: (f64, f64), law: Noise) -> Option<Made> {
    for attempt in 0..40u64 {
        let mut random = ChaCha8Rng::seed_from_u64(seed * 1000 + attempt);
        let tilt = if names.contains(&"thickness-shift") {
            4e-3
        } else {
            3e-5
        };
        let bare = scene(law, tilt, &mut random);
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
            observations: measured(&full, law, seed.wrapping_mul(7919) + attempt),
            effects: names.to_vec(),
            truth: full.effects,
            gap,
            seal,
        });
    }
    None
}

fn measured(scene: &Scene, law: Noise, seed: u64) -> Observations {
    if law != Noise::Tails {
        return scene.measured(seed);
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut observations = scene.exact();
    if let Ok(student) = StudentT::new(3.0) {
        for reading in &mut observations.readings {
            // The variance of Student's law with three degrees of freedom is three.
            let tail: f64 = student.sample(&mut random);
            reading.value += scene.noise.white * tail / 3f64.sqrt();
        }
    }
    observations
}

/// The size of an effect as the diagnosis reports it first.
pub fn size(injection: &Injection) -> f64 {
    match *injection {
        Injection::Taper(size)
        | Injection::ReversalShift(size)
        | Injection::ThicknessShift(size)
        | Injection::GainMismatch(size)
        | Injection::CommonGain(size)
        | Injection::AxisBacklash(size)
        | Injection::Hysteresis(size)
        | Injection::GravitySag(size)
        | Injection::TipRadius(size)
        | Injection::IndicatorNonlinearity {
            deviation: size, ..
        }
        | Injection::ThermalDrift { drift: size, .. }
        | Injection::ZeroJump { jump: size, .. }
        | Injection::LocalContamination { height: size, .. }
        | Injection::CyclicError {
            amplitude: size, ..
        } => size,
    }
}
