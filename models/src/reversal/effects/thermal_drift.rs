//! What holds the indicators warms up while the traces are taken.
//!
//! Each mount moves by its own amount. One time constant: d (1 − exp(−t/τ)) for each indicator, up
//! to twenty times the duration of the test, where it is a straight line. Two time constants, each
//! with its own part in each indicator: mounts of different mass, or a body that warms its mount.
//! Free: an amplitude for each indicator and time constant, the time constants.

use nalgebra::DMatrix;

use super::indicators::{ALL, Indicators};
use super::{Linearised, spread};
use crate::model::{About, Column, Effect, Estimate, FittedModel, Parameter, Shape};

/// See the head of the file. Variants: the indicators, and beyond the scopes two time constants.
pub(super) struct ThermalDrift(pub Indicators);

/// Two time constants are told apart from here on.
const APART: f64 = 1.3;

/// Where two time constants are begun, as parts of the duration.
const FAST: [f64; 4] = [0.03, 0.08, 0.2, 0.5];
/// See [`FAST`]; the last is nearly a straight line.
const SLOW: [f64; 4] = [0.3, 0.9, 3.0, 20.0];

impl Effect<Linearised> for ThermalDrift {
    fn name(&self) -> &str {
        "thermal-drift"
    }

    fn about(&self) -> About {
        About {
            physics: "spindle, slide or the mounts of the indicators drift towards thermal equilibrium while the traces are taken, each by its own amount",
            confirm: "leave the indicators on the artefact at one position for as long as the test took and record them",
            source: "first-order thermal response d (1 - exp(-t / tau)); ISO 230-3",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.amplitudes_at(&Shape::variant(ALL))
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        let drift = Parameter::symmetric("drift", "um", 500.0);
        let one = self.0.sizes(shape.variant, &drift, "drift");
        (0..self.stages(shape)).flat_map(|_| one.clone()).collect()
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        ["log-time-constant", "log-second-time-constant"]
            .map(|name| Parameter::between(name, "ln s", -5.0, 20.0))
            .to_vec()
    }

    fn grid(&self, model: &Linearised) -> Vec<Shape> {
        let at = |part: f64| Shape {
            variant: self.0.fullest(),
            values: vec![(part * model.duration()).ln()],
            // Beyond twenty times the duration a drift is a straight line.
            steps: vec![if part > 5.0 { 0.0 } else { 0.2 }],
        };
        [0.03, 0.06, 0.12, 0.25, 0.5, 1.0, 2.0, 20.0]
            .map(at)
            .to_vec()
    }

    fn relatives(&self, model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let with = |variant: usize, values: Vec<f64>| Shape {
            variant,
            steps: vec![0.2; values.len()],
            values,
        };
        match *shape.values.as_slice() {
            [one] => {
                let two = shape.variant + self.0.scope_count();
                let one = if shape.free() == 0 { one - 3.0 } else { one };
                // A single time constant says little of two that are far apart, least where they work
                // against each other: such pairs are begun from everywhere.
                let fast = FAST.iter().flat_map(|f| SLOW.map(|s| [*f, s]));
                let apart = fast.filter(|[f, s]| s / f > 2.0 * APART);
                let all = apart.map(|pair| pair.map(|part| (part * model.duration()).ln()));
                let near = [one - 0.7, one + 0.7];
                std::iter::once(near)
                    .chain(all)
                    .map(|pair| with(two, pair.to_vec()))
                    .collect()
            }
            [one, two] => vec![with(
                shape.variant % self.0.scope_count(),
                vec![0.5 * (one + two)],
            )],
            _ => Vec::new(),
        }
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let total = model.duration();
        let stage = |log_constant: &f64| {
            let constant = log_constant.exp().max(1e-3 * total);
            // Per unit of the drift over the whole test, so that the straight line is the limit.
            let whole = (-total / constant).exp_m1();
            let warming = Column::from_places(model.places(), |_, place| {
                (-place.time / constant).exp_m1() / whole
            });
            self.0.apart(model, shape.variant, &warming)
        };
        shape.values.iter().flat_map(stage).collect()
    }

    fn allowed(&self, model: &Linearised, shape: &Shape) -> bool {
        let part = |log_constant: &f64| log_constant.exp() / model.duration();
        let inside = |part: f64| part > 0.005 && part < 50.0;
        shape.values.iter().all(|v| inside(part(v)))
            && shape.values.windows(2).all(|v| v[1] > v[0] + APART.ln())
    }

    /// The drift is told over the whole test.
    fn carried(
        &self,
        from: &Linearised,
        to: &Linearised,
        shape: &Shape,
        amplitudes: &[f64],
    ) -> (Shape, Vec<f64>) {
        let count = self.0.of(shape.variant).len().max(1);
        let grown = |log_constant: &f64| {
            let whole = |model: &Linearised| (-model.duration() / log_constant.exp()).exp_m1();
            whole(to) / whole(from)
        };
        let stages: Vec<f64> = shape.values.iter().map(grown).collect();
        let by_stage = |(k, a): (usize, &f64)| a * stages.get(k / count).unwrap_or(&1.0);
        let carried = amplitudes.iter().enumerate().map(by_stage);
        (shape.clone(), carried.collect())
    }

    fn variant_name(&self, _model: &Linearised, shape: &Shape) -> Option<String> {
        let linear = shape.free() == 0;
        Some(
            match (self.stages(shape), linear) {
                (2, _) => "two time constants",
                (_, true) => "straight in time",
                _ => "one time constant",
            }
            .to_owned(),
        )
    }

    /// The drift of each indicator over the whole test, then the time constants.
    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let count = self.0.of(shape.variant).len();
        let estimate = |name: &str, value: f64, std: f64, unit: &str| Estimate {
            name: name.to_owned(),
            value,
            std,
            unit: unit.to_owned(),
        };
        let mut told: Vec<Estimate> = self.amplitudes_at(shape)[..count]
            .iter()
            .enumerate()
            .map(|(own, parameter)| {
                let parts: Vec<(usize, f64)> = (own..amplitudes.len())
                    .step_by(count)
                    .map(|k| (k, 1.0))
                    .collect();
                let whole = parts.iter().map(|(k, _)| amplitudes[*k]).sum();
                estimate(&parameter.name, whole, spread(covariance, &parts), "um")
            })
            .collect();
        let constants = shape.values.iter().zip(self.shape_parameters()).enumerate();
        told.extend(constants.map(|(k, (value, parameter))| {
            let std = spread(covariance, &[(amplitudes.len() + k, 1.0)]);
            estimate(&parameter.name, *value, std, parameter.unit)
        }));
        told
    }
}

impl ThermalDrift {
    /// Number of time constants.
    fn stages(&self, shape: &Shape) -> usize {
        1 + shape.variant / self.0.scope_count()
    }
}
