//! What a step-diagonal test is made for, as linear functions of its readings: the errors of location
//! and the error functions that the readings determine.

use nalgebra::{DMatrix, DVector};

use super::components::{Component, Location};
use super::design::{Design, is_definition};
use super::elimination::Elimination;
use super::prediction::Parameter;
use super::solution::{OPEN, Solution};
use super::{DiagonalError, WorkZone};

/// An error function that the readings determine at every position.
#[derive(Debug, Clone)]
pub(super) struct Determined {
    pub component: Component,
    /// Positions, mm.
    pub positions: Vec<f64>,
    /// Positions × readings: µm or rad per µm.
    pub weights: DMatrix<f64>,
}

/// What is determined, by weights of the readings.
#[derive(Debug, Clone, Default)]
pub(super) struct Answers {
    /// Errors of location under their ISO 230-1 names and signs, rad per µm.
    pub locations: Vec<(Location, DVector<f64>)>,
    /// The error functions.
    pub functions: Vec<Determined>,
}

impl Answers {
    /// Those of a design, least squares.
    ///
    /// # Errors
    /// The singular values do not converge.
    pub fn of(zone: &WorkZone, design: &Design) -> Result<Self, DiagonalError> {
        let blank = DVector::zeros(design.stop_of.len());
        let triangle = Elimination::of(design, zone, &blank)?;
        let border = Solution::of_readings(&triangle.corner, &triangle.right, triangle.floor)?;
        let open = triangle.undetermined(&border.null)?;
        let unseen = |j: usize| open.square(j).sqrt();
        // M (MᵀM)⁺ e.
        let weights = |j: usize| {
            let mut unit = DVector::zeros(design.scale.len());
            unit[j] = 1.0;
            let inside = triangle.correction(&unit, &border.half_covariance);
            design.residuals(&blank, &inside) * -design.scale[j]
        };
        let known = |parameter: Parameter| {
            let j = design.unknowns.index_of(parameter)?;
            (unseen(j) < OPEN).then_some(j)
        };
        let locations = Location::ALL.into_iter().filter_map(|location| {
            let j = known(Parameter::Squareness(location))?;
            Some((location, weights(j) * location.iso_sign()))
        });
        let functions = Component::all().filter_map(|component| {
            let mut found = Determined {
                component,
                positions: Vec::new(),
                weights: DMatrix::zeros(zone.steps + 1, blank.len()),
            };
            let mut any = false;
            for index in 0..=zone.steps {
                found
                    .positions
                    .push(zone.step()[component.axis.index()] * index as f64);
                let node = Parameter::Node(component, index);
                if is_definition(node, zone.steps) {
                    continue;
                }
                let j = known(node)?;
                found.weights.set_row(index, &weights(j).transpose());
                any = true;
            }
            any.then_some(found)
        });
        Ok(Self {
            locations: locations.collect(),
            functions: functions.collect(),
        })
    }
}
