//! Designs other than the four channels: effects by formulas written out here, put into readings of
//! eight channels; readings without any; four channels told by their angles.

mod indicators;
mod limits;
mod machine;

use errsep::diagnosis::{Diagnosis, Kind, Options, diagnose};
use errsep_models::reversal::Direction;
use errsep_models::reversal::designs::{Design, DesignObservations, DesignReading, Zero};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const EIGHT: &str = "0/0,90/0,180/0,270/0,0/180,90/180,180/180,270/180";
const SIXTEEN: &str = "0/0,90/0,180/0,270/0,0/90,90/90,180/90,270/90,\
                       0/180,90/180,180/180,270/180,0/270,90/270,180/270,270/270";

const TRAVEL: f64 = 300.0;
const NOISE: f64 = 0.05;

/// One reading as it is taken.
#[derive(Clone, Copy)]
struct Moment {
    /// Angles, rad.
    phi: f64,
    theta: f64,
    /// +1 forward.
    way: f64,
    x: f64,
    /// Seconds, and as a part of the whole test.
    time: f64,
    part: f64,
}

impl Moment {
    fn is_at(&self, indicator: f64, spindle: f64) -> bool {
        let degrees = |a: f64| a.to_degrees().round();
        degrees(self.phi) == indicator && degrees(self.theta) == spindle
    }

    fn indicator(&self) -> f64 {
        self.phi.to_degrees().round()
    }

    fn slope(&self) -> f64 {
        let psi = self.phi - self.theta;
        60e-6 * self.phi.cos() - 40e-6 * self.phi.sin()
            + 500e-6 * psi.cos()
            + 350e-6 * psi.sin()
            + 15e-6
    }

    fn slide(&self, x: f64) -> f64 {
        let u = x / TRAVEL;
        let horizontal = 1.5 * (5.0 * u).sin() + 0.7 * (11.0 * u + 1.0).cos();
        let vertical = 1.1 * (6.5 * u + 2.0).sin() - 0.6 * (13.0 * u).cos();
        horizontal * self.phi.cos() + vertical * self.phi.sin()
    }

    /// Form of the side seen, µm: a wave of its own for each.
    fn side(&self, x: f64) -> f64 {
        let side = (self.phi - self.theta)
            .to_degrees()
            .rem_euclid(360.0)
            .round();
        let (own, u) = (side / 90.0, x / TRAVEL);
        (1.0 + 0.2 * own) * ((7.0 + 1.7 * own) * u + own).sin() + 0.4 * ((17.0 - own) * u).cos()
    }

    /// What is seen with the slide at x, µm.
    fn seen(&self, x: f64) -> f64 {
        1e3 * self.slope() * x + self.slide(x) + self.side(x)
    }
}

/// What is put into the readings of a design.
struct Put {
    design: &'static str,
    repeats: u32,
    positions: usize,
    /// Whether the spindle is turned in every repeat.
    turning: bool,
    seed: u64,
}

const PUT: Put = Put {
    design: EIGHT,
    repeats: 3,
    positions: 60,
    turning: true,
    seed: 1,
};

impl Put {
    /// The readings, by what is shown at each moment; a trace is shown in the order in which it is read.
    fn readings(&self, show: impl Fn(&[Moment]) -> Vec<f64>) -> DesignObservations {
        let design = Design::parse(self.design).unwrap();
        let positions = design.positions();
        let mut order: Vec<(u32, f64)> = Vec::new();
        for repeat in 1..=self.repeats {
            order.extend(positions.iter().map(|p| (repeat, *p)));
        }
        if !self.turning {
            order.sort_by(|a, b| a.1.total_cmp(&b.1));
        }
        let steps = 2 * self.positions * order.len();
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut readings = Vec::new();
        for (pass, (repeat, spindle)) in order.iter().enumerate() {
            for (half, direction) in [Direction::Forward, Direction::Backward]
                .into_iter()
                .enumerate()
            {
                for (channel, own) in design.channels().iter().enumerate() {
                    if own.spindle != *spindle {
                        continue;
                    }
                    let trace: Vec<Moment> = (0..self.positions)
                        .map(|k| {
                            let step = (2 * pass + half) * self.positions + k;
                            let at = if half == 0 { k } else { self.positions - 1 - k };
                            Moment {
                                phi: own.indicator.to_radians(),
                                theta: spindle.to_radians(),
                                way: if half == 0 { 1.0 } else { -1.0 },
                                x: TRAVEL * at as f64 / (self.positions - 1) as f64,
                                time: 2.0 * step as f64,
                                part: step as f64 / steps as f64,
                            }
                        })
                        .collect();
                    for (moment, value) in trace.iter().zip(show(&trace)) {
                        let noise: f64 = StandardNormal.sample(&mut random);
                        readings.push(DesignReading {
                            channel,
                            repeat: *repeat,
                            direction,
                            time: Some(moment.time),
                            x: moment.x,
                            value: value + NOISE * noise,
                        });
                    }
                }
            }
        }
        DesignObservations { design, readings }
    }

    /// The same where each moment shows what it sees and something more.
    fn with(&self, change: impl Fn(&Moment) -> f64) -> DesignObservations {
        self.readings(|trace| trace.iter().map(|m| m.seen(m.x) + change(m)).collect())
    }
}

fn model(readings: &DesignObservations) -> Linearised {
    Linearised::of_design(readings, Zero::Reset, None, Assumptions::default()).unwrap()
}

fn diagnosed(readings: &DesignObservations) -> Diagnosis {
    let options = Options {
        draws: 200,
        ..Options::default()
    };
    diagnose(&model(readings), &options)
}

/// That the effect is named, alone or in a group of its kind.
fn named(effect: &str, readings: &DesignObservations) -> Diagnosis {
    let diagnosis = diagnosed(readings);
    let verdict = &diagnosis.verdict;
    assert_eq!(
        verdict.kind,
        Kind::Effect,
        "{effect}: {}",
        verdict.statement
    );
    let groups = verdict.indistinguishable.iter().flatten();
    let found = verdict
        .effects
        .iter()
        .chain(groups)
        .any(|name| name == effect);
    assert!(found, "{effect}: {}", verdict.statement);
    diagnosis
}

/// Size and standard uncertainty of a parameter of a candidate.
fn size(diagnosis: &Diagnosis, effect: &str, parameter: &str) -> (f64, f64) {
    let own = diagnosis
        .candidates
        .iter()
        .find(|c| c.effect == effect)
        .unwrap();
    let found = own.parameters.iter().find(|p| p.name == parameter);
    let found = found.unwrap_or_else(|| panic!("{parameter} of {:?}", own.parameters));
    (found.value, found.std)
}
