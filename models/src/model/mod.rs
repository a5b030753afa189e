//! What a fitted model offers to the diagnosis of its gap, whatever it is a model of.
//!
//! The diagnosis never looks inside a model. It asks for the readings with their circumstances,
//! for what the fit can absorb, for the quantities people act on, and for a catalogue of effects
//! that the model leaves out.

mod any;
mod effect;
mod moments;

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

/// Relative rounding of numbers that a calculation has gone through.
pub(crate) const ROUNDING: f64 = 1e-12;

pub use any::AnyModel;
pub(crate) use effect::amplitude;
pub(crate) use effect::each;
pub use effect::{About, Effect, Estimate, Fall, Link, Parameter, Shape};
pub(crate) use moments::Moments;

/// The circumstances of one reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Index into [`FittedModel::channel_names`].
    pub channel: usize,
    /// Position along the trace, in the unit of [`FittedModel::position_unit`].
    pub x: f64,
    /// Seconds since the first reading, measured or taken from the order of the traces.
    pub time: f64,
    /// Repeat number.
    pub repeat: u32,
    /// +1 forward, −1 backward.
    pub direction: f64,
    /// Readings in the same cell have the same expectation under the model.
    pub cell: usize,
}

/// How an error may change along a covariate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Course {
    /// By any smooth function.
    Smooth,
    /// Nothing up to some value, the same from there on.
    Step,
    /// Not at all: it is in proportion to the factors alone.
    Proportional,
}

/// Something along which an error may change.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariate {
    /// What follows "smooth in", "step in" or "proportional to".
    pub name: String,
    /// Its value for every reading.
    pub values: Vec<f64>,
    /// How the error may change along it.
    pub course: Course,
    /// What the function is multiplied by in every reading, each with a weight of its own: the parts by which errors
    /// along several axes are read. None: by one.
    pub factors: Vec<Vec<f64>>,
    /// For every reading the group whose error is of a size of its own in every channel; none: all are one group.
    pub groups: Option<Vec<usize>>,
}

/// Readings with their circumstances.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// The circumstances of every reading; the readings of one trace stand together.
    pub places: Arc<[Place]>,
    /// The traces: readings taken in one go, along which noise may be correlated.
    pub traces: Arc<[Range<usize>]>,
    /// The readings.
    pub observed: DVector<f64>,
}

impl Covariate {
    /// That of smooth functions, the same in all readings.
    pub fn smooth(name: impl Into<String>, values: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            values,
            course: Course::Smooth,
            factors: Vec::new(),
            groups: None,
        }
    }
}

impl Record {
    /// Readings in their traces.
    pub fn new(places: Vec<Place>, traces: Vec<Range<usize>>, observed: DVector<f64>) -> Self {
        Self {
            places: places.into(),
            traces: traces.into(),
            observed,
        }
    }

    /// Other values under the same circumstances.
    #[must_use]
    pub fn with(&self, observed: DVector<f64>) -> Self {
        Self {
            places: Arc::clone(&self.places),
            traces: Arc::clone(&self.traces),
            observed,
        }
    }
}

/// The greatest of what readings were computed to and what they were rounded to, by their decimals, as a standard deviation.
pub(crate) fn rounding_of(readings: &DVector<f64>) -> f64 {
    let read_to = decimal_step(readings.iter().copied()).unwrap_or(0.0);
    (ROUNDING * readings.amax()).max(read_to / 12f64.sqrt())
}

/// The power of ten of which all readings are whole multiples: what they were rounded to. `None` where they have more
/// decimals than anybody reads.
pub(crate) fn decimal_step(readings: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    /// Decimals of a reading, in its unit, at most.
    const MOST: i32 = 6;
    // A unit may have been converted, and a reading may be the difference of much greater coordinates.
    let whole = |value: f64, steps: f64| {
        let multiple = value * steps;
        (multiple - multiple.round()).abs() <= 1e-7 + 1e-13 * multiple.abs()
    };
    let steps = (0..=MOST).map(|decimals| 10f64.powi(decimals));
    let mut told = steps.filter(|steps| readings.clone().all(|value| whole(value, *steps)));
    told.next().map(|steps| 1.0 / steps)
}

/// A sparse signature: the change of each reading per unit of an amplitude.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Column {
    /// Places of the readings that change.
    pub rows: Vec<usize>,
    /// Change of the reading at each row, in the unit of the reading.
    pub values: Vec<f64>,
}

