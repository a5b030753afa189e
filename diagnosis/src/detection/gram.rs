//! EᵀPE of sparse signatures without ever making P L⁻¹E.

use std::ops::Range;
use std::sync::Arc;

use errsep_models::model::Column;
use nalgebra::{DMatrix, DVector};

use crate::detection::space::Space;
use crate::levels::INVISIBLE;

impl Space {
    /// EᵀPE of sparse signatures without ever making P L⁻¹E: the cost is that of the traces in
    /// which a signature is.
    pub fn gram(&self, columns: &[Column]) -> Gram {
        let parts: Vec<Part> = columns.iter().map(|c| self.part(c)).collect();
        let gram = DMatrix::from_fn(parts.len(), parts.len(), |i, j| {
            if j < i {
                0.0
            } else {
                parts[i].product(&parts[j], self)
            }
        });
        Gram {
            whole: parts.iter().map(|p| p.square).sum(),
            matrix: DMatrix::from_fn(parts.len(), parts.len(), |i, j| gram[(i.min(j), i.max(j))]),
        }
    }

    /// A signature as it is whitened, and what the fit absorbs of it.
    pub fn part(&self, column: &Column) -> Part {
        let (whitened, touched) = self.whitened_by_traces(column);
        let sums = self.patterns.as_ref().map_or_else(
            || DMatrix::zeros(0, 0),
            |patterns| {
                let length = self.traces.first().map_or(0, Range::len);
                let mut sums = DMatrix::zeros(length, patterns.ncols());
                for &t in &touched {
                    let values = whitened.rows(self.traces[t].start, length);
                    for k in 0..patterns.ncols() {
                        if patterns[(t, k)] != 0.0 {
                            sums.column_mut(k).axpy(patterns[(t, k)], &values, 1.0);
                        }
                    }
                }
                sums
            },
        );
        let along = |basis: &DMatrix<f64>| {
            DVector::from_iterator(
                basis.ncols(),
                basis.column_iter().map(|direction| {
                    touched
                        .iter()
                        .map(|&t| {
                            let trace = &self.traces[t];
                            direction
                                .rows(trace.start, trace.len())
                                .dot(&whitened.rows(trace.start, trace.len()))
                        })
                        .sum()
                }),
            )
        };
        Part {
            returned: along(&self.returned),
            absorbed: along(&self.absorbed),
            loose: along(&self.loose.in_squares),
            square: whitened.norm_squared(),
            sums,
            touched,
            whitened,
        }
    }

    /// A signature whitened, and the traces in which it is then. Many signatures are one profile times a sign in each
    /// trace: such a profile is whitened once.
    fn whitened_by_traces(&self, column: &Column) -> (DVector<f64>, Vec<usize>) {
        let mut whitened = DVector::zeros(self.readings);
        let mut seen = vec![false; self.traces.len()];
        for (&row, &value) in column.rows.iter().zip(&column.values) {
            whitened[row] += value;
            seen[self.trace_of[row] as usize] = true;
        }
        let touched: Vec<usize> = (0..seen.len()).filter(|t| seen[*t]).collect();
        let mut model: Option<(usize, Vec<f64>)> = None;
        for &t in &touched {
            let trace = self.traces[t].clone();
            let values = &whitened.as_slice()[trace.clone()];
            let same = |sign: f64, raw: &[f64]| {
                raw.len() == values.len() && raw.iter().zip(values).all(|(a, b)| *a == sign * b)
            };
            let known = model.as_ref().and_then(|(from, raw)| {
                if !Arc::ptr_eq(&self.whitening[*from], &self.whitening[t]) {
                    None
                } else if same(1.0, raw) {
                    Some((*from, 1.0))
                } else {
                    same(-1.0, raw).then_some((*from, -1.0))
                }
            });
            if let Some((from, sign)) = known {
                let from = self.traces[from].start;
                for k in 0..trace.len() {
                    whitened[trace.start + k] = sign * whitened[from + k];
                }
            } else {
                model = Some((t, values.to_vec()));
                self.whitening[t].whiten(&mut whitened.as_mut_slice()[trace]);
            }
        }
        if let Some(root) = &self.scatter {
            // It joins readings of different traces.
            root.apply(whitened.as_mut_slice());
            return (whitened, (0..self.traces.len()).collect());
        }
        (whitened, touched)
    }

    /// The part of a signature that is another in some traces, `column` holding what it is there.
    /// Not for scatter that the model expects, which joins readings of different traces.
    pub fn replaced(&self, part: &Part, column: &Column, traces: &[usize]) -> Part {
        let mut new = part.clone();
        for &t in traces {
            new.whitened
                .rows_mut(self.traces[t].start, self.traces[t].len())
                .fill(0.0);
        }
        for (&row, &value) in column.rows.iter().zip(&column.values) {
            new.whitened[row] += value;
        }
        for &t in traces {
            let trace = self.traces[t].clone();
            let (from, length) = (trace.start, trace.len());
            self.whitening[t].whiten(&mut new.whitened.as_mut_slice()[trace]);
            let now = new.whitened.rows(from, length);
            let change = now - part.whitened.rows(from, length);
            new.square += change.dot(&(now + part.whitened.rows(from, length)));
            if let Some(patterns) = &self.patterns {
                for k in 0..patterns.ncols() {
                    new.sums.column_mut(k).axpy(patterns[(t, k)], &change, 1.0);
                }
            }
            for (along, basis) in [
                (&mut new.returned, &self.returned),
                (&mut new.absorbed, &self.absorbed),
                (&mut new.loose, &self.loose.in_squares),
            ] {
                for (along, direction) in along.iter_mut().zip(basis.column_iter()) {
                    *along += direction.rows(from, length).dot(&change);
                }
            }
        }
        let also = traces.iter().filter(|t| !part.touched.contains(t));
        new.touched.extend(also);
        new
    }
}

/// EᵀPE of a signature and what goes with it.
pub(crate) struct Gram {
    /// EᵀPE.
    pub matrix: DMatrix<f64>,
    /// Σ |L⁻¹E|².
    pub whole: f64,
}

impl Gram {
    /// Whether the fit leaves enough of the signatures to be looked for.
    pub fn is_visible(&self) -> bool {
        self.matrix.trace() > INVISIBLE * self.whole
    }
}

/// A whitened column and what the fit absorbs of it.
#[derive(Clone)]
pub(crate) struct Part {
    whitened: DVector<f64>,
    touched: Vec<usize>,
    sums: DMatrix<f64>,
    returned: DVector<f64>,
    absorbed: DVector<f64>,
    loose: DVector<f64>,
    square: f64,
}

impl Part {
    /// What the fit leaves of its square; nothing where that is too little to be looked for.
    pub fn visible_square(&self, space: &Space) -> Option<f64> {
        let left = self.product(self, space);
        (left > INVISIBLE * self.square).then_some(left)
    }

    /// Eᵢᵀ L⁻ᵀ P L⁻¹ Eⱼ.
    pub fn product(&self, other: &Self, space: &Space) -> f64 {
        let whole: f64 = if std::ptr::eq(self, other) {
            self.square
        } else {
            self.touched
                .iter()
                .map(|&t| {
                    let (from, length) = (space.traces[t].start, space.traces[t].len());
                    self.whitened
                        .rows(from, length)
                        .dot(&other.whitened.rows(from, length))
                })
                .sum()
        };
        whole - self.sums.dot(&other.sums) + self.returned.dot(&other.returned)
            - self.absorbed.dot(&other.absorbed)
            - self.loose.dot(&other.loose)
    }
}
