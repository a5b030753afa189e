//! All identifiable combinations of the errors at once, from all readings.

use super::components::{Component, Location};
use super::design::{Design, Function, decompose, is_definition, nodes_of};
use super::determination::{
    Determined, ambiguities, determination, end_slope, open_shape, remedies,
};
use super::diagonals::{Travel, WorkZone};
use super::estimates::{
    Assumptions, ComponentEstimate, LocationEstimate, MirrorEstimate, StepDiagonalFit,
};
use super::prediction::Parameter;
use super::readings::{DiagonalError, DiagonalReading, check, check_noise};
use crate::uncertainty::{DegreesOfFreedom, welch_satterthwaite};
use errsep_solvers::linear::pivoted_qr::PivotedQr;
use nalgebra::{DMatrix, DVector, Dyn};

/// Residuals of so many roundings of the readings are no noise.
const ROUNDINGS: f64 = 100.0;

/// What a measured slope must share with the directions that the readings leave open to determine one
/// of them: those are known to about 1e-11, and what a set-up leaves open shows with more than 1e-4.
pub(super) const OPEN: f64 = 1e-6;

/// What a measured slope may count for beside a reading: outside, rounding shows in the uncertainties of
/// what it settles (1e-7 of them at either end).
const WEIGHTS: std::ops::RangeInclusive<f64> = 1e-8..=1e18;

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
    check_noise(assumptions.noise)?;
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

    let from_readings = Solution::of_readings(&design.matrix, &observed)?;
    let freedom_of = |rank: usize, rows: usize| rows.saturating_sub(design.runs.len() + rank);
    let readings_alone = freedom_of(from_readings.rank(), readings.len());
    let (noise, noise_degrees_of_freedom) = match assumptions.noise {
        Some(given) => (Some(given), Some(DegreesOfFreedom::Infinite)),
        None => match scatter(&from_readings.residuals, &observed, readings_alone) {
            Some(noise) => {
                let degrees = DegreesOfFreedom::Finite(readings_alone as f64);
                (Some(noise), Some(degrees))
            }
            None => (None, None),
        },
    };
    // Measured slopes join as further rows, weighted by the noise of a reading over their own.
    let extra = slope_rows(&design, zone, assumptions, noise)?;
    let (solution, freedom) = if extra.is_empty() {
        (from_readings, readings_alone)
    } else {
        let solution = from_readings.joined(&design.matrix, &observed, &extra)?;
        let freedom = freedom_of(solution.rank(), readings.len() + extra.len());
        (solution, freedom)
    };

    let null = &solution.null;
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
            .collect::<Result<Vec<_>, _>>()
    };
    let back = readings.iter().any(|r| r.travel == Travel::Backward);
    Ok(StepDiagonalFit {
        components: functions(Function::Error)?,
        reversals: if back {
            functions(Function::Reversal)?
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
        ambiguities: ambiguities(&design.unknowns, null)?,
        remedies: remedies(&design.unknowns, null)?,
        noise,
        noise_degrees_of_freedom,
        degrees_of_freedom: freedom,
        residuals: solution.residuals.iter().copied().collect(),
        jacobian: DMatrix::from_fn(design.matrix.nrows(), design.matrix.ncols(), |i, j| {
            design.matrix[(i, j)] / design.scale[j]
        }),
        names: design.unknowns.parameters.clone(),
    })
}

/// The standard deviation of a reading by the residuals; none without redundancy, or where nothing
/// but the rounding of the readings is left.
fn scatter(residuals: &DVector<f64>, observed: &DVector<f64>, freedom: usize) -> Option<f64> {
    let (largest, greatest) = (residuals.amax(), observed.amax());
    if freedom == 0 || largest <= ROUNDINGS * f64::EPSILON * greatest {
        return None;
    }
    // Divided first: the squares of very large or very small readings leave the range of numbers.
    let sum = residuals.iter().map(|r| (r / largest).powi(2)).sum::<f64>();
    Some(largest * (sum / freedom as f64).sqrt())
}

/// Least squares of least norm: parameters, their half covariance W with (MᵀM)⁺ = W Wᵀ, residuals.
struct Solution {
    /// Orthonormal basis of what is determined, n × rank.
    determined: DMatrix<f64>,
    /// Orthonormal basis of what is not, n × nullity.
    null: DMatrix<f64>,
    parameters: DVector<f64>,
    half_covariance: DMatrix<f64>,
    /// Of the readings alone.
    residuals: DVector<f64>,
}

