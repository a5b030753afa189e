//! The design matrix of a set of readings, its rank and its null space.

use super::components::{Axis, Component, NodeKind};
use super::diagonals::{Diagonal, Sequence, Target, Travel, WorkZone};
use super::elimination::Elimination;
use super::prediction::{Parameter, Unknowns, sensitivities};
use super::readings::{DiagonalError, DiagonalReading, Run};
use super::undetermined::Undetermined;
use errsep_solvers::linear::limited;
use nalgebra::{DMatrix, DVector};
use std::collections::HashMap;

/// Singular values below this share of the greatest count as zero: the entries carry some 1e-13 of
/// rounding, the least effect that a grid of twenty steps can show is about 1e-4.
pub(super) const RANK_TOLERANCE: f64 = 1e-9;

/// µm that a rotation of 1 rad makes at a lever of 1 mm.
const UM_PER_RAD_MM: f64 = 1e3;

/// What is tabulated over the positions of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Function {
    /// The mean of both senses of travel.
    Error(Component),
    /// The positive less the negative sense.
    Reversal(Component),
}

impl Function {
    pub(super) const fn component(self) -> Component {
        match self {
            Self::Error(component) | Self::Reversal(component) => component,
        }
    }
}

/// A design: what each reading sees, columns scaled to µm. Readings at the same stop of a set-up see the
/// same, but for the zero of their run.
#[derive(Debug, Clone)]
pub(super) struct Design {
    pub(super) unknowns: Unknowns,
    /// A parameter is its scaled value times this: µm or rad.
    pub(super) scale: DVector<f64>,
    /// Runs, each of which costs one degree of freedom.
    pub(super) runs: Vec<Run>,
    /// Run of each reading.
    pub(super) run_of: Vec<usize>,
    /// For each stop the places of the unknowns it sees, and the readings' derivatives by the scaled
    /// unknowns.
    pub(super) stops: Vec<Vec<(usize, f64)>>,
    /// Stop of each reading.
    pub(super) stop_of: Vec<usize>,
}

/// Whether a parameter is zero by definition of where the errors are counted from: functions at
/// corner A, straightness at both ends.
pub(super) fn is_definition(parameter: Parameter, steps: usize) -> bool {
    match parameter {
        Parameter::Node(_, 0) => true,
        Parameter::Node(component, index) => {
            component.kind() == NodeKind::Straightness && index == steps
        }
        _ => false,
    }
}

impl Design {
    /// The design of `readings` in the parameters that `keep` accepts.
    pub(super) fn of(
        zone: &WorkZone,
        readings: &[DiagonalReading],
        keep: impl Fn(Parameter) -> bool,
    ) -> Self {
        let mut known = HashMap::new();
        let mut seen = Vec::new();
        let stop_of: Vec<usize> = readings
            .iter()
            .map(|r| {
                *known
                    .entry((r.diagonal, r.target, r.at, r.travel))
                    .or_insert_with(|| {
                        seen.push(sensitivities(zone, r.diagonal, r.target, r.at, r.travel));
                        seen.len() - 1
                    })
            })
            .collect();
        // An axis that stands still adds a constant rotation of the tool, which is mirror misalignment
        // under another name.
        let moves = |axis: Axis| {
            readings
                .iter()
                .any(|r| r.diagonal.signs()[axis.index()] != 0)
        };
        let moving = Axis::ALL.map(moves);
        // Without a way back the usual analysis, which takes no axis to depend on its sense of travel.
        let back = readings.iter().any(|r| r.travel == Travel::Backward);
        let wanted = |p: Parameter| {
            let of_model = match p {
                Parameter::Node(c, _) => moving[c.axis.index()],
                Parameter::Reversal(..) => back,
                Parameter::Squareness(_) | Parameter::Mirror(..) => true,
            };
            of_model && keep(p)
        };
        let mut touched = vec![None; Parameter::count(zone.steps)];
        for &(parameter, _) in seen.iter().flatten() {
            touched[parameter.number(zone.steps)] = Some(parameter);
        }
        let unknowns = Unknowns::of(touched.into_iter().flatten().filter(|&p| wanted(p)));
        let mut places = vec![None; Parameter::count(zone.steps)];
        for (place, parameter) in unknowns.parameters.iter().enumerate() {
            places[parameter.number(zone.steps)] = Some(place);
        }
        let diagonal = zone.travel.iter().map(|t| t * t).sum::<f64>().sqrt();
        let scale = DVector::from_iterator(
            unknowns.parameters.len(),
            unknowns.parameters.iter().map(|p| match p {
                Parameter::Node(c, _) | Parameter::Reversal(c, _) if !c.rotation => 1.0,
                _ => 1.0 / (UM_PER_RAD_MM * diagonal),
            }),
        );
        let mut runs: Vec<Run> = readings.iter().map(DiagonalReading::run).collect();
        runs.sort_unstable();
        runs.dedup();
        let run_of: Vec<usize> = readings
            .iter()
            .map(|r| runs.partition_point(|run| *run < r.run()))
            .collect();
        let stops = seen
            .iter()
            .map(|terms| {
                terms
                    .iter()
                    .filter_map(|&(parameter, value)| {
                        let place = places[parameter.number(zone.steps)]?;
                        Some((place, value * scale[place]))
                    })
                    .collect()
            })
            .collect();
        Self {
            unknowns,
            scale,
            runs,
            run_of,
            stops,
            stop_of,
        }
    }

