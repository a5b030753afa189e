//! A fixed machine model against measured parts, as the diagnosis sees it: nothing is fitted, so
//! all that parts show beyond the prediction and its own uncertainty is gap.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use errsep_solvers::linear::limited::symmetric_eigen;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::model::coordinate;
use super::{
    Axis, ComponentError, Machine, MachineError, PartReading, Position, effects, part_residuals,
};
use crate::model::{
    Column, Course, Covariate, Effect, FittedModel, Freedom, Place, Quantity, ROUNDING, Record,
    decimal_step,
};
use crate::units::um_from_mm;

/// Parts measured at points whose deviations a machine model predicts.
#[derive(Debug, Clone)]
pub struct MeasuredParts {
    readings: Vec<PartReading>,
    predicted: DVector<f64>,
    record: Record,
    parts: Vec<String>,
    expected: Arc<[Column]>,
    /// Columns of the zeros and turns of the parts, where these belong to the model.
    pub(super) alignment: Option<DMatrix<f64>>,
    /// What the readings were rounded to, µm; zero where that is not seen.
    read_to: f64,
    /// The turn of each part that was taken off its readings, rad about each axis.
    pub(super) turns: BTreeMap<String, Vector3<f64>>,
}

impl MeasuredParts {
    /// Predicts every reading, with what the machine's own spreads let it be off, and puts them into traces: one direction of one replicate of one part.
    /// The position of a reading is the coordinate of its point along its direction; parts follow
    /// one another in time, in the order in which they first occur. Replicates of one part repeat
    /// each other; parts do not, so that their scatter is gap and not noise.
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
        let places: Vec<Place> = readings
            .iter()
            .map(|r| Place {
                channel: r.axis.index(),
                x: r.position[r.axis.index()],
                time: parts[&r.part] as f64,
                repeat: r.replicate,
                direction: 1.0,
                cell: (parts[&r.part] * features.len() + features[&r.feature]) * Axis::ALL.len()
                    + r.axis.index(),
            })
            .collect();
        let mut traces: Vec<Range<usize>> = Vec::new();
        for (i, reading) in readings.iter().enumerate() {
            match traces.last_mut() {
                Some(trace) if i > 0 && key(&readings[i - 1]) == key(reading) => trace.end = i + 1,
                _ => traces.push(i..i + 1),
            }
        }
        let expected = expected_scatter(machine, &readings, &places)?.into();
        Ok(Self {
            predicted: DVector::from_iterator(
                readings.len(),
                residuals.iter().map(|r| r.predicted),
            ),
            record: Record::new(
                places,
                traces,
                DVector::from_iterator(readings.len(), readings.iter().map(|r| r.value)),
            ),
            parts: {
                let mut names: Vec<(usize, String)> =
                    parts.into_iter().map(|(name, k)| (k, name)).collect();
                names.sort_unstable();
                names.into_iter().map(|(_, name)| name).collect()
            },
            expected,
            alignment: None,
            turns: BTreeMap::new(),
            read_to: decimal_step(readings.iter().map(|r| r.value)).unwrap_or(0.0),
            readings,
        })
    }

    /// The readings in the order of [`FittedModel::places`].
    #[must_use]
    pub fn readings(&self) -> &[PartReading] {
        &self.readings
    }

    /// The parts, in the order in which they first occur.
    #[must_use]
    pub fn parts(&self) -> &[String] {
        &self.parts
    }

    /// What the machine's model leaves of the readings, µm.
    pub(super) fn left(&self) -> DVector<f64> {
        &self.record.observed - &self.predicted
    }

    /// Takes a motion of the nominal points, mm, off the readings of a part.
    pub(super) fn turned_back(&mut self, part: &str, motion: impl Fn(&Position) -> Position) {
        for r in self.readings.iter_mut().filter(|r| r.part == part) {
            r.value -= um_from_mm(motion(&r.position)[r.axis.index()]);
        }
        let values = self.readings.iter().map(|r| r.value);
        let observed = DVector::from_iterator(self.readings.len(), values);
        self.record = self.record.with(observed);
    }

    /// The signature with a value for each reading of some parts.
    pub(super) fn column(&self, value: impl Fn(&PartReading) -> f64) -> Column {
        Column::from_places(&self.record.places, |k, _| value(&self.readings[k]))
    }
}

