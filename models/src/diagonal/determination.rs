//! What a null space means: which errors are determined, which cannot be told apart, and which further
//! measurement would settle it.

use super::components::{Axis, Component, Location, NodeKind};
use super::design::{Function, nodes_of};
use super::prediction::{Parameter, Unknowns};
use super::readings::DiagonalError;
use super::undetermined::{NOTHING, SparseRow, Undetermined, square};
use errsep_solvers::linear::limited::symmetric_eigen;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// How far the readings determine an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Determined {
    /// Wholly, counted from its definition.
    Wholly,
    /// All but a straight line.
    ShapeOnly,
    /// All but a constant: its changes along the axis.
    ChangesOnly,
    /// Some combinations of its values.
    Partly,
    /// No combination of its own values.
    Nothing,
    /// The readings do not depend on it.
    NotTouched,
}

impl Determined {
    /// For people.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Wholly => "determined",
            Self::ShapeOnly => "shape only, slope not",
            Self::ChangesOnly => "changes only, constant not",
            Self::Partly => "in part",
            Self::Nothing => "not determined",
            Self::NotTouched => "not touched by the readings",
        }
    }
}

/// Errors that the readings cannot tell apart.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ambiguity {
    /// The least set found: leaving out any one of them removes the ambiguity.
    pub members: Vec<String>,
    /// One sentence for a person.
    pub statement: String,
}

/// A further measurement and what it would settle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Remedy {
    /// What to measure.
    pub measure: String,
    /// What the readings would then determine.
    pub settles: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Whole,
    Slope,
    Shape,
    /// The constant of a reversal.
    Constant,
    /// The rest of it.
    Changes,
}

/// A group of parameters that people name as one thing.
#[derive(Debug, Clone)]
struct Block {
    name: String,
    rows: Vec<usize>,
    line: DVector<f64>,
    part: Part,
    /// The later, the rather kept when an ambiguity is reduced to its least set.
    rank: u8,
}

impl Block {
    /// Rows over the columns of the null space that span the coordinates within this block.
    fn coordinates(&self, null: &Undetermined) -> Vec<SparseRow> {
        let along = || self.rows.iter().copied().zip(self.line.iter().copied());
        match self.part {
            Part::Whole => self
                .rows
                .iter()
                .map(|&place| null.combined([(place, 1.0)]))
                .collect(),
            Part::Slope | Part::Constant => vec![null.combined(along())],
            // What is no multiple of the line: each value less that of the last, by the line's ratio.
            Part::Shape | Part::Changes => {
                let Some((last, end)) = along().next_back() else {
                    return Vec::new();
                };
                along()
                    .filter(|&(place, _)| place != last)
                    .map(|(place, height)| null.combined([(place, 1.0), (last, -height / end)]))
                    .collect()
            }
        }
    }
}

fn blocks(unknowns: &Unknowns) -> Vec<Block> {
    let mut found = Vec::new();
    let mut add = |name: String, rows: Vec<usize>, line: DVector<f64>, part, rank| {
        if !rows.is_empty() {
            found.push(Block {
                name,
                rows,
                line,
                part,
                rank,
            });
        }
    };
    for component in Component::all() {
        let function = Function::Error(component);
        let nodes = nodes_of(unknowns, function);
        let rows: Vec<usize> = nodes.iter().map(|n| n.0).collect();
        let line = open_shape(function, &nodes);
        match component.kind() {
            NodeKind::Angular => add(component.words_and_symbol(), rows, line, Part::Whole, 0),
            NodeKind::Straightness => {
                add(component.words_and_symbol(), rows, line, Part::Whole, 1);
            }
            NodeKind::Positioning => {
                let (axis, symbol) = (component.axis.letter(), component.name());
                if rows.len() > 1 {
                    let name = format!("shape of the positioning of {axis} ({symbol})");
                    add(name, rows.clone(), line.clone(), Part::Shape, 2);
                }
                add(
                    format!("positioning slope of {axis} ({symbol})"),
                    rows,
                    line,
                    Part::Slope,
                    5,
                );
            }
        }
    }
    for location in Location::ALL {
        let rows = unknowns
            .index_of(Parameter::Squareness(location))
            .into_iter()
            .collect();
        add(
            format!("{} ({})", location.words(), location.name()),
            rows,
            DVector::zeros(1),
            Part::Whole,
            3,
        );
    }
    for component in Component::all() {
        let function = Function::Reversal(component);
        let nodes = nodes_of(unknowns, function);
        let rows: Vec<usize> = nodes.iter().map(|n| n.0).collect();
        let constant = open_shape(function, &nodes);
        let words = component.words_and_symbol();
        add(
            format!("changes of the reversal in the {words}"),
            rows.clone(),
            constant.clone(),
            Part::Changes,
            1,
        );
        add(
            format!("mean reversal in the {words}"),
            rows,
            constant,
            Part::Constant,
            1,
        );
    }
    let mirrors: Vec<usize> = unknowns
        .parameters
        .iter()
        .enumerate()
        .filter(|(_, p)| matches!(p, Parameter::Mirror(..)))
        .map(|(place, _)| place)
        .collect();
    let line = DVector::zeros(mirrors.len());
    add(
        "mirror misalignment".to_owned(),
        mirrors,
        line,
        Part::Whole,
        4,
    );
    found
}

