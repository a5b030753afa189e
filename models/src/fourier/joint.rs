//! The joint signal of P2 and P3 and the step between them.

use super::scan::{FourierError, Scan, Section};
use serde::{Deserialize, Serialize};

/// How the step between P2 and P3 is taken out of the joint signal: their height difference and the
/// rise of the workpiece over the section.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Compensation {
    /// Not at all: the probes were levelled, or the ramp is wanted.
    None,
    /// P3 is shifted so that the joint is continuous, equation (15): the profile then starts and ends
    /// at the same height, whatever the tilt of the workpiece, and the cut-off series has no ramp to
    /// represent. The tilt is given beside the profile.
    Chord,
    /// Equation (20): the tilt of the workpiece, found from P1 at both ends of the travel, stays in
    /// the profile. The series must then carry a ramp.
    Level,
    /// As [`Compensation::Chord`], but the step is an unknown of the fit of each scan to all its
    /// readings, so that no two readings at the joint limit the profile. It presumes that the
    /// workpiece has no form beyond the orders kept; where the readings show some, the step is taken
    /// as in [`Compensation::Chord`].
    #[default]
    Fitted,
}

/// One reading in the step of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShiftTerm {
    /// Probe, 1 to 3.
    pub probe: u8,
    /// Place in the scan.
    pub index: usize,
    /// Weight in the step.
    pub weight: f64,
}

/// The difference signal of one scan, on the N points of the section.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// m = m₁ − m₂ before the joint, m₁ − m₃ from there on, µm.
    pub difference: Vec<f64>,
    /// P1, µm.
    pub first: Vec<f64>,
    /// Grid points at which P1 was not read but taken from other scans.
    pub first_filled: Vec<usize>,
    /// The first grid point that P3 supplies; nothing in the two-sensor method.
    pub third_from: Option<usize>,
    /// Rise of the workpiece over the section, µm: m₁(L) − m₁(0), if read and if the slide ends level.
    pub rise: Option<f64>,
}

/// Joins P2 and P3: m_r2 = m₂ for x < L − d, m₃ from there on (equation (9) with its limits
/// corrected). Without a third probe P2 is used throughout and the profile must repeat beyond L.
///
/// # Errors
/// What [`FourierError`] lists for an uneven grid, missing probes or readings that are no numbers.
pub fn join(scan: &Scan, section: Section) -> Result<Joint, FourierError> {
    let samples = scan.samples(section)?;
    let readings = &scan.readings;
    let closing = readings.get(samples).map(|r| r.m1);
    let rise = closing.zip(readings.first()).map(|(end, r)| end - r.m1);
    let slack = 1e-6 * section.length / samples as f64;
    let from = section.length - scan.spacing - slack;
    let third_from = scan
        .has_third_probe()
        .then(|| readings.partition_point(|r| r.x < from).min(samples));
    let mut difference = Vec::with_capacity(samples);
    for (index, r) in readings.iter().take(samples).enumerate() {
        let (probe, second) = match third_from {
            Some(from) if index >= from => (3, r.m3),
            _ => (2, r.m2),
        };
        let second = second.ok_or(FourierError::ProbeMissing {
            probe,
            x: r.x,
            index,
        })?;
        difference.push(r.m1 - second);
    }
    Ok(Joint {
        difference,
        first: readings.iter().take(samples).map(|r| r.m1).collect(),
        first_filled: (scan.filled.iter())
            .filter(|f| f.first && f.index < samples)
            .map(|f| f.index)
            .collect(),
        third_from,
        rise,
    })
}

/// The readings of which the step is a weighted sum: none for [`Compensation::None`], for
/// [`Compensation::Fitted`] (all readings count there) and without a third probe.
///
/// # Errors
/// [`FourierError::NoOverlap`] and [`FourierError::NoClosingReading`].
pub fn step_terms(
    scan: &Scan,
    section: Section,
    compensation: Compensation,
) -> Result<Vec<ShiftTerm>, FourierError> {
    if !scan.has_third_probe() || matches!(compensation, Compensation::None | Compensation::Fitted)
    {
        return Ok(Vec::new());
    }
    let mut terms = step_at_joint(scan, section)?;
    if compensation == Compensation::Level {
        let samples = scan.samples(section)?;
        if scan.readings.len() <= samples {
            let length = section.length;
            return Err(FourierError::NoClosingReading { length });
        }
        for (index, weight) in [(0, 1.0), (samples, -1.0)] {
            terms.push(ShiftTerm {
                probe: 1,
                index,
                weight,
            });
        }
    }
    Ok(terms)
}

/// m₂ − m₃ at the joint, on a grid point or interpolated between the two beside it.
fn step_at_joint(scan: &Scan, section: Section) -> Result<Vec<ShiftTerm>, FourierError> {
    let joint = section.length - scan.spacing;
    let readings = &scan.readings;
    let after = readings.partition_point(|r| r.x < joint);
    let index = after.min(readings.len().saturating_sub(1));
    let missing = FourierError::NoOverlap { joint, index };
    let at = |i: usize| readings.get(i).map(|r| r.x);
    let pitch = match (at(0), at(1)) {
        (Some(first), Some(second)) => second - first,
        _ => return Err(missing),
    };
    let on_grid = [after.checked_sub(1), Some(after)]
        .into_iter()
        .flatten()
        .find(|&i| at(i).is_some_and(|x| (x - joint).abs() < 1e-6 * pitch));
    let shares = match on_grid {
        Some(index) => vec![(index, 1.0)],
        None => {
            let before = after.wrapping_sub(1);
            let (Some(x0), Some(x1)) = (at(before), at(after)) else {
                return Err(missing);
            };
            let share = (joint - x0) / (x1 - x0);
            vec![(before, 1.0 - share), (after, share)]
        }
    };
    let mut terms = Vec::new();
    for (index, weight) in shares {
        if !readings
            .get(index)
            .is_some_and(|r| r.m2.is_some() && r.m3.is_some())
        {
            return Err(FourierError::NoOverlap { joint, index });
        }
        for (probe, weight) in [(2, weight), (3, -weight)] {
            terms.push(ShiftTerm {
                probe,
                index,
                weight,
            });
        }
    }
    Ok(terms)
}

/// The weighted sum of the readings, µm.
pub(super) fn sum_of(scan: &Scan, terms: &[ShiftTerm]) -> f64 {
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
