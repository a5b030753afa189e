//! Runs over the same stops taken together, and what their readings say of their zeros.

use super::design::Design;
use super::diagonals::{Diagonal, Target};
use errsep_solvers::linear::banded::{Tall, compress};
use nalgebra::DVector;
use std::collections::BTreeMap;

/// The mean reading of runs over the same stops at one of them.
pub(super) struct Reading {
    pub(super) zero: usize,
    /// How many runs they are.
    pub(super) count: f64,
    /// µm.
    pub(super) value: f64,
}

/// The readings of each stop, runs over the same stops taken together.
pub(super) struct Runs {
    pub(super) readings: Vec<Vec<Reading>>,
    /// The set-up of each zero.
    pub(super) zeros: Vec<(Diagonal, Target)>,
}

impl Runs {
    pub(super) fn of(design: &Design, observed: &DVector<f64>) -> Self {
        let mut runs: Vec<Vec<(usize, f64)>> = vec![Vec::new(); design.runs.len()];
        for (reading, (&run, &stop)) in design.run_of.iter().zip(&design.stop_of).enumerate() {
            runs[run].push((stop, observed[reading]));
        }
        let mut alike: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
        for (number, run) in runs.iter_mut().enumerate() {
            run.sort_by_key(|r| r.0);
            let stops = run.iter().map(|r| r.0).collect();
            alike.entry(stops).or_default().push(number);
        }
        let mut found = Self {
            readings: Vec::new(),
            zeros: Vec::new(),
        };
        found.readings.resize_with(design.stops.len(), Vec::new);
        for (stops, numbers) in alike {
            let count = numbers.len() as f64;
            for (k, &stop) in stops.iter().enumerate() {
                let sum: f64 = numbers.iter().map(|&number| runs[number][k].1).sum();
                found.readings[stop].push(Reading {
                    zero: found.zeros.len(),
                    count,
                    value: sum / count,
                });
            }
            let (diagonal, target, ..) = design.runs[numbers[0]];
            found.zeros.push((diagonal, target));
        }
        found
    }

    /// What the readings of each stop say about the zeros alone: with w the roots of the counts, all
    /// directions across w, by the reflection that turns w into a multiple of the first.
    pub(super) fn differences(&self, unknowns: usize, rest: &mut Gathered) {
        let mut setups: BTreeMap<(Diagonal, Target), Vec<usize>> = BTreeMap::new();
        let mut place = Vec::with_capacity(self.zeros.len());
        for (zero, &setup) in self.zeros.iter().enumerate() {
            let zeros = setups.entry(setup).or_default();
            place.push((setup, zeros.len()));
            zeros.push(zero);
        }
        let mut gathered: BTreeMap<(Diagonal, Target), Gathered> = setups
            .iter()
            .map(|(&setup, zeros)| (setup, Gathered::new(zeros.len() + 1)))
            .collect();
        for readings in &self.readings {
            let Some(gathered) = readings
                .first()
                .and_then(|r| gathered.get_mut(&self.zeros[r.zero]))
            else {
                continue;
            };
            let mut u: Vec<f64> = readings.iter().map(|r| r.count.sqrt()).collect();
            u[0] += u.iter().map(|w| w * w).sum::<f64>().sqrt();
            let factor = 2.0 / u.iter().map(|u| u * u).sum::<f64>();
            let last = gathered.columns - 1;
            for j in 1..readings.len() {
                let mut row = vec![0.0; gathered.columns];
                for (i, r) in readings.iter().enumerate() {
                    let reflected = f64::from(i == j) - factor * u[j] * u[i];
                    let a = reflected * r.count.sqrt();
                    row[place[r.zero].1] = a;
                    row[last] += a * r.value;
                }
                gathered.push(&row);
            }
        }
        for (gathered, zeros) in gathered.into_values().zip(setups.values()) {
            let columns = gathered.columns;
            for row in gathered.finish().chunks_exact(columns).take(zeros.len()) {
                let mut out = vec![0.0; rest.columns];
                for (&zero, value) in zeros.iter().zip(row) {
                    out[unknowns + zero] = *value;
                }
                out[rest.columns - 1] = row[columns - 1];
                rest.push(&out);
            }
        }
    }
}

/// Rows over few columns, gathered into a triangle.
pub(super) struct Gathered {
    columns: usize,
    waiting: Tall,
    triangle: Vec<f64>,
}

impl Gathered {
    pub(super) fn new(columns: usize) -> Self {
        let mut waiting = Tall::new(columns);
        waiting.reset(0, columns);
        Self {
            columns,
            waiting,
            triangle: vec![0.0; columns * columns],
        }
    }

    pub(super) fn push(&mut self, row: &[f64]) {
        let at = self.waiting.rows();
        self.waiting.reset(at + 1, self.columns);
        for (j, value) in row.iter().enumerate() {
            self.waiting.column_mut(j)[at] = *value;
        }
        if at + 1 == Tall::CAPACITY {
            self.bring_in();
        }
    }

    fn bring_in(&mut self) {
        compress(&mut self.waiting, &mut self.triangle);
        self.waiting.reset(0, self.columns);
    }

    /// Columns × columns, by rows.
    pub(super) fn finish(mut self) -> Vec<f64> {
        self.bring_in();
        self.triangle
    }
}
