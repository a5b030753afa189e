//! Anderson's mixing of a fixed-point iteration (J. ACM 12 (1965) 547): the next iterate is that
//! combination of the last few whose remaining steps cancel best.

use nalgebra::{DMatrix, DVector};

/// Number of earlier steps that are combined.
const DEPTH: usize = 5;
/// Part of the greatest squared step below which a combination is rounding.
const DEPENDENT: f64 = 1e-8;

/// The last iterates and their steps.
#[derive(Default)]
pub(crate) struct Mixing {
    /// Images and steps, latest last.
    history: Vec<(DMatrix<f64>, DMatrix<f64>)>,
}

impl Mixing {
    /// The next iterate after one and its image.
    pub fn mixed(&mut self, iterate: &DMatrix<f64>, image: DMatrix<f64>) -> DMatrix<f64> {
        let step = &image - iterate;
        self.history.push((image, step));
        if self.history.len() > DEPTH + 1 {
            self.history.remove(0);
        }
        let Some(((image, step), earlier)) = self.history.split_last() else {
            return iterate.clone();
        };
        if earlier.is_empty() {
            return image.clone();
        }
        let turns: Vec<DMatrix<f64>> = earlier.iter().map(|(_, s)| step - s).collect();
        let gram = DMatrix::from_fn(turns.len(), turns.len(), |i, j| turns[i].dot(&turns[j]));
        let along = DVector::from_fn(turns.len(), |i, _| turns[i].dot(step));
        let weights = gram
            .pseudo_inverse(DEPENDENT * step.norm_squared())
            .map_or_else(|_| DVector::zeros(turns.len()), |inverse| inverse * along);
        let mut next = image.clone();
        for ((earlier, _), weight) in earlier.iter().zip(weights.iter()) {
            next += (earlier - image) * *weight;
        }
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x ← A x + b with eigenvalues up to 0.9 and of both signs: in three unknowns the mixing is
    /// there after four steps, where the plain iteration still has 0.9⁶ = 0.53 of its distance.
    #[test]
    fn a_linear_fixed_point_is_found_in_as_many_steps_as_unknowns() {
        let a = DMatrix::from_row_slice(3, 3, &[0.9, 0.2, 0.0, 0.0, -0.7, 0.1, 0.0, 0.0, 0.5]);
        let b = DMatrix::from_column_slice(3, 1, &[1.0, -2.0, 0.5]);
        let truth = (DMatrix::identity(3, 3) - &a).lu().solve(&b).unwrap();
        let mut x = DMatrix::zeros(3, 1);
        let mut mixing = Mixing::default();
        for _ in 0..6 {
            let image = &a * &x + &b;
            x = mixing.mixed(&x, image);
        }
        // Rounding, times the condition of (I − A) and of the differences.
        assert!((&x - &truth).norm() < 1e-6 * truth.norm(), "{x} {truth}");
    }
}
