//! The place and turn of each measured part, where they belong to the model and not to the machine.

use nalgebra::{DMatrix, DVector, Vector3};

use super::turn::{as_vector, turn_of};
use super::{Axis, MachineError, MeasuredParts, PartReading, Position};
use crate::units::um_from_mm;

/// A zero or a turn of one part, fitted to its readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Alignment {
    /// The part.
    pub part: String,
    /// What it is: `zero of x`, …, `turn about z`, ….
    pub name: String,
    /// Its value, µm (of the middle of the part's points) or rad.
    pub value: f64,
    /// Its standard uncertainty from what is left of the part's readings, noise and gap alike; not a number
    /// where the part has no reading too many.
    pub std: f64,
    /// `um` or `rad`.
    pub unit: &'static str,
}

/// A zero of an axis, or a turn about one.
#[derive(Debug, Clone, Copy)]
enum Motion {
    Zero(Axis),
    Turn(Axis),
}

impl Motion {
    const ALL: [Self; 6] = [
        Self::Zero(Axis::X),
        Self::Zero(Axis::Y),
        Self::Zero(Axis::Z),
        Self::Turn(Axis::X),
        Self::Turn(Axis::Y),
        Self::Turn(Axis::Z),
    ];

    fn name(self) -> String {
        match self {
            Self::Zero(axis) => format!("zero of {}", axis.letter().to_lowercase()),
            Self::Turn(axis) => format!("turn about {}", axis.letter().to_lowercase()),
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Self::Zero(_) => "um",
            Self::Turn(_) => "rad",
        }
    }

    /// What a unit of it (1 µm, 1 rad) adds to a reading, µm: a zero, or ω × r with r counted from `middle`.
    fn moves(self, reading: &PartReading, middle: &Position) -> f64 {
        match self {
            Self::Zero(axis) => f64::from(u8::from(reading.axis == axis)),
            Self::Turn(axis) => {
                let mut about = Vector3::zeros();
                about[axis.index()] = 1.0;
                um_from_mm(about.cross(&(reading.position - middle))[reading.axis.index()])
            }
        }
    }
}

/// Singular values below this share of the greatest are of turns and zeros that the points do not tell.
const RANK: f64 = 1e-9;

/// Greatest turn of a part, rad: its errors are looked for where its nominal points would lie unturned, off by 2 % of
/// their distances then.
const MOST: f64 = 0.02;

impl MeasuredParts {
    /// The same parts with the zero and the turn of each as unknowns of the model: the turn is taken off the readings
    /// exactly where they tell it, and what is left are small rotations about the middle of the part's points and shifts
    /// along each axis that was measured.
    ///
    /// # Errors
    /// A part that lies turned by more than 0.02 rad.
    pub fn aligned(mut self) -> Result<Self, MachineError> {
        self.turn_back()?;
        let mut columns: Vec<DVector<f64>> = Vec::new();
        for part in self.parts() {
            let middle = self.middle(part);
            for motion in Motion::ALL {
                let column = self.column(|r| match r.part == *part {
                    true => motion.moves(r, &middle),
                    false => 0.0,
                });
                let mut dense = DVector::zeros(self.readings().len());
                for (row, value) in column.rows.iter().zip(column.values.iter()) {
                    dense[*row] = *value;
                }
                let size = dense.norm();
                if size > 0.0 {
                    columns.push(dense / size);
                }
            }
        }
        self.alignment = Some(match columns.is_empty() {
            true => DMatrix::zeros(self.readings().len(), 0),
            false => DMatrix::from_columns(&columns),
        });
        Ok(self)
    }

    /// Takes the turns of the parts off their readings.
    fn turn_back(&mut self) -> Result<(), MachineError> {
        for part in self.parts().to_vec() {
            let of_part = |r: &&PartReading| r.part == part;
            let Some((turn, middle)) = turn_of(self.readings().iter().filter(of_part)) else {
                continue;
            };
            let (vector, angle) = as_vector(&turn);
            if angle > MOST {
                return Err(MachineError::Turned { part, angle });
            }
            self.turned_back(&part, |p| turn * (p - middle) - (p - middle));
            self.turns.insert(part, vector);
        }
        Ok(())
    }

