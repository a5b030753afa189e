//! Effects that each indicator has by its own amount: which indicators a variant is of.

use std::borrow::Cow;
use std::ops::Range;

use nalgebra::DMatrix;

use super::{Linearised, spread};
use crate::model::{Column, Estimate, FittedModel, Parameter, Shape};
use crate::reversal::diagnosable::Arrangement;

/// All indicators, each by its own amount; scope k from one on is indicator k − 1 alone.
pub(super) const ALL: usize = 0;

/// The indicators of some readings. The variant of an effect is a scope and a multiple of
/// [`Indicators::scope_count`].
#[derive(Debug, Clone)]
pub(super) struct Indicators {
    names: Vec<String>,
}

impl Indicators {
    /// Those of an arrangement.
    pub fn new(arrangement: &Arrangement) -> Self {
        let count = 0..arrangement.indicators().len();
        Self {
            names: count.map(|k| arrangement.indicator_name(k)).collect(),
        }
    }

    /// How many they are.
    pub fn count(&self) -> usize {
        self.names.len()
    }

    /// Number of scopes.
    pub fn scope_count(&self) -> usize {
        self.count() + 1
    }

    /// The scopes that the readings can show, the fullest first.
    pub fn scopes(&self) -> Range<usize> {
        let fullest = usize::from(self.count() == 1);
        fullest..self.scope_count()
    }

    /// The fullest scope.
    pub fn fullest(&self) -> usize {
        self.scopes().start
    }

    /// The indicators that a variant is of.
    pub fn of(&self, variant: usize) -> Range<usize> {
        match variant % self.scope_count() {
            ALL => 0..self.count(),
            one => one - 1..one,
        }
    }

    /// A signature in all readings, taken apart into one for each indicator that a variant is of.
    pub fn apart(&self, model: &Linearised, variant: usize, whole: &Column) -> Vec<Column> {
        let of = |indicator: usize| {
            let (rows, values) = whole
                .rows
                .iter()
                .zip(&whole.values)
                .filter(|(row, _)| model.seat(&model.places()[**row]).indicator == indicator)
                .unzip();
            Column { rows, values }
        };
        self.of(variant).map(of).collect()
    }

    /// Names of what a variant has once for each of its indicators.
    fn named(&self, variant: usize, what: &'static str) -> Vec<Cow<'static, str>> {
        let own = self.of(variant);
        if own.len() == 1 {
            return vec![Cow::Borrowed(what)];
        }
        let name = |k: usize| Cow::Owned(format!("{}-{what}", self.names[k].replace('°', "deg")));
        own.map(name).collect()
    }

    /// The amplitudes of a variant: one for each of its indicators.
    pub fn sizes(&self, variant: usize, like: &Parameter, what: &'static str) -> Vec<Parameter> {
        let named = |name| Parameter {
            name,
            ..like.clone()
        };
        self.named(variant, what).into_iter().map(named).collect()
    }

    /// The amplitudes of waves: a cosine and a sine for each indicator of a variant.
    pub fn rotations(&self, variant: usize, reach: f64) -> Vec<Parameter> {
        let part = |name| Parameter {
            name,
            ..Parameter::symmetric("", "um", reach)
        };
        let pairs = self.named(variant, "cosine").into_iter();
        pairs
            .zip(self.named(variant, "sine"))
            .flat_map(|(cosine, sine)| [part(cosine), part(sine)])
            .collect()
    }

    /// What is told of waves: the amplitude of each, then the parameters of their shape.
    pub fn rotating(
        &self,
        variant: usize,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
        parameters: &[Parameter],
    ) -> Vec<Estimate> {
        let pairs = amplitudes.chunks_exact(2).enumerate();
        let mut told: Vec<Estimate> = pairs
            .zip(self.named(variant, "amplitude"))
            .map(|((k, pair), name)| {
                let size = pair[0].hypot(pair[1]).max(f64::MIN_POSITIVE);
                let along = [(2 * k, pair[0] / size), (2 * k + 1, pair[1] / size)];
                Estimate {
                    name: name.into_owned(),
                    value: size,
                    std: spread(covariance, &along),
                    unit: "um".to_owned(),
                }
            })
            .collect();
        let shapes = shape.values.iter().zip(parameters).enumerate();
        told.extend(shapes.map(|(k, (value, parameter))| Estimate {
            name: parameter.name.to_string(),
            value: *value,
            std: spread(covariance, &[(amplitudes.len() + k, 1.0)]),
            unit: parameter.unit.to_owned(),
        }));
        told
    }

    /// The name of an indicator.
    pub fn name(&self, indicator: usize) -> &str {
        &self.names[indicator]
    }

    /// The scope in words.
    pub fn words(&self, variant: usize) -> String {
        match (variant % self.scope_count(), self.count()) {
            (ALL, 2) => "both indicators, each by its own amount".to_owned(),
            (ALL, _) => "all indicators, each by its own amount".to_owned(),
            (one, _) => format!("{} indicator", self.names[one - 1]),
        }
    }

    /// The scopes other than a variant's own, with what else the variant says kept.
    pub fn others(&self, variant: usize) -> impl Iterator<Item = usize> + use<> {
        let kind = variant - variant % self.scope_count();
        let scopes = self.scopes().map(move |scope| kind + scope);
        scopes.filter(move |other| *other != variant)
    }
}
