//! Signatures that are the same in all readings of a cell, or turn with the direction only, stored
//! once a cell: their products with the readings then cost a fraction.

use std::collections::BTreeMap;

use errsep_models::model::{Column, Place};
use nalgebra::{DMatrix, DVector};

/// How a column repeats itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Rows are readings.
    Plain,
    /// Rows are cells; all readings of a cell have the value.
    Even,
    /// Rows are cells; a reading has the value times its direction.
    Odd,
}

/// A column in its shortest form.
#[derive(Debug, Clone)]
pub(in crate::diagnosis) struct Folded {
    kind: Kind,
    rows: Vec<u32>,
    values: Vec<f64>,
}

/// The readings of every cell.
#[derive(Debug, Clone)]
pub(in crate::diagnosis) struct Folding {
    cell: Vec<u32>,
    direction: Vec<f64>,
    members: Vec<Vec<u32>>,
}

/// A vector over the readings with its sums over the cells.
pub(in crate::diagnosis) struct Sums {
    plain: Vec<f64>,
    even: Vec<f64>,
    odd: Vec<f64>,
}

/// Several vectors over the readings with their sums, one a row of `BATCH` values.
pub(in crate::diagnosis) struct BatchSums<const BATCH: usize> {
    plain: Vec<[f32; BATCH]>,
    even: Vec<[f32; BATCH]>,
    odd: Vec<[f32; BATCH]>,
}

impl Folding {
    pub fn new(places: &[Place]) -> Self {
        let mut order: BTreeMap<usize, u32> = BTreeMap::new();
        let mut members: Vec<Vec<u32>> = Vec::new();
        let mut cell = Vec::with_capacity(places.len());
        for (row, place) in places.iter().enumerate() {
            let at = *order.entry(place.cell).or_insert_with(|| {
                members.push(Vec::new());
                members.len() as u32 - 1
            });
            members[at as usize].push(row as u32);
            cell.push(at);
        }
        Self {
            cell,
            direction: places.iter().map(|p| p.direction).collect(),
            members,
        }
    }

    /// The shortest form of a column.
    pub fn fold(&self, column: &Column) -> Folded {
        let mut sum: Vec<Option<(f64, f64)>> = vec![None; self.members.len()];
        let mut count = vec![0u32; self.members.len()];
        let (mut even, mut odd) = (true, true);
        for (&row, &value) in column.rows.iter().zip(&column.values) {
            let (cell, turned) = (self.cell[row] as usize, value * self.direction[row]);
            count[cell] += 1;
            match sum[cell] {
                None => sum[cell] = Some((value, turned)),
                Some((v, t)) => {
                    even &= v == value;
                    odd &= t == turned;
                }
            }
        }
        let whole =
            (0..count.len()).all(|k| count[k] == 0 || count[k] as usize == self.members[k].len());
        let touched = count.iter().filter(|c| **c > 0).count();
        if !(whole && (even || odd) && touched < column.rows.len()) {
            return Folded {
                kind: Kind::Plain,
                rows: column.rows.iter().map(|r| *r as u32).collect(),
                values: column.values.clone(),
            };
        }
        let (rows, values) = sum
            .iter()
            .enumerate()
            .filter_map(|(k, s)| s.map(|(v, t)| (k as u32, if even { v } else { t })))
            .unzip();
        Folded {
            kind: if even { Kind::Even } else { Kind::Odd },
            rows,
            values,
        }
    }

    /// The column again.
    pub fn unfold(&self, folded: &Folded) -> Column {
        let mut column = Column::default();
        for (&row, &value) in folded.rows.iter().zip(&folded.values) {
            if folded.kind == Kind::Plain {
                column.rows.push(row as usize);
                column.values.push(value);
                continue;
            }
            for &reading in &self.members[row as usize] {
                let reading = reading as usize;
                column.rows.push(reading);
                column.values.push(match folded.kind {
                    Kind::Odd => value * self.direction[reading],
                    _ => value,
                });
            }
        }
        column
    }

