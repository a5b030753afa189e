//! How a diagnosis is made.

/// How a diagnosis is made.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Probability of naming anything where nothing is there.
    pub false_alarm: f64,
    /// Draws behind every tail probability.
    pub draws: usize,
    /// Seed of the draws.
    pub seed: u64,
    /// Effects to leave out of the catalogue.
    pub without: Vec<String>,
    /// Most rivals drawn from each family for the severity of a name; none: it is left out.
    pub severity: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            false_alarm: 0.01,
            draws: 1000,
            seed: 1,
            without: Vec::new(),
            severity: 0,
        }
    }
}
