//! All identifiable combinations of the errors at once, from all readings.

use super::components::{Component, Location};
use super::design::{Decomposition, Design, Function, decompose, is_definition, nodes_of};
use super::determination::{
    Determined, ambiguities, determination, end_slope, open_shape, remedies,
};
use super::diagonals::{Travel, WorkZone};
use super::estimates::{
    Assumptions, ComponentEstimate, LocationEstimate, MirrorEstimate, StepDiagonalFit,
};
use super::prediction::Parameter;
use super::readings::{DiagonalError, DiagonalReading, check};
use crate::uncertainty::{DegreesOfFreedom, welch_satterthwaite};
use nalgebra::{DMatrix, DVector, Dyn};

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
            && !matches!(p, Parameter::Node(c, _) | Parameter::Reversal(c, _)
                if assumptions.zero.contains(&c))
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
    let extra = slope_rows(&design, zone, assumptions, noise);
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
        noise: noise.zip(noise_degrees_of_freedom),
        slopes: extra
            .iter()
            .map(|row| (row.place, row.coefficient, row.degrees_of_freedom))
            .collect(),
    };
    let functions = |of: fn(Component) -> Function| {
        Component::all()
            .map(|c| estimate.function(zone, of(c)))
            .collect()
    };
    let back = readings.iter().any(|r| r.travel == Travel::Backward);
    Ok(StepDiagonalFit {
        components: functions(Function::Error),
        reversals: if back {
            functions(Function::Reversal)
        } else {
            Vec::new()
        },
        squareness: Location::ALL
            .into_iter()
            .map(|location| {
                let (determined, value, spread) = estimate.single(Parameter::Squareness(location));
                LocationEstimate {
                    location,
                    determined,
                    value,
                    std: spread.map(|s| s.0),
                    degrees_of_freedom: spread.map(|s| s.1),
                }
            })
            .collect(),
        mirrors: design
            .unknowns
            .parameters
            .iter()
            .filter_map(|&p| match p {
                Parameter::Mirror(diagonal, target, direction) => {
                    let (_, value, spread) = estimate.single(p);
                    Some(MirrorEstimate {
                        diagonal,
                        target,
                        direction,
                        value,
                        std: spread.map(|s| s.0),
                        degrees_of_freedom: spread.map(|s| s.1),
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
    noise: Option<(f64, DegreesOfFreedom)>,
    /// Rows of measured slopes: place, weighted coefficient, degrees of freedom.
    slopes: Vec<(usize, f64, DegreesOfFreedom)>,
}

impl Estimate<'_> {
    fn function(&self, zone: &WorkZone, function: Function) -> ComponentEstimate {
        let component = function.component();
        let unknowns = &self.design.unknowns;
        let null = &self.solution.decomposition.null;
        let (determined, lost) = determination(unknowns, null, function);
        let nodes = nodes_of(unknowns, function);
        let mut estimate = ComponentEstimate {
            component,
            determined,
            positions: Vec::new(),
            values: Vec::new(),
            std: Vec::new(),
            degrees_of_freedom: Vec::new(),
        };
        let count = nodes.len();
        let functionals: DMatrix<f64> = match determined {
            Determined::NotTouched | Determined::Nothing => return estimate,
            Determined::Wholly => DMatrix::identity(count, count),
            Determined::ShapeOnly => {
                let line = open_shape(function, &nodes);
                let mut less_line = DMatrix::identity(count, count);
                let end = line[count - 1];
                for i in 0..count {
                    less_line[(i, count - 1)] -= line[i] / end;
                }
                less_line
            }
            Determined::ChangesOnly => {
                let mut less_first = DMatrix::identity(count, count);
                for i in 0..count {
                    less_first[(i, 0)] -= 1.0;
                }
                less_first
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
        if let Some((_, degrees)) = self.noise {
            estimate.std = vec![0.0; zone.steps + 1];
            estimate.degrees_of_freedom = vec![degrees; zone.steps + 1];
        }
        for (k, &(_, index)) in nodes.iter().enumerate() {
            estimate.values[index] = scale * values[k];
            if let Some((u, degrees)) = self.spread(halves.row(k)) {
                estimate.std[index] = scale * u;
                estimate.degrees_of_freedom[index] = degrees;
            }
        }
        estimate
    }

    /// Standard uncertainty, in scaled parameters, and effective degrees of freedom of a functional c
    /// from c W.
    ///
    /// It weighs the row a_k of a measured slope by c W Wᵀ a_kᵀ, which is what that slope contributes;
    /// the rest of c W comes from the readings.
    fn spread(&self, half: RowDVectorView) -> Option<(f64, DegreesOfFreedom)> {
        let (sigma, degrees) = self.noise?;
        let square = half.norm_squared();
        if self.slopes.is_empty() {
            return Some((sigma * square.sqrt(), degrees));
        }
        let mut parts = Vec::with_capacity(self.slopes.len() + 1);
        let mut from_slopes = 0.0;
        for &(place, coefficient, degrees) in &self.slopes {
            let own = self.solution.half_covariance.row(place);
            let weight = coefficient * own.dot(&half);
            from_slopes += weight * weight;
            parts.push((weight, degrees));
        }
        // Rounding may leave some 1e-16 where everything comes from a slope.
        parts.push(((square - from_slopes).max(0.0).sqrt(), degrees));
        Some((sigma * square.sqrt(), welch_satterthwaite(&parts)))
    }

    fn single(
        &self,
        parameter: Parameter,
    ) -> (Determined, Option<f64>, Option<(f64, DegreesOfFreedom)>) {
        let Some(place) = self.design.unknowns.index_of(parameter) else {
            return (Determined::NotTouched, None, None);
        };
        // A tenth of a millionth of a unit vector: see the threshold of `determination`.
        if self.solution.decomposition.null.row(place).norm() > 1e-6 {
            return (Determined::Nothing, None, None);
        }
        let scale = self.design.scale[place];
        let spread = self
            .spread(self.solution.half_covariance.row(place))
            .map(|(u, degrees)| (scale * u, degrees));
        (
            Determined::Wholly,
            Some(scale * self.solution.parameters[place]),
            spread,
        )
    }
}

type RowDVectorView<'a> = nalgebra::MatrixView<'a, f64, nalgebra::U1, Dyn, nalgebra::U1, Dyn>;

/// A measured slope as a row of the design, weighted to the noise of a reading.
struct SlopeRow {
    place: usize,
    coefficient: f64,
    value: f64,
    degrees_of_freedom: DegreesOfFreedom,
}

fn slope_rows(
    design: &Design,
    zone: &WorkZone,
    assumptions: &Assumptions,
    noise: Option<f64>,
) -> Vec<SlopeRow> {
    assumptions
        .slopes
        .iter()
        .filter_map(|m| {
            let travel = zone.travel[m.axis.index()];
            let (place, gradient) = end_slope(&design.unknowns, m.axis, travel, zone.steps)?;
            // Without any redundancy the readings' noise is taken as that of the slope over the travel.
            let weight = noise.unwrap_or(m.std * travel) / m.std;
            Some(SlopeRow {
                place,
                coefficient: weight * gradient * design.scale[place],
                value: weight * m.slope,
                degrees_of_freedom: m.degrees_of_freedom,
            })
        })
        .collect()
}

fn stacked(
    matrix: &DMatrix<f64>,
    right: &DVector<f64>,
    extra: &[SlopeRow],
) -> (DMatrix<f64>, DVector<f64>) {
    let (rows, columns) = matrix.shape();
    let mut taller = matrix.clone().resize(rows + extra.len(), columns, 0.0);
    let mut longer = right.clone().resize_vertically(rows + extra.len(), 0.0);
    for (k, row) in extra.iter().enumerate() {
        taller[(rows + k, row.place)] = row.coefficient;
        longer[rows + k] = row.value;
    }
    (taller, longer)
}
