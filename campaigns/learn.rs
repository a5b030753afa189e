//! What nobody listed, learnt from one campaign and tested on another: `cargo run --release -p errsep-campaigns --bin
//! learn -- CASES SEED [MODEL]`. Smooth effects by formulas of its own, bound to position, direction,
//! reading and time, are put into campaigns of every model; what the catalogue names is withheld until the
//! verdict is `unknown`. Told is how often the gap of the second campaign closes (held-out, after at most 1.2
//! floors), how often what is not smooth is refused, and what learning makes of campaigns without any effect.

#[path = "../tests/other_models/mod.rs"]
mod other_models;
#[path = "../tests/scene/mod.rs"]
mod scene;

use errsep::diagnosis::{Kind, Options, Seen, Tabulated, diagnose_with, learn, tested};
use errsep_models::model::{FittedModel, Place};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use nalgebra::DVector;
use other_models::{
    calibration_line_made, circle_made, four_sensor_made, fourier_made, machine_made,
    step_diagonal_made,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// What is put in: a function of one coordinate over its range, 0 to 1.
#[derive(Clone, Copy, PartialEq)]
enum Bound {
    Position,
    Direction,
    Reading,
    Time,
    Step,
    Cycle,
}

/// Models of which the whole catalogue is sought through; of the others all of it is withheld, for its time.
const QUICK: [&str; 3] = [
    "calibration line",
    "circle",
    "machine against measured parts",
];

/// Smooth ones, and what no smooth curve resolves.
const SMOOTH: [Bound; 4] = [
    Bound::Position,
    Bound::Direction,
    Bound::Reading,
    Bound::Time,
];
const ROUGH: [Bound; 2] = [Bound::Step, Bound::Cycle];

impl Bound {
    fn name(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::Direction => "position and direction",
            Self::Reading => "reading",
            Self::Time => "time",
            Self::Step => "step",
            Self::Cycle => "cycle near the spacing",
        }
    }

    /// The coordinate of a reading, 0 to 1; nothing where a model has none.
    fn of(self, ranges: &[[f64; 2]; 3], place: &Place, reading: f64) -> f64 {
        let part = |k: usize, value: f64| (value - ranges[k][0]) / (ranges[k][1] - ranges[k][0]);
        match self {
            Self::Reading => part(1, reading),
            Self::Time => part(2, place.time),
            _ => part(0, place.x),
        }
    }
}

/// A formula that is in no catalogue, with the values drawn for one machine.
#[derive(Clone)]
struct Formula {
    bound: Bound,
    size: f64,
    values: [f64; 4],
    weights: Vec<f64>,
    ranges: [[f64; 2]; 3],
    spacing: f64,
}

impl Formula {
    fn drawn<M: FittedModel + 'static>(model: &M, bound: Bound, random: &mut ChaCha8Rng) -> Self {
        let range = |value: &dyn Fn(usize) -> f64| {
            let all = (0..model.places().len()).map(value);
            let low = all.clone().fold(f64::INFINITY, f64::min);
            [low, all.fold(f64::NEG_INFINITY, f64::max)]
        };
        let places = model.places();
        let ranges = [
            range(&|k| places[k].x),
            range(&|k| model.observed()[k]),
            range(&|k| places[k].time),
        ];
        let mut x: Vec<f64> = places.iter().map(|p| p.x).collect();
        x.sort_by(f64::total_cmp);
        x.dedup_by(|a, b| (*a - *b).abs() < 1e-9 * (ranges[0][1] - ranges[0][0]));
        let alike = random.random::<f64>() < 0.5;
        let weights = (0..model.channel_names().len())
            .map(|_| {
                let own = 2.0 * random.random::<f64>() - 1.0;
                if alike { 1.0 } else { own }
            })
            .collect();
        Self {
            bound,
            size: 3.0 * (8.0f64).powf(random.random::<f64>()),
            values: [0; 4].map(|_| random.random::<f64>()),
            weights,
            ranges,
            spacing: 1.0 / (x.len().max(2) - 1) as f64,
        }
    }

    /// The change of a reading in units of the noise.
    fn at(&self, place: &Place, reading: f64) -> f64 {
        let u = self.bound.of(&self.ranges, place, reading);
        let [a, b, c, d] = self.values;
        let value = match self.bound {
            Bound::Position => (2.0 * (u - a)).sinh().sin() * (1.0 + b * u) + c * (4.0 * u).cos(),
            Bound::Direction if place.direction > 0.0 => (6.0 * u * (0.5 + a)).sin() * u,
            Bound::Direction => b * (1.0 - u) * (1.0 - u) * (5.0 * u).cos(),
            Bound::Reading => ((5.0 + 3.0 * a) * (u - 0.3 - 0.4 * b)).tanh() + c * (7.0 * u).sin(),
            Bound::Time => {
                (3.0 + 6.0 * a) * u.powf(1.5 + b) * (-(2.0 + 4.0 * c) * u).exp() * (2.0 + d)
            }
            Bound::Step => f64::from(u8::from(u > 0.3 + 0.4 * a)),
            Bound::Cycle => (std::f64::consts::TAU * u / (self.spacing * (2.3 + a))).sin(),
        };
        self.size * value * self.weights.get(place.channel).copied().unwrap_or(1.0)
    }
}