impl Column {
    /// The signature whose value at each reading is given by a function of its circumstances.
    pub fn from_places(places: &[Place], value: impl Fn(usize, &Place) -> f64) -> Self {
        let mut rows = Vec::with_capacity(places.len());
        let mut values = Vec::with_capacity(places.len());
        for (k, place) in places.iter().enumerate() {
            let change = value(k, place);
            if change != 0.0 {
                rows.push(k);
                values.push(change);
            }
        }
        Self { rows, values }
    }

    /// All readings, zeros included.
    pub fn dense(&self, readings: usize) -> DVector<f64> {
        let mut full = DVector::zeros(readings);
        for (&row, &value) in self.rows.iter().zip(&self.values) {
            full[row] = value;
        }
        full
    }
}

/// What the fit of a model can absorb: the column space of its Jacobian.
#[derive(Debug, Clone, Default)]
pub struct Freedom {
    /// Columns of the Jacobian, readings × columns; may be rank deficient.
    pub columns: DMatrix<f64>,
    /// Unknown profiles that are free at every position, where all traces share their positions.
    pub profiles: Option<Profiles>,
}

/// Unknown functions of position, each seen by the traces with fixed weights.
///
/// Trace t reads Σₖ patterns\[t, k\] · fₖ(x). The functions are free at every position except that
/// each of `withheld` names a direction which the model does not allow them.
#[derive(Debug, Clone)]
pub struct Profiles {
    /// Weights, traces × functions.
    pub patterns: DMatrix<f64>,
    /// Pairs (function, profile over the positions) that this function must not contain.
    pub withheld: Vec<(usize, DVector<f64>)>,
}

/// A number people act on, as a linear function of the readings.
#[derive(Debug, Clone)]
pub struct Quantity {
    /// Name in tables and JSON.
    pub name: String,
    /// Unit.
    pub unit: &'static str,
    /// Weight of each reading.
    pub weights: DVector<f64>,
}

/// A profile people act on, for reporting how far an effect moved it.
#[derive(Debug, Clone)]
pub struct Profile {
    /// Name in tables and JSON.
    pub name: String,
    /// Unit of the values.
    pub unit: &'static str,
    /// Positions of the values, in the unit of [`FittedModel::position_unit`].
    pub positions: Vec<f64>,
    /// Values over the positions.
    pub values: DVector<f64>,
    /// Standard deviation of a value per unit standard deviation of one reading.
    pub noise_gain: f64,
}

/// Weights over the channels that make a combination people have a name for.
#[derive(Debug, Clone)]
pub struct Pattern {
    /// Name in tables and JSON.
    pub name: String,
    /// Weight of each channel.
    pub weights: Vec<f64>,
}

/// A model fitted to readings, as the diagnosis sees it.
pub trait FittedModel: Clone + Send + Sync {
    /// Name of the model, for reports.
    fn name(&self) -> &'static str;

    /// Unit of the readings.
    fn reading_unit(&self) -> &'static str;

