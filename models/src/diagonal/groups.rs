//! The unknowns in the order in which they are eliminated.

use super::design::{Design, decompose};
use super::diagonals::WorkZone;
use super::prediction::Parameter;
use super::readings::DiagonalError;
use nalgebra::{DMatrix, DVector};
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// The unknowns at one position of one axis, in orthonormal combinations.
#[derive(Debug)]
pub(super) struct Group {
    /// Places of the unknowns, p of them.
    pub(super) places: Vec<usize>,
    /// Combinations that some stop sees, p × r.
    pub(super) seen: DMatrix<f64>,
    /// Those that none does, p × (p − r).
    pub(super) unseen: DMatrix<f64>,
    /// First column of the band that belongs to `seen`.
    pub(super) first: usize,
}

/// Where an unknown is.
#[derive(Debug, Clone, Copy)]
pub(super) enum Slot {
    /// Group and row in it.
    Group(usize, usize),
    /// Column of the border.
    Border(usize),
}

/// All unknowns in order.
#[derive(Debug)]
pub(super) struct Arrangement {
    /// From the middle of the travel outwards.
    pub(super) groups: Vec<Group>,
    /// Where each unknown is.
    pub(super) slots: Vec<Slot>,
    /// First column of each level, and the end.
    pub(super) levels: Vec<usize>,
    /// Number of unknowns in the border.
    pub(super) border: usize,
}

/// Arranges the unknowns of a design.
///
/// # Errors
/// Singular values do not converge.
pub(super) fn arrange(design: &Design, zone: &WorkZone) -> Result<Arrangement, DiagonalError> {
    let mut members: BTreeMap<(Reverse<usize>, usize, usize), Vec<usize>> = BTreeMap::new();
    let mut slots = Vec::with_capacity(design.unknowns.parameters.len());
    let mut border = 0;
    for (place, parameter) in design.unknowns.parameters.iter().enumerate() {
        slots.push(Slot::Border(border));
        match *parameter {
            Parameter::Node(c, index) | Parameter::Reversal(c, index)
                if (1..zone.steps).contains(&index) =>
            {
                let level = index.min(zone.steps - index);
                let position = (Reverse(level), c.axis.index(), index);
                members.entry(position).or_default().push(place);
            }
            _ => border += 1,
        }
    }
    for (group, places) in members.values().enumerate() {
        for (row, &place) in places.iter().enumerate() {
            slots[place] = Slot::Group(group, row);
        }
    }
    let mut sights: Vec<Vec<f64>> = vec![Vec::new(); members.len()];
    let sizes: Vec<usize> = members.values().map(Vec::len).collect();
    for terms in &design.stops {
        let mut last = None;
        let mut of_groups: Vec<(usize, usize, f64)> = terms
            .iter()
            .filter_map(|&(place, a)| match slots[place] {
                Slot::Group(group, row) => Some((group, row, a)),
                Slot::Border(_) => None,
            })
            .collect();
        of_groups.sort_by_key(|t| t.0);
        for (group, row, a) in of_groups {
            let rows = &mut sights[group];
            if last != Some(group) {
                rows.resize(rows.len() + sizes[group], 0.0);
                last = Some(group);
            }
            let start = rows.len() - sizes[group];
            rows[start + row] = a;
        }
    }
    let (mut groups, mut levels) = (Vec::with_capacity(members.len()), Vec::new());
    let (mut columns, mut level) = (0, None);
    for (((at, ..), places), sight) in members.into_iter().zip(sights) {
        if level != Some(at) {
            levels.push(columns);
            level = Some(at);
        }
        let p = places.len();
        let split = decompose(&DMatrix::from_row_slice(sight.len() / p, p, &sight), 0.0)?;
        let vectors: Vec<DVector<f64>> = split.determined.into_iter().map(|d| d.1).collect();
        let seen = match &vectors[..] {
            [] => DMatrix::zeros(p, 0),
            some => DMatrix::from_columns(some),
        };
        columns += seen.ncols();
        groups.push(Group {
            places,
            first: columns - seen.ncols(),
            seen,
            unseen: split.null,
        });
    }
    levels.push(columns);
    Ok(Arrangement {
        groups,
        slots,
        levels,
        border,
    })
}
