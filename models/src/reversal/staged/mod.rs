//! The staged solution: lines, contrasts, forms from what the lines leave.
//!
//! The line of each channel gives its tilt; the contrasts of the tilts give α, β, γ; the rest of each
//! channel, freed of its tilt by shear or rotation, gives the forms. The lines are solved together with
//! free forms, so that a channel that lacks readings takes no form for slope. See
//! `docs/theory/reversal-staged.md`.

mod answers;
mod correlated;
mod designs;
mod drift;
mod estimates;
mod forms;
mod gauge;
mod grid;
mod joint;
mod line;
mod no_solution;
mod noise;
mod resample;
mod rotation;
mod tilts;
mod trace;

pub use super::Combination;
pub use estimates::ErrorEstimates;
pub use no_solution::NoSolution;
pub use noise::{Moved, Noise, NoiseSource, moved};
pub use resample::Interpolation;
pub use rotation::Removal;
pub use trace::Trace;

use super::cells::Union;
use super::convention::{Contrast, Convention};
use super::{Channel, Observations, Rounding};
use crate::noise::Law;
use designs::Designs;
use estimates::rms;
use forms::{rotated_together, sheared_together, take_tilt_out};
use gauge::LinePart;
use grid::Grid;
use joint::Joint;
use line::Line;
use rotation::{angle_of_slope, sheared};
use tilts::{Tilts, channel_lines, contrasts, solve_tilts};

/// How to solve.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Options {
    /// How the tilt is taken out; absent: whichever has the smaller estimated error (shear where its
    /// error is below a hundredth of the noise).
    pub removal: Option<Removal>,
    /// How rotated or differing grids are brought together.
    pub interpolation: Interpolation,
    /// How the slopes are read.
    pub convention: Convention,
    /// Thickness (diameter) D of the artefact, mm, if known.
    pub thickness: Option<f64>,
    /// Standard deviation of one reading, µm, if known.
    pub noise: Option<f64>,
}

/// A number with its standard uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// The estimate.
    pub value: f64,
    /// Its standard uncertainty (k = 1), from the noise of the readings.
    pub std: f64,
}

/// The line of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelLine {
    /// Which channel.
    pub channel: Channel,
    /// Readings used.
    pub readings: usize,
    /// Different positions among them.
    pub positions: usize,
    /// Tilt, the arctangent of the slope, rad.
    pub tilt: Value,
    /// Height of the line at x = 0, µm.
    pub offset: f64,
    /// Root mean square of what the line leaves, µm.
    pub rest_rms: f64,
    /// Mean of backward minus forward readings, µm, where both were taken.
    pub direction_difference: Option<f64>,
    /// Estimated errors of shear, interpolation and thickness along the channel.
    pub estimates: ErrorEstimates,
}

/// A combination of tilts that the channels determine.
#[derive(Debug, Clone, PartialEq)]
pub struct Tilt {
    /// Its name in the convention, such as `alpha` or `beta + gamma`.
    pub name: String,
    /// Its coefficients on the convention's tilts and its weights on the channels.
    pub combination: Combination,
    /// Value, rad.
    pub angle: Value,
}

/// A combination of forms that the channels determine, on the common grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Form {
    /// Its name, such as `M` or `S_A/2 - S_B/2`.
    pub name: String,
    /// Its coefficients on M, S_A, S_B and its weights on the channels.
    pub combination: Combination,
    /// Values, µm, without straight-line part: their least-squares line over the measured positions,
    /// each weighted by the width of its cell, is zero.
    pub values: Vec<f64>,
    /// Standard uncertainties, µm.
    pub std: Vec<f64>,
}

/// What the one redundancy of four channels says.
#[derive(Debug, Clone, PartialEq)]
pub struct Closure {
    /// The contrast that the convention says is zero, rad.
    pub slope: Value,
    /// Positions of the common grid that all four channels have, mm.
    pub x: Vec<f64>,
    /// (R1A + R1B − R2A − R2B)/4 there, µm, without straight-line part.
    pub profile: Vec<f64>,
    /// Its root mean square, µm.
    pub rms: f64,
    /// The root mean square that the noise alone would give, µm.
    pub expected_rms: f64,
}

