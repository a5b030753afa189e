//! Regularization through the band: A with a few neighbouring nonzeros a row and a few columns that
//! every row may see. Each λ costs one orthogonal factorisation of [A; λL], linear in the rows.

use std::sync::OnceLock;

use rayon::prelude::*;

use super::error::checked_lambda;
use super::factored::Factored;
use super::{Family, Penalty, Point, RegularizationError};

/// A banded and bordered least-squares problem with its data and a penalty on the band's unknowns.
///
/// Side conditions wᵀx = 0 on the band's unknowns may be added; they single out one solution where
/// the rows allow many, whatever their length.
#[derive(Debug, Clone)]
pub struct BandedSystem {
    pub(super) band: usize,
    pub(super) border: usize,
    pub(super) width: usize,
    /// First band unknown of each row, ascending.
    pub(super) firsts: Vec<usize>,
    /// For each row `width` band values, `border` values, the right-hand side.
    pub(super) values: Vec<f64>,
    pub(super) stencil: &'static [f64],
    pub(super) conditions: Vec<Vec<f64>>,
    pub(super) held: Vec<usize>,
    /// The large end of the range, once it was looked for.
    largest: OnceLock<f64>,
}

impl BandedSystem {
    /// An empty system of `band` unknowns of which a row sees `width` neighbours, and `border`
    /// unknowns that every row may see. The penalty acts on the band's unknowns.
    ///
    /// # Errors
    /// A custom penalty, which has no band; a width that is zero or larger than the band.
    pub fn new(
        band: usize,
        width: usize,
        border: usize,
        penalty: &Penalty,
    ) -> Result<Self, RegularizationError> {
        let stencil = penalty.stencil().ok_or(RegularizationError::Shape {
            what: "a row of a custom penalty for the band",
            expected: width,
            found: band,
        })?;
        if width < stencil.len() || width > band {
            return Err(RegularizationError::Shape {
                what: "the width of the band",
                expected: stencil.len(),
                found: width,
            });
        }
        Ok(Self {
            band,
            border,
            width,
            firsts: Vec::new(),
            values: Vec::new(),
            stencil,
            conditions: Vec::new(),
            held: Vec::new(),
            largest: OnceLock::new(),
        })
    }

    /// Adds a row: `width` values for the band unknowns from `first` on, the border's values, and
    /// the right-hand side. Rows come with `first` not decreasing.
    ///
    /// # Errors
    /// A row out of order, beyond the band, of the wrong length, or not finite.
    pub fn push(
        &mut self,
        first: usize,
        band: &[f64],
        border: &[f64],
        data: f64,
    ) -> Result<(), RegularizationError> {
        let shape = |what, expected, found| {
            Err(RegularizationError::Shape {
                what,
                expected,
                found,
            })
        };
        if band.len() != self.width {
            return shape("the band part of a row", self.width, band.len());
        }
        if border.len() != self.border {
            return shape("the border part of a row", self.border, border.len());
        }
        let least = self.firsts.last().copied().unwrap_or(0);
        if first < least || first + self.width > self.band {
            return shape(
                "the place of a row, counted from the row before,",
                least,
                first,
            );
        }
        if !band
            .iter()
            .chain(border)
            .chain([&data])
            .all(|value| value.is_finite())
        {
            return Err(RegularizationError::NotFinite { what: "a row" });
        }
        self.largest = OnceLock::new();
        self.firsts.push(first);
        self.values.extend_from_slice(band);
        self.values.extend_from_slice(border);
        self.values.push(data);
        Ok(())
    }

    /// Requires that a band unknown is zero, and holds it there with a row of its own: needed where
    /// neither the other rows nor the penalty would see it. The row takes its place in the order of
    /// [`push`](Self::push) and does not count as data.
    ///
    /// # Errors
    /// No such unknown, or its row would come out of order.
    pub fn hold(&mut self, unknown: usize) -> Result<(), RegularizationError> {
        let first = unknown.min(self.band - self.width);
        let mut weights = vec![0.0; self.band];
        let (Some(weight), true) = (weights.get_mut(unknown), unknown - first < self.width) else {
            return Err(RegularizationError::Shape {
                what: "the number of an unknown to hold",
                expected: self.band,
                found: unknown,
            });
        };
        *weight = 1.0;
        let mut row = vec![0.0; self.width];
        row[unknown - first] = 1.0;
        self.push(first, &row, &vec![0.0; self.border], 0.0)?;
        self.held.push(self.firsts.len() - 1);
        self.require(weights)
    }