    /// A vector with its sums.
    pub fn sums(&self, vector: &DVector<f64>) -> Sums {
        let over = |value: &dyn Fn(usize) -> f64| -> Vec<f64> {
            self.members
                .iter()
                .map(|cell| cell.iter().map(|r| value(*r as usize)).sum())
                .collect()
        };
        Sums {
            even: over(&|r| vector[r]),
            odd: over(&|r| vector[r] * self.direction[r]),
            plain: vector.as_slice().to_vec(),
        }
    }

    /// The columns of a matrix with their sums. Single precision: what these products are for is a
    /// law found by drawing, and signatures of which less than 10⁻⁴ is visible are not drawn.
    pub fn batch_sums<const BATCH: usize>(&self, columns: &DMatrix<f64>) -> BatchSums<BATCH> {
        let mut plain = vec![[0f32; BATCH]; columns.nrows()];
        for (k, column) in columns.column_iter().enumerate() {
            for (row, value) in plain.iter_mut().zip(column.iter()) {
                row[k] = *value as f32;
            }
        }
        let over = |turned: bool| -> Vec<[f32; BATCH]> {
            self.members
                .iter()
                .map(|cell| {
                    let mut sum = [0f32; BATCH];
                    for &row in cell {
                        let sign = if turned {
                            self.direction[row as usize] as f32
                        } else {
                            1.0
                        };
                        for (s, v) in sum.iter_mut().zip(&plain[row as usize]) {
                            *s += sign * v;
                        }
                    }
                    sum
                })
                .collect()
        };
        BatchSums {
            even: over(false),
            odd: over(true),
            plain,
        }
    }
}

impl Folded {
    /// Its product with a vector.
    pub fn dot(&self, sums: &Sums) -> f64 {
        let vector = match self.kind {
            Kind::Plain => &sums.plain,
            Kind::Even => &sums.even,
            Kind::Odd => &sums.odd,
        };
        let terms = self.rows.iter().zip(&self.values);
        terms
            .map(|(row, value)| value * vector[*row as usize])
            .sum()
    }

    /// Its products with several vectors.
    pub fn batch_dot<const BATCH: usize>(&self, sums: &BatchSums<BATCH>) -> [f32; BATCH] {
        let vectors = match self.kind {
            Kind::Plain => &sums.plain,
            Kind::Even => &sums.even,
            Kind::Odd => &sums.odd,
        };
        let mut sum = [0f32; BATCH];
        for (&row, &value) in self.rows.iter().zip(&self.values) {
            let value = value as f32;
            for (s, v) in sum.iter_mut().zip(&vectors[row as usize]) {
                *s += value * v;
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn places() -> Vec<Place> {
        (0..24)
            .map(|k| Place {
                channel: 0,
                x: f64::from(k % 4),
                time: f64::from(k),
                repeat: (k / 8) as u32,
                direction: if k / 4 % 2 == 0 { 1.0 } else { -1.0 },
                cell: (k % 4) as usize,
            })
            .collect()
    }

    proptest! {
        /// Folding changes neither the column nor its products, whichever way it repeats itself.
        #[test]
        fn a_folded_column_is_the_column(
            values in prop::collection::vec(-2.0f64..2.0, 4),
            vector in prop::collection::vec(-2.0f64..2.0, 24),
            kind in 0usize..3,
        ) {
            let places = places();
            let folding = Folding::new(&places);
            let column = Column::from_places(&places, |k, p| match kind {
                0 => values[p.cell],
                1 => values[p.cell] * p.direction,
                _ => values[p.cell] * (k as f64).sin(),
            });
            let folded = folding.fold(&column);
            let vector = DVector::from_vec(vector);
            let back = folding.unfold(&folded).dense(24);
            prop_assert_eq!(&back, &column.dense(24));
            // Rounding of 24 terms below 4, in double and in single precision.
            let product = back.dot(&vector);
            prop_assert!((folded.dot(&folding.sums(&vector)) - product).abs() < 1e-13);
            let batch = folding.batch_sums::<1>(&DMatrix::from_column_slice(24, 1, vector.as_slice()));
            prop_assert!((f64::from(folded.batch_dot(&batch)[0]) - product).abs() < 1e-4);
            if kind < 2 {
                prop_assert!(folded.rows.len() <= 4);
            }
        }
    }
}
