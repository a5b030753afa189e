//! All identifiable combinations of the errors at once, from all readings.

use super::components::{Axis, Component, Location};
use super::design::{Decomposition, Design, decompose, is_definition, nodes_of};
use super::determination::{
    Ambiguity, Determined, Remedy, ambiguities, determination, end_slope, line_of, remedies,
};
use super::diagonals::{Diagonal, Target, WorkZone};
use super::prediction::Parameter;
use super::readings::{DiagonalError, DiagonalReading, check};
use crate::uncertainty::DegreesOfFreedom;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// A positioning slope measured by other means.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Axis.
    pub axis: Axis,
    /// Slope by end points, µm/mm.
    pub slope: f64,
    /// Its standard uncertainty, µm/mm.
    pub std: f64,
}

/// What is taken from elsewhere.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Assumptions {
    /// Errors taken as zero: the usual analysis takes all nine angular ones.
    pub zero: Vec<Component>,
    /// Slopes that were measured.
    pub slopes: Vec<Measured>,
    /// Standard deviation of one reading, µm, where it is known.
    pub noise: Option<f64>,
}

/// One error function.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ComponentEstimate {
    /// Which.
    pub component: Component,
    /// How far the readings determine it.
    pub determined: Determined,
    /// Grid positions, mm.
    pub positions: Vec<f64>,
    /// Values there, µm or rad: from corner A where determined wholly (straightness: from the line
    /// through its ends), from the line through the ends where only the shape is, else the determined
    /// part. Empty where nothing is.
    pub values: Vec<f64>,
    /// Standard uncertainties; empty where the noise is not known.
    pub std: Vec<f64>,
}

/// One squareness error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LocationEstimate {
    /// Which.
    pub location: Location,
    /// Whether it is determined.
    pub determined: Determined,
    /// The paper's S, rad, where determined.
    pub value: Option<f64>,
    /// Its standard uncertainty, rad.
    pub std: Option<f64>,
}

/// One misalignment angle of the mirror of one set-up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MirrorEstimate {
    /// Diagonal.
    pub diagonal: Diagonal,
    /// Target.
    pub target: Target,
    /// Number of the direction in [`Diagonal::mirror_axes`].
    pub direction: usize,
    /// Angle, rad, where determined.
    pub value: Option<f64>,
    /// Its standard uncertainty, rad.
    pub std: Option<f64>,
}

/// The result of the regression.
#[derive(Debug, Clone)]
pub struct StepDiagonalFit {
    /// The 18 functions, in the order of [`Component::all`].
    pub components: Vec<ComponentEstimate>,
    /// The three squareness errors.
    pub squareness: Vec<LocationEstimate>,
    /// The mirrors.
    pub mirrors: Vec<MirrorEstimate>,
    /// Unknowns, definitions taken out.
    pub parameters: usize,
    /// Independent combinations determined.
    pub rank: usize,
    /// What cannot be told apart.
    pub ambiguities: Vec<Ambiguity>,
    /// What would settle it.
    pub remedies: Vec<Remedy>,
    /// Standard deviation of one reading, µm: given or estimated; none without redundancy.
    pub noise: Option<f64>,
    /// How well that is known: infinite where it was given.
    pub noise_degrees_of_freedom: Option<DegreesOfFreedom>,
    /// Readings and measured slopes less runs less rank.
    pub degrees_of_freedom: usize,
    /// Reading less model, µm, in the order of the readings.
    pub residuals: Vec<f64>,
    /// Sensitivity of each reading to each of `names`, per µm or rad, freed from the zero of its run.
    pub jacobian: DMatrix<f64>,
    /// The parameters of the columns.
    pub names: Vec<Parameter>,
}