/// Unit vector over the free nodes of what tests of this kind leave open most easily: a straight line
/// through zero at the origin of an error, a constant of a reversal.
pub(super) fn open_shape(function: Function, nodes: &[(usize, usize)]) -> DVector<f64> {
    let height = |node: &(usize, usize)| match function {
        Function::Error(_) => node.1 as f64,
        Function::Reversal(_) => 1.0,
    };
    let shape = DVector::from_iterator(nodes.len(), nodes.iter().map(height));
    let length = shape.norm();
    if length > 0.0 { shape / length } else { shape }
}

fn not_converged() -> DiagonalError {
    DiagonalError::Numerical {
        reason: "the eigenvalues did not converge".to_owned(),
    }
}

/// How far one function is determined, and an orthonormal basis (free nodes × lost) of the
/// combinations of its own values that are not.
pub(super) fn determination(
    unknowns: &Unknowns,
    null: &Undetermined,
    function: Function,
) -> Result<(Determined, DMatrix<f64>), DiagonalError> {
    let nodes = nodes_of(unknowns, function);
    let rows: Vec<usize> = nodes.iter().map(|n| n.0).collect();
    if rows.is_empty() {
        return Ok((Determined::NotTouched, DMatrix::zeros(0, 0)));
    }
    // A function has one value at a position: what lies at that position alone leaves all of it open.
    let mut lost = Vec::new();
    let shared = null.shared();
    let mut own = DMatrix::zeros(rows.len(), shared.len());
    for (i, &place) in rows.iter().enumerate() {
        let (alone, row) = null.split(place);
        if alone > NOTHING {
            lost.push(DVector::from_fn(rows.len(), |k, _| f64::from(k == i)));
            continue;
        }
        for &(j, v) in row {
            own[(i, j - shared.start)] = v;
        }
    }
    if own.norm_squared() > NOTHING {
        // Few combinations are shared: own v for the eigenvectors v of ownᵀ own.
        let eigen = symmetric_eigen(own.tr_mul(&own)).ok_or_else(not_converged)?;
        let open = (0..shared.len())
            .filter(|&j| eigen.eigenvalues[j] > NOTHING)
            .map(|j| (&own * eigen.eigenvectors.column(j)).normalize());
        lost.extend(open);
    }
    let determined = match &lost[..] {
        [] => Determined::Wholly,
        all if all.len() == rows.len() => Determined::Nothing,
        [only] if only.dot(&open_shape(function, &nodes)).abs() > 1.0 - 1e-6 => match function {
            Function::Reversal(_) => Determined::ChangesOnly,
            Function::Error(c) if c.kind() != NodeKind::Straightness => Determined::ShapeOnly,
            Function::Error(_) => Determined::Partly,
        },
        _ => Determined::Partly,
    };
    let lost = if lost.is_empty() {
        DMatrix::zeros(rows.len(), 0)
    } else {
        DMatrix::from_columns(&lost)
    };
    Ok((determined, lost))
}

