//! Scans of a known workpiece on a known slide: the simulation of the paper's section 2.2, with tilt,
//! height difference and noise.

use super::scan::{FourierError, Scan, ScanReading};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use realfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// What to simulate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FourierSimulation {
    /// Section L, mm.
    pub length: f64,
    /// Grid points on the section.
    pub samples: usize,
    /// Probe spacings d, mm, one scan each and per repeat.
    pub spacings: Vec<f64>,
    /// Repeats of each spacing.
    pub repeats: u32,
    /// Orders in workpiece and slide: 7 e^{−0.12 ω} and 5 e^{−0.08 ω} µm with phases of the seed.
    pub orders: usize,
    /// Slope of the workpiece, µm per radian of θ (0.2 in the paper).
    pub slope: f64,
    /// Step of the workpiece, µm, and its position, mm (40 µm at 105 mm in the paper).
    pub step: (f64, f64),
    /// A2 − A3, µm.
    pub height_difference: f64,
    /// Rise of the slide over the section, µm; zero is the condition of equation (20).
    pub slide_rise: f64,
    /// Standard deviation of each reading, µm.
    pub noise: f64,
    /// Whether there is a third probe.
    pub third_probe: bool,
}

impl Default for FourierSimulation {
    fn default() -> Self {
        Self {
            length: 100.0,
            samples: 1000,
            spacings: vec![48.5, 34.1, 78.6],
            repeats: 1,
            orders: 30,
            slope: 0.2,
            step: (40.0, 105.0),
            height_difference: 0.0,
            slide_rise: 0.0,
            noise: 2.0,
            third_probe: true,
        }
    }
}

/// What the scans were made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FourierTruth {
    /// Positions on the section, mm.
    pub x: Vec<f64>,
    /// Workpiece there, µm.
    pub workpiece: Vec<f64>,
    /// Slide there, µm.
    pub slide: Vec<f64>,
}

/// What disturbs the scans beside noise, in exact form; a spacing is given by its place in the list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Disturbance {
    /// P3 stands higher in the scans of one spacing.
    HeightDifference {
        /// Place of the spacing.
        spacing: usize,
        /// Height, µm.
        height: f64,
    },
    /// P2 and P3 stand further from P1 than the spacing says.
    ProbeSpacing {
        /// Place of the spacing.
        spacing: usize,
        /// Error, mm.
        error: f64,
    },
    /// The slide turns by a sine over the section, rad.
    Yaw(f64),
    /// P1 settles by so much over all scans, µm, with a time constant of 0.15 of them; the zero of each
    /// scan stays in it.
    Drift(f64),
    /// The zero of P1 jumps by so much in the middle of the last scan, µm.
    ZeroJump(f64),
    /// The slide travels too far by this share.
    TravelScale(f64),
    /// The workpiece bends by so much over all scans, µm.
    ThermalBending(f64),
    /// P2 reads too much by this share.
    Gain(f64),
    /// P2 reads too much by this at its greatest reading of all scans, µm, and in proportion to the square of it elsewhere.
    Nonlinearity(f64),
    /// The workpiece steps up by so much behind the section, µm, a twentieth of it past its end.
    BeyondTheSection(f64),
}

impl Disturbance {
    /// The names that [`Self::named`] knows.
    pub const NAMES: [&'static str; 10] = [
        "beyond-the-section",
        "drift",
        "gain",
        "height-difference",
        "nonlinearity",
        "probe-spacing",
        "thermal-bending",
        "travel-scale",
        "yaw",
        "zero-jump",
    ];

    /// A disturbance by the name of its effect and its size, µm, mm, rad or a share; those of one spacing are
    /// given to the last.
    pub fn named(name: &str, size: f64, spacings: usize) -> Option<Self> {
        let spacing = spacings.saturating_sub(1);
        Some(match name {
            "height-difference" => Self::HeightDifference {
                spacing,
                height: size,
            },
            "probe-spacing" => Self::ProbeSpacing {
                spacing,
                error: size,
            },
            "yaw" => Self::Yaw(size),
            "drift" => Self::Drift(size),
            "zero-jump" => Self::ZeroJump(size),
            "travel-scale" => Self::TravelScale(size),
            "thermal-bending" => Self::ThermalBending(size),
            "gain" => Self::Gain(size),
            "nonlinearity" => Self::Nonlinearity(size),
            "beyond-the-section" => Self::BeyondTheSection(size),
            _ => return None,
        })
    }
}

