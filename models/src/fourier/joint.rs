//! The joint signal of P2 and P3 and the height difference between them.

use super::scan::{FourierError, Scan, Section};
use serde::{Deserialize, Serialize};

/// How the height difference of P2 and P3 is taken out of the joint signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Compensation {
    /// Not at all: the probes were levelled, or the ramp is wanted.
    None,
    /// P3 is shifted so that the joint is continuous, equation (15): the profile then starts and ends
    /// at the same height, whatever the tilt of the workpiece, and the cut-off series has no ramp to
    /// represent. The tilt is given beside the profile.
    #[default]
    Chord,
    /// Equation (20): the tilt of the workpiece, found from P1 at both ends of the travel, stays in
    /// the profile. The series must then carry a ramp.
    Level,
}

/// One reading in the shift of P3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShiftTerm {
    /// Probe, 1 to 3.
    pub probe: u8,
    /// Place in the scan.
    pub index: usize,
    /// Weight in the shift.
    pub weight: f64,
}

/// The difference signal of one scan, on the N points of the section.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// m = m₁ − m_r2, µm.
    pub difference: Vec<f64>,
    /// P1, µm.
    pub first: Vec<f64>,
    /// What was added to P3, µm; nothing in the two-sensor method.
    pub shift: Option<f64>,
    /// The readings of which the shift is a weighted sum.
    pub shift_terms: Vec<ShiftTerm>,
    /// A2 − A3 of equation (18), µm, if the slide ends level and P1 was read at both ends.
    pub height_difference: Option<f64>,
    /// Rise of the workpiece over the section, µm: m₁(L) − m₁(0), if read and if the slide ends level.
    pub rise: Option<f64>,
}

/// Joins P2 and P3: m_r2 = m₂ for x < L − d, m₃ from there on (equation (9) with its limits
/// corrected). Without a third probe P2 is used throughout and the profile must repeat beyond L.
///
/// # Errors
/// What [`FourierError`] lists for an uneven grid, missing probes or no overlap at the joint.
pub fn join(
    scan: &Scan,
    section: Section,
    compensation: Compensation,
) -> Result<Joint, FourierError> {
    let samples = scan.samples(section)?;
    let readings = &scan.readings;
    let closing = readings.get(samples).map(|r| r.m1);
    let rise = closing.zip(readings.first()).map(|(end, r)| end - r.m1);
    let joint = section.length - scan.spacing;
    let step = step_at_joint(scan, joint);
    let mut shift = None;
    let mut shift_terms = Vec::new();
    if scan.has_third_probe() {
        if compensation != Compensation::None {
            shift_terms = step.clone().ok_or(FourierError::NoOverlap { joint })?;
        }
        if compensation == Compensation::Level {
            let length = section.length;
            rise.ok_or(FourierError::NoClosingReading { length })?;
            for (index, weight) in [(0, 1.0), (samples, -1.0)] {
                shift_terms.push(ShiftTerm {
                    probe: 1,
                    index,
                    weight,
                });
            }
        }
        shift = Some(sum_of(scan, &shift_terms));
    }
    let height_difference = step
        .zip(rise)
        .map(|(terms, rise)| sum_of(scan, &terms) - rise);
    let slack = 1e-6 * section.length / samples as f64;
    let mut difference = Vec::with_capacity(samples);
    for r in &readings[..samples] {
        let second = match shift {
            Some(shift) if r.x >= joint - slack => {
                r.m3.map(|m3| m3 + shift)
                    .ok_or(FourierError::ProbeMissing { probe: 3, x: r.x })?
            }
            _ => {
                r.m2.ok_or(FourierError::ProbeMissing { probe: 2, x: r.x })?
            }
        };
        difference.push(r.m1 - second);
    }
    Ok(Joint {
        difference,
        first: readings[..samples].iter().map(|r| r.m1).collect(),
        shift,
        shift_terms,
        height_difference,
        rise,
    })
}

/// m₂ − m₃ at the joint, on a grid point or interpolated between the two beside it.
fn step_at_joint(scan: &Scan, joint: f64) -> Option<Vec<ShiftTerm>> {
    let readings = &scan.readings;
    let after = readings.partition_point(|r| r.x < joint);
    let pitch = readings.get(1)?.x - readings.first()?.x;
    let on_grid = [after.checked_sub(1), Some(after)]
        .into_iter()
        .flatten()
        .find(|&i| {
            readings
                .get(i)
                .is_some_and(|r| (r.x - joint).abs() < 1e-6 * pitch)
        });
    let shares = match on_grid {
        Some(index) => vec![(index, 1.0)],
        None => {
            let before = after.checked_sub(1)?;
            let (x0, x1) = (readings.get(before)?.x, readings.get(after)?.x);
            let share = (joint - x0) / (x1 - x0);
            vec![(before, 1.0 - share), (after, share)]
        }
    };
    let mut terms = Vec::new();
    for (index, weight) in shares {
        let r = readings.get(index)?;
        r.m2.and(r.m3)?;
        for (probe, weight) in [(2, weight), (3, -weight)] {
            terms.push(ShiftTerm {
                probe,
                index,
                weight,
            });
        }
    }
    Some(terms)
}

fn sum_of(scan: &Scan, terms: &[ShiftTerm]) -> f64 {
    terms
        .iter()
        .filter_map(|t| {
            let r = scan.readings.get(t.index)?;
            let reading = match t.probe {
                1 => Some(r.m1),
                2 => r.m2,
                _ => r.m3,
            };
            reading.map(|value| t.weight * value)
        })
        .sum()
}
