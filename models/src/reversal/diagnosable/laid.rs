//! What two groups of spindle positions tell of the artefact, laid over each other: how far it lies elsewhere along its axis.
//!
//! What the indicators of one position read together, weighted so that no form of the slide is left, is the artefact's
//! alone: T(x), lines apart. A shift by s makes T(x − s) of it in another position.

use errsep_solvers::linear::limited::symmetric_eigen;
use errsep_solvers::scalar::least_between;
use nalgebra::{DMatrix, DVector};

use super::super::smooth_profile::{SmoothProfile, Spot};
use super::Linearised;

/// Combinations of channels that are zero to this share of the greatest are zero.
const NOTHING: f64 = 1e-9;
/// Least part of the positions at which both positions of the spindle were read.
const LEAST_OVERLAP: f64 = 0.6;
/// Shifts that are tried, by the mean distance of the positions.
const STEP: f64 = 0.5;
/// Most of them to either side.
const MOST_STEPS: f64 = 100.0;
/// To what part of the mean distance of the positions a shift is found here: its size is fitted afterwards.
const FINE: f64 = 1e-3;
/// Places apart over which what is left may go together, and the most by the number of places.
const TOGETHER: usize = 12;
/// See [`TOGETHER`].
const FEW: usize = 10;

/// What two groups of spindle positions tell of the artefact alone.
pub(in crate::reversal) struct Laid<'m> {
    positions: &'m [f64],
    fixed: Vec<SmoothProfile>,
    moved: Vec<DVector<f64>>,
}

impl Laid<'_> {
    /// Mean square of what is left between both, µm², with the artefact of the second group `shift` mm farther along;
    /// infinite where too little is left of the travel.
    pub fn misfit(&self, shift: f64) -> f64 {
        let there = self.overlap(shift);
        if (there.len() as f64) < LEAST_OVERLAP * self.positions.len() as f64 {
            return f64::INFINITY;
        }
        let sum: f64 = self.left(&there).map(|left| left.norm_squared()).sum();
        sum / (there.len() as f64 - 2.0)
    }

    /// The places at which both groups tell the artefact, and where the first does.
    fn overlap(&self, shift: f64) -> Vec<(usize, Spot)> {
        let n = self.positions.len();
        let within = self.positions[0]..=self.positions[n - 1];
        let places = (0..n).filter(|k| within.contains(&(self.positions[*k] - shift)));
        places
            .map(|k| (k, Spot::new(self.positions, k, self.positions[k] - shift)))
            .collect()
    }

    /// What is left of each combination, without straight line.
    fn left(&self, there: &[(usize, Spot)]) -> impl Iterator<Item = DVector<f64>> {
        self.fixed.iter().zip(&self.moved).map(|(fixed, moved)| {
            let left = there.iter().map(|(k, spot)| moved[*k] - fixed.at(spot));
            self.bent(there, DVector::from_iterator(there.len(), left))
        })
    }

    /// Values at places less their straight line.
    fn bent(&self, there: &[(usize, Spot)], mut values: DVector<f64>) -> DVector<f64> {
        let mut x = DVector::from_iterator(there.len(), there.iter().map(|t| self.positions[t.0]));
        x.add_scalar_mut(-x.mean());
        values.add_scalar_mut(-values.mean());
        let slope = x.dot(&values) / x.norm_squared();
        values.axpy(-slope, &x, 1.0);
        values
    }

    /// Standard uncertainty of the best shift, mm: with g the slopes of the artefact along it and e what is left, the sums of
    /// products g e of places up to some apart are what noise gives it, correlated along the traces or not (Newey and
    /// West, Econometrica 55 (1987) 703). Both groups have it.
    pub fn std(&self, shift: f64) -> f64 {
        let there = self.overlap(shift);
        let (mut squares, mut noise) = (0.0, 0.0);
        for (fixed, left) in self.fixed.iter().zip(self.left(&there)) {
            let slopes = there.iter().map(|(_, spot)| fixed.slope_at(spot));
            let slopes = self.bent(&there, DVector::from_iterator(there.len(), slopes));
            squares += slopes.norm_squared();
            let products = slopes.component_mul(&left);
            let together = TOGETHER.min(products.len() / FEW);
            for apart in 0..=together {
                let kept = products.len() - apart;
                let sum = products.rows(0, kept).dot(&products.rows(apart, kept));
                let weight = 1.0 - apart as f64 / (together + 1) as f64;
                noise += if apart == 0 { sum } else { 2.0 * weight * sum };
            }
        }
        (2.0 * noise.max(0.0)).sqrt() / squares
    }

    /// The shift with which both agree best, no farther than `reach`, mm.
    pub fn best(&self, reach: f64) -> f64 {
        let n = self.positions.len();
        let gap = (self.positions[n - 1] - self.positions[0]) / (n - 1) as f64;
        let steps = (reach / (STEP * gap)).floor().clamp(1.0, MOST_STEPS);
        let step = reach / steps;
        let tried = (-(steps as i64)..=steps as i64).map(|k| k as f64 * step);
        let (_, near) = tried.map(|shift| (self.misfit(shift), shift)).fold(
            (f64::INFINITY, 0.0),
            |best, next| {
                if next.0 < best.0 { next } else { best }
            },
        );
        let misfit = |shift: f64| Ok::<_, std::convert::Infallible>(self.misfit(shift));
        let between = (near - step).max(-reach)..(near + step).min(reach);
        least_between(between.start, between.end, FINE * gap, misfit).unwrap_or(near)
    }
}

impl Linearised {
    /// The artefact as two groups of spindle positions tell it; `None` where their channels do not tell it apart from
    /// the slide.
    pub(in crate::reversal) fn laid(
        &self,
        readings: &DVector<f64>,
        fixed: impl Fn(usize) -> bool,
        moved: impl Fn(usize) -> bool,
    ) -> Option<Laid<'_>> {
        let means = self.channel_means(readings, None);
        let own = |c: &usize| {
            let position = self.present()[*c].position;
            means[*c].is_some() && (fixed(position) || moved(position))
        };
        let channels: Vec<usize> = (0..means.len()).filter(own).collect();
        let is_moved = |c: usize| moved(self.present()[c].position);
        let forms = self.forms.len();
        // No slide in either group, and no side in both together.
        let mut rules = DMatrix::zeros(3 * forms, channels.len());
        for (k, c) in channels.iter().enumerate() {
            let group = usize::from(is_moved(*c)) * forms;
            for (form, factor) in self.arrangement.slides(*c) {
                rules[(group + form, k)] = *factor;
            }
            rules[(2 * forms + self.arrangement.side_form(*c), k)] = 1.0;
        }
        let eigen = symmetric_eigen(rules.tr_mul(&rules))?;
        let most = eigen.eigenvalues.amax();
        let n = self.positions.len();
        let (mut still, mut shifted) = (Vec::new(), Vec::new());
        for (k, weights) in eigen.eigenvectors.column_iter().enumerate() {
            if eigen.eigenvalues[k] > NOTHING * most {
                continue;
            }
            let sum = |group: bool, sign: f64| {
                let mut sum = DVector::zeros(n);
                for (c, weight) in channels.iter().zip(weights.iter()) {
                    if let (true, Some(mean)) = (is_moved(*c) == group, &means[*c]) {
                        sum.axpy(sign * weight, mean, 1.0);
                    }
                }
                sum
            };
            still.push(self.smoother.smooth(&sum(false, -1.0)));
            shifted.push(sum(true, 1.0));
        }
        (!still.is_empty()).then_some(Laid {
            positions: &self.positions,
            fixed: still,
            moved: shifted,
        })
    }
}