/// What disturbs one scan.
#[derive(Default)]
struct Here {
    height: f64,
    error: f64,
    yaw: f64,
    drift: f64,
    jump: f64,
    scale: f64,
    bending: f64,
    gain: f64,
    step: f64,
}

impl Here {
    /// Of the scans of a spacing; the last of all is one that may jump.
    fn of(disturbances: &[Disturbance], place: usize, is_last: bool) -> Self {
        let mut here = Self::default();
        for disturbance in disturbances {
            match *disturbance {
                Disturbance::HeightDifference { spacing, height } if spacing == place => {
                    here.height += height;
                }
                Disturbance::ProbeSpacing { spacing, error } if spacing == place => {
                    here.error += error;
                }
                Disturbance::HeightDifference { .. } | Disturbance::ProbeSpacing { .. } => {}
                Disturbance::Yaw(angle) => here.yaw += angle,
                Disturbance::Drift(size) => here.drift += size,
                Disturbance::ZeroJump(size) if is_last => here.jump += size,
                Disturbance::ZeroJump(_) => {}
                Disturbance::TravelScale(share) => here.scale += share,
                Disturbance::ThermalBending(size) => here.bending += size,
                Disturbance::Gain(share) => here.gain += share,
                Disturbance::BeyondTheSection(size) => here.step += size,
                // Of the readings of all scans, afterwards.
                Disturbance::Nonlinearity(_) => {}
            }
        }
        here
    }
}

/// Σ a_ω cos(ωθ + φ_ω) = Re Σ c_ω z^ω with z = e^{jθ}.
struct Waves {
    coefficients: Vec<Complex64>,
}

impl Waves {
    fn draw(rng: &mut ChaCha8Rng, orders: usize, first: f64, decay: f64) -> Self {
        let coefficients = (1..=orders)
            .map(|w| {
                let amplitude = first * (-decay * w as f64).exp();
                Complex64::from_polar(amplitude, rng.random_range(0.0..TAU))
            })
            .collect();
        Self { coefficients }
    }

    fn at(&self, theta: f64) -> f64 {
        let z = Complex64::from_polar(1.0, theta);
        let sum = self
            .coefficients
            .iter()
            .rev()
            .fold(Complex64::default(), |sum, c| (sum + c) * z);
        sum.re
    }
}

/// The scans of one seed and what they were made of.
///
/// # Errors
/// [`FourierError::Spacing`] and [`FourierError::Simulation`] for figures that make no sense.
pub fn simulate(
    what: &FourierSimulation,
    seed: u64,
) -> Result<(Vec<Scan>, FourierTruth), FourierError> {
    simulate_disturbed(what, &[], seed)
}

