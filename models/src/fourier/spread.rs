//! Uncertainty of orders, profile and straightness from the noise of the readings.

use super::along::Along;
use super::group::Group;
use super::joint::ShiftTerm;
use super::spectrum::{coefficients, profile};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use realfft::num_complex::Complex64;
use std::f64::consts::TAU;

/// Covariance of the coefficients of orders 1, 2, … for unit noise of a reading: each part of each
/// order by itself, and what acts on all orders together.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Spread {
    /// Variance of the real and of the imaginary part of an order with the steps known.
    own: Vec<f64>,
    /// Outer products that are added: weight and response of the orders.
    shared: Vec<(f64, Vec<Complex64>)>,
}

/// Variance of the real part, of the imaginary part, and their covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PartVariance {
    pub real: f64,
    pub imaginary: f64,
    pub covariance: f64,
}

impl Spread {
    /// With the steps known exactly.
    pub fn new(own: Vec<f64>) -> Self {
        Self {
            own,
            shared: Vec::new(),
        }
    }

    /// The same under noise that is correlated along the scans: `of_shared` is how many times as great it makes what acts on all
    /// orders together.
    pub fn under(&mut self, along: &Along, of_shared: f64) {
        for (place, own) in self.own.iter_mut().enumerate() {
            *own *= along.of_order(place + 1);
        }
        for (weight, _) in &mut self.shared {
            *weight *= of_shared;
        }
    }

    /// Adds a multiple of the outer product of a response with itself.
    pub fn add(&mut self, weight: f64, response: Vec<Complex64>) {
        self.shared.push((weight, response));
    }

    /// Adds a step that is the weighted sum of a few readings. Such a reading acts twice: through the
    /// step, `−weight · through`, and directly as part of the difference signal, `direct`; the direct
    /// part alone is in the variance of the orders already.
    pub fn add_readings(
        &mut self,
        group: &Group,
        terms: &[ShiftTerm],
        share: &[Complex64],
        through: &[Complex64],
    ) {
        let n = group.samples;
        let per_reading = 1.0 / group.repeats();
        for term in terms {
            let third = group.third_from.is_some_and(|from| term.index >= from);
            let sign = match (term.probe, third) {
                _ if term.index >= n => 0.0,
                (1, _) => 1.0,
                (2, false) | (3, true) => -1.0,
                _ => 0.0,
            };
            let direct: Vec<Complex64> = share
                .iter()
                .zip(1usize..)
                .map(|(share, order)| {
                    let turns = (order * term.index % n) as f64 / n as f64;
                    share * Complex64::from_polar(sign / n as f64, -TAU * turns)
                })
                .collect();
            let both = direct
                .iter()
                .zip(through)
                .map(|(d, r)| d - term.weight * r)
                .collect();
            self.add(per_reading, both);
            self.add(-per_reading, direct);
        }
    }

    /// An error of the coefficients for unit noise of a reading, given that of P1: `first` has the
    /// coefficients of the mean noise of P1, orders 0, 1, …, each part of the variance `variance` of its order, and
    /// `through` what of it passes into each order of the profile.
    ///
    /// What readings at a joint do to several orders at once is drawn apart from P1, and what they add
    /// less (the negative outer products) left out: a share of 1/N of an order's own variance.
    pub fn draw(
        &self,
        random: &mut impl Rng,
        first: &[Complex64],
        variance: impl Fn(usize) -> f64,
        through: &[Complex64],
    ) -> Vec<Complex64> {
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let mut series = vec![Complex64::default()];
        let parts = self.own.iter().zip(first.iter().skip(1)).zip(through);
        for (place, ((own, of_first), passed)) in parts.enumerate() {
            let rest = (own - passed.norm_sqr() * variance(place + 1))
                .max(0.0)
                .sqrt();
            series.push(passed * of_first + rest * Complex64::new(normal(), normal()));
        }
        for (weight, response) in self.shared.iter().filter(|(weight, _)| *weight > 0.0) {
            let amount = weight.sqrt() * normal();
            for (sum, value) in series.iter_mut().skip(1).zip(response) {
                *sum += amount * value;
            }
        }
        series
    }

    /// Of the order at a place, from 0 for order 1.
    pub fn order(&self, place: usize) -> PartVariance {
        let own = self.own.get(place).copied().unwrap_or(0.0);
        let mut sum = PartVariance {
            real: own,
            imaginary: own,
            covariance: 0.0,
        };
        for (weight, response) in &self.shared {
            let r = response.get(place).copied().unwrap_or_default();
            sum.real += weight * r.re * r.re;
            sum.imaginary += weight * r.im * r.im;
            sum.covariance += weight * r.re * r.im;
        }
        sum.real = sum.real.max(0.0);
        sum.imaginary = sum.imaginary.max(0.0);
        sum
    }

    /// Standard uncertainty at each of `samples` positions, of the profile and of the profile less its
    /// least-squares line.
    pub fn profiles(&self, samples: usize) -> (Vec<f64>, Vec<f64>) {
        let n = samples as f64;
        // A profile is Σ 2 Re F e^{jωθ}: four times the variance of a part, at every position.
        let level: f64 = self.own.iter().map(|v| 4.0 * v).sum();
        let arm: Vec<f64> = (0..samples).map(|k| k as f64 - 0.5 * (n - 1.0)).collect();
        let square: f64 = arm.iter().map(|t| t * t).sum();
        // The line of a wave of order ω has the slope n τ_ω/Σ t², τ the spectrum of the arm t. With
        // Var = v (1 − 2 t slope·wave + t² slope²) summed over cosine and sine of each order:
        let tau = coefficients(&arm, self.own.len());
        let mut crossed = vec![Complex64::default()];
        let mut slope_variance = 0.0;
        for (own, tau) in self.own.iter().zip(tau.iter().skip(1)) {
            crossed.push(2.0 * own * tau);
            slope_variance += 4.0 * own * tau.norm_sqr();
        }
        let crossed = profile(&crossed, samples);
        let rate = if square > 0.0 { n / square } else { 0.0 };
        let mut whole = vec![level; samples];
        let mut straight: Vec<f64> = arm
            .iter()
            .zip(&crossed)
            .map(|(t, c)| level - 2.0 * t * rate * c + (t * rate).powi(2) * slope_variance)
            .collect();
        for (weight, response) in &self.shared {
            let mut series = vec![Complex64::default()];
            series.extend(response);
            let shape = profile(&series, samples);
            let slope = if square > 0.0 {
                arm.iter().zip(&shape).map(|(t, s)| t * s).sum::<f64>() / square
            } else {
                0.0
            };
            for (((v, u), s), t) in whole.iter_mut().zip(&mut straight).zip(&shape).zip(&arm) {
                *v += weight * s * s;
                *u += weight * (s - slope * t).powi(2);
            }
        }
        let root = |variances: Vec<f64>| variances.into_iter().map(|v| v.max(0.0).sqrt()).collect();
        (root(whole), root(straight))
    }
}