/// Root mean squares over all channels of the method's estimated errors, µm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorRms {
    /// Shear instead of rotation.
    pub shear: f64,
    /// Interpolation after rotation.
    pub interpolation: f64,
    /// The source document's shear error.
    pub shear_as_printed: f64,
    /// The source document's interpolation error.
    pub interpolation_as_printed: f64,
    /// Thickness, where it is known.
    pub thickness: Option<f64>,
}

/// What the model leaves of the readings where all four channels were read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Root mean square, µm.
    pub rms: f64,
    /// Mean readings less unknowns.
    pub degrees_of_freedom: usize,
}

/// The staged solution.
#[derive(Debug, Clone, PartialEq)]
pub struct Staged {
    /// How the slopes were read.
    pub convention: Convention,
    /// How the tilt was taken out.
    pub removal: Removal,
    /// The lines, in the order of the channels.
    pub lines: Vec<ChannelLine>,
    /// The tilts or their combinations, orthogonal to each other.
    pub tilts: Vec<Tilt>,
    /// Degrees of freedom of their uncertainties, where these are not known without doubt.
    pub slope_freedom: Option<f64>,
    /// All four contrasts of the slopes; only four channels have them.
    pub contrasts: Option<[(Contrast, Value); 4]>,
    /// Positions of the forms, mm.
    pub x: Vec<f64>,
    /// Whether that grid is the traces' own, or they were interpolated onto it.
    pub one_grid: bool,
    /// The greatest height taken out of a trace, µm, where repeats stand apart that were not read at the same positions.
    pub levelled_um: Option<f64>,
    /// Measured positions at which too few channels were read to tell the forms apart: the forms' lines
    /// are zero over the others, and the tilts count from those lines.
    pub left_out: usize,
    /// The forms or their combinations.
    pub forms: Vec<Form>,
    /// The closure; only four channels have one.
    pub closure: Option<Closure>,
    /// What the model leaves.
    pub residual: Residual,
    /// The noise behind the uncertainties, and the other figures that the data give.
    pub noise: Noise,
    /// Every noise figure at hand, the one in use first.
    pub noise_figures: Vec<Noise>,
    /// How readings were rounded where that is more coarsely than they scatter: the channel of which repeats have most of it in
    /// common.
    pub rounding: Option<Rounding>,
    /// The noise of one reading that makes the means of repeats as far off as they are: its own, and what they have in common of
    /// their rounding.
    pub of_mean: Noise,
    /// The law of the noise of the mean of a channel's traces, µm², as the closure tells it, where a part is likelier to be
    /// correlated along a trace than not.
    pub correlated: Option<Law>,
}

/// The names of the forms.
pub const FORMS: [&str; 3] = ["M", "S_A", "S_B"];

const MOST: f64 = std::f64::consts::FRAC_PI_4;

