//! The line of a trace.

/// A line, its height told at some position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Where the height is taken, mm.
    pub center: f64,
    /// Height there, µm.
    pub mean: f64,
    /// Slope, µm/mm.
    pub slope: f64,
}

impl Line {
    /// The least-squares line of points with weights; `None` where all positions are equal or there is none.
    pub fn fit(x: &[f64], y: &[f64], weight: &[f64]) -> Option<Self> {
        let points = || x.iter().zip(y).zip(weight).map(|((&x, &y), &w)| (x, y, w));
        let total = weight.iter().sum::<f64>();
        let center = points().map(|(x, _, w)| w * x).sum::<f64>() / total;
        let mean = points().map(|(_, y, w)| w * y).sum::<f64>() / total;
        let (product, spread) = points().fold((0.0, 0.0), |(product, spread), (x, y, w)| {
            let d = x - center;
            (product + w * d * (y - mean), spread + w * d * d)
        });
        (spread > 0.0).then(|| Self {
            center,
            mean,
            slope: product / spread,
        })
    }

    /// Height at a position, µm.
    pub fn at(&self, x: f64) -> f64 {
        self.mean + self.slope * (x - self.center)
    }
}