    /// Adds the condition Σ wᵢxᵢ = 0 over all band unknowns.
    ///
    /// # Errors
    /// The wrong number of weights.
    pub fn require(&mut self, weights: Vec<f64>) -> Result<(), RegularizationError> {
        if weights.len() != self.band {
            return Err(RegularizationError::Shape {
                what: "a condition",
                expected: self.band,
                found: weights.len(),
            });
        }
        self.largest = OnceLock::new();
        self.conditions.push(weights);
        Ok(())
    }

    /// Factors the system at λ.
    ///
    /// # Errors
    /// λ not positive; unknowns that neither rows nor penalty determine.
    pub fn factor(&self, lambda: f64) -> Result<Factored<'_>, RegularizationError> {
        Factored::new(self, checked_lambda(lambda)?)
    }

    /// The values of a row, its first unknown and its right-hand side.
    pub(super) fn row(&self, index: usize) -> (usize, &[f64], &[f64], f64) {
        let stride = self.width + self.border + 1;
        let row = &self.values[index * stride..(index + 1) * stride];
        (
            self.firsts[index],
            &row[..self.width],
            &row[self.width..stride - 1],
            row[stride - 1],
        )
    }

    /// Number of rows of L.
    pub fn penalty_rows(&self) -> usize {
        self.band + 1 - self.stencil.len()
    }

    /// L x for the band's unknowns.
    pub(super) fn penalised<'a>(&'a self, x: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        x.windows(self.stencil.len())
            .map(|part| part.iter().zip(self.stencil).map(|(x, s)| x * s).sum())
    }
}

impl Family for BandedSystem {
    fn row_count(&self) -> usize {
        self.firsts.len() - self.held.len()
    }

    /// From five decades below the largest column norm of A over that of L to that, or to where differences
    /// let half a parameter through: waves longer than the rows reach have far smaller differences than values,
    /// and pass a λ that is many times that quotient of norms.
    fn range(&self) -> (f64, f64) {
        let norms = self.of_norms();
        if self.stencil.len() < 2 {
            return (1e-5 * norms, norms);
        }
        let largest = *self
            .largest
            .get_or_init(|| self.half_let_through(norms).unwrap_or(norms));
        (1e-5 * norms, largest)
    }

    fn samples(&self) -> usize {
        // Over five decades; as dense over more.
        const FEWEST: f64 = 48.0;
        let (smallest, largest) = self.range();
        (FEWEST * (largest / smallest).log10() / 5.0)
            .round()
            .max(FEWEST) as usize
    }

    fn points(&self, lambdas: &[f64]) -> Result<Vec<Point>, RegularizationError> {
        lambdas
            .par_iter()
            .map(|lambda| self.point(*lambda))
            .collect()
    }

    fn point(&self, lambda: f64) -> Result<Point, RegularizationError> {
        Ok(self.factor(lambda)?.point())
    }
}

impl BandedSystem {
    /// λ from `norms` on at which half a parameter of those that L sees is let through, to some per cent.
    fn half_let_through(&self, norms: f64) -> Option<f64> {
        // Beyond these decades nothing is.
        const DECADES: f64 = 5.0;
        let parameters = |lambda| Some(self.point(lambda).ok()?.effective_parameters);
        let (mut low, mut high) = (norms, norms * 10_f64.powf(DECADES));
        let free = parameters(high)?.round();
        if parameters(low)? - free < 0.5 {
            return Some(norms);
        }
        while high > 1.05 * low {
            let middle = (low * high).sqrt();
            if parameters(middle)? - free < 0.5 {
                high = middle;
            } else {
                low = middle;
            }
        }
        Some(high)
    }

    /// The largest column norm of A over that of L.
    fn of_norms(&self) -> f64 {
        let mut squares = vec![0.0; self.band];
        for index in 0..self.firsts.len() {
            let (first, band, _, _) = self.row(index);
            for (square, value) in squares[first..].iter_mut().zip(band) {
                *square += value * value;
            }
        }
        let of_a = squares.into_iter().fold(0.0, f64::max).sqrt();
        let of_l = self.stencil.iter().map(|s| s * s).sum::<f64>().sqrt();
        of_a / of_l
    }
}
