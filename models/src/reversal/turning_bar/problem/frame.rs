//! From what places and times are counted.

use super::super::run::Run;

/// Where the axes of a run have their zeros, and the angle from which the turn is counted.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// x_r, mm: where e lies along side 0.
    pub reference_mm: f64,
    /// Half the travel, mm.
    pub half_mm: f64,
    /// Middle of the times.
    pub middle: f64,
    /// Half their range.
    pub half_time: f64,
    /// θ_b of every reading, rad.
    pub base: Vec<f64>,
    /// Least and greatest position, mm: the ends of the form.
    pub range: (f64, f64),
    /// First and last time: the ends of the turn.
    pub times: (f64, f64),
}

impl Frame {
    /// The frame of a run whose base angle is known.
    pub fn new(run: &Run, base: Vec<f64>, reference_mm: f64) -> Self {
        let ((first, last), (low, high)) = (run.times(), run.range());
        Self {
            reference_mm,
            half_mm: 0.5 * (high - low),
            middle: f64::midpoint(first, last),
            half_time: 0.5 * (last - first),
            base,
            range: (low, high),
            times: (first, last),
        }
    }

    /// The frame of the readings of which `keep` says so.
    #[must_use]
    pub fn part(&self, keep: impl Fn(usize) -> bool) -> Self {
        let kept = self.base.iter().enumerate().filter(|(i, _)| keep(*i));
        Self {
            base: kept.map(|(_, b)| *b).collect(),
            ..self.clone()
        }
    }

    /// ξ of a position.
    pub fn xi(&self, x: f64) -> f64 {
        (x - self.reference_mm) / self.half_mm
    }

    /// τ of a time.
    pub fn tau(&self, time: f64) -> f64 {
        (time - self.middle) / self.half_time
    }
}