    /// Whether zero and turn of each part are unknowns of the model.
    #[must_use]
    pub fn is_aligned(&self) -> bool {
        self.alignment.is_some()
    }

    /// Zeros and turns of the parts that their readings determine, fitted to what the machine's model leaves;
    /// and the names, with the part, of those that they do not. Empty unless [`aligned`](Self::aligned).
    #[must_use]
    pub fn alignments(&self) -> (Vec<Alignment>, Vec<String>) {
        let (mut found, mut open) = (Vec::new(), Vec::new());
        if !self.is_aligned() {
            return (found, open);
        }
        let left = self.left();
        for part in self.parts() {
            let middle = self.middle(part);
            let rows: Vec<usize> = (0..left.len())
                .filter(|k| self.readings()[*k].part == *part)
                .collect();
            let of = |motion: Motion| {
                let values = rows
                    .iter()
                    .map(|k| motion.moves(&self.readings()[*k], &middle));
                DVector::from_iterator(rows.len(), values)
            };
            let moving: Vec<(Motion, DVector<f64>)> = Motion::ALL
                .into_iter()
                .map(|motion| (motion, of(motion)))
                .filter(|(_, column)| column.norm() > 0.0)
                .collect();
            let sizes: Vec<f64> = moving.iter().map(|(_, column)| column.norm()).collect();
            let unit = moving
                .iter()
                .zip(&sizes)
                .map(|((_, column), size)| column / *size);
            let unit: Vec<DVector<f64>> = unit.collect();
            if unit.is_empty() {
                continue;
            }
            let columns = DMatrix::from_columns(&unit);
            let values = DVector::from_iterator(rows.len(), rows.iter().map(|k| left[*k]));
            let svd = columns.clone().svd(true, true);
            let least = RANK * svd.singular_values.amax();
            let rank = svd.singular_values.iter().filter(|s| **s > least).count();
            let (Ok(inverse), Some(right)) = (svd.clone().pseudo_inverse(least), &svd.v_t) else {
                continue;
            };
            let fitted = &inverse * &values;
            let residual = &values - &columns * &fitted;
            let degrees = rows.len().saturating_sub(rank);
            let variance = match degrees {
                0 => f64::NAN,
                _ => residual.norm_squared() / degrees as f64,
            };
            for (k, (motion, _)) in moving.iter().enumerate() {
                // The share of this unknown that lies in directions without any singular value.
                let told: f64 = (0..svd.singular_values.len())
                    .filter(|i| svd.singular_values[*i] > least)
                    .map(|i| right[(i, k)].powi(2))
                    .sum();
                if told < 1.0 - 1e-6 {
                    open.push(format!("{} of part {part}", motion.name()));
                    continue;
                }
                found.push(Alignment {
                    part: part.clone(),
                    name: motion.name(),
                    value: fitted[k] / sizes[k] + self.turned(part, *motion),
                    std: (variance * inverse.row(k).norm_squared()).sqrt() / sizes[k],
                    unit: motion.unit(),
                });
            }
        }
        (found, open)
    }

    /// What was taken off the readings of a part already, rad.
    fn turned(&self, part: &str, motion: Motion) -> f64 {
        match (motion, self.turns.get(part)) {
            (Motion::Turn(axis), Some(turn)) => turn[axis.index()],
            _ => 0.0,
        }
    }

    /// The middle of the points of a part.
    fn middle(&self, part: &str) -> Position {
        let of_part = self.readings().iter().filter(|r| r.part == part);
        let (sum, count) = of_part.fold((Position::zeros(), 0.0), |(sum, count), r| {
            (sum + r.position, count + 1.0)
        });
        sum / f64::max(count, 1.0)
    }
}
