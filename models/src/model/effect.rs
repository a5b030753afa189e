//! An effect that a model leaves out: what it is, its shapes and sizes, and its signature.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use super::Column;

/// A parameter of an effect with its unit and the range in which it is physically plausible.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name in tables and JSON.
    pub name: Cow<'static, str>,
    /// Unit.
    pub unit: &'static str,
    /// Smallest plausible value.
    pub low: f64,
    /// Greatest plausible value.
    pub high: f64,
}

impl Parameter {
    /// A parameter of either sign.
    pub const fn symmetric(name: &'static str, unit: &'static str, reach: f64) -> Self {
        Self {
            name: Cow::Borrowed(name),
            unit,
            low: -reach,
            high: reach,
        }
    }

    /// A parameter between two plausible values.
    pub const fn between(name: &'static str, unit: &'static str, low: f64, high: f64) -> Self {
        Self {
            name: Cow::Borrowed(name),
            unit,
            low,
            high,
        }
    }
}

/// What the size of an effect is: the first amplitude of that of this name in a catalogue. `None` where it
/// has none.
pub(crate) fn amplitude<M>(catalogue: &[Box<dyn Effect<M>>], effect: &str) -> Option<Parameter> {
    let own = catalogue.iter().find(|known| known.name() == effect)?;
    own.amplitudes().into_iter().next()
}

/// The estimate of one parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Name of the parameter.
    pub name: String,
    /// Best value.
    pub value: f64,
    /// Standard uncertainty.
    pub std: f64,
    /// Unit.
    pub unit: String,
}

/// One member of an effect's family of signatures: its variant and its nonlinear parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Which of the effect's discrete variants (a channel, a sign pattern …).
    pub variant: usize,
    /// Nonlinear parameters, in the order of [`Effect::shape_parameters`].
    pub values: Vec<f64>,
    /// First step of the search around each value; zero keeps it.
    pub steps: Vec<f64>,
}

impl Shape {
    /// The only member of an effect without nonlinear parameters.
    pub fn only() -> Self {
        Self::variant(0)
    }

    /// A variant without nonlinear parameters.
    pub fn variant(variant: usize) -> Self {
        Self {
            variant,
            values: Vec::new(),
            steps: Vec::new(),
        }
    }

    /// The shape of an effect whose signature depends on its own size alone, at the size that was found.
    pub(crate) fn settled_at(&self, amplitudes: &[f64]) -> Option<Self> {
        amplitudes.first().map(|&size| Self {
            values: vec![size],
            steps: vec![0.0],
            ..self.clone()
        })
    }

    /// Number of parameters that the search may change.
    pub fn free(&self) -> usize {
        self.steps.iter().filter(|step| **step != 0.0).count()
    }
}

/// Where the signature of an effect falls or rises from one reading to the next: a small step of its shape moves no
/// reading over it, and yet the readings tell between which of them it lies.
#[derive(Debug, Clone, PartialEq)]
pub struct Fall {
    /// The derivatives of what it lies at by the values of the shape, with their places.
    pub by: Vec<(usize, f64)>,
    /// How far that goes from one reading to the next.
    pub apart: f64,
    /// By how much the readings there differ, per unit of the amplitude.
    pub height: Column,
}

/// What people should know of an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct About {
    /// What happens physically.
    pub physics: &'static str,
    /// The observation that would confirm or refute it.
    pub confirm: &'static str,
    /// Where the formula comes from.
    pub source: &'static str,
}

/// Where in the chain from the machine to the reading an effect acts. Signatures that depend on what
/// is seen are taken with the changes of the effects that come before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Link {
    /// It moves what the sensor sees at a place.
    Stylus,
    /// It moves the place: what is seen there comes with it.
    Slide,
    /// It depends on what the sensor sees.
    Sensor,
    /// It adds to the reading.
    Reading,
    /// It depends on the reading, with all that any other effect but that of a scale has added to it.
    Pointer,
    /// It depends on where the indicator stands on its scale, with all that moves it there: play and friction of its
    /// plunger, and what moves its mount.
    Scale,
}

impl Link {
    /// Whether an effect here depends on what an effect at another link changes.
    pub fn sees(self, other: Self) -> bool {
        match self {
            Self::Stylus | Self::Reading => false,
            Self::Slide => other == Self::Stylus,
            Self::Sensor => matches!(other, Self::Stylus | Self::Slide),
            Self::Pointer => !matches!(other, Self::Pointer | Self::Scale),
            Self::Scale => !matches!(other, Self::Sensor | Self::Scale),
        }
    }
}

/// A physical effect that a model leaves out.
pub trait Effect<M>: Send + Sync {
    /// Name in verdicts, options and files.
    fn name(&self) -> &str;

    /// Physics, confirmation and source.
    fn about(&self) -> About;

    /// The parameters that enter linearly, one signature each; where variants differ in them, those
    /// of the fullest.
    fn amplitudes(&self) -> Vec<Parameter>;

    /// The parameters that enter linearly at a shape: a variant may have fewer than another.
    fn amplitudes_at(&self, _shape: &Shape) -> Vec<Parameter> {
        self.amplitudes()
    }

    /// The parameters that enter nonlinearly.
    fn shape_parameters(&self) -> Vec<Parameter> {
        Vec::new()
    }

    /// The shapes at which the search begins, dense enough that the best is near one of them.
    fn grid(&self, _model: &M) -> Vec<Shape> {
        vec![Shape::only()]
    }

