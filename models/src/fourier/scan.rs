//! One pass of the probes over the section, and what can be wrong with it.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::filled::Filled;

/// What is measured: the section of the workpiece and how finely.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Section {
    /// Length L of the section, mm; in the three-sensor method also the distance from P2 to P3.
    pub length: f64,
    /// Highest order that is kept, undulations per section.
    pub orders: usize,
}

/// The probes at one slide position.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScanReading {
    /// Position of the first probe, mm, from 0 at the start of the section.
    pub x: f64,
    /// Reading of P1, at x, µm.
    pub m1: f64,
    /// Reading of P2, at x + d, µm.
    pub m2: Option<f64>,
    /// Reading of P3, at x + d − L, µm; absent in the two-sensor method.
    pub m3: Option<f64>,
}

/// One pass with one probe spacing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// Distance d from P1 to P2, mm.
    pub spacing: f64,
    /// Repeat number, from 1.
    pub repeat: u32,
    /// Readings in order of x, evenly spaced from 0; the last may be at L.
    pub readings: Vec<ScanReading>,
    /// Readings that were taken from other scans ([`fill`](super::fill)).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub filled: Vec<Filled>,
}

/// Why a scan cannot be separated.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FourierError {
    /// No scan was given.
    #[error("there is no scan to separate")]
    NoScan,
    /// The section's length or the probe spacing makes no sense.
    #[error("probe spacing {spacing} mm must lie between 0 and the section's length {length} mm")]
    Spacing {
        /// Spacing, mm.
        spacing: f64,
        /// Section, mm.
        length: f64,
    },
    /// A reading or a position is NaN, infinite, or so large that its square is.
    #[error("the readings at x = {x} mm are not numbers that a probe can give")]
    NotFinite {
        /// Place in the scan, from 0.
        index: usize,
        /// Position, mm.
        x: f64,
    },
    /// Two readings of a scan at one position.
    #[error("x = {x} mm is read twice in one scan")]
    Duplicate {
        /// Place of the second in the scan, from 0.
        index: usize,
        /// Position, mm.
        x: f64,
    },
    /// Positions are not the even grid that the Fourier transform needs.
    #[error(
        "x = {found} mm stands where an even grid from 0 with step {step} mm has {expected} mm"
    )]
    UnevenGrid {
        /// Place in the scan, from 0.
        index: usize,
        /// Step of the grid, mm.
        step: f64,
        /// Position expected, mm.
        expected: f64,
        /// Position found, mm.
        found: f64,
    },
    /// A step of the grid without a row, or with one that P1 is missing in.
    #[error("P1 has no reading at x = {x} mm, the next is at {next} mm")]
    RowMissing {
        /// Place in the scan of the next reading, from 0.
        index: usize,
        /// Position, mm.
        x: f64,
        /// Position of the next reading, mm.
        next: f64,
    },
    /// The grid does not end at the section's end.
    #[error(
        "the readings end at {end} mm, the section at {length} mm: the grid must fill the section"
    )]
    SectionNotFilled {
        /// Place of the last reading in the scan, from 0.
        index: usize,
        /// Last position, mm.
        end: f64,
        /// Section, mm.
        length: f64,
    },
    /// A probe that is needed was not read.
    #[error("no reading of P{probe} at x = {x} mm, which the joint signal needs there")]
    ProbeMissing {
        /// 2 or 3.
        probe: u8,
        /// Position, mm.
        x: f64,
        /// Place in the scan, from 0.
        index: usize,
    },
    /// The height difference cannot be found.
    #[error(
        "the height difference of P2 and P3 needs both probes read at the joint x = {joint} mm"
    )]
    NoOverlap {
        /// L − d, mm.
        joint: f64,
        /// Place of the reading beside the joint, from 0.
        index: usize,
    },
    /// Equation (20) needs the closing reading of P1.
    #[error(
        "compensation \"level\" needs P1 read at x = {length} mm, one step beyond the last grid point"
    )]
    NoClosingReading {
        /// Section, mm.
        length: f64,
    },
    /// More orders than the grid carries.
    #[error(
        "{orders} orders need more than {} readings, there are {samples}",
        orders.saturating_mul(2)
    )]
    TooManyOrders {
        /// Orders asked for.
        orders: usize,
        /// Readings on the grid.
        samples: usize,
    },
    /// A stated noise that is no standard deviation.
    #[error("a noise of {value} um is no standard deviation")]
    Noise {
        /// As stated, µm.
        value: f64,
    },
    /// Nothing is left over that tells the noise.
    #[error("with {orders} orders kept too little is left over to tell the noise of a reading")]
    NoiseUnknown {
        /// Orders kept.
        orders: usize,
    },
    /// The step at the joint cannot be fitted beside the form.
    #[error("with {orders} orders kept the form of the workpiece takes over the step at the joint")]
    StepNotSeen {
        /// Orders kept.
        orders: usize,
    },
    /// Figures of a simulation that make no sense.
    #[error("{what}")]
    Simulation {
        /// What is wrong.
        what: String,
    },
}

