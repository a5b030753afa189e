//! All identifiable combinations of the errors at once, from all readings.

use super::components::{Component, Location};
use super::design::{Design, Function, is_definition, nodes_of};
use super::determination::{
    Determined, ambiguities, determination, end_slope, open_shape, remedies,
};
use super::diagonals::{Travel, WorkZone};
use super::elimination::Elimination;
use super::estimates::{
    Assumptions, ComponentEstimate, LocationEstimate, MirrorEstimate, StepDiagonalFit,
};
use super::groups::Slot;
use super::half_covariance::HalfCovariance;
use super::prediction::Parameter;
use super::readings::{DiagonalError, DiagonalReading, check, check_noise};
use super::solution::{SlopeRow, Solution};
use super::undetermined::{NOTHING, Undetermined};
use crate::uncertainty::{DegreesOfFreedom, Disagreement, welch_satterthwaite};
use nalgebra::{DMatrix, DVector, DVectorView};

/// Residuals of so many roundings of the readings are no noise.
const ROUNDINGS: f64 = 100.0;

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

    let triangle = Elimination::of(&design, zone, &observed)?;
    let from_readings = Solution::of_readings(&triangle.corner, &triangle.right, triangle.floor)?;
    let mut parameters = triangle.solution(&from_readings.parameters);
    let mut residuals = design.residuals(&observed, &parameters);
    // One step of refinement takes off what the least norm of the border costs in rounding.
    let gradient = design.gradient(&residuals);
    parameters += triangle.correction(&gradient, &from_readings.half_covariance);
    residuals = design.residuals(&observed, &parameters);

    let rank_of = |border: &Solution| triangle.rank_with(border.rank());
    let freedom_of = |rank: usize, rows: usize| rows.saturating_sub(design.runs.len() + rank);
    let readings_alone = freedom_of(rank_of(&from_readings), readings.len());
    let (noise, noise_degrees_of_freedom) = match assumptions.noise {
        Some(given) => (Some(given), Some(DegreesOfFreedom::Infinite)),
        None => match scatter(&residuals, &observed, readings_alone) {
            Some(noise) => {
                let degrees = DegreesOfFreedom::Finite(readings_alone as f64);
                (Some(noise), Some(degrees))
            }
            None => (None, None),
        },
    };
    let disagreement = assumptions.noise.and_then(|given| {
        let squares = residuals.norm_squared();
        Disagreement::of(
            squares,
            readings_alone as f64,
            given,
            DegreesOfFreedom::Infinite,
        )
    });
    // Measured slopes join as further rows, weighted by the noise of a reading over their own. They are
    // of the ends of the axes, which the border holds.
    let extra = slope_rows(&design, &triangle, zone, assumptions, noise)?;
    let (solution, freedom) = if extra.is_empty() {
        (from_readings, readings_alone)
    } else {
        let solution = from_readings.joined(&triangle.corner, &triangle.right, &extra)?;
        parameters = triangle.solution(&solution.parameters);
        residuals = design.residuals(&observed, &parameters);
        let freedom = freedom_of(rank_of(&solution), readings.len() + extra.len());
        (solution, freedom)
    };

    let null = triangle.undetermined(&solution.null)?;
    let estimate = Estimate {
        design: &design,
        half: HalfCovariance::of(&triangle, &solution.half_covariance),
        parameters: &parameters,
        null: &null,
        noise: noise.zip(noise_degrees_of_freedom),
        slopes: &extra,
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
        rank: rank_of(&solution),
        ambiguities: ambiguities(&design.unknowns, &null),
        remedies: remedies(&design.unknowns, &null),
        noise,
        noise_degrees_of_freedom,
        disagreement,
        degrees_of_freedom: freedom,
        residuals: residuals.iter().copied().collect(),
        sensitivities: design.sensitivities(),
        names: design.unknowns.parameters,
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

struct Estimate<'a> {
    design: &'a Design,
    half: HalfCovariance<'a>,
    /// Scaled.
    parameters: &'a DVector<f64>,
    null: &'a Undetermined,
    noise: Option<(f64, DegreesOfFreedom)>,
    slopes: &'a [SlopeRow],
}