    /// Members of the family that one found by searching is compared with: another section of a
    /// bump, one indicator in place of both. Each is searched from where it stands, and the one of
    /// greatest evidence is kept.
    fn relatives(&self, _model: &M, _shape: &Shape) -> Vec<Shape> {
        Vec::new()
    }

    /// The change of the readings per unit of each amplitude, at the fitted state of the model.
    fn columns(&self, model: &M, shape: &Shape) -> Vec<Column>;

    /// Where in the chain from the machine to the reading it acts, at a shape.
    fn link(&self, _shape: &Shape) -> Link {
        Link::Reading
    }

    /// Whether its signature is linear in the fitted state. How far it moves an answer is then taken
    /// at the state as it was read: smoothing would bias that, most at the ends of the travel, and
    /// noise does not.
    fn is_linear_in_state(&self) -> bool {
        false
    }

    /// Whether the model absorbs this effect whatever its size: it is listed as undetectable and
    /// never named, whatever small part of it bent states or missing traces leave visible.
    fn absorbed(&self) -> bool {
        false
    }

    /// Changes of the readings, of one standard deviation each, that the model leaves open at a shape: it sees
    /// the state where it is not known. What remains beside the effect is judged with them.
    fn open(&self, _model: &M, _shape: &Shape) -> Vec<Column> {
        Vec::new()
    }

    /// Columns of the limit in which the freedom of a shape shows nothing, if they are those of another effect:
    /// a cause stands only where the evidence for it is greater than for them.
    fn limit(&self, _model: &M, _shape: &Shape) -> Vec<Column> {
        Vec::new()
    }

    /// Values of a shape, by their places, that are the same again after a period, and this period, where
    /// a search by small steps may stop beside the best.
    fn cycles(&self, _model: &M, _shape: &Shape) -> Vec<(usize, f64)> {
        Vec::new()
    }

    /// Where a value of a shape changes the readings of some traces alone, of an effect of one column: those
    /// traces, and the column at each of their readings. A search by small steps then takes the others as they are.
    fn changed(&self, _model: &M, _shape: &Shape, _value: usize) -> Option<(Vec<usize>, Column)> {
        None
    }

    /// Where the signature falls from one reading to the next, of an effect of one amplitude.
    fn falls(&self, _model: &M, _shape: &Shape) -> Vec<Fall> {
        Vec::new()
    }

    /// Whether a shape is one that the search may go to.
    fn allowed(&self, _model: &M, _shape: &Shape) -> bool {
        true
    }

    /// Whether amplitudes inside their ranges are possible at this state too: an indicator's
    /// reading rises with what it sees.
    fn possible(&self, _model: &M, _shape: &Shape, _amplitudes: &[f64]) -> bool {
        true
    }

    /// The shape that belongs to estimated amplitudes, for effects whose signature depends on
    /// their size.
    fn settled(&self, _shape: &Shape, _amplitudes: &[f64]) -> Option<Shape> {
        None
    }

    /// The shape as the readings themselves tell it, from those without what other causes change in them, for an
    /// effect that does at each reading what came before makes of it; the others do not ask for them.
    fn traced(
        &self,
        _model: &M,
        _readings: &dyn Fn() -> Option<DVector<f64>>,
        _shape: &Shape,
    ) -> Option<Shape> {
        None
    }

    /// How often the readings chose between two ways, as probable before, that the shape could take.
    fn choices(&self, _shape: &Shape) -> usize {
        0
    }

    /// The same physical effect at another state of the model, where shape or amplitudes are told
    /// relative to the state.
    fn carried(&self, _from: &M, _to: &M, shape: &Shape, amplitudes: &[f64]) -> (Shape, Vec<f64>) {
        (shape.clone(), amplitudes.to_vec())
    }

    /// The readings without this effect, where taking its change out of them does not suffice
    /// because the effect hides a part of the state: from the readings with it and those less its
    /// change, `clean`.
    fn restored(
        &self,
        _model: &M,
        _shape: &Shape,
        _readings: &DVector<f64>,
        _clean: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        None
    }

    /// Of an effect that begins at a moment, its only shape parameter, and lasts: the moments of the readings, ascending,
    /// between which it may begin. Its signature is the same from one of them to the next.
    fn moments(&self, _model: &M, _shape: &Shape) -> Vec<f64> {
        Vec::new()
    }

    /// The variant in words, where the effect has several.
    fn variant_name(&self, _model: &M, _shape: &Shape) -> Option<String> {
        None
    }

    /// What is reported from amplitudes and shape, both with their covariance
    /// (amplitudes first, then shape parameters).
    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let parameters = self.amplitudes_at(shape).into_iter();
        let values = amplitudes.iter().chain(&shape.values);
        each(
            parameters.chain(self.shape_parameters()),
            values,
            covariance,
        )
    }
}

/// Parameters as they stand, each with its standard uncertainty.
pub(crate) fn each<'v>(
    parameters: impl Iterator<Item = Parameter>,
    values: impl Iterator<Item = &'v f64>,
    covariance: &DMatrix<f64>,
) -> Vec<Estimate> {
    let variance = |k: usize| covariance.get((k, k)).copied().unwrap_or(f64::NAN);
    let named = parameters.zip(values).enumerate();
    named
        .map(|(k, (parameter, &value))| Estimate {
            name: parameter.name.into_owned(),
            value,
            std: variance(k).clamp(0.0, f64::INFINITY).sqrt(),
            unit: parameter.unit.to_owned(),
        })
        .collect()
}