/// Estimates everything that the readings determine.
///
/// # Errors
/// What [`DiagonalError`] lists.
pub fn regress(
    zone: &WorkZone,
    readings: &[DiagonalReading],
    assumptions: &Assumptions,
) -> Result<StepDiagonalFit, DiagonalError> {
    check(zone, readings)?;
    for m in &assumptions.slopes {
        if !(m.std > 0.0 && m.std.is_finite() && m.slope.is_finite()) {
            return Err(DiagonalError::MeasuredUncertainty {
                what: format!("positioning slope of {}", m.axis.letter()),
            });
        }
    }
    let design = Design::of(zone, readings, |p| {
        !is_definition(p, zone.steps)
            && !matches!(p, Parameter::Node(c, _) if assumptions.zero.contains(&c))
    });
    let mut observed = DVector::from_iterator(readings.len(), readings.iter().map(|r| r.value));
    design.free_of_zero(&mut observed);

    let from_readings = Solution::of(&design.matrix, &observed)?;
    let freedom_of = |rank: usize, rows: usize| rows.saturating_sub(design.runs.len() + rank);
    let readings_alone = freedom_of(from_readings.rank(), readings.len());
    let (noise, noise_degrees_of_freedom) = match assumptions.noise.filter(|&sigma| sigma > 0.0) {
        Some(given) => (Some(given), Some(DegreesOfFreedom::Infinite)),
        None if readings_alone > 0 => {
            let freedom = readings_alone as f64;
            let sum = from_readings.residuals.norm_squared();
            let degrees = DegreesOfFreedom::Finite(freedom);
            (Some((sum / freedom).sqrt()), Some(degrees))
        }
        None => (None, None),
    };
    // Measured slopes join as further rows, weighted by the noise of a reading over their own.
    let extra = extra_rows(&design, zone, assumptions, noise);
    let (solution, freedom) = if extra.is_empty() {
        (from_readings, readings_alone)
    } else {
        let (matrix, right) = stacked(&design.matrix, &observed, &extra);
        let solution = Solution::of(&matrix, &right)?;
        let freedom = freedom_of(solution.rank(), readings.len() + extra.len());
        (solution, freedom)
    };

    let null = &solution.decomposition.null;
    let estimate = Estimate {
        design: &design,
        solution: &solution,
        noise,
    };
    Ok(StepDiagonalFit {
        components: Component::all()
            .map(|c| estimate.component(zone, c))
            .collect(),
        squareness: Location::ALL
            .into_iter()
            .map(|location| {
                let single = estimate.single(Parameter::Squareness(location));
                LocationEstimate {
                    location,
                    determined: single.0,
                    value: single.1,
                    std: single.2,
                }
            })
            .collect(),
        mirrors: design
            .unknowns
            .parameters
            .iter()
            .filter_map(|&p| match p {
                Parameter::Mirror(diagonal, target, direction) => {
                    let (_, value, std) = estimate.single(p);
                    Some(MirrorEstimate {
                        diagonal,
                        target,
                        direction,
                        value,
                        std,
                    })
                }
                _ => None,
            })
            .collect(),
        parameters: design.unknowns.parameters.len(),
        rank: solution.rank(),
        ambiguities: ambiguities(&design.unknowns, null),
        remedies: remedies(&design.unknowns, null),
        noise,
        noise_degrees_of_freedom,
        degrees_of_freedom: freedom,
        residuals: solution
            .residuals
            .iter()
            .take(readings.len())
            .copied()
            .collect(),
        jacobian: DMatrix::from_fn(design.matrix.nrows(), design.matrix.ncols(), |i, j| {
            design.matrix[(i, j)] / design.scale[j]
        }),
        names: design.unknowns.parameters.clone(),
    })
}

/// Least squares of least norm: parameters, their half covariance W with (MᵀM)⁺ = W Wᵀ, residuals.
struct Solution {
    decomposition: Decomposition,
    parameters: DVector<f64>,
    half_covariance: DMatrix<f64>,
    residuals: DVector<f64>,
}

impl Solution {
    fn of(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Result<Self, DiagonalError> {
        let decomposition = decompose(matrix)?;
        let gradient = matrix.transpose() * right;
        let n = matrix.ncols();
        let mut parameters = DVector::zeros(n);
        let mut half_covariance = DMatrix::zeros(n, decomposition.determined.len());
        let mut add = |parameters: &mut DVector<f64>, gradient: &DVector<f64>| {
            for (k, (value, v)) in decomposition.determined.iter().enumerate() {
                *parameters += v * (v.dot(gradient) / (value * value));
                half_covariance.set_column(k, &(v / *value));
            }
        };
        add(&mut parameters, &gradient);
        // One step of refinement brings the rounding of MᵀM back to that of M.
        let correction = matrix.transpose() * (right - matrix * &parameters);
        add(&mut parameters, &correction);
        Ok(Self {
            residuals: right - matrix * &parameters,
            decomposition,
            parameters,
            half_covariance,
        })
    }

    fn rank(&self) -> usize {
        self.decomposition.determined.len()
    }
}

struct Estimate<'a> {
    design: &'a Design,
    solution: &'a Solution,
    noise: Option<f64>,
}

