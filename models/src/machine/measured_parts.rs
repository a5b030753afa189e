//! A fixed machine model against measured parts, as the diagnosis sees it: nothing is fitted, so
//! all that parts show beyond the prediction is gap.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::{Axis, Machine, MachineError, PartReading, Position, part_residuals};
use crate::model::{
    About, Column, Effect, FittedModel, Freedom, Parameter, Place, Quantity, Shape,
};
use crate::units::{UM_PER_MM, um_from_mm};

/// Parts measured at points whose deviations a machine model predicts.
#[derive(Debug, Clone)]
pub struct MeasuredParts {
    readings: Vec<PartReading>,
    predicted: DVector<f64>,
    observed: DVector<f64>,
    places: Vec<Place>,
    traces: Vec<Range<usize>>,
}

impl MeasuredParts {
    /// Predicts every reading and puts them into traces: one direction of one replicate of one part.
    /// The position of a reading is the coordinate of its point along its direction; parts follow
    /// one another in time, in the order in which they first occur.
    ///
    /// # Errors
    /// A point outside a table of the machine, a reading that is not finite.
    pub fn new(machine: &Machine, mut readings: Vec<PartReading>) -> Result<Self, MachineError> {
        let parts = places_of(readings.iter().map(|r| r.part.as_str()));
        let features = places_of(readings.iter().map(|r| r.feature.as_str()));
        let key = |r: &PartReading| (parts[&r.part], r.replicate, r.axis);
        readings.sort_by(|a, b| {
            let along = |r: &PartReading| r.position[r.axis.index()];
            key(a).cmp(&key(b)).then(along(a).total_cmp(&along(b)))
        });
        let residuals = part_residuals(machine, &readings)?;
        let places = readings
            .iter()
            .map(|r| Place {
                channel: r.axis.index(),
                x: r.position[r.axis.index()],
                time: parts[&r.part] as f64,
                repeat: r.replicate,
                direction: 1.0,
                cell: features[&r.feature] * Axis::ALL.len() + r.axis.index(),
            })
            .collect();
        let mut traces: Vec<Range<usize>> = Vec::new();
        for (i, reading) in readings.iter().enumerate() {
            match traces.last_mut() {
                Some(trace) if i > 0 && key(&readings[i - 1]) == key(reading) => trace.end = i + 1,
                _ => traces.push(i..i + 1),
            }
        }
        Ok(Self {
            predicted: DVector::from_iterator(
                readings.len(),
                residuals.iter().map(|r| r.predicted),
            ),
            observed: DVector::from_iterator(readings.len(), readings.iter().map(|r| r.value)),
            places,
            traces,
            readings,
        })
    }

    /// The readings in the order of [`FittedModel::places`].
    #[must_use]
    pub fn readings(&self) -> &[PartReading] {
        &self.readings
    }
}

/// Number of each name by its first occurrence.
fn places_of<'a>(names: impl Iterator<Item = &'a str>) -> std::collections::HashMap<String, usize> {
    let mut places = std::collections::HashMap::new();
    for name in names {
        let next = places.len();
        places.entry(name.to_owned()).or_insert(next);
    }
    places
}

