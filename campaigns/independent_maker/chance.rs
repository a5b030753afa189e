//! Random numbers, all of them drawn from the name and the seed of a case.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, StudentT};

/// The random numbers of one case.
pub struct Chance(ChaCha8Rng);

impl Chance {
    /// The numbers that belong to a name and a seed: the same on every machine.
    pub fn of(name: &str, seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(digest(name) ^ mixed(seed)))
    }

    /// Uniform between two limits.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// Uniform in the logarithm between two positive limits.
    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// Plus or minus one.
    pub fn sign(&mut self) -> f64 {
        if self.0.random::<bool>() { 1.0 } else { -1.0 }
    }

    /// A whole number below `n`.
    pub fn pick(&mut self, n: usize) -> usize {
        self.0.random_range(0..n)
    }

    /// Whether something of this probability happens.
    pub fn happens(&mut self, probability: f64) -> bool {
        self.between(0.0, 1.0) < probability
    }

    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Student's t of three degrees of freedom, scaled to a standard deviation of one.
    pub fn heavy(&mut self) -> f64 {
        StudentT::new(3.0).map_or(0.0, |law| law.sample(&mut self.0)) / 3.0_f64.sqrt()
    }

    /// A number from which an effect makes what differs from trace to trace.
    pub fn lot(&mut self) -> u64 {
        self.0.random()
    }
}

/// Uniform in 0 … 1, the same for the same lot and number.
pub fn share(lot: u64, number: u64) -> f64 {
    #[allow(clippy::cast_precision_loss)] // 53 bits are kept.
    let share = (mixed(lot ^ mixed(number)) >> 11) as f64;
    share / 9_007_199_254_740_992.0
}

/// FNV-1a.
fn digest(name: &str) -> u64 {
    name.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// The finaliser of SplitMix64.
fn mixed(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
