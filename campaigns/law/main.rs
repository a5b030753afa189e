//! Laws put into simulated campaigns and sought again: `cargo run --release -p errsep-campaigns --bin law -- CASES SEED
//! [laws|nulls|smooth]`. Twenty laws by formulas of this file, which shares no code with the grammar, with parameters
//! of chance are laid over readings of a reversal, a calibration line and a circle, the whole catalogue withheld. Told
//! is how often the law is found exactly: the same class of expression, and a visible change equal to 1 % of its root
//! mean square; and how often a law is told where there is none: in the noise, in Gaussian processes, in bumps.

mod laws;
#[path = "../../tests/other_models/mod.rs"]
mod other_models;
#[path = "../../tests/scene/mod.rs"]
mod scene;

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use errsep::diagnosis::{Kind, Law, LawFound, Options, diagnose_with, law};
use errsep_models::calibration_line::CalibrationLine;
use errsep_models::circle::CirclePoints;
use errsep_models::model::{Effect, FittedModel, Place, Shape};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use laws::{At, CIRCLE, LINE, Listed, READING, REVERSAL};
use nalgebra::DVector;
use other_models::{calibration_line_made, circle_made};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use statrs::distribution::{Beta, ContinuousCDF};

/// Length of what is seen of a law, in units of the noise of one reading: exact to 1 % is only possible far above it.
const SEEN: [f64; 2] = [250.0, 1000.0];
/// The same of gaps that are no law.
const SEEN_SMOOTH: [f64; 2] = [30.0, 1000.0];

/// The circumstances of all readings. A reading is the mean of those that differ by nothing but noise.
fn circumstances<M: FittedModel + 'static>(model: &M) -> Vec<At> {
    let places = model.places();
    let mut sums: BTreeMap<(usize, usize), (f64, f64)> = BTreeMap::new();
    for (place, value) in places.iter().zip(model.observed()) {
        let sum = sums.entry((place.cell, place.channel)).or_default();
        *sum = (sum.0 + value, sum.1 + 1.0);
    }
    let reading = |p: &Place| {
        let (sum, count) = sums[&(p.cell, p.channel)];
        sum / count
    };
    let range = |value: &dyn Fn(&Place) -> f64| {
        let low = places.iter().map(value).fold(f64::INFINITY, f64::min);
        (
            low,
            places.iter().map(value).fold(f64::NEG_INFINITY, f64::max),
        )
    };
    let part = |(low, high): (f64, f64), value: f64| (value - low) / (high - low).max(1e-300);
    let (x, t, r) = (range(&|p| p.x), range(&|p| p.time), range(&reading));
    let reach = r.0.abs().max(r.1.abs());
    let at = |p: &Place| At {
        x: part(x, p.x),
        t: part(t, p.time),
        r: reading(p) / reach,
        d: p.direction,
        c: p.channel,
    };
    places.iter().map(at).collect()
}

/// What the model leaves of changes of its readings: an orthonormal basis of what it absorbs, column by column.
struct Absorbed(Vec<DVector<f64>>);

impl Absorbed {
    fn of<M: FittedModel + 'static>(model: &M) -> Self {
        let freedom = model.freedom();
        let mut columns: Vec<DVector<f64>> = freedom
            .columns
            .column_iter()
            .map(|c| c.clone_owned())
            .collect();
        if let Some(profiles) = &freedom.profiles {
            let length = model.traces()[0].len();
            for function in 0..profiles.patterns.ncols() {
                let withheld = profiles.withheld.iter().find(|w| w.0 == function);
                for i in 0..length {
                    let mut profile = DVector::zeros(length);
                    profile[i] = 1.0;
                    if let Some((_, normal)) = withheld {
                        profile -= normal * (normal[i] / normal.norm_squared());
                    }
                    let mut column = DVector::zeros(model.places().len());
                    for (t, trace) in model.traces().iter().enumerate() {
                        let own = &profile * profiles.patterns[(t, function)];
                        column.rows_mut(trace.start, length).copy_from(&own);
                    }
                    columns.push(column);
                }
            }
        }
        let mut kept = Self(Vec::new());
        for column in columns {
            let left = kept.left(&kept.left(&column));
            if left.norm() > 1e-7 * column.norm() {
                kept.0.push(left.normalize());
            }
        }
        kept
    }

    fn left(&self, change: &DVector<f64>) -> DVector<f64> {
        let mut left = change.clone();
        for basis in &self.0 {
            left.axpy(-basis.dot(&left), basis, 1.0);
        }
        left
    }
}