/// A campaign with an effect laid over its readings.
fn with<M: FittedModel + 'static>(model: &M, noise: f64, formula: &Formula) -> M {
    let readings = model.observed();
    let change = DVector::from_fn(readings.len(), |k, _| {
        noise * formula.at(&model.places()[k], readings[k])
    });
    model.refit(readings + change)
}

#[derive(Default, Clone, Copy)]
struct Count {
    cases: usize,
    unknown: usize,
    learnt: usize,
    right: usize,
    closed: usize,
    as_learnt: usize,
    named: usize,
}

impl Count {
    fn plus(self, o: Self) -> Self {
        Self {
            cases: self.cases + o.cases,
            unknown: self.unknown + o.unknown,
            learnt: self.learnt + o.learnt,
            right: self.right + o.right,
            closed: self.closed + o.closed,
            as_learnt: self.as_learnt + o.as_learnt,
            named: self.named + o.named,
        }
    }
}

fn one<M: FittedModel + 'static>(
    make: &(dyn Fn(u64, u64) -> M + Sync),
    bound: Bound,
    seed: u64,
) -> Count {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut count = Count {
        cases: 1,
        ..Count::default()
    };
    let base = make(seed, 1);
    let mut options = Options {
        draws: 200,
        ..Options::default()
    };
    let noise = diagnose_with(&base, Vec::new(), &options).gap.noise;
    let formula = Formula::drawn(&base, bound, &mut random);
    let first = with(&base, noise, &formula);
    let bare = !QUICK.contains(&first.name());
    for _ in 0..6 {
        let catalogue = if bare { Vec::new() } else { first.effects() };
        let found = diagnose_with(&first, catalogue, &options);
        match found.verdict.kind {
            Kind::None => return count,
            Kind::Unknown => {
                count.unknown = 1;
                break;
            }
            Kind::Effect => {
                let own = found.verdict.causes().concat();
                options.without.extend(own.iter().map(|s| (*s).to_owned()));
            }
        }
    }
    let found = learn(&first, &options);
    if let (Err(why), Some(_)) = (&found, std::env::var_os("ERRSEP_CASES")) {
        println!("{} {seed} {}: {why:?}", first.name(), bound.name());
    }
    let Some(learnt) = found.ok().filter(|_| count.unknown == 1) else {
        return count;
    };
    count.learnt = 1;
    let along = learnt.along.split(',').next().unwrap_or_default();
    count.right = usize::from(along == bound.name());
    let second = with(&make(seed, 2), noise, &formula);
    let effect = Tabulated {
        seen: Some(Seen {
            model: first.name().to_owned(),
            file: String::new(),
            sha256: String::new(),
            channels: Vec::new(),
            repeats: Vec::new(),
            date: String::new(),
        }),
        ..learnt.effect
    };
    let Some(test) = tested(&second, &effect, &options) else {
        return count;
    };
    let closed = test.held_out.is_some_and(|h| h.after <= 1.2 * h.floor);
    count.closed = usize::from(closed);
    count.as_learnt = usize::from(test.after.ci95[0] == 0.0);
    let mut catalogue = if bare { Vec::new() } else { second.effects() };
    catalogue.push(Box::new(effect));
    let told = diagnose_with(&second, catalogue, &options);
    count.named = usize::from(told.verdict.effects == ["learnt"]);
    if std::env::var_os("ERRSEP_CASES").is_some() {
        println!("{:?}", learnt.ways);
        println!(
            "{} {seed} {}: {} | held-out {:?} | {:?} -> {:?} size {:.3} ± {:.3} explained {:.3} chance {:.3} p {:.4} | {:?} {:?}",
            first.name(),
            bound.name(),
            learnt.along,
            test.held_out,
            test.before,
            test.after,
            test.size,
            test.size_std,
            test.explained,
            test.by_chance,
            test.p_value,
            told.verdict.kind,
            told.verdict.effects
        );
    }
    count
}