    /// Unit of the positions.
    fn position_unit(&self) -> &'static str {
        "mm"
    }

    /// Unit of the times: numbers of readings where none are known.
    fn time_unit(&self) -> &'static str {
        "s"
    }

    /// The readings with their circumstances.
    fn record(&self) -> &Record;

    /// The circumstances of all readings.
    fn places(&self) -> &[Place] {
        &self.record().places
    }

    /// The traces.
    fn traces(&self) -> &[Range<usize>] {
        &self.record().traces
    }

    /// The readings.
    fn observed(&self) -> &DVector<f64> {
        &self.record().observed
    }

    /// What the fitted state makes every reading, where that is smoother than the least-squares
    /// fit: a state to put known effects into, without the noise that the fit has taken up.
    fn smooth(&self) -> Option<DVector<f64>> {
        None
    }

    /// What the fit can absorb, at its optimum.
    fn freedom(&self) -> Freedom;

    /// The readings less the part of the model that is not linear in its unknowns, so that what
    /// remains is fitted by [`Self::freedom`].
    fn linearised(&self) -> DVector<f64> {
        self.observed().clone()
    }

    /// Names of the channels.
    fn channel_names(&self) -> Vec<String>;

    /// What tells the trace of a place from the others of its channel, where that is not its repeat
    /// and its direction.
    fn trace_name(&self, _place: &Place) -> Option<String> {
        None
    }

    /// Combinations of the channels to look at beside the channels themselves.
    fn patterns(&self) -> Vec<Pattern> {
        Vec::new()
    }

    /// The numbers people act on.
    fn quantities(&self) -> Vec<Quantity> {
        Vec::new()
    }

    /// The profiles people act on.
    fn profiles(&self) -> Vec<Profile> {
        Vec::new()
    }

    /// Whether noise may be correlated along a trace and shift whole traces. Where it may not, what
    /// shifts a trace is gap.
    fn correlated_noise(&self) -> bool {
        true
    }

    /// What of the catalogue jumps at some moment and stays, and is no shift of traces by their noise: of each such what
    /// it adds to all readings, readings × amplitudes.
    fn jumps(&self) -> Vec<DMatrix<f64>> {
        Vec::new()
    }

    /// Whether a single wrong reading is an effect of the catalogue, and not to be calmed as noise.
    fn names_single_readings(&self) -> bool {
        false
    }

    /// What the model itself expects readings to be off by beside their noise, the same in every
    /// repeat: independent causes, the change of the readings by one standard deviation of each. It
    /// is no gap.
    fn expected_scatter(&self) -> &[Column] {
        &[]
    }

    /// The smallest difference of readings that is more than rounding of what they were reckoned from or read to:
    /// 1e-12 of the greatest reading, unless they are small differences of greater numbers, or the standard deviation of
    /// rounding to the decimals that they have (GUM F.2.2.1).
    fn rounding(&self) -> f64 {
        rounding_of(self.observed())
    }

    /// Standard deviation of one reading where the user states it.
    fn stated_noise(&self) -> Option<f64> {
        None
    }

    /// Readings of which each that is diagnosed is the mean.
    fn readings_in_each(&self) -> f64 {
        1.0
    }

    /// By how much the white variance of what traces have in common exceeds what their differences show:
    /// more than one where readings are not each of their own.
    fn noise_allowance(&self) -> f64 {
        1.0
    }

    /// Readings, or what is left of them, without the heights of repeats where these are unknowns of the fit, each by itself.
    fn levelled<'v>(&self, readings: &'v DVector<f64>) -> Cow<'v, DVector<f64>> {
        Cow::Borrowed(readings)
    }

    /// Whether repeats of a trace were read at the same places, so that nothing but noise is in their differences.
    fn repeats_are_alike(&self) -> bool {
        true
    }

    /// The same model fitted to other values of the same readings.
    fn refit(&self, observed: DVector<f64>) -> Self;

    /// The same where readings are changed by what is itself taken from the fitted state: how smooth
    /// the state is must not be learnt from them, as their roughness may be its own.
    #[must_use]
    fn refit_as_smooth(&self, observed: DVector<f64>) -> Self {
        self.refit(observed)
    }

    /// The same state without smoothing.
    #[must_use]
    fn as_read(&self) -> Self {
        self.clone()
    }

    /// A draw of what the fit of a state as smooth as this one may have taken away of the truth, in the
    /// model's own terms; nothing where it does not smooth. `noise`: a draw of the readings' noise that
    /// has no part in the fit.
    fn smoothed_away(&self, _noise: &DVector<f64>) -> Option<DMatrix<f64>> {
        None
    }

    /// The same model with such a draw added to its state.
    #[must_use]
    fn roughened(self, _away: &DMatrix<f64>) -> Self {
        self
    }

    /// Measurements that could be made beside this one, in words, each as the model fitted to what
    /// the present state predicts for it; the cheapest first.
    fn further(&self) -> Vec<(String, Self)> {
        Vec::new()
    }

    /// Of what, beside the position along the trace, the time and the reading, errors that nobody has listed may be
    /// functions: the diagnosis draws rivals of a name from them.
    fn covariates(&self) -> Vec<Covariate> {
        Vec::new()
    }

    /// The changes of the readings by what a new set-up changes, readings × unknowns: a further
    /// measurement of the same thing fits them anew and takes over all else. `None`: the model does
    /// not say what stays the same.
    fn set_anew(&self) -> Option<DMatrix<f64>> {
        None
    }

    /// The fitted state with a change of what is seen, one value a reading, that is not fitted:
    /// signatures of effects that depend on it are taken there.
    #[must_use]
    fn beneath(self, _change: &DVector<f64>) -> Self {
        self
    }

    /// The effects which the model leaves out.
    fn effects(&self) -> Vec<Box<dyn Effect<Self>>>;
}

#[cfg(test)]
mod tests {
    use super::decimal_step;

    /// *Definition*: tenths as they are typed and as differences of coordinates, whole numbers, and what nobody typed.
    #[test]
    fn readings_tell_what_they_were_rounded_to() {
        let typed = [0.0, 1.2, -3.7, 25.0];
        assert_eq!(decimal_step(typed.iter().copied()), Some(0.1));
        let measured = typed.map(|um| 1e3 * ((100.0 + 1e-3 * um) - 100.0));
        assert_eq!(decimal_step(measured.iter().copied()), Some(0.1));
        assert_eq!(decimal_step([4.0, 7.0].into_iter()), Some(1.0));
        assert_eq!(decimal_step([0.123_456_789_1].into_iter()), None);
    }
}