/// Solves in stages.
///
/// Repeats and directions are averaged at each position; traces of different grids are interpolated
/// onto a common one, and a channel that was not read somewhere has no value there. Any subset of
/// channels is taken: the answer holds the combinations that it determines.
///
/// # Errors
/// [`NoSolution`] says what is missing.
pub fn solve(observations: &Observations, options: &Options) -> Result<Staged, NoSolution> {
    check(observations, options)?;
    let (mut traces, levelled_um) = Trace::all(observations);
    let mut drifts = drift::take_out(observations, &mut traces);
    let channels: Vec<Channel> = traces.iter().map(|t| t.channel).collect();
    let designs = Designs::of(&channels);
    let first = fit_lines(&traces)?;
    let grid = Grid::of(&traces, &designs, options.interpolation)?;
    let measured = Union::of(traces.iter().map(|t| &t.x[..]));
    let (gauge, left_out) = LinePart::gauge(&grid, measured, options.interpolation);
    let pairs = drift::opposite(&traces);
    let shared = drift::shared(observations, &traces);
    let joint =
        Joint::solve(&traces, &first, &grid, &designs, &gauge)?.sharing(&traces, &pairs, shared);
    let fits = &joint.lines;
    let estimates = estimate_errors(&traces, fits, options);
    let early_noise = noise_figures(options, &traces, None);
    let removal = options
        .removal
        .unwrap_or_else(|| choose(&estimates, early_noise.first()));
    let half = options.thickness.unwrap_or(0.0) / 2.0;
    let (removal, profiles) = match take_tilt_out(&traces, fits, removal, half) {
        Err(NoSolution::Folded { .. }) if options.removal.is_none() => (
            Removal::Shear,
            take_tilt_out(&traces, fits, Removal::Shear, half)?,
        ),
        profiles => (removal, profiles?),
    };
    let together = match removal {
        Removal::Shear => sheared_together(&grid, &joint, gauge),
        Removal::Rotation => {
            rotated_together(&grid, &designs, &profiles, gauge, options.interpolation)?
        }
    };
    let closing = (traces.len() == 4).then(|| together.closure(&designs, &joint));
    let noise_figures = noise_figures(options, &traces, closing.as_ref());
    let noise = *noise_figures.first().ok_or(NoSolution::NoReadings)?;
    let rounding = trace::rounding(observations);
    let of_mean = noise.beside(rounding.as_ref(), &traces);
    let by_closure = noise_figures
        .iter()
        .find(|n| n.source == NoiseSource::Closure);
    let correlated = match (&closing, by_closure) {
        // A closure that repeats do not explain is no noise.
        (Some((x, profile, _)), Some(told))
            if noise.source != NoiseSource::Declared && of_mean.exceeded_by(told).is_none() =>
        {
            let white = joint.slopes().diagonal() * of_mean.sigma.powi(2);
            correlated::add(&mut drifts, &traces, (x, profile), white.as_slice())
        }
        _ => None,
    };
    let known = of_mean.degrees_of_freedom.unwrap_or(f64::INFINITY);
    let sheared = sheared_slopes(&traces, &estimates);
    let tilts = Tilts::of(&joint, (of_mean.sigma, known), &drifts, &sheared);
    let lines = channel_lines(&traces, fits, estimates, &tilts);
    let forms = together.forms(&designs, &joint, of_mean.sigma);
    let contrasts = (traces.len() == 4).then(|| contrasts(&tilts));
    let closure = closing
        .zip(contrasts)
        .map(|((x, profile, unit), contrasts)| {
            let closing = options.convention.closure();
            let slope = contrasts.iter().find(|(c, _)| *c == closing);
            let expected = unit.iter().sum::<f64>() / unit.len() as f64;
            Closure {
                slope: slope.map_or(
                    Value {
                        value: 0.0,
                        std: 0.0,
                    },
                    |(_, v)| *v,
                ),
                rms: rms(&profile),
                expected_rms: of_mean.sigma * expected.sqrt(),
                x,
                profile,
            }
        });
    let mut staged = Staged {
        convention: options.convention,
        removal,
        tilts: solve_tilts(&tilts, &channels, options.convention),
        slope_freedom: Some(tilts.freedom).filter(|f| f.is_finite()),
        contrasts,
        residual: residual_freedom(closure.as_ref()),
        lines,
        one_grid: grid.one_grid,
        levelled_um,
        left_out,
        x: together.x,
        forms,
        closure,
        noise,
        noise_figures,
        rounding,
        of_mean,
        correlated,
    };
    staged.residual.rms = rms(staged.residuals().iter().flat_map(|(_, r)| r));
    Ok(staged)
}

