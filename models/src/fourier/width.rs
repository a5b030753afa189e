//! Straightness of workpiece and slide, peak to valley about the least-squares line, and how well it is
//! known.
//!
//! The workpiece is made of the orders kept; the slide is read point by point, P1 less the workpiece, so
//! that the noise of its points widens it. Both are told with what the noise adds on average and with the
//! interval of [`StraightnessError`], which allows for it.

use nalgebra::DVector;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use realfft::num_complex::Complex64;
use std::convert::Infallible;

use super::along::Along;
use super::result::Separation;
use super::separation::straightness;
use super::spectrum::{coefficients, profile};
use super::spread::Spread;
use crate::zone::{Judged, StraightnessError, straightness_error};

/// Draws of the errors: with both signs the standard deviation is known to 1/√(4·100), 5 %.
const DRAWS: u64 = 100;

/// How the noise of the readings comes into both profiles.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Errors {
    /// Covariance of the orders for unit noise.
    pub spread: Spread,
    /// What the mean of P1 passes into each order of the workpiece.
    pub through_first: Vec<Complex64>,
    /// Scans whose P1 is averaged for the slide.
    pub scans: usize,
    /// Variance of that average at each position, over that where all scans have it.
    pub weights: Vec<f64>,
    /// By how much P1 scatters from scan to scan, over the noise of a reading; 1 with one scan, which does
    /// not tell it.
    pub first: f64,
    /// Noise that is correlated along the scans.
    pub along: Option<Along>,
}

/// Variance of what P1 passes into the workpiece at most: the difference of two probes whose variances are
/// 1 on average is all of P1's then.
const ALL_OF_FIRST: f64 = 2.0;

impl Errors {
    /// An error of the workpiece and of the slide, for unit noise.
    fn draw(&self, random: &mut impl Rng, samples: usize) -> [Vec<f64>; 2] {
        let scans = self.scans as f64;
        let (passed, own) = self.of_first();
        let mut white = |variance: f64| -> Vec<f64> {
            let scale = (variance / scans).sqrt();
            let noise = match &self.along {
                Some(along) => along.draw(random, samples),
                None => (0..samples).map(|_| normal(random)).collect(),
            };
            let weights = noise.iter().zip(&self.weights);
            weights.map(|(e, w)| w.sqrt() * scale * e).collect()
        };
        let (first, alone) = (white(passed), white(own));
        let series = self.spread.draw(
            random,
            &coefficients(&first, self.through_first.len()),
            // Of a part of an order of the mean of n scans of N readings.
            |order| 0.5 * passed * self.of_order(order) / (scans * samples as f64),
            &self.through_first,
        );
        let workpiece = profile(&series, samples);
        let first = first.iter().zip(&alone).map(|(first, own)| first + own);
        let slide = first.zip(&workpiece).map(|(f, w)| f - w).collect();
        [workpiece, slide]
    }

    fn of_order(&self, order: usize) -> f64 {
        let along = self.along.as_ref();
        along.map_or(1.0, |along| along.of_order(order))
    }

    /// Variance of P1 that passes into the workpiece, and the rest: what makes P1 scatter more than the
    /// difference signal allows is of the slide.
    fn of_first(&self) -> (f64, f64) {
        let variance = self.first * self.first;
        let passed = variance.min(ALL_OF_FIRST);
        (passed, variance - passed)
    }

    /// Standard uncertainty of a point of the slide less its line beside that of the workpiece less its
    /// own, both µm: with c what P1 passes into an order, the covariance of P1 and the workpiece at a place
    /// is 2 Σ Re c σ²/(n N), n scans of N readings.
    pub fn slide_std(&self, sigma: f64, straightness_std: &[f64]) -> Vec<f64> {
        let of_mean = sigma * sigma / self.scans as f64;
        let samples = straightness_std.len() as f64;
        let (of_first, alone) = self.of_first();
        let passed: f64 = of_first * self.through_first.iter().map(|c| c.re).sum::<f64>();
        let first = of_first + alone;
        let less = of_mean * (first + 4.0 * passed) / samples;
        let at_places = straightness_std.iter().zip(&self.weights);
        let variance = |(u, weight): (&f64, &f64)| of_mean * first * weight - less + u * u;
        at_places.map(|at| variance(at).max(0.0).sqrt()).collect()
    }
}

impl Separation {
    /// Straightness of the workpiece, peak to valley about its least-squares line.
    pub fn workpiece_error(&self) -> StraightnessError {
        self.width(&self.workpiece, 0)
    }

    /// The same of the slide. Where it was read with much noise it is far too wide: see
    /// [`StraightnessError::widening`].
    pub fn slide_error(&self) -> StraightnessError {
        self.width(&self.slide, 1)
    }

    fn width(&self, found: &[f64], which: usize) -> StraightnessError {
        let straight = |profile: &[f64]| DVector::from_vec(straightness(&self.x, profile));
        let found = straight(found);
        let judged = Judged {
            deviations: found.add_scalar(-f64::midpoint(found.max(), found.min())),
            profile: &found,
            degrees: self.degrees_of_freedom,
            draws: DRAWS,
        };
        let zone = |profile: &DVector<f64>| {
            let rest = straight(profile.as_slice());
            Ok::<_, Infallible>(rest.max() - rest.min())
        };
        let draw = |random: &mut ChaCha8Rng| {
            let [workpiece, slide] = self.errors.draw(random, self.x.len());
            let drawn = if which == 0 { workpiece } else { slide };
            Ok(self.noise.0 * DVector::from_vec(drawn))
        };
        match straightness_error(&judged, zone, draw) {
            Ok(found) => found,
            Err(never) => match never {},
        }
    }
}

fn normal(random: &mut impl Rng) -> f64 {
    StandardNormal.sample(random)
}