fn table<M: FittedModel + 'static>(
    name: &str,
    chosen: Option<&String>,
    (cases, first): (u64, u64),
    make: &(dyn Fn(u64, u64) -> M + Sync),
) {
    if chosen.is_some_and(|c| c != name) {
        return;
    }
    println!("\n### {name}\n");
    println!(
        "| put in | cases | `unknown` | learnt | bound to that | closed | as learnt | named alone |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for bound in SMOOTH.into_iter().chain(ROUGH) {
        let turns = make(1, 1).places().iter().any(|p| p.direction < 0.0);
        if bound == Bound::Direction && !turns {
            continue;
        }
        let all = (0..cases)
            .into_par_iter()
            .map(|k| one(make, bound, first * 1000 + k))
            .reduce(Count::default, Count::plus);
        println!(
            "| {} | {} | {} | {} | {} | {} | {} | {} |",
            bound.name(),
            all.cases,
            all.unknown,
            all.learnt,
            all.right,
            all.closed,
            all.as_learnt,
            all.named
        );
    }
    let options = Options {
        draws: 200,
        ..Options::default()
    };
    let falls: Vec<(f64, bool)> = (0..2 * cases)
        .into_par_iter()
        .map(|k| match learn(&make(first * 2000 + k, 1), &options) {
            Ok(learnt) => (learnt.fall, true),
            Err(why) => (why.fall(), false),
        })
        .collect();
    let greatest = falls.iter().map(|f| f.0).fold(f64::NEG_INFINITY, f64::max);
    println!(
        "\nForced on {} campaigns without an effect: the held-out mean square falls by at most {:.2} %, in {} by more than 2 %; {} claimed.",
        falls.len(),
        100.0 * greatest,
        falls.iter().filter(|f| f.0 > 0.02).count(),
        falls.iter().filter(|f| f.1).count()
    );
}

/// A reversal of one machine, set up anew for every campaign: tilts a twentieth of themselves away, offsets a
/// tenth.
fn reversal(seed: u64, campaign: u64) -> Linearised {
    let mut scene = scene::scene(seed, 20e-6);
    let other = scene::scene(seed * 31 + campaign, 20e-6);
    for k in 0..3 {
        scene.tilts[k] += 0.05 * other.tilts[k];
    }
    for k in 0..4 {
        scene.offsets[k] += 0.1 * other.offsets[k];
    }
    let observations = scene.measured(seed * 1000 + campaign);
    Linearised::new(&observations, Assumptions::default()).unwrap()
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, usual: u64| {
        let given = arguments.get(k).and_then(|a| a.parse().ok());
        given.unwrap_or(usual)
    };
    let (size, chosen) = ((number(0, 6), number(1, 1)), arguments.get(2));
    println!("{} cases an effect, seed {}", size.0, size.1);
    table("reversal", chosen, size, &reversal);
    let put = |seed: u64, campaign: u64| seed * 10 + campaign;
    table("calibration-line", chosen, size, &|s, c| {
        calibration_line_made(&[], put(s, c), 1.0)
    });
    table("circle", chosen, size, &|s, c| {
        circle_made(&[], put(s, c), 1.0)
    });
    table("four-sensor", chosen, size, &|s, c| {
        four_sensor_made(&[], put(s, c), 1.0)
    });
    table("fourier", chosen, size, &|s, c| {
        fourier_made(&[], put(s, c), 1.0)
    });
    table("step-diagonal", chosen, size, &|s, c| {
        step_diagonal_made(&[], put(s, c), 1.0)
    });
    table("machine", chosen, size, &|s, c| {
        machine_made(&[], put(s, c), 1.0)
    });
}