    /// Readings × parameters, per scaled parameter, each run with mean zero in every column.
    pub(super) fn dense(&self) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.stop_of.len(), self.unknowns.parameters.len());
        for (row, &stop) in self.stop_of.iter().enumerate() {
            for &(place, value) in &self.stops[stop] {
                matrix[(row, place)] = value;
            }
        }
        for column in 0..matrix.ncols() {
            let mut values: DVector<f64> = matrix.column(column).into();
            self.free_of_zero(&mut values);
            matrix.set_column(column, &values);
        }
        matrix
    }

    /// Sensitivity of each reading to each of the unknowns it sees, per µm or rad.
    pub(super) fn sensitivities(&self) -> Vec<Vec<(usize, f64)>> {
        let unscaled = |terms: &Vec<(usize, f64)>| -> Vec<(usize, f64)> {
            let terms = terms.iter();
            terms.map(|&(j, a)| (j, a / self.scale[j])).collect()
        };
        let stops: Vec<_> = self.stops.iter().map(unscaled).collect();
        self.stop_of
            .iter()
            .map(|&stop| stops[stop].clone())
            .collect()
    }

    /// Mᵀr of residuals r whose runs have mean zero.
    pub(super) fn gradient(&self, residuals: &DVector<f64>) -> DVector<f64> {
        let mut sums = vec![0.0; self.stops.len()];
        for (r, &stop) in residuals.iter().zip(&self.stop_of) {
            sums[stop] += r;
        }
        let mut gradient = DVector::zeros(self.scale.len());
        for (terms, sum) in self.stops.iter().zip(sums) {
            for &(place, a) in terms {
                gradient[place] += a * sum;
            }
        }
        gradient
    }

    /// Observed less predicted, each run with mean zero, µm.
    pub(super) fn residuals(&self, observed: &DVector<f64>, scaled: &DVector<f64>) -> DVector<f64> {
        let predicted: Vec<f64> = self
            .stops
            .iter()
            .map(|terms| terms.iter().map(|&(place, a)| a * scaled[place]).sum())
            .collect();
        let mut left = DVector::from_iterator(
            observed.len(),
            observed
                .iter()
                .zip(&self.stop_of)
                .map(|(o, &stop)| o - predicted[stop]),
        );
        self.free_of_zero(&mut left);
        left
    }

    /// Takes the mean of each run off: the unknown zero of the laser, eliminated.
    pub(super) fn free_of_zero(&self, values: &mut DVector<f64>) {
        let mut sums = vec![(0.0, 0.0); self.runs.len()];
        for (value, &run) in values.iter().zip(&self.run_of) {
            sums[run].0 += value;
            sums[run].1 += 1.0;
        }
        for (value, &run) in values.iter_mut().zip(&self.run_of) {
            *value -= sums[run].0 / sums[run].1;
        }
    }
}

/// Singular value decomposition of a tall matrix by way of its triangle, split at the rank.
pub(super) struct Decomposition {
    /// Right singular vectors with their singular values, greatest first, down to the rank.
    pub(super) determined: Vec<(f64, DVector<f64>)>,
    /// Orthonormal basis of the null space, n × nullity.
    pub(super) null: DMatrix<f64>,
}