impl Solution {
    fn of_readings(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Result<Self, DiagonalError> {
        let decomposition = decompose(matrix, 0.0)?;
        let n = matrix.ncols();
        let rank = decomposition.determined.len();
        let mut parameters = DVector::zeros(n);
        let mut half_covariance = DMatrix::zeros(n, rank);
        let mut determined = DMatrix::zeros(n, rank);
        for (k, (value, v)) in decomposition.determined.iter().enumerate() {
            half_covariance.set_column(k, &(v / *value));
            determined.set_column(k, v);
        }
        // The second round is one step of refinement: it brings the rounding of MᵀM back to that of M.
        for _ in 0..2 {
            let gradient = matrix.transpose() * (right - matrix * &parameters);
            for (value, v) in &decomposition.determined {
                parameters += v * (v.dot(&gradient) / (value * value));
            }
        }
        Ok(Self {
            residuals: right - matrix * &parameters,
            determined,
            null: decomposition.null,
            parameters,
            half_covariance,
        })
    }

    /// The solution with measured slopes beside the readings.
    ///
    /// What the slopes determine further is sought among what the readings leave open, by their
    /// direction alone: the rank must not depend on how well a slope is known. In the basis of what
    /// both determine the problem has full rank, and Householder reflections with pivoted columns and
    /// the heavy rows first solve it whatever the weights (Cox & Higham, BIT 38 (1998) 34).
    fn joined(
        &self,
        matrix: &DMatrix<f64>,
        right: &DVector<f64>,
        slopes: &[SlopeRow],
    ) -> Result<Self, DiagonalError> {
        let (readings, n) = matrix.shape();
        let rows = DMatrix::from_fn(slopes.len(), self.null.ncols(), |k, j| {
            self.null[(slopes[k].place, j)]
        });
        let further = decompose(&rows, OPEN)?;
        let added: Vec<DVector<f64>> = further
            .determined
            .iter()
            .map(|(_, v)| &self.null * v)
            .collect();
        let from_readings = self.rank();
        let rank = from_readings + added.len();
        let mut determined = self.determined.clone().resize_horizontally(rank, 0.0);
        for (k, direction) in added.iter().enumerate() {
            determined.set_column(from_readings + k, direction);
        }

        let mut order: Vec<usize> = (0..slopes.len()).collect();
        order.sort_by(|&a, &b| slopes[b].coefficient.total_cmp(&slopes[a].coefficient));
        let heavy = order.partition_point(|&k| slopes[k].coefficient > 1.0);
        let (before, after) = order.split_at(heavy);
        let mut weighted = DMatrix::zeros(readings + slopes.len(), rank);
        let mut observed = DVector::zeros(readings + slopes.len());
        let of_slopes = before.iter().enumerate().chain(
            after
                .iter()
                .enumerate()
                .map(|(i, k)| (heavy + readings + i, k)),
        );
        for (row, &k) in of_slopes {
            let slope = &slopes[k];
            weighted.set_row(row, &(determined.row(slope.place) * slope.coefficient));
            observed[row] = slope.value;
        }
        // What the slopes add leaves the readings alone: zero, not the rounding of M times it.
        weighted
            .view_mut((heavy, 0), (readings, from_readings))
            .copy_from(&(matrix * &self.determined));
        observed.rows_mut(heavy, readings).copy_from(right);

        let qr = PivotedQr::new(weighted);
        qr.apply_transposed(&mut observed);
        let mut permuted = DMatrix::zeros(n, rank);
        for (k, &j) in qr.permutation().iter().enumerate() {
            permuted.set_column(k, &determined.column(j));
        }
        let inverse = qr
            .upper()
            .solve_upper_triangular(&DMatrix::identity(rank, rank))
            .ok_or_else(|| DiagonalError::Numerical {
                reason: "the measured slopes and the readings make no triangle".to_owned(),
            })?;
        let half_covariance = permuted * inverse;
        let parameters = &half_covariance * observed.rows(0, rank);
        Ok(Self {
            residuals: right - matrix * &parameters,
            determined,
            null: &self.null * further.null,
            parameters,
            half_covariance,
        })
    }

    fn rank(&self) -> usize {
        self.determined.ncols()
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
    fn function(
        &self,
        zone: &WorkZone,
        function: Function,
    ) -> Result<ComponentEstimate, DiagonalError> {
        let component = function.component();
        let unknowns = &self.design.unknowns;
        let (determined, lost) = determination(unknowns, &self.solution.null, function)?;
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
            Determined::NotTouched | Determined::Nothing => return Ok(estimate),
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
        Ok(estimate)
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
        if self.solution.null.row(place).norm() > 1e-6 {
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
) -> Result<Vec<SlopeRow>, DiagonalError> {
    let mut rows = Vec::new();
    for m in &assumptions.slopes {
        let travel = zone.travel[m.axis.index()];
        let Some((place, gradient)) = end_slope(&design.unknowns, m.axis, travel, zone.steps)
        else {
            continue;
        };
        // Without any redundancy the readings' noise is taken as that of the slope over the travel.
        let weight = noise.unwrap_or(m.std * travel) / m.std;
        let coefficient = weight * gradient * design.scale[place];
        if !WEIGHTS.contains(&coefficient) {
            return Err(DiagonalError::MeasuredUncertainty {
                what: format!("positioning slope of {}", m.axis.letter()),
            });
        }
        rows.push(SlopeRow {
            place,
            coefficient,
            value: weight * m.slope,
            degrees_of_freedom: m.degrees_of_freedom,
        });
    }
    Ok(rows)
}