fn drawn_size(bounds: [f64; 2], random: &mut ChaCha8Rng) -> f64 {
    bounds[0] * (bounds[1] / bounds[0]).powf(random.random::<f64>())
}

/// A change of a visible length in units of the noise.
fn scaled(change: &DVector<f64>, absorbed: &Absorbed, noise: f64, seen: f64) -> DVector<f64> {
    change * (seen * noise / absorbed.left(change).norm())
}

fn options() -> Options {
    Options {
        draws: 200,
        ..Options::default()
    }
}

/// What the search comes to on readings whose verdict without a catalogue is `unknown`.
enum Outcome {
    NotUnknown,
    NoLaw(String),
    Told(Box<Law>),
}

fn sought<M: FittedModel + 'static>(model: &M, forced: bool) -> Outcome {
    let options = options();
    if !forced && diagnose_with(model, Vec::new(), &options).verdict.kind != Kind::Unknown {
        return Outcome::NotUnknown;
    }
    match law(model, &options, 0) {
        Ok(LawFound::Law(law)) => Outcome::Told(law),
        Ok(LawFound::None(none)) => Outcome::NoLaw(format!("{} ({:?})", none.why, none.nearest)),
        Err(_) => Outcome::NotUnknown,
    }
}

#[derive(Default, Clone, Copy)]
struct Count {
    cases: usize,
    unknown: usize,
    told: usize,
    class: usize,
    exact: usize,
    sizes: usize,
    inside: usize,
}

fn case<M: FittedModel + 'static>(base: &M, noise: f64, listed: &Listed, seed: u64) -> Count {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let parameters = [0; 4].map(|_| random.random::<f64>());
    let places = circumstances(base);
    let raw = DVector::from_iterator(
        places.len(),
        places.iter().map(|a| (listed.1)(a, &parameters)),
    );
    let absorbed = Absorbed::of(base);
    let change = scaled(&raw, &absorbed, noise, drawn_size(SEEN, &mut random));
    let mut count = Count {
        cases: 1,
        ..Count::default()
    };
    let verbose = std::env::var_os("ERRSEP_CASES").is_some();
    match sought(&base.refit(base.observed() + &change), false) {
        Outcome::NotUnknown => {
            if verbose {
                println!("{seed} {:?}: no gap", listed.0);
            }
        }
        Outcome::NoLaw(why) => {
            count.unknown = 1;
            if verbose {
                let of = change.amax() / base.observed().amax();
                println!("{seed} {:?}, up to {of:.2} of the reading: {why}", listed.0);
            }
        }
        Outcome::Told(law) => {
            (count.unknown, count.told) = (1, 1);
            let own = law.effect.columns(base, &Shape::only())[0].dense(places.len());
            let off = absorbed.left(&(own - &change)).norm() / absorbed.left(&change).norm();
            let mut classes: Vec<(&str, &str)> = law
                .terms
                .iter()
                .map(|t| (t.function.as_str(), t.along.unwrap_or("")))
                .collect();
            classes.sort_unstable();
            count.class = usize::from(classes == listed.0);
            count.exact = usize::from(classes == listed.0 && off <= 0.01);
            if let Some((name, truth)) = listed.2.filter(|_| count.class == 1) {
                let along = law
                    .terms
                    .iter()
                    .find(|t| t.parameters.iter().any(|p| p.name == name));
                let found = along.and_then(|t| t.parameters.iter().find(|p| p.name == name));
                let of_time = along.is_some_and(|t| t.along == Some("time"));
                let value = |p: &Place| if of_time { p.time } else { p.x };
                let low = base
                    .places()
                    .iter()
                    .map(value)
                    .fold(f64::INFINITY, f64::min);
                let high = base
                    .places()
                    .iter()
                    .map(value)
                    .fold(f64::NEG_INFINITY, f64::max);
                let from = if name == "origin" { low } else { 0.0 };
                if let Some(found) = found {
                    let off = found.value - from - truth(&parameters) * (high - low);
                    count.sizes = 1;
                    count.inside = usize::from(off.abs() <= 1.96 * found.std);
                }
            }
            if verbose {
                let text = law.effect.formula.as_ref().map_or("", |f| f.text());
                println!(
                    "{seed} {:?}: {text} {:?}, off {off:.4}, odds {:.1e}",
                    listed.0, law.effect.channels, law.odds
                );
            }
        }
    }
    count
}

