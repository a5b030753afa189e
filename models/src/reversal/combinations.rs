//! Which combinations of the unknowns a set of channels determines, and from which weights.

use errsep_solvers::linear::limited::svd;
use nalgebra::DMatrix;

/// A combination of unknowns that the channels determine: Σ coefficient·unknown = Σ weight·channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Combination {
    /// Coefficient of each unknown.
    pub coefficients: Vec<f64>,
    /// Weight of each channel, in the order of the rows.
    pub weights: Vec<f64>,
}

impl Combination {
    /// The unknown that this combination gives by itself, if it is one.
    pub fn single(&self) -> Option<usize> {
        let mut nonzero = (0..self.coefficients.len()).filter(|&i| self.coefficients[i] != 0.0);
        match (nonzero.next(), nonzero.next()) {
            (Some(i), None) => Some(i),
            _ => None,
        }
    }

    /// The combination in words, such as `beta + gamma` or `M + S_A/2 + S_B/2`.
    pub fn name(&self, unknowns: &[&str]) -> String {
        let mut name = String::new();
        for (c, unknown) in self.coefficients.iter().zip(unknowns) {
            let sign = match (*c, name.is_empty()) {
                (0.0, _) => continue,
                (c, true) if c < 0.0 => "-",
                (_, true) => "",
                (c, false) if c < 0.0 => " - ",
                (_, false) => " + ",
            };
            name += sign;
            name += unknown;
            if c.abs() != 1.0 {
                name += &format!("/{}", 1.0 / c.abs());
            }
        }
        name
    }
}

/// Coefficients below this are rounding: the rows hold −1, 0 and 1 only.
const ROUNDING: f64 = 1e-9;

/// The independent combinations that the rows of `design` (one a channel, entries −1, 0, 1)
/// determine.
///
/// The determined part of an unknown is its row of the projector A⁺A on the row space; taken in
/// order and made orthogonal to those before, these rows are an orthogonal basis of all that is
/// determined. Each is scaled to a greatest coefficient of 1, or ½ where it weighs two unknowns
/// `halved` (a mean or half difference).
pub fn determined(design: &DMatrix<f64>, halved: &[usize]) -> Vec<Combination> {
    // The rows are few and their entries small integers: the tolerance parts 0 from at least 0.3.
    let inverse =
        svd(design.clone(), true, true).and_then(|factors| factors.pseudo_inverse(ROUNDING).ok());
    let Some(inverse) = inverse else {
        return Vec::new();
    };
    let projector = &inverse * design;
    let mut basis: Vec<nalgebra::RowDVector<f64>> = Vec::new();
    for row in projector.row_iter() {
        let mut rest = row.into_owned();
        for b in &basis {
            rest -= b * (rest.dot(b) / b.norm_squared());
        }
        if rest.norm() > ROUNDING {
            basis.push(rest);
        }
    }
    basis
        .into_iter()
        .map(|b| {
            let largest = b.amax();
            let is_halved = (0..b.len()).filter(|&i| b[i].abs() > ROUNDING).count() == 2
                && halved.iter().filter(|&&i| b[i].abs() > ROUNDING).count() == 2;
            let scale = if is_halved { 0.5 } else { 1.0 } / largest;
            let clean = |c: f64| {
                let c = c * scale;
                // Multiples of one twelfth hold every coefficient and weight of four sign rows.
                (c * 12.0).round() / 12.0
            };
            let weights = &b * &inverse;
            Combination {
                coefficients: b.iter().map(|&c| clean(c)).collect(),
                weights: weights.iter().map(|&w| clean(w)).collect(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reversal::Channel;
    use Channel::{C1A, C1B, C2A, C2B};

    fn forms(channels: &[Channel]) -> Vec<String> {
        let design = DMatrix::from_fn(channels.len(), 3, |r, c| match c {
            0 => channels[r].indicator_sign(),
            1 => f64::from(u8::from(channels[r].is_side_a())),
            _ => f64::from(u8::from(!channels[r].is_side_a())),
        });
        determined(&design, &[1, 2])
            .iter()
            .map(|c| {
                // The weights must give the coefficients: sums of a few multiples of 1/12.
                let given = nalgebra::RowDVector::from_row_slice(&c.weights) * &design;
                for (g, k) in given.iter().zip(&c.coefficients) {
                    assert!((g - k).abs() < 1e-14, "{channels:?} {c:?}");
                }
                c.name(&["M", "S_A", "S_B"])
            })
            .collect()
    }

    fn tilts(channels: &[Channel]) -> Vec<String> {
        let design = DMatrix::from_fn(channels.len(), 3, |r, c| match c {
            0 => channels[r].indicator_sign(),
            1 => channels[r].spindle_sign(),
            _ => channels[r].side_sign(),
        });
        determined(&design, &[])
            .iter()
            .map(|c| c.name(&["alpha", "beta", "gamma"]))
            .collect()
    }

    #[test]
    fn what_each_subset_determines() {
        assert_eq!(forms(&[C1A, C1B, C2A, C2B]), ["M", "S_A", "S_B"]);
        assert_eq!(tilts(&[C1A, C1B, C2A, C2B]), ["alpha", "beta", "gamma"]);
        assert_eq!(forms(&[C1A, C2B]), ["M + S_A/2 + S_B/2", "S_A/2 - S_B/2"]);
        assert_eq!(tilts(&[C1A, C2B]), ["alpha", "beta + gamma"]);
        assert_eq!(forms(&[C1A, C1B]), ["M + S_A/2 - S_B/2", "S_A/2 + S_B/2"]);
        assert_eq!(tilts(&[C1A, C1B]), ["alpha + gamma", "beta"]);
        assert_eq!(forms(&[C1A, C2A]), ["M", "S_A"]);
        assert_eq!(tilts(&[C1A, C2A]), ["alpha + beta", "gamma"]);
        assert_eq!(forms(&[C1B, C2A, C2B]), ["M", "S_A", "S_B"]);
        assert_eq!(tilts(&[C1B, C2A, C2B]), ["alpha", "beta", "gamma"]);
        assert_eq!(forms(&[C1B]), ["M - S_B"]);
        assert_eq!(tilts(&[C1B]), ["alpha - beta + gamma"]);
    }
}
