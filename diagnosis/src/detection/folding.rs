//! Signatures that are the same in all readings of a cell, or turn with the direction only, stored
//! once a cell: their products with the readings then cost a fraction.

use std::collections::BTreeMap;

use errsep_models::model::{Column, Place};
use nalgebra::{DMatrixView, RealField};

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
pub(crate) struct Folded {
    kind: Kind,
    rows: Vec<u32>,
    values: Vec<f64>,
}

/// The readings of every cell.
#[derive(Debug, Clone)]
pub(crate) struct Folding {
    cell: Vec<u32>,
    direction: Vec<f64>,
    members: Vec<Vec<u32>>,
}

/// Several vectors over the readings with their sums over the cells, one a row of `BATCH` values.
pub(crate) struct Sums<T, const BATCH: usize> {
    plain: Vec<[T; BATCH]>,
    even: Vec<[T; BATCH]>,
    odd: Vec<[T; BATCH]>,
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

    /// The columns of a matrix, at most `BATCH`, with their sums.
    pub fn sums<T: RealField + Copy, const BATCH: usize>(
        &self,
        columns: DMatrixView<'_, f64>,
    ) -> Sums<T, BATCH> {
        let mut plain = vec![[T::zero(); BATCH]; columns.nrows()];
        for (k, column) in columns.column_iter().enumerate() {
            for (row, value) in plain.iter_mut().zip(column.iter()) {
                row[k] = nalgebra::convert(*value);
            }
        }
        let over = |turned: bool| -> Vec<[T; BATCH]> {
            let of_cell = |cell: &Vec<u32>| {
                let mut sum = [T::zero(); BATCH];
                for &row in cell {
                    let sign = if turned {
                        nalgebra::convert(self.direction[row as usize])
                    } else {
                        T::one()
                    };
                    for (s, v) in sum.iter_mut().zip(&plain[row as usize]) {
                        *s += sign * *v;
                    }
                }
                sum
            };
            self.members.iter().map(of_cell).collect()
        };
        Sums {
            even: over(false),
            odd: over(true),
            plain,
        }
    }
}

impl Folded {
    /// Its products with several vectors.
    pub fn dot<T: RealField + Copy, const BATCH: usize>(
        &self,
        sums: &Sums<T, BATCH>,
    ) -> [T; BATCH] {
        let vectors = match self.kind {
            Kind::Plain => &sums.plain,
            Kind::Even => &sums.even,
            Kind::Odd => &sums.odd,
        };
        let mut sum = [T::zero(); BATCH];
        for (&row, &value) in self.rows.iter().zip(&self.values) {
            let value: T = nalgebra::convert(value);
            for (s, v) in sum.iter_mut().zip(&vectors[row as usize]) {
                *s += value * *v;
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
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
            let matrix = DMatrix::from_columns(&[-&vector, vector]);
            let double = folding.sums::<f64, 2>(matrix.as_view());
            prop_assert!((folded.dot(&double)[1] - product).abs() < 1e-13);
            let single = folding.sums::<f32, 3>(matrix.as_view());
            prop_assert!((f64::from(folded.dot(&single)[0]) + product).abs() < 1e-4);
            if kind < 2 {
                prop_assert!(folded.rows.len() <= 4);
            }
        }
    }
}