/// Two-sided 95 % limits of a part (Clopper and Pearson).
fn limits(count: usize, of: usize) -> String {
    let (a, n) = (count as f64, of as f64);
    let at = |a: f64, b: f64, p: f64| Beta::new(a, b).unwrap().inverse_cdf(p);
    let low = if count == 0 {
        0.0
    } else {
        at(a, n - a + 1.0, 0.025)
    };
    let high = if count == of {
        1.0
    } else {
        at(a + 1.0, n - a, 0.975)
    };
    format!(
        "{count} of {of} ({:.1} to {:.1} %)",
        100.0 * low,
        100.0 * high
    )
}

fn table<M: FittedModel + 'static>(
    name: &str,
    listed: &[Listed],
    (cases, first): (u64, u64),
    noise: f64,
    make: &(dyn Fn(u64) -> M + Sync),
) -> Count {
    let mut whole = Count::default();
    for (k, law) in listed.iter().enumerate() {
        let all: Vec<Count> = (0..cases)
            .into_par_iter()
            .map(|case| {
                let seed = first * 100_000 + k as u64 * 1000 + case;
                self::case(&make(seed), noise, law, seed)
            })
            .collect();
        let sum = all.iter().fold(Count::default(), |a, b| Count {
            cases: a.cases + b.cases,
            unknown: a.unknown + b.unknown,
            told: a.told + b.told,
            class: a.class + b.class,
            exact: a.exact + b.exact,
            sizes: a.sizes + b.sizes,
            inside: a.inside + b.inside,
        });
        let terms: Vec<String> = law
            .0
            .iter()
            .map(|(f, along)| format!("{f} {along}"))
            .collect();
        println!(
            "| {name} | {} | {} | {} | {} | {} | {} |",
            terms.join(" + "),
            sum.cases,
            sum.unknown,
            sum.told,
            sum.class,
            sum.exact
        );
        whole.cases += sum.cases;
        whole.unknown += sum.unknown;
        whole.told += sum.told;
        whole.class += sum.class;
        whole.exact += sum.exact;
        whole.sizes += sum.sizes;
        whole.inside += sum.inside;
    }
    whole
}

/// A gap that is no law of the grammar: a Gaussian process or a bump along one coordinate, each channel with a weight
/// of chance or all alike.
fn no_law<M: FittedModel + 'static>(model: &M, random: &mut ChaCha8Rng) -> DVector<f64> {
    let places = circumstances(model);
    let along = random.random_range(0..3);
    let bump = random.random::<f64>() < 0.25;
    let alike = random.random::<bool>();
    let channels = places.iter().map(|a| a.c).max().unwrap_or(0) + 1;
    let normal = |random: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(random) };
    let weights: Vec<f64> = (0..channels)
        .map(|_| if alike { 1.0 } else { normal(random) })
        .collect();
    let length = 0.04 * (1.0f64 / 0.04).powf(random.random::<f64>());
    let centre = random.random::<f64>();
    let waves: Vec<(f64, f64)> = (0..32)
        .map(|_| (normal(random) / length, TAU * random.random::<f64>()))
        .collect();
    DVector::from_iterator(
        places.len(),
        places.iter().map(|a| {
            let u = [a.x, a.t, 0.5 * (1.0 + a.r)][along];
            let value: f64 = if bump {
                (-((u - centre) / (0.3 * length)).powi(2)).exp()
            } else {
                waves.iter().map(|(w, phase)| (w * u + phase).cos()).sum()
            };
            value * weights[a.c]
        }),
    )
}

