//! What a named effect is worth: `cargo run --release -p errsep-campaigns --bin severity -- CASES SEED [MODEL…]
//! [other-formulas] [agreement]`, of every model or those named, with this project's own shapes or, of three models, with
//! those of other formulas. For each effect at four times the size that is seen with 80 %: how often it is named, and
//! strong, and whether these data could tell it there from every other effect that they show; with it withheld at 1.5 to
//! 4 times: how often another is named, and strong, and how often that is one which these data could have told from the
//! withheld one at its size. Where asked, how often score stage and whole diagnosis agree on rivals.

mod makers;
#[path = "../../tests/other_models/mod.rs"]
mod other_models;

use std::collections::BTreeMap;

use errsep::diagnosis::{
    Agreement, Confidence, Diagnosability, Diagnosis, NoiseLaw, NoiseSource, Options, agreement,
    certificate,
};
use errsep_models::model::{AnyModel, FittedModel};
use other_models::{MAKERS, Maker, judged, seen_from};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Rivals of each family that are named in both ways, for one measurement.
const EACH: usize = 8;
/// Quantile of the normal law: two effects are told apart with 99 %.
const TELL: f64 = 2.326;

/// Whether an effect in place of another, at a multiple of the latter's smallest size seen, can be told
/// from it.
type Told = Box<dyn Fn(&str, &str, f64) -> bool + Sync>;

/// Makers of three models whose shapes follow other formulas than the signatures.
const OTHER_FORMULAS: [Maker; 3] = [
    Maker {
        model: "circle",
        effects: &["lobes", "outlier", "ovality", "scale-mismatch"],
        made: |put, seed| AnyModel::new(&makers::circle(put, seed)),
        noise: makers::CIRCLE_NOISE,
    },
    Maker {
        model: "four-sensor",
        effects: &["drift", "gain", "sensor-position"],
        made: |put, seed| AnyModel::new(&makers::four_sensor(put, seed)),
        noise: makers::SENSOR_NOISE,
    },
    Maker {
        model: "step-diagonal",
        effects: &["angular-error", "drift", "mirror-misalignment"],
        made: |put, seed| AnyModel::new(&makers::step_diagonal(put, seed)),
        noise: makers::LASER_NOISE,
    },
];

fn options(without: &[&str], severity: usize) -> Options {
    Options {
        draws: 400,
        without: without.iter().map(|s| (*s).to_owned()).collect(),
        severity,
        ..Options::default()
    }
}

/// What the certificate of a measurement says of two effects: with the visible length |Ê| in units of the
/// noise they are told apart with 99 % from |Ê| sin θ/2 = 2.33 on, θ the angle between them. An effect that
/// could only imitate the other at a size that is not plausible is told from it.
fn told_by(model: &AnyModel, noise: f64) -> Told {
    let law = NoiseLaw::white(noise, f64::INFINITY, NoiseSource::Stated);
    let rows = certificate(model, model.effects(), &law, &options(&[], 0));
    let readings = model.places().len() as f64;
    let cosine = move |of: &Diagnosability, other: &str| {
        let rival = of.rivals.iter().find(|(name, _)| name == other);
        rival.map_or(0.0, |(_, cosine)| *cosine)
    };
    Box::new(move |withheld, other, times| {
        let row = |name: &str| rows.iter().find(|row| row.effect == name);
        let (Some(own), Some(rival)) = (row(withheld), row(other)) else {
            return true;
        };
        let length = own.visible_rms.unwrap_or(0.0) * readings.sqrt() / noise * times;
        // Each at the middle of its shapes against all shapes of the other: the nearer of both.
        let nearest = cosine(own, other).max(cosine(rival, withheld));
        length * (0.5 * nearest.acos()).sin() >= TELL
    })
}

/// What came of one case.
struct Outcome {
    /// Named alone, or in its group; strong of these; another named with it withheld, strong, and the same
    /// where these data could have told that one from the withheld.
    counts: [bool; 7],
    /// Of a right name that is weak the worst rival, of a wrong name the name.
    said: Vec<String>,
}

fn strong(diagnosis: &Diagnosis) -> bool {
    let all = &diagnosis.verdict.severity;
    !all.is_empty() && all.iter().all(|s| s.confidence == Confidence::Strong)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, usual: u64| {
        let given = arguments.get(k).and_then(|a| a.parse().ok());
        given.unwrap_or(usual)
    };
    let (cases, first) = (number(0, 8), number(1, 1));
    println!("{cases} cases an effect, seed {first}");
    let words = arguments.get(2..).unwrap_or_default();
    let asked = |what: &str| words.iter().any(|word| word == what);
    let other = asked("other-formulas");
    let makers = if other {
        &OTHER_FORMULAS[..]
    } else {
        &MAKERS[..]
    };
    let named: Vec<&Maker> = makers.iter().filter(|maker| asked(maker.model)).collect();
    if named.len() + usize::from(other) + usize::from(asked("agreement")) < words.len() {
        eprintln!("{} is not all known", words.join(" "));
        std::process::exit(2);
    }
    let chosen = if named.is_empty() {
        makers.iter().collect()
    } else {
        named
    };
    for maker in chosen {
        table(maker, cases, first);
        if asked("agreement") {
            agreed(maker, cases, first);
        }
    }
}

