//! The 21 errors as tables over the grid: what a simulation is made of.

use super::components::{Axis, Component, Location};
use super::diagonals::WorkZone;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Error functions at the grid positions of a work zone and the squareness errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ErrorTables {
    /// By [`Component::index`]: values at the grid positions, µm or rad.
    pub functions: Vec<Vec<f64>>,
    /// By [`Component::index`]: reversal values at the grid positions, µm or rad, the error when the
    /// axis arrives in its positive sense less that when it arrives in its negative sense;
    /// `functions` are the means of both.
    pub reversals: Vec<Vec<f64>>,
    /// By [`Location`]: the paper's S, rad, positive where the angle exceeds 90°.
    pub squareness: [f64; 3],
}

impl ErrorTables {
    /// A machine without errors.
    pub fn zero(zone: &WorkZone) -> Self {
        Self {
            functions: vec![vec![0.0; zone.steps + 1]; Component::COUNT],
            reversals: vec![vec![0.0; zone.steps + 1]; Component::COUNT],
            squareness: [0.0; 3],
        }
    }

    /// The reversal values of one function.
    pub fn reversal_of(&self, component: Component) -> &[f64] {
        &self.reversals[component.index()]
    }

    /// The reversal values of one function, to change them.
    pub fn reversal_of_mut(&mut self, component: Component) -> &mut Vec<f64> {
        &mut self.reversals[component.index()]
    }

    /// The values of one function.
    pub fn of(&self, component: Component) -> &[f64] {
        &self.functions[component.index()]
    }

    /// The values of one function, to change them.
    pub fn of_mut(&mut self, component: Component) -> &mut Vec<f64> {
        &mut self.functions[component.index()]
    }

    /// S of one pair, rad.
    pub const fn squareness_of(&self, location: Location) -> f64 {
        self.squareness[location as usize]
    }

    /// The three translations (µm) or rotations (rad) when an axis has arrived at a grid index in the
    /// sense `approach`: +1, −1, or 0 for the mean of both.
    pub fn vector(&self, axis: Axis, rotation: bool, index: usize, approach: i8) -> Vector3<f64> {
        Vector3::from_fn(|c, _| {
            let component = Component {
                rotation,
                direction: Axis::ALL[c],
                axis,
            };
            let at = |values: &[f64]| values.get(index).copied().unwrap_or(0.0);
            at(self.of(component)) + 0.5 * f64::from(approach) * at(self.reversal_of(component))
        })
    }
}
