//! Readings along diagonals and the single-axis edges between them.

use super::components::Axis;
use super::diagonals::{Diagonal, Sequence, Target, Travel, WorkZone};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashSet};
use thiserror::Error;

/// One reading of the laser.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DiagonalReading {
    /// Diagonal along which the beam runs.
    pub diagonal: Diagonal,
    /// What the tool carries.
    pub target: Target,
    /// Order of the motions.
    pub sequence: Sequence,
    /// Repeat number, from 1.
    pub repeat: u32,
    /// Sense of travel; the way back belongs to the same run.
    pub travel: Travel,
    /// Grid indices of the machine position.
    pub at: [usize; 3],
    /// Displacement read less the nominal one, µm.
    pub value: f64,
}

/// One run: readings whose laser was zeroed once.
pub(super) type Run = (Diagonal, Target, Sequence, u32);

impl DiagonalReading {
    pub(super) fn run(&self) -> Run {
        (self.diagonal, self.target, self.sequence, self.repeat)
    }
}

/// Why readings cannot be used.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DiagonalError {
    /// Nothing to work on.
    #[error("there are no readings")]
    NoReadings,
    /// A work zone without volume or steps.
    #[error(
        "the work zone {} × {} × {} mm with {} steps makes no grid: every travel used must be positive, with at least one step",
        travel[0], travel[1], travel[2], steps
    )]
    Zone {
        /// Travel, mm.
        travel: [f64; 3],
        /// Steps on each axis.
        steps: usize,
    },
    /// A travel of no machine.
    #[error(
        "the travel of {} is {travel:e} mm: positions are in mm, travels from {LEAST_TRAVEL:e} to {GREATEST_TRAVEL:e} mm can be used",
        axis.letter()
    )]
    Travel {
        /// Axis.
        axis: Axis,
        /// Its travel, mm.
        travel: f64,
    },
    /// A standard deviation of a reading that is not positive and finite.
    #[error(
        "the standard deviation of a reading is {noise} um: it must be greater than zero and finite"
    )]
    Noise {
        /// As given, µm.
        noise: f64,
    },
    /// A reading is NaN or infinite.
    #[error("reading {}: it is not finite", index + 1)]
    NotFinite {
        /// Place in the list, from 0.
        index: usize,
    },
    /// A position that the diagonal's steps do not reach.
    #[error("reading {}: {}", index + 1, off_path(*at, *diagonal, *sequence))]
    OffPath {
        /// Place in the list, from 0.
        index: usize,
        /// Grid indices.
        at: [usize; 3],
        /// Diagonal.
        diagonal: Diagonal,
        /// Sequence.
        sequence: Sequence,
    },
    /// The same stop twice in one run.
    #[error("reading {}: {}", index + 1, repeated(*diagonal, *sequence, *repeat, *travel))]
    Duplicate {
        /// Place in the list, from 0.
        index: usize,
        /// Diagonal.
        diagonal: Diagonal,
        /// Sequence.
        sequence: Sequence,
        /// Repeat.
        repeat: u32,
        /// Sense of travel.
        travel: Travel,
    },
    /// A measured quantity whose standard uncertainty cannot be used.
    #[error(
        "the standard uncertainty of the measured {what} must be greater than zero and finite, and within a hundred decades of what the readings give"
    )]
    MeasuredUncertainty {
        /// The quantity.
        what: String,
    },
    /// The regression could not be computed.
    #[error("the regression failed: {reason}")]
    Numerical {
        /// What failed.
        reason: String,
    },
}

/// Travels beyond these, mm, are no machine's; their squares might leave the range of numbers.
const LEAST_TRAVEL: f64 = 1e-6;
const GREATEST_TRAVEL: f64 = 1e9;

fn off_path(at: [usize; 3], diagonal: Diagonal, sequence: Sequence) -> String {
    format!(
        "position {at:?} (in steps) is no stop of diagonal {} in sequence {}",
        diagonal.name(),
        sequence.name()
    )
}

fn repeated(diagonal: Diagonal, sequence: Sequence, repeat: u32, travel: Travel) -> String {
    format!(
        "it repeats a stop of diagonal {}, sequence {}, repeat {repeat}, {}: number the repeats",
        diagonal.name(),
        sequence.name(),
        travel.name()
    )
}

impl DiagonalError {
    /// The place in the list, from 0, of the reading that is wrong, and what is wrong with it.
    pub fn at_reading(&self) -> Option<(usize, String)> {
        match self {
            Self::NotFinite { index } => Some((*index, "the reading is not finite".to_owned())),
            Self::OffPath {
                index,
                at,
                diagonal,
                sequence,
            } => Some((*index, off_path(*at, *diagonal, *sequence))),
            Self::Duplicate {
                index,
                diagonal,
                sequence,
                repeat,
                travel,
            } => Some((*index, repeated(*diagonal, *sequence, *repeat, *travel))),
            _ => None,
        }
    }
}

/// Refuses a standard deviation of a reading that is none.
pub(super) fn check_noise(noise: Option<f64>) -> Result<(), DiagonalError> {
    match noise {
        Some(noise) if !(noise > 0.0 && noise.is_finite()) => Err(DiagonalError::Noise { noise }),
        _ => Ok(()),
    }
}