fn outcome(maker: &Maker, effect: &str, smallest: f64, told: &Told, seed: u64) -> Outcome {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let times = 1.5 + 2.5 * random.random::<f64>();
    let seed = random.random_range(2..1_000_000);
    // Draws of their own: the same in all cases would make one law, in error by the same, of all.
    let own = |without: &[&str]| Options {
        seed,
        ..options(without, 1000)
    };
    let known = maker.diagnosed(&[(effect, 4.0 * smallest)], seed, &own(&[]));
    let hidden = maker.diagnosed(&[(effect, times * smallest)], seed, &own(&[effect]));
    let judgement = judged(&known, Some(effect));
    let (alone, grouped) = (judgement == "named alone", judgement == "in its group");
    let right = alone || grouped;
    let wrong = judged(&hidden, Some(effect)) == "another named";
    let mut causes = hidden.verdict.causes().into_iter();
    let separable = causes.any(|group| group.iter().all(|other| told(effect, other, times)));
    let mut said = Vec::new();
    for severity in known.verdict.severity.iter().filter(|_| right) {
        if severity.is_weak_by_rivals() {
            let worst = &severity.rivals[0];
            let rival = format!("{} {:.3}", worst.name, worst.probability);
            said.push(format!(
                "{effect} weak by {rival}, lower {:.3}",
                severity.lower
            ));
        } else if severity.leaves_something() {
            said.push(format!("{effect} weak by what is left"));
        } else if severity.beside_others {
            said.push(format!("{effect} weak as one of several"));
        } else if severity.jump_beside {
            said.push(format!("{effect} weak by a jump"));
        }
    }
    if wrong {
        let word = if strong(&hidden) { "strong" } else { "weak" };
        said.push(format!(
            "{effect} taken for {}, {word}",
            hidden.verdict.effects.join(" and ")
        ));
    }
    Outcome {
        counts: [
            alone,
            grouped,
            right && strong(&known),
            wrong,
            wrong && strong(&hidden),
            wrong && separable,
            wrong && separable && strong(&hidden),
        ],
        said,
    }
}

fn table(maker: &Maker, cases: u64, first: u64) {
    println!("\n### {}\n", maker.model);
    println!(
        "| effect | at four times: alone | in its group | of both strong | separable there | withheld: another named \
         | strong | another that could be told from it | strong |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let told = told_by(&(maker.made)(&[], 1), maker.noise);
    let mut sums = [0; 7];
    // Cases of what is separable, and the right and strong among them.
    let mut separable = (0, 0);
    let mut said: BTreeMap<String, usize> = BTreeMap::new();
    for effect in maker.effects {
        let smallest = seen_from(maker, effect, &options(&[], 0));
        let outcomes: Vec<Outcome> = (0..cases)
            .into_par_iter()
            .map(|case| outcome(maker, effect, smallest, &told, first * 10_000 + case))
            .collect();
        let counts: [usize; 7] =
            std::array::from_fn(|k| outcomes.iter().filter(|o| o.counts[k]).count());
        for (sum, count) in sums.iter_mut().zip(counts) {
            *sum += count;
        }
        for what in outcomes.into_iter().flat_map(|outcome| outcome.said) {
            *said.entry(what).or_default() += 1;
        }
        let mut others = maker.effects.iter().filter(|other| *other != effect);
        let apart = others.all(|other| told(effect, other, 4.0));
        if apart {
            separable.0 += cases;
            separable.1 += counts[2];
        }
        let apart = if apart { "yes" } else { "no" };
        println!("| {effect} | {} |", cells(counts, apart));
    }
    let all = cases * maker.effects.len() as u64;
    let (of, strong) = separable;
    println!(
        "| of {all} | {} |\n",
        cells(sums, &format!("{strong} of {of}"))
    );
    for (what, count) in said {
        println!("{count} {what}");
    }
}

/// The cells of a row, the separable after what was named.
fn cells(counts: [usize; 7], separable: &str) -> String {
    let counts = counts.map(|n| n.to_string());
    let (known, hidden) = counts.split_at(3);
    [&known.join(" | "), separable, &hidden.join(" | ")].join(" | ")
}

/// Score stage and whole diagnoses, on rivals of names near the limit of detection and well above.
fn agreed(maker: &Maker, cases: u64, first: u64) {
    let mut sum = Agreement::default();
    for effect in maker.effects {
        let smallest = seen_from(maker, effect, &options(&[], 0));
        for case in 0..cases.div_ceil(4) {
            let put = [(*effect, smallest * if case % 2 == 0 { 1.5 } else { 4.0 })];
            let seed = first * 40_000 + case;
            for own in agreement(&(maker.made)(&put, seed), &options(&[], 0), EACH) {
                sum.cases += own.cases;
                sum.scored += own.scored;
                sum.whole += own.whole;
                sum.both += own.both;
            }
        }
    }
    println!(
        "\nRivals named alike: {} by the score stage, {} by whole diagnoses, {} by both, of {}.",
        sum.scored, sum.whole, sum.both, sum.cases
    );
}