impl FourierError {
    /// Place in the scan, from 0, of the reading that the error is about.
    #[must_use]
    pub fn reading(&self) -> Option<usize> {
        match *self {
            Self::NotFinite { index, .. }
            | Self::Duplicate { index, .. }
            | Self::UnevenGrid { index, .. }
            | Self::RowMissing { index, .. }
            | Self::SectionNotFilled { index, .. }
            | Self::ProbeMissing { index, .. }
            | Self::NoOverlap { index, .. } => Some(index),
            _ => None,
        }
    }
}

/// Readings and positions are below this, µm or mm: sums of their squares stay numbers.
const GREATEST: f64 = 1e100;

impl Scan {
    /// The number N of grid points on 0 ≤ x < L, after checking that the scan is an even grid that
    /// fills the section.
    pub(super) fn samples(&self, section: Section) -> Result<usize, FourierError> {
        let (spacing, length) = (self.spacing, section.length);
        if !(length > 0.0 && length.is_finite() && spacing > 0.0 && spacing < length) {
            return Err(FourierError::Spacing { spacing, length });
        }
        for (index, r) in self.readings.iter().enumerate() {
            let values = [Some(r.x), Some(r.m1), r.m2, r.m3];
            if values.iter().flatten().any(|v| !(v.abs() < GREATEST)) {
                return Err(FourierError::NotFinite { index, x: r.x });
            }
        }
        let twice = |pair: &[ScanReading]| matches!(pair, [a, b] if a.x == b.x);
        if let Some(before) = self.readings.windows(2).position(twice) {
            let index = before + 1;
            let x = self.readings.get(index).map_or(f64::NAN, |r| r.x);
            return Err(FourierError::Duplicate { index, x });
        }
        let (first, second) = match self.readings[..] {
            [first, second, ..] => (first.x, second.x),
            _ => {
                return Err(FourierError::TooManyOrders {
                    orders: section.orders,
                    samples: self.readings.len(),
                });
            }
        };
        // A position that is missing makes one gap twice as long as the others.
        let steps = (length / self.usual_gap().unwrap_or(second - first)).round();
        let step = length / steps;
        if !(step > 0.0 && step.is_finite()) {
            return Err(FourierError::UnevenGrid {
                index: 1,
                step,
                expected: first,
                found: second,
            });
        }
        // A thousandth of a step is a displacement error far below what a grid is set up to.
        let tolerance = 1e-3 * step;
        for (index, r) in self.readings.iter().enumerate() {
            let expected = index as f64 * step;
            let over = (r.x - expected) / step;
            if over > 0.5 && (over - over.round()).abs() * step <= tolerance {
                return Err(FourierError::RowMissing {
                    index,
                    x: expected,
                    next: r.x,
                });
            }
            if (r.x - expected).abs() > tolerance {
                return Err(FourierError::UnevenGrid {
                    index,
                    step,
                    expected,
                    found: r.x,
                });
            }
        }
        let samples = steps as usize;
        if self.readings.len() < samples || self.readings.len() > samples + 1 {
            return Err(FourierError::SectionNotFilled {
                index: self.readings.len().saturating_sub(1),
                end: self.readings.last().map_or(0.0, |r| r.x),
                length,
            });
        }
        if section.orders == 0 || section.orders >= samples.div_ceil(2) {
            return Err(FourierError::TooManyOrders {
                orders: section.orders,
                samples,
            });
        }
        Ok(samples)
    }

    /// Median distance of neighbouring readings, mm.
    pub(super) fn usual_gap(&self) -> Option<f64> {
        let pairs = self.readings.windows(2);
        let mut gaps: Vec<f64> = pairs.map(|pair| pair[1].x - pair[0].x).collect();
        gaps.sort_by(f64::total_cmp);
        gaps.get(gaps.len() / 2).copied()
    }

    /// Whether the scan has a third probe.
    pub fn has_third_probe(&self) -> bool {
        self.readings.iter().any(|r| r.m3.is_some())
    }
}
