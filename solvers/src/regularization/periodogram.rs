//! The normalised cumulative periodogram: λ for which the residuals look most like white noise.

use nalgebra::DVector;
use realfft::RealFftPlanner;

use super::search::logarithmic_grid;
use super::{RegularizationError, Spectrum};

/// The choice of the normalised cumulative periodogram.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Periodogram {
    /// λ of the whitest residuals.
    pub lambda: f64,
    /// Largest distance of their cumulative periodogram from the straight line of white noise.
    pub distance: f64,
    /// Whether that distance stays within the Kolmogorov–Smirnov limit of white noise at 5 %.
    pub white: bool,
}

/// λ whose residuals are nearest to white noise (Hansen, Kilmer and Kjeldsen 2006).
///
/// The residuals must stand in their natural order, along the path or in time. The grid's λ are
/// compared by the mean distance, which is smoother than the largest one.
///
/// # Errors
/// Fewer than eight residuals, or no range of λ.
pub fn periodogram(spectrum: &Spectrum<'_>) -> Result<Periodogram, RegularizationError> {
    use super::Family;
    let (smallest, largest) = spectrum.range();
    if spectrum.row_count() < 8 {
        return Err(RegularizationError::Shape {
            what: "the residual vector",
            expected: 8,
            found: spectrum.row_count(),
        });
    }
    if !(smallest > 0.0 && smallest < largest) {
        return Err(RegularizationError::NothingToChoose);
    }
    let grid: Vec<(f64, f64, f64)> = logarithmic_grid(smallest, largest, GRID)
        .into_iter()
        .map(|lambda| {
            let (mean, maximum) = distances(&spectrum.residuals(lambda)?);
            Ok((lambda, mean, maximum))
        })
        .collect::<Result<_, RegularizationError>>()?;
    let limit = 1.36 / ((spectrum.row_count() / 2) as f64).sqrt();
    // The first dip below the limit coming from the smooth side: further down the residuals are
    // what is left of overfitted noise, which can look white again.
    let dip = (1..grid.len() - 1).rev().find(|index| {
        let mean = |index: usize| grid[index].1;
        grid[*index].2 <= limit && mean(*index) <= mean(index + 1) && mean(*index) < mean(index - 1)
    });
    let chosen = match dip {
        Some(index) => grid[index],
        None => grid
            .into_iter()
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .ok_or(RegularizationError::NothingToChoose)?,
    };
    Ok(Periodogram {
        lambda: chosen.0,
        distance: chosen.2,
        white: chosen.2 <= limit,
    })
}

/// Largest distance of a series' cumulative periodogram from that of white noise: 0 for perfectly
/// even power, towards 1 when all of it sits in one frequency.
pub fn whiteness_distance(series: &DVector<f64>) -> f64 {
    distances(series).1
}

/// Mean and largest distance from the line of even power, the zero frequency left out.
fn distances(series: &DVector<f64>) -> (f64, f64) {
    let mut input: Vec<f64> = series.iter().copied().collect();
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(input.len());
    let mut output = transform.make_output_vec();
    if transform.process(&mut input, &mut output).is_err() {
        return (1.0, 1.0);
    }
    let powers: Vec<f64> = output.iter().skip(1).map(|c| c.norm_sqr()).collect();
    let total: f64 = powers.iter().sum();
    if total <= 0.0 || powers.is_empty() {
        return (1.0, 1.0);
    }
    let count = powers.len() as f64;
    let (mut cumulative, mut sum, mut largest) = (0.0, 0.0, 0.0_f64);
    for (index, power) in powers.iter().enumerate() {
        cumulative += power / total;
        let distance = (cumulative - (index + 1) as f64 / count).abs();
        sum += distance;
        largest = largest.max(distance);
    }
    (sum / count, largest)
}

const GRID: usize = 100;
