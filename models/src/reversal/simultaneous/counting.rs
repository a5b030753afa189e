//! What every reading counts for in a combination of unknowns.

use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::Parameters;

use super::problem::Reversal;

/// The covariances of a combination of unknowns with those of band and border.
pub type Shared = (Vec<f64>, Vec<f64>);

impl Reversal<'_> {
    /// J z for the covariances z of each combination with all unknowns, J in units of the readings' standard
    /// deviations: by combination and channel, in the order of the channel's sorted readings.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    pub fn counting(
        &self,
        at: &Parameters,
        combinations: &[Shared],
    ) -> Result<Vec<Vec<Vec<f64>>>, NoValue> {
        let nothing: Vec<Vec<f64>> = self.channels.iter().map(|c| vec![0.0; c.len()]).collect();
        let mut counting = vec![nothing; combinations.len()];
        let mut factors = Vec::new();
        self.for_each_batch(at, |channel, first, columns, shares, rows| {
            for ((band, border), counting) in combinations.iter().zip(&mut counting) {
                factors.clear();
                factors.resize(rows.columns() - 1, 0.0);
                for (factor, unknown) in factors.iter_mut().zip(columns) {
                    *factor = unknown.map_or(0.0, |j| band[j]);
                }
                for share in shares {
                    factors[share.column as usize] += share.weight * border[share.unknown as usize];
                }
                let own = &mut counting[channel][first..first + rows.rows()];
                for (k, factor) in factors.iter().enumerate() {
                    for (sum, value) in own.iter_mut().zip(rows.column(k)) {
                        *sum += factor * value;
                    }
                }
            }
        })?;
        Ok(counting)
    }
}