impl Estimate<'_> {
    fn function(
        &self,
        zone: &WorkZone,
        function: Function,
    ) -> Result<ComponentEstimate, DiagonalError> {
        let component = function.component();
        let unknowns = &self.design.unknowns;
        let (determined, lost) = determination(unknowns, self.null, function)?;
        let nodes = nodes_of(unknowns, function);
        let mut estimate = ComponentEstimate {
            component,
            determined,
            positions: Vec::new(),
            values: Vec::new(),
            std: Vec::new(),
            degrees_of_freedom: Vec::new(),
        };
        let Some(functionals) = functionals(function, determined, &nodes, &lost) else {
            return Ok(estimate);
        };
        let rows: Vec<usize> = nodes.iter().map(|n| n.0).collect();
        let scale = rows.first().map_or(1.0, |&r| self.design.scale[r]);
        let values = &functionals * self.parameters.select_rows(&rows);
        let (squares, halves) = self.half.times(&rows, &functionals);
        let pitch = zone.step()[component.axis.index()];
        estimate.positions = (0..=zone.steps).map(|i| pitch * i as f64).collect();
        estimate.values = vec![0.0; zone.steps + 1];
        if let Some((_, degrees)) = self.noise {
            estimate.std = vec![0.0; zone.steps + 1];
            estimate.degrees_of_freedom = vec![degrees; zone.steps + 1];
        }
        for (k, &(_, index)) in nodes.iter().enumerate() {
            estimate.values[index] = scale * values[k];
            if let Some((u, degrees)) = self.spread(squares[k], &halves.column(k)) {
                estimate.std[index] = scale * u;
                estimate.degrees_of_freedom[index] = degrees;
            }
        }
        Ok(estimate)
    }

    /// Standard uncertainty, in scaled parameters, and effective degrees of freedom of a functional c
    /// from the squared length of c W and its part in the border.
    ///
    /// It weighs the row a_k of a measured slope by c W Wᵀ a_kᵀ, which is what that slope contributes;
    /// the rest of c W comes from the readings.
    fn spread(&self, square: f64, half: &DVectorView<f64>) -> Option<(f64, DegreesOfFreedom)> {
        let (sigma, degrees) = self.noise?;
        if self.slopes.is_empty() {
            return Some((sigma * square.sqrt(), degrees));
        }
        let mut parts = Vec::with_capacity(self.slopes.len() + 1);
        let mut from_slopes = 0.0;
        for slope in self.slopes {
            let own = self.half.root().row(slope.column).transpose();
            let weight = slope.coefficient * own.dot(half);
            from_slopes += weight * weight;
            parts.push((weight, slope.degrees_of_freedom));
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
        if self.null.square(place) > NOTHING {
            return (Determined::Nothing, None, None);
        }
        let scale = self.design.scale[place];
        let one = DMatrix::identity(1, 1);
        let (square, half) = self.half.times(&[place], &one);
        let spread = self
            .spread(square[0], &half.column(0))
            .map(|(u, degrees)| (scale * u, degrees));
        (
            Determined::Wholly,
            Some(scale * self.parameters[place]),
            spread,
        )
    }
}

/// What is told of a function, in its free values: itself, itself less what is open, or its part that is
/// determined. None where nothing is.
pub(super) fn functionals(
    function: Function,
    determined: Determined,
    nodes: &[(usize, usize)],
    lost: &DMatrix<f64>,
) -> Option<DMatrix<f64>> {
    let count = nodes.len();
    let mut told = DMatrix::identity(count, count);
    match determined {
        Determined::NotTouched | Determined::Nothing => return None,
        Determined::Wholly => {}
        Determined::ShapeOnly => {
            let line = open_shape(function, nodes);
            let end = line[count - 1];
            for i in 0..count {
                told[(i, count - 1)] -= line[i] / end;
            }
        }
        Determined::ChangesOnly => {
            for i in 0..count {
                told[(i, 0)] -= 1.0;
            }
        }
        Determined::Partly => told -= lost * lost.transpose(),
    }
    Some(told)
}

fn slope_rows(
    design: &Design,
    triangle: &Elimination,
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
        let (Slot::Border(column), _) = triangle.slot(place) else {
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
            column,
            coefficient,
            value: weight * m.slope,
            degrees_of_freedom: m.degrees_of_freedom,
        });
    }
    Ok(rows)
}
