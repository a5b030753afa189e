//! The reading as a linear function of the 21 errors and the mirror angles: equations (1) and (4).

use super::components::{Axis, Component, Location};
use super::diagonals::{Diagonal, Target, Travel, WorkZone};
use super::errors::ErrorTables;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// µm of a lever of 1 mm turned by 1 rad.
const UM_PER_RAD_MM: f64 = 1e3;

/// One unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Parameter {
    /// Value of an error function at a grid index, µm or rad.
    Node(Component, usize),
    /// The paper's S of a pair of axes, rad.
    Squareness(Location),
    /// Misalignment of the mirror of a set-up about one of [`Diagonal::mirror_axes`], rad.
    Mirror(Diagonal, Target, usize),
    /// Reversal value of an error function at a grid index: arrived in the positive sense of the axis
    /// less in the negative, µm or rad.
    Reversal(Component, usize),
}

impl Parameter {
    /// How many there are on axes of so many steps.
    pub(super) const fn count(steps: usize) -> usize {
        2 * Component::COUNT * (steps + 1)
            + Location::ALL.len()
            + 2 * Target::ALL.len() * Diagonal::ALL.len()
    }

    /// A number of its own below [`Self::count`].
    pub(super) const fn number(self, steps: usize) -> usize {
        let functions = 2 * Component::COUNT * (steps + 1);
        match self {
            Self::Node(c, index) => c.index() * (steps + 1) + index,
            Self::Reversal(c, index) => (Component::COUNT + c.index()) * (steps + 1) + index,
            Self::Squareness(location) => functions + location as usize,
            Self::Mirror(diagonal, target, direction) => {
                let setup = diagonal as usize * Target::ALL.len() + target as usize;
                functions + Location::ALL.len() + 2 * setup + direction
            }
        }
    }
}

/// The unknowns that the readings touch, with their places in the parameter vector.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknowns {
    /// The parameters in order.
    pub parameters: Vec<Parameter>,
}

impl Unknowns {
    /// Place of a parameter.
    pub fn index_of(&self, parameter: Parameter) -> Option<usize> {
        self.parameters.binary_search(&parameter).ok()
    }

    /// The set of some parameters, sorted.
    pub fn of(parameters: impl IntoIterator<Item = Parameter>) -> Self {
        let mut parameters: Vec<Parameter> = parameters.into_iter().collect();
        parameters.sort_unstable();
        parameters.dedup();
        Self { parameters }
    }
}

/// Equation (4) for the reading at grid indices `at` relative to the start of the diagonal: the
/// parameters it depends on and how, µm per µm or µm per rad.
///
/// e(p₃) − e(p₁) along the beam, and the offset of the beam on the mirror, p₁ − p₃, turned by the
/// tool's rotations (mirror only) and by the misalignment. p₁ may be any point of the beam, because
/// n·(ε × n) = 0; here it is the start of the diagonal.
pub(super) fn sensitivities(
    zone: &WorkZone,
    diagonal: Diagonal,
    target: Target,
    at: [usize; 3],
    travel: Travel,
) -> Vec<(Parameter, f64)> {
    let n = diagonal.direction(zone);
    let (start, _) = zone.ends(diagonal);
    let (p3, p1) = (zone.position(at), zone.position(start));
    let offset = p1 - p3;
    let mut terms: Vec<(Parameter, f64)> = Vec::with_capacity(4 * Component::COUNT + 5);
    let approach = |travel| diagonal.approach(travel).map(|s| 0.5 * f64::from(s));
    let (arrived, left) = (approach(travel), approach(Travel::Forward));
    for component in Component::all() {
        let (a, c) = (component.axis.index(), component.direction.index());
        let unit = Vector3::ith(c, 1.0);
        let (here, there) = if component.rotation {
            let here = n.dot(&unit.cross(&lever(component.axis, p3)));
            let there = n.dot(&unit.cross(&lever(component.axis, p1)));
            let seen = match target {
                Target::Mirror => n.dot(&unit.cross(&offset)),
                Target::RetroReflector => 0.0,
            };
            (UM_PER_RAD_MM * (here + seen), -UM_PER_RAD_MM * there)
        } else {
            (n[c], -n[c])
        };
        let (turned, turned_there) = (arrived[a] * here, left[a] * there);
        if at[a] == start[a] {
            terms.push((Parameter::Node(component, at[a]), here + there));
            terms.push((Parameter::Reversal(component, at[a]), turned + turned_there));
            continue;
        }
        terms.push((Parameter::Node(component, at[a]), here));
        terms.push((Parameter::Node(component, start[a]), there));
        terms.push((Parameter::Reversal(component, at[a]), turned));
        terms.push((Parameter::Reversal(component, start[a]), turned_there));
    }
    for location in Location::ALL {
        let moved = squareness_shift(location, p3) - squareness_shift(location, p1);
        terms.push((
            Parameter::Squareness(location),
            UM_PER_RAD_MM * n.dot(&moved),
        ));
    }
    for (k, axis) in diagonal.mirror_axes(zone).into_iter().enumerate() {
        terms.push((
            Parameter::Mirror(diagonal, target, k),
            UM_PER_RAD_MM * n.dot(&axis.cross(&offset)),
        ));
    }
    // What cancels leaves only rounding of levers of the size of the zone.
    terms.retain(|t| t.1.abs() > 1e-9);
    terms
}

/// From the slide's own origin to the tool: (0, y, z) for X, (0, 0, z) for Y, none for Z.
fn lever(axis: Axis, p: Vector3<f64>) -> Vector3<f64> {
    match axis {
        Axis::X => Vector3::new(0.0, p.y, p.z),
        Axis::Y => Vector3::new(0.0, 0.0, p.z),
        Axis::Z => Vector3::zeros(),
    }
}

fn squareness_shift(location: Location, p: Vector3<f64>) -> Vector3<f64> {
    match location {
        Location::XY => Vector3::new(-p.y, 0.0, 0.0),
        Location::XZ => Vector3::new(-p.z, 0.0, 0.0),
        Location::YZ => Vector3::new(0.0, -p.z, 0.0),
    }
}

/// The reading that the linear model predicts, µm.
pub fn predicted_reading(
    zone: &WorkZone,
    errors: &ErrorTables,
    diagonal: Diagonal,
    target: Target,
    mirror: Vector3<f64>,
    at: [usize; 3],
    travel: Travel,
) -> f64 {
    let axes = diagonal.mirror_axes(zone);
    sensitivities(zone, diagonal, target, at, travel)
        .into_iter()
        .map(|(parameter, coefficient)| {
            let value = match parameter {
                Parameter::Node(component, index) => {
                    errors.of(component).get(index).copied().unwrap_or(0.0)
                }
                Parameter::Reversal(component, index) => {
                    let values = errors.reversal_of(component);
                    values.get(index).copied().unwrap_or(0.0)
                }
                Parameter::Squareness(location) => errors.squareness_of(location),
                Parameter::Mirror(_, _, k) => axes.get(k).map_or(0.0, |axis| axis.dot(&mirror)),
            };
            coefficient * value
        })
        .sum()
}
