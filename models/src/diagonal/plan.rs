//! Before measuring: what a choice of diagonals, targets and sequences will determine.

use super::components::Component;
use super::design::{Design, Function, blank_readings, is_definition, left_open};
use super::determination::{Determined, determination};
use super::diagonals::{Diagonal, Sequence, Target, WorkZone};
use super::readings::DiagonalError;
use serde::{Deserialize, Serialize};

/// How far each error is determined by one run of each (diagonal, target, sequence).
///
/// # Errors
/// [`DiagonalError::Numerical`] if the decomposition fails.
pub fn determined_by(
    zone: &WorkZone,
    runs: &[(Diagonal, Target, Sequence)],
) -> Result<Vec<(Component, Determined)>, DiagonalError> {
    let readings = blank_readings(zone, runs);
    let design = Design::of(zone, &readings, |p| !is_definition(p, zone.steps));
    let null = left_open(&design, zone)?;
    Component::all()
        .map(|c| {
            let function = Function::Error(c);
            Ok((c, determination(&design.unknowns, &null, function)?.0))
        })
        .collect()
}

/// A set of sequences, run on every diagonal, and the angular errors that it determines.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SequenceChoice {
    /// The sequences.
    pub sequences: Vec<Sequence>,
    /// Angular errors wholly determined.
    pub angular: Vec<Component>,
    /// Translational errors determined wholly or in shape.
    pub translational: Vec<Component>,
}

/// For each number of sequences from 1 to 6 the first set that determines the most angular errors,
/// and among those the most translational ones.
///
/// # Errors
/// [`DiagonalError::Numerical`] if a decomposition fails.
pub fn choose_sequences(
    zone: &WorkZone,
    diagonals: &[Diagonal],
    targets: &[Target],
) -> Result<Vec<SequenceChoice>, DiagonalError> {
    // Four steps tell what is determined: the pattern repeats from step to step.
    let zone = WorkZone {
        steps: zone.steps.clamp(1, 4),
        ..*zone
    };
    let mut best: Vec<Option<SequenceChoice>> = vec![None; Sequence::STEPS.len()];
    for mask in 1_usize..1 << Sequence::STEPS.len() {
        let sequences: Vec<Sequence> = Sequence::STEPS
            .into_iter()
            .enumerate()
            .filter(|(bit, _)| mask >> bit & 1 == 1)
            .map(|(_, s)| s)
            .collect();
        let mut runs = Vec::new();
        for &target in targets {
            for &diagonal in diagonals {
                runs.extend(sequences.iter().map(|&s| (diagonal, target, s)));
            }
        }
        let determined = determined_by(&zone, &runs)?;
        let pick = |rotation: bool| {
            determined
                .iter()
                .filter(|(c, d)| {
                    c.rotation == rotation
                        && (*d == Determined::Wholly || (!rotation && *d == Determined::ShapeOnly))
                })
                .map(|(c, _)| *c)
                .collect::<Vec<Component>>()
        };
        let choice = SequenceChoice {
            angular: pick(true),
            translational: pick(false),
            sequences,
        };
        let worth = |c: &SequenceChoice| (c.angular.len(), c.translational.len());
        let slot = &mut best[choice.sequences.len() - 1];
        if slot.as_ref().is_none_or(|old| worth(&choice) > worth(old)) {
            *slot = Some(choice);
        }
    }
    Ok(best.into_iter().flatten().collect())
}