fn check(observations: &Observations, options: &Options) -> Result<(), NoSolution> {
    if observations.readings.is_empty() {
        return Err(NoSolution::NoReadings);
    }
    let refuse = |what, value| Err(NoSolution::NotUsable { what, value });
    for r in &observations.readings {
        if !r.x.is_finite() {
            return refuse("a position", r.x);
        }
        if !r.value.is_finite() {
            return refuse("a reading", r.value);
        }
    }
    if let Some(d) = options.thickness.filter(|d| !(d.is_finite() && *d >= 0.0)) {
        return refuse("the thickness", d);
    }
    if let Some(s) = options.noise.filter(|s| !(s.is_finite() && *s > 0.0)) {
        return refuse("the noise", s);
    }
    Ok(())
}

fn fit_lines(traces: &[Trace]) -> Result<Vec<Line>, NoSolution> {
    traces
        .iter()
        .map(|t| {
            let too_few = NoSolution::TooFewPositions {
                channel: t.channel.name(),
                positions: t.x.len(),
            };
            if t.x.len() < 3 {
                return Err(too_few);
            }
            let line = Line::fit(&t.x, &t.mean, &t.count).ok_or(too_few)?;
            let tilt = angle_of_slope(line.slope);
            // Written so that a slope that overflowed is refused too.
            if tilt.abs() < MOST && line.at(0.0).is_finite() {
                Ok(line)
            } else {
                Err(NoSolution::TooSteep {
                    channel: t.channel.name(),
                    degrees: tilt.to_degrees(),
                })
            }
        })
        .collect()
}

fn estimate_errors(traces: &[Trace], lines: &[Line], options: &Options) -> Vec<ErrorEstimates> {
    traces
        .iter()
        .zip(lines)
        .map(|(t, line)| {
            let (x, rest) = sheared(t, line);
            ErrorEstimates::of(&x, &rest, line, options.thickness, options.interpolation)
        })
        .collect()
}

/// The slope of the estimated shear error of each channel, µm/mm: a line fitted to readings that are not rotated holds it,
/// whatever is done to the forms.
fn sheared_slopes(traces: &[Trace], estimates: &[ErrorEstimates]) -> Vec<f64> {
    let of = |(trace, own): (&Trace, &ErrorEstimates)| {
        Line::fit(&trace.x, &own.shear, &trace.count).map_or(0.0, |line| line.slope)
    };
    traces.iter().zip(estimates).map(of).collect()
}

/// A shear error below this share of the noise is not worth an interpolation.
const NEGLIGIBLE: f64 = 0.01;

/// The removal whose estimated error is smaller, root mean square over all channels; the simpler
/// shear where its error is lost in the noise.
fn choose(estimates: &[ErrorEstimates], noise: Option<&Noise>) -> Removal {
    let shear = rms(estimates.iter().flat_map(|e| &e.shear));
    let interpolation = rms(estimates.iter().flat_map(|e| &e.interpolation));
    let lost = noise.map_or(0.0, |n| NEGLIGIBLE * n.sigma);
    if interpolation < shear && shear > lost {
        Removal::Rotation
    } else {
        Removal::Shear
    }
}

fn noise_figures(
    options: &Options,
    traces: &[Trace],
    closure: Option<&(Vec<f64>, Vec<f64>, Vec<f64>)>,
) -> Vec<Noise> {
    let declared = options.noise.map(|sigma| Noise {
        sigma,
        source: NoiseSource::Declared,
        degrees_of_freedom: None,
    });
    [
        declared,
        noise::from_repeats(traces),
        closure.and_then(|(_, profile, unit)| noise::from_closure(profile, unit)),
        noise::from_neighbours(traces),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Four channels at the n positions that all of them have: 4 n mean readings; 4 offsets, 3 tilts and 3
/// forms of n values less line each. A position that one of them lacks, and fewer channels, leave
/// nothing.
fn residual_freedom(closure: Option<&Closure>) -> Residual {
    Residual {
        rms: 0.0,
        degrees_of_freedom: closure.map_or(0, |c| c.x.len().saturating_sub(1)),
    }
}
