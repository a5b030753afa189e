//! The covariance matrix of what a solution names.

use super::solution::Simultaneous;

/// Variances and covariances of named quantities.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariances {
    /// Names: of tilts as they are, of effects with their parameter, `taper.half-angle`.
    pub names: Vec<String>,
    /// Their units.
    pub units: Vec<&'static str>,
    /// Row by row, in the products of these units.
    pub matrix: Vec<Vec<f64>>,
}

impl Simultaneous {
    /// The covariance matrix of the tilts, or of the combinations that the channels determine, and of the
    /// parameters of the effects whose uncertainty is that of the fit.
    ///
    /// Of two quantities over their standard uncertainties, a and b, it is (var(a + b) − var(a − b))/4: the
    /// law of the noise is asked for variances only.
    pub fn covariances(&self) -> Covariances {
        let tilts = self.tilt_combinations().into_iter();
        let mut all: Vec<(String, &'static str, Vec<f64>)> = tilts
            .map(|(name, combination)| (name, "rad", self.tilt_weights(&combination)))
            .collect();
        for effect in &self.effects {
            for parameter in &effect.parameters {
                if let Some(weights) = &parameter.weights {
                    let name = format!("{}.{}", effect.effect, parameter.name);
                    all.push((name, parameter.unit, weights.clone()));
                }
            }
        }
        let std = |weights: &[f64]| self.border_combination(weights).0.std;
        let stds: Vec<f64> = all.iter().map(|(_, _, weights)| std(weights)).collect();
        let combined = |i: usize, j: usize, sign: f64| {
            let pairs = all[i].2.iter().zip(&all[j].2);
            let weights: Vec<f64> = pairs
                .map(|(a, b)| a / stds[i] + sign * b / stds[j])
                .collect();
            std(&weights).powi(2)
        };
        let count = all.len();
        let mut matrix = vec![vec![0.0; count]; count];
        for i in 0..count {
            matrix[i][i] = stds[i] * stds[i];
            for j in (0..i).filter(|j| stds[i] > 0.0 && stds[*j] > 0.0) {
                let correlation = (combined(i, j, 1.0) - combined(i, j, -1.0)) / 4.0;
                matrix[i][j] = correlation * stds[i] * stds[j];
                matrix[j][i] = matrix[i][j];
            }
        }
        Covariances {
            names: all.iter().map(|(name, _, _)| name.clone()).collect(),
            units: all.iter().map(|(_, unit, _)| *unit).collect(),
            matrix,
        }
    }
}
