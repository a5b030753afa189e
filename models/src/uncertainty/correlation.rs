//! Correlation coefficients between the inputs of a measurement.

use super::UncertaintyError;

/// A symmetric table of correlation coefficients; what is not set is uncorrelated.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlation {
    count: usize,
    pairs: Vec<(usize, usize, f64)>,
}

impl Correlation {
    /// `count` uncorrelated inputs.
    #[must_use]
    pub fn none(count: usize) -> Self {
        Self {
            count,
            pairs: Vec::new(),
        }
    }

    /// Number of inputs the table is for.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Sets the coefficient of two different inputs.
    ///
    /// # Errors
    /// An index out of range, an input with itself, a pair set before, a coefficient outside
    /// -1..=1.
    pub fn with(
        mut self,
        first: usize,
        second: usize,
        coefficient: f64,
    ) -> Result<Self, UncertaintyError> {
        let wrong = |why| {
            Err(UncertaintyError::BadCorrelation {
                first,
                second,
                found: coefficient,
                why,
            })
        };
        if first >= self.count || second >= self.count {
            return wrong("there is no such quantity");
        }
        if first == second {
            return wrong("a quantity is always fully correlated with itself");
        }
        if !(-1.0..=1.0).contains(&coefficient) {
            return wrong("it must lie between -1 and 1");
        }
        let pair = (first.min(second), first.max(second));
        if self.pairs.iter().any(|&(i, j, _)| (i, j) == pair) {
            return wrong("it is set twice");
        }
        self.pairs.push((pair.0, pair.1, coefficient));
        Ok(self)
    }

    /// The pairs set, each with its smaller index first.
    pub fn pairs(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        self.pairs.iter().copied()
    }
}
