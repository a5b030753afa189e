//! What the page of a reversal is made from.

use crate::report::Standing;

/// What the page of a reversal shows. Angles are in rad, positions in mm, readings in µm; what a
/// method does not have is left empty, and its section is left out.
#[derive(Debug, Clone, Default)]
pub struct View {
    /// Name of the data.
    pub data: String,
    /// The method in words, with its options.
    pub method: String,
    /// The sentence a person acts on.
    pub summary: String,
    /// Whether the answer can be relied on.
    pub standing: Option<Standing>,
    /// The tilts that these data determine.
    pub tilts: Vec<Angle>,
    /// Effects in the fit, one row a parameter.
    pub effects: Vec<Effect>,
    /// All slope contrasts with their meaning.
    pub contrasts: Vec<Contrast>,
    /// The forms, each over its own positions.
    pub forms: Vec<Form>,
    /// Factor from a standard uncertainty to the half width of a 95 % interval; 1.96 if zero.
    pub coverage_factor: f64,
    /// Straightness of the forms.
    pub straightness: Vec<Straightness>,
    /// What is left of the readings.
    pub residuals: Vec<Residual>,
    /// Standard deviation of one reading, µm: estimated or given.
    pub noise_um: Option<f64>,
    /// Where the noise comes from, in words.
    pub noise_source: String,
    /// Noise of each channel, µm, where it was estimated separately.
    pub channel_noise: Vec<(String, f64)>,
    /// Degrees of freedom of the residuals.
    pub degrees_of_freedom: Option<usize>,
    /// The closure profile.
    pub closure: Option<Closure>,
    /// How the fit went.
    pub convergence: Option<Convergence>,
    /// How the number of knots was chosen.
    pub knots: Option<Knots>,
    /// Estimated errors of the method itself: name, RMS in µm, meaning.
    pub method_errors: Vec<(String, f64, String)>,
    /// The set-up as it was used, in the form of the set-up file.
    pub setup: String,
    /// What no such measurement can show.
    pub hidden: Vec<String>,
    /// What the channels leave open, with what to do.
    pub open: Option<String>,
    /// Anything the reader has to be careful about.
    pub warnings: Vec<String>,
}

/// An angle with its standard uncertainty, in rad.
#[derive(Debug, Clone, Default)]
pub struct Angle {
    /// `alpha`, `beta + gamma`, …
    pub name: String,
    /// Value, rad.
    pub value: f64,
    /// Standard uncertainty, rad; absent where these data give none.
    pub std: Option<f64>,
    /// What it means on the machine.
    pub meaning: String,
}

/// A parameter of an effect in the fit.
#[derive(Debug, Clone, Default)]
pub struct Effect {
    /// The effect, with its variant.
    pub effect: String,
    /// The parameter.
    pub parameter: String,
    /// Value, standard uncertainty and unit in words.
    pub value: String,
}

/// One combination of the channels' slopes.
#[derive(Debug, Clone, Default)]
pub struct Contrast {
    /// Signs of 1A, 1B, 2A, 2B, as in `+ − − +`.
    pub signs: String,
    /// Its name in the convention of the set-up, if it has one.
    pub name: String,
    /// Value, rad.
    pub value: f64,
    /// Standard uncertainty, rad.
    pub std: Option<f64>,
    /// What it means.
    pub meaning: String,
}

/// A form over its positions.
#[derive(Debug, Clone, Default)]
pub struct Form {
    /// `M`, `S_A`, `S_B`.
    pub name: String,
    /// Positions, mm.
    pub x: Vec<f64>,
    /// Deviations, µm.
    pub value: Vec<f64>,
    /// Their standard uncertainties, µm; empty where there are none.
    pub std: Vec<f64>,
}

/// Straightness of one form against the three reference lines, µm.
#[derive(Debug, Clone, Default)]
pub struct Straightness {
    /// `M`, `S_A`, `S_B`.
    pub form: String,
    /// Against the least-squares line.
    pub least_squares: f64,
    /// Against the line through the end points.
    pub end_point: f64,
    /// Against the pair of closest parallel lines.
    pub minimum_zone: f64,
}

/// What is left of one reading.
#[derive(Debug, Clone, Default)]
pub struct Residual {
    /// `1A`, `1B`, `2A` or `2B`.
    pub channel: &'static str,
    /// Number of the repeat.
    pub repeat: usize,
    /// Whether the slide moved backward.
    pub backward: bool,
    /// Position, mm.
    pub x: f64,
    /// Reading less model, µm.
    pub residual: f64,
}

/// The combination of the channels that is zero in a perfect reversal.
#[derive(Debug, Clone, Default)]
pub struct Closure {
    /// Positions, mm.
    pub x: Vec<f64>,
    /// Values, µm.
    pub value: Vec<f64>,
    /// Root mean square, µm.
    pub rms: f64,
    /// Root mean square that the noise alone would give, µm.
    pub expected_rms: Option<f64>,
}

/// How the fit went.
#[derive(Debug, Clone, Default)]
pub struct Convergence {
    /// Whether it ended at a minimum.
    pub converged: bool,
    /// Why it ended, in words.
    pub reason: String,
    /// Cost after each iteration, the start first.
    pub costs: Vec<f64>,
}

/// How the number of knots was chosen.
#[derive(Debug, Clone, Default)]
pub struct Knots {
    /// Name of the criterion.
    pub criterion: String,
    /// Numbers of intervals tried and the value of the criterion for each.
    pub tried: Vec<(usize, f64)>,
    /// The number that was used.
    pub chosen: usize,
    /// Why, in words; also whether it lies at an end of what was tried.
    pub reason: String,
}