/// What the machine's spreads let readings be off, um: its coefficients, common to all parts, and its
/// scatter, drawn anew for every point of every part.
fn expected_scatter(
    machine: &Machine,
    readings: &[PartReading],
    places: &[Place],
) -> Result<Vec<Column>, MachineError> {
    let spectrum = |error: &ComponentError| MachineError::BadComponent {
        component: error.component,
        why: "the spread of its coefficients has no finite principal axes".to_owned(),
    };
    let mut columns = Vec::new();
    for error in machine.errors() {
        let spread = &error.spread;
        if spread.covariance.is_empty() {
            continue;
        }
        let motion =
            |r: &PartReading| machine.sensitivity(error.component, &r.position)[r.axis.index()];
        let eigen = symmetric_eigen(spread.covariance.clone()).ok_or_else(|| spectrum(error))?;
        let directions = eigen.eigenvectors.column_iter();
        for (variance, direction) in eigen.eigenvalues.iter().zip(directions) {
            let deviation = |r: &PartReading| {
                let powers = spread
                    .basis
                    .powers(coordinate(error.component, &r.position));
                powers.zip(&direction).map(|(p, d)| p * d).sum::<f64>()
            };
            let size = variance.max(0.0).sqrt();
            columns.push(Column::from_places(places, |k, _| {
                size * motion(&readings[k]) * deviation(&readings[k])
            }));
        }
    }
    let mut points: BTreeMap<(&str, &str), Vec<usize>> = BTreeMap::new();
    for (k, r) in readings.iter().enumerate() {
        points.entry((&r.part, &r.feature)).or_default().push(k);
    }
    for rows in points.into_values() {
        let position = &readings[rows[0]].position;
        let mut covariance = Matrix3::zeros();
        for error in machine.errors() {
            let motion = machine.sensitivity(error.component, position);
            covariance += motion * motion.transpose() * error.spread.scatter;
        }
        let eigen = symmetric_eigen(covariance).ok_or(MachineError::NotFinite {
            what: "the expected scatter of a part",
            found: covariance.amax(),
        })?;
        let directions = eigen.eigenvectors.column_iter();
        for (variance, direction) in eigen.eigenvalues.iter().zip(directions) {
            let size = variance.max(0.0).sqrt();
            let values = rows
                .iter()
                .map(|k| size * direction[readings[*k].axis.index()]);
            columns.push(Column {
                values: values.collect(),
                rows: rows.clone(),
            });
        }
    }
    columns.retain(|column| column.values.iter().any(|v| *v != 0.0));
    Ok(columns)
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

    fn time_unit(&self) -> &'static str {
        "parts"
    }

    fn record(&self) -> &Record {
        &self.record
    }

    /// Of the readings as they were given: a turn that was taken off them has all decimals.
    fn rounding(&self) -> f64 {
        (ROUNDING * self.observed().amax()).max(self.read_to / 12f64.sqrt())
    }

    fn freedom(&self) -> Freedom {
        Freedom {
            columns: match &self.alignment {
                Some(columns) => columns.clone(),
                None => DMatrix::zeros(self.record.observed.len(), 0),
            },
            profiles: None,
        }
    }

    fn linearised(&self) -> DVector<f64> {
        self.left()
    }

    fn expected_scatter(&self) -> &[Column] {
        &self.expected
    }

    fn channel_names(&self) -> Vec<String> {
        Axis::ALL
            .iter()
            .map(|axis| axis.letter().to_string())
            .collect()
    }

    fn trace_name(&self, place: &Place) -> Option<String> {
        // Parts follow one another in time; padded, so that names sort as numbers do.
        let part = self.parts.get(place.time as usize)?;
        Some(format!("part {part:>3}"))
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

    /// The coordinates of a point, in all parts alike and, where there are several, in every part otherwise.
    fn covariates(&self) -> Vec<Covariate> {
        let of = |axis: Axis| self.readings.iter().map(move |r| r.position[axis.index()]);
        let parts: Vec<usize> = self.places().iter().map(|p| p.time as usize).collect();
        let along = |axis: &Axis| {
            let everywhere = Covariate::smooth(axis.letter(), of(*axis).collect());
            let by_part = (self.parts.len() > 1).then(|| Covariate {
                name: format!("{}, another in every part", axis.letter()),
                groups: Some(parts.clone()),
                ..everywhere.clone()
            });
            let others = Axis::ALL.into_iter().filter(|other| other != axis);
            let product = Covariate {
                name: format!("{} times another coordinate", axis.letter()),
                factors: others.map(|other| of(other).collect()).collect(),
                ..everywhere.clone()
            };
            [everywhere, product].into_iter().chain(by_part)
        };
        let times: Vec<f64> = self.places().iter().map(|p| p.time).collect();
        let in_time = Covariate {
            factors: Axis::ALL.iter().map(|axis| of(*axis).collect()).collect(),
            ..Covariate::smooth("time times a coordinate", times)
        };
        let proportional = Covariate {
            name: "a coordinate".to_owned(),
            course: Course::Proportional,
            ..in_time.clone()
        };
        let of_all = (self.parts.len() > 1).then_some(in_time);
        let by_axis = Axis::ALL.iter().flat_map(along);
        by_axis.chain(of_all).chain([proportional]).collect()
    }

    fn refit(&self, observed: DVector<f64>) -> Self {
        Self {
            record: self.record.with(observed),
            ..self.clone()
        }
    }

    fn effects(&self) -> Vec<Box<dyn Effect<Self>>> {
        match self.is_aligned() {
            true => effects::of_aligned_parts(),
            false => effects::all(),
        }
    }
}