/// Refuses readings that the analysis cannot place.
///
/// # Errors
/// What [`DiagonalError`] lists of readings and work zone.
pub fn check(zone: &WorkZone, readings: &[DiagonalReading]) -> Result<(), DiagonalError> {
    if readings.is_empty() {
        return Err(DiagonalError::NoReadings);
    }
    let body = readings.iter().any(|r| r.diagonal.is_body());
    let used = if body { 3 } else { 2 };
    if zone.steps == 0
        || zone.travel[..used]
            .iter()
            .any(|t| !(*t > 0.0 && t.is_finite()))
    {
        return Err(DiagonalError::Zone {
            travel: zone.travel,
            steps: zone.steps,
        });
    }
    for axis in &Axis::ALL[..used] {
        let travel = zone.travel[axis.index()];
        if !(LEAST_TRAVEL..=GREATEST_TRAVEL).contains(&travel) {
            return Err(DiagonalError::Travel {
                axis: *axis,
                travel,
            });
        }
    }
    let mut seen = HashSet::with_capacity(readings.len());
    for (index, r) in readings.iter().enumerate() {
        if !r.value.is_finite() {
            return Err(DiagonalError::NotFinite { index });
        }
        if !zone.is_stop(r.diagonal, r.sequence, r.at) {
            return Err(DiagonalError::OffPath {
                index,
                at: r.at,
                diagonal: r.diagonal,
                sequence: r.sequence,
            });
        }
        if !seen.insert((r.run(), r.travel, r.at)) {
            return Err(DiagonalError::Duplicate {
                index,
                diagonal: r.diagonal,
                sequence: r.sequence,
                repeat: r.repeat,
                travel: r.travel,
            });
        }
    }
    Ok(())
}

/// In which sense the axis moves that makes a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Motion {
    /// In either; the mean of all.
    Either,
    /// Towards greater positions.
    Positive,
    /// Towards smaller positions.
    Negative,
}

/// One step of one axis: the set-up it belongs to, where its lower end is, which axis moves and in
/// which sense.
type Step = (Diagonal, Target, [usize; 3], Axis, Motion);

/// The readings at both ends of every single-axis motion, the lower end first.
#[derive(Debug, Clone, Default)]
pub struct Edges {
    ends: BTreeMap<Step, Vec<(usize, usize)>>,
}

impl Edges {
    /// Finds the edges of all runs.
    pub fn of(readings: &[DiagonalReading]) -> Self {
        let mut runs: BTreeMap<(Run, Travel), BTreeMap<[usize; 3], usize>> = BTreeMap::new();
        for (index, r) in readings.iter().enumerate() {
            let stops = runs.entry((r.run(), r.travel)).or_default();
            stops.insert(r.at, index);
        }
        let mut edges = Self::default();
        for (((diagonal, target, _, _), travel), stops) in &runs {
            let approach = diagonal.approach(*travel);
            for (&at, &low) in stops {
                for axis in Axis::ALL {
                    let mut next = at;
                    next[axis.index()] += 1;
                    let Some(&high) = stops.get(&next) else {
                        continue;
                    };
                    let own = if approach[axis.index()] > 0 {
                        Motion::Positive
                    } else {
                        Motion::Negative
                    };
                    for motion in [Motion::Either, own] {
                        let step = (*diagonal, *target, at, axis, motion);
                        edges.ends.entry(step).or_default().push((low, high));
                    }
                }
            }
        }
        edges
    }

    /// dd_PQ of a cell, as weights on readings: the mean over the runs that hold the edge. `from` and
    /// `to` are the letters of its corners, A to H.
    pub fn weights(
        &self,
        diagonal: Diagonal,
        target: Target,
        cell: [usize; 3],
        (from, to): (char, char),
        motion: Motion,
    ) -> Option<Vec<(usize, f64)>> {
        let (p, q) = (corner(from)?, corner(to)?);
        let axis = Axis::ALL.into_iter().find(|a| {
            let a = a.index();
            p[a] != q[a] && (0..3).all(|b| b == a || p[b] == q[b])
        })?;
        let forward = q[axis.index()] > p[axis.index()];
        let low: [usize; 3] = std::array::from_fn(|a| cell[a] + p[a].min(q[a]));
        let ends = self.ends.get(&(diagonal, target, low, axis, motion))?;
        let share = if forward { 1.0 } else { -1.0 } / ends.len() as f64;
        Some(
            ends.iter()
                .flat_map(|&(l, h)| [(h, share), (l, -share)])
                .collect(),
        )
    }
}

fn corner(letter: char) -> Option<[usize; 3]> {
    Some(match letter {
        'A' => [0, 0, 0],
        'B' => [1, 0, 0],
        'C' => [1, 1, 0],
        'D' => [0, 1, 0],
        'E' => [0, 0, 1],
        'F' => [1, 0, 1],
        'G' => [1, 1, 1],
        'H' => [0, 1, 1],
        _ => return None,
    })
}