/// How many gaps that are no law are told as one.
fn false_laws<M: FittedModel + 'static>(
    name: &str,
    (cases, first): (u64, u64),
    noise: f64,
    make: &(dyn Fn(u64) -> M + Sync),
    smooth: bool,
) {
    let one = |case: u64| {
        let seed = first * 100_000 + 50_000 + case;
        let base = make(seed);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        if !smooth {
            return sought(&base, true);
        }
        let absorbed = Absorbed::of(&base);
        // A narrow bump between two loads is none.
        let mut raw = no_law(&base, &mut random);
        while absorbed.left(&raw).norm() < 1e-6 {
            raw = no_law(&base, &mut random);
        }
        let change = scaled(&raw, &absorbed, noise, drawn_size(SEEN_SMOOTH, &mut random));
        sought(&base.refit(base.observed() + change), false)
    };
    let all: Vec<Outcome> = (0..cases).into_par_iter().map(one).collect();
    let told = all.iter().filter(|o| matches!(o, Outcome::Told(_))).count();
    let asked = all
        .iter()
        .filter(|o| !matches!(o, Outcome::NotUnknown))
        .count();
    if std::env::var_os("ERRSEP_CASES").is_some() {
        for outcome in &all {
            match outcome {
                Outcome::Told(law) => println!(
                    "false: {:?} {:.1e} {:?}",
                    law.effect.formula, law.odds, law.rms
                ),
                Outcome::NoLaw(why) => println!("{why}"),
                Outcome::NotUnknown => {}
            }
        }
    }
    println!(
        "{name}: {cases} campaigns, {asked} asked, false laws {}",
        limits(told, cases as usize)
    );
}

/// A reversal set up with tilts of this size, rad.
fn set_up(seed: u64, tilt: f64) -> Linearised {
    let observations = scene::scene(seed, tilt).measured(seed);
    Linearised::new(&observations, Assumptions::default()).unwrap()
}

fn reversal(seed: u64) -> Linearised {
    set_up(seed, 20e-6)
}

/// Of readings that are large beside what an indicator may be off by.
fn steep(seed: u64) -> Linearised {
    set_up(seed, 400e-6)
}

fn line(seed: u64) -> CalibrationLine {
    calibration_line_made(&[], seed, 1.0)
}

fn circle(seed: u64) -> CirclePoints {
    circle_made(&[], seed, 1.0)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, usual: u64| {
        arguments
            .get(k)
            .and_then(|a| a.parse().ok())
            .unwrap_or(usual)
    };
    let size = (number(0, 5), number(1, 1));
    let what = arguments.get(2).map(String::as_str);
    let wanted = |name: &str| what.is_none_or(|w| w == name);
    println!("{} cases, seed {}", size.0, size.1);
    // Standard deviation of one reading as the makers have it.
    let noise = [0.05, 1e-3, 1.0];
    if wanted("laws") {
        println!("| model | law | cases | `unknown` | told | right class | exact |");
        println!("|---|---|---|---|---|---|---|");
        let counts = [
            table("reversal", &REVERSAL, size, noise[0], &reversal),
            table("reversal, steep", &READING, size, noise[0], &steep),
            table("calibration line", &LINE, size, noise[1], &line),
            table("circle", &CIRCLE, size, noise[2], &circle),
        ];
        let sum = |of: fn(&Count) -> usize| counts.iter().map(of).sum::<usize>();
        println!(
            "\nexact {}, of those told {}",
            limits(sum(|c| c.exact), sum(|c| c.cases)),
            limits(sum(|c| c.exact), sum(|c| c.told))
        );
        println!(
            "periods, constants and origins within 1.96 standard uncertainties: {}",
            limits(sum(|c| c.inside), sum(|c| c.sizes))
        );
    }
    for (smooth, name) in [(false, "nulls"), (true, "smooth")] {
        if wanted(name) {
            false_laws(
                &format!("{name}, reversal"),
                size,
                noise[0],
                &reversal,
                smooth,
            );
            false_laws(
                &format!("{name}, calibration line"),
                size,
                noise[1],
                &line,
                smooth,
            );
            false_laws(&format!("{name}, circle"), size, noise[2], &circle, smooth);
        }
    }
}
