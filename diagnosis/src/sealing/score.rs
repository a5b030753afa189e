//! The score of a measurement, as plain values.

use serde::Serialize;

use crate::sealing::sealed::{Interval, REACH, SealedNumber};

/// Whether a sealed cause stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Standing {
    /// It is there, of the size that was sealed.
    Stands,
    /// It is there, of another size.
    Changed,
    /// Nothing of it is there.
    Gone,
    /// The measurement could not have shown it.
    Untested,
}

/// A number that was sealed and what was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckedNumber {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// As it was sealed.
    pub sealed: f64,
    /// 95 % interval of what was to be found, with the measurement's own uncertainty as it was made.
    pub found95: [f64; 2],
    /// What was found.
    pub found: f64,
    /// Its own standard uncertainty; nothing where the measurement alone does not tell it.
    pub std: Option<f64>,
    /// Standard deviations between them.
    pub z: f64,
    /// Whether it lies in its interval.
    pub inside: bool,
}

impl CheckedNumber {
    pub(super) fn new(sealed: &SealedNumber, found: f64, std: Option<f64>) -> Self {
        let z = (found - sealed.value) / sealed.found_std.max(f64::MIN_POSITIVE);
        Self {
            name: sealed.name.clone(),
            unit: sealed.unit.clone(),
            sealed: sealed.value,
            found95: sealed.found95,
            found,
            std,
            z,
            inside: z.abs() <= REACH,
        }
    }
}

/// A cause that was sealed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckedEffect {
    /// Name.
    pub effect: String,
    /// Variant in words, where it has several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variant: Option<String>,
    /// Whether it stands.
    pub standing: Standing,
    /// Its sizes, its shape held as it was sealed.
    pub numbers: Vec<CheckedNumber>,
}

/// A gap that was sealed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckedGap {
    /// As it was sealed: root mean square and its 95 % interval.
    pub sealed: f64,
    /// Its 95 % interval.
    pub found95: [f64; 2],
    /// What was found.
    pub found: f64,
    /// Standard deviations between the mean squares.
    pub z: f64,
    /// Whether it lies in its interval.
    pub inside: bool,
}

impl CheckedGap {
    /// `moved`: mean squares of what the causes change, as they were planned and at the set-up as it is;
    /// `doubt`: relative uncertainty of their sizes.
    pub(super) fn without(sealed: &Interval, square: f64, moved: [f64; 2], doubt: f64) -> Self {
        let [planned, here] = moved;
        let grown = if planned > 0.0 {
            (here / planned).sqrt()
        } else {
            1.0
        };
        let there = Interval::about(
            sealed.square + here - planned,
            (sealed.square_std * grown.max(1.0)).hypot(2.0 * doubt * (here - planned)),
        );
        Self::new(&there, square)
    }

    pub(super) fn new(sealed: &Interval, square: f64) -> Self {
        let z = (square - sealed.square) / sealed.square_std.max(f64::MIN_POSITIVE);
        Self {
            sealed: sealed.rms,
            found95: sealed.ci95,
            found: square.max(0.0).sqrt(),
            z,
            inside: z.abs() <= REACH,
        }
    }
}

/// The readings against their bands.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckedTrace {
    /// Readings that were compared.
    pub readings: usize,
    /// Part of them that lie in their bands.
    pub coverage: f64,
    /// Part that was to lie there.
    pub expected: f64,
    /// Mean square of the misses in units of their standard deviations: one is expected.
    pub mean_square: f64,
    /// The same part by channel.
    pub by_channel: Vec<(String, f64)>,
    /// Readings that were not planned, by trace or position: not compared.
    pub not_planned: usize,
    /// Planned readings that are missing.
    pub missing: usize,
}

/// A measurement against what was sealed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Checked {
    /// Unit of the readings.
    pub unit: &'static str,
    /// The readings.
    pub trace: CheckedTrace,
    /// The causes.
    pub effects: Vec<CheckedEffect>,
    /// The numbers that a new set-up does not change.
    pub quantities: Vec<CheckedNumber>,
    /// What the model misses without the causes.
    pub without: CheckedGap,
    /// With the causes taken out as they were sealed.
    pub with: CheckedGap,
    /// By reading: what it differs by from what was sealed, what a new set-up changes taken out, and half of its
    /// band; nothing where it was not planned.
    #[serde(skip)]
    pub missed: Vec<Option<(f64, f64)>>,
}