/// The ambiguities, each reduced to a least set, without repetition.
pub(super) fn ambiguities(unknowns: &Unknowns, null: &Undetermined) -> Vec<Ambiguity> {
    let all = blocks(unknowns);
    let rows: Vec<Vec<SparseRow>> = all.iter().map(|b| b.coordinates(null)).collect();
    let open = |b: usize| moved(&rows[b]);
    let mut order: Vec<usize> = (0..all.len()).filter(|&b| open(b)).collect();
    order.sort_by_key(|&b| all[b].rank);
    let mut found: Vec<(Vec<usize>, Ambiguity)> = Vec::new();
    for &subject in order.iter().rev() {
        // Reversals say for themselves how far they are determined; they may take part here, where the
        // way back was not measured on every diagonal.
        if matches!(all[subject].part, Part::Constant | Part::Changes) {
            continue;
        }
        let mut held = null.free();
        let mut members = order.clone();
        for &candidate in &order {
            if candidate == subject {
                continue;
            }
            let before = held.len();
            held.add(&rows[candidate]);
            if held.leaves(&rows[subject]) {
                members.retain(|&m| m != candidate);
            } else {
                held.truncate(before);
            }
        }
        members.retain(|&m| held.leaves(&rows[m]));
        members.sort_unstable();
        if found.iter().all(|(known, _)| *known != members) {
            let ambiguity = describe(&members.iter().map(|&m| &all[m]).collect::<Vec<_>>());
            found.push((members, ambiguity));
        }
    }
    found.into_iter().map(|f| f.1).collect()
}

/// Whether what the readings leave open moves one of these.
fn moved(rows: &[SparseRow]) -> bool {
    rows.iter().map(|row| square(row)).sum::<f64>() > NOTHING
}

fn describe(members: &[&Block]) -> Ambiguity {
    let names: Vec<String> = members.iter().map(|b| b.name.clone()).collect();
    let slopes = members.iter().filter(|b| b.part == Part::Slope).count();
    let rotations: Vec<&str> = members
        .iter()
        .filter(|b| b.rank == 0)
        .map(|b| b.name.as_str())
        .collect();
    let advice = if slopes > 0 && rotations.is_empty() {
        "measure one slope".to_owned()
    } else if rotations.is_empty() {
        "measure one of them by other means".to_owned()
    } else {
        format!(
            "measure the {} directly, or add readings with the other target",
            list(&rotations)
        )
    };
    let text: Vec<&str> = names.iter().map(String::as_str).collect();
    let statement = match text[..] {
        [only] => format!("{only} has no effect on the readings: {advice}"),
        _ => format!("{} cannot be told apart: {advice}", list(&text)),
    };
    Ambiguity {
        members: names,
        statement,
    }
}

/// "a", "a and b", "a, b and c".
fn list(items: &[&str]) -> String {
    match items {
        [] => String::new(),
        [only] => (*only).to_owned(),
        [head @ .., last] => format!("{} and {last}", head.join(", ")),
    }
}

/// What each single further measurement would settle; those that settle nothing are left out.
pub(super) fn remedies(unknowns: &Unknowns, null: &Undetermined) -> Vec<Remedy> {
    let all = blocks(unknowns);
    let rows: Vec<Vec<SparseRow>> = all.iter().map(|b| b.coordinates(null)).collect();
    let open: Vec<usize> = (0..all.len()).filter(|&b| moved(&rows[b])).collect();
    let mut remedies = Vec::new();
    for &known in &open {
        if all[known].rank != 0 && all[known].part != Part::Slope {
            continue;
        }
        let mut held = null.free();
        held.add(&rows[known]);
        let settles: Vec<String> = open
            .iter()
            .filter(|&&b| all[b].name != all[known].name && !held.leaves(&rows[b]))
            .map(|&b| all[b].name.clone())
            .collect();
        if !settles.is_empty() {
            remedies.push(Remedy {
                measure: all[known].name.clone(),
                settles,
            });
        }
    }
    remedies
}

/// Gradient of the positioning slope of an axis in µm/mm by end points, in its free nodes.
pub(super) fn end_slope(
    unknowns: &Unknowns,
    axis: Axis,
    travel: f64,
    steps: usize,
) -> Option<(usize, f64)> {
    let component = Component {
        rotation: false,
        direction: axis,
        axis,
    };
    let place = unknowns.index_of(Parameter::Node(component, steps))?;
    Some((place, 1.0 / travel))
}