impl Estimate<'_> {
    fn component(&self, zone: &WorkZone, component: Component) -> ComponentEstimate {
        let unknowns = &self.design.unknowns;
        let (determined, lost) =
            determination(unknowns, &self.solution.decomposition.null, component);
        let nodes = nodes_of(unknowns, component);
        let mut estimate = ComponentEstimate {
            component,
            determined,
            positions: Vec::new(),
            values: Vec::new(),
            std: Vec::new(),
        };
        let count = nodes.len();
        let functionals: DMatrix<f64> = match determined {
            Determined::NotTouched | Determined::Nothing => return estimate,
            Determined::Wholly => DMatrix::identity(count, count),
            Determined::ShapeOnly => {
                let line = line_of(&nodes);
                let mut less_line = DMatrix::identity(count, count);
                let end = line[count - 1];
                for i in 0..count {
                    less_line[(i, count - 1)] -= line[i] / end;
                }
                less_line
            }
            Determined::Partly => DMatrix::identity(count, count) - &lost * lost.transpose(),
        };
        let rows: Vec<usize> = nodes.iter().map(|n| n.0).collect();
        let scale = rows.first().map_or(1.0, |&r| self.design.scale[r]);
        let values = &functionals * self.solution.parameters.select_rows(&rows);
        let halves = &functionals * self.solution.half_covariance.select_rows(&rows);
        let pitch = zone.step()[component.axis.index()];
        estimate.positions = (0..=zone.steps).map(|i| pitch * i as f64).collect();
        estimate.values = vec![0.0; zone.steps + 1];
        estimate.std = vec![
            0.0;
            if self.noise.is_some() {
                zone.steps + 1
            } else {
                0
            }
        ];
        for (k, &(_, index)) in nodes.iter().enumerate() {
            estimate.values[index] = scale * values[k];
            if let Some(sigma) = self.noise {
                estimate.std[index] = scale * sigma * halves.row(k).norm();
            }
        }
        estimate
    }

    fn single(&self, parameter: Parameter) -> (Determined, Option<f64>, Option<f64>) {
        let Some(place) = self.design.unknowns.index_of(parameter) else {
            return (Determined::NotTouched, None, None);
        };
        // A tenth of a millionth of a unit vector: see the threshold of `determination`.
        if self.solution.decomposition.null.row(place).norm() > 1e-6 {
            return (Determined::Nothing, None, None);
        }
        let scale = self.design.scale[place];
        let std = self
            .noise
            .map(|sigma| scale * sigma * self.solution.half_covariance.row(place).norm());
        (
            Determined::Wholly,
            Some(scale * self.solution.parameters[place]),
            std,
        )
    }
}

/// A measured slope as (place, coefficient, value), weighted to the noise of a reading.
fn extra_rows(
    design: &Design,
    zone: &WorkZone,
    assumptions: &Assumptions,
    noise: Option<f64>,
) -> Vec<(usize, f64, f64)> {
    assumptions
        .slopes
        .iter()
        .filter_map(|m| {
            let travel = zone.travel[m.axis.index()];
            let (place, gradient) = end_slope(&design.unknowns, m.axis, travel, zone.steps)?;
            // Without any redundancy the readings' noise is taken as that of the slope over the travel.
            let weight = noise.unwrap_or(m.std * travel) / m.std;
            Some((
                place,
                weight * gradient * design.scale[place],
                weight * m.slope,
            ))
        })
        .collect()
}

fn stacked(
    matrix: &DMatrix<f64>,
    right: &DVector<f64>,
    extra: &[(usize, f64, f64)],
) -> (DMatrix<f64>, DVector<f64>) {
    let (rows, columns) = matrix.shape();
    let mut taller = matrix.clone().resize(rows + extra.len(), columns, 0.0);
    let mut longer = right.clone().resize_vertically(rows + extra.len(), 0.0);
    for (k, &(place, coefficient, value)) in extra.iter().enumerate() {
        taller[(rows + k, place)] = coefficient;
        longer[rows + k] = value;
    }
    (taller, longer)
}