/// Singular values below `floor` or a billionth of the greatest count as zero.
pub(super) fn decompose(matrix: &DMatrix<f64>, floor: f64) -> Result<Decomposition, DiagonalError> {
    let n = matrix.ncols();
    if matrix.is_empty() {
        return Ok(Decomposition {
            determined: Vec::new(),
            null: DMatrix::identity(n, n),
        });
    }
    let triangle = if matrix.nrows() > n {
        matrix.clone().qr().unpack_r()
    } else {
        let mut square = DMatrix::zeros(n, n);
        square.rows_mut(0, matrix.nrows()).copy_from(matrix);
        square
    };
    let svd = limited::svd(triangle, false, true).ok_or_else(|| DiagonalError::Numerical {
        reason: "the singular values did not converge".to_owned(),
    })?;
    let v_t = svd.v_t.ok_or_else(|| DiagonalError::Numerical {
        reason: "no singular vectors".to_owned(),
    })?;
    let greatest = svd.singular_values.iter().copied().fold(0.0, f64::max);
    let mut determined = Vec::new();
    let mut null = Vec::new();
    for (i, &value) in svd.singular_values.iter().enumerate() {
        let vector: DVector<f64> = v_t.row(i).transpose();
        if value > floor.max(RANK_TOLERANCE * greatest) {
            determined.push((value, vector));
        } else {
            null.push(vector);
        }
    }
    let null = if null.is_empty() {
        DMatrix::zeros(n, 0)
    } else {
        DMatrix::from_columns(&null)
    };
    Ok(Decomposition { determined, null })
}

/// What readings of a design leave open.
///
/// # Errors
/// Singular values do not converge.
pub(super) fn left_open(design: &Design, zone: &WorkZone) -> Result<Undetermined, DiagonalError> {
    let blank = DVector::zeros(design.stop_of.len());
    let triangle = Elimination::of(design, zone, &blank)?;
    let border = decompose(&triangle.corner, triangle.floor)?;
    triangle.undetermined(&border.null)
}

/// How much a set of runs can determine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identifiability {
    /// Independent readings: stops less one per run, whose zero is arbitrary.
    pub readings: usize,
    /// Parameters that the readings touch, those of definition included.
    pub parameters: usize,
    /// Independent combinations that the readings determine.
    pub rank: usize,
    /// Parameters left once those of definition are taken as zero.
    pub defined_parameters: usize,
    /// The rank in those: the same, if the definitions cost nothing.
    pub defined_rank: usize,
}

/// Counts for one run of each (diagonal, target, sequence).
///
/// # Errors
/// [`DiagonalError::Numerical`] if the decomposition fails.
pub fn identifiability(
    zone: &WorkZone,
    runs: &[(Diagonal, Target, Sequence)],
) -> Result<Identifiability, DiagonalError> {
    let readings = blank_readings(zone, runs);
    let blank = DVector::zeros(readings.len());
    let all = Design::of(zone, &readings, |_| true);
    let defined = Design::of(zone, &readings, |p| !is_definition(p, zone.steps));
    Ok(Identifiability {
        readings: readings.len() - all.runs.len(),
        parameters: all.unknowns.parameters.len(),
        rank: Elimination::of(&all, zone, &blank)?.rank()?,
        defined_parameters: defined.unknowns.parameters.len(),
        defined_rank: Elimination::of(&defined, zone, &blank)?.rank()?,
    })
}

/// Readings of value zero at every stop of the runs.
pub(super) fn blank_readings(
    zone: &WorkZone,
    runs: &[(Diagonal, Target, Sequence)],
) -> Vec<DiagonalReading> {
    runs.iter()
        .flat_map(|&(diagonal, target, sequence)| {
            zone.stops(diagonal, sequence)
                .into_iter()
                .map(move |at| DiagonalReading {
                    diagonal,
                    target,
                    sequence,
                    repeat: 1,
                    travel: Travel::Forward,
                    at,
                    value: 0.0,
                })
        })
        .collect()
}

/// Places of the free nodes of a function, in order of their grid index.
pub(super) fn nodes_of(unknowns: &Unknowns, function: Function) -> Vec<(usize, usize)> {
    unknowns
        .parameters
        .iter()
        .enumerate()
        .filter_map(|(place, p)| match p {
            Parameter::Node(c, index) if Function::Error(*c) == function => Some((place, *index)),
            Parameter::Reversal(c, index) if Function::Reversal(*c) == function => {
                Some((place, *index))
            }
            _ => None,
        })
        .collect()
}
