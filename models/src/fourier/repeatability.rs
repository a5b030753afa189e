//! Figures of merit of profiles and spectra.

use realfft::num_complex::Complex64;

/// U_sp, equation (29), µm: root mean square over repeats and positions of the deviation from the
/// mean profile. The sum is divided by M as in the paper, not by M − 1.
pub fn repeatability(profiles: &[Vec<f64>]) -> Option<f64> {
    let first = profiles.first()?;
    let (repeats, samples) = (profiles.len(), first.len());
    if repeats < 2 || samples == 0 || profiles.iter().any(|p| p.len() != samples) {
        return None;
    }
    let mut sum = 0.0;
    for k in 0..samples {
        let mean = profiles.iter().map(|p| p[k]).sum::<f64>() / repeats as f64;
        sum += profiles.iter().map(|p| (p[k] - mean).powi(2)).sum::<f64>();
    }
    Some((sum / (repeats * samples) as f64).sqrt())
}

/// d_sp, equation (21), µm: mean absolute deviation of two profiles.
pub fn mean_deviation(estimated: &[f64], actual: &[f64]) -> f64 {
    let count = estimated.len().min(actual.len()).max(1);
    let sum: f64 = estimated
        .iter()
        .zip(actual)
        .map(|(a, b)| (a - b).abs())
        .sum();
    sum / count as f64
}

/// D_h, equation (22), µm: mean deviation of the peak amplitudes 2|F| of orders 1, 2, …; phases are
/// not seen. Both slices begin at order 1.
pub fn mean_harmonic_deviation(estimated: &[Complex64], actual: &[Complex64]) -> f64 {
    let count = estimated.len().min(actual.len()).max(1);
    let sum: f64 = estimated
        .iter()
        .zip(actual)
        .map(|(a, b)| 2.0 * (a.norm() - b.norm()).abs())
        .sum();
    sum / count as f64
}
