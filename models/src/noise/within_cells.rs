//! What readings tell beside the means of the cells into which they are gathered.

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::law::Law;
use super::posterior::Posterior;

/// Means of cells that differ more than this often by chance, readings being independent, are no sign that these are not.
const BY_CHANCE: f64 = 1e-3;

/// How readings scatter about the means of their cells.
#[derive(Debug, Clone, Copy, Default)]
pub struct WithinCells {
    squares: f64,
    /// Of neighbours.
    products: f64,
    pairs: f64,
    readings: f64,
    cells: f64,
    /// Lengths of the cells, from the first to the last reading.
    travel: f64,
}

impl WithinCells {
    /// Adds the values of a cell in the order of their positions, of which the first and the last lie so far apart.
    pub fn add(&mut self, travel: f64, values: impl Iterator<Item = f64> + Clone) {
        let (sum, count) = values
            .clone()
            .fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
        let mut before = None;
        for value in values {
            let own = value - sum / count;
            self.squares += own * own;
            if let Some(before) = before.replace(own) {
                self.products += own * before;
                self.pairs += 1.0;
            }
        }
        self.readings += count;
        self.cells += 1.0;
        self.travel += travel;
    }

    /// Adds those of others.
    pub fn extend(&mut self, other: &Self) {
        self.squares += other.squares;
        self.products += other.products;
        self.pairs += other.pairs;
        self.readings += other.readings;
        self.cells += other.cells;
        self.travel += other.travel;
    }

    /// Readings of a cell, on average.
    pub fn readings_a_cell(&self) -> f64 {
        self.readings / self.cells.max(1.0)
    }

    /// Variance of a reading beside what goes on from cell to cell; `means`: the law of the means of the cells.
    pub fn variance_of_a_reading(&self, means: &Law) -> f64 {
        self.squares / self.readings.max(1.0) + means.white
    }

    /// How many times as great as of independent readings the white part of the means is.
    fn excess(&self, means: &Law) -> f64 {
        self.readings_a_cell() * means.white / self.variance_of_a_reading(means)
    }

    /// Whether means of cells, of which so much is known, scatter by more than independent readings would have them.
    pub fn are_correlated(&self, means: &Posterior) -> bool {
        let freedom = (means.count(), self.readings - self.cells);
        let law = FisherSnedecor::new(freedom.0, freedom.1.max(1.0));
        freedom.1 > 1.0 && law.is_ok_and(|law| law.sf(self.excess(&means.mean())) < BY_CHANCE)
    }

    /// The law of the readings, where that of the means is so: with one correlated part, within cells where that shows and adds
    /// more to the variance of long means than what goes on from cell to cell.
    ///
    /// Of readings of variance s = w + o at steps over which the part o has the correlation ρ the mean of n ≫ 1/(1 − ρ) has the
    /// variance (s + 2oρ/(1 − ρ))/n, and neighbours have the covariance oρ.
    pub fn law(&self, posterior: &Posterior) -> Law {
        let means = posterior.mean();
        let independent = Law {
            white: self.readings_a_cell() * means.white,
            ..means
        };
        if !self.are_correlated(posterior) {
            return independent;
        }
        let white = self.variance_of_a_reading(&means);
        let more = self.excess(&means) - 1.0;
        // Beside their mean neighbours have that covariance less its variance.
        let neighbours = self.products / self.pairs.max(1.0) + means.white;
        let apart = 2.0 * neighbours / (white * more);
        let (correlation, correlated) = if apart > 0.0 && neighbours < (1.0 - apart) * white {
            (1.0 - apart, neighbours / (1.0 - apart))
        } else {
            (more / (more + 2.0), white)
        };
        let length = self.travel / self.pairs.max(1.0) / -correlation.ln();
        if posterior.is_correlated() && means.correlated * means.length > correlated * length {
            return Law { white, ..means };
        }
        Law {
            white: white - correlated,
            correlated,
            length,
            ..means
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::WithoutLines;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// 400 cells of 50 readings each.
    fn gathered(law: &Law, seed: u64) -> (WithinCells, Posterior) {
        let x: Vec<f64> = (0..20_000).map(|k| 0.015 * f64::from(k)).collect();
        let mut noise = vec![0.0; x.len()];
        law.draw(&x, &mut ChaCha8Rng::seed_from_u64(seed), &mut noise);
        let (mut within, mut places, mut means) = (WithinCells::default(), vec![], vec![]);
        for (x, cell) in x.chunks(50).zip(noise.chunks(50)) {
            within.add(x[49] - x[0], cell.iter().copied());
            places.push(0.5 * (x[0] + x[49]));
            means.push(cell.iter().sum::<f64>() / 50.0);
        }
        let mut values = WithoutLines::default();
        values.add(&places, means);
        (within, Posterior::of(&values).unwrap())
    }

    /// *Simulated truth*: a sensor's filter makes neighbours alike; the law of its readings is found from within the cells.
    #[test]
    fn noise_of_less_than_a_cell_is_told() {
        let law = Law {
            correlated: 0.5,
            length: 0.1,
            ..Law::of_white(0.5)
        };
        let mut told = 0;
        for seed in 0..20 {
            let (within, posterior) = gathered(&law, seed);
            assert!(within.are_correlated(&posterior));
            let found = within.law(&posterior);
            // k·u: of 20 000 readings with some 2000 independent ones the variance is known to 3 %, of 400 means the excess to
            // 8 %; four of them and what is left out of cells of 50 readings.
            assert!((found.of_readings() - 1.0).abs() < 0.15, "{found:?}");
            let along = found.correlated * found.length;
            told += usize::from((along / 0.05 - 1.0).abs() < 0.4);
        }
        // One row of means may be correlated by chance, beyond its cells: at even odds less than a quarter of the time, and
        // twelve of 20 have a probability of 10⁻³ then.
        assert!(told >= 9, "{told}");
    }

    /// *Simulated truth*: of 200 sets of independent readings fewer than five pass for correlated.
    #[test]
    fn independent_readings_are_independent() {
        let told = (0..200).filter(|seed| {
            let (within, posterior) = gathered(&Law::of_white(1.0), *seed);
            within.are_correlated(&posterior)
        });
        // Binomial: at one in a thousand five of 200 have a probability of 2·10⁻⁶.
        assert!(told.count() < 5);
    }
}