impl FittedModel for MeasuredParts {
    fn name(&self) -> &'static str {
        "machine against measured parts"
    }

    fn reading_unit(&self) -> &'static str {
        "um"
    }

    fn places(&self) -> &[Place] {
        &self.places
    }

    fn traces(&self) -> &[Range<usize>] {
        &self.traces
    }

    fn observed(&self) -> &DVector<f64> {
        &self.observed
    }

    fn freedom(&self) -> Freedom {
        Freedom {
            columns: DMatrix::zeros(self.observed.len(), 0),
            profiles: None,
        }
    }

    fn linearised(&self) -> DVector<f64> {
        &self.observed - &self.predicted
    }

    fn channel_names(&self) -> Vec<String> {
        Axis::ALL
            .iter()
            .map(|axis| axis.letter().to_string())
            .collect()
    }

    fn quantities(&self) -> Vec<Quantity> {
        [Axis::X, Axis::Y]
            .into_iter()
            .filter_map(|axis| {
                let of_axis = |r: &PartReading| r.axis == axis;
                let count = self.readings.iter().filter(|r| of_axis(r)).count();
                let weight = |r| if of_axis(r) { 1.0 / count as f64 } else { 0.0 };
                (count > 0).then(|| Quantity {
                    name: format!("mean deviation along {}", axis.letter()),
                    unit: "um",
                    weights: DVector::from_iterator(
                        self.readings.len(),
                        self.readings.iter().map(weight),
                    ),
                })
            })
            .collect()
    }

    fn refit(&self, observed: DVector<f64>) -> Self {
        Self {
            observed,
            ..self.clone()
        }
    }

    fn effects(&self) -> Vec<Box<dyn Effect<Self>>> {
        EFFECTS
            .iter()
            .map(|effect| Box::new(*effect) as Box<dyn Effect<Self>>)
            .collect()
    }
}

/// An effect that moves the points of all parts alike.
#[derive(Clone, Copy)]
struct Motion {
    name: &'static str,
    about: About,
    parameters: &'static [Parameter],
    /// Change of a reading along an axis at a point per unit of each parameter, um.
    change: fn(Axis, &Position) -> [f64; 2],
}

const fn parameter(name: &'static str, unit: &'static str, reach: f64) -> Parameter {
    Parameter {
        name,
        unit,
        low: -reach,
        high: reach,
    }
}

/// What a machine model leaves out of parts, common to all of them.
const EFFECTS: [Motion; 4] = [
    Motion {
        name: "datum-offset",
        about: About {
            physics: "The origin from which the parts are measured is not the one they were made from.",
            confirm: "Measure the parts from another datum, or the datum itself.",
            source: "rigid translation of all points",
        },
        parameters: &[parameter("x", "um", 1e3), parameter("y", "um", 1e3)],
        change: |axis, _| match axis {
            Axis::X => [1.0, 0.0],
            Axis::Y => [0.0, 1.0],
            Axis::Z => [0.0, 0.0],
        },
    },
    Motion {
        name: "datum-rotation",
        about: About {
            physics: "The parts are measured in a frame turned against that of the machine.",
            confirm: "Align the measurement to another edge and see the deviations turn.",
            source: "rigid rotation about Z: (-y, x)",
        },
        parameters: &[parameter("angle", "rad", 1e-2)],
        change: |axis, p| match axis {
            Axis::X => [-um_from_mm(p.y), 0.0],
            Axis::Y => [um_from_mm(p.x), 0.0],
            Axis::Z => [0.0, 0.0],
        },
    },
    Motion {
        name: "thermal-expansion",
        about: About {
            physics: "Parts were warmer or colder when made than when measured.",
            confirm: "Record the temperature of a part at both times.",
            source: "uniform scale: (x, y, z)",
        },
        parameters: &[parameter("scale", "1", 1e-2)],
        change: |axis, p| [um_from_mm(p[axis.index()]), 0.0],
    },
    Motion {
        name: "squareness-change",
        about: About {
            physics: "The angle between X and Y was another when the parts were made.",
            confirm: "Measure the squareness of X and Y again, at the load of machining.",
            source: "shear of X by y; NISTIR 6868, equation (9)",
        },
        parameters: &[parameter("angle", "rad", 1e-2)],
        change: |axis, p| match axis {
            Axis::X => [-p.y * UM_PER_MM, 0.0],
            Axis::Y | Axis::Z => [0.0, 0.0],
        },
    },
];

impl Effect<MeasuredParts> for Motion {
    fn name(&self) -> &str {
        self.name
    }

    fn about(&self) -> About {
        self.about
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.parameters.to_vec()
    }

    fn columns(&self, model: &MeasuredParts, _shape: &Shape) -> Vec<Column> {
        (0..self.parameters.len())
            .map(|k| {
                Column::from_places(&model.places, |i, _| {
                    let reading = &model.readings[i];
                    (self.change)(reading.axis, &reading.position)[k]
                })
            })
            .collect()
    }
}