/// The scans of one seed with disturbances.
///
/// # Errors
/// Those of [`simulate`].
pub fn simulate_disturbed(
    what: &FourierSimulation,
    disturbances: &[Disturbance],
    seed: u64,
) -> Result<(Vec<Scan>, FourierTruth), FourierError> {
    let length = what.length;
    if what.samples < 3 || what.spacings.is_empty() {
        return Err(FourierError::Simulation {
            what: "a simulation needs at least three samples and one spacing".to_owned(),
        });
    }
    let figures = [
        length,
        what.slope,
        what.step.0,
        what.step.1,
        what.height_difference,
        what.slide_rise,
        what.noise,
    ];
    if figures.iter().any(|v| !v.is_finite()) || what.noise < 0.0 {
        return Err(FourierError::Simulation {
            what: "the figures of a simulation must be finite, its noise not negative".to_owned(),
        });
    }
    let normal = Normal::new(0.0, what.noise).map_err(|e| FourierError::Simulation {
        what: format!("the noise cannot be drawn: {e}"),
    })?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let workpiece_waves = Waves::draw(&mut rng, what.orders, 7.0, 0.12);
    let slide_waves = Waves::draw(&mut rng, what.orders, 5.0, 0.08);
    let workpiece = |x: f64| {
        let theta = TAU * x / length;
        let step = if x >= what.step.1 { what.step.0 } else { 0.0 };
        workpiece_waves.at(theta) + what.slope * theta + step
    };
    let slide = |x: f64| slide_waves.at(TAU * x / length) + what.slide_rise * x / length;
    let grid = |i: usize| length * i as f64 / what.samples as f64;
    let truth = FourierTruth {
        x: (0..what.samples).map(grid).collect(),
        workpiece: (0..what.samples).map(|i| workpiece(grid(i))).collect(),
        slide: (0..what.samples).map(|i| slide(grid(i))).collect(),
    };
    let runs = what.repeats.max(1) as usize * what.spacings.len();
    let mut scans = Vec::new();
    for repeat in 1..=what.repeats.max(1) {
        for (place, &spacing) in what.spacings.iter().enumerate() {
            if !(spacing > 0.0 && spacing < length) {
                return Err(FourierError::Spacing { spacing, length });
            }
            let joint = length - spacing;
            // The scans of one spacing are taken in one go.
            let run = place * what.repeats.max(1) as usize + repeat as usize - 1;
            let here = Here::of(disturbances, place, run + 1 == runs);
            // A probe at an arm along the slide rises by the arm times the tangent of the angle.
            let lift =
                |x: f64, arm: f64| 1e3 * arm * (here.yaw * (TAU * x / length + 0.7).sin()).tan();
            // One step before the joint, so that it can be interpolated where it is off the grid.
            let third_from = joint - 1.5 * length / what.samples as f64;
            let readings = (0..=what.samples)
                .map(|i| {
                    let x = grid(i);
                    let moment = (run as f64 + i as f64 / what.samples as f64) / runs as f64;
                    let stands = x * (1.0 + here.scale);
                    let probed = |at: f64| {
                        let u = at.rem_euclid(length) / length;
                        let step = if at >= 1.05 * length { here.step } else { 0.0 };
                        workpiece(at)
                            + step
                            + here.bending * moment * (1.0 - (2.0 * u - 1.0).powi(2))
                    };
                    let zero = here.drift * (1.0 - (-moment / 0.15).exp())
                        + if 2 * i > what.samples { here.jump } else { 0.0 };
                    let mut noise = || normal.sample(&mut rng);
                    let m1 = probed(stands) + slide(x) + zero + noise();
                    let m2 = (1.0 + here.gain)
                        * (what.height_difference
                            + probed(stands + spacing + here.error)
                            + slide(x)
                            + lift(x, spacing + here.error))
                        + noise();
                    ScanReading {
                        x,
                        m1,
                        m2: Some(m2),
                        m3: (what.third_probe && x >= third_from).then(|| {
                            probed(stands - joint + here.error)
                                + slide(x)
                                + here.height
                                + lift(x, here.error - joint)
                                + noise()
                        }),
                    }
                })
                .collect();
            scans.push(Scan {
                spacing,
                repeat,
                readings,
                filled: Vec::new(),
            });
        }
    }
    for disturbance in disturbances {
        if let Disturbance::Nonlinearity(size) = disturbance {
            bend(&mut scans, *size, what);
        }
    }
    Ok((scans, truth))
}

/// Bends the readings of P2 by so much at the greatest that stands in for the other end of the spacing, µm.
fn bend(scans: &mut [Scan], size: f64, what: &FourierSimulation) {
    let counts =
        |scan: &Scan, r: &ScanReading| !what.third_probe || r.x < what.length - scan.spacing;
    let of = |scan: &Scan| -> f64 {
        let read = scan.readings.iter().filter(|r| counts(scan, r));
        read.filter_map(|r| r.m2)
            .fold(0.0, |most, m| most.max(m.abs()))
    };
    let reach = scans.iter().map(of).fold(f64::MIN_POSITIVE, f64::max);
    let readings = scans.iter_mut().flat_map(|s| &mut s.readings);
    for m2 in readings.filter_map(|r| r.m2.as_mut()) {
        *m2 += size * (*m2 / reach).powi(2);
    }
}
