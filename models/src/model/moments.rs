//! Moments at which something may begin that lasts: between readings that follow each other.

use super::{Place, Shape};

/// The different moments of some readings, ascending.
pub(crate) struct Moments(Vec<f64>);

impl Moments {
    pub fn of<'a>(places: impl Iterator<Item = &'a Place>) -> Self {
        Self::at(places.map(|p| p.time))
    }

    /// The different ones of these.
    pub fn at(moments: impl Iterator<Item = f64>) -> Self {
        let mut moments: Vec<f64> = moments.collect();
        moments.sort_by(f64::total_cmp);
        moments.dedup();
        Self(moments)
    }

    /// Shapes of a variant at which a search begins, at most about `most`: each midway between two
    /// moments.
    pub fn grid(&self, variant: usize, most: usize) -> Vec<Shape> {
        let stride = self.0.len().div_ceil(most).max(1);
        let pairs = self.0.windows(2).enumerate().step_by(stride);
        pairs
            .map(|(k, pair)| {
                let next = self.0[(k + stride).min(self.0.len() - 1)];
                Shape {
                    variant,
                    values: vec![0.5 * (pair[0] + pair[1])],
                    steps: vec![0.5 * (next - pair[0])],
                }
            })
            .collect()
    }

    /// The moments themselves.
    pub fn all(self) -> Vec<f64> {
        self.0
    }
}
