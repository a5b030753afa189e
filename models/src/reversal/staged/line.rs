//! The weighted least-squares line of a profile, and what removing it does to the noise.

/// A least-squares line, centred on the mean position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Weighted mean position, mm.
    pub center: f64,
    /// Height at the mean position, µm.
    pub mean: f64,
    /// Slope, µm/mm.
    pub slope: f64,
    /// Σ w (x − center)², mm².
    pub spread: f64,
}

impl Line {
    /// The line of points with weights; `None` where all positions are equal or there is none.
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
            spread,
        })
    }

    /// The line of points of equal weight.
    pub fn fit_equal(x: &[f64], y: &[f64]) -> Option<Self> {
        Self::fit(x, y, &vec![1.0; x.len()])
    }

    /// Height at a position, µm.
    pub fn at(&self, x: f64) -> f64 {
        self.mean + self.slope * (x - self.center)
    }
}

/// Removes the least-squares line (equal weights) in place.
pub fn remove_line(x: &[f64], y: &mut [f64]) {
    if let Some(line) = Line::fit_equal(x, y) {
        for (x, y) in x.iter().zip(y) {
            *y -= line.at(*x);
        }
    }
}

/// The variances of a profile of independent values after its least-squares line was removed.
///
/// With the hat matrix H of the line, var((I − H) y)ₖ = vₖ (1 − 2 Hₖₖ) + Σⱼ Hₖⱼ² vⱼ; the sum is
/// quadratic in xₖ − x̄, so that the cost is linear.
pub fn variances_without_line(x: &[f64], variance: &[f64]) -> Vec<f64> {
    let n = x.len() as f64;
    let center = x.iter().sum::<f64>() / n;
    let spread = x.iter().map(|x| (x - center).powi(2)).sum::<f64>();
    if spread <= 0.0 {
        return variance.to_vec();
    }
    let (mut v0, mut v1, mut v2) = (0.0, 0.0, 0.0);
    for (x, v) in x.iter().zip(variance) {
        let d = x - center;
        v0 += v / (n * n);
        v1 += 2.0 * v * d / (n * spread);
        v2 += v * d * d / (spread * spread);
    }
    x.iter()
        .zip(variance)
        .map(|(x, v)| {
            let d = x - center;
            let hat = 1.0 / n + d * d / spread;
            (v * (1.0 - 2.0 * hat) + v0 + v1 * d + v2 * d * d).max(0.0)
        })
        .collect()
}
