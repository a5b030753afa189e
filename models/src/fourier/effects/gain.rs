//! The gain of one probe is wrong.

use super::FourierScans;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};

/// The probes whose gain shows against the others, 1 to 3. What all have in common is the size of the workpiece; of two the one
/// is the other turned round.
pub(super) fn probes(model: &FourierScans) -> Vec<Shape> {
    let probes = if model.has_third_probe() {
        1..=3
    } else {
        2..=2
    };
    probes.map(Shape::variant).collect()
}

/// What a probe reads, with the sign that it has in the difference; zero where it is not read.
pub(super) fn reading(model: &FourierScans, row: usize, probe: usize) -> f64 {
    let [first, other] = model.read(row);
    match probe {
        1 => first,
        _ if model.other_probe(row) == probe => -other,
        _ => 0.0,
    }
}

/// See the head of the file.
pub(super) struct Gain;

impl Effect<FourierScans> for Gain {
    fn name(&self) -> &str {
        "gain"
    }

    fn about(&self) -> About {
        About {
            physics: "one probe reads too much or too little by a factor against the others",
            confirm: "move all probes together by a known step, and compare what they read",
            source: "g times the reading of one probe, slide and workpiece; ISO 230-1:2012, annex A",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("gain", "1", 0.2)]
    }

    fn grid(&self, model: &FourierScans) -> Vec<Shape> {
        probes(model)
    }

    fn variant_name(&self, _model: &FourierScans, shape: &Shape) -> Option<String> {
        Some(format!("probe {}", shape.variant))
    }

    fn columns(&self, model: &FourierScans, shape: &Shape) -> Vec<Column> {
        // The mean of both probes holds half of what the gain makes of the one.
        let gain = shape.values.first().copied().unwrap_or(0.0);
        vec![Column::from_places(model.places(), |row, _| {
            reading(model, row, shape.variant) / (1.0 + 0.5 * gain)
        })]
    }

    fn settled(&self, shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
        shape.settled_at(amplitudes)
    }
}
